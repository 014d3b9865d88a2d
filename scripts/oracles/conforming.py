"""The conforming start against TetGen (Debian: tetgen): conforming.py MEDIAL MESH...

MESH: a file or builtin:ID. Where neither adds a point, TetGen with `-pD` triangulates the same points: 99 % of its
circumspheres must be ours, and the numbers of cells within 5 %, since cospherical vertices have several
triangulations, and cells with a circumcentre outside are left out here. On every mesh the Euler number of the start
must be that of the solid, half that of the surface. Exit codes: 0 all agree, 1 some differ, 77 TetGen or NumPy is
missing.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
except ImportError:
    np = None

# A circumsphere is the same within this, as a fraction of the diagonal and of its radius.
TOLERANCE = 1e-7


def counts(path):
    """Vertices, edges and faces of an OFF file."""
    words = Path(path).read_text().split()
    vertices, faces = int(words[1]), int(words[2])
    points = np.array(words[4:4 + 3 * vertices], float).reshape(-1, 3)
    return points, vertices - 3 * faces // 2 + faces


def circumspheres(points, cells):
    """n x 4: centres and radii."""
    a, rest = points[cells[:, 0]], [points[cells[:, k]] for k in (1, 2, 3)]
    rows = np.stack([p - a for p in rest], axis=1)
    with np.errstate(all="ignore"):
        centre = np.linalg.solve(rows, 0.5 * np.sum(rows**2, axis=2)[..., None])[..., 0]
    return np.column_stack([a + centre, np.linalg.norm(centre, axis=1)])


def table(path, columns):
    """The rows of a TetGen file without their numbers."""
    lines = [line.split() for line in path.read_text().splitlines() if line and line[0] != "#"]
    return np.array([row[1:1 + columns] for row in lines[1:]], float)


def shared(ours, theirs, diagonal):
    """Share of their spheres that are among ours."""
    step = TOLERANCE * diagonal
    order = np.argsort(ours[:, 0])
    ours = ours[order]
    found = 0
    for sphere in theirs:
        near = max(step, TOLERANCE * sphere[3])
        low, high = np.searchsorted(ours[:, 0], [sphere[0] - near, sphere[0] + near])
        found += bool((np.abs(ours[low:high] - sphere) <= near).all(axis=1).any())
    return found / len(theirs)


def compare(medial, mesh, folder):
    """Whether all agrees; prints a line."""
    source = folder / "mesh.off"
    if mesh.startswith("builtin:"):
        subprocess.run([medial, "datasets", "make", mesh.removeprefix("builtin:"), "-o", source], check=True,
                       stdout=subprocess.DEVNULL)
    else:
        subprocess.run([medial, "--quiet", "convert", mesh, source], check=True, stdout=subprocess.DEVNULL)
    made = subprocess.run([medial, "--json", "axis", source, "-o", folder / "start.ma"], check=True,
                          capture_output=True, text=True)
    start = json.loads(made.stdout)
    points, euler = counts(source)
    added = start["samples"] - len(points)
    is_right = start["euler"] * 2 == euler
    text = f"{Path(mesh).name}: Euler number {start['euler']} of {euler / 2:g}, {added} points added"
    subprocess.run(["tetgen", "-pDQ", source], check=True, stdout=subprocess.DEVNULL, timeout=600)
    nodes = table(folder / "mesh.1.node", 3)
    cells = table(folder / "mesh.1.ele", 4).astype(int)
    text += f"; TetGen adds {len(nodes) - len(points)}"
    if added == 0 and len(nodes) == len(points):
        cells -= cells.min()
        lines = (folder / "start.ma").read_text().splitlines()
        ours = np.array([line.split()[1:5] for line in lines if line.startswith("v ")], float)
        share = shared(ours, circumspheres(nodes, cells), np.linalg.norm(np.ptp(points, axis=0)))
        text += f"; {len(ours)} cells, TetGen {len(cells)}; {share:.2%} of the circumspheres shared"
        is_right &= abs(len(ours) - len(cells)) <= 0.05 * len(cells) and share > 0.99
    print(text, flush=True)
    return is_right


def main():
    if np is None or not shutil.which("tetgen"):
        print("skipped: TetGen or NumPy is missing", file=sys.stderr)
        sys.exit(77)
    medial, *meshes = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        sys.exit(0 if all([compare(medial, mesh, Path(folder)) for mesh in meshes]) else 1)


main()
