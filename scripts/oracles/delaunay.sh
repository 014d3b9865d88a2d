#!/bin/sh
# Compares medial's triangulation with CGAL's on the same points: number and set of cells, seconds,
# memory above the input; names that begin with w: are weighted. Runs alternate, and the best of
# each side counts: CPU seconds of one thread, or with -p seconds by the clock of two threads, for
# CGAL under its Parallel_tag. Exit codes: 0 all sets agree, 1 some differ, 77 CGAL is missing
# (Debian: libcgal-dev libtbb-dev libgmp-dev libmpfr-dev).
#
#   scripts/oracles/delaunay.sh [-p] [-r ROUNDS] [NAME ...]
set -eu
cd "$(dirname "$0")/../.."

rounds=3
threads=1
while getopts pr: option; do
    case $option in
        p) threads=2 ;;
        r) rounds=$OPTARG ;;
        *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))
export RAYON_NUM_THREADS=$threads
if [ $threads = 2 ]; then
    default="cube-1000000 surface-1000000"
else
    default="cube-100000 surface-100000 cube-1000000 surface-1000000 sphere-100000 \
        lattice-30 box-100 box-128 icosphere-6 icosphere-7 cylinder-200 \
        w:cube-100000 w:surface-100000 w:cube-1000000 w:lattice-30 w:box-100 w:icosphere-6 \
        w:cylinder-200"
fi
sets=${*:-$default}

work=${CARGO_TARGET_DIR:-target}/oracles
mkdir -p "$work"
if [ ! -e /usr/include/CGAL/Delaunay_triangulation_3.h ]; then
    echo "skipped: CGAL is not installed (libcgal-dev)" >&2
    exit 77
fi
if [ ! "$work/delaunay_cgal" -nt scripts/oracles/delaunay_cgal.cpp ]; then
    g++ -std=c++17 -O3 -DNDEBUG -DCGAL_LINKED_WITH_TBB scripts/oracles/delaunay_cgal.cpp \
        -o "$work/delaunay_cgal" -ltbb -ltbbmalloc -lgmp -lmpfr -pthread
fi
cargo build --quiet --release -p medial-oracles --bin delaunay_oracle
ours=${CARGO_TARGET_DIR:-target}/release/delaunay_oracle

status=0
printf '%-18s %9s %10s %10s %7s %9s %9s\n' points cells 'medial s' 'CGAL s' ratio 'medial MB' 'CGAL MB'
for name in $sets; do
    file=$work/$name.f64
    scripts/oracles/points.py "$name" "$file"
    case $name in w:*) mode=weighted ;; *) mode= ;; esac
    cgal_mode=$mode
    if [ $threads = 2 ]; then cgal_mode=parallel; fi
    : >"$work/a"
    : >"$work/b"
    i=0
    while [ $i -lt "$rounds" ]; do
        "$ours" "$file" $mode >>"$work/a"
        "$work/delaunay_cgal" "$file" 1 $cgal_mode >>"$work/b"
        i=$((i + 1))
    done
    sort -k3,3g "$work/a" | head -n 1 >"$work/a1"
    sort -k3,3g "$work/b" | head -n 1 >"$work/b1"
    read -r cells_a set_a seconds_a kib_a <"$work/a1"
    read -r cells_b set_b seconds_b kib_b <"$work/b1"
    verdict=
    if [ "$cells_a $set_a" != "$cells_b $set_b" ]; then
        verdict="DIFFERENT: CGAL has $cells_b cells"
        status=1
    fi
    ratio=$(awk "BEGIN { printf \"%.2f\", $seconds_a / $seconds_b }")
    printf '%-18s %9s %10s %10s %7s %9d %9d %s\n' "$name" "$cells_a" "$seconds_a" "$seconds_b" \
        "$ratio" $((kib_a / 1024)) $((kib_b / 1024)) "$verdict"
    rm -f "$file"
done
exit $status
