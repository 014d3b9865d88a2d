"""The command `medial`, in this process and in new ones."""

from __future__ import annotations

import sys
from typing import NoReturn

from . import _medial

#: The start of the command in a new process. It must not import from the user's folder, where a file may have the name
#: of a module. With `python -m` that folder would be the first.
STARTED_BY = [
    sys.executable,
    "-c",
    "import sys; sys.path[:1] = filter(None, sys.path[:1]); from medial_axis._command import main; main()",
]


def main() -> NoReturn:
    """Runs the command with the words of this process, and ends it."""
    words = sys.argv[1:]
    if words[:1] == ["worker"]:
        # Standard output is for the supervisor: output of classes goes to standard error.
        sys.stdout = sys.stderr
    program, *arguments = STARTED_BY
    sys.exit(_medial.run_command(program, arguments, _medial.__file__, words))
