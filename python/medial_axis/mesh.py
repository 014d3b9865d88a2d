"""Closed surfaces."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, Literal

from . import _medial
from ._arguments import FloatArray, IndexArray, Progress, call, floats, indices, path_text, whole
from .errors import InputError, ParameterError

if TYPE_CHECKING:
    from .axis import MedialAxis


class Mesh:
    """A surface that bounds a solid: closed, manifold, oriented outward.

    `vertices` and `faces` are arrays, n x 3; or `vertices` alone is a mesh of trimesh, Open3D or PyVista, or a pair of
    arrays. Repeated vertices are merged and faces turned as in a file; `report()` says what was done. A surface that
    bounds no solid is refused with the reason (`InputError`).
    """

    _surface: _medial.Surface
    _problem: str | None
    source: str | None
    """The path or name that it was read from."""

    def __init__(
        self,
        vertices: Any,
        faces: Any = None,
        *,
        name: str = "mesh",
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        if faces is None:
            vertices, faces = _foreign(vertices)
        self._surface = _medial.Surface.from_arrays(
            floats(vertices, "vertices"),
            indices(faces, "faces", 3),
            str(name),
            call(0, threads, progress),
        )
        self._problem = None
        self.source = None

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        *,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Mesh:
        """Reads OFF, OBJ, PLY, STL or GLB; or `builtin:ID`, a solid with a known axis, or `dataset:NAME`."""
        text = path_text(path)
        mesh = cls._of(_medial.Surface.read(text, call(0, threads, progress)))
        mesh.source = text
        return mesh

    @classmethod
    def _of(cls, surface: _medial.Surface, problem: str | None = None) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._surface, mesh._problem, mesh.source = surface, problem, None
        return mesh

    @property
    def name(self) -> str:
        """Name in tables: the stem of the file."""
        return self._surface.name

    @property
    def vertices(self) -> FloatArray:
        """Positions, n x 3."""
        return self._surface.vertices

    @property
    def faces(self) -> IndexArray:
        """Corners of triangles, n x 3, counter-clockwise from outside."""
        return self._surface.faces

    @property
    def problem(self) -> str | None:
        """Why a reconstruction bounds no solid; None where it does, and for every mesh that was read."""
        return self._problem

    def report(self) -> dict[str, Any]:
        """Counts, topology, repairs and warnings, as `medial info --json` says them."""
        result: dict[str, Any] = json.loads(self._surface.report())
        return result

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes .ply, .off or .obj. The file is complete or not there."""
        self._surface.save(path_text(path))

    def medial_axis(
        self,
        *,
        sampling: str = "vertices",
        dual: str = "fan",
        seed: int = 0,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> MedialAxis:
        """The Voronoi medial mesh, from which methods start.

        `sampling` is `vertices`, `auto` (adds samples where the axis fails), `uniform:COUNT` or `blue:COUNT`; `dual`
        is how Voronoi polygons are triangulated: `fan` or `delaunay`.
        """
        from .axis import MedialAxis

        self._solid()
        made = self._surface.medial_axis(str(sampling), str(dual), call(seed, threads, progress))
        return MedialAxis._of(made, self)

    def read_axis(
        self,
        path: str | os.PathLike[str],
        *,
        fit: Literal["none", "similarity", "auto"] = "none",
        radii: Literal["file", "surface"] = "file",
        lenient: bool = False,
        block: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> MedialAxis:
        """Reads a medial mesh of this surface: `.ma` in any dialect, `.ply`, `.obj`.

        In the units of the surface, unless `fit` finds others (`auto`: if it does not fit as it is). `radii="surface"` gives
        spheres without radii their distance to the surface; `lenient` takes lines that the header does not announce;
        `block` is which of several meshes in one file is meant, from 1. `.remarks` of the result says what was done.
        """
        from .axis import MedialAxis

        self._solid()
        block = None if block is None else whole(block, "block", 1, 2**31)
        options = {"fit": fit, "radii": radii, "lenient": lenient, "block": block}
        try:
            text = json.dumps(options)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"read_axis: {error}") from None
        axis, remarks = self._surface.read_axis(path_text(path), text, call(0, threads, progress))
        return MedialAxis._of(axis, self, remarks=remarks)

    def closest_points(
        self, points: Any, *, threads: int | None = None
    ) -> tuple[FloatArray, FloatArray, IndexArray]:
        """For each of n points the closest one of the surface (n x 3), its distance (n) and its face (n)."""
        return self._surface.closest_points(floats(points, "points"), call(0, threads))

    def signed_distance(self, points: Any, *, threads: int | None = None) -> FloatArray:
        """The distance of each point to the surface: negative inside, with an exact sign."""
        self._solid()
        return self._surface.signed_distance(floats(points, "points"), call(0, threads))

    def to_trimesh(self) -> Any:
        """As a `trimesh.Trimesh`, with the vertices in the same order."""
        import trimesh

        return trimesh.Trimesh(self.vertices.copy(), self.faces.copy(), process=False)

    def to_open3d(self) -> Any:
        """As an `open3d.geometry.TriangleMesh`."""
        import open3d

        vertices = open3d.utility.Vector3dVector(self.vertices.copy())
        faces = open3d.utility.Vector3iVector(self.faces.astype("int32"))
        return open3d.geometry.TriangleMesh(vertices, faces)

    def _solid(self) -> None:
        if self._problem is not None:
            raise InputError(f"{self.name}: {self._problem}")

    def __repr__(self) -> str:
        return f"<Mesh {self.name}: {len(self.vertices)} vertices, {len(self.faces)} faces>"


def _foreign(value: Any) -> tuple[Any, Any]:
    """Vertices and triangles of an object of another package."""
    if isinstance(value, (tuple, list)) and len(value) == 2:
        return value[0], value[1]
    for vertices, faces in [("vertices", "faces"), ("vertices", "triangles")]:  # trimesh; Open3D
        if hasattr(value, vertices) and hasattr(value, faces):
            return getattr(value, vertices), getattr(value, faces)
    if hasattr(value, "points") and hasattr(value, "regular_faces"):  # PyVista
        return value.points, value.triangulate().regular_faces
    raise InputError(
        f"a {type(value).__name__} is no mesh: give vertices and faces, or a mesh of trimesh, Open3D or PyVista; "
        "Mesh.read takes a file"
    )
