#!/bin/sh
# The baseline beside the medial methods: decimates each mesh by surface quadrics (fast-simplification
# from PyPI, in a virtual environment below the build folder) to several counts of stored numbers
# (floats, three for each vertex), measures the results like medial meshes, and adds them to the report
# in DIR. Without meshes: the built-in shapes. Exit codes: 0 done, 77 Python or fast-simplification
# cannot be had: the report stays as it is.
#
#   medial compare MESH ... --out DIR && scripts/baselines/decimate.sh [-n NUMBERS] DIR [MESH ...]
#
# MESH as for `medial compare`: a file or builtin:ID[:RESOLUTION]. The default NUMBERS are those of 4000,
# 2000, 1000, 500, 200, 100 and 50 spheres, four for each.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)

numbers="16000 8000 4000 2000 800 400 200"
while getopts n: option; do
    case $option in
        n) numbers=$(echo "$OPTARG" | tr ',' ' ') ;;
        *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))
if [ $# = 0 ]; then
    sed -n 's/^#   //p' "$0" >&2
    exit 2
fi
report=$1
shift

target=${CARGO_TARGET_DIR:-$root/target}
work=$target/baselines
mkdir -p "$work"
python=${BASELINE_PYTHON:-$work/venv/bin/python}
if ! "$python" -c 'import fast_simplification' 2>/dev/null; then
    python3 -m venv "$work/venv" && "$work/venv/bin/pip" install --quiet fast-simplification &&
        "$python" -c 'import fast_simplification' || {
        echo "skipped: fast-simplification could not be installed" >&2
        exit 77
    }
fi
medial=${MEDIAL:-$target/release/medial}
if [ -z "${MEDIAL:-}" ]; then
    (cd "$root" && cargo build --quiet --release -p medial-bench)
fi
if [ $# = 0 ]; then
    for id in $("$medial" datasets list --json |
        python3 -c 'import json, sys; print(*[d["id"] for d in json.load(sys.stdin)["datasets"]])'); do
        set -- "$@" "builtin:$id"
    done
fi

for mesh in "$@"; do
    rm -rf "$work/mesh"
    mkdir -p "$work/mesh"
    case $mesh in
        builtin:*:*)
            rest=${mesh#builtin:}
            "$medial" datasets make "${rest%%:*}" --resolution "${rest#*:}" -o "$work/mesh/input.off"
            ;;
        builtin:*) "$medial" datasets make "${mesh#builtin:}" -o "$work/mesh/input.off" ;;
        *) "$medial" convert "$mesh" "$work/mesh/input.off" ;;
    esac >"$work/mesh/log"
    # shellcheck disable=SC2086 # a list of numbers
    "$python" "$root/scripts/baselines/decimate.py" "$work/mesh" $numbers
    "$medial" baseline "$mesh" --surfaces "$work/mesh/surfaces.json" --out "$report"
done
rm -rf "$work/mesh"
