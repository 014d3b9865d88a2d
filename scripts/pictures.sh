#!/bin/sh
# Makes the pictures of README.md and docs/ from built-in shapes, in about ten seconds.
#
#   scripts/pictures.sh [FOLDER]      FOLDER: where they are written [docs]
#
# MEDIAL names another program than target/release/medial.
set -eu
cd "$(dirname "$0")/.."
folder=${1:-docs}
medial=${MEDIAL:-target/release/medial}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Panels take their captions from the names of the files.
for method in qmat hem tight; do
    "$medial" simplify builtin:bracket --method "$method" --spheres 40 -o "$work/$method.ma"
done
# One scale for all panels, wide enough to tell two large errors from each other.
"$medial" render builtin:bracket "$work/qmat.ma" "$work/hem.ma" "$work/tight.ma" \
    --show error --max-error 0.02 --size 360x270 -o "$folder/three-methods.png"
