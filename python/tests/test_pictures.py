"""Pictures, notebooks, other packages, repairs and rows of frames."""

from __future__ import annotations

import importlib.util
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import medial_axis
from medial_axis import InputError, MedialAxis, Mesh, ParameterError, render
from test_objects import TETRAHEDRON, command


def size(png: bytes) -> tuple[int, int]:
    """Width and height in the head of a PNG file."""
    assert png.startswith(b"\x89PNG") and png.endswith(b"IEND\xaeB\x60\x82")
    return struct.unpack(">II", png[16:24])


def test_a_picture_is_that_of_the_command(blob: Mesh, axis: MedialAxis, tmp_path: Path) -> None:
    result = axis.simplify("qmat", spheres=50)
    result.save(tmp_path / "qmat.ma")
    axis.simplify("hem", spheres=50).save(tmp_path / "hem.ma")
    command("render", "builtin:blob", tmp_path / "qmat.ma", "--camera", "30,20", "--size", "300x200", "-o", tmp_path / "x.png")
    assert render(result, camera=(30, 20), size=(300, 200)).png == (tmp_path / "x.png").read_bytes()
    paths = [tmp_path / "qmat.ma", tmp_path / "hem.ma"]
    command("render", "builtin:blob", *paths, "--show", "error", "-o", tmp_path / "strip.png")
    strip = render(blob, [result, axis.simplify("hem", spheres=50)], show="error")
    assert strip.png == (tmp_path / "strip.png").read_bytes()
    assert strip.errors[0]["hausdorff"] == pytest.approx(result.evaluate().hausdorff)
    assert render(blob, [result, result], names=["k = 0.1", "b"]).png != render(blob, [result, result], names=["k = 0", "b"]).png
    strip.save(tmp_path / "saved.png")
    assert size((tmp_path / "saved.png").read_bytes()) == (strip.width, strip.height)


def test_options_of_a_picture(blob: Mesh, axis: MedialAxis) -> None:
    assert render(blob, up="-x", background="#102030", camera=[1, 0, 0.5]).up[0] < 0
    for words in ({"show": "all"}, {"camera": "upside"}, {"size": (0, 3)}, {"size": 7}, {"color": 3}, {"max_error": "x"}):
        with pytest.raises(ParameterError, match=next(iter(words))):
            render(blob, **words)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="show"):
        render(blob, show="error")
    with pytest.raises(ParameterError, match="found 1, expected 2"):
        render(blob, [axis, axis], names=["one"])
    with pytest.raises(InputError, match="no surface"):
        render(MedialAxis([[0, 0, 0]], [1.0]))
    with pytest.raises(InputError, match="MedialAxis"):
        render(blob, [3])  # type: ignore[list-item]


def test_what_a_notebook_shows(blob: Mesh, axis: MedialAxis) -> None:
    mesh = Mesh(blob.vertices, blob.faces, name="<b>")
    result = mesh.medial_axis().simplify("qmat", spheres=50)
    for shown, words in [(mesh, ["faces", str(len(blob.faces))]), (result, ["50", "qmat", "(1, 0, 0)"])]:
        png = shown._repr_png_()
        assert png is not None and size(png) == (480, 360) and shown._repr_png_() is png
        page = shown._repr_html_()
        assert "data:image/png;base64," in page and "&lt;b&gt;" in page and "<b>" not in page
        assert all(word in page for word in words)
    lone = MedialAxis([[0, 0, 0]], [1.0])
    assert lone._repr_png_() is None and "<img" not in lone._repr_html_() and "spheres" in lone._repr_html_()


def test_plots(axis: MedialAxis, tmp_path: Path) -> None:
    result = axis.simplify("qmat", spheres=50)
    picture = result.plot(backend="png", screenshot=tmp_path / "x.png")
    assert picture.png == (tmp_path / "x.png").read_bytes() == render(result).png
    with pytest.raises(ParameterError, match="backend"):
        result.plot(backend="vtk")  # type: ignore[arg-type]
    if importlib.util.find_spec("pyvista") is not None:
        for shown in (result, result.mesh):
            assert shown is not None
            shown.plot(backend="pyvista", screenshot=tmp_path / "y.png")
            assert (tmp_path / "y.png").stat().st_size > 10_000


WITHOUT = """
import sys, warnings
for name in ("pyvista", "trimesh", "networkx", "open3d", "pandas"):
    sys.modules[name] = None
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *more: None if name == "pyvista" else found(name, *more)
import medial_axis
axis = medial_axis.Mesh.read("builtin:box").medial_axis()
assert axis.plot().width == 800
calls = [axis.to_pyvista, axis.to_trimesh, axis.to_networkx, axis.mesh.to_pyvista, axis.mesh.to_trimesh,
         axis.mesh.to_open3d, lambda: axis.plot(backend="pyvista"), medial_axis.load]
for call in calls:
    try:
        call()
    except ImportError as error:
        print(error)
"""


def test_a_missing_package_is_named(tmp_path: Path) -> None:
    (tmp_path / "medial-report").mkdir()
    (tmp_path / "medial-report" / "results.csv").write_text("mesh\n")
    done = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    names = ["pyvista", "trimesh", "networkx", "pyvista", "trimesh", "open3d", "pyvista", "pandas"]
    assert len(lines) == 8 and all(f"pip install {name}" in line for name, line in zip(names, lines)), lines


def test_other_packages(blob: Mesh, axis: MedialAxis) -> None:
    result = axis.simplify("qmat", spheres=50)
    if importlib.util.find_spec("networkx") is not None:
        graph = result.to_networkx()
        assert graph.number_of_nodes() == 50 and graph.number_of_edges() == len(result.edges)
        assert graph.nodes[7] == {"centre": tuple(result.centres[7]), "radius": result.radii[7]}
        assert graph.graph["faces"] == [tuple(face) for face in result.faces.tolist()]
    if importlib.util.find_spec("trimesh") is not None:
        theirs = result.to_trimesh()
        assert (theirs.vertices == result.centres).all() and (theirs.faces == result.faces).all()
        assert (theirs.vertex_attributes["radius"] == result.radii).all()
    if importlib.util.find_spec("pyvista") is not None:
        surface = blob.to_pyvista()
        assert surface.is_manifold and surface.volume == pytest.approx(blob.report()["volume"])
        assert Mesh(surface) == blob
        assert result.to_pyvista().n_lines == len(result.lone_edges())


def test_repairs(tmp_path: Path) -> None:
    vertices, faces = TETRAHEDRON
    with pytest.raises(InputError, match="open|boundary"):
        Mesh.repair(vertices, faces[:3])
    filled = Mesh.repair(vertices, faces[:3], fill_holes=True, name="filled")
    assert filled == Mesh(vertices, faces) or len(filled.faces) == 4
    assert filled.name == "filled" and filled.report()["volume"] == pytest.approx(1 / 6)
    two = np.vstack([vertices, 5 * vertices + 10]), np.vstack([faces, faces + 4])
    assert len(Mesh.repair(*two).faces) == 8
    largest = Mesh.repair(two, components="largest")
    assert len(largest.faces) == 4 and largest.report()["volume"] == pytest.approx(125 / 6)
    # Of a file, as the command does it.
    text = "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n"
    (tmp_path / "open.off").write_text(text)
    command("repair", tmp_path / "open.off", "--fill-holes", "-o", tmp_path / "closed.off")
    of_file = Mesh.repair(tmp_path / "open.off", fill_holes=True)
    assert of_file == Mesh.read(tmp_path / "closed.off") and of_file.name == "open"
    # Parts that touch in a vertex.
    touching = np.vstack([vertices, -vertices[1:]]), np.vstack([faces, np.array([0, 4, 5, 6])[faces][:, ::-1]])
    assert len(Mesh.repair(touching).vertices) == 8
    with pytest.raises(ParameterError, match="components"):
        Mesh.repair(*two, components="both")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="nowhere.off"):
        Mesh.repair("nowhere.off")


def test_the_diagonal(blob: Mesh, axis: MedialAxis) -> None:
    extent = np.ptp(blob.vertices, axis=0)
    assert blob.diagonal == pytest.approx(np.linalg.norm(extent))
    assert blob.diagonal == axis.evaluate(samples=100).diagonal


def test_an_evaluation_is_a_row_of_a_frame(blob: Mesh, axis: MedialAxis, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    report = medial_axis.compare(
        "builtin:blob", methods="qmat", spheres=[50, 20], out=tmp_path / "out", quiet=True, arguments=["--samples", "50000"]
    )
    theirs = report.frame()
    theirs = theirs[theirs.method == "qmat"].sort_values("spheres")
    ours = pandas.DataFrame([axis.simplify("qmat", spheres=n).evaluate().row() for n in (20, 50)])
    assert set(ours.columns) <= set(theirs.columns)
    for column in ("mesh", "method", "level", "asked", "status", "spheres", "faces", "betti_0"):
        assert ours[column].tolist() == theirs[column].tolist(), column
    for column in ("hausdorff", "mean", "diagonal"):  # pandas rounds what it reads.
        assert ours[column].tolist() == pytest.approx(theirs[column].tolist(), rel=1e-14), column
    assert (ours.seconds_total > 0).all()
    axis.save(tmp_path / "x.ma")
    row = blob.read_axis(tmp_path / "x.ma").evaluate(samples=100).row()
    assert row["mesh"] == "blob" and row["spheres"] == len(axis) and "method" not in row and row["status"] == "external"
