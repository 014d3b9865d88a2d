//! Binary glTF 2.0 (`.glb`), which viewers, browsers and Blender show as it is.
//!
//! One mesh `medial axis`, whose primitives share their vertices, the spheres: all faces as triangles, edges *without
//! a face* as lines, spheres without an edge as points. A vertex has its position, a normal, a colour (`COLOR_0`,
//! linear light), the radius (`_RADIUS`) and, where coloured by something else, that (`_STABILITY`, `_ERROR`). What
//! the colours mean stands in the mesh's `extras`. Where asked, a second mesh `spheres` holds the spheres as round
//! bodies ([`balls`]).
//!
//! - Coordinates are turned to glTF's `y` up, and back when read ([`crate::glb`]); Blender shows those of `.ma`.
//! - glTF has single precision only: coordinates and radii are rounded to the nearest `f32`, by at most 6e-8 of their
//!   size ([`single_precision_loss`]). What is too large for it is refused.
//! - Sheets have two sides and may meet in threes, so that a smooth normal is a compromise where they do. Faces are
//!   turned alike across edges of two faces; the normal of a vertex is the sum of its faces' area vectors, each on
//!   the side of the largest.
//! - Read is what has `_RADIUS`. Other programs repeat vertices where normals differ, and have vertices of their own
//!   for lines: in files that this crate did not write, spheres that are equal bit for bit are one.

mod balls;
mod normals;
mod read;
mod write;

pub use read::parse_glb;
pub(super) use write::file;
pub use write::single_precision_loss;

#[cfg(test)]
mod tests;
