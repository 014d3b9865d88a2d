"""What the Python package costs beside the command: time of a simplification, and memory of a triangulation.

    python scripts/python_overhead.py MESH [ROUNDS]

Both sides are asked in turn. The command's time is the one that it tells: substrates, preparation and level, without reading and
checking. That of Python is the wall clock around `medial_axis()` and `simplify()`, from arrays.
"""

import json
import resource
import statistics
import subprocess
import sys
import threading
import time

import numpy as np

import medial_axis
from medial_axis import Mesh

MILLION = 1_000_000


def by_command(mesh: str) -> float:
    words = ["simplify", mesh, "--method", "qmat", "--spheres", "100", "--json"]
    run = subprocess.run([sys.executable, "-m", "medial_axis", *words], capture_output=True, text=True, check=True)
    return float(json.loads(run.stdout)["seconds"]["total"])


def by_package(mesh: str) -> float:
    arrays = Mesh.read(mesh)
    fresh = Mesh(arrays.vertices, arrays.faces)
    start = time.perf_counter()
    fresh.medial_axis().simplify("qmat", spheres=100)
    return time.perf_counter() - start


def resident_mb() -> float:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


def peak_of_a_triangulation() -> tuple[float, float]:
    """Megabytes on top of the points: while it works, and of the result."""
    points = np.random.default_rng(0).random((MILLION, 3))
    before, most, done = resident_mb(), [0.0], threading.Event()

    def watch() -> None:
        while not done.wait(0.01):
            most[0] = max(most[0], resident_mb())

    watcher = threading.Thread(target=watch)
    watcher.start()
    made = medial_axis.triangulate(points)
    done.set()
    watcher.join()
    return most[0] - before, sum(array.nbytes for array in made) / 1e6


def peak_of_the_command() -> float:
    """Megabytes that the command tells for the same points, which it reads from a file."""
    import tempfile

    with tempfile.NamedTemporaryFile(suffix=".npy") as file:
        np.save(file, np.random.default_rng(0).random((MILLION, 3)))
        file.flush()
        words = ["triangulate", file.name, "--json"]
        run = subprocess.run([sys.executable, "-m", "medial_axis", *words], capture_output=True, text=True, check=True)
    return float(json.loads(run.stdout)["peak_bytes"]) / 1e6


def main() -> None:
    mesh, rounds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 7
    ratios = []
    for _ in range(rounds):
        command, package = by_command(mesh), by_package(mesh)
        ratios.append(package / command)
        print(f"command {command:.3f} s, package {package:.3f} s, ratio {package / command:.3f}")
    print(f"median ratio {statistics.median(ratios):.3f}")
    peak, result = peak_of_a_triangulation()
    print(f"a million points ({MILLION * 24 / 1e6:.0f} MB): {peak:.0f} MB more while it works, result {result:.0f} MB")
    print(f"the command, with its own copy of the points: {peak_of_the_command():.0f} MB in all")


if __name__ == "__main__":
    main()
