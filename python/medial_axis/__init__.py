"""Simplify the 3D medial axis transform, and compare the published methods that do.

    import medial_axis

    mesh = medial_axis.Mesh.read("bear.off")
    axis = mesh.medial_axis().simplify("qmat", spheres=100)
    print(axis.evaluate())

Lengths are in the units of the mesh. Errors, and all inputs of your methods, are fractions of the bounding-box diagonal.
Arrays are n x 3 (points, float64; triangles, uint32, from 0). Arrays of an object are shared and read-only.
"""

from __future__ import annotations

from . import _medial
from ._medial import __version__
from .axis import MedialAxis, Run
from .comparison import Report, compare, load
from .errors import (
    CancelledError,
    FailedError,
    InputError,
    InternalError,
    MedialError,
    MedialWarning,
    ParameterError,
    UnsupportedError,
)
from .evaluation import Certificate, Counts, Evaluation, Spikes, TriangleQuality
from .mesh import Mesh
from .method import (
    Level,
    MethodInfo,
    NativeLevel,
    Param,
    RunContext,
    Shape,
    Simplified,
    methods,
    simplifier,
)
from .picture import Picture, render
from .points import Triangulation, betti, closest_points, signed_distance, triangulate

__all__ = [
    "CancelledError",
    "Certificate",
    "Counts",
    "Evaluation",
    "FailedError",
    "InputError",
    "InternalError",
    "Level",
    "MedialAxis",
    "MedialError",
    "MedialWarning",
    "Mesh",
    "MethodInfo",
    "NativeLevel",
    "Param",
    "ParameterError",
    "Picture",
    "Report",
    "Run",
    "RunContext",
    "Shape",
    "Simplified",
    "Spikes",
    "Triangulation",
    "TriangleQuality",
    "UnsupportedError",
    "__version__",
    "betti",
    "closest_points",
    "compare",
    "load",
    "methods",
    "render",
    "signed_distance",
    "simplifier",
    "triangulate",
]

del _medial
