#!/bin/sh
# Prints the size of this project: everything that can be counted without building it.
#
#   scripts/size.sh [FOLDER]      FOLDER: a clone of the project [this one]
#
# Tests are files in tests/, benches/, examples/ and fuzz/, files named *tests.rs, and `#[cfg(test)]` modules.
# The number of files that one comparison passes needs a build:
#   RUSTFLAGS=-Cinstrument-coverage cargo build; LLVM_PROFILE_FILE=x.%p target/debug/medial compare bear.off
#   profparser show --all-functions --input x.1234     (cargo install llvm_profparser; functions, named by module)
cd "${1:-$(dirname "$0")/..}" || exit 2
exec python3 - <<'END'
import json, re, subprocess
from pathlib import Path

def listed(*patterns):
    command = ["git", "ls-files", "-z", "--", *patterns]
    names = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [Path(name) for name in names.split("\0") if name and Path(name).is_file()]

TEST_FOLDERS = {"tests", "benches", "examples", "fuzz"}

def is_test(path):
    return bool(TEST_FOLDERS & set(path.parts[:-1])) or path.name.endswith("tests.rs")

def without_test_modules(lines):
    """rustfmt closes a module at the indentation at which it was opened."""
    kept, end = [], None
    pending = False
    for line in lines:
        text = line.strip()
        if end is not None:
            if line.rstrip() == end:
                end = None
            continue
        if text == "#[cfg(test)]":
            pending = True
            continue
        if pending and text.startswith("#["):
            continue
        if pending:
            pending = False
            if re.match(r"(pub(\(.*\))? )?mod \w+;", text):
                continue
            if re.match(r"(pub(\(.*\))? )?mod \w+ \{$", text):
                end = line[: len(line) - len(line.lstrip())] + "}"
                continue
        kept.append(line)
    return kept

def is_code(line):
    text = line.strip()
    return bool(text) and not text.startswith("//")

rust = {path: path.read_text().splitlines() for path in listed("*.rs")}
product = {path: without_test_modules(lines) for path, lines in rust.items() if not is_test(path)}
code = {path: sum(map(is_code, lines)) for path, lines in product.items()}
joined = "\n".join(line for lines in product.values() for line in lines)
total = sum(code.values())
why = len(re.findall(r"(?m)^\s*//(?![/!])", joined)) + len(re.findall(r"(?m)^\s*[^\s/].*[;,{(] // ", joined))
functions = len(re.findall(r"(?m)^\s*(?:pub(?:\([a-z]+\))? )?(?:const |unsafe |async )*fn \w", joined))
closures = len(re.findall(r"(?m)^\s*let (?:mut )?\w+(?:: [^=]+)? =\s*(?:move )?\|", joined))

metadata = json.loads(subprocess.run(
    ["cargo", "metadata", "--format-version", "1", "--no-deps", "--offline"],
    capture_output=True, text=True, check=True).stdout)
executables, dependencies = 0, set()
for package in metadata["packages"]:
    dependencies |= {d["name"] for d in package["dependencies"] if d.get("path") is None}
    for target in package["targets"]:
        executables += target["test"]

def verbs():
    """The variants of the command line's enum that are not hidden."""
    for path in ("bench/cli.rs", "bench/src/cli.rs"):
        if not Path(path).exists():
            continue
        body = re.search(r"enum (?:Verb|Command|Commands)\b.*?\{\n(.*?)\n\}", Path(path).read_text(), re.S)
        if body is None:
            break
        # Of an inline module or a variant only the first line stands at this depth.
        entries = re.findall(r"((?:^    (?:///|#\[).*\n)*)^    [A-Z]\w*", body[1], re.M)
        return sum("hide = true" not in attributes for attributes in entries)
    return "?"

def lines_below(folder):
    return sum(len(lines) for path, lines in rust.items() if path.parts[0] == folder)

words = sum(len(path.read_text().split()) for path in listed("*.md"))
rows = [
    ("lines of Rust, tests included", sum(map(len, rust.values()))),
    ("code lines without blank, comment, tests", total),
    ("`.rs` files", len(rust)),
    ("verbs shown", verbs()),
    ("lines of reports, with tests", lines_below("reports")),
    ("lines of bench, with tests", lines_below("bench")),
    ("comment lines that say why, % of code", round(100 * why / total, 1)),
    ("named local closures in 100 functions", round(100 * closures / functions, 1)),
    ("test executables", executables),
    ("words of Markdown", words),
    ("direct dependencies", len(dependencies)),
]
for name in sorted({path.parts[0] for path in rust}):
    rows.append((f"lines of {name}/", lines_below(name)))
width = max(len(name) for name, _ in rows)
for name, value in rows:
    print(f"{name:<{width}}  {value:>10,}" if isinstance(value, int) else f"{name:<{width}}  {value:>10}")
END
