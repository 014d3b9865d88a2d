"""Calls of the extension to classes of users: descriptions, checks, and texts of exceptions."""

from __future__ import annotations

import importlib.util
import json
import os
import sys
import traceback
from types import TracebackType
from typing import Any, NamedTuple

from . import _medial, method
from .axis import MedialAxis
from .errors import ParameterError, UnsupportedError
from .method import Level, MethodInfo, Param, RunContext, Shape, Simplified

#: The file that is being loaded for its classes, if any: it must not start comparisons.
loading: str | None = None


class Output(NamedTuple):
    """The result of `at` for the extension."""

    axis: _medial.Axis
    native_level: float | None
    warnings: list[str]


def describe(cls: Any) -> str:
    """The description of a class, as JSON."""
    info = getattr(cls, "info", None)
    if not isinstance(info, MethodInfo):
        raise ParameterError(f"{cls!r}: not a method; put @medial_axis.simplifier before the class")
    native = info.native
    return json.dumps(
        {
            "id": info.id,
            "title": info.title,
            "citation": info.citation,
            "summary": info.summary or f"A Python class: {cls.__qualname__}.",
            "native": native and {
                "name": native.name,
                "unit": native.unit,
                "larger_is_coarser": bool(native.larger_is_coarser),
            },
            "sweep": [float(level) for level in info.sweep],
            "params": [
                {"name": p.name, "default": _written(p.default), "unit": p.unit, "help": p.help}
                for p in info.params
            ],
            "published": info.published,
            "on_request": bool(info.on_request),
            "incremental": bool(info.incremental),
            "seeded": bool(info.seeded),
        }
    )


def _written(value: Any) -> str:
    """A default as it would be written on the command line."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(value)


def prepare(cls: Any, shape: _medial.ShapeHandle, params: str, run: _medial.RunHandle) -> Any:
    """An instance, prepared for a shape."""
    values = _values(cls.info.params, json.loads(params))
    instance = cls()
    instance.prepare(Shape(shape), values, RunContext(run))
    return instance


def _values(known: tuple[Param, ...], given: dict[str, Any]) -> dict[str, Any]:
    """The value of every parameter: as set, or the default, which decides the type."""
    names = [param.name for param in known]
    for key in given:
        if key not in names:
            raise ParameterError(f"unknown parameter `{key}` (expected one of: {', '.join(names) or 'none'})")
    return {param.name: _typed(param, given.get(param.name, param.default)) for param in known}


def _typed(param: Param, value: Any) -> Any:
    default = param.default
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if isinstance(default, bool):
        fits, needed = isinstance(value, bool), "true or false"
    elif isinstance(default, int):
        fits, needed = is_number and float(value).is_integer(), "a whole number"
    elif isinstance(default, float):
        fits, needed = is_number, "a number"
    else:
        value = value if isinstance(value, str) else json.dumps(value)
        fits, needed = True, "a text"
    if not fits:
        raise ParameterError(f"{param.name} = {value!r}: expected {needed}")
    return type(default)(value)


def at(instance: Any, kind: str, value: float) -> Output:
    """The result of an instance at a level."""
    info = type(instance).info
    if kind == "native" and info.native is None or kind == "published" and info.published is None:
        raise UnsupportedError(f"{info.id} has no {kind} level; give a number of spheres")
    levels = {
        "published": Level(),
        "spheres": Level(spheres=int(value)),
        "native": Level(native=value),
    }
    result = instance.at(levels[kind])
    if isinstance(result, MedialAxis):
        result = Simplified(result)
    if not isinstance(result, Simplified):
        name = type(instance).__qualname__
        raise TypeError(f"{name}.at: expected a MedialAxis or Simplified, found a {type(result).__name__}")
    axis = result.axis
    if not isinstance(axis, MedialAxis):
        raise TypeError(f"Simplified.axis: expected a MedialAxis, found a {type(axis).__name__}")
    level = None if result.native_level is None else float(result.native_level)
    warnings = [str(warning) for warning in result.warnings]
    return Output(axis._axis, level, warnings)


def error_text(error: BaseException) -> str:
    """An exception in a line: its type, its message, and the line in the user's file that raised it."""
    here = os.path.dirname(os.path.abspath(__file__))
    frames = traceback.extract_tb(_traceback(error))
    own = [frame for frame in frames if not os.path.abspath(frame.filename).startswith(here)]
    where = f" ({os.path.basename(own[-1].filename)}, line {own[-1].lineno})" if own else ""
    message = str(error)
    return f"{type(error).__name__}{': ' if message else ''}{message}{where}"


def _traceback(error: BaseException) -> TracebackType | None:
    return error.__traceback__


def load(path: str | os.PathLike[str]) -> list[type[Any]]:
    """The classes of a file that are methods, in its order."""
    global loading
    path = os.path.abspath(path)
    stem = os.path.splitext(os.path.basename(path))[0]
    name = f"_medial_plugin_{stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ParameterError(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    # As if it was run: imports from its folder work.
    sys.path.insert(0, os.path.dirname(path))
    sys.modules[name] = module
    loading = path
    try:
        spec.loader.exec_module(module)
    finally:
        loading = None
    return [cls for cls in method.registered().values() if cls.__module__ == name]

