"""Compares `medial repair --wrap` with CGAL's alpha wrap of the same files.

    python3 scripts/oracles/wrap.py MEDIAL WORK [--alpha A] MESH ...

MEDIAL is the command, WORK a folder for the CGAL programs and the wraps, A the radius as a fraction of the bounding box's
diagonal, 0.02 by default; the offset is A / 30. Prints a row for each mesh: vertices of both wraps and their ratio, the
Hausdorff distance of the wraps as a fraction of alpha, CPU seconds of the wrap by CGAL and of the whole command. Exit codes:
0 the vertex counts differ by at most 50 % and the Hausdorff distances are at most 3 alpha, 1 otherwise, 77 CGAL is missing
(Debian: libcgal-dev libgmp-dev libmpfr-dev).
"""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
# Largest ratio of vertex counts.
COUNTS = 1.5
# Largest Hausdorff distance, as a multiple of alpha: an opening of about 2 alpha may be entered by one wrap alone.
DISTANCE = 3.0


def built(work, name):
    """The program of `name`.cpp."""
    source, program = HERE / f"{name}.cpp", work / name
    if not program.exists() or program.stat().st_mtime < source.stat().st_mtime:
        words = ["g++", "-std=c++17", "-O3", "-DNDEBUG", source, "-o", program, "-lgmp", "-lmpfr"]
        subprocess.run(words, check=True)
    return program


def seconds(words):
    """CPU seconds of a command, and its output."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, output


def compared(medial, work, alpha, mesh):
    """The row of a mesh, and whether the wraps agree."""
    ours, theirs = work / "wrap_ours.off", work / "wrap_theirs.off"
    words = [medial, "--json", "repair", mesh, "--wrap", str(alpha), "-o", ours]
    own_seconds, output = seconds(words)
    report = json.loads(output)
    wrapped = report["repairs"][-1]
    counts = subprocess.run(
        [built(work, "wrap_cgal"), mesh, str(alpha), str(alpha / 30), theirs],
        check=True, capture_output=True, text=True).stdout.split()
    length = wrapped["alpha"]
    bounds = subprocess.run(
        [built(work, "hausdorff_cgal"), ours, theirs, str(0.02 * length)],
        check=True, capture_output=True, text=True).stdout.split()
    distance = max(float(bound) for bound in bounds) / length
    ratio = report["vertices"] / int(counts[0])
    row = (f"{Path(mesh).name:32} {report['vertices']:8} {counts[0]:>8} {ratio:6.2f} {distance:10.2f} "
           f"{own_seconds:8.2f} {float(counts[2]):8.2f} {own_seconds / float(counts[2]):6.2f}")
    return row, 1 / COUNTS <= ratio <= COUNTS and distance <= DISTANCE


def main():
    """Prints the table."""
    if not Path("/usr/include/CGAL/alpha_wrap_3.h").exists():
        print("skipped: CGAL is not installed (libcgal-dev)", file=sys.stderr)
        return 77
    arguments = sys.argv[1:]
    alpha = 0.02
    if "--alpha" in arguments:
        at = arguments.index("--alpha")
        alpha = float(arguments[at + 1])
        del arguments[at:at + 2]
    if len(arguments) < 3:
        print(__doc__, file=sys.stderr)
        return 2
    medial, work, *meshes = arguments
    os.environ["RAYON_NUM_THREADS"] = "1"
    print(f"{'mesh':32} {'vertices':>8} {'CGAL':>8} {'ratio':>6} {'d / alpha':>10} {'s':>8} {'CGAL s':>8} {'ratio':>6}")
    agree = True
    for mesh in meshes:
        row, agrees = compared(medial, Path(work), alpha, mesh)
        print(row if agrees else f"{row}  differs", flush=True)
        agree &= agrees
    return 0 if agree else 1


if __name__ == "__main__":
    sys.exit(main())
