#!/usr/bin/env python3
"""Kills a comparison at random moments and continues it, and asks that nothing is lost or torn.

    scripts/kills.py [MEDIAL] [KILLS] [SEED]

1. An undisturbed run into one folder.
2. The same command into another, killed (SIGKILL) after a random time, again and again; after each
   kill every line of the records is whole but perhaps the last, and no worker is left.
3. The same command to its end: records and results are those of the undisturbed run, but for seconds
   and memory, and at most the items in flight were run twice.

Needs Python 3 and nothing else. Exit code 0 when all holds.
"""

import json
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import time

MEDIAL = sys.argv[1] if len(sys.argv) > 1 else "target/release/medial"
KILLS = int(sys.argv[2]) if len(sys.argv) > 2 else 20
random.seed(int(sys.argv[3]) if len(sys.argv) > 3 else 1)
WORDS = ["compare", "builtin:box", "builtin:torus", "builtin:blob", "--spheres", "300,100", "--quiet"]


def command(out):
    return [MEDIAL, *WORDS, "--out", str(out)]


def records(out):
    """Records by key, without what differs from run to run, and the number of lines."""
    lines = (out / "results.jsonl").read_text().splitlines()
    found = {}
    for line in lines:
        record = json.loads(line)
        for key in ("evaluate_seconds", "repetitions", "command"):
            record.pop(key, None)
        for key in ("seconds", "cpu_seconds", "peak_bytes", "substrates", "own_seconds"):
            record["simplify"].pop(key, None)
        found[record["key"]] = record
    return found, len(lines)


def results(out):
    files = (path for path in (out / "axes").rglob("*") if path.is_file())
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def descendants(pid):
    parents = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                stat = pathlib.Path("/proc", entry, "stat").read_text()
            except OSError:
                continue
            parents[int(entry)] = int(stat.rsplit(")", 1)[1].split()[1])
    found = [pid]
    for parent in found:
        found += [child for child, its in parents.items() if its == parent]
    return found[1:]


def alive(pid):
    try:
        return b"worker" in pathlib.Path("/proc", str(pid), "cmdline").read_bytes()
    except OSError:
        return False


with tempfile.TemporaryDirectory() as folder:
    whole, killed = pathlib.Path(folder, "whole"), pathlib.Path(folder, "killed")
    begun = time.monotonic()
    subprocess.run(command(whole), stdout=subprocess.DEVNULL, check=False)
    length = time.monotonic() - begun
    stopped = 0
    for number in range(KILLS):
        run = subprocess.Popen(command(killed), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        # Short enough that the run lasts through all of them.
        time.sleep(random.uniform(0.0, 2.0 * length / KILLS))
        workers = descendants(run.pid)
        stopped += run.poll() is None
        run.kill()
        run.wait()
        for _ in range(200):
            if not any(map(alive, workers)):
                break
            time.sleep(0.05)
        else:
            sys.exit(f"kill {number}: a worker is left: {workers}")
        if (killed / "results.jsonl").exists():
            text = (killed / "results.jsonl").read_text()
            for line in text[: text.rfind("\n") + 1].splitlines():
                json.loads(line)
    subprocess.run(command(killed), stdout=subprocess.DEVNULL, check=False)
    (expected, asked), (found, lines) = records(whole), records(killed)
    assert found == expected, "the records differ"
    assert results(killed) == results(whole), "the results differ"
    twice = lines - asked
    # An item in flight has two levels here.
    assert twice <= 2 * KILLS, f"{twice} levels were recorded twice"
    print(f"{stopped} of {KILLS} kills met the run; {len(found)} records equal, {twice} recorded twice")
