"""Long calls: threads, Ctrl-C, progress, memory."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import medial_axis
from medial_axis import MedialAxis, Mesh


def test_two_threads_at_once(axis: MedialAxis) -> None:
    found: dict[int, list[bytes]] = {}

    def work(thread: int) -> None:
        methods = ["qmat", "hem"] if thread else ["hem", "qmat"]
        results = {method: axis.simplify(method, spheres=50) for method in methods}
        found[thread] = [results[method].centres.tobytes() for method in ("qmat", "hem")]

    threads = [threading.Thread(target=work, args=(thread,)) for thread in range(2)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert found[0] == found[1]


def test_others_run_during_a_long_call() -> None:
    """The interpreter's lock is free: another thread counts meanwhile."""
    points = np.random.default_rng(0).random((200_000, 3))
    ticks, done = [0], threading.Event()

    def tick() -> None:
        while not done.wait(0.005):
            ticks[0] += 1

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.perf_counter()
    medial_axis.triangulate(points)
    seconds = time.perf_counter() - start
    done.set()
    thread.join()
    # One tick in 5 ms without the lock, and none while a call holds it.
    assert ticks[0] > 10 * seconds


def test_the_number_of_threads_changes_nothing(blob: Mesh) -> None:
    axes = [blob.medial_axis(threads=n).simplify("qmat", spheres=50, threads=n) for n in (1, 2)]
    assert axes[0].centres.tobytes() == axes[1].centres.tobytes()


def test_progress_is_reported_and_its_errors_are_raised(blob: Mesh) -> None:
    fine = Mesh.read("builtin:torus:160")
    reported: list[tuple[str, float | None]] = []
    fine.medial_axis(progress=lambda stage, share: reported.append((stage, share)))
    assert reported and all(share is None or 0 <= share <= 1 for _, share in reported)

    def refuse(stage: str, share: float | None) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        Mesh.read("builtin:torus:170").medial_axis(progress=refuse)


INTERRUPTED = """
import signal, sys, time
import numpy as np
import medial_axis
# What starts in the background inherits that interrupts are ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
points = np.random.default_rng(0).random((3_000_000, 3))
print("ready", flush=True)
start = time.monotonic()
try:
    medial_axis.triangulate(points)
except KeyboardInterrupt:
    print("interrupted", time.monotonic(), flush=True)
    sys.exit(7)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_an_interrupt_ends_a_long_call() -> None:
    process = subprocess.Popen([sys.executable, "-c", INTERRUPTED], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    time.sleep(0.5)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    word, at = process.stdout.readline().split()
    assert word == "interrupted"
    assert process.wait(timeout=60) == 7
    # Half a second is promised; a busy machine may be slower, but not as slow as the whole call.
    assert float(at) - sent < 2.0


def resident_bytes() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no /proc")
def test_a_thousand_calls_leak_no_memory() -> None:
    mesh = Mesh.read("builtin:box")
    corners = np.random.default_rng(1).random((50, 3))
    initial = mesh.medial_axis()

    def calls(count: int) -> None:
        for _ in range(count):
            medial_axis.triangulate(corners)
            copy = Mesh(mesh.vertices, mesh.faces)
            copy.signed_distance(corners)
            small = initial.simplify("angle", level=60)
            small.betti, small.centres, small.faces
            with pytest.raises(medial_axis.ParameterError):
                initial.simplify("angle", level=60, wrong=1)

    calls(100)  # For allocations that happen once.
    before = resident_bytes()
    calls(200)
    assert resident_bytes() - before < 20_000_000, "a thousand calls and errors"


def test_a_comparison_shows_one_line_that_updates(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    def run(out: str, progress: bool | Callable[[str, float | None], object]) -> str:
        medial_axis.compare(
            "builtin:box", methods=["qmat", "hem"], spheres=20, out=tmp_path / out, quiet=True, progress=progress
        )
        return capfd.readouterr().err

    shown = run("line", True)
    assert shown.count("\n") == 1 and shown.endswith("\n"), "one line"
    states = shown.rstrip("\n").split("\r")[1:]
    assert len(states) == 4 and all(state.startswith("compare: ") for state in states)
    assert "box: qmat" in "".join(states) and "left" not in shown
    assert re.fullmatch(r"compare:   0%\|          \| 0/3 \[00:\d\d<\?, box: initial\]", states[0]), states[0]
    assert re.match(r"compare: 100%\|█{10}\| 3/3 \[00:\d\d<00:00, done\]", states[-1]), states[-1]
    calls: list[tuple[str, float | None]] = []
    assert run("function", lambda stage, share: calls.append((stage, share))) == ""
    assert [share for _, share in calls] == [0, 1 / 3, 2 / 3, 1] and calls[0][0].startswith("box: ")

    def refuse(stage: str, share: float | None) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        run("refused", refuse)
    # Reasons of missing results come after the line.
    (tmp_path / "open.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    with pytest.raises(medial_axis.MedialError, match="open.*refused"):
        medial_axis.compare(tmp_path / "open.off", methods="qmat", out=tmp_path / "open", quiet=True, progress=True)
