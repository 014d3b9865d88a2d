#!/usr/bin/env python3
"""The table of docs/measured/real-files.md: what `medial axis` makes of the surface files of a folder, by class of defect.

A file is served if its start has the Betti numbers of the solid and a Hausdorff error of at most 2 % of the diagonal. The
others are wrapped, and served then if the start of the wrap is.

    scripts/real_files.py target/release/medial FOLDER [--every N] > table.md
"""
import argparse
import collections
import json
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

SECONDS = 60
SAMPLES = "3000"
VERDICTS = ["served", "coarse", "other topology", "refused", "over time"]
WRAPPED = "served when wrapped"


def call(words):
    """The exit code, the JSON object and the CPU seconds of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=2 * SECONDS)
        code, text = done.returncode, done.stdout
    except subprocess.TimeoutExpired:
        code, text = None, ""
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    return code, json.loads(text) if text.startswith("{") else {}, seconds


def defect(info):
    if not info.get("closed"):
        return "open"
    if not info["manifold"]:
        return "more than two faces at an edge, or touching parts"
    return "crossing faces" if info["self_intersecting"] else "none"


def verdict(medial, path, axis):
    words = ["--json", "--threads", "1"]
    code, start, seconds = call([medial, "axis", path, "-o", axis, *words])
    if code is None or seconds > SECONDS:
        return "over time", seconds
    if code != 0:
        return "refused", seconds
    if start["betti"] != start["expected_betti"]:
        return "other topology", seconds
    measured = call([medial, "evaluate", path, axis, "--samples", SAMPLES, *words])[1]
    if not measured:
        return "over time", seconds
    return "served" if measured["hausdorff"] <= 0.02 else "coarse", seconds


def served_wrapped(medial, path, folder):
    wrapped = f"{folder}/wrapped.off"
    code, _, seconds = call([medial, "repair", path, "--wrap", "-o", wrapped, "--threads", "1"])
    if code != 0 or seconds > SECONDS:
        return False
    return verdict(medial, wrapped, f"{folder}/wrapped.ma")[0] == "served"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("medial")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--every", type=int, default=1, metavar="N", help="take every N-th file")
    given = parser.parse_args()
    kinds = {".stl", ".obj", ".off", ".ply"}
    files = sorted(path for path in given.folder.rglob("*") if path.suffix.lower() in kinds)
    counts, times = collections.defaultdict(collections.Counter), collections.defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        for path in files[:: given.every]:
            info = call([given.medial, "info", str(path), "--json"])[1]
            found, seconds = verdict(given.medial, str(path), f"{folder}/start.ma")
            wrapped = found != "served" and served_wrapped(given.medial, str(path), folder)
            for row in (defect(info), "all"):
                counts[row][found] += 1
                counts[row][WRAPPED] += wrapped
                times[row].append(seconds)
            note = f"{found}, {WRAPPED}" if wrapped else found
            print(f"{path}: {defect(info)}: {note}, {seconds:.2f} s", file=sys.stderr, flush=True)
    print("| defect | files | " + " | ".join([*VERDICTS, WRAPPED]) + " | median CPU s | largest |")
    print("|---" * (len(VERDICTS) + 5) + "|")
    for row in sorted(counts, key=lambda row: (row == "all", -len(times[row]))):
        cells = [len(times[row]), *(counts[row][name] for name in [*VERDICTS, WRAPPED])]
        cells += [f"{statistics.median(times[row]):.2f}", f"{max(times[row]):.1f}"]
        print(f"| {row} | " + " | ".join(map(str, cells)) + " |")


main()
