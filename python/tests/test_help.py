"""Documentation of the public interface: each section is there, names what exists, and its examples run."""

from __future__ import annotations

import doctest
import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import medial_axis

SECTION = re.compile(r"^( *)(Args|Returns|Raises|Example):$", re.MULTILINE)


def documented() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public functions, classes that are called with arguments, and public methods of all classes."""
    for name in medial_axis.__all__:
        member = getattr(medial_axis, name)
        if inspect.isfunction(member):
            yield name, member
        elif inspect.isclass(member):
            if name in ("Mesh", "MedialAxis"):
                yield name, member
            for own, value in vars(member).items():
                function = value.__func__ if isinstance(value, classmethod) else value
                if inspect.isfunction(function) and not own.startswith("_"):
                    yield f"{name}.{own}", function


FUNCTIONS = dict(documented())


def test_all_that_is_public_is_looked_at() -> None:
    expected = {"compare", "render", "Mesh", "Mesh.read", "MedialAxis.simplify", "Evaluation.row", "Report.frame", "Shape.initial"}
    assert expected <= set(FUNCTIONS) and len(FUNCTIONS) > 45


@pytest.mark.parametrize("name", FUNCTIONS)
def test_sections(name: str) -> None:
    function = FUNCTIONS[name]
    text = inspect.getdoc(function) or ""
    parts = SECTION.split(text)
    sections = dict(zip(parts[2::3], parts[3::3]))
    assert parts[0].strip().split("\n")[0].endswith((".", ":")), "a sentence first"
    parameters = [p for p in inspect.signature(function).parameters if p not in ("self", "cls")]
    named = re.findall(r"^    (\w+): .+", sections.get("Args", ""), re.MULTILINE)
    assert named == parameters if name != "simplifier" else named == ["cls"]
    returned = inspect.signature(function).return_annotation
    assert ("Returns" in sections) == (returned not in ("None", None) and not inspect.isclass(function))
    assert "Example" in sections
    # Only these cannot fail.
    if "Raises" not in sections:
        assert not parameters or name == "Simplified", name


@pytest.mark.parametrize("name", [m.name for m in pkgutil.iter_modules(medial_axis.__path__) if m.name not in ("__main__", "_medial")])
def test_examples(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `pytest --doctest-modules` runs them."""
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(f"medial_axis.{name}")
    result = doctest.testmod(module)
    assert result.failed == 0
    assert result.attempted > 0 or name.startswith("_") or name == "errors"
