//! Average outward flux: closed forms, known axes, topology, losses, the published level, refusals.

use std::collections::BTreeMap;

use medial::Vec3;
use medial::complex::{betti, cubical_betti};
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, RunContext, Simplified, SimplifyError};
use medial::surface::{self, TriMesh, TriangleBvh};
use medial_datasets::BuiltIn;
use medial_methods::Result;
use medial_methods::aof::{
    self, Descent, Grid, LatticeSetting, LatticeVoxels, Rules, Solid, Sphere, Spiral, Surface,
    Voxel, Wanted,
};

use crate::common::{self, cuboid, default_shape, params as settings, shape_of};

fn own(shape: &Shape, resolution: u32) -> Solid<'_> {
    Solid::new(shape, LatticeSetting::own(resolution), RunContext::default()).expect("faces")
}

const HALF: Vec3 = Vec3::new(1.5, 1.0, 0.5);

/// With the parameters of a text such as `resolution=50`.
fn simplified(shape: &Shape, text: &str, level: Level) -> Result<Simplified> {
    let set: Vec<_> = text.split(' ').filter_map(|pair| pair.split_once('=')).collect();
    aof::method().prepare(shape, &settings(&set), &RunContext::default())?.at(level)
}

/// Flux through a sphere of radius `sigma` in the box.
fn flux_in_box(spiral: Spiral, samples: usize, sigma: f64, centre: Vec3) -> f64 {
    // Lengths of a shape are fractions of its diagonal.
    let shape = shape_of(&cuboid(HALF));
    let normal = shape.normalisation();
    let (sphere, centre) =
        (Sphere::new(spiral, samples, sigma / normal.diagonal), normal.forward(centre));
    Surface::of(&shape).expect("faces").flux(&sphere, centre, 0)
}

/// Depths of a centre below the faces of the box, in its own units: along x, y, z.
fn depths(grid: &Grid, diagonal: f64, voxel: &Voxel) -> Vec3 {
    HALF - (grid.centre(voxel.place) * diagonal).abs()
}

/// The paper prints -0.3315 for a sheet between two voxels. Midway the closed form gives -0.375; its
/// classic spiral scatters around that with the orientation, and the printed value is that of an
/// offset of 0.58 sigma.
#[test]
fn sheets_of_the_box_have_the_flux_of_the_paper() {
    let shape = shape_of(&cuboid(HALF));
    let diagonal = shape.normalisation().diagonal;
    // 99 voxels: 33 across the thickness, so that the middle sheet runs through centres. 90 voxels:
    // it runs midway between them.
    for (resolution, offset, flux, tolerance) in [(99, 0.0, 0.5, 0.012), (90, 0.5, 0.375, 0.03)] {
        let descent = own(&shape, resolution).descend(resolution, Wanted::All);
        let Descent { grid, voxels, .. } = descent.expect("fits");
        let sigma = grid.side * diagonal;
        // Away from seams, where two depths are the same, by 2 sigma.
        let seam = 2.0 * 2.0_f64.sqrt() * sigma;
        let (mut middle, mut inclined) = (0, 0);
        for voxel in voxels.iter() {
            let Vec3 { x, y, z } = depths(&grid, diagonal, &voxel);
            if (HALF.z - z - offset * sigma).abs() < 1e-9 && x.min(y) - z > seam {
                middle += 1;
                assert!((voxel.flux + flux).abs() < tolerance, "middle {voxel:?}");
            }
            let sheets = [(x, z, y), (y, z, x), (x, y, z)];
            if sheets.into_iter().any(|(a, b, c)| {
                (a - b).abs() < 1e-9 && c - a > seam && HALF.z - a > seam && a > 2.0 * sigma
            }) {
                inclined += 1;
                assert!((voxel.flux + 0.125_f32.sqrt()).abs() < 0.012, "inclined {voxel:?}");
            }
        }
        assert!(middle > 1000 && inclined > 3000, "{resolution}: {middle} {inclined}");
    }
    let offset = flux_in_box(Spiral::EqualArea, 2000, 0.01, Vec3::new(0.0, 0.0, 0.0058));
    assert!((offset + 0.3315).abs() < 0.002, "{offset}");
}

/// The axis thinned at an object angle, and the voxels that it was thinned from.
fn thinned_axis(shape: &Shape, resolution: u32, angle: f64) -> (LatticeVoxels, Descent) {
    let solid = own(shape, resolution);
    let descent = solid.descend(resolution, Wanted::All).expect("fits");
    (solid.axis(&descent, angle).expect("not cancelled"), descent)
}

/// The voxels with a flux of at most `-1/8 sin alpha`: a sheet anywhere in a voxel keeps it.
fn kept_voxels(shape: &Shape, resolution: u32, angle: f64) -> (Grid, Vec<Voxel>) {
    let Descent { grid, voxels, .. } =
        own(shape, resolution).descend(resolution, Wanted::All).expect("fits");
    let threshold = (-0.125 * angle.to_radians().sin()) as f32;
    (grid, voxels.iter().filter(|voxel| voxel.flux <= threshold).collect())
}

#[test]
fn kept_voxels_are_within_sigma_of_a_known_axis() {
    // The axis of the continuous shape is that of its mesh for flat shapes alone. The threshold
    // is below the flux that the samples give a constant field.
    for id in ["box", "plate"] {
        let built_in = medial_datasets::find(id).expect("in the catalogue");
        let shape = shape_of(&built_in.mesh(built_in.default_resolution));
        let normal = shape.normalisation();
        let axis = built_in.axis().expect("known").mesh;
        let centre = |v: u32| normal.forward(axis.spheres[v as usize].centre);
        let sheets: Vec<[Vec3; 3]> = axis.faces.iter().map(|f| f.map(centre)).collect();
        let sheets = TriangleBvh::from_triangles(&sheets).expect("sheets");
        for resolution in [60, 77, 99] {
            let (grid, kept) = kept_voxels(&shape, resolution, 30.0);
            assert!(kept.len() > 500, "{id} at {resolution}");
            for voxel in kept {
                let distance = sheets.closest(grid.centre(voxel.place)).distance;
                assert!(distance < grid.side, "{id} at {resolution}: {voxel:?}");
            }
        }
    }
}

#[test]
fn at_most_two_voxels_across_a_sheet_along_the_lattice() {
    let shape = shape_of(&cuboid(HALF));
    for resolution in [60, 61, 75, 90, 99, 100] {
        let (grid, kept) = kept_voxels(&shape, resolution, 60.0);
        let mut columns = BTreeMap::<[u16; 2], u32>::new();
        let diagonal = shape.normalisation().diagonal;
        for voxel in &kept {
            let Vec3 { x, y, z } = depths(&grid, diagonal, voxel);
            if x > z + 0.2 && y > z + 0.2 {
                *columns.entry([voxel.place[0], voxel.place[1]]).or_default() += 1;
            }
        }
        assert!(columns.len() > 100 && columns.values().all(|&count| count <= 2), "{resolution}");
    }
}

/// On lattices of a resolution, and at an angle: thinning keeps the Betti numbers of the start set, the
/// base has those of the solid, and medial meshes have those of their voxels.
fn assert_topology_is_kept(shapes: &[BuiltIn], lattices: &[(u32, f64)], counts: &[usize]) {
    let start_betti = |start: &Descent| {
        let places: Vec<_> = start.voxels.iter().map(|v| v.place.map(u32::from)).collect();
        cubical_betti(&places)
    };
    for built_in in shapes {
        let id = built_in.id;
        let shape = shape_of(&built_in.mesh(built_in.default_resolution));
        for &(resolution, angle) in lattices {
            let (axis, start) = thinned_axis(&shape, resolution, angle);
            assert_eq!(axis.betti(), start_betti(&start), "{id} {resolution}");
            let text = format!("resolution={resolution}");
            for level in [Level::Native(angle), Level::Published] {
                match simplified(&shape, &text, level) {
                    Ok(result) => assert_same_topology(&result, &format!("{id} {text} {level:?}")),
                    Err(SimplifyError::Parameter(why)) => {
                        assert!(why.contains("no voxel fits"), "{id} {text}: {why}");
                    }
                    Err(error) => panic!("{id} {text}: {error}"),
                }
            }
        }
        let base = own(&shape, 48).base().expect("fits");
        assert_eq!(base.topology, built_in.expected_betti, "{id} at {}", base.resolution);
        assert_eq!(base.topology, start_betti(&base.descent));
        for &count in counts {
            let result = simplified(&shape, "", Level::Spheres(count)).expect("a count");
            assert_same_topology(&result, &format!("{id} at {count}"));
        }
    }
}

#[test]
fn the_topology_is_kept_from_the_start_set_to_the_medial_mesh() {
    // A void, a loop, two components, and a reflex edge.
    let shapes = ["hollow-sphere", "torus", "pair", "bracket"]
        .map(|id| medial_datasets::find(id).expect("in the catalogue"));
    // Coarse start sets fall apart; a small angle leaves thick ones.
    assert_topology_is_kept(&shapes, &[(14, 30.0), (15, 30.0), (24, 3.0)], &[60]);
}

#[test]
#[ignore = "nightly"]
fn the_topology_is_kept_on_all_shapes() {
    // Those of a default comparison: voxels of all the others take minutes and show the same.
    let shapes = medial_datasets::catalogue().into_iter().filter(|shape| shape.in_default);
    let lattices = [(14, 30.0), (15, 30.0), (24, 30.0), (30, 3.0), (40, 45.0), (60, 30.0)];
    assert_topology_is_kept(&shapes.collect::<Vec<_>>(), &lattices, &[400, 60]);
}

/// Meshes with two, three and four loops. The start set has them too, or a warning names the missing ones.
#[test]
fn thinning_real_meshes_keeps_their_loops() {
    let shared = [("threeholes.off", [1, 3, 0]), ("fertility.off", [1, 4, 0])];
    let shared = shared.map(|(name, betti)| (name, medial_test_support::mesh(name), betti));
    let figure = Some(medial_test_support::free_meshes().join("figure.off"));
    for (name, path, expected) in shared.into_iter().chain([("figure.off", figure, [1, 2, 0])]) {
        let Some(path) = path else { continue };
        let shape = shape_of(&surface::read(&path).expect("a surface").mesh);
        for resolution in [20, 48] {
            let solid = own(&shape, resolution);
            let base = solid.base().expect("fits");
            let warnings = &base.diagnostics.warnings;
            let betti = base.topology;
            let warned = warnings.iter().any(|warning| warning.contains("Betti"));
            assert!(betti == expected || warned, "{name} at {resolution}: {betti:?}");
            assert!(resolution < 48 || betti == expected, "{name}: {betti:?}");
            let axis = solid.axis(&base.descent, 30.0).expect("runs");
            assert_eq!(axis.betti(), betti, "{name}");
        }
    }
}

#[test]
fn refined_spheres_are_internal_and_touch_twice() {
    let shape = default_shape("bracket");
    let tree = shape.surface_tree().expect("faces");
    let inside = shape.inside_test();
    let (axis, _) = thinned_axis(&shape, 48, 30.0);
    let sphere = Sphere::new(Spiral::EqualArea, 50, axis.grid.side);
    let mut two = 0;
    let (surface, centres) = (Surface::of(&shape).expect("faces"), axis.points());
    let all = surface.refine(&sphere, &centres, &RunContext::default()).expect("runs");
    for (refined, centre) in all.iter().zip(centres) {
        let (c, r) = (refined.ball.centre, refined.ball.radius);
        assert_eq!(inside.side(c), surface::Side::Inside);
        assert!((tree.closest(c).distance - r).abs() < 1e-15);
        assert!(c.distance(centre) <= axis.grid.side * 1.000_001);
        let [p, q] = refined.contacts;
        assert!(p.distance(c) - r < 1e-9 && q.distance(c) - r < 1e-9, "{refined:?}");
        two += usize::from(p.distance(q) > 0.5 * r);
    }
    assert!(two * 100 > axis.voxels.len() * 98, "{two} of {}", axis.voxels.len());
}

/// Betti numbers of the medial mesh and of the voxels; `what` names the case.
fn assert_same_topology(result: &Simplified, what: &str) {
    let voxels = result.extras.get::<LatticeVoxels>().expect("voxels");
    assert_eq!(voxels.voxels.len(), result.mesh.spheres.len(), "{what}");
    assert_eq!(betti(&result.mesh), voxels.betti(), "{what}");
    assert_eq!(result.mesh.check(), Ok(()), "{what}");
}

#[test]
fn voxels_carry_the_distances_of_their_centres_and_their_flux() {
    let shape = default_shape("bracket");
    let tree = shape.surface_tree().expect("faces");
    let result = simplified(&shape, "resolution=54", Level::Published).expect("published");
    let voxels = result.extras.get::<LatticeVoxels>().expect("voxels");
    for (voxel, ball) in voxels.voxels.iter().zip(&result.mesh.spheres) {
        let centre = voxels.grid.centre(voxel.place);
        assert!(centre.distance(ball.centre) < 1e-15);
        assert!((tree.closest(centre).distance - f64::from(voxel.distance)).abs() < 1e-7);
        assert!((-1.0..=-0.2).contains(&(voxel.flux - 1e-7)), "{voxel:?}");
    }
    let other = common::levels(&shape, "angle", &[], &[Level::Spheres(10)]).remove(0);
    assert!(other.expect("a count").extras.get::<LatticeVoxels>().is_none());
}

/// Over one plane, next to its border, and on sheets through and off the centre.
#[test]
fn the_flux_of_a_convex_solid_is_the_sum_over_its_nearest_planes() {
    for spiral in [Spiral::EqualArea, Spiral::Classic] {
        let sphere = Sphere::new(spiral, 50, 0.01);
        for centre in [[0.2, 0.1, 0.4], [1.4, 0.1, 0.0], [0.2, 0.1, 0.0052], [1.4, 0.1, 0.395]] {
            let centre = Vec3::from(centre);
            let flux = flux_in_box(spiral, 50, sphere.radius, centre);
            let along = |n: &Vec3| {
                let depth = HALF - (centre + *n * sphere.radius).abs();
                let least = depth.min_element();
                let axis = (0..3).find(|&axis| depth[axis] == least).expect("an axis");
                -n[axis] * (centre + *n * sphere.radius)[axis].signum()
            };
            let expected = sphere.directions.iter().map(along).sum::<f64>() / 50.0;
            assert!((flux - expected).abs() < 1e-12, "{spiral:?} {centre}: {flux} {expected}");
        }
    }
}

/// A cube with a thin square rod on its top: a limb that no Betti number shows.
fn cube_with_rod(rod: f64) -> TriMesh {
    let rings = [(0.5, -0.5), (0.5, 0.5), (rod, 0.5), (rod, 2.0)];
    let vertices = rings.into_iter().flat_map(|(half, z)| {
        [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]
            .map(|[x, y]| Vec3::new(half * x, half * y, z))
    });
    let mut faces = vec![[0, 2, 1], [0, 3, 2], [12, 13, 14], [12, 14, 15]];
    for below in [0, 4, 8] {
        for k in 0..4 {
            let [a, b] = [below + k, below + (k + 1) % 4];
            faces.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
        }
    }
    TriMesh { vertices: vertices.collect(), faces }
}

#[test]
fn a_limb_thinner_than_the_lattice_is_resolved_or_named() {
    // The lattice has voxels of 2.5 / 54 = 0.046: a rod of half width 0.03 has none.
    let shape = shape_of(&cube_with_rod(0.03));
    let result = simplified(&shape, "", Level::Native(30.0)).expect("an angle");
    let highest = |result: &Simplified| {
        let heights =
            result.mesh.spheres.iter().map(|s| shape.normalisation().backward(s.centre).z);
        heights.fold(f64::MIN, f64::max)
    };
    assert!(highest(&result) > 1.8, "{} {:?}", highest(&result), result.diagnostics);
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("instead of 54")));
    // The published rules take the lattice as it is, and a warning names the loss.
    let lost = simplified(&shape, "resolution=54", Level::Published).expect("published");
    assert!(highest(&lost) < 0.6, "{}", highest(&lost));
    let warning = lost.diagnostics.warnings.last().expect("a warning");
    assert!(warning.contains("resolution = 54: the surface at"), "{warning}");
    assert!(warning.contains("2.0000"), "the end of the rod: {warning}");
    // A rod that no affordable lattice resolves.
    let shape = shape_of(&cube_with_rod(0.002));
    let result = simplified(&shape, "", Level::Native(30.0)).expect("an angle");
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("raise resolution")));
}

#[test]
fn counts_are_met_on_coarser_and_finer_lattices() {
    // A count below that of the lattice is met on a coarser one.
    for count in [500, 100] {
        let result = simplified(&default_shape("box"), "", Level::Spheres(count)).expect("a count");
        assert_eq!(result.mesh.spheres.len(), count);
        let counts: BTreeMap<_, _> = result.diagnostics.counts.into_iter().collect();
        assert_eq!(["voxel_b0", "voxel_b1", "voxel_b2"].map(|name| counts[name]), [1, 0, 0]);
        assert!(counts["lattice"] < 60);
    }
    let text = "resolution=24";
    for id in ["bracket", "torus", "capsule"] {
        let shape = default_shape(id);
        let own = simplified(&shape, text, Level::Native(30.0)).expect("an angle");
        let count = own.mesh.spheres.len() + 57;
        let result = simplified(&shape, text, Level::Spheres(count)).expect("a count");
        assert_eq!(result.mesh.spheres.len(), count, "{id}: {:?}", result.diagnostics);
        assert_eq!(Some(betti(&result.mesh)), shape.expected_betti(), "{id}");
    }
    // A ball has one voxel on any lattice: the search for more ends with a warning.
    let result = simplified(&default_shape("sphere"), text, Level::Spheres(500)).expect("a count");
    assert!(result.mesh.spheres.len() < 500);
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("instead of 500")));
}

#[test]
fn the_published_level_has_the_rules_of_the_paper() {
    let shape = default_shape("box");
    let published = simplified(&shape, "resolution=99", Level::Published).expect("published");
    let voxels = published.extras.get::<LatticeVoxels>().expect("voxels");
    assert!(!voxels.voxels.is_empty() && voxels.voxels.iter().all(|v| v.flux <= -0.2 + 1e-7));
    let shares = [Rules::Published, Rules::Own].map(|rules| {
        let setting = LatticeSetting { rules, ..LatticeSetting::own(99) };
        let solid = Solid::new(&shape, setting, RunContext::default()).expect("faces");
        let tally = solid.descend(99, Wanted::All).expect("fits").tally;
        tally.dismissed.iter().sum::<u64>() as f64 / tally.start as f64
    });
    // From a flux of 0 on about half of the directions of a plane stay.
    assert!(shares[0] < 0.85 * shares[1], "{shares:?}");
}

#[test]
fn bad_input_is_refused_by_name() {
    let (shape, count) = (default_shape("box"), Level::Spheres(10));
    for (text, level, expected) in [
        ("resolution=5000", count, "above the limit of 2000 MB; lower resolution"),
        ("resolution=5000", Level::Published, "above the limit of 2000 MB; lower resolution"),
        ("resolution=0", count, "resolution = 0 is outside [1, 60000]"),
        ("resolution=x", count, "expected `auto` or a number of voxels"),
        ("resolution=1", Level::Published, "resolution = 1: no voxel fits into the solid; raise"),
        ("resolution=1", count, "resolution = 1 (and"),
        ("", Level::Native(0.0), "angle = 0.0 is outside (0.0, 90.0]"),
        ("", Level::Native(-10.0), "angle = -10.0 is outside (0.0, 90.0]"),
        ("", Level::Spheres(0), "expected at least 1"),
    ] {
        match simplified(&shape, text, level) {
            Err(SimplifyError::Parameter(message) | SimplifyError::Level(message)) => {
                assert!(message.contains(expected), "{text}: {message}");
            }
            other => panic!("{text}: {other:?}"),
        }
    }
    // So thin that no lattice has a voxel, or only one beyond memory.
    for height in [1e-6, 1e-3] {
        let refused = simplified(&shape_of(&cuboid(Vec3::new(1.0, 1.0, height))), "", count);
        assert!(matches!(refused, Err(SimplifyError::Parameter(_))), "{height}");
    }
}
