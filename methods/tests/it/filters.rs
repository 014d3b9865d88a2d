//! The variants of the angle filter and the lambda-medial axis: thresholds on boxes, ties, levels.

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::shape::Shape;
use medial::simplifier::{Level, RunContext, SimplifyError};

use crate::common::{FACET, at, built_in, default_shape, levels, params, shape, shape_of};

/// A solid box around the origin, in the shape's units: its half sides, descending, and how far a point
/// is from the central rectangle.
struct Cuboid {
    middle: Vec3,
    half: Vec3,
    thinnest: usize,
}

impl Cuboid {
    fn of(shape: &Shape) -> Self {
        let (lo, hi) = shape.mesh().bounding_box().expect("vertices");
        let half = (hi - lo) / 2.0;
        let thinnest = (0..3).min_by(|&a, &b| half[a].total_cmp(&half[b])).expect("three");
        Self { middle: lo.midpoint(hi), half, thinnest }
    }

    fn rectangle(&self) -> Vec3 {
        let mut reach = self.half - Vec3::splat(self.half[self.thinnest]);
        reach[self.thinnest] = 0.0;
        reach
    }

    fn off_rectangle(&self, x: Vec3) -> f64 {
        let (reach, x) = (self.rectangle(), x - self.middle);
        x.distance(x.clamp(-reach, reach))
    }

    /// The farthest of some points of the rectangle from all spheres.
    fn uncovered(&self, mesh: &MedialMesh) -> f64 {
        let reach = self.rectangle();
        let steps = 12;
        let points = (0..=steps).flat_map(|i| (0..=steps).map(move |j| (i, j)));
        let far = points.map(|(i, j)| {
            let mut p = reach;
            let axes = [1, 2].map(|k| (self.thinnest + k) % 3);
            for (axis, n) in axes.into_iter().zip([i, j]) {
                p[axis] *= 2.0 * f64::from(n) / f64::from(steps) - 1.0;
            }
            let p = self.middle + p;
            mesh.spheres.iter().map(|s| s.centre.distance(p)).fold(f64::INFINITY, f64::min)
        });
        far.fold(0.0, f64::max)
    }
}

/// The longest edge of the surface: the spacing of its samples.
fn spacing(shape: &Shape) -> f64 {
    let mesh = shape.mesh();
    let edges = (0..mesh.faces.len()).flat_map(|f| {
        let [a, b, c] = mesh.triangle(f);
        [a.distance(b), b.distance(c), c.distance(a)]
    });
    edges.fold(0.0, f64::max)
}

#[test]
fn the_axis_above_a_right_angle_is_the_central_rectangle_of_a_box() {
    let shape = shape("box", 90);
    let (cuboid, h) = (Cuboid::of(&shape), spacing(&shape));
    for set in [FACET, &[]] {
        let mesh = at(&shape, "angle", set, Level::Native(110.0));
        assert!(!mesh.faces.is_empty());
        let closed = set.is_empty() || mesh.faces.iter().flatten().count() >= mesh.spheres.len();
        assert!(closed, "facets and closure");
        for sphere in &mesh.spheres {
            let off = cuboid.off_rectangle(sphere.centre);
            // Contacts are samples: an angle scatters by about h / r.
            let resolved = 2.0 * h / 20.0_f64.to_radians();
            assert!(off < 2.0 * h || sphere.radius < resolved, "{set:?}: {sphere:?} {off}");
        }
        assert!(cuboid.uncovered(&mesh) < 3.0 * h, "{set:?}");
        // Below a right angle the sheets of the edges are there: some sphere is far off.
        let mesh = at(&shape, "angle", set, Level::Native(60.0));
        let off = mesh.spheres.iter().filter(|s| s.radius > 3.0 * h);
        let off = off.map(|s| cuboid.off_rectangle(s.centre)).fold(0.0, f64::max);
        assert!(off > 2.0 * h, "{set:?}: {off}");
    }
}

#[test]
fn kept_items_among_ties_are_spread_over_the_shape() {
    // All facets of the middle sheet tie, and cut by their numbers they would be one end of it.
    let shape = default_shape("plate");
    let cuboid = Cuboid::of(&shape);
    let all = [("angle", FACET), ("angle", &[]), ("lambda", &[])];
    for (method, set) in all {
        let mesh = at(&shape, method, set, Level::Spheres(150));
        let uncovered = cuboid.uncovered(&mesh) / cuboid.rectangle().length();
        assert!(uncovered < 0.5, "{method} {set:?}: {uncovered}");
    }
}

#[test]
fn variants_of_voronoi_facets_refuse_a_given_mesh() {
    let mesh = built_in("box");
    let given = shape_of(&mesh).voronoi().expect("a mesh");
    let shape = shape_of(&mesh);
    let shape = {
        let back = *shape.normalisation();
        shape_of(&mesh).with_initial(&given.to_input(&back))
    };
    for (method, set) in [("angle", FACET), ("dey-zhao", &[])] {
        let method = medial_methods::find(method).expect("registered");
        let refused = method.prepare(&shape, &params(set), &RunContext::default()).err();
        assert!(matches!(refused, Some(SimplifyError::Unsupported { .. })), "{set:?}");
    }
}

// ----------------------------------------------------------------------------
// The levels that they support, and how they meet a number of spheres.

#[test]
fn counts_are_met_from_below_or_with_a_warning() {
    let shape = default_shape("bracket");
    for (method, set) in [("angle", FACET), ("lambda", &[])] {
        let wanted = [600, 100, 20].map(Level::Spheres);
        for (found, count) in levels(&shape, method, set, &wanted).into_iter().zip([600, 100, 20]) {
            let found = found.expect("a count");
            let reached = found.mesh.spheres.len();
            assert!(reached > 0 && (reached == count || !found.diagnostics.warnings.is_empty()));
            assert!(reached <= count, "{method} {set:?}: {reached} for {count}");
        }
        let refused = levels(&shape, method, set, &[Level::Spheres(0)]).remove(0);
        assert!(matches!(refused, Err(SimplifyError::Level(_))), "{method} {set:?}");
    }
}

#[test]
fn the_published_level_is_announced_and_is_a_native_one() {
    let shape = default_shape("bracket");
    for (method, set) in [("angle", FACET), ("angle", &[]), ("lambda", &[])] {
        let published =
            levels(&shape, method, set, &[Level::Published]).remove(0).expect("a level");
        let warnings = &published.diagnostics.warnings;
        assert!(warnings.iter().any(|w| w.starts_with("no single level is published; this is ")));
        assert!(!published.mesh.spheres.is_empty(), "{method} {set:?}");
        let native = Level::Native(published.native_level.expect("a native level"));
        assert_eq!(published.mesh, at(&shape, method, set, native), "{method} {set:?}");
    }
    let lambda = levels(&shape, "lambda", &[], &[Level::Published]).remove(0).expect("a level");
    let axis = shape.voronoi().expect("a mesh");
    let sides = [0, 1, 2].map(|k| {
        let along = axis.spheres.iter().map(|s| s.centre[k]);
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    });
    let longest = sides.into_iter().fold(0.0, f64::max);
    assert_eq!(lambda.native_level, Some(0.02 * longest));
}
