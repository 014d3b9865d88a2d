"""Checked arguments: those of every long call, and arrays of the kind, shape and layout that the extension requires."""

from __future__ import annotations

import importlib
import math
import operator
import os
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InputError, ParameterError

Progress = Callable[[str, "float | None"], object]
"""Called with a stage and its completed share (None if unknown), in the thread of the call."""

_Call = tuple[int, "int | None", "Progress | None"]


def call(seed: int = 0, threads: int | None = None, progress: Progress | None = None) -> _Call:
    """Arguments of a long call, checked."""
    if progress is not None and not callable(progress):
        raise ParameterError(f"progress: expected a function, found a {type(progress).__name__}")
    seed = whole(seed, "seed", 0, 2**64 - 1)
    threads = None if threads is None else whole(threads, "threads", 1, 1024)
    return seed, threads, progress


def whole(value: Any, what: str, least: int, most: int) -> int:
    """A whole number in a range."""
    _refuse_bool(value, what, "a whole number")
    try:
        number = operator.index(value)
    except TypeError:
        raise ParameterError(f"{what}: expected a whole number, found {value!r}") from None
    if not least <= number <= most:
        raise ParameterError(f"{what} = {number}: expected {least} to {most}")
    return number


def real(value: Any, what: str, least: float = -math.inf, most: float = math.inf) -> float:
    """A number in a range; without one, any."""
    _refuse_bool(value, what, "a number")
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{what}: expected a number, found {value!r}") from None
    if math.isnan(number) or number < least or number > most:
        raise ParameterError(f"{what} = {number}: expected {least} to {most}")
    return number


def _refuse_bool(value: Any, what: str, expected: str) -> None:
    if isinstance(value, bool):
        raise ParameterError(f"{what}: expected {expected}, found {value}")


def path_text(path: Any, what: str = "path") -> str:
    """A path as text."""
    try:
        text = os.fsdecode(path)
    except TypeError:
        raise ParameterError(f"{what}: expected a path, found a {type(path).__name__}") from None
    if "\0" in text:
        raise ParameterError(f"{what}: {text!r} has a zero byte")
    return text


def need(module: str, package: str) -> Any:
    """A module of an optional package."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        message = f"{package} is not installed ({error}); run pip install {package.lower()}"
        raise ImportError(message, name=module) from error


FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.uint32]
BoolArray = npt.NDArray[np.bool_]

_MOST = np.iinfo(np.uint32).max


def floats(value: Any, what: str, columns: int | None = 3) -> FloatArray:
    """An n x columns array of finite float64, or a plain list of n where `columns` is None."""
    array = _array(value, what)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{what}: expected numbers, found an array of {array.dtype}")
    array = _shaped(array, what, columns)
    result = np.ascontiguousarray(array, dtype=np.float64)
    if not np.isfinite(result).all():
        row = int(np.argwhere(~np.isfinite(result))[0][0])
        raise InputError(f"{what}: row {row} has a number that is not finite: {result[row]}")
    return result


def indices(value: Any, what: str, columns: int) -> IndexArray:
    """An n x columns array of indices, as uint32."""
    array = _array(value, what)
    if array.dtype.kind not in "iu" and array.size > 0:
        raise InputError(f"{what}: expected indices, found an array of {array.dtype}")
    array = _shaped(array, what, columns)
    if array.size > 0 and (int(array.min()) < 0 or int(array.max()) > _MOST):
        row = int(np.argwhere((array < 0) | (array > _MOST))[0][0])
        raise InputError(f"{what}: row {row} has an index out of range: {array[row]}")
    return np.ascontiguousarray(array, dtype=np.uint32)


def same(ones: tuple[Any, ...], others: tuple[Any, ...]) -> bool:
    """Whether arrays are equal bit by bit, like their hashes: 0.0 differs from -0.0."""
    return all(one.shape == other.shape and one.tobytes() == other.tobytes() for one, other in zip(ones, others))


def truths(value: Any, what: str, count: int) -> BoolArray:
    """`count` truth values."""
    array = _array(value, what)
    if array.dtype != np.bool_ or array.shape != (count,):
        raise InputError(f"{what}: expected {count} truth values, found an array of {array.dtype} with the shape {array.shape}")
    return array


def _array(value: Any, what: str) -> npt.NDArray[Any]:
    try:
        return np.asarray(value)
    except Exception as error:  # A foreign object may raise any exception.
        raise InputError(f"{what}: a {type(value).__name__} is not an array ({error})") from error


def _shaped(array: npt.NDArray[Any], what: str, columns: int | None) -> npt.NDArray[Any]:
    if columns is None:
        if array.ndim != 1:
            raise InputError(f"{what}: expected a single row of numbers, found the shape {array.shape}")
        return array
    if array.size == 0 and array.ndim <= 2:
        return array.reshape(0, columns)
    if array.ndim != 2 or array.shape[1] != columns:
        raise InputError(f"{what}: expected the shape (n, {columns}), found {array.shape}")
    return array
