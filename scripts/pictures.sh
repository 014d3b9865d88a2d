#!/bin/sh
# Makes the pictures of README.md and docs/ from built-in shapes, in about 30 seconds.
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

# Panels take their captions from the names of the files. One scale for all panels of a picture.
three() {
    for method in qmat hem tight; do
        "$medial" simplify "builtin:$1" --method "$method" --spheres 100 -o "$work/$method.ma"
    done
    "$medial" render "builtin:$1" "$work/qmat.ma" "$work/hem.ma" "$work/tight.ma" \
        --show error --max-error "$2" --size 360x270 -o "$folder/three-methods-$1.png"
}
three bracket 0.01
three blob 0.004

for fit in outside inside balanced; do
    "$medial" simplify builtin:bracket --method cover --spheres 32 --set fit=$fit -o "$work/$fit.yaml"
done
"$medial" render builtin:bracket "$work/outside.yaml" "$work/inside.yaml" "$work/balanced.yaml" \
    --show error --max-error 0.05 --size 262x200 -o "$folder/spheres.png"
