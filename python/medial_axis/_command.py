"""The command `medial`: how it runs in this process, and how it is started in another."""

from __future__ import annotations

import sys
from typing import NoReturn

from . import _medial

#: Python, and what it does before the words of the command. The folder of the user is no place to import from: a file
#: there may be called as a module is. With `python -m` it would be the first.
STARTED_BY = [
    sys.executable,
    "-c",
    "import sys; sys.path[:1] = filter(None, sys.path[:1]); from medial_axis._command import main; main()",
]


def main() -> NoReturn:
    """Runs the command with the words of this process, and ends it."""
    words = sys.argv[1:]
    if words[:1] == ["worker"]:
        # Standard output is for the supervisor: what classes print goes beside it.
        sys.stdout = sys.stderr
    program, *arguments = STARTED_BY
    sys.exit(_medial.run_command(program, arguments, _medial.__file__, words))
