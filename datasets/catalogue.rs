//! The list of built-in shapes.

use medial::Vec3;
use medial::surface::TriMesh;
use serde::Serialize;

use crate::axes::{self, box_axis};
use crate::bisectors::KnownAxis;
use crate::profiles::{HOLED_HALF, triangle};
use crate::shapes::{
    self, BLIND_HOLE, BLIND_HOLE_RADIUS, BOX_HALF, BRACKET, BRACKET_ELBOW, FILLETED_ELBOW, FRUSTUM,
    PLATE_HALF, RIB, RIB_HALF, ROD_HALF, ROD_RADIUS, WEDGE, diagonal_of, grid_box,
};
use crate::solids::capsule_of;

/// Finest resolution that is generated: some four million vertices.
pub const MAX_RESOLUTION: u32 = 2000;

/// A generated solid.
#[derive(Clone, Debug, Serialize)]
pub struct BuiltIn {
    /// Short name for the command line, such as `rounded-box`.
    pub id: &'static str,
    /// Name for tables.
    pub title: &'static str,
    /// One sentence: the shape, its dimensions, its use.
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
        self.known_axis.map(|axis| KnownAxis { parts: axes::parts(self.id), ..axis() })
    }
}

/// The built-in shape with this id.
pub fn find(id: &str) -> Option<BuiltIn> {
    catalogue().into_iter().find(|shape| shape.id == id)
}

/// A table of shapes. The last column of the second line is [`BuiltIn::in_default`].
macro_rules! shapes {
    ($($id:literal, $title:literal, betti $betti:expr, resolution $default:literal from $min:literal,
       $generate:expr, $axis:expr, $diagonal:expr, $in_default:literal, $summary:literal;)*) => {
        vec![$(BuiltIn {
            id: $id,
            title: $title,
            summary: $summary,
            expected_betti: $betti,
            default_resolution: $default,
            min_resolution: $min,
            generate: $generate,
            known_axis: $axis,
            diagonal: $diagonal,
            in_default: $in_default,
        }),*]
    };
}

/// All built-in shapes: convex solids, tubes, cavities and loops, then further known axes and features of machine parts.
pub fn catalogue() -> Vec<BuiltIn> {
    shapes! {
        "sphere", "Sphere", betti [1, 0, 0], resolution 40 from 8,
            shapes::sphere, Some(axes::sphere), diagonal_of(Vec3::ONE), true,
            "Unit sphere on a geodesic grid; its axis is one point.";
        "ellipsoid", "Ellipsoid", betti [1, 0, 0], resolution 40 from 8,
            shapes::ellipsoid, Some(axes::ellipsoid), diagonal_of(shapes::ELLIPSOID), true,
            "Semi-axes 1, 0.7, 0.45; its axis is a flat elliptic disc with a smooth rim.";
        "box", "Box", betti [1, 0, 0], resolution 30 from 8,
            |edge| grid_box(BOX_HALF, edge), Some(|| box_axis(BOX_HALF, 0.0)), diagonal_of(BOX_HALF), true,
            "3 by 2 by 1 on regular grids, sharp edges sampled; 13 flat sheets, known exactly.";
        "rounded-box", "Rounded box", betti [1, 0, 0], resolution 32 from 12,
            shapes::rounded_box, Some(axes::rounded_box), diagonal_of(shapes::ROUNDED_EXTENT), true,
            "2 by 1.2 by 0.5 grown by 0.25; the axis of the core box with larger radii.";
        "plate", "Thin plate", betti [1, 0, 0], resolution 40 from 25,
            |edge| grid_box(PLATE_HALF, edge), Some(|| box_axis(PLATE_HALF, 0.0)), diagonal_of(PLATE_HALF), true,
            "2 by 1.5 by 0.1: nearly all of the axis is one sheet, and spikes are thin.";
        "bracket", "L-bracket", betti [1, 0, 0], resolution 32 from 8,
            shapes::bracket, Some(|| BRACKET_ELBOW.profile().prism(BRACKET.y / 2.0, BRACKET.y / 2.0)), diagonal_of(shapes::BRACKET_EXTENT), true,
            "Two plates of 0.4 at a right angle: convex edges and one reflex edge.";
        "capsule", "Capsule", betti [1, 0, 0], resolution 36 from 10,
            |edge| capsule_of(ROD_HALF, ROD_RADIUS, edge), Some(axes::capsule), diagonal_of(shapes::ROD_EXTENT), true,
            "Cylinder of radius 0.4 with round ends; its axis is one segment.";
        "rod", "Cone-ended rod", betti [1, 0, 0], resolution 36 from 10,
            shapes::rod, Some(axes::rod), diagonal_of(shapes::ROD_EXTENT), true,
            "Cylinder of radius 0.4 with conical ends of 45 degrees; a segment and two cones.";
        "pair", "Ball and capsule", betti [2, 0, 0], resolution 50 from 20,
            shapes::pair, Some(axes::pair), diagonal_of(shapes::PAIR_EXTENT), true,
            "Two separate bodies: the axis is a point and a segment.";
        "torus", "Torus", betti [1, 1, 0], resolution 36 from 16,
            shapes::torus, Some(axes::torus), diagonal_of(shapes::TORUS_EXTENT), true,
            "Radii 1 and 0.4 on a regular grid; its axis is a circle.";
        "coil", "Coiled pipe", betti [1, 0, 0], resolution 34 from 28,
            shapes::coil, Some(axes::coil), diagonal_of(shapes::COIL_EXTENT), true,
            "Two turns of a pipe with round ends and a narrow gap; its axis is a helix.";
        "hollow-sphere", "Hollow sphere", betti [1, 0, 1], resolution 36 from 16,
            shapes::hollow_sphere, Some(axes::hollow_sphere), diagonal_of(Vec3::ONE), true,
            "Between spheres of radii 1 and 0.5; its axis is the sphere of radius 0.75.";
        "double-torus", "Double torus", betti [1, 2, 0], resolution 44 from 30,
            shapes::double_torus, None, shapes::DOUBLE_TORUS_DIAGONAL, true,
            "Two blended tori side by side, genus 2, from an implicit function.";
        "frame", "Tetrahedral frame", betti [1, 3, 0], resolution 36 from 30,
            shapes::frame, None, shapes::FRAME_DIAGONAL, true,
            "The six edges of a tetrahedron as blended tubes, genus 3.";
        "blob", "Blob", betti [1, 0, 0], resolution 46 from 30,
            shapes::blob, None, shapes::BLOB_DIAGONAL, true,
            "A smooth body with head, tail and four limbs, from an implicit function.";
        "wedge", "Wedge", betti [1, 0, 0], resolution 30 from 8,
            shapes::wedge, Some(|| triangle(WEDGE.x, WEDGE.z).prism(0.0, WEDGE.y)), diagonal_of(shapes::WEDGE_EXTENT), false,
            "Triangular prism with edges of 40 and 70 degrees; nine flat sheets, known exactly.";
        "frustum", "Cone frustum", betti [1, 0, 0], resolution 34 from 10,
            shapes::frustum, Some(|| FRUSTUM.half_profile().revolved()), diagonal_of(shapes::FRUSTUM_EXTENT), false,
            "Radii 0.8 and 0.4, height 2, sharp creases; its axis is a segment and two cones.";
        "fillet", "Filleted bracket", betti [1, 0, 0], resolution 32 from 12,
            shapes::fillet, Some(|| FILLETED_ELBOW.profile().prism(BRACKET.y / 2.0, BRACKET.y / 2.0)), diagonal_of(shapes::BRACKET_EXTENT), false,
            "The bracket with a fillet of radius 0.3 in place of its reflex edge.";
        "rib", "Plate with a rib", betti [1, 0, 0], resolution 40 from 16,
            shapes::rib, Some(|| RIB.profile().prism(0.0, RIB_HALF)), diagonal_of(shapes::RIB_EXTENT), false,
            "A plate of 0.3 with a thin rib of 0.12 across it: two reflex edges close to each other.";
        "holed-plate", "Plate with a hole", betti [1, 1, 0], resolution 40 from 16,
            shapes::holed_plate, Some(axes::holed_plate), diagonal_of(HOLED_HALF), false,
            "2.4 by 0.3 by 1.8 with a round hole of radius 0.5 through it, genus 1.";
        "blind-hole", "Cylinder with a blind hole", betti [1, 0, 0], resolution 28 from 10,
            shapes::blind_hole, Some(|| BLIND_HOLE.mirrored(BLIND_HOLE_RADIUS).revolved()), diagonal_of(shapes::BLIND_HOLE_EXTENT), false,
            "Radius 0.8 and height 1.2, a coaxial hole of radius 0.4 down to 0.45 above the bottom.";
    }
}
