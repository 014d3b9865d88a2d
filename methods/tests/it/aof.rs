//! Average outward flux: closed forms, known axes, topology.

use medial::Vec3;
use medial::complex::{betti, cubical_betti};
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified, SimplifyError};
use medial::surface::{self, TriangleBvh};
use medial_datasets::BuiltIn;
use medial_methods::aof::{
    self, AofParams, Axis, Descent, Grid, LatticeVoxels, Probe, Sphere, Spiral, Variant, Voxel,
    Wanted, refine,
};
use medial_methods::aof::{NearSet, NearbyTriangles};

use crate::aof_solids::{HALF, built_in, bytes_of, cuboid, shape_of, simplified, solid};

fn params(variant: Variant) -> AofParams {
    AofParams { variant, ..AofParams::default() }
}

/// Flux through a sphere of radius `sigma` in the box.
fn flux_in_box(spiral: Spiral, samples: usize, sigma: f64, centre: Vec3) -> f64 {
    let triangles = NearbyTriangles::new(&cuboid(HALF));
    let sphere = Sphere::new(spiral, samples, sigma);
    let mut set = NearSet::default();
    triangles.narrow(&triangles.all(centre), centre, sigma, &mut set);
    Probe::new(&sphere).flux(&triangles, &set)
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
    let (triangles, centres) = (NearbyTriangles::new(shape.mesh()), axis.points());
    let all = refine(&triangles, &tree, &sphere, &centres, &RunContext::default()).expect("runs");
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

/// Closed forms over one plane, and beside its border.
#[test]
fn a_gradient_that_is_the_same_everywhere_needs_no_samples() {
    let triangles = NearbyTriangles::new(&cuboid(HALF));
    let sphere = Sphere::new(Spiral::Classic, 50, 0.01);
    let mut set = NearSet::default();
    for (centre, gradient) in [
        (Vec3::new(0.2, 0.1, 0.4), Some(-Vec3::Z)),
        (Vec3::new(1.4, 0.1, 0.0), Some(-Vec3::X)),
        (Vec3::new(0.2, 0.1, 0.005), None),
        (Vec3::new(1.4, 0.1, 0.395), None),
    ] {
        triangles.narrow(&triangles.all(centre), centre, sphere.radius, &mut set);
        assert_eq!(triangles.constant_gradient(&set), gradient, "{centre}");
        let flux = Probe::new(&sphere).flux(&triangles, &set);
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
