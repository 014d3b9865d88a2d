#!/bin/sh
# Checks that certified intervals hold the estimate of many samples: each mesh, simplified by Q-MAT to each
# number of spheres, certified and sampled by the same program run; the default makes about ten million
# samples both ways together. Prints one row for each case. A sampled maximum is a lower bound: above the
# interval it is an error; below, `missed` says by how much the samples fell short of the point that the
# certificate found, or by how much its lower end is wrong: more samples tell. Exit codes: 0 every interval
# holds its estimate, 1 one does not, 77 there is no mesh.
#
#   scripts/oracles/certificate.sh [-s SAMPLES] [-t TOLERANCE] [-c COUNTS] [MESH ...]
set -eu
cd "$(dirname "$0")/../.."

samples=6000000
tolerance=1e-3
counts="100 1000"
while getopts s:t:c: option; do
    case $option in
        s) samples=$OPTARG ;;
        t) tolerance=$OPTARG ;;
        c) counts=$OPTARG ;;
        *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))
meshes=${MEDIAL_MESHES:-../shared/meshes}
if [ $# = 0 ]; then
    for file in "$meshes"/*.off "$meshes"/*.obj; do
        if [ -e "$file" ]; then set -- "$@" "$file"; fi
    done
fi
if [ $# = 0 ]; then
    echo "skipped: no mesh in $meshes (MEDIAL_MESHES)" >&2
    exit 77
fi

target=${CARGO_TARGET_DIR:-target}
work=$target/oracles
mkdir -p "$work"
if [ -z "${MEDIAL:-}" ]; then
    cargo build --quiet --release -p medial-bench
    MEDIAL=$target/release/medial
fi

status=0
printf '%-14s %7s %11s %11s %11s %9s %10s %s\n' mesh spheres lower sampled upper samples missed verdict
for mesh in "$@"; do
    label=$(basename "$mesh")
    for count in $counts; do
        "$MEDIAL" --quiet simplify "$mesh" --method qmat --spheres "$count" -o "$work/certified.ma" \
            >"$work/certified.log"
        "$MEDIAL" --json evaluate "$mesh" "$work/certified.ma" --certify "$tolerance" \
            --samples "$samples" >"$work/certified.json"
        python3 - "${label%.*}" "$count" "$tolerance" "$work/certified.json" <<'END' || status=1
import json, sys
label, count, tolerance, file = sys.argv[1], sys.argv[2], float(sys.argv[3]), sys.argv[4]
found = json.load(open(file))
lower, upper = found["certified"]["lower"], found["certified"]["upper"]
sampled = found["hausdorff"]
samples = found["samples"] + found["reverse_samples"]
missed = max(0.0, lower - sampled)
# Samples of the strips that METHODOLOGY.md names lie up to 1e-7 deep.
held = lower <= sampled <= upper + 1e-7 and upper - lower <= tolerance
print(f"{label:14} {count:>7} {lower:11.8f} {sampled:11.8f} {upper:11.8f} {samples:>9} {missed:10.1e}",
      "held" if held else "NOT HELD", flush=True)
sys.exit(0 if held else 1)
END
    done
done
rm -f "$work"/certified.*
exit $status
