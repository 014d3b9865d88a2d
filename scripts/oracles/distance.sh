#!/bin/sh
# Compares medial's closest points and inside test with CGAL's on the same mesh and points: answers,
# then queries a second of one thread, in CPU time. Runs alternate, and the best of each side
# counts. Names: torus (100,352 triangles), or mesh files. Exit codes: 0 all answers agree, 1 some
# differ, 77 CGAL is missing (Debian: libcgal-dev libgmp-dev libmpfr-dev).
#
#   scripts/oracles/distance.sh [-n QUERIES] [-r ROUNDS] [NAME ...]
set -eu
cd "$(dirname "$0")/../.."

rounds=3
queries=100000
while getopts n:r: option; do
    case $option in
        n) queries=$OPTARG ;;
        r) rounds=$OPTARG ;;
        *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))
if [ $# = 0 ]; then set -- torus; fi
export RAYON_NUM_THREADS=1

work=${CARGO_TARGET_DIR:-target}/oracles
mkdir -p "$work"
if [ ! -e /usr/include/CGAL/AABB_tree.h ]; then
    echo "skipped: CGAL is not installed (libcgal-dev)" >&2
    exit 77
fi
if [ ! "$work/distance_cgal" -nt scripts/oracles/distance_cgal.cpp ]; then
    g++ -std=c++17 -O3 -DNDEBUG scripts/oracles/distance_cgal.cpp -o "$work/distance_cgal" \
        -lgmp -lmpfr
fi
cargo build --quiet --release -p medial-oracles --bin distance_oracle
ours=${CARGO_TARGET_DIR:-target}/release/distance_oracle
theirs=$work/distance_cgal

# Best seconds of a file of runs: first those for the queries, then those before.
best() {
    sort -k1,1g "$1" | head -n 1 | cut -d ' ' -f 1
    sort -k2,2g "$1" | head -n 1 | cut -d ' ' -f 2
}

status=0
printf '%-12s %-15s %11s %11s %7s %8s %8s\n' mesh 'CGAL mode' 'medial /s' 'CGAL /s' ratio \
    'build s' 'CGAL s'
for name in "$@"; do
    label=$(basename "$name")
    file=$work/$label.task
    "$ours" make "$name" "$queries" "$file"
    for mode in closest inside inside-hard; do
        case $mode in
            closest) cgal_modes="closest closest-simple closest-hinted" ;;
            *) cgal_modes=$mode ;;
        esac
        rm -f "$work"/runs.*
        i=0
        while [ $i -lt "$rounds" ]; do
            "$ours" run "$file" $mode "$work/answers" >>"$work/runs.ours"
            for cgal in $cgal_modes; do
                "$theirs" "$file" "$cgal" "$work/answers.$cgal" >>"$work/runs.$cgal"
            done
            i=$((i + 1))
        done
        seconds=$(best "$work/runs.ours")
        for cgal in $cgal_modes; do
            echo "$seconds $(best "$work/runs.$cgal")" | tr '\n' ' ' |
                awk -v n="$queries" -v mesh="$label" -v mode="$cgal" '{
                    printf "%-12s %-15s %11d %11d %7.2f %8.3f %8.3f\n",
                        mesh, mode, n / $1, n / $3, $3 / $1, $2, $4 }'
            scripts/oracles/compare.py "$file" $mode "$work/answers" "$work/answers.$cgal" || status=1
        done
    done
    rm -f "$file" "$work"/answers* "$work"/runs.*
done
exit $status
