//! Generated solids with known topology, many with a known medial axis, and declared noise.
//!
//! Every mesh is closed, manifold, oriented outward, and generated: the same resolution gives the
//! same mesh. Vertices lie on the continuous surface that [`BuiltIn::summary`] describes, so they
//! are samples of it; the triangles between them are as close as the resolution makes them.
//!
//! ```
//! let torus = medial_datasets::find("torus").expect("a built-in shape");
//! let mesh = torus.mesh(torus.default_resolution);
//! assert_eq!(torus.expected_betti, [1, 1, 0]);
//! let axis = torus.axis().expect("the axis of a torus is a circle");
//! assert!(mesh.vertices.len() > 1000 && axis.tolerance < 1e-3);
//! ```

mod axes;
mod bisectors;
mod catalogue;
mod implicit;
mod noise;
mod profiles;
pub mod published;
mod shapes;
mod solids;

pub use bisectors::KnownAxis;
pub use catalogue::{BuiltIn, MAX_RESOLUTION, catalogue, find};
pub use noise::add_noise;

#[cfg(test)]
mod tests;

#[cfg(doctest)]
#[doc = include_str!("README.md")]
struct Readme;
