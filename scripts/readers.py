"""Our .vtp and .glb files in the readers of VTK and trimesh; see readers.sh.

    readers.py MESH.ma FILE ...     compare what VTK (.vtp) and trimesh (.glb) read with the text of MESH.ma

Prints a line for each comparison; exit code 1 when one differs.
"""

import json
import sys

import numpy as np
import trimesh
import vtk
from vtk.util.numpy_support import vtk_to_numpy

failed = False


def say(what, agrees):
    global failed
    failed |= not agrees
    print(f"{'same' if agrees else 'DIFFERENT'}: {what}", flush=True)


def read_ma(file):
    spheres, edges, faces = [], [], []
    for line in open(file):
        word, *rest = line.split() or [""]
        if word == "v":
            spheres.append([float(x) for x in rest[:4]])
        elif word == "e":
            edges.append([int(x) for x in rest[:2]])
        elif word == "f":
            faces.append([int(x) for x in rest[:3]])
    return np.array(spheres).reshape(-1, 4), edges, faces


def lone_edges(edges, faces):
    sides = {tuple(sorted((f[i], f[j]))) for f in faces for i, j in ((0, 1), (0, 2), (1, 2))}
    return [tuple(e) for e in edges if tuple(e) not in sides]


def cells_of(array):
    ends = vtk_to_numpy(array.GetOffsetsArray())
    members = vtk_to_numpy(array.GetConnectivityArray())
    return [tuple(int(v) for v in members[a:b]) for a, b in zip(ends[:-1], ends[1:])]


def check_vtp(file, spheres, edges, faces):
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(file)
    reader.Update()
    data = reader.GetOutput()
    points = vtk_to_numpy(data.GetPoints().GetData())
    radii = vtk_to_numpy(data.GetPointData().GetArray("radius"))
    say(f"{file}: {len(points)} centres, bit for bit", points.dtype == float and np.array_equal(points, spheres[:, :3]))
    say(f"{file}: radii, bit for bit", np.array_equal(radii, spheres[:, 3]))
    lone = lone_edges(edges, faces)
    say(f"{file}: {len(lone)} edges without a face", sorted(cells_of(data.GetLines())) == sorted(lone))
    say(f"{file}: {len(faces)} faces", sorted(cells_of(data.GetPolys())) == sorted(tuple(f) for f in faces))
    single = set(range(len(spheres))) - {v for e in edges for v in e}
    say(f"{file}: {len(single)} spheres without an edge", {v for (v,) in cells_of(data.GetVerts())} == single)
    names = [data.GetPointData().GetArrayName(k) for k in range(data.GetPointData().GetNumberOfArrays())]
    active = data.GetPointData().GetScalars()
    say(f"{file}: arrays {names}, coloured by {active.GetName()}", active.GetName() == names[-1])


VIRIDIS = ["453781", "3D4E8A", "32668E", "287D8E", "1F958B", "29AF7F", "5CC863", "A8DB34", "FDE725"]


def viridis(place):
    table = np.array([[int(c[k : k + 2], 16) for k in (0, 2, 4)] for c in VIRIDIS]) / 255
    at = np.linspace(0, 1, len(table))
    srgb = np.stack([np.interp(place, at, table[:, k]) for k in range(3)], axis=1)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def indices_of(file, mode):
    """The indices of the primitives with a mode."""
    content = open(file, "rb").read()
    length = int.from_bytes(content[12:16], "little")
    tree, binary = json.loads(content[20 : 20 + length]), content[28 + length :]
    found = [np.empty(0, np.uint32)]
    for primitive in (p for mesh in tree["meshes"] for p in mesh["primitives"] if p["mode"] == mode):
        accessor = tree["accessors"][primitive["indices"]]
        start = tree["bufferViews"][accessor["bufferView"]]["byteOffset"]
        found.append(np.frombuffer(binary, "<u4", accessor["count"], start))
    return np.concatenate(found)


def check_glb(file, spheres, edges, faces):
    scene = trimesh.load_scene(file)
    meshes = [g for g in scene.geometry.values() if isinstance(g, trimesh.Trimesh)]
    sheets = [m for m in meshes if "_RADIUS" in m.vertex_attributes]
    lone = lone_edges(edges, faces)
    centres = np.stack((spheres[:, 0], spheres[:, 2], -spheres[:, 1]), axis=1).astype(np.float32)
    if faces:
        (sheet,) = sheets
        say(f"{file}: {len(centres)} centres in single precision, z up", np.array_equal(sheet.vertices.astype(np.float32), centres))
        radii = np.asarray(sheet.vertex_attributes["_RADIUS"]).ravel()
        say(f"{file}: radii in single precision", np.array_equal(radii, spheres[:, 3].astype(np.float32)))
        theirs = sorted(tuple(sorted(int(v) for v in f)) for f in sheet.faces)
        say(f"{file}: {len(faces)} faces", theirs == sorted(tuple(f) for f in faces))
        # With a material trimesh keeps them as an attribute: 16 bits of linear light.
        colours = np.asarray(sheet.visual.vertex_attributes["color"], float) / 65535
        extras = sheet.metadata
        say(f"{file}: extras {extras.get('colour_by')}, {extras.get('colour_low')} to {extras.get('colour_high')}",
            "colour_low" in extras and "unit" in extras)
        if extras.get("colour_by") == "radius":
            low, high = extras["colour_low"], extras["colour_high"]
            place = (spheres[:, 3] - low) / (high - low) if high > low else np.full(len(spheres), 0.5)
            off = np.abs(colours[:, :3] - viridis(place)).max()
            say(f"{file}: colours of the radii in linear light, within {off:.1e}", off <= 2e-5)
        elif extras.get("colour_by") == "stability":
            theirs = np.asarray(sheet.vertex_attributes["_STABILITY"]).ravel()
            off = np.abs(colours[:, :3] - viridis(theirs)).max()
            say(f"{file}: colours of the stability in linear light, within {off:.1e}", off <= 2e-5)
        say(f"{file}: opaque", bool((colours[:, 3] == 1).all()))
    # trimesh takes the indices of lines for 0, 1, 2, ...: by our own few lines of Python.
    drawn = {tuple(sorted(int(v) for v in e)) for e in indices_of(file, 1).reshape(-1, 2)}
    say(f"{file}: {len(lone)} edges without a face", drawn == set(lone))
    single = set(range(len(spheres))) - {v for e in edges for v in e}
    say(f"{file}: {len(single)} spheres without an edge", {int(v) for v in indices_of(file, 0)} == single)
    balls = [m for name, m in scene.geometry.items() if isinstance(m, trimesh.Trimesh) and m not in sheets]
    for body in balls:
        count = len(body.faces) // 80
        say(f"{file}: {count} spheres as bodies, outward", count == len(spheres) and body.volume > 0)
        middle = body.vertices.reshape(count, 42, 3)
        off = np.abs(np.linalg.norm(middle - centres[:, None], axis=2) - spheres[:, 3][:, None]).max()
        say(f"{file}: their vertices on the spheres, within {off:.1e}", off < 1e-5 * np.abs(centres).max())


file, *written = sys.argv[1:] or sys.exit(__doc__)
read = read_ma(file)
for other in written:
    (check_vtp if other.endswith(".vtp") else check_glb)(other, *read)
sys.exit(failed)
