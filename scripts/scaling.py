#!/usr/bin/env python3
"""Fit how time and memory of each method grow with the input.

    medial compare MESH... --spheres 100 --out FOLDER
    scripts/scaling.py FOLDER [SPHERES]      SPHERES: the requested number of spheres [100]

Least squares of log y = a + p log x over a method's own meshes on which it reached the number of spheres: x the
spheres of the initial medial mesh, y the CPU seconds of all stages, shared substrates included, or the peak of memory.
Prints one Markdown row for each method: the exponent p with its standard error, and the value at x = 10,000, which
may lie outside a method's sizes. The meshes differ in shape too, so p describes these meshes.
"""

import csv
import math
import sys
from collections import defaultdict
from pathlib import Path

# Over fewer meshes or a smaller span of sizes noise decides the exponent.
LEAST_MESHES = 4
LEAST_SPAN = 3
REFERENCE = 10_000
# Title, column of results.csv, unit of that column.
COSTS = [("CPU time", "CPU s", "cpu_seconds_total", 1), ("memory", "MB", "peak_bytes", 1e6)]


def power_law(points):
    """Exponent, its standard error and the value at REFERENCE; or why there is none."""
    if len(points) < LEAST_MESHES:
        return "too few meshes"
    sizes = [x for x, _ in points]
    span = max(sizes) / min(sizes)
    if span < LEAST_SPAN:
        return f"sizes within a factor of {span:.2g}"
    logs = [(math.log(x / REFERENCE), math.log(y)) for x, y in points]
    count = len(logs)
    mean_x = sum(x for x, _ in logs) / count
    mean_y = sum(y for _, y in logs) / count
    spread = sum((x - mean_x) ** 2 for x, _ in logs)
    slope = sum((x - mean_x) * (y - mean_y) for x, y in logs) / spread
    residual = sum((y - mean_y - slope * (x - mean_x)) ** 2 for x, y in logs)
    # Two numbers were fitted, so two degrees of freedom are gone.
    error = math.sqrt(residual / (count - 2) / spread)
    return slope, error, math.exp(mean_y - slope * mean_x)


def main(folder, spheres="100"):
    groups = defaultdict(lambda: [[], []])
    with open(Path(folder) / "results.csv", newline="") as file:
        for row in csv.DictReader(file):
            if (row["level"], row["asked"], row["comparable"]) != ("spheres", spheres, "true"):
                continue
            name = row["method"] if row["params"] == "{}" else f"{row['method']} {row['params']}"
            for points, (_, _, column, unit) in zip(groups[name], COSTS):
                # Both are fitted as logarithms.
                if row["initial_spheres"] and float(row[column] or 0) > 0:
                    points.append((float(row["initial_spheres"]), float(row[column]) / unit))
    titles = [f"{name}: exponent | {unit} at {REFERENCE:,} | n" for name, unit, _, _ in COSTS]
    print("| method | " + " | ".join(titles) + " |\n|---|" + "---|---:|---:|" * len(COSTS))
    for name, costs in groups.items():
        cells = [name]
        for points in costs:
            law = power_law(points)
            fitted = [law, "–"] if isinstance(law, str) else [f"{law[0]:.2f} ± {law[1]:.2f}", f"{law[2]:.2g}"]
            cells += fitted + [str(len(points))]
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(*sys.argv[1:])
