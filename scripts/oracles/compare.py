#!/usr/bin/env python3
"""Compares the answers of two sides to the queries of a task.

    compare.py FILE MODE OURS THEIRS

FILE, MODE and the answers as in src/bin/distance_oracle.rs. Prints the differences, and fails where there are any that
rounding does not explain.
"""

import array
import math
import struct
import sys

file, mode, *answers = sys.argv[1:]
ours, theirs = (array.array("d", open(name, "rb").read()) for name in answers)
if len(ours) != len(theirs) or not ours:
    sys.exit("the two sides do not have as many answers")
if mode != "closest":
    differing, on = sum(a != b for a, b in zip(ours, theirs)), ours.count(0)
    print(f"{differing} differ of {len(ours)} ({on} on the surface)")
    sys.exit("inside tests differ" if differing else 0)

points = lambda numbers: list(zip(numbers[::3], numbers[1::3], numbers[2::3]))
task = open(file, "rb").read()
vertices, faces, queries = struct.unpack("<3Q", task[:24])
corners = points(array.array("d", task[24 : 24 + 24 * vertices]))
begin = 24 + 24 * vertices + 12 * faces
asked = points(array.array("d", task[begin : begin + 24 * queries]))
diagonal = math.dist(*zip(*((min(axis), max(axis)) for axis in zip(*corners))))
relative = absolute = apart = ties = 0
for k, point in enumerate(asked):
    (*own, distance), (*other, _) = ours[4 * k : 4 * k + 4], theirs[4 * k : 4 * k + 4]
    # Their point, measured by us: the comparison is not about their square root.
    off = abs(distance - math.dist(point, other))
    absolute = max(absolute, off / diagonal)
    relative = max(relative, off / max(distance, 1e-3 * diagonal))
    if math.dist(own, other) > 1e-9 * diagonal:
        tied = off <= 1e-12 * diagonal
        ties, apart = ties + tied, apart + (not tied)
print(
    f"distances within {relative:.1e} relative, {absolute:.1e} of the diagonal; other points: {apart}, and {ties} ties"
)
sys.exit(0 if relative <= 1e-12 and not apart else "closest points differ")
