//! The list of built-in shapes.

use medial::surface::TriMesh;
use serde::Serialize;

use crate::axes::{self, KnownAxis};
use crate::shapes;

/// Finest resolution that is generated: some four million vertices.
pub const MAX_RESOLUTION: u32 = 2000;

/// A generated solid.
#[derive(Clone, Debug, Serialize)]
pub struct BuiltIn {
    /// Short name for the command line, such as `rounded-box`.
    pub id: &'static str,
    /// Name for tables.
    pub title: &'static str,
    /// One sentence: the shape, its dimensions, what it is good for.
    pub summary: &'static str,
    /// Components, total genus and cavities of the solid, which its medial axis shares.
    pub expected_betti: [u64; 3],
    /// Resolution at which the shape has one to three thousand vertices.
    pub default_resolution: u32,
    /// Coarsest resolution that still shows every feature.
    pub min_resolution: u32,
    #[serde(skip)]
    pub(crate) generate: fn(f64) -> TriMesh,
    #[serde(skip)]
    pub(crate) known_axis: Option<fn() -> KnownAxis>,
    /// Bounding-box diagonal of the continuous shape, in its own unit.
    pub diagonal: f64,
    /// Whether a comparison takes it where no mesh is named.
    pub in_default: bool,
}

impl BuiltIn {
    /// The surface with edges of about `diagonal / resolution`, the diagonal being that of the
    /// bounding box: doubling the resolution gives about four times as many vertices.
    ///
    /// The resolution is brought into `min_resolution..=MAX_RESOLUTION`. Small features may carry
    /// shorter edges, since every straight or round part is divided evenly.
    pub fn mesh(&self, resolution: u32) -> TriMesh {
        let resolution = resolution.clamp(self.min_resolution, MAX_RESOLUTION);
        (self.generate)(self.diagonal / f64::from(resolution))
    }

    /// The resolutions that [`BuiltIn::mesh`] takes as they are.
    pub fn resolutions(&self) -> std::ops::RangeInclusive<u32> {
        self.min_resolution..=MAX_RESOLUTION
    }

    /// The medial axis where it is known in closed form.
    pub fn axis(&self) -> Option<KnownAxis> {
        self.known_axis.map(|axis| axis())
    }
}

/// The built-in shape with this id.
pub fn find(id: &str) -> Option<BuiltIn> {
    catalogue().into_iter().find(|shape| shape.id == id)
}

/// All built-in shapes, from simple to intricate.
pub fn catalogue() -> Vec<BuiltIn> {
    let mut shapes = [convex(), tubular(), intricate()].concat();
    shapes.extend(features());
    shapes.extend(parts());
    shapes
}

/// Convex solids.
fn convex() -> [BuiltIn; 5] {
    [
        BuiltIn {
            id: "sphere",
            title: "Sphere",
            summary: "Unit sphere on a geodesic grid; its axis is one point.",
            expected_betti: [1, 0, 0],
            default_resolution: 40,
            min_resolution: 8,
            generate: shapes::sphere,
            known_axis: Some(axes::sphere),
            diagonal: shapes::SPHERE_DIAGONAL,
            in_default: true,
        },
        BuiltIn {
            id: "ellipsoid",
            title: "Ellipsoid",
            summary: "Semi-axes 1, 0.7, 0.45; its axis is a flat elliptic disc with a smooth rim.",
            expected_betti: [1, 0, 0],
            default_resolution: 40,
            min_resolution: 8,
            generate: shapes::ellipsoid,
            known_axis: Some(axes::ellipsoid),
            diagonal: shapes::ellipsoid_diagonal(),
            in_default: true,
        },
        BuiltIn {
            id: "box",
            title: "Box",
            summary: "3 by 2 by 1 on regular grids, sharp edges sampled; 13 flat sheets, known exactly.",
            expected_betti: [1, 0, 0],
            default_resolution: 30,
            min_resolution: 8,
            generate: shapes::cuboid,
            known_axis: Some(axes::cuboid),
            diagonal: shapes::diagonal_of(shapes::BOX_HALF),
            in_default: true,
        },
        BuiltIn {
            id: "rounded-box",
            title: "Rounded box",
            summary: "2 by 1.2 by 0.5 grown by 0.25; the axis of the core box with larger radii.",
            expected_betti: [1, 0, 0],
            default_resolution: 32,
            min_resolution: 12,
            generate: shapes::rounded_box,
            known_axis: Some(axes::rounded_box),
            diagonal: shapes::diagonal_of(shapes::rounded_half()),
            in_default: true,
        },
        BuiltIn {
            id: "plate",
            title: "Thin plate",
            summary: "2 by 1.5 by 0.1: nearly all of the axis is one sheet, and spikes are thin.",
            expected_betti: [1, 0, 0],
            default_resolution: 40,
            min_resolution: 25,
            generate: shapes::plate,
            known_axis: Some(axes::plate),
            diagonal: shapes::diagonal_of(shapes::PLATE_HALF),
            in_default: true,
        },
    ]
}

/// Several parts or tubes: the axis has curves, or sheets that meet.
fn tubular() -> [BuiltIn; 5] {
    [
        BuiltIn {
            id: "bracket",
            title: "L-bracket",
            summary: "Two plates of 0.4 at a right angle: convex edges and one reflex edge.",
            expected_betti: [1, 0, 0],
            default_resolution: 32,
            min_resolution: 8,
            generate: shapes::bracket,
            known_axis: Some(axes::bracket),
            diagonal: shapes::bracket_diagonal(),
            in_default: true,
        },
        BuiltIn {
            id: "capsule",
            title: "Capsule",
            summary: "Cylinder of radius 0.4 with round ends; its axis is one segment.",
            expected_betti: [1, 0, 0],
            default_resolution: 36,
            min_resolution: 10,
            generate: shapes::capsule,
            known_axis: Some(axes::capsule),
            diagonal: shapes::capsule_diagonal(),
            in_default: true,
        },
        BuiltIn {
            id: "rod",
            title: "Cone-ended rod",
            summary: "Cylinder of radius 0.4 with conical ends of 45 degrees; a segment and two cones.",
            expected_betti: [1, 0, 0],
            default_resolution: 36,
            min_resolution: 10,
            generate: shapes::rod,
            known_axis: Some(axes::rod),
            diagonal: shapes::rod_diagonal(),
            in_default: true,
        },
        BuiltIn {
            id: "pair",
            title: "Ball and capsule",
            summary: "Two separate bodies: the axis is a point and a segment.",
            expected_betti: [2, 0, 0],
            default_resolution: 50,
            min_resolution: 20,
            generate: shapes::pair,
            known_axis: Some(axes::pair),
            diagonal: shapes::pair_diagonal(),
            in_default: true,
        },
        BuiltIn {
            id: "torus",
            title: "Torus",
            summary: "Radii 1 and 0.4 on a regular grid; its axis is a circle.",
            expected_betti: [1, 1, 0],
            default_resolution: 36,
            min_resolution: 16,
            generate: shapes::torus,
            known_axis: Some(axes::torus),
            diagonal: shapes::torus_diagonal(),
            in_default: true,
        },
    ]
}

/// Cavities, several loops, surfaces without corners.
fn intricate() -> [BuiltIn; 5] {
    [
        BuiltIn {
            id: "coil",
            title: "Coiled pipe",
            summary: "Two turns of a pipe with round ends and a narrow gap; its axis is a helix.",
            expected_betti: [1, 0, 0],
            default_resolution: 34,
            min_resolution: 28,
            generate: shapes::coil,
            known_axis: Some(axes::coil),
            diagonal: shapes::coil_diagonal(),
            in_default: true,
        },
        BuiltIn {
            id: "hollow-sphere",
            title: "Hollow sphere",
            summary: "Between spheres of radii 1 and 0.5; its axis is the sphere of radius 0.75.",
            expected_betti: [1, 0, 1],
            default_resolution: 36,
            min_resolution: 16,
            generate: shapes::hollow_sphere,
            known_axis: Some(axes::hollow_sphere),
            diagonal: shapes::SPHERE_DIAGONAL,
            in_default: true,
        },
        BuiltIn {
            id: "double-torus",
            title: "Double torus",
            summary: "Two blended tori side by side, genus 2, from an implicit function.",
            expected_betti: [1, 2, 0],
            default_resolution: 44,
            min_resolution: 30,
            generate: shapes::double_torus,
            known_axis: None,
            diagonal: shapes::DOUBLE_TORUS_DIAGONAL,
            in_default: true,
        },
        BuiltIn {
            id: "frame",
            title: "Tetrahedral frame",
            summary: "The six edges of a tetrahedron as blended tubes, genus 3.",
            expected_betti: [1, 3, 0],
            default_resolution: 36,
            min_resolution: 30,
            generate: shapes::frame,
            known_axis: None,
            diagonal: shapes::FRAME_DIAGONAL,
            in_default: true,
        },
        BuiltIn {
            id: "blob",
            title: "Blob",
            summary: "A smooth body with head, tail and four limbs, from an implicit function.",
            expected_betti: [1, 0, 0],
            default_resolution: 46,
            min_resolution: 30,
            generate: shapes::blob,
            known_axis: None,
            diagonal: shapes::BLOB_DIAGONAL,
            in_default: true,
        },
    ]
}

/// Convex solids and tubes with an axis that is known exactly, beside those that a comparison takes.
fn features() -> [BuiltIn; 4] {
    [
        BuiltIn {
            id: "wedge",
            title: "Wedge",
            summary: "Triangular prism with edges of 40 and 70 degrees; nine flat sheets, known exactly.",
            expected_betti: [1, 0, 0],
            default_resolution: 30,
            min_resolution: 8,
            generate: shapes::wedge,
            known_axis: Some(axes::wedge),
            diagonal: shapes::wedge_diagonal(),
            in_default: false,
        },
        BuiltIn {
            id: "frustum",
            title: "Cone frustum",
            summary: "Radii 0.8 and 0.4, height 2, sharp creases; its axis is a segment and two cones.",
            expected_betti: [1, 0, 0],
            default_resolution: 34,
            min_resolution: 10,
            generate: shapes::frustum,
            known_axis: Some(axes::frustum),
            diagonal: shapes::frustum_diagonal(),
            in_default: false,
        },
        BuiltIn {
            id: "chain",
            title: "Chain of balls",
            summary: "Hull of four balls in a row; its axis is a segment, the radius linear between centres.",
            expected_betti: [1, 0, 0],
            default_resolution: 40,
            min_resolution: 12,
            generate: shapes::chain,
            known_axis: Some(axes::chain),
            diagonal: shapes::chain_diagonal(),
            in_default: false,
        },
        BuiltIn {
            id: "tube",
            title: "Swept tube",
            summary: "Radius 0.22 about a curve of varying curvature, round ends; its axis is the curve.",
            expected_betti: [1, 0, 0],
            default_resolution: 44,
            min_resolution: 20,
            generate: shapes::tube,
            known_axis: Some(axes::tube),
            diagonal: shapes::tube_diagonal(),
            in_default: false,
        },
    ]
}

/// Features of machine parts, each with a known axis.
fn parts() -> [BuiltIn; 4] {
    [
        BuiltIn {
            id: "fillet",
            title: "Filleted bracket",
            summary: "The bracket with a fillet of radius 0.3 in place of its reflex edge.",
            expected_betti: [1, 0, 0],
            default_resolution: 32,
            min_resolution: 12,
            generate: shapes::fillet,
            known_axis: Some(axes::fillet),
            diagonal: shapes::bracket_diagonal(),
            in_default: false,
        },
        BuiltIn {
            id: "rib",
            title: "Plate with a rib",
            summary: "A plate of 0.3 with a thin rib of 0.12 across it: two reflex edges close to each other.",
            expected_betti: [1, 0, 0],
            default_resolution: 40,
            min_resolution: 16,
            generate: shapes::rib,
            known_axis: Some(axes::rib),
            diagonal: shapes::rib_diagonal(),
            in_default: false,
        },
        BuiltIn {
            id: "holed-plate",
            title: "Plate with a hole",
            summary: "2.4 by 0.3 by 1.8 with a round hole of radius 0.5 through it, genus 1.",
            expected_betti: [1, 1, 0],
            default_resolution: 40,
            min_resolution: 16,
            generate: shapes::holed_plate,
            known_axis: Some(axes::holed_plate),
            diagonal: shapes::diagonal_of(shapes::HOLED_HALF),
            in_default: false,
        },
        BuiltIn {
            id: "blind-hole",
            title: "Cylinder with a blind hole",
            summary: "Radius 0.8 and height 1.2, a coaxial hole of radius 0.4 down to 0.45 above the bottom.",
            expected_betti: [1, 0, 0],
            default_resolution: 28,
            min_resolution: 10,
            generate: shapes::blind_hole,
            known_axis: Some(axes::blind_hole),
            diagonal: shapes::blind_hole_diagonal(),
            in_default: false,
        },
    ]
}
