"""What every long call takes."""

from __future__ import annotations

import operator
import os
from collections.abc import Callable
from typing import Any

from .errors import ParameterError

Progress = Callable[[str, "float | None"], object]
"""Called with a stage, and the share of it that is done where that is known, from the thread that made the call."""

_Call = tuple[int, "int | None", "Progress | None"]


def call(seed: int = 0, threads: int | None = None, progress: Progress | None = None) -> _Call:
    """Arguments of a long call, checked."""
    if progress is not None and not callable(progress):
        raise ParameterError(f"progress: a function is needed, not a {type(progress).__name__}")
    seed = whole(seed, "seed", 0, 2**64 - 1)
    threads = None if threads is None else whole(threads, "threads", 1, 1024)
    return seed, threads, progress


def whole(value: Any, what: str, least: int, most: int) -> int:
    """A whole number in a range."""
    try:
        number = operator.index(value)
    except TypeError:
        raise ParameterError(f"{what}: a whole number is needed, not {value!r}") from None
    if not least <= number <= most:
        raise ParameterError(f"{what} = {number}: it has to be from {least} to {most}")
    return number


def real(value: Any, what: str) -> float:
    """A number."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{what}: a number is needed, not {value!r}") from None


def path_text(path: Any, what: str = "path") -> str:
    """A path as text."""
    try:
        text = os.fsdecode(path)
    except TypeError:
        raise ParameterError(f"{what}: a path is needed, not a {type(path).__name__}") from None
    if "\0" in text:
        raise ParameterError(f"{what}: {text!r} has a zero byte")
    return text
