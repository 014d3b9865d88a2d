"""Evaluations of medial meshes."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from . import _medial

_DIAGONAL = "fraction of the bounding-box diagonal"

# A number with its unit, for `Evaluation.unit`.
_Length = Annotated[float, _DIAGONAL]
_Degrees = Annotated["float | None", "degrees"]
_OfTriangles = Annotated["float | None", "share of the triangles"]


@dataclass(frozen=True)
class Certificate:
    """An interval that contains the Hausdorff distance."""

    lower: _Length
    upper: _Length
    tolerance: _Length
    pieces: int
    """Number of pieces that were evaluated."""
    point: Annotated[tuple[float, float, float], "unit of the mesh"]
    """Where the distance is `lower`."""
    on: str
    """The surface that `point` is on: `surface` or `union`."""


@dataclass(frozen=True)
class TriangleQuality:
    """Angles of the medial triangles; None without triangles."""

    min_angle_mean: _Degrees
    max_angle_mean: _Degrees
    below_30: _OfTriangles
    below_10: _OfTriangles
    below_1: _OfTriangles
    zero_area: Annotated[int, "triangles"]


@dataclass(frozen=True)
class Spikes:
    """Spike measures; METHODOLOGY.md defines them."""

    by_ratio: tuple[dict[str, float], ...] = field(hash=False)
    """For each threshold on the stability ratio: shares and counts."""
    dangling_edges: int
    fins: int
    idle_spheres: int
    angle_spikes: int | None
    """Spheres with a separation angle below 20 degrees; None where contact points are not known."""


@dataclass(frozen=True)
class Counts:
    """Sizes of the complex."""

    spheres: int
    edges: int
    faces: int
    lone_edges: int
    isolated: int
    nonmanifold_edges: int


@dataclass(frozen=True)
class Evaluation:
    """Every metric of a medial mesh against a surface.

    `Evaluation.unit("hausdorff")` gives the unit of a field; `in_units("hausdorff")` a length in that of the mesh.
    METHODOLOGY.md defines each number.
    """

    hausdorff: _Length
    """The larger of `epsilon_union` and `reverse`."""
    epsilon: _Length
    """Largest distance from the surface to a primitive, buried or not: the reading of the Q-MAT paper."""
    epsilon_union: _Length
    """Largest distance from the surface to the union."""
    reverse: _Length
    """Largest distance from the union's boundary to the surface."""
    mean: _Length
    rms: _Length
    p95: _Length
    p99: _Length
    reverse_mean: _Length
    spheres_only: _Length
    """`epsilon_union` without cones and slabs."""
    samples: int
    reverse_samples: int
    volume_error: Annotated[float | None, "fraction of the solid's volume"]
    volume_ratio: Annotated[float | None, "volume of the union over the solid's"]
    cover: dict[str, Any] | None = field(hash=False)
    """One-sided errors, of spheres without edges or with a certificate: `uncovered` and `overshoot` in certified
    intervals, and means. METHODOLOGY.md defines the keys."""
    protrusion: Annotated[float | None, _DIAGONAL]
    """How far the union's boundary reaches out of the solid."""
    centres_outside: Annotated[float | None, "share of the spheres"]
    quality: TriangleQuality
    spikes: Spikes
    betti: tuple[int, int, int]
    """Components, tunnels and cavities of the complex."""
    euler: int
    expected_betti: tuple[int, int, int] | None
    """Those that the solid's topology implies."""
    counts: Counts
    certified: Certificate | None
    axis: dict[str, Any] | None = field(hash=False)
    """Distances to the exactly known axis of a built-in shape."""
    structure: dict[str, Any] | None = field(hash=False)
    """Sheets, seams, contacts and sharp edges: METHODOLOGY.md defines the keys."""
    diagonal: Annotated[float, "unit of the mesh"]
    """The bounding-box diagonal of the mesh."""
    seed: int
    warnings: tuple[str, ...]
    record: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)
    """The same as in a line of `results.jsonl`: `mesh`, `simplify` and `evaluate`."""

    @classmethod
    def from_json(cls, text: str, *, mesh: str = "", simplify: Mapping[str, Any] | None = None) -> Evaluation:
        """Reads the output of `medial evaluate --json`.

        Args:
            text: A JSON object.
            mesh: Name of the surface, for `row`.
            simplify: The run, for `row`: `Run.record`.

        Returns:
            The metrics.

        Raises:
            KeyError: A metric is missing.

        Example:
            >>> from medial_axis import Evaluation, Mesh
            >>> found = Mesh.read("builtin:box").medial_axis().evaluate(samples=1000)
            >>> Evaluation.from_json(json.dumps(found.record["evaluate"])) == found
            True
        """
        values: dict[str, Any] = json.loads(text)
        status = "external" if simplify is None else simplify["status"]
        sizes = {name: values["counts"][name] for name in ("spheres", "edges", "faces")}
        run = simplify or {"method": "", "level": "published", "status": status, **sizes}
        record = {"mesh": mesh, "status": status, "simplify": run, "evaluate": json.loads(text)}
        certified = values.get("certified")
        if certified is not None:
            witness = certified.pop("witness")
            certified = Certificate(**certified, point=_triple(witness["point"]), on=witness["on"])
        spikes = {**values["spikes"], "by_ratio": tuple(values["spikes"]["by_ratio"])}
        expected = values.get("expected_betti")
        values.update(
            certified=certified,
            axis=values.get("axis"),
            structure=values.get("structure"),
            cover=values.get("cover"),
            volume_ratio=values.get("volume_ratio"),
            quality=TriangleQuality(**values["quality"]),
            spikes=Spikes(**spikes),
            counts=Counts(**values["counts"]),
            betti=tuple(values["betti"]),
            expected_betti=None if expected is None else tuple(expected),
            warnings=tuple(values["warnings"]),
            record=record,
        )
        # Without the version, which the command adds.
        return cls(**{name: values[name] for name in (f.name for f in dataclasses.fields(cls))})

    @classmethod
    def unit(cls, name: str) -> str | None:
        """The unit of a field.

        Args:
            name: The field.

        Returns:
            The unit; None for counts and fields that are not numbers.

        Raises:
            KeyError: There is no such field.

        Example:
            >>> Evaluation.unit("hausdorff")
            'fraction of the bounding-box diagonal'
        """
        hint = typing.get_type_hints(cls, include_extras=True)[name]
        noted: tuple[str, ...] = getattr(hint, "__metadata__", ())
        return noted[0] if noted else None

    def in_units(self, name: str) -> float:
        """A length in the unit of the mesh instead of diagonals.

        Args:
            name: The field.

        Returns:
            The length.

        Raises:
            ValueError: The field is not a length.

        Example:
            >>> from medial_axis import Mesh
            >>> found = Mesh.read("builtin:box").medial_axis().evaluate(samples=1000)
            >>> found.in_units("hausdorff") == found.hausdorff * found.diagonal
            True
        """
        value = getattr(self, name)
        if self.unit(name) != _DIAGONAL or value is None:
            raise ValueError(f"{name}: expected a fraction of the diagonal, found {self.unit(name) or value!r}")
        return float(value) * self.diagonal

    def row(self) -> dict[str, Any]:
        """A row for a frame, with the columns of `results.csv`: the metrics, and the run that made the medial mesh.

        Returns:
            Values by column; columns without a value are left out.

        Example:
            >>> from medial_axis import Mesh
            >>> axis = Mesh.read("builtin:box").medial_axis()
            >>> rows = [axis.simplify("qmat", spheres=n).evaluate(samples=1000).row() for n in (40, 20)]
            >>> [(row["mesh"], row["method"], row["spheres"]) for row in rows]
            [('box', 'qmat', 40), ('box', 'qmat', 20)]
            >>> import pandas  # doctest: +SKIP
            >>> pandas.DataFrame(rows)[["spheres", "hausdorff"]]  # doctest: +SKIP
        """
        [row] = csv.DictReader(io.StringIO(_medial.results_row(json.dumps(self.record))))
        # The machine, and the request of an external medial mesh, are unknown.
        unknown = {"cores", "memory", "seeds"}
        if self.record["simplify"]["method"] == "":
            unknown |= {"level", "asked", "params", "seed"}
        return {key: _value(text) for key, text in row.items() if text != "" and key not in unknown}

    def __str__(self) -> str:
        def percent(share: float | None) -> str:
            return "-" if share is None else f"{100 * share:.3f} %"

        counts = self.counts
        lines = [
            f"{counts.spheres} spheres, {counts.edges} edges, {counts.faces} faces",
            f"  Hausdorff, symmetric    {percent(self.hausdorff)} of the diagonal",
            f"  surface to union, max   {percent(self.epsilon_union)}, mean {percent(self.mean)}",
            f"  union to surface, max   {percent(self.reverse)}, mean {percent(self.reverse_mean)}",
            f"  volume difference       {percent(self.volume_error)} of the volume",
            f"  Betti numbers           {self.betti} (the solid's: {self.expected_betti})",
        ]
        if self.certified is not None:
            lower, upper = percent(self.certified.lower), percent(self.certified.upper)
            lines.append(f"  Hausdorff, certified    {lower} to {upper}")
        if self.cover is not None:
            for name in ("uncovered", "overshoot"):
                lines.append(f"  {name}, at most      {percent(self.cover[name]['upper'])}")
        return "\n".join(lines + [f"  warning: {warning}" for warning in self.warnings])


def _value(text: str) -> Any:
    """The number or truth value in a cell of a CSV file, else its text."""
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return value if isinstance(value, (int, float)) else text


def _triple(point: Any) -> tuple[float, float, float]:
    x, y, z = point.values() if isinstance(point, dict) else point
    return float(x), float(y), float(z)
