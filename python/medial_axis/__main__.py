"""The command `medial`, or `python -m medial_axis`."""

from __future__ import annotations

import sys
from typing import NoReturn

from . import _medial


def main() -> NoReturn:
    """Runs the command with the words of this process, and ends it."""
    words = sys.argv[1:]
    if words[:1] == ["worker"]:
        # Standard output is for the supervisor: what classes print goes beside it.
        sys.stdout = sys.stderr
    code = _medial.run_command(sys.executable, ["-m", "medial_axis"], _medial.__file__, words)
    sys.exit(code)


if __name__ == "__main__":
    main()
