#!/usr/bin/env python3
"""Measure a medial mesh by the definitions of other papers, for comparison with their tables.

    scripts/compat.py SURFACE.off AXIS.ma [--reconstruction R.off] [--reference TRUE.ma] [--samples N] [--seed N]

Needs numpy and scipy. `medial convert` makes .off and .ma of other formats, `medial reconstruct AXIS.ma --mesh
SURFACE.off --tolerance 0.01 -o R.off` the reconstruction. Prints one JSON object; each length in the unit of the
files (`absolute`), in the longest side of the surface's bounding box (`side`) and in its diagonal (`diag`). These
numbers depend on tessellation and sampling: they compare with each other, and rank no method.

coverage_axis   Dou et al. 2022, `Geometry_Tools/metrics.py`. Distances between the *vertices* of the surface and
                of a reconstruction, each to the nearest vertex of the other: `vertex_hausdorff` the larger maximum,
                `vertex_chamfer` the *sum* of the means. Vertices are no surface: two triangulations of one unit
                sphere with 642 and 1,922 vertices are 2.7 % of the diagonal apart.
point2skeleton  Lin et al. 2021, `DistFunc.py`. `cd_recon`: mean over points of the surface of the distance to the
                sphere with the nearest *centre*, plus mean over spheres of the skeleton of the difference of radius
                and distance to the nearest point. `hd_recon`: the larger maximum instead, by analogy. `cd_mat`,
                `hd_mat`: the same between centres and those of a reference, without radii. The nearest centre
                is not the nearest sphere. The skeleton is sampled as in the code: faces by area, edges without a
                face by half the square of their length, random weights over their sum, which is denser in the
                middle; lone spheres only where there is nothing else.
matstruct       Wang et al. 2024, `src/eval/mesh_eval.cpp`. `quality`: mean over faces of 6/sqrt(3) A / (h s) with
                area, longest edge and half the perimeter. The area is a cross product: Heron's formula, as in the
                code, has no value for some degenerate triangles.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

DEGENERATE = 1e-12


def read_off(path):
    lines = [line.split("#")[0].split() for line in Path(path).read_text().splitlines()]
    lines = [words for words in lines if words]
    if lines[0] != ["OFF"]:
        raise SystemExit(f"{path}: not an OFF file; `medial convert` makes one")
    vertex_count, face_count = int(lines[1][0]), int(lines[1][1])
    vertices = np.array([words[:3] for words in lines[2 : 2 + vertex_count]], float)
    rows = lines[2 + vertex_count : 2 + vertex_count + face_count]
    faces = [words[1:4] for words in rows if words[0] == "3"]
    return vertices, np.array(faces, int).reshape(-1, 3)


def read_ma(path):
    """Centres, radii, edges and faces of a file that `medial` has written."""
    records = {"v": [], "e": [], "f": []}
    for line in Path(path).read_text().splitlines()[1:]:
        words = line.split()
        if words and words[0] in records:
            records[words[0]].append(words[1:])
    spheres = np.array(records["v"], float).reshape(-1, 4)
    edges = np.array([words[:2] for words in records["e"]], int).reshape(-1, 2)
    faces = np.array([words[:3] for words in records["f"]], int).reshape(-1, 3)
    return spheres, np.sort(edges, axis=1), np.sort(faces, axis=1)


def areas(corners):
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def sample_surface(vertices, faces, count, random):
    """Points uniform by area."""
    weights = areas(vertices[faces])
    chosen = vertices[faces[random.choice(len(faces), count, p=weights / weights.sum())]]
    root, other = np.sqrt(random.random(count)), random.random(count)
    shares = np.stack([1 - root, root * (1 - other), root * other], axis=1)
    return np.einsum("nk,nkx->nx", shares, chosen)


def sample_skeleton(spheres, edges, faces, count, random):
    """Spheres on faces and edges without a face, with interpolated radii."""
    sides = {tuple(face[list(side)]) for face in faces for side in ((0, 1), (0, 2), (1, 2))}
    lone = np.array([edge for edge in edges if tuple(edge) not in sides], int).reshape(-1, 2)
    area = areas(spheres[faces, :3]) if len(faces) else np.zeros(0)
    square = 0.5 * ((spheres[lone[:, 0], :3] - spheres[lone[:, 1], :3]) ** 2).sum(axis=1)
    total = area.sum() + square.sum()
    if not (total > 0 and np.isfinite(total)):
        return spheres
    on_faces = int(area.sum() / total * count)
    samples = []
    for simplices, weights, number in ((faces, area, on_faces), (lone, square, count - on_faces)):
        if number and weights.sum() > 0:
            chosen = spheres[simplices[random.choice(len(simplices), number, p=weights / weights.sum())]]
            shares = random.random(chosen.shape[:2])
            samples.append(np.einsum("nk,nkx->nx", shares / shares.sum(axis=1, keepdims=True), chosen))
    return np.concatenate(samples)


def both_ways(there, back):
    return {"cd": there.mean() + back.mean(), "hd": max(there.max(), back.max()),
            "there": there.max(), "back": back.max()}


def matstruct(spheres, faces):
    if not len(faces):
        return {"quality": None, "faces": 0, "degenerate_faces": 0}
    corners = spheres[faces, :3]
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    longest, half = sides.max(axis=1), sides.sum(axis=1) / 2
    with np.errstate(invalid="ignore", divide="ignore"):
        quality = np.nan_to_num(6 / np.sqrt(3) * areas(corners) / (longest * half))
    return {"quality": quality.mean(), "faces": len(faces),
            "degenerate_faces": int((quality < DEGENERATE).sum())}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("surface")
    parser.add_argument("axis")
    parser.add_argument("--reconstruction")
    parser.add_argument("--reference")
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    vertices, triangles = read_off(arguments.surface)
    spheres, edges, faces = read_ma(arguments.axis)
    extent = vertices.max(axis=0) - vertices.min(axis=0)
    side, diagonal = extent.max(), np.linalg.norm(extent)

    def length(value):
        return {"absolute": value, "side": value / side, "diag": value / diagonal}

    report = {"samples": arguments.samples, "seed": arguments.seed, "matstruct": matstruct(spheres, faces)}
    random = np.random.default_rng(arguments.seed)
    points = sample_surface(vertices, triangles, arguments.samples, random)
    skeleton = sample_skeleton(spheres, edges, faces, arguments.samples, random)
    far, nearest = cKDTree(skeleton[:, :3]).query(points)
    there = np.abs(far - skeleton[nearest, 3])
    back = np.abs(cKDTree(points).query(skeleton[:, :3])[0] - skeleton[:, 3])
    found = both_ways(there, back)
    section = {f"{name}_recon": length(found[name]) for name in ("cd", "hd")}
    section |= {f"hd_recon_{name}": length(found[name]) for name in ("there", "back")}
    if arguments.reference:
        true = sample_skeleton(*read_ma(arguments.reference), arguments.samples, random)[:, :3]
        found = both_ways(cKDTree(true).query(skeleton[:, :3])[0],
                          cKDTree(skeleton[:, :3]).query(true)[0])
        section |= {f"{name}_mat": length(found[name]) for name in ("cd", "hd")}
    report["point2skeleton"] = section
    if arguments.reconstruction:
        others, _ = read_off(arguments.reconstruction)
        found = both_ways(cKDTree(others).query(vertices)[0], cKDTree(vertices).query(others)[0])
        report["coverage_axis"] = {
            "surface_vertices": len(vertices), "reconstruction_vertices": len(others),
            "vertex_hausdorff": length(found["hd"]), "vertex_chamfer": length(found["cd"]),
            "vertex_hausdorff_from_surface": length(found["there"]),
            "vertex_hausdorff_to_surface": length(found["back"])}
    print(json.dumps(report, indent=1))


if __name__ == "__main__":
    main()
