#!/bin/sh
# Compares medial's closest points on the spheres of voxels with CGAL's, its fluxes AOF' with those
# from Open3D's closest points, and its time with that of one batched call of Open3D with as many
# threads. Runs alternate, and the best of each side counts. NAME: a built-in shape or a mesh file.
# Exit codes: 0 all answers agree, 1 some differ, 77 Open3D or CGAL is missing (Debian: python3-venv,
# libusb-1.0-0, libgl1, libcgal-dev, libgmp-dev, libmpfr-dev; Open3D itself comes from PyPI into a
# virtual environment below the build folder).
#
#   scripts/oracles/flux.sh [-n VOXELS] [-l RESOLUTION] [-r ROUNDS] [-t THREADS] [NAME ...]
set -eu
cd "$(dirname "$0")/../.."

voxels=20000
resolution=120
rounds=3
threads=2
while getopts n:l:r:t: option; do
    case $option in
        n) voxels=$OPTARG ;;
        l) resolution=$OPTARG ;;
        r) rounds=$OPTARG ;;
        t) threads=$OPTARG ;;
        *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))
if [ $# = 0 ]; then set -- box bracket torus; fi
export RAYON_NUM_THREADS="$threads"

target=${CARGO_TARGET_DIR:-target}
work=$target/oracles
mkdir -p "$work"
python=${FLUX_PYTHON:-$work/open3d/bin/python}
if [ ! -x "$python" ]; then
    python3 -m venv "$work/open3d" && "$work/open3d/bin/pip" install --quiet open3d || {
        echo "skipped: Open3D could not be installed" >&2
        exit 77
    }
fi
if ! "$python" -c 'import open3d' 2>"$work/open3d.log"; then
    echo "skipped: Open3D does not load: $(tail -n 1 "$work/open3d.log")" >&2
    exit 77
fi
if [ ! -e /usr/include/CGAL/AABB_tree.h ]; then
    echo "skipped: CGAL is not installed (libcgal-dev)" >&2
    exit 77
fi
if [ ! "$work/distance_cgal" -nt scripts/oracles/distance_cgal.cpp ]; then
    g++ -std=c++17 -O3 -DNDEBUG scripts/oracles/distance_cgal.cpp -o "$work/distance_cgal" \
        -lgmp -lmpfr
fi
cargo build --quiet --release -p medial-oracles
ours=$target/release/flux_oracle

status=0
for name in "$@"; do
    label=$(basename "$name")
    file=$work/$label.flux
    "$ours" make "$name" "$resolution" "$voxels" "$file"
    "$ours" run "$file" "$work/answers"
    "$work/distance_cgal" "$file" closest "$work/answers.cgal" >/dev/null
    printf '%s, CGAL: ' "$label"
    scripts/oracles/compare.py "$file" closest "$work/answers" "$work/answers.cgal" || status=1
    rm -f "$work/time.ours" "$work/time.open3d"
    i=0
    while [ $i -lt "$rounds" ]; do
        "$ours" time "$name" "$resolution" >>"$work/time.ours"
        "$python" scripts/oracles/flux.py "$file" "$work/answers" "$threads" 1 \
            >>"$work/time.open3d" || status=1
        i=$((i + 1))
    done
    best=$(sort -g "$work/time.ours" | head -n 1)
    echo "$best $(sort -g "$work/time.open3d" | head -n 1)" | awk -v label="$label" '{
        ours = $3 * $4 / $1; theirs = $6 / $5
        printf "%s, Open3D: fluxes within %s, %d ties of %d voxels, %d fan samples; ", label, $9, $7, $8, $10
        printf "samples a second: medial %.2e, Open3D %.2e, ratio %.1f\n", ours, theirs, ours / theirs
    }'
    rm -f "$file" "$file.voxels" "$work"/answers* "$work"/time.*
done
exit $status
