//! The shapes of the corpus: of the catalogue, and some that are made here.

use medial::Vec3;
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{self, TriMesh};

/// Two boxes, a diagonal apart.
pub const PARTS: &str = "pair of boxes";
/// A box whose thickness is a ten-thousandth of its length.
pub const PLATE: &str = "very thin plate";
/// Four vertices: one Delaunay cell.
pub const TETRAHEDRON: &str = "tetrahedron";
/// Eight vertices on one sphere: every triangulation of them is a degenerate one.
pub const CUBE: &str = "cube of eight vertices";

/// A shape of the corpus, in units that are `scale` times smaller.
pub fn scaled(name: &str, scale: f64) -> Shape {
    let mut mesh = mesh(name);
    mesh.vertices.iter_mut().for_each(|v| *v *= scale);
    let report = surface::validate(&mesh).expect("the shapes of the corpus are solids");
    Shape::new(name, &mesh, report, ShapeOptions::default()).expect("they have an extent")
}

/// A shape of the corpus.
pub fn shape(name: &str) -> Shape {
    scaled(name, 1.0)
}

fn mesh(name: &str) -> TriMesh {
    match name {
        PARTS => two(&built_in("box", 12)),
        PLATE => {
            let mut mesh = built_in("box", 12);
            mesh.vertices.iter_mut().for_each(|v| v.z *= 3e-4);
            mesh
        }
        TETRAHEDRON => solid(
            &[[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
            &[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
        ),
        CUBE => solid(
            &[
                [0, 0, 0],
                [1, 0, 0],
                [0, 1, 0],
                [1, 1, 0],
                [0, 0, 1],
                [1, 0, 1],
                [0, 1, 1],
                [1, 1, 1],
            ],
            &[
                [0, 2, 1],
                [1, 2, 3],
                [4, 5, 6],
                [5, 7, 6],
                [0, 1, 4],
                [1, 5, 4],
                [2, 6, 3],
                [3, 6, 7],
                [0, 4, 2],
                [2, 4, 6],
                [1, 3, 5],
                [3, 7, 5],
            ],
        ),
        id => {
            let shape = medial_datasets::find(id).expect("a shape of the catalogue");
            shape.mesh(shape.default_resolution)
        }
    }
}

fn built_in(id: &str, resolution: u32) -> TriMesh {
    medial_datasets::find(id).expect("a shape of the catalogue").mesh(resolution)
}

/// A mesh and a copy of it, moved by twice its width.
fn two(one: &TriMesh) -> TriMesh {
    let (low, high) = one.bounding_box().expect("it has vertices");
    let offset = Vec3::new(2.0 * (high.x - low.x), 0.0, 0.0);
    let count = one.vertices.len() as u32;
    let vertices = one.vertices.iter().copied();
    let faces = one.faces.iter().copied();
    TriMesh {
        vertices: vertices.clone().chain(vertices.map(|v| v + offset)).collect(),
        faces: faces.clone().chain(faces.map(|face| face.map(|i| i + count))).collect(),
    }
}

fn solid(vertices: &[[i32; 3]], faces: &[[u32; 3]]) -> TriMesh {
    let vertices = vertices.iter().map(|&v| Vec3::from_array(v.map(f64::from))).collect();
    TriMesh { vertices, faces: faces.to_vec() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shapes_made_here_are_what_they_are_called() {
        for (name, components, vertices) in
            [(PARTS, 2, None), (PLATE, 1, None), (TETRAHEDRON, 1, Some(4)), (CUBE, 1, Some(8))]
        {
            let shape = shape(name);
            assert_eq!(shape.expected_betti(), Some([components, 0, 0]), "{name}");
            assert!(vertices.is_none_or(|count| shape.mesh().vertices.len() == count), "{name}");
        }
    }
}
