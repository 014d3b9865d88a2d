#!/bin/sh
# The reference comparison (docs/measured/reference.md): all methods on real meshes, at equal counts and at equal error.
#
#   scripts/reference.sh FOLDER MESH...
#
# Adds missing results to FOLDER: about half an hour for twelve meshes of 10,000 vertices, most of it for `tight`.
# FOLDER/index.html and FOLDER/tables/ have the result. MEDIAL names another program than target/release/medial.
set -eu
if [ $# -lt 2 ]; then
    sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
folder=$1
shift
medial=${MEDIAL:-$(dirname "$0")/../target/release/medial}
methods=angle,lambda,dey-zhao,qmat,pmat,hem,sat,sat-pairwise,tam-heidrich,aof

# Exit code 3: a run failed, which the tables show.
compare() { "$medial" compare "$@" --counts-only --threads 1 --out "$folder" -q || [ $? -eq 3 ]; }
compare "$@" --methods "$methods,tight" --spheres 1000,500,100 --timeout 900 --budget 900
compare "$@" --methods "$methods" --spheres 100 --max-error 0.02,0.01,0.005,0.002 --samples 10000 --timeout 1800 --budget 1800
