"""Closed surfaces."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from . import _medial
from ._arguments import FloatArray, IndexArray, Progress, call, floats, indices, need, path_text, real, same, whole
from .errors import InputError, ParameterError

if TYPE_CHECKING:
    from .axis import MedialAxis
    from .picture import Backend


class Mesh:
    """A surface that bounds a solid: closed, manifold, oriented outward.

    Repeated vertices are merged and faces turned as in a file; `report()` lists these repairs. Two meshes are equal if their
    vertices and faces are, bit by bit. A mesh does not change; it can be pickled, copied, and be a key.

    Args:
        vertices: n x 3 positions, in any unit; or a mesh of trimesh, Open3D or PyVista, or a pair of arrays.
        faces: m x 3 indices of vertices, from 0.
        name: Name in tables.
        threads: Threads of a separate pool; by default all calls share one.
        progress: Called with a stage and its completed share.

    Raises:
        InputError: The arrays are wrong, or the surface bounds no solid: it is open, not manifold, or empty. `Mesh.repair`
            closes holes.

    Example:
        >>> from medial_axis import Mesh
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> Mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], name="tetrahedron")
        <Mesh tetrahedron: 4 vertices, 4 faces>
    """

    _surface: _medial.Surface
    _problem: str | None
    _png: bytes | None
    source: str | None
    """The path or name that it was read from."""

    def __init__(
        self,
        vertices: object,
        faces: ArrayLike | None = None,
        *,
        name: str = "mesh",
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Checks, repairs and orients the arrays."""
        if faces is None:
            vertices, faces = _foreign(vertices)
        self._surface = _medial.Surface.from_arrays(
            floats(vertices, "vertices"),
            indices(faces, "faces", 3),
            str(name),
            call(0, threads, progress),
        )
        self._problem = self._png = self.source = None

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        *,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Mesh:
        """Reads a file or a built-in shape.

        Args:
            path: An OFF, OBJ, PLY or STL file; `builtin:ID`, a solid with a known axis; or `dataset:NAME`.
            threads: Threads of a separate pool; by default all calls share one.
            progress: Called with a stage and its completed share.

        Returns:
            The surface, in the unit of the file.

        Raises:
            InputError: The file cannot be read, or bounds no solid.

        Example:
            >>> Mesh.read("builtin:torus")
            <Mesh torus: 1232 vertices, 2464 faces>
        """
        text = path_text(path)
        mesh = cls._of(_medial.Surface.read(text, call(0, threads, progress)))
        mesh.source = text
        return mesh

    @classmethod
    def repair(
        cls,
        vertices: object,
        faces: ArrayLike | None = None,
        *,
        fill_holes: bool = False,
        wrap: bool | float = False,
        components: str | int | float = "all",
        name: str | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Mesh:
        """Repairs a surface until it bounds a solid, like `medial repair`.

        Args:
            vertices: A file; or n x 3 positions, or a mesh of another package, as for `Mesh`.
            faces: m x 3 indices of vertices, from 0.
            fill_holes: Close holes by triangles between their vertices.
            wrap: Replace the surface by a closed one around it, which also an open or non-manifold one has. A fraction of
                the bounding-box diagonal, 0.01 for `True`: openings narrower than twice that are closed.
            components: Keep `all` parts, the `largest`, a number of the largest, or those with a share of the area below 1.
            name: Name in tables; by default the stem of the file.
            threads: Threads of a separate pool; by default all calls share one.
            progress: Called with a stage and its completed share.

        Returns:
            The surface; `report()["repairs"]` lists the repairs.

        Raises:
            InputError: The surface still bounds no solid.
            ParameterError: `components` or `wrap` is something else, or `fill_holes` and `wrap` are both given.

        Example:
            >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
            >>> mesh = Mesh.repair(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2]], fill_holes=True)
            >>> len(mesh.faces), mesh.report()["repairs"][0]["repair"]
            (4, 'filled_hole')
        """
        alpha = {True: 0.01, False: None}[wrap] if isinstance(wrap, bool) else real(wrap, "wrap", 0.0, 1.0)
        if alpha is not None and fill_holes:
            raise ParameterError("wrap: a wrap has no holes to fill; leave out fill_holes")
        path, off = "mesh", None
        if faces is None and isinstance(vertices, (str, os.PathLike)):
            path = path_text(vertices)
        else:
            given = _foreign(vertices) if faces is None else (vertices, faces)
            off = _off(floats(given[0], "vertices"), indices(given[1], "faces", 3))
        made = _medial.Surface.repair(
            path,
            off,
            bool(fill_holes),
            alpha,
            str(components),
            None if name is None else str(name),
            call(0, threads, progress),
        )
        return cls._of(made)

    @classmethod
    def _of(cls, surface: _medial.Surface, problem: str | None = None) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._surface, mesh._problem, mesh.source, mesh._png = surface, problem, None, None
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
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal, in the unit of the mesh: errors are fractions of it."""
        return self._surface.diagonal

    @property
    def problem(self) -> str | None:
        """Why a reconstruction bounds no solid; None where it does, and for every mesh that was read."""
        return self._problem

    def report(self) -> dict[str, Any]:
        """Counts, topology, repairs and warnings, with the keys of `medial info --json`.

        Returns:
            A new dictionary; `volume` and `area` are in the unit of the mesh.

        Example:
            >>> Mesh.read("builtin:torus").report()["expected_betti"]
            [1, 1, 0]
        """
        result: dict[str, Any] = json.loads(self._surface.report())
        return result

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a file, completely or not at all.

        Args:
            path: A `.ply`, `.off`, `.obj` or `.stl` file; STL is written as text.

        Raises:
            InputError: It has another extension, or cannot be written.

        Example:
            >>> Mesh.read("builtin:box").save("box.ply")
        """
        self._surface.save(path_text(path))

    def medial_axis(
        self,
        *,
        sampling: str = "conforming",
        dual: str = "fan",
        seed: int = 0,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> MedialAxis:
        """The Voronoi medial mesh, from which methods start.

        Args:
            sampling: `conforming` (the vertices, with points that make the topology right), `vertices`, `uniform:COUNT` or
                `blue:COUNT`.
            dual: How Voronoi polygons are triangulated: `fan` or `delaunay`.
            seed: Seed of random samples.
            threads: Threads of a separate pool; by default all calls share one.
            progress: Called with a stage and its completed share.

        Returns:
            The medial mesh, in the unit of the surface.

        Raises:
            ParameterError: `sampling` or `dual` is another word.
            InputError: The surface bounds no solid, or no sphere is inside.

        Example:
            >>> Mesh.read("builtin:box").medial_axis()
            <MedialAxis of box: 3980 spheres, 11695 edges, 7716 faces>
        """
        from .axis import MedialAxis

        self._solid()
        made = _medial.Axis.of_surface(self._surface, str(sampling), str(dual), call(seed, threads, progress))
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
        """Reads a medial mesh of this surface.

        Args:
            path: A file that `MedialAxis.read` reads.
            fit: `none`: the file has the unit of the surface. `similarity` finds scale and translation; `auto` does if the
                spheres do not fit otherwise.
            radii: `surface` gives spheres without radii their distance to the surface.
            lenient: Read all lines if the header states a different number.
            block: Number of the mesh, or link of a robot, in a file with several, from 1.
            threads: Threads of a separate pool; by default all calls share one.
            progress: Called with a stage and its completed share.

        Returns:
            The medial mesh; `.remarks` lists repairs and the fitting.

        Raises:
            InputError: The file cannot be read.
            ParameterError: An option has another value.

        Example:
            >>> box = Mesh.read("builtin:box")
            >>> box.medial_axis().save("box.ma")
            >>> box.read_axis("box.ma") == box.medial_axis()
            True
        """
        from .axis import MedialAxis

        self._solid()
        block = None if block is None else whole(block, "block", 1, 2**31)
        options = {"fit": fit, "radii": radii, "lenient": lenient, "block": block}
        try:
            text = json.dumps(options)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"read_axis: {error}") from None
        axis, remarks = _medial.Axis.read_for(self._surface, path_text(path), text, call(0, threads, progress))
        return MedialAxis._of(axis, self, remarks=remarks)

    def closest_points(
        self, points: ArrayLike, *, threads: int | None = None
    ) -> tuple[FloatArray, FloatArray, IndexArray]:
        """The closest point of the surface for each of n points.

        Args:
            points: n x 3 positions.
            threads: Threads of a separate pool; by default all calls share one.

        Returns:
            Closest points (n x 3), distances (n, in the unit of the mesh) and faces (n).

        Raises:
            InputError: `points` is not an n x 3 array of finite numbers.

        Example:
            >>> closest, distances, faces = Mesh.read("builtin:box").closest_points([[0, 0, 9]])
            >>> closest.tolist(), distances.tolist()
            ([[0.0, 0.0, 0.5]], [8.5])
        """
        return self._surface.closest_points(floats(points, "points"), call(0, threads))

    def signed_distance(self, points: ArrayLike, *, threads: int | None = None) -> FloatArray:
        """The distance of each of n points to the surface: negative inside, with an exact sign.

        Args:
            points: n x 3 positions.
            threads: Threads of a separate pool; by default all calls share one.

        Returns:
            n distances, in the unit of the mesh.

        Raises:
            InputError: `points` is not an n x 3 array of finite numbers, or the surface bounds no solid.

        Example:
            >>> Mesh.read("builtin:box").signed_distance([[0, 0, 0], [0, 0, 9]]).tolist()
            [-0.5, 8.5]
        """
        self._solid()
        return self._surface.signed_distance(floats(points, "points"), call(0, threads))

    def plot(self, *, backend: Backend | None = None, screenshot: str | os.PathLike[str] | None = None) -> Any:
        """Shows the surface: in a window or a notebook by PyVista where that is installed, else as a PNG.

        Args:
            backend: `pyvista` or `png`; by default PyVista if it is installed.
            screenshot: Writes a picture into this file instead, without a screen.

        Returns:
            The result of `pyvista.Plotter.show`; or a `Picture`, which a notebook shows.

        Raises:
            ParameterError: `backend` is another word.
            ImportError: PyVista is requested and not installed.

        Example:
            >>> Mesh.read("builtin:box").plot(backend="png").width
            800
        """
        from .picture import plot

        return plot(self, backend, screenshot)

    def to_trimesh(self) -> Any:
        """The surface for trimesh, with the vertices in the same order.

        Returns:
            A `trimesh.Trimesh`.

        Raises:
            ImportError: trimesh is not installed.

        Example:
            >>> Mesh.read("builtin:box").to_trimesh().is_watertight  # doctest: +SKIP
            True
        """
        trimesh = need("trimesh", "trimesh")
        return trimesh.Trimesh(self.vertices.copy(), self.faces.copy(), process=False)

    def to_open3d(self) -> Any:
        """The surface for Open3D, with the vertices in the same order.

        Returns:
            An `open3d.geometry.TriangleMesh`.

        Raises:
            ImportError: Open3D is not installed.

        Example:
            >>> Mesh.read("builtin:box").to_open3d().is_watertight()  # doctest: +SKIP
            True
        """
        open3d = need("open3d", "Open3D")
        vertices = open3d.utility.Vector3dVector(self.vertices.copy())
        faces = open3d.utility.Vector3iVector(self.faces.astype("int32"))
        return open3d.geometry.TriangleMesh(vertices, faces)

    def to_pyvista(self) -> Any:
        """The surface for PyVista, with the vertices in the same order.

        Returns:
            A `pyvista.PolyData`.

        Raises:
            ImportError: PyVista is not installed.

        Example:
            >>> Mesh.read("builtin:box").to_pyvista().is_manifold  # doctest: +SKIP
            True
        """
        pyvista = need("pyvista", "PyVista")
        data = pyvista.PolyData()
        data.points = self.vertices.copy()
        data.faces = np.insert(self.faces.astype(int), 0, 3, axis=1).ravel()
        return data

    def _solid(self) -> None:
        if self._problem is not None:
            raise InputError(f"{self.name}: {self._problem}")

    def __repr__(self) -> str:
        return f"<Mesh {self.name}: {len(self.vertices)} vertices, {len(self.faces)} faces>"

    def _repr_png_(self) -> bytes | None:
        from .picture import small_png

        self._png = self._png or small_png(self)
        return self._png

    def _repr_html_(self) -> str:
        from .picture import to_html

        report = self.report()
        rows = {
            "mesh": self.name,
            "vertices": len(self.vertices),
            "faces": len(self.faces),
            "diagonal": f"{self.diagonal:.6g}",
            "Betti numbers of the solid": self._problem or tuple(report["expected_betti"]),
            "repairs": len(report["repairs"]),
        }
        return to_html(self._repr_png_(), rows)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Mesh):
            return NotImplemented
        return self is other or same(self._arrays(), other._arrays())

    def __hash__(self) -> int:
        return hash(tuple(array.tobytes() for array in self._arrays()))

    def _arrays(self) -> tuple[Any, ...]:
        return self.vertices, self.faces

    def __reduce__(self) -> tuple[Any, ...]:
        from .axis import MedialAxis

        truth = _medial.Axis.truth(self._surface)
        known = None if truth is None else MedialAxis._of(truth, None)
        return _restored, (*self._arrays(), self.name, self._surface.report(), known, self._problem, self.source)


def _restored(
    vertices: FloatArray,
    faces: IndexArray,
    name: str,
    report: str,
    truth: MedialAxis | None,
    problem: str | None,
    source: str | None,
) -> Mesh:
    """A mesh from its pickle."""
    surface = _medial.surface_from_parts(
        floats(vertices, "vertices"),
        indices(faces, "faces", 3),
        name,
        report,
        None if truth is None else truth._axis,
        problem is None,
        call(),
    )
    mesh = Mesh._of(surface, problem)
    mesh.source = source
    return mesh


def _off(vertices: FloatArray, faces: IndexArray) -> bytes:
    """The text of an OFF file."""
    lines = [f"OFF\n{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(map(repr, row)) for row in vertices.tolist()]
    lines += [" ".join(map(str, (3, *row))) for row in faces.tolist()]
    return "\n".join(lines).encode() + b"\n"


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
        f"not a mesh (found a {type(value).__name__}); give vertices and faces, a mesh of trimesh, Open3D or PyVista, "
        "or a file to Mesh.read"
    )
