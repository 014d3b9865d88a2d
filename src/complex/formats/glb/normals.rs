//! Windings and normals of sheets, for viewers.

use std::collections::VecDeque;

use crate::Vec3;
use crate::complex::MedialMesh;

/// The faces of a medial mesh, turned alike across edges of exactly two faces: from the first face of each sheet
/// outwards. On one-sided sheets two neighbours stay opposed somewhere.
pub(super) fn turned_alike(mesh: &MedialMesh) -> Vec<[u32; 3]> {
    let mut of_edge: Vec<Vec<u32>> = vec![Vec::new(); mesh.edges.len()];
    let edges_of = |&[a, b, c]: &[u32; 3]| {
        [[a, b], [a, c], [b, c]].map(|side| mesh.edges.binary_search(&side).ok())
    };
    for (face, corners) in (0..).zip(&mesh.faces) {
        edges_of(corners).into_iter().flatten().for_each(|edge| of_edge[edge].push(face));
    }
    let mut faces = mesh.faces.clone();
    let mut reached = vec![false; faces.len()];
    let mut ahead = VecDeque::new();
    for first in 0..faces.len() {
        if !std::mem::replace(&mut reached[first], true) {
            ahead.push_back(first);
        }
        while let Some(face) = ahead.pop_front() {
            for edge in edges_of(&mesh.faces[face]).into_iter().flatten() {
                let [one, two] = of_edge[edge][..] else { continue };
                let other = (if one as usize == face { two } else { one }) as usize;
                if std::mem::replace(&mut reached[other], true) {
                    continue;
                }
                let ends = mesh.edges[edge];
                // Neighbours that are turned alike pass their edge in opposite directions.
                if passes(&faces[face], ends) == passes(&faces[other], ends) {
                    faces[other].swap(1, 2);
                }
                ahead.push_back(other);
            }
        }
    }
    faces
}

/// Whether a face passes an edge from its first end to its second.
fn passes(face: &[u32; 3], [a, b]: [u32; 2]) -> bool {
    (0..3).any(|k| face[k] == a && face[(k + 1) % 3] == b)
}

/// A unit normal at each sphere; `z` where no face has an area.
pub(super) fn normals(mesh: &MedialMesh, faces: &[[u32; 3]]) -> Vec<Vec3> {
    let area = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| mesh.spheres[v as usize].centre);
        (b - a).cross(c - a)
    };
    let mut largest = vec![Vec3::ZERO; mesh.spheres.len()];
    for face in faces {
        let area = area(face);
        for &v in face {
            let known = &mut largest[v as usize];
            if area.length_squared() > known.length_squared() {
                *known = area;
            }
        }
    }
    let mut sums = vec![Vec3::ZERO; mesh.spheres.len()];
    for face in faces {
        let area = area(face);
        for &v in face {
            let same_side = area.dot(largest[v as usize]) >= 0.0;
            sums[v as usize] += if same_side { area } else { -area };
        }
    }
    sums.into_iter().map(|sum| sum.try_normalize().unwrap_or(Vec3::Z)).collect()
}
