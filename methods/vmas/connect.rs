//! The complex: spheres are joined where their clusters are adjacent.

use rayon::prelude::*;

use super::cluster::NONE;
use super::params::Connect;
use super::points::{Locality, SurfacePoints};

/// The pairs of spheres of which some points are adjacent, ascending, in ascending order.
pub(super) fn edges(points: &SurfacePoints, labels: &[u32]) -> Vec<[u32; 2]> {
    let joined = |&[v, w]: &[u32; 2]| {
        let (a, b) = (labels[v as usize], labels[w as usize]);
        (a != b && a != NONE && b != NONE).then(|| [a.min(b), a.max(b)])
    };
    let mut edges: Vec<[u32; 2]> = points.links.par_iter().filter_map(joined).collect();
    edges.par_sort_unstable();
    edges.dedup();
    edges
}

/// The faces on these edges.
pub(super) fn faces(
    points: &SurfacePoints,
    labels: &[u32],
    edges: &[[u32; 2]],
    connect: Connect,
) -> Vec<[u32; 3]> {
    match (connect, &points.local) {
        (Connect::Cliques, _) => triangles(edges),
        (Connect::Faces, Locality::Faces(faces)) => of_labels(faces, labels),
        (Connect::Faces, Locality::Nearest { .. }) => {
            // Links within a cluster are in no triangle of three labels.
            let differ = |&&[v, w]: &&[u32; 2]| labels[v as usize] != labels[w as usize];
            let between: Vec<[u32; 2]> = points.links.iter().filter(differ).copied().collect();
            of_labels(&triangles(&between), labels)
        }
    }
}

/// The triangles of a graph whose edges are ascending pairs in ascending order.
fn triangles(edges: &[[u32; 2]]) -> Vec<[u32; 3]> {
    let later = |a: u32| {
        let from = edges.partition_point(|edge| edge[0] < a);
        let to = edges.partition_point(|edge| edge[0] <= a);
        edges[from..to].iter().map(|edge| edge[1])
    };
    let on_edge = |&[a, b]: &[u32; 2]| {
        let (mut of_a, mut of_b) = (later(a).peekable(), later(b).peekable());
        let mut found = Vec::new();
        while let (Some(&c), Some(&d)) = (of_a.peek(), of_b.peek()) {
            if c == d {
                found.push([a, b, c]);
            }
            // Both advance where they agree.
            of_a.next_if(|&c| c <= d);
            of_b.next_if(|&d| d <= c);
        }
        found
    };
    edges.par_iter().flat_map_iter(on_edge).collect()
}

/// The labels of point triples with three different ones, ascending, in ascending order.
fn of_labels(triples: &[[u32; 3]], labels: &[u32]) -> Vec<[u32; 3]> {
    let labelled = |triple: &[u32; 3]| {
        let mut face = triple.map(|v| labels[v as usize]);
        face.sort_unstable();
        (face[0] < face[1] && face[1] < face[2] && face[2] != NONE).then_some(face)
    };
    let mut faces: Vec<[u32; 3]> = triples.iter().filter_map(labelled).collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}
