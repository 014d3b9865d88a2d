#!/usr/bin/env python3
"""The baseline: surfaces decimated by quadrics, as external results of a comparison.

    python3 -m venv venv && venv/bin/pip install fast-simplification
    venv/bin/python scripts/baselines/decimate.py FOLDER MESH.off... [--numbers 16000,8000,...]
    medial compare MESH.off... --given fast-simplification=FOLDER

Writes FOLDER/MESH-NUMBERS.off for each number of floats, three for a vertex: as many as N spheres take are
4 N. Makes no file where a mesh cannot be brought within 2 % of a number (below the smallest surface that
the tool reaches, or above the input).
"""

import argparse
from pathlib import Path

import fast_simplification
import numpy as np


def read_off(path):
    words = path.read_text().split()
    vertex_count, face_count = int(words[1]), int(words[2])
    vertices = np.array(words[4 : 4 + 3 * vertex_count], float).reshape(-1, 3)
    rows = np.array(words[4 + 3 * vertex_count : 4 + 3 * vertex_count + 4 * face_count], int)
    return vertices, rows.reshape(-1, 4)[:, 1:].astype(np.int32)


def write_off(path, vertices, faces):
    with open(path, "w") as out:
        out.write(f"OFF\n{len(vertices)} {len(faces)} 0\n")
        np.savetxt(out, vertices, fmt="%.17g")
        np.savetxt(out, np.column_stack([np.full(len(faces), 3), faces]), fmt="%d")


def decimate(vertices, faces, wanted):
    """The surface with the number of vertices nearest to `wanted`. The tool takes a number of triangles:
    2 (V - chi) of a closed surface with Euler number chi, corrected by the result."""
    euler = len(vertices) - len(faces) // 2
    triangles = round(2 * (wanted - euler))
    best = None
    for _ in range(4):
        target = min(max(triangles, 4), len(faces))
        points, kept = fast_simplification.simplify(vertices, faces, target_count=target)
        used, corners = np.unique(np.asarray(kept).ravel(), return_inverse=True)
        if best is None or abs(len(used) - wanted) < abs(len(best[0]) - wanted):
            best = points[used], corners.reshape(-1, 3)
        missing = wanted - len(used)
        if abs(missing) <= 0.5 or not 4 <= triangles <= len(faces):
            break
        triangles = max(4, round(triangles + 2 * missing))
    return best


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--numbers", default="16000,8000,4000,2000,800,400,200")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for mesh in arguments.meshes:
        vertices, faces = read_off(mesh)
        # The tool works in single precision: around the origin and of size one it loses nothing to the position.
        low, high = vertices.min(0), vertices.max(0)
        middle, size = (low + high) / 2, np.linalg.norm(high - low)
        unit = np.ascontiguousarray((vertices - middle) / size)
        for numbers in map(int, arguments.numbers.split(",")):
            points, corners = decimate(unit, faces, numbers / 3)
            if len(corners) and abs(len(points) - numbers / 3) <= 0.02 * numbers / 3:
                write_off(arguments.folder / f"{mesh.stem}-{numbers}.off", points * size + middle, corners)


if __name__ == "__main__":
    main()
