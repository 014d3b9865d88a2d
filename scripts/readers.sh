#!/bin/sh
# Our .vtp and .glb files in other readers: VTK and trimesh from PyPI, in a virtual environment
# below the build folder, which the test `readers` of medial-bench uses, too. Prints a line for each
# comparison. Exit codes: 0 all agree, 1 some differ, 77 the environment cannot be made.
#
#   scripts/readers.sh
#
# Programs that are there already can be named: MEDIAL, READERS_PYTHON.
set -eu
cd "$(dirname "$0")/.."

work=${CARGO_TARGET_DIR:-target}/readers
mkdir -p "$work"
python=${READERS_PYTHON:-$work/python/bin/python}
if ! "$python" -c 'import vtk, trimesh' 2>/dev/null; then
    python3 -m venv "$work/python" &&
        "$work/python/bin/pip" install --quiet vtk trimesh >"$work/pip.log" 2>&1 || true
fi
if ! "$python" -c 'import vtk, trimesh' 2>"$work/python.log"; then
    echo "skipped: no virtual environment with vtk and trimesh can be made here ($work/pip.log)" >&2
    exit 77
fi
medial=${MEDIAL:-${CARGO_TARGET_DIR:-target}/release/medial}
if [ -z "${MEDIAL:-}" ]; then cargo build --quiet --release -p medial-bench; fi

"$python" -c 'import vtk, trimesh, sys; print("Python", sys.version.split()[0], "vtk", vtk.VTK_VERSION, "trimesh", trimesh.__version__)'
out=$work/files
rm -rf "$out"
failed=0
# `mixed` has everything: faces, an edge without a face, a sphere without an edge.
for shape in mixed torus capsule box pair; do
    mkdir -p "$out/$shape"
    x=$out/$shape/x.ma
    surface=builtin:$shape
    if [ $shape = mixed ]; then
        surface=builtin:box
        printf '6 6 2\nv 0.1 -0.25 0 0.5\nv 1 0 0 0.25\nv 0 0.5 0 0.125\nv 1 0.5 0.25 0.3\nv 1.2 0 0 0.4\nv -1 0.2 0.1 0.3\n%s' \
            'e 0 1
e 0 2
e 1 2
e 1 3
e 2 3
e 3 4
f 0 1 2
f 1 2 3
' >"$x"
    else
        "$medial" simplify "$surface" -m qmat --spheres 60 -q -o "$x" >"$out/log" || test $? -eq 3
    fi
    "$medial" convert "$x" "$out/$shape/plain.vtp" >>"$out/log"
    "$medial" convert "$x" "$out/$shape/stability.vtp" --color stability >>"$out/log"
    "$medial" convert "$x" "$out/$shape/plain.glb" >>"$out/log"
    "$medial" convert "$x" "$out/$shape/stability.glb" --color stability >>"$out/log"
    "$medial" convert "$x" "$out/$shape/error.glb" --color error --mesh "$surface" --spheres >>"$out/log"
    "$python" scripts/readers.py "$x" "$out/$shape"/*.vtp "$out/$shape"/*.glb || failed=1
done
exit $failed
