#!/usr/bin/env python3
"""Runs every verb for one mesh on every result of a comparison: none may panic, and no number may be missing.

    scripts/verbs.py MEDIAL STORE

STORE is a folder of `medial compare`. Each medial mesh in it is reconstructed, rendered, viewed, converted and evaluated.
Exit codes 0 and 1 (a typed error, which is counted and printed) pass. Exits with 1 after any other exit code, a NaN, or
five minutes.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

medial, store = sys.argv[1], Path(sys.argv[2])
failed = runs = errors = 0
with tempfile.TemporaryDirectory() as folder:
    for line in open(store / "results.jsonl"):
        record = json.loads(line)
        if not record.get("artifact"):
            continue
        axis, mesh = store / record["artifact"], f"builtin:{record['mesh'].removeprefix('builtin:')}"
        out = lambda name: str(Path(folder) / name)
        for words in (
            ["reconstruct", axis, "-o", out("x.off")],
            ["render", mesh, axis, "--show", "error", "-o", out("x.png")],
            ["view", "--mesh", mesh, axis, "-o", out("x.html")],
            ["convert", axis, out("x.ply")],
            ["--json", "evaluate", mesh, axis],
        ):
            words = [str(word) for word in words]
            runs += 1
            try:
                run = subprocess.run([medial, "--quiet", *words], capture_output=True, text=True, timeout=300)
                fault = run.returncode not in (0, 1) or "NaN" in run.stdout
                message = run.stderr.strip().splitlines()[-1:] or [""]
            except subprocess.TimeoutExpired:
                run, fault, message = None, True, ["no end in five minutes"]
            failed += fault
            if fault or run.returncode == 1:
                errors += not fault
                print(f"{'FAILED' if fault else 'error'}: medial {' '.join(words)}: {message[0]}", flush=True)
            for made in Path(folder).iterdir():
                made.unlink()
print(f"{runs} runs, {errors} typed errors, {failed} failures")
sys.exit(1 if failed or not runs else 0)
