#!/usr/bin/env python3
"""Compare results with the figures that papers print, one table a paper.

    scripts/published.py run [PAPER...] [--meshes FOLDER] [--medial PROGRAM] [--out FOLDER]
    scripts/published.py [PAPER...] [--out FOLDER]        # Markdown tables of the results there

`run` executes one `medial compare` for each row, into FOLDER/PAPER-NUMBER, and repeats nothing that is
there. Most meshes of the papers are not available: a row names the mesh that stands in, resampled to the
same size. Seconds of different decades compare as ratios only.
Papers: qmat-1 qmat-2 pmat dey-zhao tam-heidrich.
"""

import argparse
import csv
import os
import subprocess
import sys
from pathlib import Path


def seconds(*names):
    """The sum of timing columns of a row."""
    return lambda row: sum(float(row.get(name) or 0) for name in names)


def column(name, scale=1):
    return lambda row: scale * float(row[name])


def method(name, levels="", **params):
    """A `[[method]]` table of a study file. Numbers and lists of numbers are also TOML."""
    pairs = ", ".join(f"{key} = {value}" for key, value in params.items())
    return f'[[method]]\nid = "{name}"\n{levels}\nparams = {{ {pairs} }}\n'


METHOD = seconds("seconds_prepare", "seconds_simplify")
INITIAL = ("initial spheres", column("initial_spheres"))


# For each paper: its source, the common part of its study files, its columns (title, value, the method
# to read it from), and its rows (label, mesh, samples or None for its vertices, methods, figures).
def table(source, study, columns, rows):
    return {"source": source, "study": study, "columns": columns, "rows": rows}


PUBLISHED_LEVEL = "published = true\n"


PAPERS = {
    "qmat-1": table(
        "Li et al. 2015, Q-MAT, Table I: triangle angles of the Plane at 5,000 spheres, by k "
        "(the paper prints no values of k)",
        "spheres = [5000]\n",
        [INITIAL + ("qmat",),
         ("mean smallest angle, degrees", column("min_angle_mean"), "qmat"),
         ("mean largest angle, degrees", column("max_angle_mean"), "qmat"),
         ("smallest angle under 30 degrees, %", column("below_30", 100), "qmat")],
        [(f"Fig. 7({letter}), k = {k}", "plane.off", None, method("qmat", k=k, topology_from=200),
          figures)
         for letter, k, figures in (("b", "1e-3", [20806, 18.55, 108.98, 78.3]),
                                    ("c", "1e-4", [20806, 20.99, 106.55, 72.2]),
                                    ("d", "1e-5", [20806, 25.19, 101.76, 61.1]))]),
    "qmat-2": table(
        "Li et al. 2015, Q-MAT, Table II: seconds to 100 spheres (Intel i5, 2.5 GHz)",
        "spheres = [100]\n",
        [INITIAL + ("qmat",), ("HEM, s", METHOD, "hem"), ("Q-MAT, s", METHOD, "qmat")],
        [(label, mesh, samples, method("hem") + method("qmat", topology_from=200), figures)
         for label, mesh, samples, figures in (
             ("Ant", "ant12.off", 8670, [29703, 142.3, 4.0]),
             ("Bear (the paper's)", "bear.off", None, [34703, 229.7, 5.5]),
             ("Venus", "maxplanck.obj", 22309, [74998, 684.0, 11.9]),
             ("Plane", "plane.off", 6272, [20806, 118.2, 2.5]),
             ("Dolphin (the paper's)", "dolphin.off", None, [54241, 386.2, 9.5]),
             ("Octopus", "scorpion.obj", 12176, [39342, 230.0, 5.4]))]),
    "pmat": table(
        "Faraj, Thiery, Boubekeur 2013, PMAT, Table 1: the whole hierarchy, and distances at the scale "
        "s (Intel Core2 Duo, 2.5 GHz). Scales suit the paper's models, so that distances compare in kind",
        "spheres = []\n",
        [INITIAL + ("pmat",),
         ("hierarchy, s", seconds("seconds_prepare"), "pmat"),
         ("Hausdorff, %", column("hausdorff", 100), "pmat"),
         ("SAT Hausdorff, %", column("hausdorff", 100), "sat"),
         ("SAT, s", METHOD, "sat")],
        [(f"{name}, s = {s}", mesh, count,
          method("pmat", f"levels = [{s}]") + method("sat", f"levels = [{s}]"), figures)
         for name, mesh, count, s, figures in (
             ("Chair", "abc_thin.obj", 305000, 2.32, [1014760, 68.23, 1.02, 1.2, 51.22]),
             ("Chair", "abc_thin.obj", 305000, 4.99, [1014760, 68.23, 1.61, 3.3, 13.1]),
             ("Chair", "abc_thin.obj", 305000, 17.38, [1014760, 68.23, 2.5, 12.77, 0.33]),
             ("Lady", "fertility.off", 71500, 1.35, [243400, 15.2, 1.65, 2.11, 16.18]),
             ("Lady", "fertility.off", 71500, 1.95, [243400, 15.2, 5.18, 5.17, 5.39]),
             ("Lady", "fertility.off", 71500, 3.59, [243400, 15.2, 7.95, 7.66, 0.43]),
             ("Amphora", "threeholes.off", 42100, 1.18, [141918, 11.15, 1.39, 3.15, 13.84]),
             ("Amphora", "threeholes.off", 42100, 1.32, [141918, 11.15, 3.72, 4.52, 9.18]),
             ("Amphora", "threeholes.off", 42100, 1.57, [141918, 11.15, 6.05, 6.77, 5.43]),
             ("Plane", "plane.off", 75000, 1.83, [253578, 15.1, 0.52, 1.32, 17.38]),
             ("Plane", "plane.off", 75000, 3.58, [253578, 15.1, 2.46, 3.59, 3.27]),
             ("Plane", "plane.off", 75000, 6.57, [253578, 15.1, 9.54, 9.9, 0.77]))]),
    "dey-zhao": table(
        "Dey, Zhao 2002, Approximate medial axis as a Voronoi subcomplex, Table 1: seconds by number of "
        "points (PC, 933 MHz). The filter is all selection of facets, without the inside test",
        PUBLISHED_LEVEL,
        [("Delaunay, s", seconds("substrate_delaunay"), "dey-zhao"),
         ("filter, s", seconds("substrate_facets", "seconds_prepare", "seconds_simplify"), "dey-zhao")],
        [(f"{name}, {count:,} points", mesh, count, method("dey-zhao"), figures)
         for name, mesh, count, figures in (
            ("3HOLE", "threeholes.off", 4000, [2.37, 0.82]),
            ("KNOT", "builtin:coil", 10001, [8.36, 2.66]),
            ("ENGINE", "casting.off", 11361, [37.0, 1.82]),
            ("MANNEQUIN", "maxplanck.obj", 12773, [7.79, 2.28]),
            ("FANDISK", "abc_bracket.obj", 16475, [13.4, 3.0]),
            ("CLUB", "bear.off", 16865, [18.81, 3.06]),
            ("FOOT", "bear.off", 20021, [13.24, 3.71]),
            ("HAND", "ant12.off", 25626, [51.14, 5.11]),
            ("SCREWDRIVER", "screwdriver.off", 27152, [51.87, 5.36]),
            ("DINOSAUR", "scorpion.obj", 28098, [23.28, 5.8]),
            ("HEART", "dolphin.off", 37912, [32.49, 6.58]),
            ("ROCKER", "fertility.off", 40177, [74.54, 8.25]),
            ("FEMALE", "fertility.off", 121723, [292.85, 24.95]))]),
    "tam-heidrich": table(
        "Tam, Heidrich 2003, Shape simplification based on the medial axis transform, Table 1: seconds "
        "for the axis of the union of polar balls, and for pruning it (Pentium 4, 2.0 GHz)",
        PUBLISHED_LEVEL,
        [("axis, s", seconds("substrate_delaunay", "substrate_surface_tree", "substrate_inside",
                             "seconds_prepare"), "tam-heidrich"),
         ("pruning, s", seconds("seconds_simplify"), "tam-heidrich")],
        [(f"{name}, {count:,} points", mesh, count,
          method("tam-heidrich", t_t_rounds=rounds, drop=0.0, t_v=volumes), figures)
         for name, mesh, count, rounds, volumes, figures in (
            ("Tweety", "bear.off", 48668, 3, [1.0, 1.0], [186, 205]),
            ("Max Planck", "maxplanck.obj", 25044, 2, [1.0, 1.0], [57, 92]),
            ("Hip bone", "fertility.off", 70688, 3, [5.0, 5.0, 5.0], [348, 354]),
            ("Bunny", "dolphin.off", 34835, 2, [1.0, 10.0], [103, 136]))]),
}


def run(paper, name, number, options):
    label, mesh, samples, methods, _ = paper["rows"][number]
    source = mesh if mesh.startswith("builtin:") else str((options.meshes / mesh).absolute())
    # Papers start from the vertices alone.
    sampling = f"sampling = '{f'blue:{samples}' if samples else 'vertices'}'\n"
    folder = options.out / f"{name}-{number}"
    study = options.out / f"{name}-{number}.toml"
    options.out.mkdir(parents=True, exist_ok=True)
    study.write_text(f"meshes = ['{source}']\ntimeout = 3600\nbudget = 3600\ncounts_only = true\n{sampling}"
                     + paper["study"] + methods)
    print(f"{name}: {label}", file=sys.stderr)
    command = [options.medial, "compare", "--study", study, "--out", folder, "--quiet"]
    # 3: some results have another count, which the table shows.
    code = subprocess.run(command, stdout=subprocess.DEVNULL).returncode
    if code not in (0, 3):
        print(f"{name}: {label}: exit code {code}", file=sys.stderr)


def measured(folder, method, value):
    """The value of the first result of a method; None where there is none."""
    try:
        with open(folder / "results.csv", newline="") as file:
            rows = [row for row in csv.DictReader(file)
                    if row["method"] == method and row["status"] in ("ok", "other_count")]
        return value(rows[0])
    except (OSError, IndexError, KeyError, ValueError):
        return None


def show(value):
    if value is None:
        return "-"
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def print_table(paper, name, out):
    titles = [title for title, _, _ in paper["columns"]]
    print(f"## {paper['source']}\n")
    print("| model | on | " + " | ".join(f"{title}: published | ours" for title in titles) + " |")
    print("| --- | --- " + "| ---: " * (2 * len(titles)) + "|")
    for number, (label, mesh, samples, _, figures) in enumerate(paper["rows"]):
        cells = []
        for (_, value, method), figure in zip(paper["columns"], figures, strict=True):
            cells += [show(figure), show(measured(out / f"{name}-{number}", method, value))]
        source = f"{mesh}, blue:{samples}" if samples else mesh
        print(f"| {label} | {source} | " + " | ".join(cells) + " |")
    print()


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*", metavar="run | PAPER")
    parser.add_argument("--meshes", type=Path, default=Path(os.environ.get("MEDIAL_MESHES", "meshes")))
    parser.add_argument("--medial", default="target/release/medial")
    parser.add_argument("--out", type=Path, default=Path("medial-published"))
    options = parser.parse_args()
    names = [word for word in options.words if word != "run"] or list(PAPERS)
    for name in names:
        if name not in PAPERS:
            parser.error(f"{name}: no such paper; there are {' '.join(PAPERS)}")
        paper = PAPERS[name]
        if "run" in options.words:
            for number in range(len(paper["rows"])):
                run(paper, name, number, options)
        print_table(paper, name, options.out)


if __name__ == "__main__":
    main()
