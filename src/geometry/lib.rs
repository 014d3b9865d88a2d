//! Exact triangulations of points and balls, and exact distances to what balls span.
//!
//! | module or type | holds |
//! |---|---|
//! | [`Delaunay`], [`Regular`] | triangulations of any points, degenerate ones too, with or without weights |
//! | [`DualComplex`], [`UnionBoundary`] | the alpha complex of balls, and the vertices of their union's boundary |
//! | [`Poles`], [`PowerCrust`] | polar balls of a sample, and the surface between inner and outer balls |
//! | [`Sphere`], [`Cone`], [`Slab`] | signed distances to a ball and to the hulls of two and of three |
//! | [`TriangleTree`] | the triangles that cross another one, beyond common vertices and edges |
//! | [`trees::PointTree`] | the nearest point, and the points within a distance |
//! | [`trees`] | box trees for your own searches: best first, overlapping, four boxes at a time |
//! | [`predicates`] | signs that no rounding can turn |
//!
//! Coordinates are `f64`, in any one unit; every sign that a decision depends on is computed exactly, and
//! ties are broken by symbolic perturbation, so that four points on a circle or all points of a lattice are
//! no special case.
//!
//! Large inputs are divided among the threads of rayon's pool: that in which a function is called
//! (`ThreadPool::install`), else the global one, whose number of threads the environment variable
//! `RAYON_NUM_THREADS` sets. The same input gives the same output with any number of threads.
//!
//! ```
//! use medial_geometry::{Delaunay, Vec3};
//!
//! // The corners of a cube: one sphere through all eight.
//! let corners: Vec<Vec3> = (0..8)
//!     .map(|k| Vec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64))
//!     .collect();
//! let delaunay = Delaunay::new(&corners)?;
//! let volume: f64 = delaunay
//!     .finite_cells()
//!     .map(|cell| {
//!         let [a, b, c, d] = delaunay.vertices(cell).map(|v| delaunay.point(v));
//!         (b - a).cross(c - a).dot(d - a).abs() / 6.0
//!     })
//!     .sum();
//! assert!((volume - 1.0).abs() < 1e-15);
//! # Ok::<(), medial_geometry::TriangulationError>(())
//! ```

/// A hash of the sources of this crate.
pub const SOURCE_HASH: &str = env!("SOURCE_HASH");

pub mod delaunay;
mod disjoint;
pub mod dual_complex;
mod enclosing;
pub mod planar_frame;
pub mod poles;
pub mod predicates;
pub mod regular;
mod sphere;
pub mod trees;
mod triangles_meet;
pub mod triangulation;
pub mod union_boundary;

/// A hash of numbers, the same on every machine.
pub mod hash {
    use std::hash::Hasher;

    /// The finaliser of SplitMix64, whose high and low bits both mix: G. L. Steele, D. Lea, C. H. Flood:
    /// *Fast splittable pseudorandom number generators*, OOPSLA 2014, doi:10.1145/2660193.2660195.
    #[inline]
    pub fn splitmix(number: u64) -> u64 {
        let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Spreads keys over the table; there is no adversary.
    #[derive(Default)]
    pub struct KeyHasher(u64);

    impl Hasher for KeyHasher {
        fn finish(&self) -> u64 {
            self.0
        }

        fn write(&mut self, bytes: &[u8]) {
            bytes.iter().for_each(|&b| self.write_u64(self.0 ^ u64::from(b)));
        }

        fn write_u64(&mut self, key: u64) {
            self.0 = splitmix(key);
        }
    }
}

pub use delaunay::Delaunay;
pub use disjoint::DisjointSets;
pub use dual_complex::DualComplex;
pub use enclosing::enclosing_ball;
pub use poles::{PolarBall, Pole, Poles, PowerCrust, SamplePoles};
pub use regular::Regular;
pub use sphere::{Cone, ConeFrame, Slab, SlabFace, SlabPlanes, Sphere, separation_angle};
pub use triangles_meet::{TriangleTree, triangles_cross, triangles_meet};
pub use triangulation::{CellId, TriangulationError, VertexId};
pub use union_boundary::{UnionBoundary, UnionVertex};

/// The crate of [`Vec3`], in the version that this crate uses.
pub use glam;

/// A point or a vector in space, double precision: `DVec3` of [`glam`] 0.34, with all its methods.
pub type Vec3 = glam::DVec3;

#[cfg(doctest)]
#[doc = include_str!("README.md")]
struct Readme;
