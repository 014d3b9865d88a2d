#!/usr/bin/env python3
"""Checks what may use what: crates, methods, modules, files. Exits with 1 and names what breaks a rule.

    scripts/layers.py [--test]      --test: checks itself on a small made-up crate

A path such as `crate::a::Name` leads to the file that defines `Name`, through all re-exports. Tests may use anything.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# The crates that each crate may depend on.
CRATES = {
    "medial-source-hash": "",
    "medial-test-support": "",
    "medial-geometry": "medial-source-hash",
    "medial": "medial-geometry medial-source-hash",
    "medial-methods": "medial medial-source-hash",
    "medial-datasets": "medial",
    "medial-run": "medial medial-datasets",
    "medial-reports": "medial medial-run",
    "medial-bench": "medial medial-methods medial-datasets medial-run medial-reports",
    "medial-fuzz": "medial medial-geometry medial-run medial-bench",
    "medial-oracles": "medial medial-methods medial-datasets",
    "medial-python": "medial medial-methods medial-run medial-reports medial-bench",
    "medial-largest": "medial medial-methods medial-bench",
}
# The library's and the methods' own tests may use the built-in shapes.
IN_TESTS = {"medial-datasets", "medial-test-support"}

METHODS = set("angle aof cover coverage_axis dey_zhao hem lambda pmat qmat sat sat_pairwise sphere_mesh tam_heidrich tight vmas".split())

# The modules of a crate from below: each may use those of earlier layers and its own.
LAYERS = {
    "src": "atomic input colour diagnostics heap range_queue sum|surface|complex|metrics|shape|simplifier",
    "bench": "exit host process_tree|progress provenance|plugin|check|study|store|exec|args interrupt|output|files|"
    "own_metric|rebuild|cmd|cli",
}

# Files of these do not use each other in a circle. A module and one of its ancestors may use each other.
ACYCLIC = "src/geometry src methods datasets run reports bench python/src fuzz".split()


def tree(text, at, prefix, found):
    """Adds the paths of a tree such as `a::{b, c::d as e}` at a place, each with its last name. Returns its end."""
    skip = lambda at: re.compile(r"\s*").match(text, at).end()
    at = skip(at)
    if text.startswith("{", at):
        at = skip(at + 1)
        while at < len(text) and text[at] != "}":
            at = skip(tree(text, at, prefix, found))
            if text[at : at + 1] not in (",", "}"):
                return at
            at = skip(at + 1) if text[at] == "," else at
        return at + 1
    word = re.compile(r"\w*").match(text, at).group()
    at += len(word)
    if not word:
        return at + text.startswith("*", at)
    path = prefix if word == "self" and prefix else (*prefix, word)  # `a::{self}` is `a`
    if text.startswith("::", at):
        return tree(text, at + 2, path, found)
    name = re.compile(r" as (\w+)").match(text, at)
    found.append((path, name.group(1) if name else path[-1]))
    return name.end() if name else at


def parsed(text):
    """The paths in a file, and the names that its `use` declarations bring in."""
    code = "\n".join(
        line for line in text.split("\n#[cfg(test)]\nmod ")[0].splitlines() if not line.lstrip().startswith("//")
    )
    paths, names = [], {}
    for start in re.finditer(r"(?<![\w:$])(use |crate::|super::|self::)", code):
        found, is_use = [], start.group() == "use "
        tree(code, start.end() if is_use else start.start(), (), found)
        paths += [path for path, _ in found]
        names.update({name: path for path, name in found} if is_use else {})
    return paths, names


def sources_of(root):
    """The files of a crate by module."""
    sources = {}
    for file in sorted(root.rglob("*.rs")):
        parts = file.relative_to(root).parts
        folders = [root.joinpath(*parts[:k]) for k in range(1, len(parts))]
        # Separate crates have their own root.
        if {"tests", "benches", "target"} & set(parts[:-1]) or any((folder / "lib.rs").exists() for folder in folders):
            continue
        if file.stem not in ("build", "main", "tests", "source_hash"):
            own = () if file.stem in ("mod", "lib") else (file.stem,)
            sources[(*parts[:-1], *own)] = parsed(file.read_text())
    return sources


def resolved(sources, module, path, depth=0):
    """The module whose file defines the end of a path in another module; None outside the crate."""
    at, rest = module, path
    if path[0] == "crate":
        at, rest = (), path[1:]
    elif path[0] == "self":
        rest = path[1:]
    while rest and rest[0] == "super":
        at, rest = at[:-1], rest[1:]
    for k, name in enumerate(rest):
        if (*at, name) in sources:
            at = (*at, name)
            continue
        if at not in sources:
            return None
        other = sources[at][1].get(name)
        if other and depth < 9 and other != path:
            return resolved(sources, at, other + rest[k + 1 :], depth + 1)
        # A relative path that names no child begins with another crate.
        if rest == path and k == 0:
            return None
        break
    return at if at in sources else None


def uses_of(root):
    """The modules of a crate, each with those whose files it uses."""
    sources = sources_of(root)
    found = {module: {resolved(sources, module, path) for path in paths} for module, (paths, _) in sources.items()}
    return {module: used - {None} for module, used in found.items()}


def circles(root):
    """The sets of modules whose files use each other, directly or not."""
    uses = uses_of(root)
    is_kin = lambda a, b: a[: len(b)] == b or b[: len(a)] == a
    uses = {module: {other for other in used if not is_kin(module, other)} for module, used in uses.items()}
    reached = {}
    for module in uses:
        found, left = set(), list(uses[module])
        while left:
            other = left.pop()
            if other not in found:
                found.add(other)
                left += uses[other]
        reached[module] = found
    rings = {frozenset("::".join(o) for o in reached[m] if m in reached[o]) for m in uses}
    return sorted(sorted(ring) for ring in rings if ring)


def faults():
    words = ["cargo", "metadata", "--format-version", "1", "--no-deps", "--offline"]
    metadata = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for package in json.loads(metadata)["packages"]:
        name = package["name"]
        if name not in CRATES:
            yield f"{name} has no place in the order of the crates"
            continue
        for dependency in package["dependencies"]:
            other = dependency["name"]
            in_tests = dependency["kind"] == "dev" and other in IN_TESTS
            if other.startswith("medial") and not in_tests and other not in CRATES[name].split():
                yield f"{name} must not depend on {other}"

    for module, used in uses_of(ROOT / "methods").items():
        others = {other[0] for other in used if other} & METHODS - set(module[:1])
        if module and module[0] in METHODS and others:
            yield f"method {module[0]} uses the methods {', '.join(sorted(others))}"

    for folder, text in LAYERS.items():
        layer = {module: k for k, names in enumerate(text.split("|")) for module in names.split()}
        for module, used in uses_of(ROOT / folder).items():
            # The root has re-exports.
            if module and module[0] not in layer:
                yield f"{folder}: the module {module[0]} has no layer"
                continue
            for other in used if module else ():
                if other and layer.get(other[0], len(layer)) > layer[module[0]]:
                    yield f"{folder}: {'::'.join(module)} uses {'::'.join(other)}, which is not below it"

    for module, used in uses_of(ROOT / "bench").items():
        for other in used:
            if module[:1] == ("cmd",) == other[:1] and len(module) > 1 and len(other) > 1 and module[1] != other[1]:
                yield f"the verb {module[1]} uses the verb {other[1]}"

    for folder in ACYCLIC:
        if len(sources_of(ROOT / folder)) < 2:
            yield f"{folder}: no sources"
        for ring in circles(ROOT / folder):
            yield f"{folder}: these files use each other in a circle: {', '.join(ring)}"


def test():
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "b").mkdir()
        write = lambda file, text: (root / file).write_text(text)
        write("lib.rs", "mod a;\nmod b;\npub use a::One;")
        write("a.rs", "use crate::b::{c::Two, Other as _};\npub struct One;")
        write("b/mod.rs", "mod c;\npub use c::Two;\npub struct Other;")
        write("b/c.rs", "// crate::a::One\npub struct Two;\n\n#[cfg(test)]\nmod tests {\n    use crate::One;\n}")
        assert circles(root) == [], circles(root)
        assert uses_of(root)["a",] == {("b",), ("b", "c")}, uses_of(root)
        # Through the root, and through the folder's module.
        write("b/c.rs", "pub struct Two(pub(crate) crate::One);")
        write("a.rs", "use super::b::Two;\npub struct One;")
        assert circles(root) == [["a", "b::c"]], circles(root)


if sys.argv[1:] == ["--test"]:
    test()
found = list(faults())
print("\n".join(found) or "all uses are allowed")
sys.exit(1 if found else 0)
