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
        let place = umbrellas.place(p);
        assert_eq!(umbrellas.position(place), delaunay.point(p));
        assert_eq!(umbrellas.normals(place).len(), rims.len());
        let mut largest = 0.0_f64;
        for [q, r] in rims {
            let [u, v] = [q, r].map(|v| delaunay.point(v) - delaunay.point(p));
            let normal = u.cross(v);
            let along = |n: &Vec3| (n.dot(normal).abs() / normal.length() - 1.0).abs() < 1e-12;
            assert!(umbrellas.normals(place).iter().any(along));
            assert!([q, r].iter().all(|&v| umbrellas.has_edge(place, umbrellas.place(v))));
            let sine = normal.length() / (u.length() * v.length());
            largest = largest.max(u.distance(v) / (2.0 * sine));
        }
        assert!((umbrellas.largest_circumradius(place) / largest - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_facet_is_above_a_level_if_its_value_is() {
    for id in ["blob", "box"] {
        let shape = test_shape(id, 20);
        let delaunay = shape.delaunay().unwrap();
        let facets = FacetSet::of(&shape).unwrap().facets;
        // The paper's thresholds, weak ones, which edges of umbrellas would pass, and each condition alone.
        for (theta, rho) in [(22.5, 8.0), (1e-6, 0.01), (22.5, 1e9), (89.9999, 8.0)] {
            let umbrellas = Umbrellas::new(&delaunay, shape.cells().unwrap().circumspheres());
            let params = DeyZhaoParams { theta, rho };
            let facets = Arc::clone(&facets);
            let strength = Strength { facets, umbrellas, params };
            let facets = &strength.facets;
            let values: Vec<f64> = (0..facets.len()).map(|f| strength.value(f)).collect();
            // Levels between values, and values themselves.
            let some = values.iter().copied().step_by(values.len() / 20 + 1);
            for level in some.chain([0.0, 0.3, 1.0, 2.5, 4.0, 50.0]) {
                let is_above = strength.is_above(level);
                let wrong = (0..values.len()).find(|&f| is_above(f) != (values[f] > level));
                assert_eq!(wrong, None, "{id}, {params:?} at {level}");
            }
        }
    }
}
