#!/usr/bin/env python3
"""Fit orders of convergence to the known axes of built-in shapes.

    medial compare builtin:torus:18 builtin:torus:25 builtin:torus:36 builtin:torus:51 \\
        --methods angle --levels angle=0,60 --out FOLDER
    scripts/convergence.py FOLDER...

The order is p in `error = C h^p`. h is the edge length, which is proportional to 1 / resolution. It is
the slope of the least-squares line through the logarithms, with its 95 % interval (Student's t).
Prints one Markdown row for each shape, method and level with at least three resolutions: the error at
the finest resolution in % of the diagonal, and the order. Level 0 of `angle` is the initial medial mesh.
"""

import csv
import math
import sys
from collections import defaultdict
from pathlib import Path

ERRORS = {
    "to axis, max": "axis_computed_to_true_max",
    "to axis, mean": "axis_computed_to_true_mean",
    "from axis, max": "axis_true_to_computed_max",
    "from axis, mean": "axis_true_to_computed_mean",
}
# Below this fraction of the diagonal an error is rounding.
ROUNDING = 1e-9
# Student's t, two-sided 95 %, for 1, 2, ... degrees of freedom.
STUDENT = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228]


def order(points):
    """Slope and half-width of log(error) over log(edge length); None with fewer than three points."""
    points = [(-math.log(n), math.log(error)) for n, error in points if error > ROUNDING]
    count = len(points)
    if count < 3:
        return None
    mean_x = sum(x for x, _ in points) / count
    mean_y = sum(y for _, y in points) / count
    spread = sum((x - mean_x) ** 2 for x, _ in points)
    slope = sum((x - mean_x) * (y - mean_y) for x, y in points) / spread
    residual = sum((y - mean_y - slope * (x - mean_x)) ** 2 for x, y in points)
    deviation = math.sqrt(residual / (count - 2) / spread)
    return slope, STUDENT[min(count - 2, len(STUDENT)) - 1] * deviation


def cell(points):
    finest = max(points)[1]
    if finest <= ROUNDING:
        return "exact"
    fit = order(points)
    text = f"{100 * finest:.2g}"
    return f"{text}; {fit[0]:.1f} ± {fit[1]:.1f}" if fit else text


def main(folders):
    groups = defaultdict(lambda: defaultdict(list))
    for folder in folders:
        with open(Path(folder) / "results.csv", newline="") as file:
            for row in csv.DictReader(file):
                shape, _, resolution = row["mesh"].rpartition("-")
                # At equal counts a finer surface has no finer axis, so there is no order.
                counted = row["level"] == "spheres"
                if row["status"] != "ok" or counted or not resolution.isdigit():
                    continue
                level = f"{row['level']} {row['asked']}".strip()
                for title, column in ERRORS.items():
                    if row.get(column):
                        key = (shape, row["method"], row["params"], level)
                        groups[key][title].append((int(resolution), float(row[column])))
    groups = {key: errors for key, errors in groups.items()
              if len({n for n, _ in next(iter(errors.values()))}) >= 3}
    if not groups:
        sys.exit("no shape has three resolutions with a known axis")
    print("| shape | method | level | " + " | ".join(ERRORS) + " |")
    print("| --- " * (3 + len(ERRORS)) + "|")
    for (shape, method, params, level), errors in sorted(groups.items()):
        name = method if params in ("", "{}") else f"{method} {params}"
        print(f"| {shape} | {name} | {level} | "
              + " | ".join(cell(errors[title]) for title in ERRORS) + " |")


if __name__ == "__main__":
    main(sys.argv[1:] or sys.exit(__doc__))
