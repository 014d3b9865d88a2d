"""Comparisons: the runner, from Python."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import _medial, _plugins
from ._arguments import Progress, need, path_text
from ._command import STARTED_BY
from .axis import MedialAxis
from .errors import FailedError, InputError, ParameterError
from .mesh import Mesh
from .method import file_of, id_of, registered

if TYPE_CHECKING:
    import pandas as pd

    Input = str | os.PathLike[str] | Mesh

_RESULTS = "results.csv"

# A line of progress of the command: number of the item, number of items, mesh and method, and an estimate.
_BEGUN = re.compile(r"\[(\d+)/(\d+)\] (.*)$")


@dataclass(frozen=True)
class Report:
    """A folder of results."""

    folder: Path
    summary: str
    """The summary that the command printed."""
    complete: bool
    """Whether nothing failed. Results may still be off the count, unsupported or skipped."""
    reasons: tuple[str, ...] = ()
    """Reasons of missing results, and other remarks of the command."""

    @property
    def page(self) -> Path:
        """The page, which opens in any browser, offline."""
        return self.folder / "index.html"

    def frame(self) -> pd.DataFrame:
        """All results of the folder, as `load` gives them.

        Returns:
            A row for each result, with the columns of `results.csv`.

        Raises:
            ImportError: pandas is not installed.

        Example:
            >>> report = compare("builtin:box", methods="qmat", spheres=[100, 50], quiet=True)
            >>> report.frame().status.unique()  # doctest: +SKIP
            array(['ok'], dtype=object)
        """
        return load(self.folder)

    def add_metric(
        self,
        name: str,
        function: Callable[[Mesh, MedialAxis], float],
        *,
        unit: str = "",
        better: Literal["lower", "higher", "neither"] = "lower",
    ) -> tuple[str, ...]:
        """Measures a number of your own on every saved result, and makes tables and page again with a column of it.

        Each result is measured once: a further call measures those that are new.

        Args:
            name: Name of the column.
            function: Called with a surface and a result on it, in the unit of the surface; returns the number.
            unit: Unit in the head of the column.
            better: Better direction. "Which method?" has a row of a metric with a direction and positive values.

        Returns:
            Remarks, as on results that are not finite.

        Raises:
            ParameterError: `name` or `better` is something else.
            InputError: The folder has no results.

        Example:
            >>> report = compare("builtin:box", methods="qmat", spheres=[100, 50], quiet=True)
            >>> report.add_metric("mean radius", lambda mesh, axis: axis.radii.mean() / mesh.diagonal, better="neither")
            ()
            >>> "metric_mean radius" in report.frame()  # doctest: +SKIP
            True
        """

        def value(surface: _medial.Surface, path: str | os.PathLike[str]) -> float:
            mesh = Mesh._of(surface)
            return float(function(mesh, MedialAxis.read(path)))

        heading = f"{name} ({unit}), {better}" if unit else f"{name}, {better}"
        remarks = _medial.measure(os.fspath(self.folder), heading, value)
        code, _, errors = _run(["report", os.fspath(self.folder)], True, None)
        if code != 0:
            raise FailedError(errors.strip() or f"exit code {code}")
        return tuple(remarks)


def compare(
    meshes: Input | Iterable[Input] = (),
    *,
    methods: Iterable[str | type[Any]] | str | type[Any] | None = None,
    spheres: Iterable[int] | int | None = None,
    out: str | os.PathLike[str] = "medial-report",
    timeout: float | None = None,
    budget: float | None = None,
    memory: float | None = None,
    jobs: int | None = None,
    threads: int | None = None,
    arguments: Sequence[str] = (),
    quiet: bool = False,
    progress: bool | Progress = False,
) -> Report:
    """Runs methods on meshes, measures, and writes tables, plots and a page, as `medial compare` does.

    It runs in new processes, with limits for each item. Results accumulate in the folder: the same call again runs only
    missing items, also after Ctrl-C.

    Args:
        meshes: Paths, names (`builtin:torus`) or `Mesh` objects, or one of them; by default three built-in shapes.
        methods: Ids, with parameters as in `qmat:k=0.1`, or classes that `simplifier` registered; by default all but those on request.
        spheres: Counts.
        out: The folder.
        timeout: Seconds after which an item is stopped.
        budget: Seconds on a mesh after which a method starts no further level.
        memory: Megabytes above which an item is stopped.
        jobs: Items at the same time; with several, tables omit seconds.
        threads: Threads; by default all processors.
        arguments: Further words of the command, such as `["--repeat", "3"]`.
        quiet: Print only reasons of missing results.
        progress: True shows one line that updates, on standard error or in a notebook; or a function, which is called with
            the mesh and method that begins and the completed share. By default a line for each.

    Returns:
        The folder of results; `complete` if nothing failed.

    Raises:
        InputError: Meshes are refused, with all reasons.
        ParameterError: A word of the command is wrong.
        FailedError: There is no result, with the reasons.

    Example:
        >>> from medial_axis import compare
        >>> report = compare("builtin:box", methods="qmat", spheres=[100, 50], quiet=True)
        >>> report.complete, report.page.is_file()
        (True, True)
    """
    if _plugins.loading is not None:
        raise FailedError(
            f"{_plugins.loading}: calls compare() when it is loaded for its classes; put the call under "
            'if __name__ == "__main__":'
        )
    folder = Path(path_text(out, "out"))
    words = ["compare", *_inputs(meshes, folder), "--out", os.fspath(folder)]
    if methods is not None:
        chosen = [methods] if isinstance(methods, (str, type)) else list(methods)
        words += ["--methods", ",".join(id_of(method) for method in chosen)]
        words += _files(chosen)
    if spheres is not None:
        counts = [spheres] if isinstance(spheres, int) else list(spheres)
        words += ["--spheres", ",".join(str(count) for count in counts)]
    limits = {"timeout": timeout, "budget": budget, "memory": memory, "jobs": jobs, "threads": threads}
    for name, limit in limits.items():
        if limit is not None:
            words += [f"--{name}", str(limit)]
    words += [str(word) for word in arguments]
    code, printed, errors = _run(words, quiet, Line() if progress is True else progress or None)
    # All reasons that the command printed, without its lines of progress.
    lines = [line.removeprefix("medial: ") for line in errors.splitlines() if line.strip()]
    reasons = tuple(line for line in lines if not _BEGUN.match(line))
    if code in (0, 3):
        return Report(folder, printed, complete=code == 0, reasons=reasons)
    why = "\n".join(reasons) or f"exit code {code}"
    raise {1: InputError, 2: ParameterError}.get(code, FailedError)(why)


def load(folder: str | os.PathLike[str] = "medial-report") -> pd.DataFrame:
    """The results of a folder as a frame of pandas.

    Args:
        folder: The folder of `compare`.

    Returns:
        A row for each result, with the columns of `results.csv`.

    Raises:
        InputError: There are no results.
        ImportError: pandas is not installed.

    Example:
        >>> report = compare("builtin:box", methods="qmat", spheres=[100, 50], quiet=True)
        >>> sorted(load(report.folder).method.unique())  # doctest: +SKIP
        ['initial', 'qmat']
    """
    pandas = need("pandas", "pandas")
    path = Path(path_text(folder, "folder")) / _RESULTS
    if not path.is_file():
        raise InputError(f"{path}: no results; run compare or `medial compare`")
    # Its many columns are one block in a copy, so that others can be added.
    frame: pd.DataFrame = pandas.read_csv(path, low_memory=False).copy()
    return frame


def _inputs(meshes: Input | Iterable[Input], folder: Path) -> list[str]:
    """Words for meshes; meshes without a file are written to the folder."""
    given = [meshes] if isinstance(meshes, (str, os.PathLike, Mesh)) else list(meshes)
    words = []
    for mesh in given:
        if not isinstance(mesh, Mesh):
            words.append(path_text(mesh, "meshes"))
        elif mesh.source is not None:
            words.append(mesh.source)
        else:
            path = folder / "inputs" / f"{mesh.name}.ply"
            if str(path) in words:
                raise ParameterError(f"two meshes have the name {mesh.name}; rename one by Mesh(..., name=...)")
            path.parent.mkdir(parents=True, exist_ok=True)
            mesh.save(path)
            words.append(str(path))
    return words


def _files(chosen: list[str | type[Any]]) -> list[str]:
    """Options for the files of the classes among some methods, each once."""
    known = registered()
    classes = (
        method if isinstance(method, type) else known.get(method.partition(":")[0])
        for method in chosen
    )
    files = dict.fromkeys(file_of(cls) for cls in classes if cls is not None)
    return [word for file in files for word in ("--plugins", file)]


def _run(words: list[str], quiet: bool, progress: Line | Progress | None) -> tuple[int, str, str]:
    """Runs the command: its exit code and both outputs. Ctrl-C ends it like the command itself."""
    # The callback needs its lines of progress.
    command = [*STARTED_BY, *words, *(["--quiet"] if quiet and progress is None else [])]
    # In a new session: otherwise a terminal would interrupt it once, and this function a second time.
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    printed: list[str] = []
    errors: list[str] = []
    assert process.stdout is not None and process.stderr is not None
    # A pipe that is not emptied would stop the command.
    empty = threading.Thread(target=lambda out: printed.append(out.read()), args=(process.stdout,), daemon=True)
    empty.start()
    try:
        # Its messages are shown by this thread, so that a notebook shows them, too.
        for line in process.stderr:
            errors.append(line)
            begun = _BEGUN.match(line)
            if begun and progress is not None:
                done, total = int(begun[1]) - 1, int(begun[2])
                if isinstance(progress, Line):
                    progress.at(done, total, begun[3])
                else:
                    progress(begun[3], done / total)
            elif not quiet:
                sys.stderr.write(line)
                sys.stderr.flush()
        process.wait()
        if progress is not None and process.returncode in (0, 3):
            progress.end() if isinstance(progress, Line) else progress("done", 1.0)
    except BaseException:
        process.send_signal(signal.SIGINT)
        process.wait()
        raise
    finally:
        if isinstance(progress, Line):
            progress.close()
    empty.join(timeout=5)
    text = "".join(printed)
    if text and not quiet:
        print(text, end="")
    return process.returncode, text, "".join(errors)


class Line:
    """A line on standard error that updates, by the conventions of tqdm, in a terminal and in a notebook."""

    def __init__(self) -> None:
        self._start, self._total, self._width = time.monotonic(), 0, 0

    def at(self, done: int, total: int, stage: str) -> None:
        """Shows that `done` of `total` items are done, and the current one."""
        spent = time.monotonic() - self._start
        share, self._total = done / total, total
        left = _clock(spent / share - spent) if done else "?"
        bar = "\u2588" * int(10 * share)
        text = f"compare: {share:4.0%}|{bar:10}| {done}/{total} [{_clock(spent)}<{left}, {stage}]"
        # Overwrites the rest of a longer line.
        sys.stderr.write("\r" + text.ljust(self._width))
        sys.stderr.flush()
        self._width = len(text)

    def end(self) -> None:
        """Shows that all items are done."""
        if self._total > 0:
            self.at(self._total, self._total, "done")

    def close(self) -> None:
        """Ends the line, so that others follow it."""
        if self._width > 0:
            sys.stderr.write("\n")
            sys.stderr.flush()


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes:02}:{rest:02}"
