"""AOF' of the voxels of a task with Open3D's closest points, and how long its queries take.

    flux.py FILE ANSWERS THREADS ROUNDS [GUARD]

FILE, FILE.voxels and ANSWERS as in src/bin/flux_oracle.rs. All samples are queried in one
batched call of RaycastingScene (single precision), the opposites of fan samples in a second one. Fans
are recognised by the primitive's barycentric coordinates. A voxel with a sample that single precision
cannot decide (GUARD, a fraction of the diagonal; a closest point elsewhere at an equal distance, or one
next to the border of a fan, or of an opposite) is a tie: it is counted and left out. Prints seconds a batch of the first
call, its number of queries, ties, and the largest difference; fails where it exceeds 1e-4.
"""

import sys
import time

import numpy as np
import open3d as o3d

file, answers, threads, rounds = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
guard = float(sys.argv[5]) if len(sys.argv) > 5 else 2e-6

raw = open(file, "rb").read()
nv, nf, nq = np.frombuffer(raw, "<u8", 3)
nv, nf, nq = int(nv), int(nf), int(nq)
vertices = np.frombuffer(raw, "<f8", 3 * nv, 24).reshape(-1, 3)
faces = np.frombuffer(raw, "<u4", 3 * nf, 24 + 24 * nv).reshape(-1, 3)
samples = np.frombuffer(raw, "<f8", 3 * nq, 24 + 24 * nv + 12 * nf).reshape(-1, 3)
head = np.fromfile(file + ".voxels", "<f8")
count, n, sigma = int(head[0]), int(head[1]), head[2]
centres = head[3:].reshape(-1, 3)
ours = np.fromfile(answers, "<f8").reshape(-1, 4)
flux = np.fromfile(answers + ".flux", "<f8")

scene = o3d.t.geometry.RaycastingScene(nthreads=threads)
scene.add_triangles(
    o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(faces.astype(np.uint32))
)


def ask(points):
    found = scene.compute_closest_points(
        o3d.core.Tensor(points.astype(np.float32)), nthreads=threads
    )
    return (
        found["points"].numpy().astype(float),
        found["primitive_ids"].numpy(),
        found["primitive_uvs"].numpy().astype(float),
    )


ask(samples[:1000])
seconds = []
for _ in range(rounds):
    start = time.perf_counter()
    near, face, uv = ask(samples)
    seconds.append(time.perf_counter() - start)

# Concave sides: side k of a face from corner k on; vertices that end one.
corner = vertices[faces.astype(int)]
normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
side_of = {}
for f, (a, b, c) in enumerate(faces.tolist()):
    for k, edge in enumerate(((a, b), (b, c), (c, a))):
        side_of[edge] = (f, k)
concave = np.zeros((nf, 3), bool)
for (a, b), (f, k) in side_of.items():
    g, _ = side_of[(b, a)]
    along = vertices[b] - vertices[a]
    sine = np.dot(np.cross(normal[f], normal[g]), along / np.linalg.norm(along))
    concave[f, k] = sine < -1e-7
concave_vertex = np.zeros(nv, bool)
for k in range(3):
    ends = faces[concave[:, k]]
    concave_vertex[ends[:, k].astype(int)] = True
    concave_vertex[ends[:, (k + 1) % 3].astype(int)] = True


def distances_to_sides(points, face):
    """For each point on a face the distance to the line of each side, and to each corner."""
    t = vertices[faces[face].astype(int)]
    to_side, to_corner = np.empty((len(points), 3)), np.empty((len(points), 3))
    for k in range(3):
        a, b = t[:, k], t[:, (k + 1) % 3]
        u = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
        to_side[:, k] = np.linalg.norm(np.cross(points - a, u), axis=1)
        to_corner[:, k] = np.linalg.norm(points - a, axis=1)
    return to_side, to_corner


def is_on_fan(points, face):
    to_side, to_corner = distances_to_sides(points, face)
    at_vertex = concave_vertex[faces[face].astype(int)]
    return ((to_side < guard) & concave[face]).any(1) | ((to_corner < guard) & at_vertex).any(1)


away = samples - near
distance = np.linalg.norm(away, axis=1)
gradient = away / distance[:, None]
direction = (samples - np.repeat(centres, n, axis=0)) / sigma
along = (gradient * direction).sum(1)
on_fan = is_on_fan(near, face)

doubtful = np.linalg.norm(near - ours[:, :3], axis=1) > guard
# A step aside, and the closest point is elsewhere, or on another kind of feature: a tie, or the border
# of a fan. At a distance D from an edge, points up to
# sqrt(2^-23) D next to it are as near as the edge itself, to single precision.
steps = 50 * guard * np.vstack((np.eye(3), -np.eye(3)))
for step in steps:
    moved, moved_face, _ = ask(samples + step)
    doubtful |= is_on_fan(moved, moved_face) != on_fan
    doubtful |= np.linalg.norm(moved - near, axis=1) > 0.2 * distance + 100 * guard

# So near to the surface the direction to it has few digits.
doubtful |= distance < 5e-5
counted = np.where(on_fan, 0.0, along)
inward = np.flatnonzero(on_fan & (along < 0))
if len(inward):
    opposite = samples[inward] - 2 * sigma * along[inward, None] * gradient[inward]
    other, _, _ = ask(opposite)
    # The same edge means the same foot of the perpendicular: see methods/aof/flux.rs. An opposite
    # for which a step leads elsewhere has more than one closest point, to single precision.
    def is_other(step):
        other, other_face, _ = ask(opposite + step)
        moved = np.linalg.norm(other - near[inward], axis=1) > guard + 1.2 * np.linalg.norm(step)
        return moved | ~is_on_fan(other, other_face)

    one_sided = is_other(np.zeros(3))
    counted[inward[one_sided]] = along[inward[one_sided]]
    for step in steps:
        doubtful[inward[is_other(step) != one_sided]] = True

theirs = counted.reshape(-1, n).sum(1) / n
ties = doubtful.reshape(-1, n).any(1)
difference = np.abs(theirs - flux)
worst = difference[~ties].max() if (~ties).any() else float("nan")
print(f"{min(seconds):.4f} {nq} {int(ties.sum())} {count} {worst:.2e} {int(on_fan.sum())}")
sys.exit(0 if worst <= 1e-4 and (~ties).mean() > 0.25 else 1)
