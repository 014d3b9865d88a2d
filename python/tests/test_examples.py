"""Every example runs, and all of it passes the type checker."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from medial_axis import MedialAxis

EXAMPLES = Path(__file__).parent.parent / "examples"
ROOT = EXAMPLES.parent.parent


def run(name: str, *words: object, cwd: Path) -> str:
    command = [sys.executable, str(EXAMPLES / name), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def needs(module: str) -> None:
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed")


def test_three_lines(tmp_path: Path) -> None:
    printed = run("three_lines.py", cwd=tmp_path)
    assert printed.startswith("100 spheres") and "certified" in printed


@pytest.mark.parametrize("text", [ROOT / "docs" / "python.md", ROOT / "python" / "README.md"], ids=str)
def test_the_first_program_of_a_text(text: Path, tmp_path: Path) -> None:
    if not text.is_file():
        pytest.skip("not part of the source distribution")
    shell, program = re.findall(r"^```(?:sh|python)\n(.*?)^```$", text.read_text(), re.MULTILINE | re.DOTALL)[:2]
    # No index has the package.
    assert shell.startswith("pip install ./python ")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0 and "certified" in done.stdout, done.stderr


def test_the_program_for_a_robot(tmp_path: Path) -> None:
    page = ROOT / "docs" / "spheres.md"
    if not page.is_file():
        pytest.skip("not part of the source distribution")
    (program,) = re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)
    (tmp_path / "links").mkdir()
    for link, height in [("arm", 3), ("hand", 1)]:
        corners = np.array([(x, y, z * height) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        faces = np.array([face for a, b, c, d in quads for face in [(a, b, c), (a, c, d)]])
        rows = np.zeros(len(faces), [("normal", "<3f4"), ("corners", "<9f4"), ("attribute", "<u2")])
        rows["corners"] = corners[faces].reshape(-1, 9)
        content = bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes()
        (tmp_path / "links" / f"{link}.stl").write_bytes(content)
    # Few spheres suffice here.
    program = program.replace("<= 96", "<= 24")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    counts = [len(MedialAxis.read(tmp_path / f"{link}.yaml")) for link in ("arm", "hand")]
    assert counts[0] > counts[1] and sum(counts) <= 24, done.stdout


def test_a_class_of_ones_own_and_plots_of_its_results(tmp_path: Path) -> None:
    printed = run("largest.py", tmp_path / "report", cwd=tmp_path)
    assert printed.strip().endswith("index.html")
    needs("matplotlib")
    run("plots.py", tmp_path / "report", tmp_path / "errors.png", cwd=tmp_path)
    assert (tmp_path / "errors.png").stat().st_size > 10_000


def test_round_trips(tmp_path: Path) -> None:
    printed = run("round_trips.py", cwd=tmp_path)
    for module, name in [("trimesh", "trimesh"), ("open3d", "Open3D")]:
        if importlib.util.find_spec(module) is not None:
            line = next(line for line in printed.splitlines() if line.startswith(name))
            assert "=True" in line, line


def test_a_view(tmp_path: Path) -> None:
    run("view.py", tmp_path / "view.png", cwd=tmp_path)
    assert (tmp_path / "view.png").stat().st_size > 10_000


def test_types(tmp_path: Path) -> None:
    needs("mypy")
    files = [str(EXAMPLES), str(Path(__file__).parent)]
    package = Path(__file__).parent.parent / "medial_axis"
    command = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--cache-dir", str(tmp_path)]
    done = subprocess.run([*command, str(package), *files[:1]], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
