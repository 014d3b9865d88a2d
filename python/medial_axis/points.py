"""Functions of points and complexes."""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import ArrayLike

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
    points: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Triangulation:
    """The Delaunay triangulation of points, or the regular one of weighted points; exact, for any input.

    Args:
        points: n x 3 positions. A contiguous array of float64 is read in place: it must not change meanwhile.
        weights: n squared radii.
        threads: Threads of a separate pool; by default all calls share one.
        progress: Called with a stage and its completed share.

    Returns:
        Tetrahedra, hidden points and repeated points, as indices of `points`.

    Raises:
        InputError: There are fewer than four points, all are in a plane, or an array is wrong.

    Example:
        >>> from medial_axis import triangulate
        >>> triangulate([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]).cells.shape
        (1, 4)
    """
    sites = floats(points, "points")
    heights = None if weights is None else floats(weights, "weights", None)
    if heights is not None and len(heights) != len(sites):
        raise InputError(f"weights: wrong number (found {len(heights)}, expected {len(sites)})")
    cells, hidden, repeated = _medial.triangulate(sites, heights, call(0, threads, progress))
    return Triangulation(cells, hidden[:, 0], repeated)


def closest_points(
    mesh: Mesh, points: ArrayLike, *, threads: int | None = None
) -> tuple[FloatArray, FloatArray, IndexArray]:
    """The closest point of a surface for each of n points.

    Args:
        mesh: The surface.
        points: n x 3 positions.
        threads: Threads of a separate pool; by default all calls share one.

    Returns:
        Closest points (n x 3), distances (n, in the unit of the mesh) and faces (n).

    Raises:
        InputError: `mesh` is not a Mesh, or `points` not an n x 3 array of finite numbers.

    Example:
        >>> from medial_axis import Mesh, closest_points
        >>> closest, distances, faces = closest_points(Mesh.read("builtin:box"), [[0, 0, 9]])
        >>> distances.shape, faces.shape
        ((1,), (1,))
    """
    return _mesh(mesh).closest_points(points, threads=threads)


def signed_distance(mesh: Mesh, points: ArrayLike, *, threads: int | None = None) -> FloatArray:
    """The distance of each of n points to a surface: negative inside, with an exact sign.

    Args:
        mesh: The surface.
        points: n x 3 positions.
        threads: Threads of a separate pool; by default all calls share one.

    Returns:
        n distances, in the unit of the mesh.

    Raises:
        InputError: `mesh` is not a Mesh that bounds a solid, or `points` not an n x 3 array of finite numbers.

    Example:
        >>> (signed_distance(Mesh.read("builtin:box"), [[0, 0, 0], [0, 0, 9]]) > 0).tolist()
        [False, True]
    """
    return _mesh(mesh).signed_distance(points, threads=threads)


def betti(axis: MedialAxis) -> tuple[int, int, int]:
    """Components, tunnels and cavities of a medial mesh, over Z2.

    Args:
        axis: The medial mesh.

    Returns:
        The Betti numbers b0, b1 and b2.

    Raises:
        InputError: `axis` is not a MedialAxis.

    Example:
        >>> betti(Mesh.read("builtin:torus").medial_axis())
        (1, 1, 0)
    """
    if not isinstance(axis, MedialAxis):
        raise InputError(f"betti: expected a MedialAxis, found a {type(axis).__name__}")
    return axis.betti


def _mesh(mesh: Mesh) -> Mesh:
    if not isinstance(mesh, Mesh):
        raise InputError(f"mesh: expected a Mesh, found a {type(mesh).__name__}")
    return mesh
