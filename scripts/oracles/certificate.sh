#!/bin/sh
# Checks certified intervals: each mesh, simplified by Q-MAT to each number of spheres, certified and sampled by
# the same program run; the default makes about ten million samples both ways together. To the samples comes
# the certificate's own witness, measured again by witness.py: it must be on its surface, at the distance of the
# interval's lower end, or inside the union and no deeper in one primitive. The largest of all these must lie in the interval; `missed` is what the samples alone
# fall short of its lower end. Prints one row for each case. Exit codes: 0 every interval holds its
# estimate, 1 one does not, 77 there is no mesh.
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
printf '%-14s %7s %11s %11s %11s %11s %9s %10s %s\n' \
    mesh spheres lower witness sampled upper samples missed verdict
for mesh in "$@"; do
    label=$(basename "$mesh")
    for count in $counts; do
        "$MEDIAL" --quiet simplify "$mesh" --method qmat --spheres "$count" -o "$work/certified.ma" \
            >"$work/certified.log"
        "$MEDIAL" --json evaluate "$mesh" "$work/certified.ma" --certify "$tolerance" \
            --samples "$samples" >"$work/certified.json"
        witness=$(python3 scripts/oracles/witness.py "$mesh" "$work/certified.ma" "$work/certified.json")
        python3 - "${label%.*}" "$count" "$tolerance" "$work/certified.json" $witness <<'END' || status=1
import json, sys
label, count, tolerance, file = sys.argv[1], sys.argv[2], float(sys.argv[3]), sys.argv[4]
off, witness = map(float, sys.argv[5:7])
found = json.load(open(file))
lower, upper = found["certified"]["lower"], found["certified"]["upper"]
sampled = found["hausdorff"]
samples = found["samples"] + found["reverse_samples"]
missed = max(0.0, lower - sampled)
# Samples of the strips that METHODOLOGY.md names lie up to 1e-7 deep; the files have 17 digits.
rounding = 4e-9
held = off <= rounding and witness <= lower + rounding
held = held and (sys.argv[7] == "inside" or witness >= lower - rounding)
held = held and lower - rounding <= max(sampled, witness) <= upper + 1e-7
held = held and upper - lower <= tolerance
print(f"{label:14} {count:>7} {lower:11.8f} {witness:11.8f} {sampled:11.8f} {upper:11.8f} {samples:>9}",
      f"{missed:10.1e}", "held" if held else "NOT HELD", flush=True)
sys.exit(0 if held else 1)
END
    done
done
rm -f "$work"/certified.*
exit $status
