//! Turns faces so that every shell looks away from the solid: outer shells outward, shells of
//! cavities inward.
//!
//! 1. Within a component all faces follow the first one (breadth over common edges).
//! 2. A component is turned by the sign of the volume it encloses. A volume within its own
//!    rounding error counts as none and is refused.
//! 3. A component is a cavity if it lies in an odd number of others (see [`super::nesting`]).

use super::intersect::Intersections;
use super::nesting::{self, Parts, TooManyNested};
use super::report::Repair;
use super::topology::Topology;
use super::unit::Unit;
use crate::Vec3;
use crate::sum::Sum;

/// How a component is oriented, and how it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shell {
    /// Signed volume in scaled units; positive if the faces look outward.
    pub volume: f64,
    /// Bound on the rounding error of `volume`.
    pub rounding: f64,
    /// Number of components around it.
    pub depth: usize,
}

impl Shell {
    /// Whether it bounds a hole in the solid.
    pub fn is_cavity(&self) -> bool {
        self.depth % 2 == 1
    }

    /// Whether its two sides coincide, as far as doubles can tell.
    pub fn is_flat(&self) -> bool {
        self.volume.abs() <= self.rounding
    }

    /// Whether its faces look away from the solid.
    pub fn is_right(&self) -> bool {
        (self.volume > 0.0) != self.is_cavity()
    }
}

/// Volume and depth of every component of a closed, consistently oriented surface.
pub(super) fn shells(
    unit: Unit,
    points: &[Vec3],
    faces: &[[u32; 3]],
    topology: &Topology,
    intersections: &Intersections,
) -> Result<Vec<Shell>, TooManyNested> {
    let mut shells = volumes(points, faces, topology);
    let parts = Parts { unit, points, faces, component: &topology.component };
    let depths = nesting::depths(&parts, &topology.first_face, &intersections.components)?;
    for (shell, depth) in shells.iter_mut().zip(depths) {
        shell.depth = depth;
    }
    Ok(shells)
}

/// Exchanges two corners of the faces that are marked.
pub(super) fn turn_over(faces: &mut [[u32; 3]], marked: impl Iterator<Item = bool>) {
    for (face, _) in faces.iter_mut().zip(marked).filter(|(_, marked)| *marked) {
        face.swap(1, 2);
    }
}

/// What turning faces amounts to: `turned` marks faces that disagreed with the first face of
/// their component, `wrong` the components that were turned as a whole afterwards.
pub(super) fn repairs(
    turned: &[bool],
    wrong: &[bool],
    shells: &[Shell],
    component: &[u32],
) -> Vec<Repair> {
    // By component: faces that were turned, and faces in all. Unclosed surfaces have no shells.
    let components = component.iter().max().map_or(0, |&c| c as usize + 1);
    let mut faces = vec![[0; 2]; components];
    for (&turned, &component) in turned.iter().zip(component) {
        faces[component as usize][0] += usize::from(turned);
        faces[component as usize][1] += 1;
    }
    let (mut reoriented, mut outward, mut inward) = (0, 0, 0);
    for (index, &[turned, all]) in faces.iter().enumerate() {
        let whole = wrong.get(index).is_some_and(|&w| w);
        match (turned, whole) {
            (0, false) => {}
            (0, true) if shells[index].is_cavity() => inward += 1,
            (0, true) => outward += 1,
            (_, false) => reoriented += turned,
            (_, true) => reoriented += all - turned,
        }
    }
    let all = [
        Repair::ReorientedFaces { faces: reoriented },
        Repair::TurnedOutward { components: outward },
        Repair::TurnedInward { components: inward },
    ];
    all.into_iter().filter(|r| r.count() > 0).collect()
}

fn volumes(points: &[Vec3], faces: &[[u32; 3]], topology: &Topology) -> Vec<Shell> {
    let origins: Vec<Vec3> =
        topology.first_face.iter().map(|&face| points[faces[face as usize][0] as usize]).collect();
    let mut sums = vec![Sum::default(); origins.len()];
    let mut sizes = vec![0.0; origins.len()];
    for (face, &component) in faces.iter().zip(&topology.component) {
        let component = component as usize;
        // From a vertex of the component itself: far from the origin nothing cancels then.
        let [a, b, c] = face.map(|v| points[v as usize] - origins[component]);
        sums[component].add(a.dot(b.cross(c)));
        sizes[component] += a.length() * b.length() * c.length();
    }
    sums.iter()
        .zip(sizes)
        .map(|(sum, size)| Shell {
            volume: sum.value() / 6.0,
            // Each determinant is off by at most some 10 roundings of the product of lengths.
            rounding: 16.0 * f64::EPSILON * size / 6.0,
            depth: 0,
        })
        .collect()
}
