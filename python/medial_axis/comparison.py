"""Comparisons: the runner, from Python."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from . import _plugins
from ._arguments import need, path_text
from ._command import STARTED_BY
from .errors import FailedError, InputError, ParameterError
from .mesh import Mesh
from .method import file_of, id_of, registered

if TYPE_CHECKING:
    import pandas as pd

_RESULTS = "results.csv"


@dataclass(frozen=True)
class Report:
    """A folder of results."""

    folder: Path
    summary: str
    """What the command printed."""
    complete: bool
    """Whether nothing failed. Results may still be off the count, unsupported or skipped."""

    @property
    def page(self) -> Path:
        """The page, which opens in any browser, offline."""
        return self.folder / "index.html"

    def frame(self) -> pd.DataFrame:
        """All results of the folder; see `load`."""
        return load(self.folder)


def compare(
    meshes: Any = (),
    *,
    methods: Iterable[str | type[Any]] | str | type[Any] | None = None,
    spheres: Iterable[int] | int | None = None,
    out: str | os.PathLike[str] = "medial-report",
    params: Mapping[str, Mapping[str, Any]] | None = None,
    timeout: float | None = None,
    memory: float | None = None,
    threads: int | None = None,
    arguments: Sequence[str] = (),
    quiet: bool = False,
) -> Report:
    """Runs methods on meshes, measures, and writes tables, plots and a page into the folder `out`.

    The same as `medial compare`, in processes of its own: each item has limits of time (`timeout`, seconds) and memory
    (`memory`, MB), and results accumulate in the folder. `meshes` are paths, names (`builtin:torus`) or `Mesh`es; without
    any, three built-in shapes. `methods` are ids or classes that `simplifier` registered; without any, all but those on
    request. `params` sets parameters by method. `arguments` are further words of the command, such as
    `["--repeat", "3"]`.
    """
    if _plugins.loading is not None:
        raise FailedError(
            f"compare() was called while {_plugins.loading} was loaded for its classes: put the call under "
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
    for id, values in (params or {}).items():
        for key, value in values.items():
            words += ["--set", f"{id}.{key}={_word(value)}"]
    for name, limit in [("timeout", timeout), ("memory", memory), ("threads", threads)]:
        if limit is not None:
            words += [f"--{name}", str(limit)]
    words += [str(word) for word in arguments]
    code, printed, errors = _run(words, quiet)
    if code in (0, 3):
        return Report(folder, printed, complete=code == 0)
    # All reasons that the command printed, without its lines of progress.
    lines = [line.removeprefix("medial: ") for line in errors.splitlines() if line.strip()]
    reasons = [line for line in lines if not re.match(r"\[\d+/\d+\] ", line)]
    why = "\n".join(reasons) or f"exit code {code}"
    raise {1: InputError, 2: ParameterError}.get(code, FailedError)(why)


def load(folder: str | os.PathLike[str] = "medial-report") -> pd.DataFrame:
    """The results of a folder as a frame of pandas: a row for each result, with the columns of `results.csv`."""
    pandas = need("pandas", "pandas")
    path = Path(path_text(folder, "folder")) / _RESULTS
    if not path.is_file():
        raise InputError(f"{path}: there are no results; `compare` or `medial compare` makes them")
    frame: pd.DataFrame = pandas.read_csv(path, low_memory=False)
    return frame


def _inputs(meshes: Any, folder: Path) -> list[str]:
    """Words for meshes; those that are of no file are written into the folder."""
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
                raise ParameterError(f"two meshes are called {mesh.name}; Mesh(..., name=...) tells them apart")
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


def _word(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _run(words: list[str], quiet: bool) -> tuple[int, str, str]:
    """Runs the command: its exit code and what it printed. Ctrl-C ends it as it ends the command itself."""
    command = [*STARTED_BY, *words, *(["--quiet"] if quiet else [])]
    # Of a session of its own: a terminal would interrupt it once, and this function a second time.
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    errors: list[str] = []
    relay = threading.Thread(target=_relay, args=(process.stderr, errors, quiet), daemon=True)
    relay.start()
    assert process.stdout is not None
    try:
        printed = process.stdout.read()
        process.wait()
    except BaseException:
        process.send_signal(signal.SIGINT)
        process.wait()
        raise
    relay.join(timeout=5)
    if printed and not quiet:
        print(printed, end="")
    return process.returncode, printed, "".join(errors)


def _relay(stream: IO[str] | None, kept: list[str], quiet: bool) -> None:
    """Shows what the command says while it runs, where a notebook shows it too, and keeps it."""
    for line in stream or ():
        kept.append(line)
        if not quiet:
            sys.stderr.write(line)
            sys.stderr.flush()
