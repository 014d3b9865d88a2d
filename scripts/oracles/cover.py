"""Second opinions on certified one-sided errors: a million points of solid and spheres each contradict no interval.

    cover.py MEDIAL WORK SURFACE...      SURFACE: a file or builtin:ID

Makes seven sphere sets for each surface and compares `medial evaluate --certify 0.001` with points in the solid (half
of them on its boundary), points of the spheres outside all others, and points around the witnesses. Open3D decides
what is inside, in single precision. trimesh measures from the farthest points to the surface in double precision.
Prints one line for each set, in % of the diagonal, and a row of the table of oracles.
"""

import json
import subprocess
import sys
from pathlib import Path

row = {"metric": "uncovered, overshoot", "oracle": "Open3D, trimesh", "input": "sphere sets"}
try:
    import numpy as np
    import open3d as o3d
    import trimesh
except ImportError as error:
    print(json.dumps({**row, "result": str(error), "agrees": "skipped"}))
    sys.exit(0)

SETS = [("cover", 64, "outside"), ("cover", 32, "inside"), ("cover", 48, "balanced"), ("vmas", 40, ""), ("coverage-axis", 60, "")]
POINTS, SINGLE, DOUBLE = 1_000_000, 1e-6, 1e-9  # the latter bound rounding
medial, work, *surfaces = sys.argv[1:]
rng = np.random.default_rng(1)
directions = lambda count: (found := rng.normal(size=(count, 3))) / np.linalg.norm(found, axis=1)[:, None]


def run(*words):
    return subprocess.run([medial, "--json", *map(str, words)], capture_output=True, text=True, check=True).stdout


def to_spheres(points, balls):
    """The signed distance to the closest of the balls."""
    found = np.empty(len(points))
    for k in range(0, len(points), 4096):
        p = points[k : k + 4096, None]
        found[k : k + 4096] = (np.sqrt(sum((p[..., i] - balls[:, i]) ** 2 for i in range(3))) - balls[:, 3]).min(1)
    return found


def skin(balls):
    """Points of the spheres outside all others: half by area, half with all spheres alike."""
    parts, area = [], balls[:, 3] ** 2 / (balls[:, 3] ** 2).sum()
    while sum(map(len, parts)) < POINTS:
        on = np.concatenate([rng.choice(len(balls), POINTS // 10, p=area), rng.choice(len(balls), POINTS // 10)])
        points = balls[on, :3] + balls[on, 3:] * directions(len(on))
        parts.append(points[to_spheres(points, balls) > -DOUBLE])
    return np.concatenate(parts)[:POINTS]


class Solid:
    def __init__(self, file):
        mesh = trimesh.load(file, process=False)
        middle, self.size = mesh.bounds.mean(0), np.linalg.norm(mesh.extents)
        self.scaled = lambda points: (points - middle) / self.size
        self.mesh = trimesh.Trimesh(self.scaled(mesh.vertices), mesh.faces, process=False)
        self.scene = o3d.t.geometry.RaycastingScene()
        self.scene.add_triangles(self.mesh.vertices.astype(np.float32), self.mesh.faces.astype(np.uint32))
        parts, count = [self.mesh.vertices, trimesh.sample.sample_surface(self.mesh, POINTS // 2, seed=1)[0]], 0
        while count < POINTS // 2:
            points = self.mesh.bounds[0] + rng.random((POINTS, 3)) * self.mesh.extents
            points = points[self.height(points) < 0]
            parts.append(points[self.height(points, 9) < 0][: POINTS // 2 - count])  # One ray can pass through an edge.
            count += len(parts[-1])
        self.points = np.concatenate(parts)

    def height(self, points, rays=1):
        """The signed distance, positive outside."""
        return self.scene.compute_signed_distance(points.astype(np.float32), nsamples=rays).numpy().astype(float)

    def height_in_double(self, points):
        triangles = self.mesh.triangles
        every = [trimesh.triangles.closest_point(triangles, np.tile(p, (len(triangles), 1))) - p for p in points]
        return np.sign(self.height(points, 9)) * [np.linalg.norm(arm, axis=1).min() for arm in every]


def compare(solid, balls, found):
    """Largest distances by points and around the witnesses, and whether all agree with the intervals."""
    to_balls, agrees, values = lambda p: to_spheres(p, balls), True, []
    points = skin(balls)
    farthest = points[np.argsort(solid.height(points))[-50:]]
    for key, most, distance, rough, excess in [
        ("uncovered", to_balls(solid.points).max(), to_balls, to_balls, solid.height),
        ("overshoot", solid.height_in_double(farthest).max(), solid.height_in_double, solid.height, to_balls),
    ]:
        low, high, reached = found[key]["lower"], found[key]["upper"], 0.0
        if found[key].get("witness"):
            at = solid.scaled(np.array([found[key]["witness"]]))
            around = at + 1e-3 * rng.random((10_000, 1)) * directions(10_000)
            around = around[excess(around) <= 0]
            reached = distance(np.concatenate([at, around[np.argsort(rough(around))[-10:]]])).max()
            agrees &= reached >= low - DOUBLE and excess(at)[0] <= SINGLE
        agrees &= max(most, reached) <= high + SINGLE and high - low <= 1e-3 + DOUBLE
        values += [low, max(most, 0), reached, high]
    return values, agrees


count, failed, file, axis = 0, 0, Path(work, "cover.off"), Path(work, "cover.ma")
print(" " * 44, *(f"{k:>9}" for k in ("uncovered", "points", "witness", "upper", "overshoot", "points", "witness", "upper")))
for surface in surfaces:
    run(*(["datasets", "make", surface[8:], "-o"] if surface.startswith("builtin:") else ["convert", surface]), file)
    solid = Solid(file)
    for method, spheres, fit in SETS:
        options = ["--set", f"fit={fit}"] if fit else []
        run("simplify", file, "--method", method, "--spheres", spheres, *options, "-o", axis)
        balls = np.array([line.split()[1:5] for line in axis.read_text().splitlines() if line[0] == "v"], float)
        for grown in (0,) if fit else (0, 0.6):  # by a part of the gap: both errors remain
            balls[:, 3] += grown and grown * solid.size * found["uncovered"]["upper"]
            axis.write_text("\n".join([f"{len(balls)} 0 0"] + ["v {!r} {!r} {!r} {!r}".format(*ball) for ball in balls.tolist()]))
            found = json.loads(run("evaluate", file, axis, "--samples", 1000, "--certify", 0.001))["cover"]
            values, agrees = compare(solid, np.column_stack([solid.scaled(balls[:, :3]), balls[:, 3] / solid.size]), found)
            count, failed = count + 1, failed + (not agrees)
            label = f"{Path(surface).name}, {method} {fit} {'inflated' if grown else ''}"
            print(f"{label:44}", *(f"{100 * value:9.5f}" for value in values), "" if agrees else "DIFFERS", flush=True)
row |= {"input": f"{count} sphere sets", "result": f"{POINTS} points each: {failed} outside the certified intervals"}
print(json.dumps({**row, "agrees": "no" if failed else "yes"}))
