//! The initial error function of every sphere: slabs, cones of lone edges, boundary planes.

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{MedialMesh, Sphere, ZERO_LENGTH, stability_ratio};
use medial::geometry::{Cone, ConeFrame, SlabPlanes};

use super::QmatParams;
use crate::quadric::Quadric;

/// Counts of the primitives without tangent planes, which contribute nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Skipped {
    pub(super) slabs: usize,
    pub(super) cones: usize,
}

/// The quadric of each sphere of the initial mesh (equation 4 and section 4.4).
pub(super) fn initial_quadrics(
    mesh: &MedialMesh,
    complex: &CollapseComplex,
    params: &QmatParams,
) -> (Vec<Quadric>, Skipped) {
    let mut quadrics = vec![Quadric::default(); mesh.spheres.len()];
    let mut skipped = Skipped::default();
    for &face in &mesh.faces {
        let spheres = face.map(|v| mesh.spheres[v as usize]);
        match slab_planes(spheres) {
            Some(planes) => {
                let mut slab = Quadric::default();
                for normal in planes.normals() {
                    // A plane touches all three spheres, so any of them fixes its offset.
                    slab.add_plane(normal, spheres[0], 1.0);
                }
                for v in face {
                    quadrics[v as usize] += &slab;
                }
            }
            None => skipped.slabs += 1,
        }
    }
    for &[a, b] in &mesh.edges {
        let mut faces = complex.opposite_sides(a).iter().filter(|side| side.contains(&b));
        // No face: a cone, with a tip at each free end. One face: a boundary. More: neither.
        match (faces.next(), faces.next()) {
            (None, _) => {
                skipped.cones += usize::from(!add_cone(&mut quadrics, mesh, [a, b]));
                for (end, other) in [(a, b), (b, a)] {
                    if complex.neighbours(end).len() == 1 {
                        add_tip(&mut quadrics, mesh, end, other, params);
                    }
                }
            }
            (Some(&[p, q]), None) => {
                let apex = if p == b { q } else { p };
                add_rim(&mut quadrics, mesh, [a, b], apex, params);
            }
            _ => {}
        }
    }
    (quadrics, skipped)
}

/// Adds the four planes of a lone edge's cone to the quadrics of both ends; false without a cone.
fn add_cone(quadrics: &mut [Quadric], mesh: &MedialMesh, ends: [u32; 2]) -> bool {
    let [a, b] = ends.map(|v| mesh.spheres[v as usize]);
    let Some(frame) = cone_frame(a, b) else {
        return false;
    };
    let mut cone = Quadric::default();
    for normal in frame.normals() {
        cone.add_plane(normal, a, 1.0);
    }
    for v in ends {
        quadrics[v as usize] += &cone;
    }
    true
}

/// Adds the plane across the free end of a lone edge to the quadric of that end.
fn add_tip(quadrics: &mut [Quadric], mesh: &MedialMesh, end: u32, other: u32, params: &QmatParams) {
    let [tip, base] = [end, other].map(|v| mesh.spheres[v as usize]);
    // Without an axis the stability ratio is 0, and so is the weight.
    if let Some(frame) = cone_frame(base, tip) {
        let weight = boundary_weight(tip, base, params);
        quadrics[end as usize].add_plane(frame.u, tip, weight);
    }
}

/// Adds the plane along a boundary edge to the quadrics of both ends.
fn add_rim(
    quadrics: &mut [Quadric],
    mesh: &MedialMesh,
    ends: [u32; 2],
    apex: u32,
    params: &QmatParams,
) {
    let [a, b] = ends.map(|v| mesh.spheres[v as usize]);
    if cone_frame(a, b).is_none() {
        return;
    }
    if let Some(normal) = boundary_edge_normal([a, b], mesh.spheres[apex as usize]) {
        let weight = boundary_weight(a, b, params);
        for v in ends {
            quadrics[v as usize].add_plane(normal, a, weight);
        }
    }
}

/// Outward unit normal of the plane that closes a slab at its boundary edge `ends`: tangent to
/// both balls, orthogonal to the slab's plane, facing away from `opposite`.
///
/// `None` when one ball holds the other or the three centres are collinear.
fn boundary_edge_normal(ends: [Sphere; 2], opposite: Sphere) -> Option<Vec3> {
    let frame = Cone::new(ends[0], ends[1]).frame()?;
    let away = frame.across(ends[0].centre - opposite.centre)?;
    Some(frame.normal(away))
}

/// The tangent planes of a slab; `None` if the face is so thin that its plane is rounding noise.
fn slab_planes(spheres: [Sphere; 3]) -> Option<SlabPlanes> {
    let [a, b, c] = spheres.map(|m| m.centre);
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    // The smallest height is the doubled area over the longest side.
    let doubled_area = (b - a).cross(c - a).length_squared();
    if doubled_area <= ZERO_LENGTH * ZERO_LENGTH * longest {
        return None;
    }
    SlabPlanes::new(spheres)
}

/// The frame of a cone; `None` if one ball holds the other or the axis is rounding noise.
fn cone_frame(a: Sphere, b: Sphere) -> Option<ConeFrame> {
    if a.centre.distance(b.centre) < ZERO_LENGTH {
        return None;
    }
    Cone::new(a, b).frame()
}

/// Weight of a boundary plane.
fn boundary_weight(a: Sphere, b: Sphere, params: &QmatParams) -> f64 {
    let stability = stability_ratio(a, b);
    params.k_boundary * stability * stability
}
