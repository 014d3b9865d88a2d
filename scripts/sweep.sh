#!/bin/sh
# Every method on every mesh of a folder, under limits: does anything panic, hang, run out of memory or answer nonsense?
#
#   scripts/sweep.sh DIR|SET... [-- OPTIONS OF medial compare]
#
# DIR is a folder with surfaces (.off, .obj, .ply, .stl; broken ones too), SET what `medial compare --dataset` takes.
# Results go to the folder OUT (default: medial-sweep): `sweep.md` has one table and everything that is not ok, with its
# reason, `index.html` is the report. The same call again goes on where the last one ended. Exit code 1: a panic, a
# time-out, memory, an invalid output, or a result that is missing. A mesh that is refused is an outcome like others.
#
# By the environment: SPHERES (500), THREADS (2), TIMEOUT (300 seconds for each item), MEMORY (megabytes for each item;
# three quarters of the machine), METHODS (all there are), MEDIAL (target/release/medial). Needs Python 3.
set -eu

if [ $# -lt 1 ]; then
    sed -n '2,12s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
here=$(cd "$(dirname "$0")/.." && pwd)
medial=${MEDIAL:-$here/target/release/medial}
out=${OUT:-medial-sweep}
list=$(mktemp)
trap 'rm -f "$list"' EXIT

# One mesh or option a line, as no name of a file may be taken apart at its blanks.
while [ $# -gt 0 ] && [ "$1" != -- ]; do
    if [ -d "$1" ]; then
        find "$1" -maxdepth 1 -type f | grep -iE '\.(off|obj|ply|stl)$' | LC_ALL=C sort | while IFS= read -r mesh; do
            # A file that nobody may open is a mistake of the command line to `compare`, and would end it.
            if [ -r "$mesh" ]; then printf '%s\n' "$mesh"; else echo "sweep: $mesh: cannot be read, left out" >&2; fi
        done >> "$list"
    else
        printf '%s\n' "--dataset=$1" >> "$list"
    fi
    shift
done
[ $# -eq 0 ] || shift
if [ ! -s "$list" ]; then
    echo "sweep: no surface (.off, .obj, .ply, .stl) there" >&2
    exit 2
fi
methods=${METHODS:-$("$medial" methods --json | python3 -c '
import json, sys
print(",".join(method["id"] for method in json.load(sys.stdin)["methods"]))')}
set -- "$@" --methods "$methods" --spheres "${SPHERES:-500}" --counts-only --threads "${THREADS:-2}" \
    --timeout "${TIMEOUT:-300}" --out "$out"
[ -z "${MEMORY:-}" ] || set -- "$@" --memory "$MEMORY"
while IFS= read -r word; do
    set -- "$@" "$word"
done < "$list"

# 3: not every result is as asked; 5: none could be measured. Both are outcomes, and in the table.
code=0
"$medial" compare "$@" || code=$?
case $code in
0 | 3 | 5) ;;
*) exit "$code" ;;
esac
exec python3 "$here/scripts/sweep_table.py" "$out" "$medial"
