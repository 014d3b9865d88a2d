"""Classes as methods: in this process, in comparisons, in the command; and what they do wrong."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import medial_axis
from medial_axis import Level, MedialAxis, MethodInfo, ParameterError, UnsupportedError

EXAMPLES = Path(__file__).parent.parent / "examples"
sys.path.insert(0, str(EXAMPLES))

from largest import Largest  # noqa: E402


def medial(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "medial_axis", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True)


def test_in_this_process(axis: MedialAxis) -> None:
    largest = axis.simplify(Largest, spheres=30)
    expected = np.sort(axis.radii)[-30:]
    assert np.allclose(np.sort(largest.radii), expected, rtol=1e-12)
    assert largest.run is not None and largest.run.method == "largest-class"
    # A fraction of the diagonal, half-way between two radii.
    tenth, next_one = np.sort(largest.radii)[::-1][9:11]
    least = float(tenth + next_one) / 2 / axis.evaluate(samples=100).diagonal
    assert len(axis.simplify(Largest, spheres=30, least=least)) == 10
    with pytest.raises(UnsupportedError, match="give a number"):
        axis.simplify(Largest, level="published")
    with pytest.raises(ParameterError, match=r"unknown parameter `most` \(expected one of: least\)"):
        axis.simplify(Largest, spheres=3, most=1)
    with pytest.raises(ParameterError, match="least = 'x': expected a number"):
        axis.simplify(Largest, spheres=3, least="x")


def test_in_a_comparison(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    report = medial_axis.compare(
        ["builtin:box"],
        methods=[Largest, "qmat"],
        spheres=[100, 30],
        out=tmp_path / "report",
        quiet=True,
    )
    frame = report.frame()
    ours = frame[frame.method == "largest-class"].set_index("asked")
    assert (ours.status == "ok").all() and sorted(ours.spheres) == [30, 100]
    assert {"qmat", "largest-class"} <= set(frame.method)
    page = report.page.read_text()
    assert "largest-class" in page
    plots = [path for path in report.folder.rglob("*.svg") if "largest-class" in path.read_text()]
    assert plots, "it is in plots"
    # Recorded results do not run again.
    again = medial_axis.compare(
        ["builtin:box"], methods=[Largest, "qmat"], spheres=[100, 30], out=tmp_path / "report", quiet=True
    )
    assert " 0 run now" in again.summary


def test_by_the_command(tmp_path: Path) -> None:
    file = EXAMPLES / "largest.py"
    run = medial("methods", "largest-class", "--plugins", file)
    assert run.returncode == 0 and "Largest balls first" in run.stdout
    run = medial(
        "simplify", "builtin:box", "--plugins", file, "--method", "largest-class", "--spheres", 20,
        "--set", "least=0.01", "--json",
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["spheres"] == 20


FAULTY = '''
import ctypes, time
import numpy as np
import medial_axis
from medial_axis import MedialAxis, MethodInfo, Simplified


class Base:
    def prepare(self, shape, params, run):
        self.axis = shape.initial()

    def at(self, level):
        return self.axis.induced(np.arange(len(self.axis)) < (level.spheres or 1))


@medial_axis.simplifier
class Raises(Base):
    info = MethodInfo(id="raises", title="Raises")
    def at(self, level):
        return {}["nothing"]


@medial_axis.simplifier
class Loops(Base):
    info = MethodInfo(id="loops", title="Loops")
    def at(self, level):
        while True:
            pass


@medial_axis.simplifier
class Crashes(Base):
    info = MethodInfo(id="crashes", title="Crashes")
    def at(self, level):
        ctypes.string_at(0)


@medial_axis.simplifier
class Grows(Base):
    info = MethodInfo(id="grows", title="Grows")
    def at(self, level):
        return bytearray(1 << 40)


@medial_axis.simplifier
class Wrong(Base):
    info = MethodInfo(id="wrong", title="Returns another type")
    def at(self, level):
        return self.axis.centres


@medial_axis.simplifier
class Talks(Base):
    info = MethodInfo(id="talks", title="Talks")
    def at(self, level):
        print("not for you", flush=True)
        return Simplified(super().at(level), warnings=("printed a line",))
'''


def test_failures_are_rows_of_the_table(tmp_path: Path) -> None:
    file = tmp_path / "faulty.py"
    file.write_text(FAULTY)
    out = tmp_path / "report"
    run = medial(
        "compare", "builtin:box", "--plugins", file, "--methods", "raises,loops,crashes,grows,wrong,talks,qmat",
        "--spheres", 20, "--timeout", 10, "--out", out,
    )  # fmt: skip
    assert run.returncode == 3, run.stderr
    rows = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    requested = [row for row in rows if row["simplify"]["level"] == {"spheres": 20}]
    status = {row["simplify"]["method"]: row["status"] for row in requested}
    reason = {row["simplify"]["method"]: row.get("reason") for row in requested}
    assert status == {
        "raises": "failed",
        "loops": "timed_out",
        "crashes": "panicked",
        "grows": "out_of_memory",
        "wrong": "failed",
        "talks": "ok",
        "qmat": "ok",
    }, reason
    assert "KeyError: 'nothing' (faulty.py, line" in reason["raises"]
    assert "expected a MedialAxis or Simplified, found a ndarray" in reason["wrong"]


def test_files_of_the_user_are_not_imported_as_modules(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pandas")
    for name in ("numpy", "random", "medial_axis", "errors", "json"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('not me')")
    monkeypatch.chdir(tmp_path)
    report = medial_axis.compare(
        "builtin:box", methods=Largest, spheres=20, out=tmp_path / "report", quiet=True
    )
    assert (report.frame().status != "panicked").all()


def test_files_that_cannot_be_loaded(tmp_path: Path) -> None:
    for text, named in [
        ("import nothing_of_the_kind", "ModuleNotFoundError"),
        ("def", "SyntaxError"),
        ("x = 1", "no method found; put @medial_axis.simplifier before a class"),
        ("raise SystemExit(0)", "SystemExit"),
        (FAULTY.replace('id="raises"', 'id="qmat"'), "the id `qmat` is taken"),
        ("import medial_axis\nmedial_axis.compare()", "__main__"),
    ]:
        file = tmp_path / "plugin.py"
        file.write_text(text)
        run = medial("methods", "--plugins", file)
        assert run.returncode == 2 and named in run.stderr and "plugin.py" in run.stderr, (text, run.stderr)


def test_incomplete_classes_are_refused() -> None:
    with pytest.raises(ParameterError, match="info"):
        medial_axis.simplifier(type("Bare", (), {}))
    info = MethodInfo(id="Not An Id", title="x")
    with pytest.raises(ParameterError, match="lower-case"):
        medial_axis.simplifier(type("Named", (), {"info": info}))
    info = MethodInfo(id="an-id", title="x")
    with pytest.raises(ParameterError, match="prepare"):
        medial_axis.simplifier(type("Half", (), {"info": info, "at": lambda self, level: None}))
    assert Level().published and not Level(spheres=3).published
