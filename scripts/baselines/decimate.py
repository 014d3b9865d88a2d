"""Decimates FOLDER/input.off by fast-simplification to so many floats (three for each vertex) and
writes the surfaces and their list, as `medial baseline` reads it.

    decimate.py FOLDER NUMBERS ...

The tool takes a number of triangles. A closed surface of Euler number chi with V vertices has 2 (V - chi)
of them, which gives the first guess; a second one corrects it by what came out. Where a mesh cannot be
brought to within 2 % (below the smallest surface that the tool reaches, or above the input), the nearest
result is written once and says its own number. All else is the tool's default. Seconds are those of the
call that made the surface.
"""

import importlib.metadata
import json
import sys
import time

import fast_simplification
import numpy as np

folder, targets = sys.argv[1], sorted(map(int, sys.argv[2:]), reverse=True)
words = open(f"{folder}/input.off").read().split()
vertex_count, face_count = int(words[1]), int(words[2])
body = np.array(words[4 : 4 + 3 * vertex_count], float)
vertices = body.reshape(-1, 3)
rows = np.array(words[4 + 3 * vertex_count : 4 + 3 * vertex_count + 4 * face_count], int)
faces = rows.reshape(-1, 4)[:, 1:]
euler = vertex_count - face_count // 2

# Single precision inside the tool: around the origin and of size one nothing is lost to the position.
low, high = vertices.min(0), vertices.max(0)
middle, size = (low + high) / 2, np.linalg.norm(high - low)
unit = np.ascontiguousarray((vertices - middle) / size)


def decimate(triangles):
    """The surface, its vertices in use, and the seconds of the call."""
    triangles = min(max(triangles, 4), face_count)
    start = time.perf_counter()
    points, kept = fast_simplification.simplify(unit, faces.astype(np.int32), target_count=triangles)
    seconds = time.perf_counter() - start
    used, corners = np.unique(np.asarray(kept).ravel(), return_inverse=True)
    return points[used], corners.reshape(-1, 3), seconds


surfaces, seen = [], set()
for numbers in targets:
    wanted = numbers / 3
    if wanted > vertex_count:
        continue
    triangles = round(2 * (wanted - euler))
    best = None
    for _ in range(4):
        found = decimate(triangles)
        if best is None or abs(len(found[0]) - wanted) < abs(len(best[0]) - wanted):
            best = found
        missing = wanted - len(found[0])
        if abs(missing) <= 0.5 or not 4 <= triangles <= face_count:
            break
        triangles = max(4, round(triangles + 2 * missing))
    points, corners, seconds = best
    if len(corners) == 0 or len(points) in seen:
        continue
    seen.add(len(points))
    name = f"{numbers}.off"
    with open(f"{folder}/{name}", "w") as out:
        out.write(f"OFF\n{len(points)} {len(corners)} 0\n")
        for point in points * size + middle:
            out.write("%.17g %.17g %.17g\n" % tuple(point))
        for corner in corners:
            out.write("3 %d %d %d\n" % tuple(corner))
    surfaces.append({"file": name, "numbers": numbers, "seconds": seconds})

tool = "fast-simplification " + importlib.metadata.version("fast-simplification")
with open(f"{folder}/surfaces.json", "w") as out:
    json.dump({"tool": tool, "surfaces": surfaces}, out)
