"""The notebook: its cells run with the outputs that are stored in it.

`python tests/test_notebook.py` stores new outputs.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

NOTEBOOK = Path(__file__).parent.parent / "examples" / "results.ipynb"


def run_cells(cells: list[str]) -> list[str]:
    """The output of each cell, with the value of its last line, as in a notebook."""
    names: dict[str, Any] = {"__name__": "__main__"}
    outputs = []
    for source in cells:
        body = ast.parse(source).body
        last = body.pop() if body and isinstance(body[-1], ast.Expr) else None
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(ast.Module(body, []), "cell", "exec"), names)
            value = last and eval(compile(ast.Expression(last.value), "cell", "eval"), names)
        outputs.append(printed.getvalue() + ("" if value is None else f"{value!r}\n"))
    return outputs


def sources(notebook: dict[str, Any]) -> list[str]:
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]


def stored(notebook: dict[str, Any]) -> list[str]:
    outputs = [cell["outputs"] for cell in notebook["cells"] if cell["cell_type"] == "code"]
    return ["".join("".join(part["text"]) for part in parts) for parts in outputs]


def test_outputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    notebook = json.loads(NOTEBOOK.read_text())
    assert run_cells(sources(notebook)) == stored(notebook)
    assert (tmp_path / "errors.png").stat().st_size > 10_000


CELLS = [
    "from medial_axis import Mesh, compare, render\nmesh = Mesh.read('builtin:blob')\nmesh",
    "axis = mesh.medial_axis().simplify('qmat', spheres=100)\naxis",
    "render(axis, show='error')",
    "axis.plot(backend='png')",
    "report = compare('builtin:box', methods='qmat', spheres=20, quiet=True, progress=True)",
]


def test_objects_in_a_notebook(tmp_path: Path) -> None:
    """A notebook with a new kernel shows pictures, and a comparison as a line that updates."""
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [cell.outputs for cell in notebook.cells]
    for [shown], words in zip(outputs[:2], (["blob", "faces"], ["qmat", "Betti numbers", "(1, 0, 0)"])):
        page = shown.data["text/html"]
        assert "data:image/png;base64," in page and all(word in page for word in words)
    pictures = [shown.data["image/png"] for [shown] in outputs[:4]]
    assert len(set(pictures)) == 4
    for number, picture in enumerate(pictures):
        (tmp_path / f"{number}.png").write_bytes(base64.b64decode(picture))
        assert (tmp_path / f"{number}.png").read_bytes().startswith(b"\x89PNG")
    lines = "".join(output.text for output in outputs[4])
    assert lines.count("\n") == 1 and "2/2" in lines, lines


def store() -> None:
    import tempfile

    notebook = json.loads(NOTEBOOK.read_text())
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        outputs = run_cells(sources(notebook))
    code = (cell for cell in notebook["cells"] if cell["cell_type"] == "code")
    for number, (cell, text) in enumerate(zip(code, outputs), 1):
        lines = text.splitlines(keepends=True)
        cell["execution_count"] = number
        cell["outputs"] = [{"name": "stdout", "output_type": "stream", "text": lines}] if lines else []
    NOTEBOOK.write_text(json.dumps(notebook, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(store())
