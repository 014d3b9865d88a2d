//! The power crusts of the built-in shapes: their topology, how far they are from the surface both ways, and
//! how deep their faces go through each other.

#![allow(clippy::print_stderr)] // What was measured is told; `--nocapture` shows it.

use medial::Vec3;
use medial::geometry::PowerCrust;
use medial::metrics::{DistanceOptions, surface_distances};
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{self, Sampling, SurfaceReport, TriMesh};
use medial_datasets::{BuiltIn, catalogue};

/// Corners nearer than this are merged, in diagonals.
const COINCIDENT: f64 = 1e-6;

/// A crust in units of the diagonal, and what was found of it.
struct Crust {
    report: SurfaceReport,
    /// From the surface to the crust, and back.
    distances: [f64; 2],
    /// Mean distance of samples: the root of the area for each.
    spacing: f64,
    crossing: f64,
    pairs: usize,
}

fn crust(built_in: &BuiltIn, count: usize) -> Crust {
    let mesh = built_in.mesh(built_in.default_resolution);
    let report = surface::validate(&mesh).expect("a solid");
    let sampling = Sampling::BlueNoise { count, seed: 1 };
    let options = ShapeOptions { sampling, ..ShapeOptions::default() };
    let shape = Shape::new(built_in.id, &mesh, report, options).expect("an extent");
    let balls = shape.polar_balls().expect("samples span space");
    let made = surface::crust_surface(
        &PowerCrust::new(&balls.inner, &balls.outer).expect("balls"),
        COINCIDENT,
    )
    .mesh;
    let tree = shape.surface_tree().expect("faces");
    let options =
        DistanceOptions { surface_samples: 20_000, envelope_samples: 20_000, ..Default::default() };
    let apart = surface_distances(shape.mesh(), &tree, &made, &options).expect("both have area");
    let area = shape.report().area.expect("finite") / shape.normalisation().diagonal.powi(2);
    let (crossing, pairs) = deepest_crossing(&made);
    Crust {
        report: surface::validate(&made).expect("a closed manifold"),
        distances: [apart.forward, apart.reverse],
        spacing: (area / count as f64).sqrt(),
        crossing,
        pairs,
    }
}

/// How deep an edge of one face goes through another one, at most, and how many pairs of faces do so.
fn deepest_crossing(mesh: &TriMesh) -> (f64, usize) {
    let corners: Vec<[Vec3; 3]> = (0..mesh.faces.len()).map(|f| mesh.triangle(f)).collect();
    let bounds = |t: &[Vec3; 3]| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
    let mut order: Vec<usize> = (0..corners.len()).collect();
    order.sort_by(|&f, &g| bounds(&corners[f]).0.x.total_cmp(&bounds(&corners[g]).0.x));
    let (mut deepest, mut pairs) = (0.0_f64, 0);
    for (place, &f) in order.iter().enumerate() {
        let (lo, hi) = bounds(&corners[f]);
        for &g in &order[place + 1..] {
            let (l, h) = bounds(&corners[g]);
            if l.x > hi.x {
                break;
            }
            if !(l.cmple(hi).all() && h.cmpge(lo).all()) {
                continue;
            }
            let depth = crossing(mesh.faces[f], corners[f], mesh.faces[g], corners[g]);
            deepest = deepest.max(depth);
            pairs += usize::from(depth > 0.0);
        }
    }
    (deepest, pairs)
}

/// How deep edges of one of two faces that have not both ends in the other go through it.
fn crossing(f: [u32; 3], s: [Vec3; 3], g: [u32; 3], t: [Vec3; 3]) -> f64 {
    let through = |a: [u32; 3], edges: [Vec3; 3], b: [u32; 3], face: [Vec3; 3]| {
        let free = (0..3).filter(|&i| !b.contains(&a[i]) && !b.contains(&a[(i + 1) % 3]));
        free.map(|i| depth([edges[i], edges[(i + 1) % 3]], face)).fold(0.0, f64::max)
    };
    through(f, s, g, t).max(through(g, t, f, s))
}

/// How far a segment reaches through a triangle: no farther than its nearer end is from the plane, nor than
/// the crossing is from the triangle's sides.
fn depth([p, q]: [Vec3; 2], [a, b, c]: [Vec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    if normal.length() < 1e-14 {
        return 0.0;
    }
    let normal = normal.normalize();
    let [above, below] = [p, q].map(|end| normal.dot(end - a));
    if above * below >= 0.0 {
        return 0.0;
    }
    let at = p.lerp(q, above / (above - below));
    let inwards = |[u, v]: [Vec3; 2]| normal.cross(v - u).normalize_or_zero().dot(at - u);
    let to_sides = [[a, b], [b, c], [c, a]].map(inwards).into_iter().fold(f64::INFINITY, f64::min);
    above.abs().min(below.abs()).min(to_sides).max(0.0)
}

#[test]
fn crossings_are_as_deep_as_they_are() {
    let face = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let upright = |x: f64, low: f64, high: f64| {
        depth([Vec3::new(x, 0.2, low), Vec3::new(x, 0.2, high)], face)
    };
    assert_eq!(upright(0.2, 0.1, 0.5), 0.0);
    assert!((upright(0.2, -0.1, 0.5) - 0.1).abs() < 1e-15);
    assert!((upright(0.05, -0.1, 0.5) - 0.05).abs() < 1e-15);
    assert_eq!(upright(0.9, -0.1, 0.5), 0.0);
}

#[test]
fn the_crusts_of_the_built_in_shapes_have_their_topology_and_come_near() {
    for built_in in catalogue() {
        let wanted = built_in.expected_betti.map(|n| n as usize);
        let mut coarser = [f64::INFINITY; 2];
        for count in [2_000, 8_000] {
            let name = format!("{}, {count} samples", built_in.id);
            let Crust { report, distances, spacing, crossing, pairs } = crust(&built_in, count);
            eprintln!(
                "{name}: {spacing:.1e} apart; to the crust {:.1e}, back {:.1e}; {pairs} crossings, the \
                 deepest {crossing:.0e}",
                distances[0], distances[1]
            );
            assert_eq!(report.expected_betti, Some(wanted), "{name}");
            for (found, before) in distances.into_iter().zip(coarser) {
                // At a sharp edge without samples the crust is a sample's spacing off. At the wedge's edge of 40
                // degrees the faces are a spacing apart 1.5 spacings from it, and at its ends there is a third.
                let sharpness = if built_in.id == "wedge" { 2.0 } else { 1.0 };
                assert!(found < sharpness * spacing, "{name}: {found}");
                // Half as far apart.
                assert!(found < 0.85 * before, "{name}: {found} after {before}");
            }
            // The facets of a power diagram cross nowhere but for rounding, and for what merging corners moved.
            assert!(crossing < COINCIDENT, "{name}: {crossing}");
            coarser = distances;
        }
    }
}
