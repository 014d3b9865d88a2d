"""Arrays as the extension takes them: of the right kind, shape and layout, and copied only where they are not."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InputError

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.uint32]
BoolArray = npt.NDArray[np.bool_]

_MOST = np.iinfo(np.uint32).max


def floats(value: Any, what: str, columns: int | None = 3) -> FloatArray:
    """An n x columns array of finite float64, or a plain list of n where `columns` is None."""
    array = _array(value, what)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{what}: numbers are needed, not an array of {array.dtype}")
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
        raise InputError(f"{what}: indices are needed, not an array of {array.dtype}")
    array = _shaped(array, what, columns)
    if array.size > 0 and (int(array.min()) < 0 or int(array.max()) > _MOST):
        row = int(np.argwhere((array < 0) | (array > _MOST))[0][0])
        raise InputError(f"{what}: row {row} has an index that names nothing: {array[row]}")
    return np.ascontiguousarray(array, dtype=np.uint32)


def truths(value: Any, what: str, count: int) -> BoolArray:
    """`count` truth values."""
    array = _array(value, what)
    if array.dtype != np.bool_ or array.shape != (count,):
        raise InputError(f"{what}: {count} truth values are needed, not an array of {array.dtype} with the shape {array.shape}")
    return array


def _array(value: Any, what: str) -> npt.NDArray[Any]:
    try:
        return np.asarray(value)
    except Exception as error:  # Whatever a foreign object raises when it is asked.
        raise InputError(f"{what}: a {type(value).__name__} is no array: {error}") from error


def _shaped(array: npt.NDArray[Any], what: str, columns: int | None) -> npt.NDArray[Any]:
    if columns is None:
        if array.ndim != 1:
            raise InputError(f"{what}: a single row of numbers is needed, not the shape {array.shape}")
        return array
    if array.size == 0 and array.ndim <= 2:
        return array.reshape(0, columns)
    if array.ndim != 2 or array.shape[1] != columns:
        raise InputError(f"{what}: the shape (n, {columns}) is needed, not {array.shape}")
    return array
