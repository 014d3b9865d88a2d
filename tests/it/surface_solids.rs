//! From faces in any order and orientation to solids: orientation, cavities, invariants.

use std::collections::HashSet;
use std::f64::consts::TAU;

use medial::Vec3;
use medial::geometry::glam::DMat3;
use medial::surface::{
    self, Components, Fault, Format, Loaded, MendOptions, Repair, SurfaceError, TriMesh,
};
use proptest::prelude::*;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::shapes::*;

fn read(mesh: &TriMesh) -> Loaded {
    surface::read_bytes(to_off(mesh).as_bytes(), Format::Off).unwrap()
}

fn shell(radius: f64) -> TriMesh {
    cuboid(Vec3::splat(-radius), Vec3::splat(radius))
}

#[test]
fn shells_alternate_between_solid_and_cavity() {
    let nested: Vec<TriMesh> = (1..=5).rev().map(|r| shell(f64::from(r))).collect();
    let expected = 1000.0 - 512.0 + 216.0 - 64.0 + 8.0;
    for turned in 0..32 {
        let parts: Vec<TriMesh> = nested
            .iter()
            .enumerate()
            .map(
                |(i, part)| {
                    if turned >> i & 1 == 1 { inverted(part.clone()) } else { part.clone() }
                },
            )
            .collect();
        let Loaded { mesh, report } = read(&joined(&parts));
        assert_eq!(report.volume, Some(expected));
        assert_eq!(report.expected_betti, Some([3, 0, 2]));
        let wrong = |cavity: bool| {
            (0..5).filter(|i| (i % 2 == 1) == cavity && (turned >> i & 1 == 1) != cavity).count()
        };
        let mut repairs = Vec::new();
        if wrong(false) > 0 {
            repairs.push(Repair::TurnedOutward { components: wrong(false) });
        }
        if wrong(true) > 0 {
            repairs.push(Repair::TurnedInward { components: wrong(true) });
        }
        assert_eq!(report.repairs, repairs);
        let test = surface::InsideTest::new(&mesh);
        for (x, inside) in
            [(0.5, true), (1.5, false), (2.5, true), (3.5, false), (4.5, true), (5.5, false)]
        {
            assert_eq!(test.winding_number(Vec3::splat(x)), Some(i32::from(inside)), "{x}");
        }
        assert!(surface::validate(&joined(&parts)).is_ok() == repairs.is_empty());
    }
}

#[test]
fn overlapping_parts_stay_outward_and_touching_cavities_inward() {
    let other = cuboid(Vec3::splat(0.5), Vec3::splat(3.0));
    let off = to_off(&joined(&[shell(1.0), inverted(other)]));
    let overlapping = surface::inspect_bytes("test.off", off.as_bytes()).expect("read");
    assert_eq!(overlapping.report.repairs, [Repair::TurnedOutward { components: 1 }]);
    assert_eq!(overlapping.report.expected_betti, Some([2, 0, 0]));
    assert!(overlapping.report.self_intersecting && overlapping.report.warnings.len() == 2);
    // Together they are one solid.
    let solid = overlapping.solid().expect("one solid").report;
    assert_eq!((solid.expected_betti, solid.self_intersecting), (Some([1, 0, 0]), false));
    assert!((solid.volume.expect("closed") - (8.0 + 2.5_f64.powi(3) - 0.125)).abs() < 1e-12);
    assert!(matches!(solid.repairs[..], [_, Repair::ResolvedFaces { faces: 24, .. }]));

    // An octahedron that touches the wall of the box from within, in the middle of faces.
    let octahedron = sphere(0);
    let touching = read(&joined(&[inverted(octahedron.clone()), shell(1.0)]));
    assert_eq!(touching.report.expected_betti, Some([1, 0, 1]));
    // Its six tips are drawn back by a thousandth of its radius.
    assert!((touching.report.volume.unwrap() - (8.0 - 4.0 / 3.0)).abs() < 3e-3 * 4.0 / 3.0);
    let separated = touching.report.repairs.iter().find_map(|repair| match repair {
        Repair::SeparatedVertices { vertices, largest_move } => Some((*vertices, *largest_move)),
        _ => None,
    });
    let (vertices, largest_move) = separated.expect("six contacts");
    assert!(vertices == 6 && (largest_move - 1e-3).abs() < 1e-9, "{vertices} by {largest_move}");
    // Only the orientation of both against each other matters.
    let inside_out = read(&joined(&[octahedron.clone(), inverted(shell(1.0))])).report;
    assert_eq!(inside_out.expected_betti, Some([1, 0, 1]));
    assert_eq!(inside_out.volume, touching.report.volume);
    // And one that touches it from outside.
    let outside = moved(octahedron, |v| v + Vec3::new(2.0, 0.25, 0.125));
    assert_eq!(read(&joined(&[outside, shell(1.0)])).report.expected_betti, Some([2, 0, 0]));
}

/// Boxes of whole sides in some unit: the number of cells in their union, and their faces. Some boxes are inside out, but
/// none that another one encloses, which could be a cavity. Corners are below `side`; all boxes have one `height`, or any.
fn boxes(random: &mut Pcg64, unit: f64, side: i32, height: Option<i32>) -> (usize, TriMesh) {
    let count = random.random_range(2..6);
    let spans: Vec<[[i32; 3]; 2]> = (0..count)
        .map(|_| {
            let mut low = [(); 3].map(|()| random.random_range(0..side));
            let mut high = low.map(|x| x + random.random_range(1..side));
            if let Some(height) = height {
                (low[2], high[2]) = (0, height);
            }
            [low, high]
        })
        .collect();
    let mut cells = HashSet::new();
    for [low, high] in &spans {
        for x in low[0]..high[0] {
            for y in low[1]..high[1] {
                cells.extend((low[2]..high[2]).map(|z| [x, y, z]));
            }
        }
    }
    let is_within = |inner: &[[i32; 3]; 2], outer: &[[i32; 3]; 2]| {
        inner != outer && (0..3).all(|k| outer[0][k] <= inner[0][k] && inner[1][k] <= outer[1][k])
    };
    let is_nested = spans.iter().any(|inner| spans.iter().any(|outer| is_within(inner, outer)));
    let parts: Vec<TriMesh> = spans
        .iter()
        .map(|span| {
            let [low, high] = span.map(|corner| unit * Vec3::from(corner.map(f64::from)));
            let part = cuboid(low, high);
            // Other diagonals than those of its neighbours.
            let part =
                if random.random() { inverted(moved(part, |v| low + high - v)) } else { part };
            if random.random_bool(0.3) && !is_nested { inverted(part) } else { part }
        })
        .collect();
    (cells.len(), joined(&parts))
}

#[test]
fn boxes_that_touch_and_overlap_have_the_volume_of_their_union() {
    let mut random = Pcg64::seed_from_u64(7);
    for case in 0..160 {
        let unit = [1.0, 1.0, 3e-110, 7e40][case % 4];
        let (cells, mut mesh) = boxes(&mut random, unit, 4, None);
        let volume = |mesh: &TriMesh| {
            let inspected = surface::inspect_bytes("boxes.off", to_off(mesh).as_bytes());
            let inspected = inspected.expect("a surface");
            let mended = inspected.clone().mend(MendOptions::default());
            let solid = inspected.solid();
            assert_eq!(solid, mended, "case {case}");
            let mesh = solid.expect("a solid").mesh;
            let six = |face| {
                let [a, b, c] = mesh.triangle(face).map(|v| v / unit);
                a.dot(b.cross(c))
            };
            (0..mesh.faces.len()).map(six).sum::<f64>() / 6.0
        };
        let first = volume(&mesh);
        mesh.faces.shuffle(&mut random);
        let second = volume(&mesh);
        // Parts that touch are drawn apart by a thousandth of their size.
        for volume in [first, second] {
            assert!((volume - cells as f64).abs() < 5e-3 * cells as f64, "case {case}: {volume}");
        }
    }
}

#[test]
fn plain_boxes_with_faces_in_common_planes_are_one_solid() {
    let three = [
        [[[1, 0, 1], [3, 3, 4]], [[0, 4, 2], [6, 5, 6]], [[3, 2, 1], [6, 6, 3]]],
        [[[1, 0, 1], [4, 5, 5]], [[0, 1, 2], [6, 5, 5]], [[0, 3, 0], [1, 6, 6]]],
    ];
    for [a, b, c] in three {
        let parts = [a, b, c].map(|span| {
            let [low, high] = span.map(|corner| Vec3::from(corner.map(f64::from)));
            cuboid(low, high)
        });
        let report = read(&joined(&parts)).report;
        assert!(!report.self_intersecting, "{:?}", report.warnings);
    }
}

#[test]
fn a_cavity_is_where_those_of_all_bodies_are() {
    let mut random = Pcg64::seed_from_u64(17);
    for case in 0..200 {
        let mut span = |low: [i32; 3], high: [i32; 3]| {
            let pairs = [0, 1, 2].map(|k| {
                let from = random.random_range(low[k]..high[k]);
                [from, random.random_range(from + 1..=high[k])]
            });
            [pairs.map(|pair| pair[0]), pairs.map(|pair| pair[1])]
        };
        let bodies: Vec<[[[i32; 3]; 2]; 2]> = (0..2 + case % 2)
            .map(|shift| {
                // None holds another.
                let outer = [[shift, shift, 2 - shift], [8 + shift, 8 + shift, 10 - shift]];
                [outer, span(outer[0].map(|x| x + 1), outer[1].map(|x| x - 1))]
            })
            .collect();
        let holds = |[low, high]: [[i32; 3]; 2], cell: [i32; 3]| {
            (0..3).all(|k| low[k] <= cell[k] && cell[k] < high[k])
        };
        let cells = (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100]);
        let winding = |cell: [i32; 3]| -> i32 {
            let of = |[outer, cavity]: &[[[i32; 3]; 2]; 2]| {
                i32::from(holds(*outer, cell)) - i32::from(holds(*cavity, cell))
            };
            bodies.iter().map(of).sum()
        };
        let expected = cells.filter(|&cell| winding(cell) > 0).count() as f64;
        let parts: Vec<TriMesh> = bodies
            .iter()
            .flat_map(|shells| {
                let [outer, cavity] = shells.map(|span| {
                    let [low, high] = span.map(|corner| Vec3::from(corner.map(f64::from)));
                    cuboid(low, high)
                });
                [outer, inverted(cavity)]
            })
            .collect();
        let both = joined(&parts);
        for mesh in [inverted(both.clone()), both] {
            let Loaded { report, mesh } = read(&mesh);
            let volume = report.volume.expect("closed");
            assert!(
                (volume - expected).abs() < 5e-3 * expected,
                "case {case}: {volume} for {expected}, {:?}\n{bodies:?}\n{}",
                report.repairs,
                mesh.faces.len()
            );
        }
    }
}

#[test]
fn boxes_of_one_height_have_the_volume_of_their_union() {
    let mut random = Pcg64::seed_from_u64(13);
    for case in 0..100 {
        // Many faces overlap in two planes.
        let (cells, mesh) = boxes(&mut random, 1.0, 10, Some(3));
        let volume = read(&mesh).report.volume.expect("resolved");
        assert!((volume - cells as f64).abs() < 5e-3 * cells as f64, "case {case}: {volume}");
    }
}

/// Bodies of whole cells, with common vertices where they touch or overlap: the number of cells in their union, and their
/// faces, those of each body outward.
fn bodies(random: &mut Pcg64, most: usize) -> (usize, TriMesh) {
    const SIDE: usize = 3;
    let planes = [(); 3].map(|()| (0..=SIDE).map(|k| k as f64).collect());
    let mut all = HashSet::new();
    let parts: Vec<TriMesh> = (0..random.random_range(2..=most))
        .map(|_| {
            let mut body = HashSet::from([[(); 3].map(|()| random.random_range(0..SIDE))]);
            for _ in 0..random.random_range(0..6) {
                let mut next = *body.iter().min().unwrap_or(&[0; 3]);
                let axis = random.random_range(0..3);
                next[axis] = random.random_range(next[axis].saturating_sub(1)..=next[axis] + 1);
                body.insert(next.map(|k| k.min(SIDE - 1)));
            }
            all.extend(body.iter().copied());
            if random.random() {
                return cells(&planes, |cell| body.contains(&cell));
            }
            // Squares with other diagonals.
            let last = SIDE - 1;
            let mirrored = cells(&planes, |cell| body.contains(&cell.map(|k| last - k)));
            inverted(moved(mirrored, |v| SIDE as f64 - v))
        })
        .collect();
    (all.len(), joined(&parts))
}

#[test]
fn bodies_with_common_vertices_have_the_volume_of_their_union() {
    let mut random = Pcg64::seed_from_u64(11);
    for case in 0..400 {
        let (cells, mut mesh) = bodies(&mut random, 4);
        mesh.faces.shuffle(&mut random);
        if random.random() {
            mesh = inverted(mesh);
        }
        let off = to_off(&mesh);
        let solid =
            surface::inspect_bytes("bodies.off", off.as_bytes()).expect("a surface").solid();
        let Loaded { mesh, report } = solid.expect("a solid");
        let volume = report.volume.expect("closed");
        assert!(
            (volume - cells as f64).abs() < 5e-3 * cells as f64,
            "case {case}: {volume} for {cells}\n{off}"
        );
        // Diagonals of squares cross in their middle.
        let is_moved = mesh.vertices.iter().any(|&v| (2.0 * v).fract() != Vec3::ZERO);
        let is_named = report.repairs.iter().any(|repair| {
            matches!(repair, Repair::SeparatedVertices { .. } | Repair::ContractedEdges { .. })
        });
        assert_eq!(is_moved, is_named, "case {case}: {:?}\n{off}", report.repairs);
    }
}

#[test]
fn overlaps_that_meet_the_bodies_along_edges_alone_are_solid() {
    let planes = [(); 3].map(|()| vec![0.0, 1.0, 2.0, 3.0]);
    let low = cells(&planes, |cell| cell.iter().all(|&k| k < 2));
    let high = cells(&planes, |cell| cell.iter().all(|&k| k > 0));
    let both = joined(&[low, high]);
    for mesh in [inverted(both.clone()), both] {
        let report = read(&mesh).report;
        assert_eq!((report.volume, report.expected_betti), (Some(15.0), Some([1, 0, 0])));
    }
}

#[test]
fn bodies_across_a_wall_are_parts() {
    let block = |low: [f64; 3], high: [f64; 3]| cuboid(low.into(), high.into());
    let left = || block([0.0, 0.0, 0.0], [2.0, 2.0, 2.0]);
    let right = || block([2.0, 0.0, 0.0], [4.0, 2.0, 2.0]);
    // Inside, with a common plane, and out at one end.
    for (low, length, volume) in [(0.5, 3.0, 16.0), (0.5, 3.5, 16.0), (0.5, 4.0, 16.5)] {
        let pin = block([low, 0.5, 0.5], [low + length, 1.5, 1.5]);
        for turned in [pin.clone(), inverted(pin)] {
            let report = read(&joined(&[left(), right(), turned])).report;
            assert_eq!((report.volume, report.expected_betti), (Some(volume), Some([1, 0, 0])));
        }
    }
}

#[test]
fn inverted_bodies_with_common_edges_are_parts() {
    let hexagon = |offset: f64| {
        let at = |k: usize, z: f64| {
            let angle = (k % 6) as f64 * TAU / 6.0;
            Vec3::new(offset + angle.cos(), angle.sin(), z)
                .to_array()
                .map(|x| (1e6 * x).round() / 1e6)
        };
        let ring = |z: f64| (0..6).map(move |k| Vec3::from(at(k, z)));
        let vertices = ring(0.0).chain(ring(1.0)).collect();
        let side = |k: u32| {
            let next = (k + 1) % 6;
            [[k, next, next + 6], [k, next + 6, k + 6]]
        };
        let caps = (1..5).flat_map(|k| [[0, k + 1, k], [6, k + 6, k + 7]]);
        TriMesh { vertices, faces: (0..6).flat_map(side).chain(caps).collect() }
    };
    let [first, second] = [0.0, 1.0].map(hexagon);
    let all = [
        [first.clone(), second.clone()],
        [inverted(first.clone()), second.clone()],
        [first.clone(), inverted(second.clone())],
        [inverted(first), inverted(second)],
    ];
    for (k, bodies) in all.iter().enumerate() {
        let volume = read(&joined(bodies)).report.volume.expect("closed");
        assert!((volume - 4.330125).abs() < 1e-4, "case {k}: {volume}");
    }
}

#[test]
fn walls_cut_in_two_ways_and_rounded_are_no_gaps() {
    let mut random = Pcg64::seed_from_u64(3);
    for case in 0..40 {
        let [low, high] = [Vec3::X, Vec3::new(2.0, 1.0, 1.0)];
        // Its squares have other diagonals.
        let other = inverted(moved(cuboid(low, high), |v| low + high - v));
        let axis = Vec3::from([(); 3].map(|()| random.random_range(-1.0..1.0))).normalize();
        let turn = DMat3::from_axis_angle(axis, random.random_range(0.0..TAU));
        let round = |v: Vec3| Vec3::from((turn * v).to_array().map(|x| f64::from(x as f32)));
        let parts = [cube(), other.clone(), cube()];
        let inside_out = [cube(), inverted(other.clone())];
        let partly = [cube(), inverted(moved(cube(), |v| v + Vec3::X))];
        // Bodies, one of them twice, one inside out, and one inside out with the same diagonals.
        for parts in [&parts[..2], &parts, &inside_out, &partly] {
            let report = read(&moved(joined(parts), round)).report;
            assert_eq!(report.expected_betti, Some([1, 0, 0]), "case {case}: {:?}", report.repairs);
            let volume = report.volume.expect("closed");
            assert!((volume - 2.0).abs() < 1e-5, "case {case}: {volume}");
            let is_wall = |repair: &Repair| matches!(repair, Repair::DroppedWalls { faces: 4, distance } if *distance < 1e-6);
            assert!(report.repairs.iter().any(is_wall), "case {case}: {:?}", report.repairs);
        }
    }
}

#[test]
fn bodies_that_stand_on_each_other_at_an_angle_are_joined() {
    let plate = || cuboid(Vec3::new(-2.0, -2.0, 0.0), Vec3::new(2.0, 2.0, 1.0));
    let on_top = |low: [f64; 2], high: [f64; 2]| {
        cuboid(Vec3::new(low[0], low[1], 1.0), Vec3::new(high[0], high[1], 3.0))
    };
    let pillar = vec![plate(), on_top([-1.0, -1.0], [1.0, 0.5])];
    let fins = (0..4).map(|k| f64::from(k) - 1.75);
    let fins = fins.map(|x| on_top([x, -1.5], [x + 0.25, 1.5])).chain([plate()]).collect();
    // Nothing of either lies on a corner or an edge of the other.
    let bars = vec![
        cuboid(Vec3::new(-3.0, -0.5, 0.0), Vec3::new(3.0, 0.5, 1.0)),
        cuboid(Vec3::new(-0.5, -3.0, 1.0), Vec3::new(0.5, 3.0, 2.0)),
    ];
    let mut random = Pcg64::seed_from_u64(19);
    for (name, parts, area) in
        [("pillar", pillar, 62.0), ("fins", fins, 100.0), ("bars", bars, 50.0)]
    {
        for case in 0..20 {
            let axis = Vec3::from([(); 3].map(|()| random.random_range(-1.0..1.0))).normalize();
            let turn = DMat3::from_axis_angle(axis, random.random_range(0.0..TAU));
            let single = |v: Vec3| Vec3::from(v.to_array().map(|x| f64::from(x as f32)));
            let round = |v: Vec3| if case % 2 == 0 { turn * v } else { single(turn * v) };
            let report = read(&moved(joined(&parts), round)).report;
            let found = report.area.expect("an area");
            assert_eq!(report.expected_betti, Some([1, 0, 0]), "{name} {case}: {report:?}");
            assert!((found - area).abs() < 1e-4 * area, "{name} {case}: {found} for {area}");
        }
    }
}

/// A prism over a regular polygon, or a square plate with the polygon as a hole.
fn prism(sides: u32, radius: f64, [low, high]: [f64; 2], is_hole: bool) -> TriMesh {
    let corner = |k: u32| {
        let (sin, cos) = (TAU * (f64::from(k) + 0.5) / f64::from(sides)).sin_cos();
        [cos, sin]
    };
    let ring = |z: f64| (0..sides).map(corner).map(move |[x, y]| [radius * x, radius * y, z]);
    // Corners of the square in the directions of those of the polygon.
    let square = |z: f64| {
        (0..sides).map(corner).map(move |[x, y]| {
            let scale = 3.0 / x.abs().max(y.abs());
            [scale * x, scale * y, z]
        })
    };
    let rings = ring(low).chain(ring(high));
    let vertices: Vec<Vec3> = match is_hole {
        true => rings.chain(square(low)).chain(square(high)).map(Vec3::from).collect(),
        false => rings.chain([[0.0, 0.0, low], [0.0, 0.0, high]]).map(Vec3::from).collect(),
    };
    let mut faces = Vec::new();
    for k in 0..sides {
        let [a, b] = [k, (k + 1) % sides];
        let [c, d, e, f] = [a + sides, b + sides, a + 2 * sides, b + 2 * sides];
        if is_hole {
            let [g, h] = [e + sides, f + sides];
            for [p, q, r, s] in [[b, a, c, d], [e, f, h, g], [c, g, h, d], [a, b, f, e]] {
                faces.extend([[p, q, r], [p, r, s]]);
            }
        } else {
            let [low, high] = [2 * sides, 2 * sides + 1];
            faces.extend([[a, b, d], [a, d, c], [low, b, a], [high, c, d]]);
        }
    }
    TriMesh { vertices, faces }
}

#[test]
fn pins_in_holes_at_an_angle_are_joined() {
    let mut random = Pcg64::seed_from_u64(23);
    let base = |sides: u32| 0.5 * f64::from(sides) * (TAU / f64::from(sides)).sin();
    for sides in [8, 16, 24, 36] {
        // Half way in, through, flush at one side, flush at both.
        for depth in [[0.5, 2.0], [-1.0, 2.0], [0.0, 2.0], [0.0, 1.0]] {
            let plate = prism(sides, 1.0, [0.0, 1.0], true);
            let pin = prism(sides, 1.0, depth, false);
            let outer = base(sides);
            let square: f64 = plate
                .faces
                .iter()
                .map(|face| {
                    let [a, b, c] = face.map(|v| plate.vertices[v as usize]);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum();
            let volume = square + outer * (depth[1] - depth[0]);
            let whole = joined(&[plate, pin]);
            for _ in 0..4 {
                let axis = Vec3::from([(); 3].map(|()| random.random_range(-1.0..1.0))).normalize();
                let turn = DMat3::from_axis_angle(axis, random.random_range(0.0..TAU));
                let report = read(&moved(whole.clone(), |v| turn * v)).report;
                assert_eq!(report.expected_betti, Some([1, 0, 0]), "{sides} {depth:?}: {report:?}");
                let found = report.volume.expect("closed");
                assert!(
                    (found - volume).abs() < 1e-4 * volume,
                    "{sides} {depth:?}: {found} for {volume}"
                );
            }
        }
    }
}

#[test]
fn cubes_cut_in_single_precision_are_one_body() {
    // A cube in four pieces, whose cut faces rounding has moved.
    let corner = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
    let mut random = Pcg64::seed_from_u64(31);
    for case in 0..60 {
        let cut = random.random_range(0.3..0.7);
        let other = random.random_range(0.2..0.8);
        let pieces = [
            cuboid(corner(0.0, 0.0, 0.0), corner(cut, other, 1.0)),
            cuboid(corner(0.0, other, 0.0), corner(cut, 1.0, 1.0)),
            cuboid(corner(cut, 0.0, 0.0), corner(1.0, 1.0, 0.5)),
            cuboid(corner(cut, 0.0, 0.5), corner(1.0, 1.0, 1.0)),
        ];
        let axis = Vec3::from([(); 3].map(|()| random.random_range(-1.0..1.0))).normalize();
        let turn = DMat3::from_axis_angle(axis, random.random_range(0.0..TAU));
        let single = |v: Vec3| Vec3::from((turn * v).to_array().map(|x| f64::from(x as f32)));
        let report = read(&moved(joined(&pieces), single)).report;
        assert_eq!(report.expected_betti, Some([1, 0, 0]), "{case}: {report:?}");
        let found = report.volume.expect("closed");
        assert!((found - 1.0).abs() < 1e-4, "{case}: {found}");
    }
}

#[test]
fn brick_walls_cut_by_a_plane_are_one_body() {
    let mut random = Pcg64::seed_from_u64(41);
    for case in 0..60 {
        // Pieces on both sides of the cut have corners in common, and other bricks stand on their edges.
        let slopes = [(); 2].map(|()| random.random_range(-0.9..0.9));
        let mut pieces = Vec::new();
        for low in [0.0, 0.5] {
            let [first, last] = [random.random_range(0.4..0.9), random.random_range(3.1..3.6)];
            let joints = [(0.0, 0.0), (first, 0.0), (2.0, 1.0), (last, 0.0), (4.0, 0.0)];
            for pair in joints.windows(2) {
                pieces.push(moved(cube(), |v| {
                    let [y, z] = [v.y, low + 0.5 * v.z];
                    let slope = slopes[0] * (y - 0.5) + slopes[1] * (z - 0.5);
                    let [left, right] = [pair[0], pair[1]].map(|(at, share)| at + share * slope);
                    Vec3::new(left + v.x * (right - left), y, z)
                }));
            }
        }
        let axis = Vec3::from([(); 3].map(|()| random.random_range(-1.0..1.0))).normalize();
        let turn = DMat3::from_axis_angle(axis, random.random_range(0.0..TAU));
        let single = |v: Vec3| Vec3::from((turn * v).to_array().map(|x| f64::from(x as f32)));
        let wall = moved(joined(&pieces), single);
        // Without indices bodies have their common corners in common.
        for report in [read(&wall).report, read_stl(&wall).report] {
            assert_eq!(report.expected_betti, Some([1, 0, 0]), "{case}: {report:?}");
            let found = report.volume.expect("closed");
            assert!((found - 4.0).abs() < 4e-4, "{case}: {found}");
        }
    }
}

#[test]
fn columns_that_touch_along_a_whole_edge_are_drawn_apart() {
    // Between two plates, so that the surface hangs together around both ends of the edge.
    let planes = [vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 2.0, 3.0]];
    let report = read(&cells(&planes, |[x, y, z]| z != 1 || x == y)).report;
    assert_eq!(report.expected_betti, Some([1, 1, 0]), "{report:?}");
    assert!((report.volume.unwrap() - 10.0).abs() < 0.01, "{report:?}");
}

fn read_stl(mesh: &TriMesh) -> Loaded {
    let mut stl = "solid\n".to_owned();
    for corners in (0..mesh.faces.len()).map(|face| mesh.triangle(face)) {
        stl += "facet normal 0 0 0\nouter loop\n";
        corners.iter().for_each(|p| stl += &format!("vertex {} {} {}\n", p.x, p.y, p.z));
        stl += "endloop\nendfacet\n";
    }
    surface::read_bytes((stl + "endsolid\n").as_bytes(), Format::Stl).unwrap()
}

#[test]
fn a_wedge_in_its_groove_reaches_no_other_body() {
    let turn = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_x(0.7);
    let prism = |profile: &[[f64; 2]], faces: &[[u32; 3]]| {
        let count = profile.len() as u32;
        let at = |y: f64| profile.iter().map(move |&[x, z]| Vec3::new(x, y, z));
        let vertices = at(0.0).chain(at(2.0)).collect();
        let caps = faces.iter().flat_map(|&[a, b, c]| [[a, b, c], [a, c, b].map(|v| v + count)]);
        let sides = (0..count).flat_map(|a| {
            let b = (a + 1) % count;
            [[b, a, a + count], [b, a + count, b + count]]
        });
        TriMesh { vertices, faces: caps.chain(sides).collect() }
    };
    // A groove of 0.01 by 1, the wedge that fills it, and a plate below.
    let block =
        [[-2.0, 0.0], [2.0, 0.0], [2.0, 1.2], [0.01, 1.2], [0.0, 0.2], [-0.01, 1.2], [-2.0, 1.2]];
    let caps = [[0, 1, 4], [1, 2, 3], [1, 3, 4], [0, 4, 5], [0, 5, 6]];
    let wedge = prism(&[[0.0, 0.2], [0.01, 1.2], [-0.01, 1.2]], &[[0, 1, 2]]);
    let plate = cuboid(Vec3::new(-2.0, 0.0, -0.5), Vec3::new(2.0, 2.0, -0.001));
    let parts = [prism(&block, &caps), wedge, plate];
    let report = read(&moved(joined(&parts), |v| turn * v)).report;
    assert_eq!(report.expected_betti, Some([2, 0, 0]), "{report:?}");
}

#[test]
fn slits_between_joined_bodies_are_no_cavities() {
    let turn = DMat3::from_rotation_x(0.7);
    // 3e-6 and 3e-3 of the diagonal.
    for (gap, cavities) in [(3e-5, 0), (3e-2, 1)] {
        let floor = cuboid(Vec3::new(-3.0, -3.0, -1.0), Vec3::new(3.0, 3.0, 0.0));
        let pin = prism(8, 1.0, [gap, 2.0], false);
        let parts = [floor, prism(8, 1.0, [0.0, 1.0], true), pin];
        let report = read(&moved(joined(&parts), |v| turn * v)).report;
        assert_eq!(report.expected_betti, Some([1, 0, cavities]), "{gap}: {report:?}");
    }
}

#[test]
fn thin_and_distant_plates_are_kept() {
    let cube = cuboid(Vec3::splat(-0.5), Vec3::splat(0.5));
    for (thickness, shift) in [(1e-4, 0.0), (1e-6, 1e6), (1e-3, 1e10)] {
        let half = Vec3::new(10.0, 10.0, 0.5 * thickness);
        let both = joined(&[cube.clone(), cuboid(-half, half)]);
        let both = moved(both, |v| v + Vec3::splat(shift));
        let report = read(&both).report;
        let thickness = (shift + 0.5 * thickness) - (shift - 0.5 * thickness);
        let expected = 1.0 + (20.0 * 20.0 - 1.0) * thickness;
        let volume = report.volume.expect("closed");
        assert!((volume - expected).abs() < 1e-4 * expected, "{volume} for {expected}");
        assert_eq!(report.expected_betti, Some([1, 0, 0]));
    }
}

#[test]
fn wedges_around_one_edge_are_bodies_each() {
    let count = 40;
    let wedge = |k: u32| {
        let corner = |share: f64| {
            let (sin, cos) = (TAU * (f64::from(k) + share) / f64::from(count)).sin_cos();
            Vec3::new(cos, sin, 0.5)
        };
        let vertices = vec![Vec3::ZERO, Vec3::Z, corner(0.0), corner(0.5)];
        let faces = vec![[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]];
        let wedge = TriMesh { vertices, faces };
        if k.is_multiple_of(3) { inverted(wedge) } else { wedge }
    };
    let wedges: Vec<TriMesh> = (0..count).map(wedge).collect();
    let report = read(&joined(&wedges)).report;
    assert_eq!(report.expected_betti, Some([count as usize, 0, 0]));
    // Nothing crosses, so no face is replaced.
    assert_eq!(report.faces, 4 * count as usize);
    let expected = f64::from(count) * (0.5 * TAU / f64::from(count)).sin() / 6.0;
    let volume = report.volume.expect("closed");
    assert!((volume - expected).abs() < 5e-3 * expected, "{volume} for {expected}");
}

#[test]
fn bodies_without_volume_are_left_out_of_a_solid() {
    let sheet = TriMesh {
        vertices: vec![Vec3::splat(4.0), Vec3::new(5.0, 4.0, 4.0), Vec3::new(4.0, 5.0, 6.0)],
        faces: vec![[0, 1, 2], [0, 2, 1]],
    };
    let other = cuboid(Vec3::splat(0.5), Vec3::splat(3.0));
    let report = read(&joined(&[sheet, shell(1.0), other])).report;
    assert!((report.volume.expect("closed") - (8.0 + 2.5_f64.powi(3) - 0.125)).abs() < 1e-12);
    assert!(report.repairs.contains(&Repair::DroppedComponents { components: 1, faces: 2 }));
}

#[test]
fn pairs_of_faces_without_area_are_left_out_wherever_they_are() {
    let corners =
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [1.0, 0.0, 0.0]];
    let rest = [[0, 2, 4], [4, 2, 1], [0, 4, 3], [4, 1, 3], [0, 3, 2], [1, 2, 3]];
    let turn = DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(0.7);
    for is_turned in [false, true] {
        let place = |[x, y, z]: [f64; 3]| match Vec3::new(x, y, z) {
            // In single precision the corners of the pair are on no line.
            p if is_turned => Vec3::from((turn * p).to_array().map(|x| f64::from(x as f32))),
            p => p,
        };
        let vertices = corners.map(place).to_vec();
        for (first, second) in
            (0..8).flat_map(|i| (0..8).map(move |j| (i, j))).filter(|(i, j)| i != j)
        {
            let mut rest = rest.into_iter();
            let faces = (0..8).filter_map(|k| match k {
                _ if k == first => Some([0, 4, 1]),
                _ if k == second => Some([4, 0, 1]),
                _ => rest.next(),
            });
            let mesh = TriMesh { vertices: vertices.clone(), faces: faces.collect() };
            let Loaded { mesh, report } = read(&mesh);
            assert_eq!(mesh.faces.len(), 6, "{first} {second} {is_turned}");
            let is_named = report.repairs.iter().any(|repair| {
                let component = Repair::DroppedComponents { components: 1, faces: 2 };
                *repair == component || *repair == Repair::DroppedDuplicateFaces { faces: 2 }
            });
            assert!(is_named, "{first} {second} {is_turned}: {:?}", report.repairs);
            assert!(
                (report.volume.unwrap() - 4.0 / 3.0).abs() < 1e-6,
                "{first} {second} {is_turned}"
            );
        }
    }
}

#[test]
fn surfaces_with_very_many_intersections_are_named_as_unresolved() {
    let shifted =
        |k| cuboid(Vec3::splat(1e-3 * f64::from(k)), Vec3::splat(1.0 + 1e-3 * f64::from(k)));
    let many: Vec<TriMesh> = (0..160).map(shifted).collect();
    let inspected = surface::inspect_bytes("many.off", to_off(&joined(&many)).as_bytes());
    let report = inspected.expect("a surface").solid().expect("a manifold").report;
    assert!(report.intersecting_pairs > 100_000);
    assert!(report.warnings.iter().any(|warning| warning.contains("--wrap")));
}

#[test]
fn genus_is_that_of_the_solid() {
    let ring = torus(12, 6);
    let inner = moved(torus(12, 6), |v| 0.1 * v + 2.0 * Vec3::X);
    let report = read(&joined(&[ring, inner])).report;
    assert_eq!((report.components, report.genus, report.euler), (2, Some(2), 0));
    assert_eq!(report.expected_betti, Some([1, 2, 1]));
}

#[test]
fn validation_repairs_nothing() {
    let refused = |edit: &dyn Fn(&mut TriMesh)| {
        let mut mesh = joined(&[shell(2.0), inverted(shell(1.0))]);
        assert!(surface::validate(&mesh).is_ok());
        edit(&mut mesh);
        surface::validate(&mesh).unwrap_err().fault
    };
    assert!(matches!(
        refused(&|m| m.faces[3][1] = m.faces[3][0]),
        Fault::RepeatedCorner { face: 3 }
    ));
    assert!(matches!(refused(&|m| m.faces[3][1] = 16), Fault::Index { face: 3, index: 16, .. }));
    assert!(matches!(
        refused(&|m| m.faces.push(m.faces[5])),
        Fault::DuplicateFace { first: 5, second: 24 }
    ));
    assert!(matches!(refused(&|m| m.vertices.push(Vec3::X)), Fault::Unreferenced { vertex: 16 }));
    assert!(matches!(
        refused(&|m| m.vertices[9].y = f64::NAN),
        Fault::Coordinate { vertex: 9, .. }
    ));
    assert!(matches!(refused(&|m| m.faces[7].swap(0, 1)), Fault::Inconsistent { .. }));
    assert!(matches!(refused(&|m| *m = inverted(m.clone())), Fault::WrongWay { face: 0 }));
    let inner_out = |m: &mut TriMesh| m.faces[12..].iter_mut().for_each(|f| f.swap(0, 1));
    assert!(matches!(refused(&inner_out), Fault::WrongWay { face: 12 }));
    assert!(matches!(refused(&|m| m.faces.clear()), Fault::NoFaces { .. }));
    assert!(matches!(refused(&|m| m.faces.truncate(23)), Fault::Open { edges: 3, .. }));
}

#[test]
fn inspection_reports_surfaces_that_reading_rejects() {
    let mut open = cube();
    open.faces.truncate(10);
    let path = std::env::temp_dir().join(format!("medial-open-{}.off", std::process::id()));
    surface::write(&path, &open).unwrap();
    let inspection = surface::inspect(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert!(matches!(inspection.refused.as_ref().unwrap().fault, Fault::Open { edges: 4, .. }));
    let json = serde_json::to_value(&inspection.report).unwrap();
    for (key, value) in [
        ("vertices", 8.into()),
        ("faces", 10.into()),
        ("components", 1.into()),
        ("closed", false.into()),
        ("manifold", true.into()),
        ("oriented", true.into()),
        ("self_intersecting", false.into()),
        ("degenerate_faces", 0.into()),
        ("diagonal", 3_f64.sqrt().into()),
        ("genus", serde_json::Value::Null),
        ("repairs", serde_json::json!([])),
        ("warnings", serde_json::json!([])),
    ] {
        assert_eq!(json[key], value, "{key}");
    }
    let refused = inspection.refused.unwrap().to_string();
    assert!(refused.contains(".off: the surface is open: 4 edges"), "{refused}");
}

#[test]
fn files_are_written_whole_and_read_back_the_same() {
    let folder = std::env::temp_dir().join(format!("medial-surface-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mesh = moved(torus(9, 5), |v| v / 3.0 + Vec3::new(1e-7, 1e9, -1e-3));
    for name in ["a.off", "b.obj", "C.PLY"] {
        let path = folder.join(name);
        surface::write(&path, &mesh).unwrap();
        surface::write(&path, &mesh).unwrap();
        let loaded = surface::read(&path).unwrap();
        assert_eq!(loaded.mesh, mesh, "{name}");
        assert_eq!(loaded.report.repairs, []);
    }
    let path = folder.join("d.stl");
    surface::write(&path, &mesh).unwrap();
    let loaded = surface::read(&path).unwrap();
    // The same triangles to the last digit, of vertices in another order.
    assert_eq!(loaded.mesh.vertices.len(), mesh.vertices.len());
    for face in 0..mesh.faces.len() {
        assert_eq!(loaded.mesh.triangle(face), mesh.triangle(face));
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 4, "no temporary file stays");
    for (path, message) in [
        (folder.join("d.xyz"), "unknown extension \"xyz\""),
        (folder.join("none").join("d.off"), "cannot be written"),
    ] {
        let error = surface::write(&path, &mesh).unwrap_err().to_string();
        assert!(
            error.starts_with(&path.display().to_string()) && error.contains(message),
            "{error}"
        );
    }
    for (path, message) in [
        (folder.join("missing.off"), "cannot be read"),
        (folder.with_extension("off"), "cannot be read"),
        (folder.clone(), "unknown extension"),
    ] {
        let error = surface::read(&path).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
    std::fs::create_dir(folder.join("e.off")).unwrap();
    let error = surface::read(folder.join("e.off")).unwrap_err().to_string();
    assert!(error.contains("not a regular file"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Faces in any order, rotation and orientation, vertices in any order: the same solid.
    #[test]
    fn order_and_orientation_of_faces_do_not_matter(
        order in Just((0..240_u32).collect::<Vec<_>>()).prop_shuffle(),
        numbers in Just((0..62_u32).collect::<Vec<_>>()).prop_shuffle(),
        turns in prop::collection::vec(0..6_usize, 240),
    ) {
        let rock = moved(sphere(2), |v| v * (2.0 + 0.3 * (5.0 * v.x).sin() + v.y));
        let mesh = joined(&[rock, moved(torus(8, 7), |v| v * 5.0)]);
        let expected = read(&mesh).report;
        prop_assert_eq!((mesh.faces.len(), mesh.vertices.len()), (240, 122));
        let number = |v: u32| numbers.get(v as usize).copied().unwrap_or(v);
        let mut vertices = mesh.vertices.clone();
        for v in 0..122 {
            vertices[number(v) as usize] = mesh.vertices[v as usize];
        }
        let faces = order.iter().zip(&turns).map(|(&face, &turn)| {
            let mut face = mesh.faces[face as usize].map(number);
            face.rotate_left(turn % 3);
            if turn >= 3 {
                face.swap(0, 1);
            }
            face
        });
        let shuffled = TriMesh { vertices, faces: faces.collect() };
        let loaded = read(&shuffled);
        let turned = shuffled.faces.iter().zip(&loaded.mesh.faces).filter(|(a, b)| a != b).count();
        let reported: usize = loaded.report.repairs.iter().map(Repair::count).sum();
        prop_assert_eq!(turned, turns.iter().filter(|&&turn| turn >= 3).count());
        prop_assert!(reported == turned || loaded.report.repairs.len() > 1);
        let mut same = loaded.report.clone();
        same.repairs = expected.repairs.clone();
        let close = |a: Option<f64>, b: Option<f64>| (a.unwrap() / b.unwrap() - 1.0).abs() < 1e-13;
        prop_assert!(close(same.volume, expected.volume) && close(same.area, expected.area));
        (same.volume, same.area) = (expected.volume, expected.area);
        prop_assert_eq!(same, expected);
    }
}

// Repairs on demand: holes filled, parts left out.

const FILL: MendOptions = MendOptions { fill_holes: true, components: Components::All };

fn mend(mesh: &TriMesh, options: MendOptions) -> Result<Loaded, SurfaceError> {
    surface::inspect_bytes("mesh.off", to_off(mesh).as_bytes()).unwrap().mend(options)
}

/// A lattice box of `n` cells along each side, without the faces that `dropped` names by centroid.
fn lattice_box(n: u32, dropped: impl Fn(Vec3) -> bool) -> TriMesh {
    let TriMesh { vertices, mut faces } = lattice_cube(n);
    faces.retain(|face| !dropped(face.map(|v| vertices[v as usize]).iter().sum::<Vec3>() / 3.0));
    TriMesh { vertices, faces }
}

#[test]
fn a_flat_hole_is_filled_flat_and_nothing_moves() {
    let window = |p: Vec3| p.z == 1.0 && (p - Vec3::new(0.5, 0.5, 1.0)).abs().max_element() < 0.3;
    let open = lattice_box(6, window);
    let mended = mend(&open, FILL).expect("closed");
    assert!((mended.report.volume.expect("closed") - 1.0).abs() < 1e-12);
    assert!((mended.report.area.expect("closed") - 6.0).abs() < 1e-12);
    assert!(mended.mesh.vertices.iter().all(|v| open.vertices.contains(v)));
    assert_eq!(mended.report.repairs[1..], [Repair::FilledHole { edges: 16, triangles: 14 }]);
}

#[test]
fn a_hole_around_a_corner_is_filled_as_smoothly_as_its_vertices_allow() {
    let open = lattice_box(4, |p| p.min_element() > 0.7);
    let mended = mend(&open, FILL).expect("closed");
    assert_eq!(mended.report.expected_betti, Some([1, 0, 0]));
    let volume = mended.report.volume.expect("closed");
    assert!(volume > 1.0 - 1.0 / 64.0 && volume < 1.0, "{volume}");
}

#[test]
fn every_hole_is_reported_and_long_ones_are_refused() {
    let two = lattice_box(5, |p| (p.z == 1.0 || p.z == 0.0) && (p.truncate() - 0.5).length() < 0.2);
    let repairs = mend(&two, FILL).expect("closed").report.repairs;
    let holes = repairs.iter().filter(|repair| matches!(repair, Repair::FilledHole { .. }));
    assert_eq!(holes.count(), 2);
    // The reader drops the first vertices, which belong to no face.
    let mut lid = lattice_box(126, |p| p.z == 1.0);
    lid.vertices.splice(0..0, [Vec3::ZERO; 3]);
    lid.faces.iter_mut().flatten().for_each(|vertex| *vertex += 3);
    let fault = mend(&lid, FILL).expect_err("too long").fault;
    let Fault::LongHole { edges: 504, most: 500, first } = fault else { panic!("{fault}") };
    assert_eq!(lid.vertices[first.index], first.position, "the number in the file");
    let open = mend(&two, MendOptions::default()).expect_err("open").fault;
    assert!(matches!(open, Fault::Open { .. }), "{open}");
}

#[test]
fn holes_of_no_solid_have_the_reason() {
    // A band with half a turn.
    let corner = |i: u32| [2 * (i % 8), 2 * (i % 8) + 1];
    let place = |k: u32| {
        let (angle, side) = (f64::from(k / 2) * TAU / 8.0, f64::from(k % 2) - 0.5);
        let along = 1.0 + 0.3 * side * (angle / 2.0).cos();
        Vec3::new(along * angle.cos(), along * angle.sin(), 0.3 * side * (angle / 2.0).sin())
    };
    let faces = (0..8).flat_map(|i| {
        let ([a, b], [mut c, mut d]) = (corner(i), corner(i + 1));
        if i == 7 {
            (c, d) = (d, c);
        }
        [[a, c, d], [a, d, b]]
    });
    let band = TriMesh { vertices: (0..16).map(place).collect(), faces: faces.collect() };
    let fault = mend(&band, FILL).expect_err("one-sided").fault;
    assert!(matches!(fault, Fault::NonOrientable { .. }), "{fault}");
    // Three leaves at one edge.
    let leaf = |k: f64| Vec3::new(k.cos(), k.sin(), 0.5);
    let vertices = [Vec3::ZERO, Vec3::Z, leaf(0.0), leaf(2.0), leaf(4.0)].to_vec();
    let book = TriMesh { vertices, faces: vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]] };
    let fault = mend(&book, FILL).expect_err("three leaves").fault;
    let Fault::BranchingHole { at } = fault else { panic!("{fault}") };
    assert_eq!(book.vertices[at.index], at.position);
}

#[test]
fn holes_that_meet_are_separated() {
    // Two windows with one common corner.
    let windows = |p: Vec3| {
        let in_window = |low: f64| p.x > low && p.x < low + 0.25 && p.y > low && p.y < low + 0.25;
        p.z == 1.0 && (in_window(0.25) || in_window(0.5))
    };
    let apart = mend(&lattice_box(4, windows), FILL).expect("closed");
    assert!((apart.report.volume.expect("closed") - 1.0).abs() < 1e-3);
}

#[test]
fn parts_that_touch_in_a_vertex_are_drawn_apart() {
    let both = joined(&[cube(), moved(cube(), |v| v + Vec3::ONE)]);
    let mended = mend(&both, MendOptions::default()).expect("two solids");
    assert_eq!(mended.report.expected_betti, Some([2, 0, 0]));
    assert!((mended.report.volume.expect("closed") - 2.0).abs() < 2e-3);
    let moved = mended.mesh.vertices.iter().filter(|v| !both.vertices.contains(v)).count();
    assert_eq!((moved, mended.mesh.vertices.len()), (1, 16));
    assert!(
        mended
            .report
            .repairs
            .iter()
            .any(|repair| { matches!(repair, Repair::SeparatedVertices { vertices: 1, .. }) })
    );
}

#[test]
fn the_largest_part_is_kept() {
    let small = moved(lattice_box(1, |p| p.z == 1.0), |v| 0.5 * v + 3.0);
    let both = joined(&[small, lattice_cube(2)]);
    let options = MendOptions { components: Components::Largest(1), ..MendOptions::default() };
    let mended = mend(&both, options).expect("a solid");
    assert_eq!((mended.report.components, mended.mesh.faces.len()), (1, 48));
    assert!(
        mended.report.repairs.contains(&Repair::DroppedComponents { components: 1, faces: 10 })
    );
}

#[test]
fn a_part_is_kept_with_its_cavities() {
    // A hollow cube in the cavity of another, next to a solid cube, from which one face is taken later.
    let hollow = |r: f64| [shell(r), inverted(shell(0.9 * r))];
    let cube = moved(shell(1.0), |v| v + 9.0);
    let parts = [&hollow(4.0)[..], &hollow(2.0), &[cube]].concat();
    let volume = |r: f64| (1.0 - 0.9_f64.powi(3)) * (2.0 * r).powi(3);
    let keep = |mesh: &TriMesh, components| {
        mend(mesh, MendOptions { components, ..MendOptions::default() }).expect("a solid").report
    };
    for parts in [parts.clone(), parts.into_iter().rev().collect()] {
        let mut mesh = joined(&parts);
        for open in [false, true] {
            if open {
                let of_cube = |face: &[u32; 3]| mesh.vertices[face[0] as usize].x > 7.0;
                let face = mesh.faces.iter().position(of_cube).expect("a face of the cube");
                mesh.faces.remove(face);
            }
            for (which, volume, betti) in [
                (Components::Largest(1), volume(4.0), [1, 0, 1]),
                (Components::Largest(2), volume(4.0) + volume(2.0), [2, 0, 2]),
                (Components::Share(0.1), volume(4.0) + volume(2.0), [2, 0, 2]),
            ] {
                let report = keep(&mesh, which);
                assert!((report.volume.expect("closed") - volume).abs() < 1e-9);
                assert_eq!(report.expected_betti, Some(betti), "{which:?}, open: {open}");
            }
        }
    }
}

#[test]
fn holes_are_filled_before_parts_are_chosen() {
    let cavity = inverted(moved(lattice_cube(2), |v| 0.25 + 0.5 * v));
    let far = moved(lattice_cube(1), |v| 0.5 * v + 3.0);
    let open = joined(&[lattice_box(4, |p| p.z == 1.0), cavity.clone(), far]);
    let whole = read(&joined(&[lattice_cube(4), cavity])).report;
    let options = MendOptions { components: Components::Largest(1), ..FILL };
    let mended = mend(&open, options).expect("a solid").report;
    let volumes = [&mended, &whole].map(|report| report.volume.expect("closed"));
    assert!((volumes[0] - volumes[1]).abs() < 1e-9, "{volumes:?}");
    assert_eq!(mended.expected_betti, Some([1, 0, 1]));
}

#[test]
fn surfaces_that_are_flat_after_the_repair_are_rejected() {
    let triangle = TriMesh { vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y], faces: vec![[0, 1, 2]] };
    let fault = mend(&triangle, FILL).expect_err("flat").fault;
    assert!(!fault.to_string().is_empty());
}

#[test]
fn a_far_vertex_does_not_keep_others_from_being_welded() {
    // A tetrahedron with a corner twice, 1e-10 apart, that is open without a weld, far from the origin and with an outlier.
    let off = |far: f64| {
        let x = |shift: f64| 2e6 + shift;
        let near =
            format!("{:?} 0 0\n{:?} 0 0\n{:?} 1 0\n{:?} 0 1\n", x(0.0), x(1.0), x(0.0), x(0.0));
        format!(
            "OFF\n6 4 0\n{near}{:?} 1e-7 0\n{far:?} 0 0\n3 0 2 1\n3 4 1 3\n3 0 3 2\n3 1 2 3\n",
            x(0.0)
        )
    };
    for far in [0.0, 1e30, -1e35] {
        let loaded =
            surface::read_bytes(off(far).as_bytes(), Format::Off).expect("closed by a weld");
        let welded = |repair: &Repair| matches!(repair, Repair::WeldedWithin { vertices: 1, .. });
        assert!(loaded.report.repairs.iter().any(welded), "{far}: {:?}", loaded.report.repairs);
    }
}
