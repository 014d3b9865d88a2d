"""Meshes to and from trimesh and Open3D, if they are installed."""

from __future__ import annotations

from medial_axis import Mesh


def trimesh_round_trip() -> None:
    import trimesh

    mesh = Mesh(trimesh.creation.torus(1.0, 0.3), name="torus")
    union = mesh.medial_axis().simplify("qmat", spheres=60).reconstruct()
    back = union.to_trimesh()
    print(f"trimesh: {back.is_watertight=}, volume {back.volume / mesh.to_trimesh().volume:.2f} of the solid's")


def open3d_round_trip() -> None:
    import open3d

    mesh = Mesh(open3d.geometry.TriangleMesh.create_torus(1.0, 0.3), name="torus")
    union = mesh.medial_axis().simplify("qmat", spheres=60).reconstruct()
    back = union.to_open3d()
    print(f"Open3D: {back.is_watertight()=}, volume {back.get_volume() / mesh.to_open3d().get_volume():.2f} of the solid's")


for round_trip in (trimesh_round_trip, open3d_round_trip):
    try:
        round_trip()
    except ImportError as error:
        print(f"skipped: {error}")
