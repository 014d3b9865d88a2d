//! Planes in which bodies stand on each other, to within rounding.
//!
//! At a general angle such a plane has no exact corners in floating-point numbers: a gap of a rounding stays between the
//! bodies, or they cross in a part of it. In a frame where the plane is level all corners get one height, and the
//! arrangement joins the bodies exactly.

use std::ops::ControlFlow;

use glam::DMat3;

use super::mesh::TriMesh;
use super::topology::Topology;
use crate::Vec3;
use crate::geometry::TriangleTree;
use crate::geometry::predicates::orient3d;

/// Number of planes from which on they are parts of curved sheets, which are left as they are.
const MOST_PLANES: usize = 64;

/// Largest cosine of the angle between the normals of faces that look at each other.
const OPPOSED: f64 = -0.9;

/// A plane in which bodies stand on each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// A rotation that makes the plane level.
    frame: DMat3,
    height: f64,
    /// Largest distance of corners from the plane.
    most: f64,
}

/// The planes where faces of two bodies look at each other, no farther than `most` apart and not exactly in one plane, of an
/// oriented surface in scaled units. Cavities are left out: their walls may be as thin as that.
pub(super) fn contacts(mesh: &TriMesh, most: f64) -> Vec<Contact> {
    let Topology { component, first_face, .. } = Topology::new(mesh.vertices.len(), &mesh.faces);
    let mut found: Vec<Contact> = Vec::new();
    if first_face.len() < 2 {
        return found;
    }
    let corners = |face: u32| mesh.triangle(face as usize);
    let mut volumes = vec![0.0; first_face.len()];
    for (face, &own) in component.iter().enumerate() {
        let origin = mesh.vertices[mesh.faces[first_face[own as usize] as usize][0] as usize];
        let [a, b, c] = mesh.triangle(face).map(|p| p - origin);
        volumes[own as usize] += a.dot(b.cross(c));
    }
    let is_body = |face: u32| volumes[component[face as usize] as usize] > 0.0;
    let tree = TriangleTree::new(0..mesh.faces.len() as u32, corners);
    for face in 0..mesh.faces.len() as u32 {
        let [a, b, c] = corners(face);
        let own = normal([a, b, c]);
        let Some(up) = own.try_normalize().filter(|_| is_body(face)) else { continue };
        let (low, high) = (a.min(b).min(c) - most, a.max(b).max(c) + most);
        tree.overlapping([low, high, high], |other, triangle| {
            if component[face as usize] == component[other as usize] || !is_body(other) {
                return ControlFlow::Continue(());
            }
            let across = normal(triangle);
            let contact = || Contact::new(up, a, most);
            let is_found = across.length_squared() <= own.length_squared()
                && across.normalize_or_zero().dot(up) < OPPOSED
                && contact().holds(triangle)
                && triangle.iter().any(|&p| !orient3d(a, b, c, p).is_zero());
            if is_found && !found.iter().any(|contact| contact.holds([a, b, c])) {
                found.push(contact());
            }
            if found.len() < MOST_PLANES {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        if found.len() == MOST_PLANES {
            return Vec::new();
        }
    }
    found
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

impl Contact {
    /// The plane through a point.
    fn new(up: Vec3, at: Vec3, most: f64) -> Self {
        let across = up.any_orthonormal_vector();
        let frame = DMat3::from_cols(across, up.cross(across), up).transpose();
        Self { frame, height: up.dot(at), most }
    }

    fn holds(&self, triangle: [Vec3; 3]) -> bool {
        let up = self.frame.row(2);
        triangle.iter().all(|p| (p.dot(up) - self.height).abs() <= self.most)
    }

    /// A surface in the frame of the plane, whose faces in it are level.
    pub fn level(&self, mesh: &TriMesh) -> TriMesh {
        let mut vertices: Vec<Vec3> = mesh.vertices.iter().map(|&v| self.frame * v).collect();
        for (face, corners) in mesh.faces.iter().enumerate() {
            if self.holds(mesh.triangle(face)) {
                corners.iter().for_each(|&v| vertices[v as usize].z = self.height);
            }
        }
        TriMesh { vertices, faces: mesh.faces.clone() }
    }

    /// A surface from the frame of the plane.
    pub fn back(&self, mut mesh: TriMesh) -> TriMesh {
        let back = self.frame.transpose();
        mesh.vertices.iter_mut().for_each(|v| *v = back * *v);
        mesh
    }
}
