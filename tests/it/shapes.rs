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

/// The boundary of the solid cells of a grid between planes: a square of two triangles, outward, between each of them
/// and what is not solid, in the order of the cells.
pub fn cells(planes: &[Vec<f64>; 3], is_solid: impl Fn([usize; 3]) -> bool) -> TriMesh {
    let counts = planes.each_ref().map(|planes| planes.len() - 1);
    let is_solid = |cell: [usize; 3]| (0..3).all(|k| cell[k] < counts[k]) && is_solid(cell);
    let (mut ids, mut mesh) = (HashMap::new(), TriMesh::default());
    for index in 0..counts.iter().product() {
        let cell =
            [index / counts[2] / counts[1], index / counts[2] % counts[1], index % counts[2]];
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut other = cell;
            // Below 0 is a huge number, which is no cell.
            other[axis] = (cell[axis] + 2 * side).wrapping_sub(1);
            if !is_solid(cell) || is_solid(other) {
                continue;
            }
            let mut square = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                let mut corner = cell;
                corner[axis] += side;
                corner[(axis + 1) % 3] += u;
                corner[(axis + 2) % 3] += v;
                *ids.entry(corner).or_insert_with(|| {
                    mesh.vertices.push(Vec3::from([0, 1, 2].map(|k| planes[k][corner[k]])));
                    mesh.vertices.len() as u32 - 1
                })
            });
            if side == 0 {
                square.reverse();
            }
            let [a, b, c, d] = square;
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The unit cube with `n` by `n` squares of two triangles on each side.
pub fn lattice_cube(n: u32) -> TriMesh {
    let planes = || (0..=n).map(|k| f64::from(k) / f64::from(n)).collect();
    cells(&[planes(), planes(), planes()], |_| true)
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
