#!/usr/bin/env python3
"""Repeats the comparison of Coverage Axis, Coverage Axis++ and VMAS, as far as their meshes can be had.

    scripts/rivals.py FOLDER [OUT]

FOLDER has the models of these papers (ant12, bear, dolphin, fertility, threeholes; recognised by their content, see
docs/datasets.md). OUT (default: rivals) gets the report of `medial compare --study scripts/rivals.toml`, and `rivals.md`: the
figures of the authors' programs beside ours, and the numbers by the definitions of their papers. The same call again goes on
where the last one ended. By the environment: MEDIAL (target/release/medial).
"""

import json
import math
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
MEDIAL = os.environ.get("MEDIAL", str(ROOT / "target/release/medial"))
MESHES = ["ant12", "bear", "dolphin", "fertility", "threeholes"]

# Measured by this project's judge (20,000 samples) on the output of a transcription of the authors' Python, 1,500
# samples, seed 1 of NumPy, all Voronoi vertices, connection by regions, dilation 0.02 / 1.3 of the diagonal:
# spheres, symmetric Hausdorff and mean error in % of the diagonal, seconds.
COVERAGE_PLUS = {
    "ant12": (78, 2.01, 0.308, 7.2),
    "fertility": (91, 2.79, 0.372, 9.3),
    "threeholes": (99, 1.80, 0.324, 6.4),
    "bear": (49, 3.15, 0.524, 17.7),
}
DILATION_OF_DIAGONAL = 0.02 / 1.3
SEEDS = range(5)

# The same judge on the output of the authors' program without its window, on the vertices, lambda 0.2: by spheres asked
# Hausdorff, mean, spheres delivered, Euler number, seconds at most.
VMAS = {
    ("bear", 100): (0.91, 0.167, 100, 32, 2.7),
    ("bear", 500): (0.66, 0.061, 331, 240, 124),
    ("dolphin", 100): (0.72, 0.101, 100, 9, 3.4),
    ("dolphin", 500): (0.25, 0.026, 500, 135, 88),
    ("fertility", 100): (1.79, 0.234, 100, 24, 1.3),
    ("fertility", 500): (1.43, 0.114, 251, 132, 54),
    ("threeholes", 100): (1.25, 0.257, 100, 15, 0.7),
    ("threeholes", 500): (0.67, 0.108, 317, 219, 39),
}


def medial(*words):
    """The JSON that a verb prints."""
    done = subprocess.run([MEDIAL, *map(str, words), "--json"], stdout=subprocess.PIPE, check=False)
    if done.returncode not in (0, 3):
        sys.exit(f"{' '.join(map(str, words))}: exit code {done.returncode}")
    return json.loads(done.stdout)


def geometric_mean(ratios):
    return math.exp(sum(map(math.log, ratios)) / len(ratios))


def recognise(folder):
    """Takes the models of the folder into the library; those of other papers too, which does no harm."""
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() in (".off", ".obj", ".ply"):
            subprocess.run([MEDIAL, "datasets", "add", path, "--quiet"], stdout=subprocess.DEVNULL, check=True)


def sides_in_diagonal(mesh, work):
    """The diagonal of a mesh in longest sides."""
    axis = work / f"{mesh}.ma"
    medial("simplify", f"dataset:{mesh}", "-m", "qmat", "--spheres", 50, "-o", axis)
    value = medial("evaluate", f"dataset:{mesh}", axis, "--compat", "coverage-axis")["compat"]["coverage_axis"]["ca_vertex_hausdorff"]
    return value["side"] / value["diag"]


def coverage_table(work):
    """Coverage Axis++ with the dilation of the reference run, several seeds: other samples are other covers."""
    lines = [
        "| mesh | spheres: reference | ours, five seeds | Hausdorff %: reference | ours, median | mean %: reference | ours, median | "
        "Betti numbers | seconds: reference | ours, median |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    ratios = {"spheres": [], "hausdorff": [], "mean": []}
    for mesh, (spheres, hausdorff, mean, seconds) in COVERAGE_PLUS.items():
        expected = medial("info", f"dataset:{mesh}")["expected_betti"]
        level = DILATION_OF_DIAGONAL * sides_in_diagonal(mesh, work)
        runs = []
        for seed in SEEDS:
            axis = work / f"{mesh}-{seed}.ma"
            made = medial("simplify", f"dataset:{mesh}", "-m", "coverage-axis", "--level", level, "--seed", seed, "-o", axis)
            judged = medial("evaluate", f"dataset:{mesh}", axis, "--samples", 20000)
            runs.append((made["spheres"], judged["hausdorff"], judged["mean"], made["seconds"]["total"], judged["betti"]))
        columns = [sorted(column) for column in zip(*[run[:4] for run in runs])]
        middle = [column[len(column) // 2] for column in columns]
        right = sum(run[4] == expected for run in runs)
        ours = (middle[0], 100 * middle[1], 100 * middle[2])
        for name, value, reference in zip(ratios, ours, (spheres, hausdorff, mean)):
            ratios[name].append(value / reference)
        counts = f"{columns[0][0]} to {columns[0][-1]}, median {middle[0]}"
        lines.append(
            f"| {mesh} | {spheres} | {counts} | {hausdorff:.2f} | {ours[1]:.2f} | {mean:.3f} | {ours[2]:.3f} | "
            f"right in {right} of {len(runs)} | {seconds} | {middle[3]:.2f} |"
        )
    means = ", ".join(f"{name} {geometric_mean(values):.2f}" for name, values in ratios.items())
    return lines + ["", f"Geometric means of ours (medians) over the reference: {means}."]


def records(out):
    """The last record of every mesh, row and level."""
    last = {}
    for line in (out / "results.jsonl").read_text().splitlines():
        record = json.loads(line)
        simplify = record["simplify"]
        row = simplify.get("variant") or simplify["method"]
        last[record["mesh"], row, json.dumps(simplify["level"])] = record
    return last


def vmas_table(found):
    lines = [
        "| mesh, spheres asked | delivered: authors | ours | Hausdorff %: authors | ours | default | mean %: authors | ours | default | "
        "Euler number: authors | ours | right | seconds: authors | ours |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    ratios = {100: ([], []), 500: ([], [])}
    for (mesh, asked), (hausdorff, mean, delivered, euler, seconds) in VMAS.items():
        level = json.dumps({"spheres": asked})
        ours, default = (found.get((mesh, row, level)) for row in ("VMAS, vertices", "VMAS"))
        if not (ours and default and ours["evaluate"] and default["evaluate"]):
            lines.append(f"| {mesh}, {asked} | not run |")
            continue
        error = [100 * record["evaluate"]["hausdorff"] for record in (ours, default)]
        average = [100 * record["evaluate"]["mean"] for record in (ours, default)]
        ratios[asked][0].append(error[0] / hausdorff)
        ratios[asked][1].append(average[0] / mean)
        demanded = ours["evaluate"]["expected_betti"]
        lines.append(
            f"| {mesh}, {asked} | {delivered} | {ours['simplify']['reached']} | {hausdorff:.2f} | {error[0]:.2f} | {error[1]:.2f} | "
            f"{mean:.3f} | {average[0]:.3f} | {average[1]:.3f} | {euler} | {ours['evaluate']['euler']} | "
            f"{demanded[0] - demanded[1] + demanded[2]} | {seconds} | {ours['simplify']['seconds']['total']:.2f} |"
        )
    for asked, (errors, averages) in ratios.items():
        if errors:
            means = f"Hausdorff {geometric_mean(errors):.2f}, mean {geometric_mean(averages):.2f}"
            lines += ["", f"Geometric means of ours over the authors', {asked} asked: {means}."]
    return lines


def compat_table(found, out):
    """The numbers of these papers, in the longest side, beside ours."""
    lines = [
        "| mesh | row | level | spheres | Hausdorff % of diag | mean | `ca_vertex_hausdorff` % of side | `ca_vertex_chamfer` | "
        "`p2s_cd_recon` | `p2s_hd_recon` |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for (mesh, row, level), record in found.items():
        if not record.get("artifact") or not record["evaluate"]:
            continue
        judged = medial("evaluate", f"dataset:{mesh}", out / record["artifact"], "--compat", "coverage-axis,point2skeleton")
        coverage, skeleton = judged["compat"]["coverage_axis"], judged["compat"]["point2skeleton"]
        values = [coverage["ca_vertex_hausdorff"], coverage["ca_vertex_chamfer"]]
        values += [skeleton["p2s_cd_recon"], skeleton["p2s_hd_recon"]]
        asked = ", ".join(f"{key} {value}" for key, value in json.loads(level).items())
        lines.append(
            f"| {mesh} | {row} | {asked} | {record['simplify']['reached']} | {100 * record['evaluate']['hausdorff']:.2f} | "
            f"{100 * record['evaluate']['mean']:.3f} | " + " | ".join(f"{100 * v['side']:.2f}" for v in values) + " |"
        )
    return lines


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__.strip())
    out = pathlib.Path(sys.argv[2] if len(sys.argv) == 3 else "rivals")
    recognise(pathlib.Path(sys.argv[1]))
    study = ROOT / "scripts/rivals.toml"
    code = subprocess.run([MEDIAL, "compare", "--study", study, "--out", out], check=False).returncode
    # 3: some deliver another number of spheres than asked, which is one of the findings.
    if code not in (0, 3):
        sys.exit(code)
    work = out / "coverage"
    work.mkdir(exist_ok=True)
    found = records(out)
    parts = [
        ["## Coverage Axis++", ""] + coverage_table(work),
        ["## VMAS", ""] + vmas_table(found),
        ["## By the definitions of these papers", ""] + compat_table(found, out),
    ]
    text = "\n\n".join("\n".join(part) for part in parts) + "\n"
    (out / "rivals.md").write_text(text)
    print(f"{out / 'rivals.md'}, {out / 'index.html'}")


main()
