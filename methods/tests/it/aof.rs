//! Average outward flux: closed forms, known axes, topology, losses, the published level, refusals.

use medial::Vec3;
use medial::complex::{self, betti, cubical_betti};
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified, SimplifyError};
use medial::surface::{self, TriMesh, TriangleBvh};
use medial_datasets::BuiltIn;
use medial_methods::aof::{
    self, AofParams, Axis, Descent, Dismiss, Grid, LatticeVoxels, Solid, Sphere, Spiral, Surface,
    Variant, Voxel, Wanted,
};

fn shape_of(mesh: &TriMesh) -> Shape {
    let report = surface::validate(mesh).expect("a solid");
    Shape::new("shape", mesh, report, ShapeOptions::default()).expect("an extent")
}

fn built_in(id: &str) -> Shape {
    let shape = medial_datasets::find(id).expect("in the catalogue");
    shape_of(&shape.mesh(shape.default_resolution))
}

fn solid<'s>(shape: &'s Shape, params: &AofParams) -> Solid<'s> {
    Solid::new(shape, params.clone(), RunContext::default()).expect("faces")
}

/// A box with half sides `half`, as twelve triangles.
fn cuboid(half: Vec3) -> TriMesh {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        half * Vec3::new(side(0), side(1), side(2))
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriMesh {
        vertices: (0..8).map(corner).collect(),
        faces: quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}

const HALF: Vec3 = Vec3::new(1.5, 1.0, 0.5);

fn simplified(
    shape: &Shape,
    set: &[(&str, &str)],
    level: Level,
) -> Result<Simplified, SimplifyError> {
    let mut params = Params::none();
    set.iter().for_each(|(key, value)| params.set(key, value));
    aof::method().prepare(shape, &params, &RunContext::default())?.at(level)
}

/// Bytes of a result: everything that is written.
fn bytes_of(result: &Simplified) -> Vec<u64> {
    let ball = |s: &complex::Sphere| [s.centre.x, s.centre.y, s.centre.z, s.radius];
    let simplices = result.mesh.edges.iter().flatten().chain(result.mesh.faces.iter().flatten());
    let voxels = result.extras.get::<LatticeVoxels>().into_iter().flat_map(|voxels| &voxels.voxels);
    let balls = result.mesh.spheres.iter().flat_map(ball).map(f64::to_bits);
    balls
        .chain(simplices.map(|&v| u64::from(v)))
        .chain(voxels.flat_map(|v| [v.distance.to_bits(), v.flux.to_bits()]))
        .collect()
}

fn params(variant: Variant) -> AofParams {
    AofParams { variant, ..AofParams::default() }
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

#[test]
fn a_plane_and_a_corner_of_45_degrees_have_their_closed_forms() {
    for spiral in [Spiral::EqualArea, Spiral::Classic] {
        let sigma = 0.01;
        // A sheet at distance t sigma from the centre: -1/2 (1 - t^2) sin alpha. Off the centre the
        // field jumps where it is not tangent, which samples resolve less well.
        for t in [0.0, 0.3, 0.6, 0.9] {
            let tolerance = if t == 0.0 { 0.002 } else { 0.007 };
            let expected = -0.5 * (1.0 - t * t);
            let middle = flux_in_box(spiral, 500, sigma, Vec3::new(0.1, 0.2, t * sigma));
            assert!((middle - expected).abs() < tolerance, "{spiral:?} {t}: {middle}");
            let depth = 0.2;
            let across = Vec3::new(1.0, 0.0, -1.0).normalize() * (t * sigma);
            let on_sheet = Vec3::new(HALF.x - depth, 0.1, HALF.z - depth);
            let corner = flux_in_box(spiral, 500, sigma, on_sheet + across);
            let expected = expected * 0.5_f64.sqrt();
            assert!((corner - expected).abs() < tolerance, "{spiral:?} {t}: {corner}");
        }
    }
}

/// The box `3 x 2 x 1` with `resolution` voxels along its longest side.
fn box_flux(resolution: u32) -> (Grid, f64, Vec<Voxel>) {
    let shape = shape_of(&cuboid(HALF));
    let solid = solid(&shape, &params(Variant::Plain));
    let descent = solid.descend(resolution, Wanted::Kept).expect("fits");
    let diagonal = shape.normalisation().diagonal;
    (solid.grid(resolution), diagonal, descent.voxels.iter().collect())
}

/// Depths of a centre below the faces of the box, in its own units: along x, y, z.
fn depths(grid: &Grid, diagonal: f64, voxel: &Voxel) -> Vec3 {
    HALF - (grid.centre(voxel.place) * diagonal).abs()
}

#[test]
fn sheets_of_the_box_have_the_flux_of_the_paper() {
    // 99 voxels: 33 across the thickness, so that the middle sheet runs through centres.
    let (grid, diagonal, voxels) = box_flux(99);
    let sigma = grid.side * diagonal;
    let (mut middle, mut inclined) = (0, 0);
    for voxel in &voxels {
        let Vec3 { x, y, z } = depths(&grid, diagonal, voxel);
        // Away from seams, where x or y is as deep as z, by 2 sigma.
        let far = |a: f64, b: f64| a - b > 2.0 * 2.0_f64.sqrt() * sigma;
        if (z - HALF.z).abs() < 1e-9 && far(x, z) && far(y, z) {
            middle += 1;
            assert!((voxel.flux + 0.5).abs() < 0.012, "middle {voxel:?}");
        }
        let sheet = |a: f64, b: f64, c: f64, limit: f64| {
            (a - b).abs() < 1e-9
                && far(c, a)
                && limit - a > 2.0 * 2.0_f64.sqrt() * sigma
                && a > 2.0 * sigma
        };
        if sheet(x, z, y, HALF.z) || sheet(y, z, x, HALF.z) || sheet(x, y, z, HALF.z) {
            inclined += 1;
            assert!((voxel.flux + 0.125_f32.sqrt()).abs() < 0.012, "inclined {voxel:?}");
        }
    }
    assert!(middle > 1000 && inclined > 3000, "{middle} {inclined}");
}

/// The paper prints -0.3315 for a sheet between two voxels. Midway the closed form gives -0.375; its
/// classic spiral scatters around that with the orientation, and the printed value is that of an
/// offset of 0.58 sigma.
#[test]
fn a_sheet_midway_between_voxels_has_three_quarters_of_the_flux() {
    let (grid, diagonal, voxels) = box_flux(90);
    let sigma = grid.side * diagonal;
    let mut midway = 0;
    for voxel in &voxels {
        let Vec3 { x, y, z } = depths(&grid, diagonal, voxel);
        let far = |a: f64, b: f64| a - b > 2.0 * 2.0_f64.sqrt() * sigma;
        if (HALF.z - z - 0.5 * sigma).abs() < 1e-9 && far(x, z) && far(y, z) {
            midway += 1;
            assert!((voxel.flux + 0.375).abs() < 0.03, "{voxel:?}");
        }
    }
    assert!(midway > 2000);
    let offset = flux_in_box(Spiral::EqualArea, 2000, 0.01, Vec3::new(0.0, 0.0, 0.0058));
    assert!((offset + 0.3315).abs() < 0.002, "{offset}");
}

fn axis_at(shape: &Shape, params: &AofParams, resolution: u32, angle: f64) -> (Axis, Descent) {
    let wanted = if params.variant == Variant::Plain { Wanted::Kept } else { Wanted::All };
    let solid = solid(shape, params);
    let descent = solid.descend(resolution, wanted).expect("fits");
    (solid.axis(resolution, &descent, angle).expect("not cancelled"), descent)
}

#[test]
fn kept_voxels_are_within_sigma_of_a_known_axis() {
    // The axis of the continuous shape is that of its mesh for flat shapes alone. The threshold
    // is below what the samples make of a constant field.
    for id in ["box", "plate"] {
        let built_in = medial_datasets::find(id).expect("in the catalogue");
        let shape = shape_of(&built_in.mesh(built_in.default_resolution));
        let normal = shape.normalisation();
        let axis = built_in.axis().expect("known").mesh;
        let centre = |v: u32| normal.forward(axis.spheres[v as usize].centre);
        let sheets: Vec<[Vec3; 3]> = axis.faces.iter().map(|f| f.map(centre)).collect();
        let sheets = TriangleBvh::from_triangles(&sheets).expect("sheets");
        for resolution in [60, 77, 99] {
            let (kept, _) = axis_at(&shape, &params(Variant::Plain), resolution, 30.0);
            assert!(kept.voxels.len() > 500, "{id} at {resolution}");
            for point in kept.points() {
                let distance = sheets.closest(point).distance;
                assert!(distance < kept.grid.side, "{id} at {resolution}: {point}");
            }
        }
    }
}

#[test]
fn at_most_two_voxels_across_a_sheet_along_the_lattice() {
    let shape = shape_of(&cuboid(HALF));
    for resolution in [60, 61, 75, 90, 99, 100] {
        let (kept, _) = axis_at(&shape, &params(Variant::Plain), resolution, 60.0);
        let mut columns = std::collections::BTreeMap::<[u16; 2], u32>::new();
        let diagonal = shape.normalisation().diagonal;
        for voxel in &kept.voxels {
            let Vec3 { x, y, z } = depths(&kept.grid, diagonal, voxel);
            if x > z + 0.2 && y > z + 0.2 {
                *columns.entry([voxel.place[0], voxel.place[1]]).or_default() += 1;
            }
        }
        assert!(columns.len() > 100 && columns.values().all(|&count| count <= 2), "{resolution}");
    }
}

/// The shapes of a default comparison: voxels of all the others take minutes and tell the same.
fn usual_shapes() -> impl Iterator<Item = BuiltIn> {
    medial_datasets::catalogue().into_iter().filter(|shape| shape.in_default)
}

#[test]
fn homotopic_variants_keep_the_topology_of_the_start_set() {
    for shape in usual_shapes() {
        let (id, expected) = (shape.id, shape.expected_betti);
        let shape = shape_of(&shape.mesh(shape.default_resolution));
        for variant in [Variant::Homotopy, Variant::Thinning] {
            // Coarse lattices too, where the start set falls apart.
            for resolution in [15, 24, 60] {
                let (axis, start) = axis_at(&shape, &params(variant), resolution, 30.0);
                let places: Vec<_> = start.voxels.iter().map(|v| v.place.map(u32::from)).collect();
                assert_eq!(axis.betti(), cubical_betti(&places), "{id} {variant:?} {resolution}");
                assert!(axis.voxels.len() <= places.len());
            }
            let params = AofParams { resolution: 48, ..params(variant) };
            let base = solid(&shape, &params).base().expect("fits");
            let voxels = base.descent.voxels.iter();
            let places: Vec<_> = voxels.map(|v| v.place.map(u32::from)).collect();
            let betti = cubical_betti(&places);
            let warnings = &base.diagnostics.warnings;
            assert!(betti == expected || warnings.iter().any(|w| w.contains("Betti")), "{id}");
            assert!(betti == expected, "{id} at {}: {betti:?}", base.resolution);
            assert_eq!(base.topology, Some(betti));
        }
    }
}

/// Shared meshes: three holes, and four. The start set has them too, or a warning says where not.
#[test]
fn homotopy_on_shared_meshes_keeps_their_loops() {
    for (name, expected) in [("threeholes.off", [1, 3, 0]), ("fertility.off", [1, 4, 0])] {
        let Some(path) = medial_test_support::mesh(name) else { continue };
        let shape = shape_of(&surface::read(&path).expect("a surface").mesh);
        for variant in [Variant::Homotopy, Variant::Thinning] {
            for resolution in [20, 48] {
                let solid = solid(&shape, &AofParams { resolution, ..params(variant) });
                let base = solid.base().expect("fits");
                let warnings = &base.diagnostics.warnings;
                let betti = base.topology.expect("kept");
                assert!(
                    betti == expected || warnings.iter().any(|w| w.contains("thinner than")),
                    "{name} at {resolution}: {betti:?} {warnings:?}"
                );
                assert!(resolution < 48 || betti == expected, "{name}: {betti:?}");
                let axis = solid.axis(base.resolution, &base.descent, 30.0).expect("runs");
                assert_eq!(axis.betti(), betti, "{name} {variant:?}");
            }
        }
    }
}

#[test]
fn refined_spheres_are_internal_and_touch_twice() {
    let shape = built_in("bracket");
    let tree = shape.surface_tree().expect("faces");
    let inside = shape.inside_test();
    let (axis, _) = axis_at(&shape, &params(Variant::Thinning), 48, 30.0);
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
fn medial_meshes_have_the_betti_numbers_of_their_voxels() {
    for built_in in usual_shapes() {
        let shape = shape_of(&built_in.mesh(built_in.default_resolution));
        for variant in ["plain", "homotopy", "thinning"] {
            // Coarse ones fall apart; a small angle leaves thick ones.
            for (resolution, angle) in [("14", 30.0), ("30", 3.0), ("40", 45.0)] {
                let set = [("variant", variant), ("resolution", resolution), ("refine", "false")];
                let what = format!("{} {set:?} {angle}", built_in.id);
                match simplified(&shape, &set, Level::Native(angle)) {
                    Ok(result) => assert_same_topology(&result, &what),
                    Err(SimplifyError::Parameter(why)) => {
                        assert!(why.contains("thinner than a voxel"), "{what}: {why}");
                    }
                    Err(error) => panic!("{what}: {error}"),
                }
            }
        }
        for count in [400, 60] {
            let result = simplified(&shape, &[], Level::Spheres(count)).expect("a count");
            assert_same_topology(&result, &format!("{} at {count}", built_in.id));
        }
    }
}

#[test]
fn voxels_carry_the_distances_of_their_centres_and_their_flux() {
    let shape = built_in("bracket");
    let tree = shape.surface_tree().expect("faces");
    let set = [("variant", "plain"), ("refine", "false")];
    let result = simplified(&shape, &set, Level::Native(30.0)).expect("an angle");
    let voxels = result.extras.get::<LatticeVoxels>().expect("voxels");
    for (voxel, ball) in voxels.voxels.iter().zip(&result.mesh.spheres) {
        let centre = voxels.centre(voxel);
        assert!(centre.distance(ball.centre) < 1e-15);
        assert!((tree.closest(centre).distance - voxel.distance).abs() < 1e-7);
        assert!((-1.0..=-0.125 * 0.5).contains(&(voxel.flux - 1e-7)), "{voxel:?}");
    }
    let angle = built_in("box");
    let run = RunContext::default();
    let other = medial_methods::find("angle").expect("a method");
    let mut other = other.prepare(&angle, &Params::none(), &run).expect("prepared");
    assert!(other.at(Level::Spheres(10)).expect("a count").extras.get::<LatticeVoxels>().is_none());
}

/// Closed forms over one plane, and next to its border.
#[test]
fn the_flux_of_a_convex_solid_is_the_sum_over_its_nearest_planes() {
    let sphere = Sphere::new(Spiral::Classic, 50, 0.01);
    for centre in [[0.2, 0.1, 0.4], [1.4, 0.1, 0.0], [0.2, 0.1, 0.005], [1.4, 0.1, 0.395]] {
        let centre = Vec3::from(centre);
        let flux = flux_in_box(Spiral::Classic, 50, sphere.radius, centre);
        let along = |n: &Vec3| {
            let depth = HALF - (centre + *n * sphere.radius).abs();
            let least = depth.min_element();
            let axis = (0..3).find(|&axis| depth[axis] == least).expect("an axis");
            -n[axis] * (centre + *n * sphere.radius)[axis].signum()
        };
        let expected = sphere.directions.iter().map(along).sum::<f64>() / 50.0;
        assert!((flux - expected).abs() < 1e-12, "{centre}: {flux} {expected}");
    }
}

#[test]
fn one_and_two_threads_give_the_same_bytes() {
    let shape = built_in("bracket");
    for variant in ["plain", "homotopy", "thinning"] {
        for level in [Level::Native(25.0), Level::Spheres(150)] {
            let with = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                pool.expect("a pool").install(|| {
                    let set = [("variant", variant), ("resolution", "50")];
                    bytes_of(&simplified(&shape, &set, level).expect("a result"))
                })
            };
            let one = with(1);
            assert!(one.len() > 500);
            assert!([2, 3].iter().all(|&threads| with(threads) == one), "{variant} {level:?}");
        }
    }
}

#[test]
fn counts_are_met_with_one_component_and_a_coarse_lattice() {
    let shape = built_in("box");
    for count in [500, 100] {
        let result = simplified(&shape, &[], Level::Spheres(count)).expect("a count");
        assert_eq!(result.mesh.spheres.len(), count);
        let of =
            |name: &str| result.diagnostics.counts.iter().find(|(n, _)| n == name).map(|c| c.1);
        assert_eq!([of("voxel_b0"), of("voxel_b1"), of("voxel_b2")], [Some(1), Some(0), Some(0)]);
        assert!(of("lattice") < Some(60));
    }
}

#[test]
fn larger_angles_leave_fewer_voxels() {
    let shape = built_in("torus");
    for variant in ["plain", "homotopy", "thinning"] {
        let set = [("variant", variant), ("resolution", "40")];
        let mut prepared = {
            let mut params = Params::none();
            set.iter().for_each(|(key, value)| params.set(key, value));
            let run = RunContext::default();
            aof::method().prepare(&shape, &params, &run).expect("prepared")
        };
        let counts = [5.0, 30.0, 60.0, 90.0]
            .map(|angle| prepared.at(Level::Native(angle)).expect("an angle").mesh.spheres.len());
        assert!(counts.windows(2).all(|pair| pair[0] >= pair[1]), "{variant}: {counts:?}");
        assert!(counts[0] > counts[3], "{variant}: {counts:?}");
    }
}

/// A ball with a thin rod, closed: a limb that no Betti number tells of.
fn lollipop(rod: f64) -> TriMesh {
    let (around, profile) = (24_u32, {
        let ball = (0..20).map(|k| {
            let angle = f64::from(k) / 20.0 * (std::f64::consts::PI - (rod / 0.5).asin());
            (0.5 * angle.sin(), -0.5 * angle.cos())
        });
        let stick = (0..=20).map(|k| (rod, 0.5 + 1.5 * f64::from(k) / 20.0));
        ball.chain(stick).collect::<Vec<_>>()
    });
    let mut mesh = TriMesh { vertices: vec![Vec3::new(0.0, 0.0, -0.5)], faces: vec![] };
    for &(radius, z) in &profile[1..] {
        mesh.vertices.extend((0..around).map(|k| {
            let (sin, cos) = (f64::from(k) / f64::from(around) * std::f64::consts::TAU).sin_cos();
            Vec3::new(radius * cos, radius * sin, z)
        }));
    }
    let rings = profile.len() as u32 - 1;
    let at = |ring: u32, k: u32| 1 + ring * around + k % around;
    let top = mesh.vertices.len() as u32;
    mesh.vertices.push(Vec3::new(0.0, 0.0, 2.0));
    for k in 0..around {
        mesh.faces.push([0, at(0, k + 1), at(0, k)]);
        for ring in 0..rings - 1 {
            let [a, b] = [at(ring, k), at(ring, k + 1)];
            let [c, d] = [at(ring + 1, k + 1), at(ring + 1, k)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
        mesh.faces.push([top, at(rings - 1, k), at(rings - 1, k + 1)]);
    }
    mesh
}

#[test]
fn a_limb_thinner_than_the_lattice_is_resolved_or_named() {
    // The lattice has voxels of 2.5 / 54 = 0.046: a rod of radius 0.03 has none.
    let shape = shape_of(&lollipop(0.03));
    let result = simplified(&shape, &[], Level::Native(30.0)).expect("an angle");
    let highest = |result: &Simplified| {
        let heights =
            result.mesh.spheres.iter().map(|s| shape.normalisation().backward(s.centre).z);
        heights.fold(f64::MIN, f64::max)
    };
    assert!(highest(&result) > 1.8, "{} {:?}", highest(&result), result.diagnostics);
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("instead of 54")));
    // The plain rule takes the lattice as it is, and says what it would take; that holds.
    let plain = [("variant", "plain")];
    let lost = simplified(&shape, &plain, Level::Native(30.0)).expect("an angle");
    assert!(highest(&lost) < 0.6, "{}", highest(&lost));
    let warning = lost.diagnostics.warnings.iter().find(|w| w.contains("away from every voxel"));
    let warning = warning.unwrap_or_else(|| panic!("{:?}", lost.diagnostics));
    assert!(warning.contains("2.0000"), "the end of the rod: {warning}");
    let needed = warning.rsplit("resolution = ").next().expect("a resolution");
    let finer = [("variant", "plain"), ("resolution", needed)];
    let found = simplified(&shape, &finer, Level::Native(30.0)).expect("an angle");
    assert!(highest(&found) > 1.8, "{warning} {:?}", found.diagnostics);
    // A rod that no affordable lattice resolves is named with what it takes.
    let shape = shape_of(&lollipop(0.002));
    let result = simplified(&shape, &[], Level::Native(30.0)).expect("an angle");
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("max_memory = ")));
}

#[test]
fn a_count_above_that_of_the_lattice_is_met_on_a_finer_one() {
    for id in ["bracket", "torus", "capsule"] {
        let shape = built_in(id);
        let default = simplified(&shape, &[], Level::Native(30.0)).expect("an angle");
        let count = default.mesh.spheres.len() + 137;
        let result = simplified(&shape, &[], Level::Spheres(count)).expect("a count");
        assert_eq!(result.mesh.spheres.len(), count, "{id}: {:?}", result.diagnostics);
        assert_eq!(Some(betti(&result.mesh)), shape.expected_betti(), "{id}");
    }
    // A ball has one voxel on any lattice; the search for more ends and says so.
    let result = simplified(&built_in("sphere"), &[], Level::Spheres(500)).expect("a count");
    assert!(result.mesh.spheres.len() < 500);
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("instead of 500")));
}

#[test]
fn the_published_level_has_the_parameters_of_the_paper() {
    let shape = built_in("box");
    let set = [("resolution", "99"), ("max_memory", "4000")];
    let published = simplified(&shape, &set, Level::Published).expect("published");
    let named = [
        ("variant", "plain"),
        ("spiral", "classic"),
        ("start", "coarse"),
        ("dismiss", "zero"),
        ("refine", "false"),
        ("mu", "0.5"),
    ];
    let angle = 0.4_f64.asin().to_degrees();
    let same = simplified(&shape, &[&set[..], &named].concat(), Level::Native(angle));
    assert_eq!(bytes_of(&published), bytes_of(&same.expect("an angle")));
    let voxels = published.extras.get::<LatticeVoxels>().expect("voxels");
    assert!(!voxels.voxels.is_empty() && voxels.voxels.iter().all(|v| v.flux <= -0.2 + 1e-7));
    // Nothing set: the lattice of the paper, unless memory says otherwise.
    let small = [("max_memory", "60")];
    let lowered = simplified(&shape, &small, Level::Published).expect("published");
    let warnings = &lowered.diagnostics.warnings;
    assert!(warnings.iter().any(|w| w.contains("instead of the published 369")), "{warnings:?}");
    // Set by the user it is refused instead.
    let refused = simplified(&shape, &[("resolution", "369"), small[0]], Level::Published);
    assert!(matches!(refused, Err(SimplifyError::Parameter(m)) if m.contains("max_memory")));
}

#[test]
fn what_is_dismissed_depends_on_the_rule() {
    let shape = built_in("box");
    let dismissed = [Dismiss::Zero, Dismiss::Bias].map(|dismiss| {
        let params = AofParams { dismiss, ..AofParams::default() };
        let tally = solid(&shape, &params).descend(99, Wanted::Kept).expect("fits").tally;
        tally.dismissed.iter().sum::<u64>() as f64 / tally.start as f64
    });
    // With zero about half of the directions of a plane stay.
    assert!(dismissed[0] < 0.85 * dismissed[1], "{dismissed:?}");
}

#[test]
fn bad_input_is_refused_and_says_what_would_work() {
    let shape = built_in("box");
    let message = |set: &[(&str, &str)], level| match simplified(&shape, set, level) {
        Err(SimplifyError::Parameter(message) | SimplifyError::Level(message)) => message,
        other => panic!("{set:?}: {other:?}"),
    };
    let any = Level::Spheres(10);
    assert!(message(&[("resolution", "5000")], any).contains("fits, or raise max_memory"));
    assert!(message(&[("resolution", "0")], any).contains("resolution"));
    assert!(message(&[("angle", "0")], any).contains("above 0"));
    assert!(message(&[("angle", "-10")], any).contains("above 0"));
    assert!(message(&[], Level::Native(0.0)).contains("above 0"));
    assert!(message(&[("samples", "70/x")], any).contains("70/60/50"));
    assert!(message(&[("samples", "5")], any).contains("70/60/50"));
    assert!(message(&[("samples", "-50")], any).contains("70/60/50"));
    assert!(simplified(&shape, &[("samples", "50")], any).is_ok());
    assert!(message(&[("d", "1")], any).contains("2 or more"));
    assert!(message(&[("levels", "40")], any).contains("fewer levels"));
    // What the messages name works.
    let named = |advice: &str| -> String {
        let words = advice.rsplit("resolution = ").next().expect("a resolution");
        words.chars().take_while(char::is_ascii_digit).collect()
    };
    for id in ["box", "plate", "torus"] {
        let shape = built_in(id);
        let plain = |resolution: &str| {
            let set = [("resolution", resolution), ("variant", "plain")];
            simplified(&shape, &set, Level::Native(20.0)).map(|_| ())
        };
        let advice = plain("1").expect_err("too coarse").to_string();
        assert!(advice.contains("thinner than a voxel everywhere"), "{advice}");
        assert!(plain(&named(&advice)).is_ok(), "{advice}");
        let small = |resolution: &str| {
            let set = [("resolution", resolution), ("max_memory", "8")];
            simplified(&shape, &set, Level::Native(20.0)).map(|_| ())
        };
        let advice = small("300").expect_err("too fine").to_string();
        let fits = named(&advice);
        // The voxels fit; the medial mesh of them may ask for a coarser lattice still.
        let mut coarser = fits.clone();
        for _ in 0..4 {
            let Err(error) = small(&coarser) else { break };
            assert!(error.to_string().contains("the medial mesh of"), "{error}");
            let message = error.to_string().replace(" fits, or raise max_memory", "");
            coarser = named(&message);
        }
        assert!(small(&coarser).is_ok(), "{advice} {coarser}");
        let next = (fits.parse::<u32>().expect("a number") + 3).to_string();
        assert!(small(&next).is_err(), "{advice}");
    }
    assert!(message(&[("max_memory", "1e-9")], any).contains("give max_memory = "));
}

/// Every stage asks: a run that is cancelled at any of its questions ends there.
#[test]
fn cancelling_ends_the_run_at_every_stage() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
    let shape = built_in("torus");
    // Asks so many times, then cancels.
    let cancelled_after = |questions: usize| {
        let run = RunContext::default();
        let (flag, asked) = (run.cancel_flag(), Arc::new(AtomicUsize::new(0)));
        let counted = Arc::clone(&asked);
        let run = run.on_progress(move |progress| {
            assert!(progress.done <= progress.total, "{progress:?}");
            flag.store(counted.fetch_add(1, Relaxed) >= questions, Relaxed);
        });
        let method = aof::method();
        let answer = method
            .prepare(&shape, &Params::none(), &run)
            .and_then(|mut prepared| prepared.at(Level::Native(30.0)));
        (answer, asked.load(Relaxed))
    };
    let (answer, questions) = cancelled_after(usize::MAX);
    assert!(answer.is_ok() && questions > 5, "{questions}");
    for k in (0..questions).step_by(1 + questions / 12).chain([questions - 1]) {
        let (answer, asked) = cancelled_after(k);
        assert!(matches!(answer.err(), Some(SimplifyError::Cancelled)), "{k} of {questions}");
        // Those that other threads were about to ask.
        assert!(asked <= k + 1 + rayon::current_num_threads(), "{asked} after {k}");
    }
}

#[test]
fn advice_for_thin_and_scattered_solids_holds() {
    let refusal = |mesh: &TriMesh, set: &[(&str, &str)]| {
        let set = [&[("variant", "plain")], set].concat();
        match simplified(&shape_of(mesh), &set, Level::Native(20.0)) {
            Err(SimplifyError::Parameter(message)) => message,
            other => panic!("{other:?}"),
        }
    };
    let flat = |height: f64| cuboid(Vec3::new(1.0, 1.0, height));
    let mut apart = cuboid(HALF);
    let far = cuboid(HALF);
    apart.faces.extend(far.faces.iter().map(|face| face.map(|v| v + 8)));
    apart.vertices.extend(far.vertices.iter().map(|&v| v + Vec3::X * 1e12));
    for mesh in [flat(1e-6), apart.clone()] {
        let message = refusal(&mesh, &[]);
        assert!(message.contains("too thin for a lattice"), "{message}");
    }
    // Found by trying, up to a bounded effort.
    let message = refusal(&flat(1e-2), &[]);
    let named = message.rsplit("resolution = ").next().and_then(|rest| rest.split(' ').next());
    let named = named.expect("a resolution");
    let set = [("variant", "plain"), ("resolution", named)];
    assert!(simplified(&shape_of(&flat(1e-2)), &set, Level::Native(20.0)).is_ok(), "{message}");
    let message = refusal(&flat(1e-4), &[]);
    assert!(message.contains("take too long to be tried"), "{message}");
    // A lattice that fits into memory but has no voxel is not advised.
    let message = refusal(&flat(1e-3), &[("resolution", "4000"), ("max_memory", "1")]);
    assert!(message.contains("give max_memory"), "{message}");
    apart.vertices[8..].iter_mut().for_each(|v| *v += Vec3::splat(1e12));
    let message = refusal(&apart, &[]);
    assert!(message.contains("max_memory ends"), "{message}");
}

#[test]
fn samples_are_one_number_or_one_for_each_level() {
    let shape = built_in("box");
    let answer = |samples: &str, levels: &str| {
        let set = [("samples", samples), ("levels", levels)];
        simplified(&shape, &set, Level::Spheres(10)).map(|_| ())
    };
    for (samples, levels) in [("60/50", "3"), ("80/70/60/50", "3"), ("70/60", "1")] {
        let message = answer(samples, levels).expect_err("of another length").to_string();
        assert!(message.contains("one for each"), "{message}");
    }
    for (samples, levels) in [("60/50", "2"), ("50", "2"), ("70/60/50", "2")] {
        assert!(answer(samples, levels).is_ok(), "{samples} for {levels} levels");
    }
}
