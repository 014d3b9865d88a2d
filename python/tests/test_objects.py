"""Surfaces and medial meshes: the same numbers as the command, and the same files."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import medial_axis
from medial_axis import Evaluation, InputError, MedialAxis, Mesh, ParameterError, UnsupportedError

TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)


def command(*words: object) -> str:
    """The output of the command."""
    run = subprocess.run(
        [sys.executable, "-m", "medial_axis", *map(str, words)], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_the_numbers_are_those_of_the_command(blob: Mesh, axis: MedialAxis, tmp_path: Path) -> None:
    path = tmp_path / "blob.ma"
    command("simplify", "builtin:blob", "--method", "qmat", "--spheres", 50, "-o", path)
    simplified = axis.simplify("qmat", spheres=50)
    ours = tmp_path / "ours.ma"
    simplified.save(ours)
    assert ours.read_bytes() == path.read_bytes()
    text = command("evaluate", "builtin:blob", path, "--json")
    assert simplified.evaluate() == Evaluation.from_json(text)
    printed = json.loads(text)
    fields = set(Evaluation.__dataclass_fields__)
    assert set(printed) - fields == {"version"}, "every number that the command prints has a field"


def test_arrays_are_those_of_the_mesh(blob: Mesh, axis: MedialAxis) -> None:
    assert blob.vertices.dtype == np.float64 and blob.faces.dtype == np.uint32
    assert axis.centres.shape == (len(axis), 3) and axis.radii.shape == (len(axis),)
    assert axis.centres is axis.centres, "made once"
    with pytest.raises(ValueError):
        axis.centres[0, 0] = 1.0
    again = MedialAxis(axis.centres, axis.radii, axis.edges, axis.faces)
    assert (again.edges == axis.edges).all() and (again.faces == axis.faces).all()
    assert again.betti == axis.betti == medial_axis.betti(axis)
    assert axis.euler == len(axis) - len(axis.edges) + len(axis.faces)


def test_a_mesh_of_arrays_is_the_mesh_of_its_file(blob: Mesh, tmp_path: Path) -> None:
    blob.save(tmp_path / "blob.ply")
    of_file = Mesh.read(tmp_path / "blob.ply")
    of_arrays = Mesh(blob.vertices, blob.faces)
    for one, other in [(of_file, blob), (of_arrays, blob)]:
        assert (one.vertices == other.vertices).all() and (one.faces == other.faces).all()
    # Whatever numpy holds numbers in.
    turned = Mesh(np.asfortranarray(blob.vertices), blob.faces.astype(">i8")[:, [1, 2, 0]])
    assert turned.report()["volume"] == pytest.approx(blob.report()["volume"])
    single = Mesh(blob.vertices.astype("f4"), blob.faces.tolist())
    assert single.report()["expected_betti"] == [1, 0, 0]


def test_repairs_are_those_of_a_file() -> None:
    vertices, faces = TETRAHEDRON
    soup = Mesh(vertices[faces].reshape(-1, 3), np.arange(12).reshape(-1, 3)[:, ::-1], name="soup")
    assert len(soup.vertices) == 4
    repairs = [repair["repair"] for repair in soup.report()["repairs"]]
    assert "welded_vertices" in repairs and soup.report()["volume"] > 0


@pytest.mark.parametrize("extension", ["ma", "ply", "vtp", "glb"])
def test_every_format_is_written_and_those_of_data_come_back(axis: MedialAxis, extension: str, tmp_path: Path) -> None:
    simplified = axis.simplify("hem", spheres=30)
    path = tmp_path / f"x.{extension}"
    simplified.save(path)
    assert path.stat().st_size > 0
    if extension in ("vtp", "glb"):
        with pytest.raises(InputError, match=extension):
            MedialAxis.read(path)
        return
    back = MedialAxis.read(path)
    assert (back.centres == simplified.centres).all()
    assert (back.faces == simplified.faces).all()


@pytest.mark.parametrize("extension", ["csv", "json", "yaml", "xrdf", "urdf", "xml", "txt", "xyzr"])
def test_lists_of_spheres_come_back_without_their_edges(axis: MedialAxis, extension: str, tmp_path: Path) -> None:
    simplified = axis.simplify("qmat", spheres=30)
    path = tmp_path / f"arm.{extension}"
    with pytest.warns(medial_axis.MedialWarning, match=f"left out .* edges and .* faces: .{extension} holds spheres alone"):
        simplified.save(path)
    back = MedialAxis.read(path)
    assert (back.centres == simplified.centres).all() and (back.radii == simplified.radii).all()
    assert len(back.edges) == 0


def test_one_link_of_a_robot_is_chosen(tmp_path: Path) -> None:
    links = {link: [{"center": [0, 0, k], "radius": 1}] for k, link in enumerate(["arm", "hand"])}
    (tmp_path / "robot.json").write_text(json.dumps(links))
    with pytest.raises(InputError, match=r"2 links \(1 arm, 2 hand\)"):
        MedialAxis.read(tmp_path / "robot.json")
    assert MedialAxis.read(tmp_path / "robot.json", block=2).centres.tolist() == [[0, 0, 1]]


def test_a_file_in_other_units_is_fitted(blob: Mesh, axis: MedialAxis, tmp_path: Path) -> None:
    simplified = axis.simplify("qmat", spheres=50)
    path = tmp_path / "scaled.ma"
    MedialAxis(7 * simplified.centres + 3, 7 * simplified.radii, simplified.edges, simplified.faces).save(path)
    fitted = blob.read_axis(path, fit="similarity")
    assert any("fitted" in remark for remark in fitted.remarks)
    assert np.abs(fitted.radii - simplified.radii).max() < 0.02 * simplified.radii.max()
    with pytest.raises(ParameterError, match="perhaps"):
        blob.read_axis(path, fit="perhaps")  # type: ignore[arg-type]
    # Points alone: the surface has the radii.
    simplified.save(tmp_path / "points.obj")
    with pytest.raises(InputError, match="without radii"):
        blob.read_axis(tmp_path / "points.obj")
    of_surface = blob.read_axis(tmp_path / "points.obj", radii="surface")
    assert np.allclose(of_surface.radii, np.abs(blob.signed_distance(of_surface.centres)))


def test_levels(axis: MedialAxis) -> None:
    assert len(axis.simplify("qmat", spheres=40)) == 40
    filtered = axis.simplify("angle", level=60)
    assert filtered.run is not None and filtered.run.native_level == 60
    assert filtered.run.seconds["substrate"] > 0
    # Going on from what a filter left.
    pieces = filtered.betti[0]
    assert pieces <= len(filtered.simplify("qmat", spheres=400)) <= 400 < len(filtered)
    bound = axis.simplify("qmat", max_error=0.02, k=1e-4)
    assert bound.run is not None and bound.run.max_error is not None
    assert bound.run.max_error["hausdorff"] <= 0.02
    assert bound.run.params == {"k": 1e-4}
    with pytest.raises(UnsupportedError, match="spheres"):
        axis.simplify("qmat", level=3.0)
    with pytest.raises(ParameterError, match="qmat"):
        axis.simplify("qmta", spheres=10)
    with pytest.raises(ParameterError, match="kk"):
        axis.simplify("qmat", spheres=10, kk=1)
    with pytest.raises(ParameterError, match="one of"):
        axis.simplify("qmat", spheres=10, level=3.0)


REQUESTS = {
    "spheres": (["--spheres", "30"], {"spheres": 30}),
    "published": ([], {"level": "published"}),
    "level": (["--level"], {"level": None}),
    "bound": (["--max-error", "0.05"], {"max_error": 0.05}),
}


@pytest.mark.parametrize("request_of", REQUESTS)
@pytest.mark.parametrize("method", list(medial_axis.methods()))
def test_python_gives_the_file_of_the_command(method: str, request_of: str, tmp_path: Path) -> None:
    by_command, by_python = tmp_path / "command.ma", tmp_path / "python.ma"
    words, options = REQUESTS[request_of]
    if request_of == "level":
        if medial_axis.methods()[method]["native"] is None:
            pytest.skip(f"{method} has no native level")
        level = {"angle": 60.0, "lambda": 0.05, "aof": 60.0, "sat": 1.2}.get(method, 0.05)
        words, options = ["--level", str(level)], {"level": level}
    line = ["simplify", "builtin:box:8", "-m", method, *words, "--json", "--seed", "7", "-o", by_command]
    start = Mesh.read("builtin:box:8").medial_axis(seed=7)
    try:
        axis = start.simplify(method, seed=7, **options)
    except medial_axis.MedialError as error:
        # The command fails with the same message.
        with pytest.raises(AssertionError, match=re.escape(str(error).splitlines()[0][:60])):
            command(*line)
        return
    printed = command(*line)
    axis.save(by_python)
    assert by_python.read_bytes() == by_command.read_bytes()
    assert axis.run is not None and axis.run.max_error == json.loads(printed).get("max_error")


def test_distances_to_a_tetrahedron() -> None:
    mesh = Mesh(*TETRAHEDRON)
    points = [[0.125, 0.125, 0.125], [0.25, 0.25, -2.0], [0.25, 0.25, 0.0]]
    assert medial_axis.signed_distance(mesh, points).tolist() == [-0.125, 2.0, 0.0]
    closest, distances, faces = medial_axis.closest_points(mesh, points[1:2])
    assert np.allclose(closest, [[0.25, 0.25, 0.0]], atol=1e-15) and distances.tolist() == [2.0]
    assert faces.tolist() == [0]


def test_a_reconstruction_is_a_solid(blob: Mesh, axis: MedialAxis) -> None:
    simplified = axis.simplify("qmat", spheres=60)
    union = simplified.reconstruct()
    assert union.problem is None and union.report()["expected_betti"] == [1, 0, 0]
    volume = union.report()["volume"] / blob.report()["volume"]
    assert 0.9 < volume < 1.1
    distances = np.abs(blob.signed_distance(union.vertices)).max()
    found = simplified.evaluate()
    assert distances < 2 * found.in_units("hausdorff") + 0.01 * found.diagonal


def test_a_certificate_holds_the_error(axis: MedialAxis) -> None:
    found = axis.simplify("qmat", spheres=60).evaluate(certify=1e-3)
    assert found.certified is not None
    assert found.certified.lower <= found.certified.upper <= found.certified.lower + 1e-3
    assert found.hausdorff <= found.certified.upper
    assert Evaluation.unit("hausdorff") == "fraction of the bounding-box diagonal"
    assert "Hausdorff" in str(found)


def test_triangulations() -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    made = medial_axis.triangulate(np.vstack([corners, corners[:1]]))
    cells = corners[made.cells]
    volumes = np.linalg.det(cells[:, 1:] - cells[:, :1]) / 6
    assert (volumes > 0).all() and volumes.sum() == pytest.approx(1)
    assert made.repeated.tolist() == [[8, 0]] and len(made.hidden) == 0
    centre = np.vstack([corners, [[0.5, 0.5, 0.5]]])
    heavy = medial_axis.triangulate(centre, [1.0] * 8 + [-9.0])
    assert heavy.hidden.tolist() == [8]
    with pytest.raises(InputError, match="plane|four"):
        medial_axis.triangulate(corners[:3])


def test_what_is_known_of_methods() -> None:
    known = medial_axis.methods()
    assert known["qmat"]["params"][0]["name"] == "k"
    assert known["angle"]["native"]["unit"].startswith("degrees")


def test_a_metric_of_the_user_is_a_column(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    report = medial_axis.compare("builtin:box", methods="qmat", spheres=[40, 20], out=tmp_path / "report", quiet=True)
    seen = []

    def radius(mesh: Mesh, axis: MedialAxis) -> float:
        seen.append(mesh.name)
        return float(axis.radii.mean() / mesh.diagonal)

    assert report.add_metric("mean radius", radius, unit="diagonals", better="higher") == ()
    assert seen and set(seen) == {"box"}
    for _, row in report.frame().iterrows():
        if not pandas.isna(row.artifact):
            axis = MedialAxis.read(report.folder / row.artifact)
            mesh = Mesh.read("builtin:box")
            assert row["metric_mean radius"] == pytest.approx(axis.radii.mean() / mesh.diagonal)
    assert "mean radius (diagonals)" in (report.folder / "tables" / "mesh-box.md").read_text()
    again = len(seen)
    report.add_metric("mean radius", radius, unit="diagonals", better="higher")
    assert len(seen) == again, "each result is measured once"
    with pytest.raises(ZeroDivisionError):
        report.add_metric("wrong", lambda mesh, axis: 1 / 0)
    with pytest.raises(medial_axis.ParameterError, match="letters"):
        report.add_metric("a/b", radius)


def test_wrap_and_advice() -> None:
    """An open surface is refused with advice in Python; a wrap closes it."""
    corners, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2]]
    with pytest.raises(medial_axis.InputError, match=r"Mesh\.repair\(\.\.\., fill_holes=True\)"):
        Mesh(corners, faces)
    wrapped = Mesh.repair(corners, faces, wrap=0.05)
    assert wrapped.report()["components"] == 1 and len(wrapped.faces) > 100
    with pytest.raises(medial_axis.ParameterError, match="wrap"):
        Mesh.repair(corners, faces, wrap=True, fill_holes=True)
    with pytest.raises(medial_axis.ParameterError, match="wrap"):
        Mesh.repair(corners, faces, wrap=-1.0)
