"""Methods: those of the program, and Python classes."""

from __future__ import annotations

import functools
import json
import re
import sys
from dataclasses import dataclass, field
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from . import _medial
from ._arguments import BoolArray, FloatArray, IndexArray, floats
from .axis import MedialAxis
from .errors import ParameterError

_Class = TypeVar("_Class", bound=type[Any])


@dataclass(frozen=True)
class NativeLevel:
    """The scalar that controls a method in its paper."""

    name: str
    unit: str
    larger_is_coarser: bool = True


@dataclass(frozen=True)
class Param:
    """A parameter. The type of the default is that of the value."""

    name: str
    default: float | int | bool | str
    unit: str
    help: str


@dataclass(frozen=True)
class MethodInfo:
    """The description of a method."""

    id: str
    """Lower-case letters, digits and hyphens."""
    title: str
    citation: str = ""
    summary: str = ""
    params: tuple[Param, ...] = ()
    native: NativeLevel | None = None
    sweep: tuple[float, ...] = ()
    """Native levels of a default comparison, from fine to coarse."""
    published: str | None = None
    """Meaning of the published level; None without one."""
    on_request: bool = False
    """Whether it runs only when named, because it takes long."""
    incremental: bool = False
    """Whether `at` continues from the previous level. Levels are then requested from fine to coarse, and the seconds
    of a level are those of all calls up to it."""
    seeded: bool = False
    """Whether results depend on `RunContext.seed`."""


@dataclass(frozen=True)
class Level:
    """How far to simplify: `spheres` or `native` is a number, or neither for the published level."""

    spheres: int | None = None
    native: float | None = None

    @property
    def published(self) -> bool:
        return self.spheres is None and self.native is None


@dataclass(frozen=True)
class Simplified:
    """A medial mesh with diagnostics."""

    axis: MedialAxis
    native_level: float | None = None
    """The native level that met a number of spheres."""
    warnings: tuple[str, ...] = field(default_factory=tuple)


class Shape:
    """A surface as a method sees it: normalised to a bounding-box diagonal of 1.

    Its arrays are substrates: built once for all methods of a comparison, and counted in the seconds of each method that
    uses them. Do not rebuild them.
    """

    def __init__(self, handle: _medial.ShapeHandle) -> None:
        self._handle = handle

    @property
    def name(self) -> str:
        return self._handle.name

    @property
    def diagonal(self) -> float:
        """Bounding-box diagonal of the input, in its unit."""
        return self._handle.diagonal

    @property
    def expected_betti(self) -> tuple[int, int, int] | None:
        """The Betti numbers that the solid's topology demands of its medial axis."""
        return self._handle.expected_betti

    def vertices(self) -> FloatArray:
        """Positions.

        Returns:
            An n x 3 array, new each time.

        Example:
            shape.vertices().mean(axis=0)
        """
        return self._handle.vertices()

    def faces(self) -> IndexArray:
        """Triangles, counter-clockwise from outside.

        Returns:
            An n x 3 array of indices, new each time.

        Example:
            shape.vertices()[shape.faces()]
        """
        return self._handle.faces()

    def samples(self) -> FloatArray:
        """Boundary samples.

        Returns:
            An n x 3 array, new each time.

        Raises:
            FailedError: They cannot be made.

        Example:
            scipy.spatial.KDTree(shape.samples())
        """
        return self._handle.samples()

    def initial(self) -> MedialAxis:
        """The medial mesh that every method starts from.

        Returns:
            A medial mesh, in diagonals.

        Raises:
            FailedError: It cannot be made.

        Example:
            self.axis = shape.initial()
        """
        return MedialAxis._of(self._handle.initial(), None)

    def inside(self, points: ArrayLike) -> BoolArray:
        """Which of n points are inside.

        Args:
            points: n x 3 positions, in diagonals.

        Returns:
            n truth values.

        Raises:
            InputError: `points` is not an n x 3 array of finite numbers.

        Example:
            points[shape.inside(points)]
        """
        return self._handle.inside(floats(points, "points"))

    def distances(self, points: ArrayLike) -> FloatArray:
        """The distances of n points to the surface.

        Args:
            points: n x 3 positions, in diagonals.

        Returns:
            n distances, in diagonals, without a sign.

        Raises:
            InputError: `points` is not an n x 3 array of finite numbers.

        Example:
            radii = shape.distances(centres)
        """
        return self._handle.distances(floats(points, "points"))


class RunContext:
    """The context of a run."""

    def __init__(self, handle: _medial.RunHandle) -> None:
        self._handle = handle

    @property
    def seed(self) -> int:
        """Seed of every random choice."""
        return self._handle.seed

    @property
    def threads(self) -> int:
        """Number of threads to use."""
        return self._handle.threads

    def step(self, done: int, total: int) -> None:
        """Reports progress. Call it often.

        Args:
            done: Completed steps.
            total: Number of steps.

        Raises:
            CancelledError: The run is to stop.

        Example:
            run.step(len(centres), level.spheres)
        """
        self._handle.step(done, total)


_REGISTERED: dict[str, type[Any]] = {}
_ID = re.compile(r"[a-z0-9-]+")


def simplifier(cls: _Class) -> _Class:
    """Makes a class a method, for `MedialAxis.simplify`, `compare`, and `medial compare --plugins FILE.py`.

    All lengths are fractions of the bounding-box diagonal, also in results.

    Args:
        cls: A class with `info`, `prepare` and `at`.

    Returns:
        The same class.

    Raises:
        ParameterError: One of the three is missing or wrong.

    Example:
        @medial_axis.simplifier
        class Largest:
            info = medial_axis.MethodInfo(id="largest", title="Largest balls first")

            def prepare(self, shape, params, run):   # once for a shape; Shape, dict, RunContext
                self.axis = shape.initial()
                self.order = np.argsort(-self.axis.radii, kind="stable")

            def at(self, level):                     # for each Level, from fine to coarse
                if level.spheres is None:
                    raise medial_axis.UnsupportedError("give a number of spheres")
                keep = np.zeros(len(self.axis), bool)
                keep[self.order[: level.spheres]] = True
                return self.axis.induced(keep)       # a MedialAxis, or Simplified
    """
    info = getattr(cls, "info", None)
    name = getattr(cls, "__qualname__", repr(cls))
    if not isinstance(cls, type):
        raise ParameterError(f"@simplifier: expected a class, found {cls!r}")
    if not isinstance(info, MethodInfo):
        raise ParameterError(f"{name}.info: expected a MethodInfo, found {info!r}")
    if not _ID.fullmatch(info.id):
        raise ParameterError(
            f"{name}.info.id: invalid (found {info.id!r}, expected lower-case letters, digits and hyphens)"
        )
    for method in ("prepare", "at"):
        if not callable(getattr(cls, method, None)):
            raise ParameterError(f"{name} has no method `{method}`")
    _REGISTERED[info.id] = cls
    return cls


def registered() -> dict[str, type[Any]]:
    """The classes of this process by their ids."""
    return dict(_REGISTERED)


def methods() -> dict[str, dict[str, Any]]:
    """The methods of the program.

    Returns:
        By id: title, citation, native level, and parameters with units and defaults.

    Example:
        >>> from medial_axis import methods
        >>> methods()["angle"]["native"]["unit"]
        'degrees of separation angle'
    """
    return {info["id"]: info for info in json.loads(_medial.methods())}


@functools.cache
def _built_in() -> dict[str, list[str]]:
    """Names of the parameters of the methods of the program."""
    return {id: [param["name"] for param in info["params"]] for id, info in methods().items()}


def known_params(method: str | type[Any]) -> list[str] | None:
    """Names of the parameters of a method; None for other objects."""
    if isinstance(method, str):
        return _built_in().get(method)
    info = getattr(method, "info", None)
    return [param.name for param in info.params] if isinstance(info, MethodInfo) else None


def id_of(method: str | type[Any]) -> str:
    """The id of a method, given as such or as a class."""
    if isinstance(method, str):
        return method
    info = getattr(method, "info", None)
    return info.id if isinstance(info, MethodInfo) else method.__qualname__


def file_of(cls: type[Any]) -> str:
    """The file of a class, which workers load."""
    module = sys.modules.get(cls.__module__)
    path = getattr(module, "__file__", None)
    if path is None:
        raise ParameterError(
            f"{cls.__qualname__}: not in a file that workers can load; put it into a .py file and import it "
            "(in a notebook: a cell that begins with %%writefile my_method.py)"
        )
    return str(path)
