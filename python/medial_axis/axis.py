"""Medial meshes."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from . import _medial
from ._arguments import FloatArray, IndexArray, Progress, call, floats, indices, path_text, real, truths, whole
from ._methods import typed
from .errors import InputError, ParameterError
from .evaluation import Evaluation
from .mesh import Mesh


@dataclass(frozen=True)
class Run:
    """How a result was made."""

    method: str
    asked: str
    """The level, in words."""
    params: Mapping[str, Any]
    native_level: float | None = None
    """The method's own level that met the request, where it has one."""
    seconds: Mapping[str, float] = field(default_factory=dict)
    """By stage: `substrate`, shared by all methods; `prepare` and `simplify`, the method's own."""
    substrates: Mapping[str, float] = field(default_factory=dict)
    """Seconds of each substrate that the method used, whoever built it first."""
    warnings: tuple[str, ...] = ()
    max_error: Mapping[str, Any] | None = None
    """What the search for an error bound found."""


class MedialAxis:
    """A medial mesh: spheres, and edges and triangles between them, in the units of its surface.

    Made by `Mesh.medial_axis`, `Mesh.read_axis`, `MedialAxis.read`, or of arrays: n x 3 centres, n radii, and indices from 0.
    Sides of faces are added as edges, and simplices sorted.
    """

    _axis: _medial.Axis
    mesh: Mesh | None
    """The surface that it is of, where that is known."""
    run: Run | None
    """How it was made, if by a method."""
    remarks: tuple[str, ...]
    """What was found and repaired in its file."""

    def __init__(
        self,
        centres: Any,
        radii: Any,
        edges: Any = (),
        faces: Any = (),
        *,
        mesh: Mesh | None = None,
    ) -> None:
        axis = _medial.Axis.from_arrays(
            floats(centres, "centres"),
            floats(radii, "radii", None),
            indices(edges, "edges", 2),
            indices(faces, "faces", 3),
        )
        self._axis, self.mesh, self.run, self.remarks = axis, None, None, ()
        if mesh is not None:
            self._axis, self.mesh = self.of(mesh)._axis, mesh

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> MedialAxis:
        """Reads `.ma` in any dialect, `.ply` or `.obj`; no surface is known then."""
        axis, remarks = _medial.Axis.read(path_text(path))
        return cls._of(axis, None, remarks=remarks)

    @classmethod
    def _of(
        cls,
        axis: _medial.Axis,
        mesh: Mesh | None,
        *,
        run: Run | None = None,
        remarks: list[str] | None = None,
    ) -> MedialAxis:
        made = cls.__new__(cls)
        made._axis, made.mesh, made.run, made.remarks = axis, mesh, run, tuple(remarks or ())
        return made

    def of(
        self, mesh: Mesh, *, sampling: str = "vertices", dual: str = "fan", seed: int = 0
    ) -> MedialAxis:
        """The same medial mesh as one of this surface, which must have the same units."""
        if not isinstance(mesh, Mesh):
            raise InputError(f"mesh: a Mesh is needed, not a {type(mesh).__name__}")
        mesh._solid()
        made = self._axis.of(mesh._surface, str(sampling), str(dual), call(seed)[0])
        return MedialAxis._of(made, mesh, run=self.run, remarks=list(self.remarks))

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
        """Pairs of spheres, n x 2, sides of faces among them; sorted."""
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

    def induced(self, keep: Any) -> MedialAxis:
        """The spheres for which `keep` is true, with the edges and faces between them."""
        kept = truths(keep, "keep", len(self))
        return MedialAxis._of(self._axis.induced(kept.tolist()), self.mesh)

    @typed
    def simplify(
        self,
        method: str | type[Any],
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
        """The simplification of this medial mesh by a method, an id (`medial_axis.methods()`) or a class.

        Give one of `spheres`, how many; `level`, the method's own, in its unit; `max_error`, as few spheres as keep the
        Hausdorff error within this fraction of the diagonal; or none, for the published level. Parameters are those of the
        paper, by name (`k=1e-5`), or in `params`. `.run` of the result says the rest.
        """
        if not isinstance(method, (str, type)):
            raise ParameterError(f"method: an id or a class is needed, not {method!r}")
        given = {**(params or {}), **more}
        try:
            text = json.dumps(given, allow_nan=False, default=_plain)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"parameters {given!r}: {error}") from None
        axis, facts = self._axis.simplify(
            method,
            None if spheres is None else whole(spheres, "spheres", 0, 2**32 - 1),
            None if level is None else real(level, "level"),
            None if max_error is None else real(max_error, "max_error"),
            text,
            call(seed, threads, progress),
        )
        from .method import id_of

        told: dict[str, Any] = json.loads(facts)
        record = told["simplify"]
        run = Run(
            method=id_of(method),
            asked=told["asked"],
            params=given,
            native_level=record["native_level"],
            seconds=record["seconds"],
            substrates=record["substrates"],
            warnings=tuple(record["warnings"]),
            max_error=told["max_error"],
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
        """Every metric against a surface, its own unless another is given.

        `certify` encloses the Hausdorff error in an interval at most so wide, a fraction of the diagonal.
        """
        mesh = mesh if mesh is not None else self.mesh
        if not isinstance(mesh, Mesh):
            raise InputError("evaluate: give the surface, a Mesh: this medial axis knows none")
        mesh._solid()
        text = self._axis.evaluate(
            mesh._surface,
            whole(samples, "samples", 1, 2**31),
            None if certify is None else real(certify, "certify"),
            call(seed, threads, progress),
        )
        return Evaluation.from_json(text)

    def reconstruct(
        self,
        *,
        tolerance: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Mesh:
        """The boundary of the union of spheres, cones and slabs, within a tolerance (a fraction of the diagonal).

        Its `problem` says why it bounds no solid, where it does not.
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
        """Writes `.ma`, `.ply`, `.vtp` (ParaView), `.glb` (Blender, browsers), or `.obj` without radii; complete or not at all.

        For viewers: `color` is `radius` or `stability`, and `balls` adds the spheres themselves.
        """
        self._axis.save(path_text(path), color, bool(balls))

    def to_pyvista(self) -> Any:
        """As a `pyvista.PolyData`: lines for edges without a face, triangles, and the radius at points."""
        import pyvista

        data = pyvista.PolyData()
        data.points = self.centres.copy()
        lone = self.lone_edges()
        data.lines = np.insert(lone.astype(int), 0, 2, axis=1).ravel()
        data.faces = np.insert(self.faces.astype(int), 0, 3, axis=1).ravel()
        data["radius"] = self.radii.copy()
        return data

    def lone_edges(self) -> IndexArray:
        """The edges that are a side of no face."""
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


def _plain(value: Any) -> Any:
    """Numbers of numpy as those of Python."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} is no single value")
