"""Measures a certificate's witness again, without any of the program's code.

    witness.py MESH AXIS.ma EVALUATION.json

Prints two fractions of the diagonal: how far the witness is off the surface that it should be on, and its
distance from the other one. The word `inside` follows where the witness is on the surface and in the union. The distance is
then the depth in one primitive, which can be less than that to the union's boundary. Distances to cones and slabs are minima over their balls, which are convex: found
by golden sections. Plain Python: no package is needed.
"""

import json
import math
import sys

GOLDEN = (math.sqrt(5) - 1) / 2


def read_surface(file):
    words = [line.split("#")[0].split() for line in open(file)]
    words = [line for line in words if line]
    if file.endswith(".obj"):
        points = [tuple(map(float, line[1:4])) for line in words if line[0] == "v"]
        faces = [[int(w.split("/")[0]) - 1 for w in line[1:]] for line in words if line[0] == "f"]
    else:
        numbers = [w for line in words for w in line][1:]
        n, m = int(numbers[0]), int(numbers[1])
        points = [tuple(map(float, numbers[3 + 3 * k : 6 + 3 * k])) for k in range(n)]
        at, faces = 3 + 3 * n, []
        for _ in range(m):
            size = int(numbers[at])
            faces.append([int(w) for w in numbers[at + 1 : at + 1 + size]])
            at += 1 + size
    return points, [[f[0], f[k], f[k + 1]] for f in faces for k in range(1, len(f) - 1)]


def read_axis(file):
    balls, edges, faces = [], [], []
    for line in open(file):
        kind, *rest = line.split() or [""]
        if kind == "v":
            balls.append(tuple(map(float, rest[:4])))
        elif kind in ("e", "f"):
            (edges if kind == "e" else faces).append([int(w) for w in rest])
    return balls, edges, faces


def minus(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def to_triangle(p, a, b, c):
    """Distance by the regions of the triangle's plane."""
    normal = cross(minus(b, a), minus(c, a))
    if dot(normal, normal) > 0 and all(
        dot(cross(minus(v, u), minus(p, u)), normal) >= 0 for u, v in ((a, b), (b, c), (c, a))
    ):
        return abs(dot(minus(p, a), normal)) / math.sqrt(dot(normal, normal))
    return min(to_segment(p, u, v) for u, v in ((a, b), (b, c), (c, a)))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def to_segment(p, u, v):
    along, from_u = minus(v, u), minus(p, u)
    square = dot(along, along)
    t = min(1.0, max(0.0, dot(from_u, along) / square)) if square > 0 else 0.0
    return math.dist(p, [x + t * y for x, y in zip(u, along)])


def to_ball(p, ball):
    return math.dist(p, ball[:3]) - ball[3]


def between(a, b, t):
    return [x + t * (y - x) for x, y in zip(a, b)]


def least(f):
    """Minimum of a convex function over 0 to 1."""
    low, high = 0.0, 1.0
    s, t = high - GOLDEN, low + GOLDEN
    at_s, at_t = f(s), f(t)
    for _ in range(60):
        if at_s < at_t:
            high, t, at_t = t, s, at_s
            s = high - GOLDEN * (high - low)
            at_s = f(s)
        else:
            low, s, at_s = s, t, at_t
            t = low + GOLDEN * (high - low)
            at_t = f(t)
    return min(f(0.0), f(1.0), at_s, at_t)


def signed(p, balls, edges, faces):
    best = min(to_ball(p, ball) for ball in balls)

    def can_be_nearer(ids):
        # No ball of the primitive is nearer than its first one by more than its extent.
        first = balls[ids[0]]
        extent = max(math.dist(first[:3], balls[k][:3]) + abs(balls[k][3] - first[3]) for k in ids)
        return to_ball(p, first) - extent < best

    for a, b in edges:
        if can_be_nearer([a, b]):
            best = min(best, least(lambda t: to_ball(p, between(balls[a], balls[b], t))))
    for a, b, c in faces:
        if can_be_nearer([a, b, c]):

            def across(s):
                u, v = between(balls[a], balls[b], s), between(balls[a], balls[c], s)
                return least(lambda t: to_ball(p, between(u, v, t)))

            best = min(best, least(across))
    return best


def main():
    surface_file, axis_file, evaluation = sys.argv[1:4]
    found = json.load(open(evaluation))
    witness, diagonal = found["certified"]["witness"], found["diagonal"]
    p = witness["point"]
    points, faces = read_surface(surface_file)
    to_surface = min(to_triangle(p, *(points[k] for k in face)) for face in faces) / diagonal
    to_union = signed(p, *read_axis(axis_file)) / diagonal
    side = "inside" if witness["on"] == "surface" and to_union < 0 else "outside"
    off, distance = (
        (to_surface, abs(to_union)) if witness["on"] == "surface" else (abs(to_union), to_surface)
    )
    print(f"{off:.12g} {distance:.12g} {side}")


main()
