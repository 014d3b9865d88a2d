#!/bin/sh
# Every metric against an independent second opinion, in one table: sets up what it needs (Open3D, trimesh
# and GUDHI from PyPI in a virtual environment below the build folder; CGAL from Debian: libcgal-dev, libgmp-dev,
# libmpfr-dev, g++, and tetgen), runs all comparisons, and writes the table to oracles.json (and, with DIR,
# into that report) and oracles.md in the build folder's `oracles`. Missing programs count as skipped.
# Exit codes: 0 all that ran agree, 1 some differ.
#
#   scripts/oracles/all.sh [-m MESHES] [DIR]
#
# MESHES: a folder with meshes besides the built-in shapes [default: $MEDIAL_MESHES, if set]. Programs that are
# there already can be named: MEDIAL, DISTANCE_ORACLE (src/bin/distance_oracle.rs), ORACLE_PYTHON.
set -eu
cd "$(dirname "$0")/../.."

meshes=${MEDIAL_MESHES:-}
while getopts m: option; do
    case $option in
        m) meshes=$OPTARG ;;
        *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))
report=${1:-}

target=${CARGO_TARGET_DIR:-target}
work=$target/oracles
mkdir -p "$work"
rows=$work/rows.jsonl
: >"$rows"
medial=${MEDIAL:-$target/release/medial}
if [ -z "${MEDIAL:-}" ]; then cargo build --quiet --release -p medial-bench; fi

say() { # metric oracle input result agrees
    python3 -c 'import json, sys; print(json.dumps(dict(zip(
        ("metric", "oracle", "input", "result", "agrees"), sys.argv[1:]))))' "$@" | tee -a "$rows"
}

python=${ORACLE_PYTHON:-$work/python/bin/python}
if ! "$python" -c 'import open3d, gudhi, trimesh' 2>/dev/null; then
    python3 -m venv "$work/python" &&
        "$work/python/bin/pip" install --quiet open3d gudhi trimesh scipy >"$work/pip.log" 2>&1 || true
fi
has_python=yes
"$python" -c 'import open3d, gudhi, trimesh' 2>"$work/python.log" || has_python=
has_cgal=yes
[ -e /usr/include/CGAL/Polygon_mesh_processing/distance.h ] || has_cgal=

# 1. Closest points, distances and inside tests on the same 100,000 queries.
ours=${DISTANCE_ORACLE:-$target/release/distance_oracle}
if [ -z "${DISTANCE_ORACLE:-}" ]; then cargo build --quiet --release -p medial-oracles --bin distance_oracle; fi
names=torus
if [ -n "$meshes" ]; then names="torus $meshes/bear.off $meshes/abc_bracket.obj"; fi
for name in $names; do
    label=$(basename "$name")
    file=$work/$label.task
    "$ours" make "$name" 100000 "$file"
    "$ours" run "$file" closest "$work/answers" >/dev/null
    if [ $has_cgal ]; then
        if [ ! "$work/distance_cgal" -nt scripts/oracles/distance_cgal.cpp ]; then
            g++ -std=c++17 -O3 -DNDEBUG scripts/oracles/distance_cgal.cpp -o "$work/distance_cgal" \
                -lgmp -lmpfr
        fi
        for mode in closest inside inside-hard; do
            "$ours" run "$file" $mode "$work/answers.$mode" >/dev/null
            "$work/distance_cgal" "$file" $mode "$work/answers.cgal" >/dev/null
            if result=$(scripts/oracles/compare.py "$file" $mode "$work/answers.$mode" "$work/answers.cgal"); then
                agrees=yes
            else
                agrees=no
            fi
            case $mode in
                closest) say "distance to the surface" "CGAL AABB_tree" "$label" "$result" $agrees ;;
                *) say "inside test ($mode)" "CGAL Side_of_triangle_mesh" "$label" "$result" $agrees ;;
            esac
        done
    else
        say "distance to the surface" "CGAL" "$label" "libcgal-dev is missing" skipped
    fi
    if [ $has_python ]; then
        "$python" scripts/oracles/distance.py "$file" "$work/answers" "$label" | tee -a "$rows"
    else
        say "distance to the surface" "Open3D" "$label" "$(tail -n 1 "$work/python.log")" skipped
    fi
    rm -f "$file" "$work"/answers*
done

# 2. Everything that `medial evaluate` prints.
if [ $has_cgal ] && [ ! "$work/hausdorff_cgal" -nt scripts/oracles/hausdorff_cgal.cpp ]; then
    g++ -std=c++17 -O3 -DNDEBUG scripts/oracles/hausdorff_cgal.cpp -o "$work/hausdorff_cgal" -lgmp -lmpfr
fi
names="builtin:box builtin:torus builtin:bracket"
if [ -n "$meshes" ]; then names="$names $meshes/bear.off $meshes/fertility.off"; fi
for name in $names; do
    label=$(basename "$name")
    if [ ! $has_python ]; then
        say "all metrics" "Open3D, GUDHI, NumPy" "$label" "$(tail -n 1 "$work/python.log")" skipped
        continue
    fi
    case $name in
        builtin:*) "$medial" datasets make "${name#builtin:}" -o "$work/mesh.off" >/dev/null ;;
        *) "$medial" convert "$name" "$work/mesh.off" >/dev/null ;;
    esac
    for method in qmat angle; do
        "$medial" --quiet simplify "$work/mesh.off" --method $method --spheres 150 -o "$work/axis.ma" >/dev/null
        "$medial" --json evaluate "$work/mesh.off" "$work/axis.ma" --certify 1e-3 >"$work/evaluation.json"
        more=
        if [ $method = qmat ] && [ $has_cgal ]; then
            # A surface to compare with, from our own routes: the boundary of the union.
            "$medial" --quiet reconstruct "$work/axis.ma" --mesh "$work/mesh.off" --tolerance 0.03 \
                -o "$work/other.off" >/dev/null
            # A surface is evaluated as a medial mesh with radii of zero.
            "$medial" --json evaluate "$work/mesh.off" "$work/other.off" --samples 200000 >"$work/baseline.json"
            diagonal=$("$medial" --json info "$work/mesh.off" |
                python3 -c 'import json, sys; print(1e-4 * json.load(sys.stdin)["diagonal"])')
            "$work/hausdorff_cgal" "$work/mesh.off" "$work/other.off" "$diagonal" >"$work/hausdorff.txt"
            more="$work/other.off $work/baseline.json $work/hausdorff.txt"
        fi
        # shellcheck disable=SC2086 # a list of files without spaces
        "$python" scripts/oracles/metrics.py "$work/mesh.off" "$work/axis.ma" "$work/evaluation.json" \
            "$label, $method" $more | tee -a "$rows"
    done
done

# 3. One-sided errors of spheres, by a million points each, and certified intervals of filled cavities.
# shellcheck disable=SC2086 # a list of files without spaces
"$python" scripts/oracles/cover.py "$medial" "$work" $names >"$work/cover.txt" || true
tail -n 1 "$work/cover.txt" | tee -a "$rows"
"$python" scripts/oracles/cavities.py "$medial" "$work" >"$work/cavities.txt" || true
tail -n 1 "$work/cavities.txt" | tee -a "$rows"

# 4. The triangulation that the initial medial mesh is made of.
for name in $names; do
    label=$(basename "$name")
    if [ ! $has_python ] || ! command -v tetgen >/dev/null; then
        say "cells inside" "TetGen -pD" "$label" "tetgen or NumPy is missing" skipped
    elif result=$("$python" scripts/oracles/conforming.py "$medial" "$name"); then
        say "cells inside" "TetGen -pD" "$label" "${result#*: }" yes
    else
        say "cells inside" "TetGen -pD" "$label" "${result#*: }" no
    fi
done

# 5. What the test suite compares by brute force or closed form.
while IFS='|' read -r metric oracle input; do
    say "$metric" "$oracle" "$input" "cargo test" "in the test suite"
done <<'END'
distance to cone and slab|brute force over interpolated spheres|tests/it/signed_distance.rs: all degenerate classes
distance to the true axis|closed forms|src/metrics/axis_distance.rs: segments, shifted axes
certified interval|exact distances|src/metrics/certificate/tests.rs: spheres, cones, slabs in boxes and spheres
distance between surfaces|closed forms, brute force|tests/it/surface_distance.rs: boxes, random soups
spike measures|a flood from the boundary|src/metrics/spikes_tests.rs: random complexes
Betti numbers|ranks of dense matrices|src/complex/topology_tests.rs: random complexes
volume difference|closed forms|tests/it/metric_distances.rs: ball in ball, box
END

python3 - "$rows" "$work/oracles.json" "$work/oracles.md" <<'END'
import datetime, json, sys
rows = [json.loads(line) for line in open(sys.argv[1])]
made = f"Made by scripts/oracles/all.sh, {datetime.date.today()}."
json.dump({"made": made, "rows": rows}, open(sys.argv[2], "w"), indent=1)
cell = lambda text: text.replace("|", "\\|")
with open(sys.argv[3], "w") as out:
    out.write(f"# Oracles\n\n{made}\n\n| metric | second opinion | input | result | agrees |\n|---|---|---|---|---|\n")
    for row in rows:
        out.write("| " + " | ".join(cell(row[k]) for k in ("metric", "oracle", "input", "result", "agrees")) + " |\n")
END
rm -f "$work"/mesh.off "$work"/other.off "$work"/axis.ma "$work"/*.json.tmp
if [ -n "$report" ]; then
    mkdir -p "$report"
    cp "$work/oracles.json" "$report/oracles.json"
    if [ -e "$report/results.jsonl" ]; then "$medial" report "$report"; fi
fi
echo "$(wc -l <"$rows") rows in $work/oracles.md"
if grep -q '"agrees": "no"' "$rows"; then exit 1; fi
