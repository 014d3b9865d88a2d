"""Runs the Python package multisphere as a method: see docs/adapters.md.

    python3 multisphere.py SURFACE.off OUTPUT.ma --spheres N --division D --voxels V --confine true|false

Exit code 65: the package cannot be imported, or found no sphere.
"""

import argparse
import contextlib
import json
import sys
import time

# Python looks for modules in the folder of this file first, and would import this file.
sys.path.pop(0)
try:
    import multisphere
    import numpy as np
    import trimesh
except ImportError as error:
    print(f"multisphere: {error}; run: pip install 'multisphere[full]'", file=sys.stderr)
    sys.exit(65)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("surface")
    parser.add_argument("output")
    parser.add_argument("--spheres", type=int)
    parser.add_argument("--division", type=int)
    parser.add_argument("--voxels", type=float)
    parser.add_argument("--confine", choices=["true", "false"])
    arguments = parser.parse_args()

    start = time.perf_counter()
    mesh = trimesh.load(arguments.surface, force="mesh")
    # The voxels are cubes: a thin plate would need billions of them for D along its shortest side.
    most = (arguments.voxels / np.prod(mesh.extents / mesh.extents.min())) ** (1 / 3)
    division = max(1, min(arguments.division, int(most)))
    prepared = time.perf_counter()
    with contextlib.redirect_stdout(sys.stderr):
        found = multisphere.multisphere_from_mesh(
            mesh, div=division, max_spheres=arguments.spheres, confine_mesh=arguments.confine == "true"
        )
    done = time.perf_counter()

    kept = found.radii > 0
    if not kept.any():
        print("multisphere: found no sphere", file=sys.stderr)
        sys.exit(65)
    with open(arguments.output, "w") as out:
        print(kept.sum(), 0, 0, file=out)
        np.savetxt(out, np.column_stack([found.centers, found.radii])[kept], fmt="v %.17g %.17g %.17g %.17g")
    warnings = [f"division {division}, for at most {arguments.voxels:.3g} voxels"] if division < arguments.division else []
    print(json.dumps({"seconds": {"prepare": prepared - start, "simplify": done - prepared}, "warnings": warnings}))


main()
