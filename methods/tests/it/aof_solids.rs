//! What the tests of the average outward flux share: solids, and how a level is asked.

#![allow(dead_code)] // Each test uses some of it.

use medial::Vec3;
use medial::complex;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified, SimplifyError};
use medial::surface::{self, TriMesh};
use medial_methods::aof::{self, AofParams, LatticeVoxels, Solid, Surface};

pub fn shape_of(mesh: &TriMesh) -> Shape {
    let report = surface::validate(mesh).expect("a solid");
    Shape::new("shape", mesh, report, ShapeOptions::default()).expect("an extent")
}

pub fn built_in(id: &str) -> Shape {
    let shape = medial_datasets::find(id).expect("in the catalogue");
    shape_of(&shape.mesh(shape.default_resolution))
}

pub fn solid<'s>(shape: &'s Shape, params: &AofParams) -> Solid<'s> {
    Solid::new(shape, Surface::of(shape), params.clone(), RunContext::default())
}

/// A box with half sides `half`, as twelve triangles.
pub fn cuboid(half: Vec3) -> TriMesh {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        half * Vec3::new(side(0), side(1), side(2))
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriMesh {
        vertices: (0..8).map(corner).collect(),
        faces: quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}

pub const HALF: Vec3 = Vec3::new(1.5, 1.0, 0.5);

pub fn simplified(
    shape: &Shape,
    set: &[(&str, &str)],
    level: Level,
) -> Result<Simplified, SimplifyError> {
    let mut params = Params::none();
    set.iter().for_each(|(key, value)| params.set(key, value));
    aof::method().prepare(shape, &params, &RunContext::default())?.at(level)
}

/// Bytes of a result: everything that is written.
pub fn bytes_of(result: &Simplified) -> Vec<u64> {
    let ball = |s: &complex::Sphere| [s.centre.x, s.centre.y, s.centre.z, s.radius];
    let simplices = result.mesh.edges.iter().flatten().chain(result.mesh.faces.iter().flatten());
    let voxels = result.extras.get::<LatticeVoxels>().into_iter().flat_map(|voxels| &voxels.voxels);
    let balls = result.mesh.spheres.iter().flat_map(ball).map(f64::to_bits);
    balls
        .chain(simplices.map(|&v| u64::from(v)))
        .chain(voxels.flat_map(|v| [v.distance.to_bits(), v.flux.to_bits()]))
        .collect()
}
