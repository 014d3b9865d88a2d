"""Bad input: an exception that names it, in the words of the command, and never the end of the process."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import medial_axis
from medial_axis import InputError, MedialAxis, MedialError, Mesh, ParameterError

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


class Strange:
    """Raises where numpy asks it."""

    def __array__(self, *arguments: Any, **more: Any) -> Any:
        raise RuntimeError("not me")


def with_value(row: int, value: float) -> Any:
    changed = CORNERS.copy()
    changed[row, 1] = value
    return changed


@pytest.mark.parametrize(
    ("vertices", "faces", "named"),
    [
        (CORNERS.astype(complex), FACES, "vertices: expected numbers"),
        (CORNERS.astype(str), FACES, "vertices: expected numbers"),
        (CORNERS.astype(object), FACES, "vertices: expected numbers"),
        (CORNERS[:, :2], FACES, r"vertices: expected the shape \(n, 3\)"),
        (CORNERS.ravel(), FACES, r"vertices: expected the shape \(n, 3\)"),
        (with_value(2, np.nan), FACES, "vertices: row 2"),
        (with_value(3, np.inf), FACES, "vertices: row 3"),
        (Strange(), FACES, "vertices: a Strange"),
        ([[0, 0, 0], [1]], FACES, "vertices"),
        (CORNERS, FACES.astype(float), "faces: expected indices"),
        (CORNERS, FACES[:, :2], r"faces: expected the shape \(n, 3\)"),
        (CORNERS, FACES - 1, "faces: row 0"),
        (CORNERS, FACES + 2**40, "faces: row 0"),
        (CORNERS, FACES + 1, "face 1 refers to vertex 4"),
        (CORNERS, FACES[:3], "open|boundary"),
        (CORNERS, FACES[:0], "no face"),
        (CORNERS[:0], FACES[:0], "no face"),
        (CORNERS, FACES[[0, 0, 0]], "open|boundary|bound"),
        ("bear.off", None, "Mesh.read"),
        (17, None, r"not a mesh \(found a int\)"),
        (None, None, r"not a mesh \(found a NoneType\)"),
        (Strange(), None, r"not a mesh \(found a Strange\)"),
    ],
)
def test_meshes(vertices: Any, faces: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        Mesh(vertices, faces)


def test_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere.off"):
        Mesh.read("nowhere.off")
    with pytest.raises(InputError, match="torsu.*torus"):
        Mesh.read("builtin:torsu")
    with pytest.raises(InputError, match="bear.txt"):
        path = tmp_path / "bear.txt"
        path.write_text("no mesh")
        Mesh.read(path)
    with pytest.raises(ParameterError, match="zero byte"):
        Mesh.read("a\0b.off")
    with pytest.raises(InputError, match="x.ma"):
        (tmp_path / "x.ma").write_text("1 2 3 4 5 nonsense")
        MedialAxis.read(tmp_path / "x.ma")


def test_comparison_without_a_result(tmp_path: Path) -> None:
    (tmp_path / "open.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    for quiet in (True, False):
        with pytest.raises(MedialError, match="open.*refused") as raised:
            medial_axis.compare(tmp_path / "open.off", methods="qmat", spheres=5, out=tmp_path / "out", quiet=quiet)
        assert "[1/" not in str(raised.value)


def test_medial_meshes(blob: Mesh, axis: MedialAxis) -> None:
    point = [[0.0, 0.0, 0.0]]
    with pytest.raises(InputError, match="2 radii"):
        MedialAxis(point, [1.0, 2.0])
    with pytest.raises(InputError, match="sphere 0"):
        MedialAxis(point, [-1.0])
    with pytest.raises(InputError, match="edge 0"):
        MedialAxis(point, [1.0], [[0, 1]])
    with pytest.raises(InputError, match="face 0"):
        MedialAxis(point * 3, [1.0] * 3, faces=[[0, 1, 1]])
    with pytest.raises(InputError, match="has no surface; read it by"):
        MedialAxis(point, [1.0]).simplify("qmat", spheres=1)
    with pytest.raises(InputError, match="evaluate: this medial axis has no surface"):
        MedialAxis(point, [1.0]).evaluate()
    with pytest.raises(InputError, match="no sphere|sphere"):
        MedialAxis([], []).evaluate(blob)
    with pytest.raises(InputError, match="keep: expected .* truth values"):
        axis.induced([True])
    with pytest.raises((InputError, ParameterError), match="x.step"):
        axis.save("x.step")


def test_arguments(blob: Mesh, axis: MedialAxis) -> None:
    for words, named in [
        ({"spheres": "ten"}, "spheres"),
        ({"spheres": -1}, "spheres"),
        ({"spheres": 0}, "sphere"),
        ({"spheres": 2.5}, "spheres"),
        ({"max_error": 7}, "max_error"),
        ({"max_error": float("nan")}, "max_error"),
        ({"spheres": 5, "seed": -1}, "seed"),
        ({"spheres": 5, "seed": "x"}, "seed"),
        ({"spheres": 5, "threads": 0}, "threads"),
        ({"spheres": 5, "threads": 10**9}, "threads"),
        ({"spheres": 5, "progress": 3}, "progress"),
        ({"spheres": 5, "k": float("nan")}, "parameters"),
        ({"spheres": 5, "k": object()}, "parameters"),
        ({"spheres": 5, "k": "many"}, "k"),
    ]:
        with pytest.raises(ParameterError, match=named):
            axis.simplify("qmat", **words)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="sampling"):
        blob.medial_axis(sampling="some")
    with pytest.raises(ParameterError, match="dual"):
        blob.medial_axis(dual="round")
    with pytest.raises(ParameterError, match="method"):
        axis.simplify(7, spheres=5)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="@medial_axis.simplifier"):
        axis.simplify(Strange, spheres=5)
    with pytest.raises((InputError, ParameterError), match="tolerance|certif"):
        axis.simplify("angle", level=60).evaluate(certify=-1.0)


VALUES: list[Any] = [
    None, True, -1, 2**70, 0.5, float("nan"), float("inf"), "", "qmat", b"x", [], [[]], (1, 2), {}, Strange(), Strange,
    object(), CORNERS, CORNERS[::-1], CORNERS.T, CORNERS.astype("f2"), CORNERS.astype(">f8"), np.zeros((0, 3)),
    np.zeros((2, 3, 4)), np.full((4, 3), np.nan), np.full((4, 3), 1e308), np.zeros((4, 3)), np.array(3.0), len,
]  # fmt: skip


def test_hundreds_of_hostile_calls(blob: Mesh, axis: MedialAxis) -> None:
    """Any value in any place: a result or one of our exceptions, and in the end all still works."""
    small = axis.simplify("angle", level=120)
    calls = 0

    def attempt(call: Any) -> None:
        nonlocal calls
        calls += 1
        try:
            call()
        except (MedialError, ImportError):
            pass

    for value in VALUES:
        attempt(lambda: Mesh(value))
        attempt(lambda: Mesh(value, FACES))
        attempt(lambda: Mesh(CORNERS, value))
        attempt(lambda: Mesh.read(value))
        attempt(lambda: MedialAxis.read(value))
        attempt(lambda: medial_axis.triangulate(value))
        attempt(lambda: medial_axis.triangulate(CORNERS, value))
        attempt(lambda: medial_axis.closest_points(value, CORNERS))
        attempt(lambda: medial_axis.signed_distance(blob, value))
        attempt(lambda: medial_axis.betti(value))
        attempt(lambda: small.simplify(value, spheres=5))
        attempt(lambda: small.simplify("qmat", spheres=value))
        attempt(lambda: small.simplify("qmat", spheres=5, k=value))
        attempt(lambda: small.simplify("angle", level=value))
        attempt(lambda: small.evaluate(value, samples=100))
        attempt(lambda: small.evaluate(blob, samples=value))
        attempt(lambda: small.of(value))
        attempt(lambda: small.induced(value))
        attempt(lambda: small.save(value))
        attempt(lambda: medial_axis.simplifier(value))
        attempt(lambda: medial_axis.load(value))
    for one, other in itertools.product(VALUES, VALUES):
        attempt(lambda: MedialAxis(one, other))
    assert calls > 1000
    assert len(axis.simplify("qmat", spheres=5)) == 5


def test_reasons_of_a_partial_comparison(tmp_path: Path) -> None:
    (tmp_path / "open.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    report = medial_axis.compare(
        [tmp_path / "open.off", "builtin:box"], methods="qmat", spheres=20, out=tmp_path / "out", quiet=True
    )
    assert not report.complete and any("open" in reason for reason in report.reasons), report.reasons
