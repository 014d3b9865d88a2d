"""Makes the meshes of this folder. Needs numpy, manifold3d and fast-simplification:

    python3 tests/meshes/make.py        # writes body.off, part.off and figure.off in three minutes

Organic surfaces are the zero sets of blended balls with smooth noise, triangulated by manifold3d and decimated by
quadrics, so that their triangles are as irregular as those of a decimated scan. The part is a solid of boxes and
cylinders. Versions of the packages change the triangles; the tests take the files as they are.
"""

import pathlib

import fast_simplification
import manifold3d
import numpy

HERE = pathlib.Path(__file__).parent
RANDOM = numpy.random.default_rng(7)
WAVES = [(RANDOM.normal(size=3) * f, RANDOM.uniform(0, 6.3), 1 / f) for f in (2, 2, 4, 4, 4, 7, 7, 7)]


def noise(p):
    return sum(a * numpy.sin(p @ w + phase) for w, phase, a in WAVES)


def capsule(p, a, b, ra, rb):
    """Signed distance to a tapered capsule, negative inside."""
    a, b = numpy.array(a), numpy.array(b)
    t = numpy.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return numpy.linalg.norm(p - a - t * (b - a)) - (ra + t * (rb - ra))


def blended(p, parts, width):
    """Smooth union of capsules."""
    distances = numpy.array([capsule(p, *part) for part in parts])
    least = distances.min()
    return least - width * numpy.log(numpy.exp(-(distances - least) / width).sum())


def organic(parts, rough, edge, vertices, size):
    field = lambda x, y, z: -(blended(numpy.array([x, y, z]), parts, 0.04) + rough * noise(numpy.array([x, y, z])))
    solid = manifold3d.Manifold.level_set(field, [-size] * 3 + [size] * 3, edge)
    largest = max(solid.decompose(), key=lambda piece: piece.volume())
    mesh = largest.to_mesh()
    points = numpy.array(mesh.vert_properties[:, :3], dtype=float, order="C")
    faces = numpy.array(mesh.tri_verts, dtype=numpy.int32, order="C")
    share = 1 - vertices / len(points)
    return fast_simplification.simplify(points, faces, target_reduction=share)


def body():
    """A torso with head, folds and scan-like noise; no loop."""
    parts = [
        ((0, 0, -0.5), (0, 0, 0.25), 0.42, 0.33), ((0, 0, 0.3), (0.05, 0, 0.75), 0.16, 0.24),
        ((-0.3, 0, 0.2), (-0.62, 0.12, -0.2), 0.15, 0.1), ((0.3, 0, 0.2), (0.6, 0.25, 0.1), 0.15, 0.09),
        ((0.08, 0.2, 0.72), (0.1, 0.34, 0.7), 0.07, 0.04),
    ]
    return organic(parts, 0.025, 0.05, 2400, 1.3)


def figure():
    """A figure with limbs, an arm on its hip and a tail that ends at its back: two loops."""
    parts = [
        ((0, 0, -0.1), (0, 0, 0.35), 0.2, 0.17), ((0, 0, 0.4), (0, 0.03, 0.68), 0.08, 0.14),
        ((-0.1, 0, -0.15), (-0.25, 0.05, -0.85), 0.11, 0.07), ((0.1, 0, -0.15), (0.22, 0, -0.85), 0.11, 0.07),
        ((0.15, 0, 0.33), (0.6, 0.05, 0.2), 0.08, 0.06), ((0.6, 0.05, 0.2), (0.15, 0.03, -0.1), 0.06, 0.06),
        ((-0.15, 0, 0.33), (-0.75, 0.2, 0.55), 0.08, 0.04),
        ((0, -0.15, -0.1), (0, -0.6, 0), 0.07, 0.06), ((0, -0.6, 0), (0, -0.5, 0.35), 0.06, 0.05),
        ((0, -0.5, 0.35), (0, -0.12, 0.35), 0.05, 0.05),
    ]
    return organic(parts, 0.008, 0.035, 2400, 1.2)


def part():
    """A housing with thin walls, ribs, a boss and through holes: sharp edges, triangles of many sizes."""
    cube, cylinder = manifold3d.Manifold.cube, manifold3d.Manifold.cylinder
    drill = lambda x, y, r, n: cylinder(1, r, r, n).translate([x, y, -0.4])
    solid = cube([2, 1.2, 0.5]) - cube([1.88, 1.08, 0.5]).translate([0.06, 0.06, 0.06])
    solid += cube([0.05, 1.1, 0.3]).translate([0.7, 0.05, 0.03]) + cube([1.9, 0.05, 0.2]).translate([0.05, 0.75, 0.03])
    solid += cylinder(0.45, 0.2, 0.17, 40).translate([1.4, 0.4, 0.03])
    for x, y, r, n in [(1.4, 0.4, 0.1, 32), (0.3, 0.3, 0.12, 28), (0.3, 0.95, 0.08, 24), (1.05, 0.98, 0.06, 20)]:
        solid -= drill(x, y, r, n)
    solid -= cylinder(3, 0.09, 0.09, 24).rotate([0, 90, 0]).translate([-0.5, 0.45, 0.3])
    mesh = solid.refine_to_length(0.17).to_mesh()
    points = numpy.asarray(mesh.vert_properties[:, :3], dtype=float)
    return points, numpy.asarray(mesh.tri_verts)


def write(name, points, faces):
    lines = ["OFF", f"{len(points)} {len(faces)} 0"]
    lines += [" ".join(f"{x:.5f}".rstrip("0").rstrip(".") for x in point) for point in points]
    lines += ["3 " + " ".join(map(str, face)) for face in faces]
    (HERE / name).write_text("\n".join(lines) + "\n")


write("body.off", *body())
write("figure.off", *figure())
write("part.off", *part())
