"""The notebook: executed by a kernel, its cells give the outputs that are stored in it.

`python tests/test_notebook.py` stores new outputs.
"""

from __future__ import annotations

import base64
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

NOTEBOOK = Path(__file__).parent.parent / "examples" / "results.ipynb"

PICTURE = "image/png"


def executed(notebook: Any, folder: Path) -> Any:
    """The notebook with new outputs."""
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    return nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()


def read() -> Any:
    return pytest.importorskip("nbformat").read(NOTEBOOK, as_version=4)


def shown(notebook: Any) -> list[list[str]]:
    """The texts of each cell. Of a picture only that there is one: letters depend on the fonts of the machine."""
    texts = []
    for cell in notebook.cells:
        outputs = cell.get("outputs", [])
        data = [output.get("data", {"text/plain": output.get("text", "")}) for output in outputs]
        texts.append(["picture" if PICTURE in part else part["text/plain"] for part in data])
    return texts


def test_outputs(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("matplotlib")
    stored = read()
    expected = shown(stored)
    assert sum(texts == ["picture"] for texts in expected) == 3, "the medial mesh, its errors, the curves"
    assert shown(executed(stored, tmp_path)) == expected


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
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    executed(notebook, tmp_path)
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
    with tempfile.TemporaryDirectory() as folder:
        notebook = executed(read(), Path(folder))
    for cell in notebook.cells:
        # Times of this run.
        cell.metadata = {}
    notebook.metadata.pop("language_info", None)
    NOTEBOOK.write_text(json.dumps(notebook, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(store())
