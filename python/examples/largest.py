"""A method as a Python class, compared with the published ones.

    python largest.py                                                    # this comparison
    medial compare --plugins largest.py --methods largest-class,qmat     # the same from the command line
    medial check --plugins largest.py largest-class                      # the conformance tests
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

import medial_axis
from medial_axis import Level, MedialAxis, MethodInfo, Param, RunContext, Shape, Simplified


@medial_axis.simplifier
class Largest:
    """Keeps the largest balls of the initial medial mesh, with the edges and faces between them."""

    info = MethodInfo(
        id="largest-class",
        title="Largest balls first (Python class)",
        citation="An example",
        params=(Param("least", 0.0, "fraction of the diagonal", "radius below which no ball is kept"),),
    )

    def prepare(self, shape: Shape, params: dict[str, Any], run: RunContext) -> None:
        """Once for a shape."""
        self.axis = shape.initial()
        # Ties by number: the same bytes each time.
        order = np.argsort(-self.axis.radii, kind="stable")
        self.order = order[self.axis.radii[order] >= params["least"]]

    def at(self, level: Level) -> MedialAxis | Simplified:
        """Once for each level."""
        if level.spheres is None:
            raise medial_axis.UnsupportedError("give a number of spheres")
        if len(self.order) == 0:
            raise medial_axis.ParameterError("no ball is as large as `least`")
        keep = np.zeros(len(self.axis), bool)
        keep[self.order[: level.spheres]] = True
        return self.axis.induced(keep)


# Workers load this file for the class only.
if __name__ == "__main__":
    report = medial_axis.compare(
        ["builtin:box", "builtin:torus"],
        methods=[Largest, "qmat"],
        spheres=[200, 50],
        out=sys.argv[1] if len(sys.argv) > 1 else "medial-report",
    )
    print(report.page)
