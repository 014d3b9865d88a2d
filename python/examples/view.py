"""A medial mesh inside its surface, coloured by radius: by PyVista where it is installed, else as a PNG.

    python view.py                 # a window, or view.png
    python view.py picture.png     # a picture, without a screen
"""

from __future__ import annotations

import sys

from medial_axis import Mesh, Picture

axis = Mesh.read("builtin:blob").medial_axis().simplify("qmat", spheres=200)
shown = axis.plot(screenshot=sys.argv[1] if len(sys.argv) > 1 else None)
if isinstance(shown, Picture) and len(sys.argv) == 1:
    shown.save("view.png")
