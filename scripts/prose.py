#!/usr/bin/env python3
"""Measures the prose of this project: sentence lengths, semicolons, colons, and words to avoid.

    scripts/prose.py                  print the figures of the whole project; exit code 1 for too many such words
    scripts/prose.py --check [BASE]   list lines with such words among those added since BASE [origin/main];
                                      exit code 1 if there are more than a few

Code blocks, tables, headings and links' targets are not prose. Measured tables in docs/measured/ are not counted.
"""

import re
import subprocess
import sys
from pathlib import Path

WORDS = ["asked", "told", "said", "tells", "anew", "of its own", "so many", "what is", "nobody", "whoever",
         "beside", "stands", "kept on"]
PATTERN = re.compile(r"\b(" + "|".join(WORDS) + r")\b", re.IGNORECASE)
MOST = 100  # public names and texts where such a word is right
ROOT = Path(__file__).resolve().parent.parent


def git(*arguments):
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def prose(text):
    """The sentences of a Markdown text."""
    text = re.sub(r"(?ms)^```.*?^```", "\n\n", text)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    lines = []
    for line in text.splitlines():
        bare = line.strip()
        # Tables and headings have no sentences; an item of a list is a paragraph.
        if bare.startswith(("|", "#", "![", "<")):
            lines.append("")
        elif re.match(r"([-*]|\d+\.) ", bare):
            lines += ["", re.sub(r"^([-*]|\d+\.) ", "", bare)]
        else:
            lines.append(bare)
    text = "\n".join(lines)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`[^`]*`", "CODE", text)
    sentences = []
    for paragraph in re.split(r"\n\s*\n", text):
        flat = " ".join(paragraph.split())
        sentences += [s for s in re.split(r"(?<=[.!?])\s+(?=[A-Z(\"])", flat) if len(s.split()) > 1]
    return sentences


def style(paths):
    sentences = [s for path in paths for s in prose(path.read_text())]
    count = max(len(sentences), 1)
    words = sum(len(s.split()) for s in sentences)
    return words / count, sum(s.count(";") for s in sentences) / count, sum(s.count(":") for s in sentences) / count


def report():
    readme = ROOT / "README.md"
    pages = [ROOT / "METHODOLOGY.md", *sorted((ROOT / "docs").glob("*.md"))]
    print(f"README.md: {readme.stat().st_size} bytes")
    print(f"{'':24}words  semicolons  colons (a sentence)")
    for name, paths in [("README.md", [readme]), ("METHODOLOGY.md", pages[:1]), ("docs/*.md", pages[1:]),
                        ("all", [readme, *pages])]:
        words, semicolons, colons = style(paths)
        print(f"{name:24}{words:5.1f}  {semicolons:10.2f}  {colons:6.2f}")
    lines = 0
    for name in git("ls-files", "*.rs", "*.md").splitlines():
        path = ROOT / name
        if path.is_file():
            lines += sum(bool(PATTERN.search(line)) for line in path.read_text().splitlines())
    print(f"lines of .rs and .md with a word to avoid: {lines}, at most {MOST} pass")
    return lines > MOST


def check(base):
    """Words to avoid among added lines. A few are right in their place."""
    found, name = [], ""
    for line in git("diff", "-U0", f"{base}...HEAD", "--", "*.rs", "*.md").splitlines():
        if line.startswith("+++ "):
            name = line[6:]
        elif line.startswith("+") and (hit := PATTERN.search(line)):
            found.append(f"{name}: `{hit[1]}` in: {line[1:].strip()[:120]}")
    print("\n".join(found))
    print(f"{len(found)} added lines with a word to avoid, at most 10 pass")
    return len(found) > 10


if __name__ == "__main__":
    if sys.argv[1:2] == ["--check"]:
        sys.exit(check(sys.argv[2] if len(sys.argv) > 2 else "origin/main"))
    sys.exit(report())
