#!/bin/sh
# The reference comparison of README: all methods on real meshes, at equal numbers of spheres.
#
#   scripts/reference.sh FOLDER MESH...
#
# Adds what is missing to the results in FOLDER (about half an hour for twelve meshes of 10,000 vertices, most of it for
# `tight`), and copies its tables and its plot to docs/reference/. The page with everything is FOLDER/index.html.
# MEDIAL names another program than target/release/medial.
set -eu

if [ $# -lt 2 ]; then
    sed -n '2,9s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
folder=$1
shift
here=$(dirname "$0")/..
medial=${MEDIAL:-$here/target/release/medial}
methods=angle,lambda,dey-zhao,qmat,pmat,hem,sat,sat-pairwise,tam-heidrich,aof,tight

# Exit code 3: some methods cannot meet every number of spheres, which the tables tell.
"$medial" compare "$@" --methods "$methods" --spheres 1000,500,100 --counts-only --threads 1 \
    --timeout 900 --out "$folder" -q || [ $? -eq 3 ]

mkdir -p "$here/docs/reference"
for table in overview-purpose overview-scaling summary; do
    cp "$folder/tables/$table.md" "$here/docs/reference/$table.md"
done
cp "$folder/plots/overview-hausdorff.svg" "$folder/plots/overview-scaling.svg" "$here/docs/reference/"
