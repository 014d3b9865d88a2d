#!/usr/bin/env python3
"""Writes a point set for delaunay.sh: x, y, z and a weight of each point, as doubles.

    points.py NAME FILE

NAME is one of the sets below with its size, such as cube-100000; w:NAME has weights.
"""

import array
import math
import random
import sys
from itertools import combinations, product


def cube(n):
    """Uniformly random in the unit cube."""
    draw = random.Random(1).random
    return ((draw(), draw(), draw()) for _ in range(n))


def normalised(*p):
    length = math.hypot(*p)
    return tuple(x / length for x in p)


def sphere(n, seed=3):
    """Random on the unit sphere, rounded."""
    draw = random.Random(seed).gauss
    return (normalised(draw(), draw(), draw()) for _ in range(n))


def surface(n):
    """Random on a smooth surface with bumps and hollows."""
    radius = lambda x, y, z: 1 + 0.25 * math.sin(3 * x) * math.cos(4 * y) + 0.15 * math.sin(5 * z)
    return (tuple(radius(*u) * x for x in u) for u in sphere(n, 2))


def lattice(n):
    """n^3 integer points."""
    return [(x, y, z) for z, y, x in product(range(n), repeat=3)]


def box(n):
    """The surface of the unit cube in steps of 1 / n."""
    return [(x / n, y / n, z / n) for x, y, z in lattice(n + 1) if {0, n} & {x, y, z}]


def icosphere(n):
    """An icosahedron, subdivided n times, on the unit sphere."""
    golden = (1 + math.sqrt(5)) / 2
    rectangle = list(product((1, -1), (golden, -golden)))
    points = [normalised(0, a, b) for a, b in rectangle]
    points += [normalised(b, 0, a) for a, b in rectangle] + [normalised(a, b, 0) for a, b in rectangle]
    # Corners that share an edge are 1.05 apart, others 1.7 or more.
    is_near = lambda face: all(math.dist(points[a], points[b]) < 1.2 for a, b in combinations(face, 2))
    faces = list(filter(is_near, combinations(range(12), 3)))
    for _ in range(n):
        middles = {}

        def middle(*edge):
            a, b = sorted(edge)
            if (a, b) not in middles:
                middles[a, b] = len(points)
                points.append(normalised(*map(sum, zip(points[a], points[b]))))
            return middles[a, b]

        finer = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    return points


def cylinder(n):
    """n rings of n points on a cylinder without caps, square in its unrolled steps."""
    step = math.tau / n
    return [(math.cos(k * step), math.sin(k * step), ring * step) for ring in range(n) for k in range(n)]


def plane(n):
    """A planar grid of n^2 points and an apex on either side."""
    return [(x / 100, y / 100, 0) for y in range(n) for x in range(n)] + [(0, 0, 1), (0, 0, -1)]


def line(n):
    """n points of a line and two next to it."""
    return [(k / 100, 2 * k / 100, 3 * k / 100) for k in range(n)] + [(0, 1, 0), (0, 0, 1)]


def moment(n):
    """n points of the moment curve, all pairs of which are edges."""
    return [(t, t * t, t * t * t) for t in (k / n for k in range(n))]


def cluster(n):
    """n points in clusters of very different size."""
    draw = random.Random(5).random
    return [tuple(draw() * 100.0 ** -(k % 8) + k % 3 for _ in range(3)) for k in range(n)]


SETS = {make.__name__: make for make in (
    cube, surface, sphere, lattice, box, icosphere, cylinder, plane, line, moment, cluster,
)}


def weights(kind, size):
    """Of random balls of about the points' distance; on degenerate sets all of one weight."""
    reach = {"cube": size ** (-1 / 3), "surface": 2 * size**-0.5, "sphere": 2 * size**-0.5}.get(kind)
    draw = random.Random(4).random
    while True:
        yield (reach * draw()) ** 2 if reach else 0.1


if len(sys.argv) != 3:
    sys.exit(__doc__)
name, file = sys.argv[1:]
kind, _, size = name.removeprefix("w:").partition("-")
if kind not in SETS or not size.isdecimal():
    sys.exit(f"unknown point set {name}")
weight = weights(kind, int(size))
rows = array.array("d")
for point in SETS[kind](int(size)):
    rows.extend((*point, next(weight) if name.startswith("w:") else 0))
with open(file, "wb") as out:
    rows.tofile(out)
