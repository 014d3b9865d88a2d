"""Keeps the largest balls of a medial mesh, with the edges and faces between them.

Run by `medial` as largest.toml says:
    largest.py INITIAL.ma OUTPUT.ma --spheres N --least R
"""

import argparse
import json
import sys
import time

import numpy as np


def read_ma(path):
    """Spheres (n x 4: x y z r), edges (m x 2) and faces (k x 3) of a .ma file."""
    rows = {"v": [], "e": [], "f": []}
    with open(path) as lines:
        next(lines)  # The numbers of each: the lists say the same.
        for line in lines:
            kind, *words = line.split()
            rows[kind].append(words)
    return (
        np.array(rows["v"], float).reshape(-1, 4),
        np.array(rows["e"], int).reshape(-1, 2),
        np.array(rows["f"], int).reshape(-1, 3),
    )


def write_ma(path, spheres, edges, faces):
    with open(path, "w") as out:
        print(len(spheres), len(edges), len(faces), file=out)
        np.savetxt(out, spheres, fmt="v %.17g %.17g %.17g %.17g")
        np.savetxt(out, edges, fmt="e %d %d")
        np.savetxt(out, faces, fmt="f %d %d %d")


parser = argparse.ArgumentParser()
parser.add_argument("initial")
parser.add_argument("output")
parser.add_argument("--spheres", type=int)
parser.add_argument("--least", type=float)
given = parser.parse_args()

start = time.perf_counter()
spheres, edges, faces = read_ma(given.initial)
ranked = np.argsort(-spheres[:, 3], kind="stable")  # Equal radii by number: the same bytes always.
prepared = time.perf_counter()

best = ranked[: given.spheres]
best = np.sort(best[spheres[best, 3] >= given.least])
if len(best) == 0:
    sys.exit(f"no ball has a radius of {given.least}")  # Exit code 1: the run failed, and this is why.
new = np.full(len(spheres), -1)
new[best] = np.arange(len(best))
kept = [new[simplices][(new[simplices] >= 0).all(axis=1)] for simplices in (edges, faces)]
write_ma(given.output, spheres[best], *kept)
done = time.perf_counter()
print(json.dumps({"seconds": {"prepare": prepared - start, "simplify": done - prepared}}))
