//! Small closed meshes for the tests of surfaces.

#![allow(dead_code)] // Each test uses some of them.

use std::collections::HashMap;
use std::f64::consts::TAU;

use medial::Vec3;
use medial::surface::TriMesh;

/// An axis-parallel box of 12 triangles, outward.
pub fn cuboid(lo: Vec3, hi: Vec3) -> TriMesh {
    let corner = |i: u32| {
        let pick = |bit: u32, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
        Vec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z))
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { vertices: (0..8).map(corner).collect(), faces }
}

/// The cube `[0, 1]^3`.
pub fn cube() -> TriMesh {
    cuboid(Vec3::ZERO, Vec3::ONE)
}

/// A unit sphere: an octahedron whose faces were quartered `level` times.
pub fn sphere(level: usize) -> TriMesh {
    let mut vertices = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let mut faces = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut quarters = Vec::new();
        for [a, b, c] in faces {
            let [d, e, f] = [[a, b], [b, c], [c, a]].map(|[i, j]: [u32; 2]| {
                *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                    let middle = (vertices[i as usize] + vertices[j as usize]).normalize();
                    vertices.push(middle);
                    vertices.len() as u32 - 1
                })
            });
            quarters.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
        faces = quarters;
    }
    TriMesh { vertices, faces }
}

/// The unit cube with `n` by `n` squares of two triangles on each side.
pub fn lattice_cube(n: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut known = HashMap::new();
    for axis in 0..3 {
        for side in [0, n] {
            for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                let mut quad = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(u, v)| {
                    let mut p = [0; 3];
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, i + u, j + v);
                    *known.entry(p).or_insert_with(|| {
                        mesh.vertices.push(Vec3::from(p.map(f64::from)) / f64::from(n));
                        mesh.vertices.len() as u32 - 1
                    })
                });
                if side == 0 {
                    quad.reverse();
                }
                let [a, b, c, d] = quad;
                mesh.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}

/// A torus around the z axis with radii 2 and 1.
pub fn torus(around: u32, along: u32) -> TriMesh {
    torus_of([2.0, 1.0], around, along)
}

/// A torus around the z axis with the radii of its circle and of its tube.
pub fn torus_of([circle, tube]: [f64; 2], around: u32, along: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    let id = |i: u32, j: u32| (i % around) * along + j % along;
    for (i, j) in (0..around).flat_map(|i| (0..along).map(move |j| (i, j))) {
        let (a, b) =
            (f64::from(i) / f64::from(around) * TAU, f64::from(j) / f64::from(along) * TAU);
        let r = circle + tube * b.cos();
        mesh.vertices.push(Vec3::new(r * a.cos(), r * a.sin(), tube * b.sin()));
        mesh.faces.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
        mesh.faces.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
    }
    mesh
}

/// The mesh with its faces turned over.
pub fn inverted(mut mesh: TriMesh) -> TriMesh {
    mesh.faces.iter_mut().for_each(|face| face.swap(1, 2));
    mesh
}

/// The mesh with every position replaced.
pub fn moved(mut mesh: TriMesh, by: impl Fn(Vec3) -> Vec3) -> TriMesh {
    mesh.vertices.iter_mut().for_each(|v| *v = by(*v));
    mesh
}

/// All meshes as one.
pub fn joined(meshes: &[TriMesh]) -> TriMesh {
    let mut all = TriMesh::default();
    for mesh in meshes {
        let offset = all.vertices.len() as u32;
        all.vertices.extend(&mesh.vertices);
        all.faces.extend(mesh.faces.iter().map(|face| face.map(|v| v + offset)));
    }
    all
}

/// The mesh as OFF text.
pub fn to_off(mesh: &TriMesh) -> String {
    let mut text = format!("OFF\n{} {} 0\n", mesh.vertices.len(), mesh.faces.len());
    for v in &mesh.vertices {
        text += &format!("{:?} {:?} {:?}\n", v.x, v.y, v.z);
    }
    for [a, b, c] in &mesh.faces {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}
