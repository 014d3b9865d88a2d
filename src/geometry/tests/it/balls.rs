//! Balls for the tests of dual complexes.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::collections::BTreeSet;

use medial_geometry::dual_complex::Simplices;
use medial_geometry::{DualComplex, Sphere, Vec3};
use rand::RngExt;
use rand_pcg::Pcg64;

/// Their dual complex, checked.
pub fn checked(balls: &[Sphere]) -> DualComplex<'static> {
    let complex = DualComplex::of_balls(balls).expect("admissible balls");
    complex.check().expect("a simplicial complex with consistent classes");
    assert_eq!(complex.ball_count(), balls.len());
    complex
}

/// A ball.
pub fn ball(x: f64, y: f64, z: f64, r: f64) -> Sphere {
    Sphere::new(Vec3::new(x, y, z), r)
}

/// A point of the cube from -1 to 1.
pub fn unit(rng: &mut Pcg64) -> Vec3 {
    let mut x = || rng.random_range(-1.0..1.0);
    Vec3::new(x(), x(), x())
}

pub fn as_set(s: &Simplices) -> BTreeSet<Vec<usize>> {
    fn own<const N: usize>(list: &[[u32; N]]) -> impl Iterator<Item = Vec<usize>> + '_ {
        list.iter().map(|s| s.iter().map(|&i| i as usize).collect())
    }
    let vertices = s.vertices.iter().map(|&v| vec![v as usize]);
    vertices.chain(own(&s.edges)).chain(own(&s.triangles)).chain(own(&s.tetrahedra)).collect()
}
