"""Functions of points and complexes."""

from __future__ import annotations

from typing import Any, NamedTuple

from . import _medial
from ._arguments import FloatArray, IndexArray, Progress, call, floats
from .axis import MedialAxis
from .errors import InputError
from .mesh import Mesh


class Triangulation(NamedTuple):
    """A triangulation of points in space."""

    cells: IndexArray
    """Four points of each finite tetrahedron, m x 4, positively oriented."""
    hidden: IndexArray
    """Points that have no cell of a regular triangulation, h."""
    repeated: IndexArray
    """Pairs, d x 2: a point that repeats the position of another, and that other one."""


def triangulate(
    points: Any,
    weights: Any = None,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Triangulation:
    """The Delaunay triangulation of n x 3 points, or the regular one where they have weights (squared radii).

    Exact, for any input. An array of float64, contiguous, is read where it is: it must not change meanwhile.
    """
    sites = floats(points, "points")
    heights = None if weights is None else floats(weights, "weights", None)
    if heights is not None and len(heights) != len(sites):
        raise InputError(f"weights: there are {len(heights)} for {len(sites)} points")
    cells, hidden, repeated = _medial.triangulate(sites, heights, call(0, threads, progress))
    return Triangulation(cells, hidden[:, 0], repeated)


def closest_points(
    mesh: Mesh, points: Any, *, threads: int | None = None
) -> tuple[FloatArray, FloatArray, IndexArray]:
    """For each of n points the closest one of a surface (n x 3), its distance (n) and its face (n)."""
    return _mesh(mesh).closest_points(points, threads=threads)


def signed_distance(mesh: Mesh, points: Any, *, threads: int | None = None) -> FloatArray:
    """The distance of each point to a surface: negative inside, with an exact sign."""
    return _mesh(mesh).signed_distance(points, threads=threads)


def betti(axis: MedialAxis) -> tuple[int, int, int]:
    """Components, tunnels and cavities of a medial mesh, over Z2."""
    if not isinstance(axis, MedialAxis):
        raise InputError(f"betti: a MedialAxis is needed, not a {type(axis).__name__}")
    return axis.betti


def _mesh(mesh: Mesh) -> Mesh:
    if not isinstance(mesh, Mesh):
        raise InputError(f"mesh: a Mesh is needed, not a {type(mesh).__name__}")
    return mesh
