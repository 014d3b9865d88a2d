"""From a mesh to a hundred spheres, with the errors. The argument is a file; the default is a built-in shape."""

import sys

from medial_axis import Mesh

mesh = Mesh.read(sys.argv[1] if len(sys.argv) > 1 else "builtin:blob")
axis = mesh.medial_axis().simplify("qmat", spheres=100)
print(axis.evaluate(certify=1e-3))
