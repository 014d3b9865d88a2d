"""A medial mesh in PyVista, coloured by radius, inside its surface.

    python view.py                 # a window
    python view.py picture.png     # a picture, without a screen
"""

from __future__ import annotations

import sys

from medial_axis import Mesh

try:
    import pyvista
except ImportError:
    sys.exit("PyVista is not installed: pip install pyvista")

picture = sys.argv[1] if len(sys.argv) > 1 else None
mesh = Mesh.read("builtin:blob")
axis = mesh.medial_axis().simplify("qmat", spheres=200)
plotter = pyvista.Plotter(off_screen=picture is not None)
plotter.add_mesh(pyvista.make_tri_mesh(mesh.vertices, mesh.faces.astype(int)), opacity=0.15, color="white")
plotter.add_mesh(axis.to_pyvista(), scalars="radius", line_width=3, show_edges=True, edge_color="gray")
plotter.show(screenshot=picture or False)
