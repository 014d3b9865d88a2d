"""Medial meshes."""

from __future__ import annotations

import difflib
import json
import keyword
import os
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from . import _medial
from ._arguments import FloatArray, IndexArray, Progress, call, floats, indices, need, path_text, real, same, truths, whole
from ._methods import typed
from .errors import InputError, MedialWarning, ParameterError
from .evaluation import Evaluation
from .mesh import Mesh

if TYPE_CHECKING:
    from .picture import Backend

_OPTIONS = ("spheres", "level", "max_error", "seed", "threads", "progress", "params")


@dataclass(frozen=True)
class Run:
    """The run of a method that made a medial mesh."""

    method: str
    asked: str
    """The requested level as text."""
    params: Mapping[str, Any] = field(hash=False)
    native_level: float | None = None
    """The native level that met the request, if the method has one."""
    seconds: Mapping[str, float] = field(default_factory=dict, hash=False)
    """By stage: `substrate`, shared by all methods; `prepare` and `simplify` of the method; and their `total`."""
    substrates: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Seconds of each substrate that the method used, also if another method built it."""
    warnings: tuple[str, ...] = ()
    max_error: Mapping[str, Any] | None = field(default=None, hash=False)
    """The result of the search for an error bound."""
    record: Mapping[str, Any] = field(default_factory=dict, repr=False, hash=False)
    """The whole run, as `simplify` in a line of `results.jsonl`."""


class MedialAxis:
    """A medial mesh: spheres, and edges and triangles between them, in the units of its surface.

    Made by `Mesh.medial_axis`, `Mesh.read_axis`, `MedialAxis.read`, or from arrays. Sides of faces are added as edges, and
    simplices sorted. Two medial meshes are equal if their arrays are, bit by bit, independent of surfaces and runs. A
    medial mesh does not change; it can be pickled, copied, and be a key.

    Args:
        centres: n x 3 positions.
        radii: n radii.
        edges: m x 2 indices of spheres, from 0.
        faces: k x 3 indices of spheres.
        mesh: Its surface, in the same unit.

    Raises:
        InputError: The arrays are wrong.

    Example:
        >>> from medial_axis import MedialAxis, Mesh
        >>> MedialAxis([[0, 0, 0], [1, 0, 0]], [1.0, 0.5], edges=[[0, 1]])
        <MedialAxis: 2 spheres, 1 edges, 0 faces>
    """

    _axis: _medial.Axis
    _png: bytes | None
    mesh: Mesh | None
    """Its surface, if known."""
    run: Run | None
    """The run of the method that made it, if any."""
    remarks: tuple[str, ...]
    """Defects and repairs of its file."""

    def __init__(
        self,
        centres: ArrayLike,
        radii: ArrayLike,
        edges: ArrayLike = (),
        faces: ArrayLike = (),
        *,
        mesh: Mesh | None = None,
    ) -> None:
        """Checks and copies the arrays."""
        axis = _medial.Axis.from_arrays(
            floats(centres, "centres"),
            floats(radii, "radii", None),
            indices(edges, "edges", 2),
            indices(faces, "faces", 3),
        )
        self._axis, self.mesh, self.run, self.remarks, self._png = axis, None, None, (), None
        if mesh is not None:
            self._axis, self.mesh = self.of(mesh)._axis, mesh

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, block: int | None = None) -> MedialAxis:
        """Reads a file; `Mesh.read_axis` does so with a surface.

        Args:
            path: A `.ma` file in any dialect, `.ply` or `.obj`; or a list of spheres: `.csv`, `.json`, `.yaml` (cuRobo),
                `.xrdf`, `.urdf`, `.xml` (MuJoCo), `.txt`, `.xyzr`.
            block: Number of the mesh, or link of a robot, in a file with several, from 1.

        Returns:
            The medial mesh, without a surface; `.remarks` lists repairs.

        Raises:
            InputError: The file cannot be read.

        Example:
            >>> MedialAxis([[0, 0, 0]], [1.0]).save("point.ma")
            >>> MedialAxis.read("point.ma")
            <MedialAxis: 1 spheres, 0 edges, 0 faces>
        """
        block = None if block is None else whole(block, "block", 1, 2**31)
        axis, remarks = _medial.Axis.read(path_text(path), block)
        return cls._of(axis, None, remarks=remarks)

    @classmethod
    def _of(
        cls,
        axis: _medial.Axis,
        mesh: Mesh | None,
        *,
        run: Run | None = None,
        remarks: Iterable[str] = (),
    ) -> MedialAxis:
        made = cls.__new__(cls)
        made._axis, made.mesh, made.run, made.remarks, made._png = axis, mesh, run, tuple(remarks), None
        return made

    def of(
        self, mesh: Mesh, *, sampling: str = "conforming", dual: str = "fan", seed: int = 0
    ) -> MedialAxis:
        """The same medial mesh as one of a surface, which must have the same unit.

        Args:
            mesh: The surface.
            sampling: Samples of the surface for methods, as in `Mesh.medial_axis`.
            dual: As in `Mesh.medial_axis`.
            seed: Seed of random samples.

        Returns:
            A medial mesh that can be simplified and evaluated.

        Raises:
            InputError: `mesh` bounds no solid.
            ParameterError: `sampling` or `dual` is another word.

        Example:
            >>> MedialAxis([[0, 0, 0]], [0.3]).of(Mesh.read("builtin:box"))
            <MedialAxis of box: 1 spheres, 0 edges, 0 faces>
        """
        if not isinstance(mesh, Mesh):
            raise InputError(f"mesh: expected a Mesh, found a {type(mesh).__name__}")
        mesh._solid()
        made = self._axis.of(mesh._surface, str(sampling), str(dual), call(seed)[0])
        return MedialAxis._of(made, mesh, run=self.run, remarks=self.remarks)

    @property
    def centres(self) -> FloatArray:
        """Centres of the spheres, n x 3."""
        return self._axis.centres

    @property
    def radii(self) -> FloatArray:
        """Radii of the spheres, n."""
        return self._axis.radii

    @property
    def edges(self) -> IndexArray:
        """Pairs of spheres, m x 2, sides of faces among them; sorted."""
        return self._axis.edges

    @property
    def faces(self) -> IndexArray:
        """Triples of spheres, n x 3; sorted, without an orientation."""
        return self._axis.faces

    @property
    def betti(self) -> tuple[int, int, int]:
        """Components, tunnels and cavities of the complex."""
        return self._axis.betti

    @property
    def euler(self) -> int:
        """Spheres - edges + faces."""
        return self._axis.euler

    def __len__(self) -> int:
        return len(self.radii)

    def induced(self, keep: ArrayLike) -> MedialAxis:
        """Some of the spheres, with the edges and faces between them.

        Args:
            keep: n truth values.

        Returns:
            A medial mesh of the same surface.

        Raises:
            InputError: `keep` has another shape or type.

        Example:
            >>> axis = Mesh.read("builtin:box").medial_axis()
            >>> len(axis.induced(axis.radii > axis.radii.mean())) < len(axis)
            True
        """
        kept = truths(keep, "keep", len(self))
        return MedialAxis._of(self._axis.induced(kept.tolist()), self.mesh)

    @typed
    def simplify(
        self,
        method: str | type[Any] | None = None,
        *,
        spheres: int | None = None,
        level: float | Literal["published"] | None = None,
        max_error: float | None = None,
        seed: int = 0,
        threads: int | None = None,
        progress: Progress | None = None,
        params: Mapping[str, Any] | None = None,
        **more: Any,
    ) -> MedialAxis:
        """The simplification by a method. Give one of `spheres`, `level` and `max_error`.

        Args:
            method: An id of `medial_axis.methods()`, or a class of your own; by default `tight` for `spheres` and `max_error`.
            spheres: Number of spheres.
            level: The native level, in the unit of the method; or `published`, the setting of its paper.
            max_error: Search the fewest spheres with at most this Hausdorff error, a fraction of the bounding-box diagonal.
            seed: Seed of every random choice.
            threads: Threads of a separate pool; by default all calls share one.
            progress: Called with a stage and its completed share.
            params: Parameters of the method, by name.
            more: The same as keywords: `k=1e-5`. `medial_axis.methods()` lists them with units and defaults.

        Returns:
            A medial mesh of the same surface. Its `.run` has the seconds by stage, the level and warnings, which are
            also given as `MedialWarning`s: a missed number of spheres among them.

        Raises:
            ParameterError: The method, its level or a parameter is wrong or missing.
            UnsupportedError: The method does not support this.
            FailedError: The method failed.
            InputError: This medial mesh has no surface.

        Example:
            >>> axis = Mesh.read("builtin:box").medial_axis()
            >>> axis.simplify("qmat", spheres=20, k=1e-5)
            <MedialAxis of box by qmat: 20 spheres, 58 edges, 39 faces>
        """
        from .method import id_of, known_params

        if method is None and not (spheres is max_error is None):
            method = _medial.DEFAULT_METHOD
        if not isinstance(method, (str, type)):
            without = "; only spheres=N and max_error=E have a default" if method is None else ""
            raise ParameterError(f"method: expected an id or a class, found {method!r}{without}")
        # `lambda` is a word of Python.
        more = {key[:-1] if keyword.iskeyword(key[:-1]) else key: value for key, value in more.items()}
        given = {**(params or {}), **more}
        id, known = id_of(method), known_params(method)
        unknown = [] if known is None else [str(key) for key in given if key not in known]
        for key in unknown:
            for near in difflib.get_close_matches(key, [*_OPTIONS, *(known or ())], 1):
                raise ParameterError(f"{id}: unknown parameter `{key}`; did you mean `{near}`?")
        # Other mistakes are reported by the method itself.
        if known is not None and not unknown and spheres is level is max_error is None:
            raise ParameterError(
                f"{id}: no level; give one of spheres=N, level=X (the native level, or "
                '"published") and max_error=E (a fraction of the diagonal)'
            )
        try:
            text = json.dumps(given, allow_nan=False, default=_plain)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"parameters {given!r}: {error}") from None
        is_published = isinstance(level, str) and level == "published"
        if is_published and not spheres is max_error is None:
            raise ParameterError("more than one level; give one of spheres, level and max_error")
        axis, facts = _medial.simplify(
            self._axis,
            method,
            None if spheres is None else whole(spheres, "spheres", 0, 2**32 - 1),
            None if level is None or is_published else real(level, "level"),
            None if max_error is None else real(max_error, "max_error"),
            text,
            call(seed, threads, progress),
        )
        loaded: dict[str, Any] = json.loads(facts)
        record = loaded["simplify"]
        notes = tuple(record["warnings"])
        missed = f"{len(axis.radii)} spheres instead of {spheres}"
        if record["status"] == "other_count" and not any(missed in note for note in notes):
            notes = (missed, *notes)
        for note in notes:
            warnings.warn(f"{id}: {note}", MedialWarning, stacklevel=2)
        run = Run(
            method=id,
            asked=loaded["asked"],
            params=given,
            native_level=record["native_level"],
            seconds=record["seconds"],
            substrates=record["substrates"],
            warnings=notes,
            max_error=loaded["max_error"],
            record=record,
        )
        return MedialAxis._of(axis, self.mesh, run=run)

    def evaluate(
        self,
        mesh: Mesh | None = None,
        *,
        certify: float | None = None,
        samples: int = 50_000,
        seed: int = 0,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Evaluation:
        """Every metric against a surface.

        Args:
            mesh: The surface; by default that of the medial mesh.
            certify: Certify the Hausdorff error by an interval of this width, a fraction of the bounding-box diagonal.
            samples: Surface samples in addition to the vertices, at least 100; as many on the union.
            seed: Seed of the samples.
            threads: Threads of a separate pool; by default all calls share one.
            progress: Called with a stage and its completed share.

        Returns:
            The metrics; errors are fractions of the bounding-box diagonal. `.row()` is a row for a frame.

        Raises:
            InputError: There is no surface, or no sphere.
            ParameterError: A number is out of its range.

        Example:
            >>> axis = Mesh.read("builtin:box").medial_axis().simplify("qmat", spheres=20)
            >>> round(axis.evaluate().hausdorff, 3)
            0.033
        """
        mesh = mesh if mesh is not None else self.mesh
        if not isinstance(mesh, Mesh):
            raise InputError("evaluate: this medial axis has no surface; give the surface as mesh=")
        mesh._solid()
        text = self._axis.evaluate(
            mesh._surface,
            whole(samples, "samples", 100, 2**31),
            None if certify is None else real(certify, "certify", 1e-6, 1.0),
            call(seed, threads, progress),
        )
        return Evaluation.from_json(text, mesh=mesh.name, simplify=self.run.record if self.run else None)

    def reconstruct(
        self,
        *,
        tolerance: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Mesh:
        """The boundary of the union of spheres, cones and slabs.

        Args:
            tolerance: Its largest distance from that boundary, a fraction of the bounding-box diagonal.
            threads: Threads of a separate pool; by default all calls share one.
            progress: Called with a stage and its completed share.

        Returns:
            The surface; its `problem` is the reason where it bounds no solid.

        Raises:
            InputError: There is no sphere, or the tolerance is too small.

        Example:
            >>> axis = Mesh.read("builtin:box").medial_axis().simplify("qmat", spheres=20)
            >>> axis.reconstruct(tolerance=0.01).problem is None
            True
        """
        name = f"{self.mesh.name}-union" if self.mesh is not None else "union"
        tolerance = None if tolerance is None else real(tolerance, "tolerance")
        made, problem = self._axis.reconstruct(tolerance, name, call(0, threads, progress))
        return Mesh._of(made, problem)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        color: str | None = None,
        balls: bool = False,
    ) -> None:
        """Writes a file, completely or not at all.

        Args:
            path: `.ma`, `.ply`, `.vtp` (ParaView), `.glb` (Blender, browsers), or `.obj` without radii; for the spheres
                alone `.csv`, `.json`, `.yaml` (cuRobo), `.xrdf`, `.urdf`, `.xml` (MuJoCo), `.txt`, `.xyzr`, with a
                `MedialWarning` if edges are left out.
            color: For viewers: `radius` or `stability`.
            balls: For viewers: add the spheres themselves.

        Raises:
            InputError: The file cannot be written.
            ParameterError: `color` is another word.

        Example:
            >>> Mesh.read("builtin:box").medial_axis().save("box.glb", color="stability")
        """
        left_out = self._axis.save(path_text(path), color, bool(balls))
        if left_out is not None:
            warnings.warn(left_out, MedialWarning, stacklevel=2)

    def plot(self, *, backend: Backend | None = None, screenshot: str | os.PathLike[str] | None = None) -> Any:
        """Shows it in its surface: in a window or a notebook by PyVista where that is installed, else as a PNG.

        Args:
            backend: `pyvista` or `png`; by default PyVista if it is installed.
            screenshot: Writes a picture into this file instead, without a screen.

        Returns:
            The result of `pyvista.Plotter.show`; or a `Picture`, which a notebook shows.

        Raises:
            ParameterError: `backend` is another word.
            ImportError: PyVista is requested and not installed.
            InputError: There is no surface, for a PNG.

        Example:
            >>> Mesh.read("builtin:box").medial_axis().plot(backend="png").width
            800
        """
        from .picture import plot

        return plot(self, backend, screenshot)

    def to_networkx(self) -> Any:
        """The graph of spheres and edges for NetworkX.

        Returns:
            A `networkx.Graph`. Nodes are the indices of spheres with `centre` (a tuple of 3) and `radius`; `graph["faces"]`
            is the list of triples.

        Raises:
            ImportError: NetworkX is not installed.

        Example:
            >>> axis = MedialAxis([[0, 0, 0], [1, 0, 0]], [1.0, 0.5], edges=[[0, 1]])
            >>> axis.to_networkx().nodes[1]  # doctest: +SKIP
            {'centre': (1.0, 0.0, 0.0), 'radius': 0.5}
        """
        graph = need("networkx", "NetworkX").Graph(faces=[tuple(face) for face in self.faces.tolist()])
        spheres = zip(self.centres.tolist(), self.radii.tolist())
        graph.add_nodes_from((i, {"centre": tuple(c), "radius": r}) for i, (c, r) in enumerate(spheres))
        graph.add_edges_from(self.edges.tolist())
        return graph

    def to_trimesh(self) -> Any:
        """Spheres and faces for trimesh, which has no edges without a face: `lone_edges()` are those.

        Returns:
            A `trimesh.Trimesh` with `vertex_attributes["radius"]`.

        Raises:
            ImportError: trimesh is not installed.

        Example:
            >>> axis = Mesh.read("builtin:box").medial_axis()
            >>> len(axis.to_trimesh().faces) == len(axis.faces)  # doctest: +SKIP
            True
        """
        trimesh = need("trimesh", "trimesh")
        radii = {"radius": self.radii.copy()}
        return trimesh.Trimesh(self.centres.copy(), self.faces.copy(), process=False, vertex_attributes=radii)

    def to_pyvista(self) -> Any:
        """Triangles, and lines for edges without a face, for PyVista.

        Returns:
            A `pyvista.PolyData` with the `radius` of each point.

        Raises:
            ImportError: PyVista is not installed.

        Example:
            >>> axis = Mesh.read("builtin:box").medial_axis()
            >>> axis.to_pyvista()["radius"].max() == axis.radii.max()  # doctest: +SKIP
            True
        """
        pyvista = need("pyvista", "PyVista")
        data = pyvista.PolyData()
        data.points = self.centres.copy()
        lone = self.lone_edges()
        data.lines = np.insert(lone.astype(int), 0, 2, axis=1).ravel()
        data.faces = np.insert(self.faces.astype(int), 0, 3, axis=1).ravel()
        data["radius"] = self.radii.copy()
        return data

    def lone_edges(self) -> IndexArray:
        """The edges that are a side of no face.

        Returns:
            m x 2 indices of spheres.

        Example:
            >>> MedialAxis([[0, 0, 0], [1, 0, 0]], [1.0, 0.5], edges=[[0, 1]]).lone_edges().tolist()
            [[0, 1]]
        """
        if len(self.faces) == 0:
            return self.edges
        sides = np.concatenate([self.faces[:, [0, 1]], self.faces[:, [0, 2]], self.faces[:, [1, 2]]])
        count = np.uint64(len(self))

        def keys(pairs: IndexArray) -> Any:
            return pairs[:, 0].astype(np.uint64) * count + pairs[:, 1].astype(np.uint64)

        return self.edges[~np.isin(keys(self.edges), keys(sides))]

    def __repr__(self) -> str:
        of = f" of {self.mesh.name}" if self.mesh is not None else ""
        by = f" by {self.run.method}" if self.run is not None else ""
        return (
            f"<MedialAxis{of}{by}: {len(self)} spheres, {len(self.edges)} edges, {len(self.faces)} faces>"
        )

    def _repr_png_(self) -> bytes | None:
        from .picture import small_png

        self._png = self._png or small_png(self)
        return self._png

    def _repr_html_(self) -> str:
        from .picture import to_html

        rows: dict[str, object] = {}
        if self.mesh is not None:
            rows["medial mesh of"] = self.mesh.name
        if self.run is not None:
            rows["method"] = f"{self.run.method}, {self.run.asked}"
        rows |= {"spheres": len(self), "edges": len(self.edges), "faces": len(self.faces), "Betti numbers": self.betti}
        if self.mesh is not None:
            rows["Betti numbers of the solid"] = tuple(self.mesh.report()["expected_betti"])
        return to_html(self._repr_png_(), rows)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MedialAxis):
            return NotImplemented
        return self is other or same(self._arrays(), other._arrays())

    def __hash__(self) -> int:
        return hash(tuple(array.tobytes() for array in self._arrays()))

    def _arrays(self) -> tuple[Any, ...]:
        return self.centres, self.radii, self.edges, self.faces

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (*self._arrays(), self._axis.state(), self.mesh, self.run, self.remarks)


def _restored(
    centres: FloatArray,
    radii: FloatArray,
    edges: IndexArray,
    faces: IndexArray,
    state: Any,
    mesh: Mesh | None,
    run: Run | None,
    remarks: tuple[str, ...],
) -> MedialAxis:
    """A medial mesh from its pickle."""
    contacts, options, is_initial = state
    samples, of_sphere = contacts or (None, None)
    surface = None if mesh is None else mesh._surface
    axis = MedialAxis(centres, radii, edges, faces)._axis
    made = axis.with_state(samples, of_sphere, surface, options, is_initial)
    return MedialAxis._of(made, mesh, run=run, remarks=remarks)


def _plain(value: Any) -> Any:
    """Numbers of numpy as those of Python."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"expected a single value, found {value!r}")
