//! Umbrellas and thresholds against their definitions; `tests/it/dey_zhao.rs` has the facets that are kept.

use medial::Vec3;
use medial::geometry::{CellId, Delaunay, Pole, Poles, VertexId};

use super::*;
use crate::test_shape;

/// Of each sample the other corners of its umbrella's triangles: the dual edges that have their ends on
/// both sides of the plane through the sample normal to its pole vector.
fn expected_umbrellas(delaunay: &Delaunay) -> Vec<Vec<[VertexId; 2]>> {
    let poles = Poles::new(delaunay);
    let centre = |cell: CellId| delaunay.circumsphere(cell).unwrap().0;
    let mut umbrellas = vec![Vec::new(); delaunay.point_count()];
    for cell in delaunay.finite_cells() {
        let corners = delaunay.vertices(cell);
        for (opposite, other) in delaunay.neighbours(cell).into_iter().enumerate() {
            if other < cell {
                continue;
            }
            let facet = [1, 2, 3].map(|k| corners[(opposite + k) % 4]);
            for turn in 0..3 {
                let [p, q, r] = [0, 1, 2].map(|k| facet[(turn + k) % 3]);
                let at = |v: VertexId| delaunay.point(v);
                let pole_vector = match poles.of_sample(p.index()).first.unwrap() {
                    Pole::Vertex(pole) => centre(pole) - at(p),
                    Pole::Infinite(direction) => direction,
                };
                let beyond = if delaunay.is_infinite(other) {
                    let normal = (at(q) - at(p)).cross(at(r) - at(p));
                    normal * -normal.dot(at(corners[opposite]) - at(p)).signum()
                } else {
                    centre(other) - at(p)
                };
                let ahead = |v: Vec3| v.dot(pole_vector) >= 0.0;
                if ahead(centre(cell) - at(p)) != ahead(beyond) {
                    umbrellas[p.index()].push([q, r]);
                }
            }
        }
    }
    umbrellas
}

#[test]
fn umbrellas_are_the_triangles_whose_dual_edge_crosses_the_tangent_plane() {
    let shape = test_shape("blob", 48);
    let delaunay = shape.delaunay().unwrap();
    let umbrellas = Umbrellas::new(&delaunay, shape.cells().unwrap().circumspheres());
    assert_eq!((umbrellas.missing(), umbrellas.flat()), (0, 0));
    for (p, rims) in (0..).map(VertexId).zip(expected_umbrellas(&delaunay)) {
        assert_eq!(umbrellas.normals(p).len(), rims.len());
        let mut largest = 0.0_f64;
        for [q, r] in rims {
            let [u, v] = [q, r].map(|v| delaunay.point(v) - delaunay.point(p));
            let normal = u.cross(v);
            let along = |n: &Vec3| (n.dot(normal).abs() / normal.length() - 1.0).abs() < 1e-12;
            assert!(umbrellas.normals(p).iter().any(along));
            assert!([q, r].iter().all(|&v| umbrellas.has_edge(p, v)));
            let sine = normal.length() / (u.length() * v.length());
            largest = largest.max(u.distance(v) / (2.0 * sine));
        }
        assert!((umbrellas.largest_circumradius(p) / largest - 1.0).abs() < 1e-12);
    }
}
