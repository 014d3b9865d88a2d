//! The Voronoi subcomplex: invariance, stability under thinning, the sheets of a box.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_8};

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, RunContext, Simplified};
use medial::surface::{Side, TriMesh};
use medial_methods::dey_zhao;

use crate::common::{self, sampled as shape_of};

fn built_in(id: &str, resolution: u32) -> TriMesh {
    medial_datasets::find(id).expect("in the catalogue").mesh(resolution)
}

fn at(shape: &Shape, params: &[(&str, &str)], level: Level) -> Simplified {
    let params = common::params(params);
    let prepared = dey_zhao::method().prepare(shape, &params, &RunContext::default());
    prepared.expect("ready").at(level).expect("a level")
}

fn area(mesh: &MedialMesh) -> f64 {
    let areas = mesh.faces.iter().map(|f| {
        let [a, b, c] = f.map(|v| mesh.spheres[v as usize].centre);
        (b - a).cross(c - a).length() / 2.0
    });
    areas.sum()
}

#[test]
fn thinning_a_dense_sample_keeps_the_area() {
    for id in ["ellipsoid", "rounded-box", "hollow-sphere"] {
        let mesh = built_in(id, 120);
        let [dense, thin] = ["blue:24000", "blue:12000"]
            .map(|sampling| area(&at(&shape_of(&mesh, sampling), &[], Level::Published).mesh));
        assert!((thin / dense - 1.0).abs() < 0.1, "{id}: {dense} then {thin}");
    }
}

#[test]
fn a_plate_keeps_its_middle_sheet() {
    // 2 x 1.5 x 0.1: the middle sheet is the rectangle 1.9 x 1.4.
    let mesh = built_in("plate", 200);
    let shape = shape_of(&mesh, "vertices");
    let kept = at(&shape, &[], Level::Published).mesh;
    let unit = shape.normalisation().diagonal;
    let middle = kept.spheres.iter().filter(|s| (s.radius * unit - 0.05).abs() < 1e-3).count();
    assert!(2 * middle > kept.spheres.len());
    assert!(area(&kept) * unit * unit > 0.98 * 1.9 * 1.4, "{}", area(&kept) * unit * unit);
    let back = |p: Vec3| shape.normalisation().backward(p);
    for s in kept.spheres.iter().filter(|s| (s.radius * unit - 0.05).abs() < 1e-3) {
        assert!(back(s.centre).z.abs() < 1e-3, "{:?}", back(s.centre));
    }
}

#[test]
fn a_number_of_spheres_is_the_published_result_of_fewer_samples() {
    let mesh = built_in("blob", 60);
    for sampling in ["vertices", "uniform:4000:7"] {
        let shape = shape_of(&mesh, sampling);
        for count in [1000, 250] {
            let found = at(&shape, &[], Level::Spheres(count));
            let reached = found.mesh.spheres.len();
            assert!(reached <= count && reached * 100 >= 98 * count, "{reached} for {count}");
            assert_eq!(found.native_level, Some(1.0));
            let samples = common::count(&found, "samples");
            let again = match sampling {
                "vertices" => format!("blue:{samples}"),
                _ => format!("uniform:{samples}:7"),
            };
            assert_eq!(found.mesh, at(&shape_of(&mesh, &again), &[], Level::Published).mesh);
        }
    }
}

// ----------------------------------------------------------------------------
// The Voronoi subcomplex from its definitions, by brute force on few random samples: no triangulation, no pole and
// no umbrella of the program takes part.
//
// 1. Delaunay tetrahedra are those whose circumsphere holds no sample; facets of only one are on the hull.
// 2. The pole vector of a sample leads to the farthest circumcentre around it, on the hull along the mean
//    of the outward normals.
// 3. The umbrella: the triangles whose two circumcentres lie on both sides of the plane through the sample
//    normal to the pole vector; beyond the hull a circumcentre is at infinity.
// 4. Both conditions as the paper has them, from each end of each edge.

const SAMPLES: usize = 90;

/// Decisions within this margin depend on rounding.
const ROUNDING: f64 = 1e-9;

struct Cell {
    corners: [usize; 4],
    centre: Vec3,
}

/// The centre of the sphere through four points, by Cramer's rule.
fn circumcentre([a, b, c, d]: [Vec3; 4]) -> Vec3 {
    let [u, v, w] = [b - a, c - a, d - a];
    let turned = u.length_squared() * v.cross(w)
        + v.length_squared() * w.cross(u)
        + w.length_squared() * u.cross(v);
    a + turned / (2.0 * u.dot(v.cross(w)))
}

/// Step 1.
fn cells(points: &[Vec3]) -> Vec<Cell> {
    let n = points.len();
    let mut cells = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            for c in b + 1..n {
                for d in c + 1..n {
                    let corners = [a, b, c, d];
                    let centre = circumcentre(corners.map(|v| points[v]));
                    let radius = centre.distance_squared(points[a]);
                    let holds = |&v: &usize| centre.distance_squared(points[v]) < radius;
                    if !(0..n).filter(|v| !corners.contains(v)).any(|v| holds(&v)) {
                        cells.push(Cell { corners, centre });
                    }
                }
            }
        }
    }
    cells
}

/// The two sides of a Delaunay triangle.
struct Triangle {
    corners: [usize; 3],
    /// From a point of the triangle's plane the way to each end of its Voronoi edge is that to a circumcentre,
    /// or, beyond the hull, along the outward normal.
    ends: [End; 2],
}

#[derive(Clone, Copy)]
enum End {
    Centre(Vec3),
    Infinite(Vec3),
}

fn triangles(points: &[Vec3], cells: &[Cell]) -> Vec<Triangle> {
    let mut around: BTreeMap<[usize; 3], Vec<usize>> = BTreeMap::new();
    for (index, cell) in cells.iter().enumerate() {
        for left_out in 0..4 {
            let [a, b, c] = [1, 2, 3].map(|k| cell.corners[(left_out + k) % 4]);
            let mut corners = [a, b, c];
            corners.sort_unstable();
            around.entry(corners).or_default().push(index);
        }
    }
    let triangle = |(corners, cells_at): (&[usize; 3], &Vec<usize>)| {
        let first = &cells[cells_at[0]];
        let other = match cells_at.get(1) {
            Some(&other) => End::Centre(cells[other].centre),
            None => {
                let [a, b, c] = corners.map(|v| points[v]);
                let apex = first.corners.iter().find(|v| !corners.contains(v)).expect("a fourth");
                let normal = (b - a).cross(c - a).normalize();
                End::Infinite(-normal * normal.dot(points[*apex] - a).signum())
            }
        };
        assert!(cells_at.len() <= 2, "no Delaunay triangulation");
        Triangle { corners: *corners, ends: [End::Centre(first.centre), other] }
    };
    around.iter().map(triangle).collect()
}

/// Step 2.
fn pole_vector(p: usize, points: &[Vec3], cells: &[Cell], at_p: &[&Triangle]) -> Vec3 {
    let normals = at_p.iter().flat_map(|t| t.ends).filter_map(|end| match end {
        End::Infinite(normal) => Some(normal),
        End::Centre(_) => None,
    });
    let normal: Vec3 = normals.sum();
    if normal != Vec3::ZERO {
        return normal;
    }
    let ways = cells.iter().filter(|c| c.corners.contains(&p)).map(|c| c.centre - points[p]);
    ways.max_by(|u, v| u.length().total_cmp(&v.length())).expect("a cell")
}

/// Step 3.
fn umbrella<'t>(
    p: usize,
    points: &[Vec3],
    cells: &[Cell],
    all: &'t [Triangle],
) -> Vec<&'t Triangle> {
    let at_p: Vec<&Triangle> = all.iter().filter(|t| t.corners.contains(&p)).collect();
    let pole = pole_vector(p, points, cells, &at_p);
    let ahead = |end: End| match end {
        End::Centre(centre) => (centre - points[p]).dot(pole) >= 0.0,
        End::Infinite(normal) => normal.dot(pole) >= 0.0,
    };
    at_p.into_iter().filter(|t| ahead(t.ends[0]) != ahead(t.ends[1])).collect()
}

/// The test of an edge: either condition suffices.
#[derive(Clone, Copy)]
struct Rule {
    /// An angle with every normal of less than this.
    angle: Option<f64>,
    /// Longer than this number of circumradii of every triangle.
    ratio: Option<f64>,
}

/// Step 4: whether the edge `pq` is kept by its test from `p`.
fn passes([p, q]: [usize; 2], points: &[Vec3], umbrella: &[&Triangle], rule: Rule) -> bool {
    if umbrella.is_empty() || umbrella.iter().any(|t| t.corners.contains(&q)) {
        return false;
    }
    let edge = points[q] - points[p];
    let (mut largest_angle, mut least_ratio) = (0.0_f64, f64::INFINITY);
    for triangle in umbrella {
        let [a, b, c] = triangle.corners.map(|v| points[v]);
        let normal = (b - a).cross(c - a);
        let cosine = edge.dot(normal).abs() / (edge.length() * normal.length());
        largest_angle = largest_angle.max(cosine.min(1.0).acos());
        let circumradius = a.distance(b) * b.distance(c) * c.distance(a) / (2.0 * normal.length());
        least_ratio = least_ratio.min(edge.length() / circumradius);
    }
    let exceeds = |value: f64, limit: f64| {
        assert!((value - limit).abs() > ROUNDING, "{value} is decided by rounding");
        value > limit
    };
    let is_steep = rule.angle.is_some_and(|limit| !exceeds(largest_angle, limit));
    is_steep || rule.ratio.is_some_and(|limit| exceeds(least_ratio, limit))
}

/// The spheres of the facets that the algorithm keeps, and the number of triangles that they are cut into.
fn expected(shape: &Shape, rules: &[Rule]) -> Vec<(Vec<Vec3>, usize)> {
    let samples = shape.samples();
    let points = &samples[..];
    let cells = cells(points);
    let triangles = triangles(points, &cells);
    let umbrellas: Vec<_> =
        (0..points.len()).map(|p| umbrella(p, points, &cells, &triangles)).collect();
    let centres: Vec<Vec3> = cells.iter().map(|cell| cell.centre).collect();
    let sides = shape.inside_test().sides(&centres);
    let is_on_hull = |p: usize, q: usize| {
        let has_both = |t: &&Triangle| t.corners.contains(&p) && t.corners.contains(&q);
        let mut at_edge = triangles.iter().filter(has_both);
        at_edge.any(|t| matches!(t.ends[1], End::Infinite(_)))
    };
    let mut found = vec![(BTreeSet::new(), 0); rules.len()];
    for p in 0..points.len() {
        for q in p + 1..points.len() {
            let has = |&c: &usize| cells[c].corners.contains(&p) && cells[c].corners.contains(&q);
            let around: Vec<usize> = (0..cells.len()).filter(has).collect();
            let is_inside = around.iter().all(|&c| sides[c] == Side::Inside);
            if around.is_empty() || !is_inside || is_on_hull(p, q) {
                continue;
            }
            for (&rule, (kept, faces)) in rules.iter().zip(&mut found) {
                if passes([p, q], points, &umbrellas[p], rule)
                    || passes([q, p], points, &umbrellas[q], rule)
                {
                    *faces += around.len() - 2;
                    kept.extend(around.iter().copied());
                }
            }
        }
    }
    let centres = |kept: BTreeSet<usize>| kept.into_iter().map(|c| centres[c]).collect();
    found.into_iter().map(|(kept, faces)| (centres(kept), faces)).collect()
}

/// Parameters, and their meaning.
fn rules() -> [(Vec<(&'static str, &'static str)>, Rule); 4] {
    let angle = Some(FRAC_PI_2 - FRAC_PI_8);
    [
        (vec![], Rule { angle, ratio: Some(8.0) }),
        // Thresholds that nothing passes.
        (vec![("rho", "1e12")], Rule { angle, ratio: None }),
        (vec![("theta", "89.9999999")], Rule { angle: None, ratio: Some(8.0) }),
        // So few samples are far apart: a ratio that decides.
        (vec![("theta", "89.9999999"), ("rho", "1.5")], Rule { angle: None, ratio: Some(1.5) }),
    ]
}

#[test]
fn few_random_samples_keep_the_facets_that_the_definitions_keep() {
    let rules = rules();
    let mut spheres = [0; 4];
    let mut all = 0;
    // Without flat parts: of coplanar samples there is more than one triangulation.
    for id in ["blob", "ellipsoid", "coil", "frame", "double-torus"] {
        let built_in = medial_datasets::find(id).expect("in the catalogue");
        let mesh = built_in.mesh(built_in.default_resolution);
        for seed in 1..=4 {
            let shape = shape_of(&mesh, &format!("uniform:{SAMPLES}:{seed}"));
            all += shape.voronoi().expect("spheres").spheres.len();
            let expected = expected(&shape, &rules.clone().map(|(_, rule)| rule));
            for (k, ((set, _), (centres, faces))) in rules.iter().zip(expected).enumerate() {
                let found = at(&shape, set, Level::Published).mesh;
                let name = format!("{id}, seed {seed}, {set:?}");
                let sizes = (found.spheres.len(), found.faces.len());
                assert_eq!(sizes, (centres.len(), faces), "{name}");
                for centre in centres {
                    let near = |s: &Sphere| s.centre.distance(centre) < 1e-7;
                    assert!(found.spheres.iter().any(near), "{name}: {centre}");
                }
                spheres[k] += sizes.0;
            }
        }
    }
    // Each rule decides something.
    let [both, angle, ratio, long] = spheres;
    assert!(ratio < angle && angle <= both && both < all, "{spheres:?} of {all}");
    assert!(0 < long && long < all, "{spheres:?} of {all}");
}
