"""Second opinions on `medial evaluate`: the same numbers by other programs and other routes.

    metrics.py MESH.off AXIS.ma EVALUATION.json LABEL [DECIMATED.off BASELINE.json HAUSDORFF.txt]

Distances to triangles come from Open3D's RaycastingScene (single precision), Betti numbers from GUDHI,
Hausdorff bounds between surfaces from CGAL (HAUSDORFF.txt, by hausdorff_cgal), the union of primitives is
replaced by balls interpolated along them, and angles and spike measures are written down once more from
METHODOLOGY.md. Prints one JSON object for each comparison. Lengths are fractions of the diagonal.
"""

import json
import sys

import gudhi
import numpy as np
import open3d as o3d

mesh_file, axis_file, evaluation_file, label = sys.argv[1:5]
found = json.load(open(evaluation_file))
rng = np.random.default_rng(1)


def read_off(file):
    words = open(file).read().split()
    nv, nf = int(words[1]), int(words[2])
    vertices = np.array(words[4 : 4 + 3 * nv], float).reshape(-1, 3)
    faces = np.array(words[4 + 3 * nv : 4 + 3 * nv + 4 * nf], int).reshape(-1, 4)[:, 1:]
    return vertices, faces


vertices, faces = read_off(mesh_file)
low, high = vertices.min(0), vertices.max(0)
middle, size = (low + high) / 2, np.linalg.norm(high - low)
vertices = (vertices - middle) / size
spheres, edges, triangles = [], [], []
for line in open(axis_file):
    word, *rest = line.split() or ["#"]
    if word == "v":
        spheres.append([float(x) for x in rest[:4]])
    elif word == "e":
        edges.append(sorted(int(x) for x in rest[:2]))
    elif word == "f":
        triangles.append(sorted(int(x) for x in rest[:3]))
spheres = np.array(spheres)
centres, radii = (spheres[:, :3] - middle) / size, spheres[:, 3] / size
edges, triangles = np.array(edges).reshape(-1, 2), np.array(triangles, int).reshape(-1, 3)


def say(metric, oracle, result, agrees):
    row = {"metric": metric, "oracle": oracle, "input": label, "result": result,
           "agrees": "yes" if agrees else "no"}
    print(json.dumps(row), flush=True)


def scene_of(points, corners):
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(points.astype(np.float32)),
                        o3d.core.Tensor(corners.astype(np.uint32)))
    return scene


def distances(scene, points):
    return scene.compute_distance(o3d.core.Tensor(points.astype(np.float32))).numpy().astype(float)


def sample(points, corners, count):
    a, b, c = (points[corners[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    picked = rng.choice(len(corners), count, p=area / area.sum())
    root, v = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    return a[picked] * (1 - root) + b[picked] * (root * (1 - v)) + c[picked] * (root * v)


def balls():
    """Balls along all primitives, dense: their union is inside the exact one by at most the second
    power of the spacing over the radius."""
    at, r = [centres], [radii]
    t = np.linspace(0, 1, 65)[None, :, None]
    a, b = edges.T
    at.append((centres[a][:, None] * (1 - t) + centres[b][:, None] * t).reshape(-1, 3))
    r.append((radii[a][:, None] * (1 - t[..., 0]) + radii[b][:, None] * t[..., 0]).ravel())
    n = 24
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    if len(triangles):
        at.append(np.einsum("wk,fkx->fwx", weights, centres[triangles]).reshape(-1, 3))
        r.append(np.einsum("wk,fk->fw", weights, radii[triangles]).ravel())
    return np.concatenate(at), np.concatenate(r)


ball_at, ball_r = balls()


def signed(points, at=ball_at, r=ball_r):
    least = np.empty(len(points))
    square = (at**2).sum(1)
    for k in range(0, len(points), 64):
        p = points[k : k + 64]
        d2 = (p**2).sum(1)[:, None] + square[None] - 2 * p @ at.T
        least[k : k + 64] = (np.sqrt(np.maximum(d2, 0)) - r[None]).min(1)
    return least


def onto_union(points):
    closest = np.empty(len(points), int)
    square = (ball_at**2).sum(1)
    for k in range(0, len(points), 64):
        p = points[k : k + 64]
        d2 = (p**2).sum(1)[:, None] + square[None] - 2 * p @ ball_at.T
        closest[k : k + 64] = (np.sqrt(np.maximum(d2, 0)) - ball_r[None]).argmin(1)
    arm = points - ball_at[closest]
    return ball_at[closest] + ball_r[closest][:, None] * arm / np.linalg.norm(arm, axis=1)[:, None]


surface = sample(vertices, faces, 6000)
sigma = np.abs(signed(surface))
for key, theirs in [("mean", sigma.mean()), ("rms", np.sqrt((sigma**2).mean())),
                    ("p95", np.quantile(sigma, 0.95)), ("p99", np.quantile(sigma, 0.99))]:
    off = abs(theirs / found[key] - 1)
    say(key, "NumPy, balls along the primitives, own samples", f"{off:.1%} apart", off < 0.06)
at_vertices = np.abs(signed(vertices[rng.permutation(len(vertices))[:6000]])).max()
theirs = max(sigma.max(), at_vertices)
say("epsilon_union", "NumPy, the same", f"{theirs:.5f} by fewer samples, {found['epsilon_union']:.5f}",
    theirs <= found["epsilon_union"] + 2e-3 and theirs >= 0.8 * found["epsilon_union"])
theirs = np.abs(signed(np.vstack((surface, vertices)), centres, radii)).max()
say("spheres_only", "NumPy, all vertices and fewer samples", f"{theirs:.5f}, {found['spheres_only']:.5f}",
    0.8 * found["spheres_only"] <= theirs <= 1.02 * found["spheres_only"])

# The boundary of the union: the point of it that is closest to a point outside is on the ball closest to that.
# Points outside are taken from random directions and heights over the balls. Both maxima are over samples, and
# fall short where the farthest point is the tip of a small ball; the certified interval below may not be left.
scene = scene_of(vertices, faces)
# Half of them by area, half with all balls alike, for the tips of small ones.
picked = np.concatenate((rng.choice(len(ball_at), 15000, p=ball_r**2 / (ball_r**2).sum()),
                         rng.choice(len(ball_at), 15000)))
direction = rng.normal(size=(30000, 3))
direction /= np.linalg.norm(direction, axis=1)[:, None]
above = ball_at[picked] + (ball_r[picked] + 0.1 * rng.random(30000) ** 2)[:, None] * direction
above = above[signed(above) > 0]
candidates = onto_union(above)
theirs = distances(scene, candidates).max()
say("reverse", "Open3D distances, own points on the union",
    f"{theirs:.5f} by {len(candidates)} points, {found['reverse']:.5f}",
    0.8 * found["reverse"] <= theirs <= found["reverse"] + 1e-3)
if found.get("certified"):
    both = max(theirs, sigma.max(), at_vertices)
    low_, high_ = found["certified"]["lower"], found["certified"]["upper"]
    say("certified interval", "the larger of the two above", f"{both:.5f}, interval {low_:.5f} to {high_:.5f}",
        0.8 * low_ <= both <= high_ + 1e-4)

# Volume of the symmetric difference.
box_low, box_high = (np.minimum(vertices.min(0), (ball_at - ball_r[:, None]).min(0)),
                     np.maximum(vertices.max(0), (ball_at + ball_r[:, None]).max(0)))
points = box_low + rng.random((8000, 3)) * (box_high - box_low)
in_solid = scene.compute_occupancy(o3d.core.Tensor(points.astype(np.float32))).numpy() > 0.5
differ = in_solid != (signed(points) < 0)
a, b, c = (vertices[faces[:, k]] for k in range(3))
volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
theirs = differ.mean() * np.prod(box_high - box_low) / volume
spread = np.sqrt(differ.mean() / len(points)) * np.prod(box_high - box_low) / volume
say("volume_error", "Open3D occupancy, Monte Carlo",
    f"{theirs:.4f} +- {spread:.4f}, {found['volume_error']:.4f}",
    abs(theirs - found["volume_error"]) < 4 * spread + 1e-3)

# Topology.
tree = gudhi.SimplexTree()
for v in range(len(centres)):
    tree.insert([v])
for simplex in (*edges.tolist(), *triangles.tolist()):
    tree.insert(simplex)
tree.compute_persistence(homology_coeff_field=2, persistence_dim_max=True)
theirs = (tree.betti_numbers() + [0, 0, 0])[:3]
say("betti", "GUDHI " + gudhi.__version__, f"{theirs}, {found['betti']}", theirs == found["betti"])

# Angles.
corner = centres[triangles]
side = lambda k: corner[:, (k + 1) % 3] - corner[:, k]
area = np.linalg.norm(np.cross(side(0), side(1)), axis=1)
longest = np.max([np.linalg.norm(side(k), axis=1) for k in range(3)], axis=0)
proper = area / np.maximum(longest, 1e-300) >= 1e-12
angle = np.degrees([np.arctan2(area, (side(k) * -side((k + 2) % 3)).sum(1)) for k in range(3)]).T[proper]
quality = found["quality"]
ours = [quality[k] for k in ("min_angle_mean", "max_angle_mean", "below_30", "below_10")]
if len(angle):
    theirs = [angle.min(1).mean(), angle.max(1).mean(), (angle.min(1) < 30).mean(), (angle.min(1) < 10).mean()]
    off = np.abs(np.subtract(theirs, ours)).max()
    say("quality: angles, shares", "NumPy", f"within {off:.1e}", off < 1e-7)
else:
    say("quality: angles, shares", "NumPy", "no triangle with an area", ours == [None] * 4)

# Spikes, from the definitions.
count_of = {}
for f in triangles:
    for pair in ((f[0], f[1]), (f[0], f[2]), (f[1], f[2])):
        count_of[tuple(int(x) for x in pair)] = count_of.get(tuple(int(x) for x in pair), 0) + 1
shared = np.array([count_of.get(tuple(int(x) for x in e), 0) for e in edges])
length = np.linalg.norm(centres[edges[:, 0]] - centres[edges[:, 1]], axis=1)
length[length < 1e-12] = 0
change = np.abs(radii[edges[:, 0]] - radii[edges[:, 1]])
ratio = np.where(length > 0, np.maximum(0, length - change) / np.maximum(length, 1e-300), 0)
degree = np.bincount(edges.ravel(), minlength=len(centres))
boundary = np.zeros(len(centres), bool)
boundary[edges[shared <= 1].ravel()] = True
dangling = (length > 0) & (shared == 0) & (degree[edges] == 1).any(1)
worst, same = 0.0, int(dangling.sum()) == found["spikes"]["dangling_edges"]
for at in found["spikes"]["by_ratio"]:
    weak = ratio < at["threshold"]
    parent = list(range(len(centres)))

    def root(v):
        while parent[v] != v:
            parent[v] = parent[parent[v]]
            v = parent[v]
        return v

    for i, j in edges[weak]:
        parent[root(i)] = root(j)
    on_boundary = {root(v) for v in np.flatnonzero(boundary)}
    spikes = len({root(i) for i, _ in edges[weak & (length > 0)]} & on_boundary)
    proper_edges = length > 0
    worst = max(worst, abs((weak & proper_edges).sum() / max(proper_edges.sum(), 1) - at["edge_share"]),
                abs(length[weak].sum() / max(length.sum(), 1e-300) - at["length_share"]))
    same &= spikes == at["spikes"] and int((weak & dangling).sum()) == at["dangling_edges"]
idle = set()
for i, j in edges:
    for v, u in ((i, j), (j, i)):
        growth = radii[u] - radii[v]
        if boundary[v] and growth > -1e-9 and np.linalg.norm(centres[v] - centres[u]) - growth < 1e-3:
            idle.add(int(v))
same &= len(idle) == found["spikes"]["idle_spheres"]
say("spike measures", "NumPy, from the definitions", f"counts {'equal' if same else 'differ'}, shares within {worst:.1e}",
    same and worst < 1e-9)
lone, manifold = int((shared == 0).sum()), int((shared >= 3).sum())
counts = found["counts"]
same = (lone, manifold, int((degree == 0).sum())) == (
    counts["lone_edges"], counts["nonmanifold_edges"], counts["isolated"])
say("counts", "NumPy", "equal" if same else "differ", same)

# The decimated surface.
if len(sys.argv) > 5:
    other_vertices, other_faces = read_off(sys.argv[5])
    other_vertices = (other_vertices - middle) / size
    ours = json.load(open(sys.argv[6]))
    there, back = (float(x) / size for x in open(sys.argv[7]).read().split())
    error = 1e-4
    say("surface to surface", "CGAL bounded_error_Hausdorff_distance",
        f"{there:.6f} and {back:.6f}, {ours['epsilon_union']:.6f} and {ours['reverse']:.6f}; bound {error:g}",
        ours["epsilon_union"] <= there + error and ours["reverse"] <= back + error
        and ours["epsilon_union"] >= there - error - 1e-3 and ours["reverse"] >= back - error - 1e-3)
    theirs = distances(scene_of(other_vertices, other_faces), sample(vertices, faces, 50000)).mean()
    off = abs(theirs / ours["mean"] - 1)
    say("surface to surface, mean", "Open3D, own samples", f"{off:.2%} apart", off < 0.03)
