"""Distances of a task with Open3D's RaycastingScene (single precision), against medial's answers.

    distance.py FILE ANSWERS LABEL

FILE and ANSWERS (of mode `closest`) as in src/bin/distance_oracle.rs. Prints a row of the table of
oracles: the largest difference as a fraction of the diagonal, and of the distances in double precision
from the query to Open3D's own closest point. The mesh and the queries are moved to the origin first, so
that single precision is spent on the mesh and not on its position.
"""

import json
import sys

import numpy as np
import open3d as o3d

file, answers, label = sys.argv[1:4]
raw = open(file, "rb").read()
nv, nf, nq = (int(x) for x in np.frombuffer(raw, "<u8", 3))
vertices = np.frombuffer(raw, "<f8", 3 * nv, 24).reshape(-1, 3)
faces = np.frombuffer(raw, "<u4", 3 * nf, 24 + 24 * nv).reshape(-1, 3)
queries = np.frombuffer(raw, "<f8", 3 * nq, 24 + 24 * nv + 12 * nf).reshape(-1, 3)
ours = np.fromfile(answers, "<f8").reshape(-1, 4)[:, 3]
low, high = vertices.min(0), vertices.max(0)
middle, diagonal = (low + high) / 2, np.linalg.norm(high - low)
as_tensor = lambda x: o3d.core.Tensor(((x - middle) / diagonal).astype(np.float32))
scene = o3d.t.geometry.RaycastingScene()
scene.add_triangles(as_tensor(vertices), o3d.core.Tensor(faces.astype(np.uint32)))
theirs = scene.compute_distance(as_tensor(queries)).numpy().astype(float)
off = np.abs(theirs - ours / diagonal).max()
row = {"metric": "distance to the surface", "oracle": f"Open3D {o3d.__version__} (single precision)",
       "input": label, "result": f"{nq} queries within {off:.1e} of the diagonal",
       "agrees": "yes" if off <= 1e-6 else "no"}
print(json.dumps(row))
sys.exit(0)
