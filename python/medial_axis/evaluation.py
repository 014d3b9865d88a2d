"""What was measured on a medial mesh."""

from __future__ import annotations

import dataclasses
import json
import typing
from dataclasses import dataclass
from typing import Annotated, Any

_DIAGONAL = "fraction of the bounding-box diagonal"

# A number with its unit, as `Evaluation.unit` tells it.
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

    by_ratio: tuple[dict[str, float], ...]
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
    axis: dict[str, Any] | None
    """Distances to the exactly known axis of a built-in shape."""
    diagonal: Annotated[float, "unit of the mesh"]
    """The bounding-box diagonal of the mesh."""
    seed: int
    warnings: tuple[str, ...]

    @classmethod
    def from_json(cls, text: str) -> Evaluation:
        """Reads what `medial evaluate --json` prints."""
        told: dict[str, Any] = json.loads(text)
        certified = told.get("certified")
        if certified is not None:
            witness = certified.pop("witness")
            certified = Certificate(**certified, point=_triple(witness["point"]), on=witness["on"])
        spikes = {**told["spikes"], "by_ratio": tuple(told["spikes"]["by_ratio"])}
        expected = told.get("expected_betti")
        told.update(
            certified=certified,
            axis=told.get("axis"),
            quality=TriangleQuality(**told["quality"]),
            spikes=Spikes(**spikes),
            counts=Counts(**told["counts"]),
            betti=tuple(told["betti"]),
            expected_betti=None if expected is None else tuple(expected),
            warnings=tuple(told["warnings"]),
        )
        # The command says its version beside the numbers.
        return cls(**{name: told[name] for name in (f.name for f in dataclasses.fields(cls))})

    @classmethod
    def unit(cls, name: str) -> str | None:
        """The unit of a field; None for counts and what is no number."""
        hint = typing.get_type_hints(cls, include_extras=True)[name]
        noted: tuple[str, ...] = getattr(hint, "__metadata__", ())
        return noted[0] if noted else None

    def in_units(self, name: str) -> float:
        """A length in the unit of the mesh instead of diagonals."""
        value = getattr(self, name)
        if self.unit(name) != _DIAGONAL or value is None:
            raise ValueError(f"{name} is no fraction of the diagonal, but {self.unit(name) or value!r}")
        return float(value) * self.diagonal

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
        return "\n".join(lines + [f"  warning: {warning}" for warning in self.warnings])


def _triple(point: Any) -> tuple[float, float, float]:
    x, y, z = point.values() if isinstance(point, dict) else point
    return float(x), float(y), float(z)
