"""Objects as values: equal, hashed, pickled, copied, in other processes; and warnings of results not as requested."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
import warnings
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import medial_axis
from medial_axis import Evaluation, MedialAxis, MedialWarning, Mesh, ParameterError


def test_equality_is_that_of_the_arrays(blob: Mesh, axis: MedialAxis) -> None:
    again = Mesh(blob.vertices, blob.faces, name="again")
    assert again == blob and hash(again) == hash(blob) and len({again, blob}) == 1
    moved = Mesh(blob.vertices + 1, blob.faces)
    assert moved != blob and blob != "blob" and axis != blob
    assert again.medial_axis() == axis and hash(again.medial_axis()) == hash(axis)
    assert axis.simplify("qmat", spheres=30) != axis
    zero, negative = (MedialAxis([[0.0, x, 0.0]], [1.0]) for x in (0.0, -0.0))
    assert zero != negative, "as their hashes"
    found = axis.evaluate(samples=100)
    assert {found: 1}[axis.evaluate(samples=100)] == 1 and found != axis.evaluate(samples=200)


def test_a_pickle_is_the_bytes_of_its_arrays(blob: Mesh, axis: MedialAxis) -> None:
    result = axis.simplify("qmat", spheres=100)
    alone = MedialAxis(result.centres, result.radii, result.edges, result.faces)
    arrays = (alone.centres, alone.radii, alone.edges, alone.faces)
    data = pickle.dumps(alone)
    assert all(array.tobytes() in data for array in arrays)
    assert len(data) < sum(array.nbytes for array in arrays) + 1000
    assert pickle.dumps(pickle.loads(data)) == data
    buffers: list[pickle.PickleBuffer] = []
    pickle.dumps(alone, protocol=5, buffer_callback=buffers.append)
    assert len(buffers) == 4, "not copied where the protocol can pass them"
    surface = pickle.dumps(blob)
    assert blob.vertices.tobytes() in surface and blob.faces.tobytes() in surface


def test_copies_continue_as_the_original(blob: Mesh, axis: MedialAxis) -> None:
    uniform = blob.medial_axis(sampling="uniform:3000", dual="delaunay", seed=5)
    result = axis.simplify("qmat", spheres=100)
    for one in (axis, uniform, result, axis.induced(axis.radii > 0.1)):
        for other in (pickle.loads(pickle.dumps(one)), copy.deepcopy(one)):
            assert other == one and other.mesh == one.mesh and other.run == one.run
            # Contacts, samples, and whether it is the initial mesh: all decide the result.
            for method in ("qmat", "angle"):
                assert other.simplify(method, spheres=50) == one.simplify(method, spheres=50)
    back = pickle.loads(pickle.dumps(blob))
    assert back.name == "blob" and back.report() == blob.report() and back.source == "builtin:blob"
    # The exactly known axis of a built-in shape is measured against.
    torus = Mesh.read("builtin:torus").medial_axis()
    known = pickle.loads(pickle.dumps(torus)).evaluate(samples=100)
    assert known == torus.evaluate(samples=100) and known.axis is not None
    found = result.evaluate(certify=1e-2)
    assert pickle.loads(pickle.dumps(found)) == found == copy.deepcopy(found)
    both = pickle.loads(pickle.dumps([blob, axis, result]))
    assert both[1].mesh is both[0] is both[2].mesh, "a surface is stored once"


def test_a_pickle_of_a_surface_that_bounds_no_solid(axis: MedialAxis) -> None:
    point = MedialAxis([[0, 0, 0], [9, 0, 0], [9.5, 0, 0]], [1, 1, 1], edges=[[1, 2]]).reconstruct()
    assert pickle.loads(pickle.dumps(point)).problem == point.problem
    corrupt = list(axis.mesh.__reduce__()) if axis.mesh else []
    corrupt[1] = (np.zeros((3, 3)), np.array([[0, 1, 7]]), *corrupt[1][2:])
    with pytest.raises(medial_axis.InputError, match="missing vertex"):
        corrupt[0](*corrupt[1])


def fewest(axis: MedialAxis, count: int) -> tuple[MedialAxis, Evaluation]:
    result = axis.simplify("qmat", spheres=count)
    return result, result.evaluate(samples=1000)


def test_other_processes(axis: MedialAxis) -> None:
    counts = [20, 40, 80]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        theirs = list(pool.map(fewest, [axis] * 3, counts))
    assert theirs == [fewest(axis, count) for count in counts]
    assert all(result.mesh == axis.mesh for result, _ in theirs)


def test_a_level_is_needed(axis: MedialAxis) -> None:
    for id in medial_axis.methods():
        with pytest.raises(ParameterError, match=rf"{id}: no level.*spheres.*level.*max_error"):
            axis.simplify(id)  # type: ignore[call-overload]
    with pytest.raises(ParameterError, match="`sphere`; did you mean `spheres`"):
        axis.simplify("qmat", sphere=100)  # type: ignore[call-overload]
    with pytest.raises(ParameterError, match="`thet`; did you mean `theta`"):
        axis.simplify("dey-zhao", spheres=9, thet=9)  # type: ignore[call-overload]
    with pytest.raises(ParameterError, match="one of"):
        axis.simplify("angle", spheres=9, level="published")
    assert axis.simplify("angle", level="published") == axis.simplify("angle", level=60)
    with pytest.raises(ParameterError, match="only spheres=N and max_error=E have a default"):
        axis.simplify(level=60)
    default = axis.simplify(spheres=40, rounds=1, start=100).run
    assert default is not None and default.method == "tight"


def test_results_not_as_requested_give_warnings(axis: MedialAxis) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert axis.simplify("qmat", spheres=40).run is not None
    pieces = axis.simplify("angle", level=60)
    with pytest.warns(MedialWarning) as warned:
        result = pieces.simplify("qmat", spheres=10)
    assert result.run is not None and any(f"{len(result)} spheres instead of 10" in note for note in result.run.warnings)
    assert [f"qmat: {note}" for note in result.run.warnings] == [str(note.message) for note in warned]
    assert all(note.filename == __file__ for note in warned), "the line of the caller"
