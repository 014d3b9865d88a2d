//! Bodies that stand on each other, to within rounding.
//!
//! At a general angle the plane between two bodies has no exact corners in floating-point numbers: a gap of a rounding
//! stays between them, or they cross in a part of it, and no arrangement of such faces is of use. So the smaller body is
//! pushed into the larger one, by 4e-6 to 8e-6 of the diagonal. Where faces of both look the same way in one plane, the
//! smaller body is drawn back by a quarter of that, or they would cross there.
//!
//! Plates of a few times that thickness become thinner, and bodies that touch themselves are not found.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use glam::DMat3;

use super::mesh::TriMesh;
use super::topology::Topology;
use crate::Vec3;
use crate::geometry::TriangleTree;
use crate::geometry::predicates::orient3d;

/// Least cosine of the angle between the planes of faces in contact.
const ALIGNED: f64 = 0.9;

/// Cosine of the angle between two faces above which they push a vertex as one.
const ALIKE: f64 = 0.999;

/// How far the largest body is pushed, in distances up to which bodies are in contact. The smallest is pushed twice as far,
/// and the others in between, so that no two end in one plane.
const PUSH: f64 = 4.0;

/// How far the largest body is drawn back where it looks the same way as another one. The smallest goes twice as far, less
/// than anything is pushed.
const BACK: f64 = 1.0;

/// Limit of the way of a vertex, in pushes. A wedge would leave its groove to move both sides.
const MOST: f64 = 2.0;

/// Share of a push that a direction without a face is damped by.
const DAMPING: f64 = 1e-6;

/// Which body is pushed into which. The second order has other vertices that move, and so other gaps.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    SmallerIntoLarger,
    LargerIntoSmaller,
}

/// A vertex of a pushed body: normals of its faces in contact, and how far each is to move along it.
type Pushes = Vec<(Vec3, f64)>;

/// Whether bodies of an oriented surface in scaled units stand on each other, no farther than `most` apart and not exactly in
/// one plane. Cavities are left out: their walls may be as thin as that.
pub(super) fn has_contacts(mesh: &TriMesh, most: f64) -> bool {
    Bodies::new(mesh, most).is_some_and(|bodies| bodies.any())
}

/// The surface with the smaller of two such bodies pushed into the larger one, or the other way round, with the number of
/// vertices that were moved and the longest way; None where there are no contacts.
pub(super) fn pushed(mesh: &TriMesh, most: f64, order: Order) -> Option<(TriMesh, usize, f64)> {
    let mut bodies = Bodies::new(mesh, most).filter(Bodies::any)?;
    if order == Order::LargerIntoSmaller {
        let last = bodies.rank.iter().flatten().max().copied()?;
        bodies.rank.iter_mut().flatten().for_each(|rank| *rank = last - *rank);
    }
    let mut pushed = mesh.clone();
    let (mut vertices, mut farthest) = (0, 0.0_f64);
    for (v, pushes) in bodies.pushes() {
        let way = way(&pushes);
        pushed.vertices[v as usize] += way;
        vertices += 1;
        farthest = farthest.max(way.length());
    }
    Some((pushed, vertices, farthest))
}

/// The least way that moves all faces by their distances, or nearly so where they are too many.
fn way(pushes: &Pushes) -> Vec3 {
    let outer = |n: Vec3| DMat3::from_cols(n * n.x, n * n.y, n * n.z);
    let sum = pushes
        .iter()
        .fold(DMat3::from_diagonal(Vec3::splat(DAMPING)), |sum, &(n, _)| sum + outer(n));
    let way = sum.inverse() * pushes.iter().map(|&(n, distance)| distance * n).sum::<Vec3>();
    let most = pushes.iter().fold(0.0, |most: f64, &(_, distance)| most.max(distance.abs()));
    way.clamp_length_max(MOST * most)
}

/// The bodies of a surface.
struct Bodies<'m> {
    mesh: &'m TriMesh,
    most: f64,
    tree: TriangleTree,
    /// The body of each face.
    body: Vec<u32>,
    /// For each body its place among all in the order of their volumes, the largest first, unless reversed. None for cavities.
    rank: Vec<Option<usize>>,
}

/// Two faces in contact.
struct Contact {
    /// The face of the smaller body.
    face: u32,
    /// Whether the faces look at each other, instead of the same way.
    is_opposed: bool,
    is_exact: bool,
}

impl<'m> Bodies<'m> {
    fn new(mesh: &'m TriMesh, most: f64) -> Option<Self> {
        let Topology { component: body, first_face, .. } =
            Topology::new(mesh.vertices.len(), &mesh.faces);
        if first_face.len() < 2 {
            return None;
        }
        let mut volumes = vec![0.0; first_face.len()];
        for (face, &own) in body.iter().enumerate() {
            let origin = mesh.triangle(first_face[own as usize] as usize)[0];
            let [a, b, c] = mesh.triangle(face).map(|p| p - origin);
            volumes[own as usize] += a.dot(b.cross(c));
        }
        let mut order: Vec<usize> = (0..volumes.len()).filter(|&k| volumes[k] > 0.0).collect();
        order.sort_by(|&i, &j| volumes[j].total_cmp(&volumes[i]).then(i.cmp(&j)));
        let mut rank = vec![None; volumes.len()];
        (0..).zip(order).for_each(|(place, k)| rank[k] = Some(place));
        let corners = |face: u32| mesh.triangle(face as usize);
        let tree = TriangleTree::new(0..mesh.faces.len() as u32, corners);
        Some(Self { mesh, most, tree, body, rank })
    }

    fn any(&self) -> bool {
        let is_contact = |contact: Contact| contact.is_opposed && !contact.is_exact;
        self.each_contact(|contact| match is_contact(contact) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
        .is_break()
    }

    /// The vertices of the smaller bodies in contact. Where bodies look the same way in one plane, the smaller one is drawn
    /// back instead.
    fn pushes(&self) -> BTreeMap<u32, Pushes> {
        let mut found: BTreeMap<u32, Pushes> = BTreeMap::new();
        let _ = self.each_contact(|Contact { face, is_opposed, .. }| {
            let up = normal(self.mesh.triangle(face as usize)).normalize_or_zero();
            let rank = self.rank[self.body[face as usize] as usize].unwrap_or_default();
            let farther = self.most * (1.0 + rank as f64 / self.rank.len() as f64);
            let push = if is_opposed { PUSH * farther } else { -BACK * farther };
            for v in self.mesh.faces[face as usize] {
                let pushes = found.entry(v).or_default();
                match pushes.iter_mut().find(|(n, _)| n.dot(up) > ALIKE) {
                    Some((_, known)) => *known = known.max(push),
                    None => pushes.push((up, push)),
                }
            }
            ControlFlow::Continue(())
        });
        found
    }

    fn each_contact(&self, mut found: impl FnMut(Contact) -> ControlFlow<()>) -> ControlFlow<()> {
        let Self { mesh, most, tree, body, rank } = self;
        for face in 0..mesh.faces.len() as u32 {
            let corners = mesh.triangle(face as usize);
            let Some(own) = rank[body[face as usize] as usize] else { continue };
            let [a, b, c] = corners;
            let reach = PUSH * most;
            let (low, high) = (a.min(b).min(c) - reach, a.max(b).max(c) + reach);
            let mut ended = ControlFlow::Continue(());
            tree.overlapping([low, high, high], |other, triangle| {
                let larger = rank[body[other as usize] as usize].is_some_and(|other| other < own);
                if larger && let Some((is_opposed, is_exact)) = self.contact(corners, triangle) {
                    ended = found(Contact { face, is_opposed, is_exact });
                }
                ended
            });
            ended?;
        }
        ControlFlow::Continue(())
    }

    /// Whether two faces are in one plane, to within the distance, and overlap, or touch if they look the same way: if so
    /// whether they look at each other, and whether they are exactly in one plane.
    fn contact(&self, first: [Vec3; 3], second: [Vec3; 3]) -> Option<(bool, bool)> {
        let (n, m) = (normal(first), normal(second));
        let cosine = n.try_normalize()?.dot(m.try_normalize()?);
        if cosine.abs() < ALIGNED {
            return None;
        }
        let is_larger = n.length_squared() >= m.length_squared();
        let (large, small) = if is_larger { (first, second) } else { (second, first) };
        let [a, b, c] = large;
        let up = normal(large).normalize();
        if small.iter().any(|p| (*p - a).dot(up).abs() > self.most) {
            return None;
        }
        let is_opposed = cosine < 0.0;
        let least = if is_opposed { self.most } else { -PUSH * self.most };
        let overlaps = |along: Vec3| {
            let ends = |t: [Vec3; 3]| {
                let at = t.map(|p| (p - a).dot(along));
                [at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2])]
            };
            let (first, second) = (ends(first), ends(second));
            first[1].min(second[1]) - first[0].max(second[0]) > least
        };
        let edges = |[a, b, c]: [Vec3; 3]| [b - a, c - b, a - c];
        let axes = [edges(first), edges(second)].into_iter().flatten();
        let mut axes = axes.filter_map(|edge| edge.cross(up).try_normalize());
        let is_exact = || small.iter().all(|&p| orient3d(a, b, c, p).is_zero());
        axes.all(overlaps).then(|| (is_opposed, is_exact()))
    }
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}
