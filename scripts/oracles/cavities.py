"""Second opinions on certified intervals of unions that fill cavities: samples of both boundaries contradict none.

    cavities.py MEDIAL WORK [COUNT]      COUNT: number of random solids [200]

Each solid is a block with slots, pockets, tubes or closed cavities, 0.002 to 0.2 of its size wide. Balls, cones or slabs
fill it to different degrees. `medial evaluate --certify` must print an interval that holds, up to the spacing of the
samples, the Hausdorff distance between samples of the surface and samples of the union's boundary, and that is as narrow
as requested. Distances to primitives are computed here. Prints one line for each solid, in % of the diagonal, and a row of
the table of oracles. Needs NumPy and SciPy.
"""

import json
import subprocess
import sys
from itertools import product
from pathlib import Path

row = {"metric": "certified interval", "oracle": "samples of both boundaries", "input": "filled cavities"}
try:
    import numpy as np
    from scipy.spatial import cKDTree
except ImportError as error:
    print(json.dumps({**row, "result": str(error), "agrees": "skipped"}))
    sys.exit(0)

medial, work = sys.argv[1], Path(sys.argv[2])
count = int(sys.argv[3]) if len(sys.argv) > 3 else 200
SAMPLES, TOLERANCE, ROUNDING = 60_000, 0.002, 1e-9
rng = np.random.default_rng(5)
unit = lambda v: v / np.linalg.norm(v, axis=-1, keepdims=True)


def solid(size, width, kind):
    """Vertices and faces of a block without a cavity: cells of a grid, and the squares between them and the rest."""
    cuts = [[0.0, s] for s in size]
    low = 0.2 * size[2] if kind != "tube" else 0.0
    high = size[2] if kind != "closed" else 0.8 * size[2]
    spans = [[0.5 * size[0] - width / 2, 0.5 * size[0] + width / 2], [0.0, size[1]], [low, high]]
    if kind != "slot":
        spans[1] = [0.4 * size[1], 0.4 * size[1] + (width if kind == "tube" else 0.3 * size[1])]
    for axis in range(3):
        cuts[axis] = sorted({*cuts[axis], *spans[axis]})
    is_full = lambda cell: all(0 <= c < len(cuts[k]) - 1 for k, c in enumerate(cell)) and not all(
        spans[k][0] <= cuts[k][c] < spans[k][1] for k, c in enumerate(cell)
    )
    ids, faces = {}, []
    for cell in product(*(range(len(c) - 1) for c in cuts)):
        if not is_full(cell):
            continue
        for axis, side in product(range(3), (0, 1)):
            if is_full(tuple(c + (2 * side - 1) * (k == axis) for k, c in enumerate(cell))):
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            square = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = list(cell)
                corner[axis] += side
                corner[u] += a
                corner[v] += b
                square.append(ids.setdefault(tuple(corner), len(ids)))
            square = square if side else square[::-1]
            faces += [[square[0], square[1], square[2]], [square[0], square[2], square[3]]]
    return np.array([[cuts[k][c] for k, c in enumerate(corner)] for corner in ids]), np.array(faces)


def filling(size, kind):
    """Balls in the block, each as large as fits, times a factor; cones and slabs between near ones."""
    balls = []
    for _ in range(int(rng.integers(60, 400))):
        centre = rng.uniform(0, size)
        balls.append([*centre, min(centre.min(), (size - centre).min()) * rng.uniform(0.7, 1.03)])
    balls = np.array(balls)
    near = cKDTree(balls[:, :3]).query(balls[:, :3], 3)[1]
    faces = sorted({tuple(sorted(map(int, n))) for n in near if len(set(n)) == 3}) if kind == "slabs" else []
    edges = {tuple(sorted(map(int, n[:2]))) for n in near} if kind == "cones" else set()
    for a, b, c in faces:
        edges |= {(a, b), (a, c), (b, c)}
    return balls, sorted(edges), faces


class Union:
    def __init__(self, balls, edges, faces):
        self.balls, self.edges, self.faces = balls, edges, faces

    def to_cone(self, p, a, b):
        a, b = self.balls[a], self.balls[b]
        axis, growth = b[:3] - a[:3], b[3] - a[3]
        length = np.linalg.norm(axis)
        if length <= abs(growth):
            return np.full(len(p), np.inf)
        w = p - a[:3]
        along = w @ axis / length
        across = np.linalg.norm(w - along[:, None] * axis / length, axis=1)
        t = np.clip((along + across * growth / np.sqrt(length**2 - growth**2)) / length, 0, 1)
        return np.linalg.norm(w - t[:, None] * axis, axis=1) - (a[3] + t * growth)

    def planes(self, face):
        """Outward normals of the planes that touch three balls, and the gradient of the radius; None without any."""
        a, b, c = (self.balls[k] for k in face)
        u, v = b[:3] - a[:3], c[:3] - a[:3]
        normal = np.cross(u, v)
        if np.linalg.norm(normal) < 1e-9:
            return None
        gradient = np.linalg.solve(np.array([u, v, normal]), [b[3] - a[3], c[3] - a[3], 0.0])
        if gradient @ gradient >= 1:
            return None
        rise = np.sqrt(1 - gradient @ gradient) * normal / np.linalg.norm(normal)
        return rise - gradient, -rise - gradient, gradient

    def to_face(self, p, face):
        """Infinite where the nearest ball is on a side: the cones have these."""
        planes = self.planes(face)
        if planes is None:
            return np.full(len(p), np.inf)
        a, b, c = (self.balls[k] for k in face)
        normal = unit(np.cross(b[:3] - a[:3], c[:3] - a[:3]))
        gradient = planes[2]
        height = (p - a[:3]) @ normal
        q = p - height[:, None] * normal
        q = q + np.abs(height)[:, None] * gradient / np.sqrt(1 - gradient @ gradient)
        weights = np.linalg.lstsq(np.array([b[:3] - a[:3], c[:3] - a[:3]]).T, (q - a[:3]).T, rcond=None)[0].T
        inside = (weights >= 0).all(1) & (weights.sum(1) <= 1)
        radius = a[3] + weights @ [b[3] - a[3], c[3] - a[3]]
        return np.where(inside, np.linalg.norm(p - q, axis=1) - radius, np.inf)

    def signed(self, p):
        """The least signed distance to a primitive."""
        best = np.full(len(p), np.inf)
        for k in range(0, len(p), 8192):
            q = p[k : k + 8192]
            square = (q**2).sum(1)[:, None] - 2 * q @ self.balls[:, :3].T + (self.balls[:, :3] ** 2).sum(1)
            best[k : k + 8192] = (np.sqrt(np.maximum(square, 0)) - self.balls[:, 3]).min(1)
        for primitive in [*self.edges, *self.faces]:
            balls = self.balls[list(primitive)]
            low, high = balls[:, :3].min(0), balls[:, :3].max(0)
            # Any other point is nearer to a ball than to this primitive.
            to_box = np.linalg.norm(np.maximum(np.maximum(low - p, p - high), 0), axis=1)
            near = np.flatnonzero(to_box - balls[:, 3].max() < best)
            q = p[near]
            found = self.to_cone(q, *primitive) if len(primitive) == 2 else self.to_face(q, primitive)
            best[near] = np.minimum(best[near], found)
        return best

    def boundary(self):
        """Samples of the primitives' surfaces that are in no primitive."""
        area = self.balls[:, 3] ** 2 * 4 * np.pi
        parts = []
        for ball, share in zip(self.balls, area / area.sum()):
            parts.append(ball[:3] + ball[3] * unit(rng.normal(size=(int(share * SAMPLES) + 200, 3))))
        for a, b in self.edges:
            a, b = self.balls[a], self.balls[b]
            axis = b[:3] - a[:3]
            slope = (b[3] - a[3]) / np.linalg.norm(axis)
            if abs(slope) < 1:
                t = rng.uniform(size=(600, 1))
                out = np.cross(axis, rng.normal(size=(600, 3)))
                normal = np.sqrt(1 - slope**2) * unit(out) - slope * unit(axis)
                parts.append(a[:3] + t * axis + (a[3] + t * (b[3] - a[3])) * normal)
        for face in self.faces:
            planes = self.planes(face)
            for normal in planes[:2] if planes else ():
                weights = rng.dirichlet([1, 1, 1], 400)
                corners = np.array([self.balls[k][:3] + self.balls[k][3] * normal for k in face])
                parts.append(weights @ corners)
        points = np.concatenate(parts)
        return points[self.signed(points) > -1e-6]


def surface_samples(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    on = np.concatenate([rng.choice(len(faces), SAMPLES, p=area / area.sum()), np.repeat(np.arange(len(faces)), 50)])
    weights = rng.dirichlet([1, 1, 1], len(on))
    return np.concatenate([points, sum(weights[:, [k]] * points[faces[on, k]] for k in range(3))])


failed = widest = 0
for number in range(count):
    kind, primitives = ("slot", "pocket", "tube", "closed")[number % 4], ("balls", "cones", "slabs")[number % 3]
    size = np.array([1.0, rng.uniform(0.6, 1), rng.uniform(0.5, 1)])
    width = 10 ** rng.uniform(np.log10(0.002), np.log10(0.2))
    points, faces = solid(size, width, kind)
    union = Union(*filling(size, primitives))
    mesh, axis = work / "cavity.off", work / "cavity.ma"
    with open(mesh, "w") as out:
        out.write(f"OFF\n{len(points)} {len(faces)} 0\n")
        out.writelines(f"{x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
        out.writelines(f"3 {a} {b} {c}\n" for a, b, c in faces.tolist())
    with open(axis, "w") as out:
        out.write(f"{len(union.balls)} {len(union.edges)} {len(union.faces)}\n")
        out.writelines(f"v {x!r} {y!r} {z!r} {r!r}\n" for x, y, z, r in union.balls.tolist())
        out.writelines(f"e {a} {b}\n" for a, b in union.edges)
        out.writelines(f"f {a} {b} {c}\n" for a, b, c in union.faces)
    words = [medial, "--json", "evaluate", mesh, axis, "--certify", TOLERANCE]
    answer = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if answer.returncode != 0:
        print(f"{number} {kind} {primitives}: {answer.stderr.strip()}", flush=True)
        failed += 1
        continue
    found = json.loads(answer.stdout)
    lower, upper = found["certified"]["lower"], found["certified"]["upper"]
    diagonal = np.linalg.norm(size)
    on_surface, on_boundary = surface_samples(points, faces), union.boundary()
    signed = union.signed(on_surface)
    to_boundary = np.where(signed >= 0, signed, cKDTree(on_boundary).query(on_surface)[0])
    to_surface = cKDTree(on_surface).query(on_boundary)[0]
    sampled = max(to_boundary.max(), to_surface.max()) / diagonal
    # Distance from a point of one boundary to the nearest sample of it, nearly the largest.
    spacing = max(
        np.quantile(cKDTree(s[::2]).query(s[1::2])[0], 0.999) for s in (on_surface, on_boundary)
    ) / diagonal
    held = lower <= sampled + spacing and sampled <= upper + spacing and found["hausdorff"] <= upper + ROUNDING
    held = held and found["hausdorff"] >= sampled - spacing and upper - lower <= TOLERANCE
    failed += not held
    widest = max(widest, upper - lower)
    values = (100 * width / diagonal, 100 * lower, 100 * sampled, 100 * found["hausdorff"], 100 * upper, 100 * spacing)
    print(f"{number:3} {kind:6} {primitives:5}", *(f"{v:9.4f}" for v in values), "held" if held else "NOT HELD", flush=True)
result = f"{count - failed} of {count} intervals hold, at most {100 * widest:.3f} % wide"
print(json.dumps({**row, "result": result, "agrees": "no" if failed else "yes"}))
sys.exit(1 if failed else 0)
