#!/usr/bin/env python3
"""Check `--max-error` against a dense sweep of counts.

    scripts/bounds.py MEDIAL MESH [MESH ...] [--methods qmat,hem,angle] [--bounds 0.03,0.02,0.01,0.005]

For each mesh and method 40 counts are measured, from that of the initial medial mesh to ten. A bound that one of them
keeps must be met, with at most 1.1 times the fewest spheres of the sweep. Exit code 1 where one is not.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

parser = argparse.ArgumentParser()
parser.add_argument("medial")
parser.add_argument("meshes", nargs="+")
parser.add_argument("--methods", default="qmat,hem,angle")
parser.add_argument("--bounds", default="0.03,0.02,0.01,0.005")
arguments = parser.parse_args()
bounds = [float(bound) for bound in arguments.bounds.split(",")]


def rows(mesh, method, *levels):
    with tempfile.TemporaryDirectory() as folder:
        command = [arguments.medial, "compare", mesh, "--methods", method, "--counts-only", *levels]
        command += ["--samples", "50000", "--timeout", "9000", "--budget", "9000", "--quiet", "--out", folder]
        subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        lines = (Path(folder) / "results.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


failed = 0
for mesh in arguments.meshes:
    axis = subprocess.run([arguments.medial, "axis", mesh, "--json"], capture_output=True, text=True, check=True)
    most = json.loads(axis.stdout)["spheres"]
    counts = sorted({round(most * (10 / most) ** (k / 39)) for k in range(40)}, reverse=True)
    for method in arguments.methods.split(","):
        sweep = rows(mesh, method, "--spheres", ",".join(map(str, counts)))
        sweep = [(r["evaluate"]["hausdorff"], r["simplify"]["spheres"]) for r in sweep if r["evaluate"]]
        found = rows(mesh, method, "--spheres", "10", "--max-error", arguments.bounds)
        for bound in bounds:
            fewest = min((n for error, n in sweep if error <= bound), default=None)
            met = [r["simplify"]["spheres"] for r in found
                   if r["simplify"]["level"] == {"max_error": bound} and r["status"] == "ok"]
            fine = fewest is None or bool(met) and met[0] <= 1.1 * fewest
            failed += not fine
            print(f"{Path(mesh).stem} {method} {bound}: sweep {fewest}, found {met}{'' if fine else '  FAILED'}", flush=True)
sys.exit(failed > 0)
