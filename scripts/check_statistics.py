#!/usr/bin/env python3
"""Repeats the statistics of a report with SciPy and compares all digits.

    scripts/check_statistics.py REPORT [REPORT ...]

Reads results.csv of each report, computes the signed-rank tests, the corrected p-values and the intervals anew, and
compares them with tables/overview-differences.csv. Exits with 1 if a number differs by more than 1e-9. Needs numpy and
scipy; without them it prints "skipped".
"""

import csv
import itertools
import math
import sys
from collections import defaultdict
from pathlib import Path

try:
    import numpy as np
    from scipy import stats
except ImportError:
    print("skipped: numpy or scipy is missing")
    sys.exit(0)

TOLERANCE = 1e-9
RANKED = 5.0


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def exact_p(differences):
    """The signed-rank test by SciPy: its table of the exact distribution, or all signs where there are ties."""
    d = np.array([x for x in differences if x != 0.0])
    if len(d) == 0:
        return 1.0
    # Infinite values take the ranks of a finite value that is larger than all.
    large = 2.0 * max([abs(x) for x in d if math.isfinite(x)], default=1.0)
    d = np.where(np.isfinite(d), d, np.sign(d) * large)
    if len(d) > 100:
        return stats.wilcoxon(d, method="approx").pvalue
    if len(set(np.abs(d))) == len(d):
        return stats.wilcoxon(d, method="exact").pvalue
    ranks = stats.rankdata(np.abs(d))
    # All signs: the distribution of the sum of independent ranks, as a polynomial in half ranks.
    sums = np.array([1.0])
    for rank in np.rint(2 * ranks).astype(int):
        other = np.zeros(len(sums) + rank)
        other[: len(sums)] += 0.5 * sums
        other[rank:] += 0.5 * sums
        sums = other
    if len(d) <= 13:
        enumerated = stats.permutation_test(
            (d,), lambda x, axis: np.where(x > 0, ranks, 0).sum(axis=axis), permutation_type="samples",
            n_resamples=np.inf, vectorized=True,
        ).pvalue
        found = int(np.rint(2 * ranks[d > 0].sum()))
        direct = min(1.0, 2 * min(sums[: found + 1].sum(), sums[found:].sum()))
        assert abs(direct - enumerated) < 1e-9, (direct, enumerated)
    found = int(np.rint(2 * ranks[d > 0].sum()))
    return min(1.0, 2 * min(sums[: found + 1].sum(), sums[found:].sum()))


def holm(p):
    order = np.argsort(p, kind="stable")
    corrected, largest = np.zeros(len(p)), 0.0
    for k, i in enumerate(order):
        largest = max(largest, min(1.0, (len(p) - k) * p[i]))
        corrected[i] = largest
    return corrected


def interval(logs):
    """Percentiles of the mean of 2,000 resamples drawn by SplitMix64."""
    if len(logs) < 6:
        return None
    mask, state, means = (1 << 64) - 1, 0, []
    for _ in range(2000):
        total = 0.0
        for _ in logs:
            state = (state + 0x9E3779B97F4A7C15) & mask
            z = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & mask
            z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
            total += logs[((z ^ (z >> 31)) * len(logs)) >> 64]
        means.append(total / len(logs))
    return [math.exp(x) for x in np.quantile(means, [0.025, 0.975])]


class Check:
    def __init__(self):
        self.count, self.worst, self.faults = 0, 0.0, []

    def same(self, what, ours, theirs):
        self.count += 1
        difference = abs(ours - theirs)
        self.worst = max(self.worst, difference)
        if not difference <= TOLERANCE:
            self.faults.append(f"{what}: {ours} here, {theirs} in the report")


def check(report):
    rows = [row for row in read(report / "results.csv") if row["method"] != "initial"]
    name = lambda row: row["row"]
    errors = defaultdict(dict)  # by count and series: mesh -> error in %, infinite without a result
    for row in rows:
        if row["level"] == "spheres":
            error = float(row["hausdorff"] or "inf") * 100
            usable = row["comparable"] == "true" and error <= RANKED
            errors[int(row["asked"]), name(row)][row["mesh"]] = error if usable else math.inf
    result = Check()
    differences = read(report / "tables/overview-differences.csv")
    for spheres, group in itertools.groupby(differences, key=lambda row: int(row["spheres"])):
        group, ps = list(group), []
        for row in group:
            first, second = (errors[spheres, row[key]] for key in ("method", "other"))
            pairs = [(first[mesh], second[mesh]) for mesh in first if mesh in second]
            pairs = [pair for pair in pairs if math.isfinite(min(pair))]
            logs = [0.0 if a == b else math.log(a) - math.log(b) for a, b in pairs]
            finite = [x for x in logs if math.isfinite(x)]
            what = f"{report}, {spheres}, {row['method']} and {row['other']}"
            for key, is_in in (("better", lambda x: x < 0), ("equal", lambda x: x == 0), ("worse", lambda x: x > 0)):
                result.same(f"{what}, {key}", sum(map(is_in, logs)), int(row[key]))
            if finite:
                ratios = [math.exp(x) for x in finite]
                result.same(f"{what}, ratio", stats.gmean(ratios), float(row["ratio"]))
            ends = interval(finite)
            if ends:
                for end, key in zip(ends, ("ratio_low", "ratio_high")):
                    result.same(f"{what}, {key}", end, float(row[key]))
            ps.append(exact_p(logs))
            result.same(f"{what}, p", ps[-1], float(row["p"]))
        for row, p in zip(group, holm(np.array(ps))):
            what = f"{report}, {spheres}, {row['method']} and {row['other']}, corrected p"
            result.same(what, p, float(row["p_corrected"]))
    return result


faults = []
for report in map(Path, sys.argv[1:]):
    found = check(report)
    print(f"{report}: {found.count} numbers, largest difference {found.worst:.1e}")
    faults += found.faults
for fault in faults[:20]:
    print(fault)
if len(sys.argv) < 2:
    sys.exit(__doc__)
sys.exit(1 if faults else 0)
