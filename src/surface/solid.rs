//! From a polygon soup that crosses, overlaps or touches itself to the solid that it means.
//!
//! The solid is where the winding number of the surface is at least 1. The crate `manifold-rust` computes it with an exact
//! arrangement of the triangles (B. Lévy 2025, *Exact predicates, exact constructions and combinatorics for mesh CSG*,
//! <https://doi.org/10.1145/3744642>, describes the approach); walls between bodies and doubled faces have the solid on both
//! sides, or on none, and disappear. New vertices are rounded to double precision, so the result is checked like any
//! file.
//!
//! 1. *Weld*: vertices within the first of [`TOLERANCES`] that closes the surface, or the next one where 2 to 4 fail.
//! 2. *Orient*: bodies that touch are taken apart (`parts.rs`) and turned outward, or inward where they are cavities. Then
//!    plane walls between them are left out.
//! 3. *Push*: where leaving out walls does not give a solid, of bodies that stand on each other to within rounding the
//!    smaller one goes into the larger (`contacts.rs`), with the walls. Cavities as thin as rounding makes them are left out.
//!    Where the solid has loops or cavities, it is compared with those of other ways to push.
//! 4. *Resolve*: the winding number, compared with that of the input at points. Repeated while rounding makes faces cross.
//! 5. *Separate*: parts that touch in a vertex or along an edge.

use std::collections::{HashMap, HashSet};
use std::panic::catch_unwind;

use manifold_rust::linalg;
use manifold_rust::robust::assemble::assemble;
use manifold_rust::robust::cells::{build_cells, extract, windings};
use manifold_rust::robust::intersection_graph::build_graph;
use manifold_rust::types::{OpType, WindingRule};

use super::check::orient_and_examine;
use super::contacts::{self, Order};
use super::intersections::intersections;
use super::mend::{Stays, halve_shared_edges, separate};
use super::mesh::{TriMesh, Unit};
use super::parts::{ASIDE, PLACE, Parted, parted, split_at_vertices, walls};
use super::repair::{Duplicates, Repaired, build, compact, repair, weld_within};
use super::report::{Repair, SurfaceReport};
use super::soup::PolygonSoup;
use super::topology::{Topology, repairs, shells, turn_over};
use super::{Contraction, Folds, InsideTest, Inspection, Loaded, contract_short_edges};
use crate::Vec3;

/// Largest distances of welded vertices, as fractions of the diagonal of the bounding box.
const TOLERANCES: [f64; 4] = [0.0, 1e-9, 1e-7, 1e-6];

/// Largest thickness of a wall between bodies, as a fraction of the diagonal.
const WALL: f64 = 1e-6;

/// Largest thickness of a cavity that is left out while a solid is resolved, as a fraction of the diagonal.
const SLIT: f64 = 1e-5;

/// Length below which edges of the result are contracted, as a fraction of the diagonal.
const SHORT: f64 = 1e-5;

/// Change of the volume by contractions, as a share, above which they are left out.
const SLIGHT: f64 = 1e-4;

/// Change of the extent, and of the volume by a further pass, as shares, above which an arrangement is taken for wrong.
const LOSS: f64 = 1e-6;

/// Number of faces at which the winding number of an arrangement is compared with that of the surface.
const COMPARED: usize = 2_000;

/// Compared points for each one that may differ, in a sliver.
const SELDOM: usize = 500;

/// Limit of passes through the arrangement.
const PASSES: usize = 4;

/// Limit of the pairs of intersecting faces. The time of the arrangement grows a little faster than their number.
const MOST_PAIRS: usize = 100_000;

/// The solid of a closed surface, whose triangles after exact welds are `checked`. None if it is open, or no pass gives a
/// surface without crossings.
pub(super) fn resolve(soup: &PolygonSoup, unit: Unit, checked: &Inspection) -> Option<Loaded> {
    let SurfaceReport { diagonal, intersecting_pairs, .. } = checked.report;
    if intersecting_pairs > MOST_PAIRS {
        return None;
    }
    let mut tried = Vec::new();
    TOLERANCES.into_iter().find_map(|tolerance| {
        let (built, weld) = welded(soup, unit, tolerance * diagonal)?;
        // As many vertices are the same ones: a weld merges what a shorter one does.
        let vertices = built.vertices.len();
        if built.topology.boundary_edges > 0 || tried.contains(&vertices) {
            return None;
        }
        tried.push(vertices);
        joined(&built, weld.as_slice(), unit, checked).or_else(|| {
            let (built, dropped) = without_flaps(&built, unit)?;
            let repairs: Vec<Repair> = weld.into_iter().chain([dropped]).collect();
            joined(&built, &repairs, unit, checked)
        })
    })
}

/// The solid of closed, welded triangles. `repairs` are those made so far.
fn joined(
    built: &Repaired,
    repairs: &[Repair],
    unit: Unit,
    checked: &Inspection,
) -> Option<Loaded> {
    // Welded along common edges, bodies hang together in another way where one is inside out, or where rounding has turned
    // their faces around each other.
    let bodies = in_runs(built).and_then(|bodies| {
        let own: Vec<u32> = (0..bodies.vertices.len() as u32).collect();
        let bodies = build(&bodies, unit, &own, Duplicates::Kept).ok()?;
        bodies.topology.is_manifold().then_some(bodies)
    });
    let by = |way| resolved(built.clone(), repairs, unit, checked, way);
    let of_bodies = |way| resolved(bodies.clone()?, repairs, unit, checked, way);
    let [usual, other] = [Order::SmallerIntoLarger, Order::LargerIntoSmaller].map(Way::Pushed);
    let ways: [&dyn Fn() -> Option<Loaded>; 4] = [
        &|| of_bodies(usual).or_else(|| of_bodies(Way::Walls)),
        &|| by(usual).or_else(|| by(Way::Walls)),
        &|| of_bodies(other),
        &|| by(other),
    ];
    let walls_alone = by(Way::WallsAlone).or_else(|| of_bodies(Way::WallsAlone));
    walls_alone.or_else(|| simplest(ways.into_iter().filter_map(|way| way())))
}

/// The triangles without pairs of narrow ones that have the same corners and face each other: they bound nothing. None if
/// there is no pair.
fn without_flaps(built: &Repaired, unit: Unit) -> Option<(Repaired, Repair)> {
    let points = unit.forward_all(&built.vertices);
    let low = points.iter().fold(Vec3::INFINITY, |low, &p| low.min(p));
    let high = points.iter().fold(Vec3::NEG_INFINITY, |high, &p| high.max(p));
    let width = WALL * (high - low).length();
    let is_narrow = |face: [u32; 3]| {
        let [a, b, c] = face.map(|v| points[v as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (b - a).cross(c - a).length() <= width * longest
    };
    let mut single = HashMap::<[u32; 3], Vec<usize>>::new();
    let mut dropped = vec![false; built.faces.len()];
    for (f, &face) in built.faces.iter().enumerate().filter(|&(_, &face)| is_narrow(face)) {
        let [a, b, c] = from_least(face);
        match single.get_mut(&[a, c, b]).and_then(Vec::pop) {
            Some(other) => (dropped[f], dropped[other]) = (true, true),
            None => single.entry([a, b, c]).or_default().push(f),
        }
    }
    let count = dropped.iter().filter(|&&dropped| dropped).count();
    if count == 0 || count == dropped.len() {
        return None;
    }
    let kept = built.faces.iter().zip(dropped).filter(|(_, dropped)| !dropped);
    let kept: Vec<[u32; 3]> = kept.map(|(&face, _)| face).collect();
    let soup = PolygonSoup::of_triangles(&built.vertices, &kept).ok()?;
    let own: Vec<u32> = (0..soup.vertices.len() as u32).collect();
    let built = build(&soup, unit, &own, Duplicates::Kept).ok()?;
    Some((built, Repair::DroppedDuplicateFaces { faces: count }))
}

/// The triangles with vertices of their own for each of several closed surfaces that follow each other: files list body after
/// body. None for others.
fn in_runs(Repaired { vertices, faces, .. }: &Repaired) -> Option<PolygonSoup> {
    let (mut apart, mut of_run) = (Vec::new(), HashMap::new());
    let mut corners = Vec::with_capacity(faces.len());
    let (mut open, mut runs) = (HashMap::new(), 0);
    for &face in faces {
        corners.push(face.map(|v| {
            *of_run.entry(v).or_insert_with(|| {
                apart.push(vertices[v as usize]);
                apart.len() as u32 - 1
            })
        }));
        let [a, b, c] = face;
        for [a, b] in [[a, b], [b, c], [c, a]] {
            match open.get_mut(&[b, a]) {
                Some(1) => drop(open.remove(&[b, a])),
                Some(others) => *others -= 1,
                None => *open.entry([a, b]).or_insert(0) += 1,
            }
        }
        if open.is_empty() {
            of_run.clear();
            runs += 1;
        }
    }
    let soup = (runs > 1 && open.is_empty()).then(|| PolygonSoup::of_triangles(&apart, &corners));
    soup?.ok()
}

/// The first solid without loops, cavities and vertices drawn apart, or else the one with the fewest. Loops of the bodies
/// themselves are in all, those that a gap leaves in few.
fn simplest(mut solids: impl Iterator<Item = Loaded>) -> Option<Loaded> {
    let faults = |Loaded { report, .. }: &Loaded| {
        let is_drawn = |repair: &Repair| matches!(repair, Repair::SeparatedVertices { .. });
        let drawn = usize::from(report.repairs.iter().any(is_drawn));
        let [bodies, loops, cavities] = report.expected_betti.unwrap_or_default();
        (loops + cavities + drawn, bodies)
    };
    let mut best = solids.next()?;
    while faults(&best).0 > 0
        && let Some(solid) = solids.next()
    {
        if faults(&solid) < faults(&best) {
            best = solid;
        }
    }
    Some(best)
}

/// How touching bodies are joined.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    /// Walls between them are left out, which gives the solid.
    WallsAlone,
    /// Bodies are pushed into each other. No wall is left out before, as the rest of it would join both bodies.
    Pushed(Order),
    /// Walls are left out.
    Walls,
}

/// The solid of welded triangles.
fn resolved(
    mut built: Repaired,
    earlier: &[Repair],
    unit: Unit,
    checked: &Inspection,
    way: Way,
) -> Option<Loaded> {
    let diagonal = checked.report.diagonal;
    let mut repairs = checked.report.repairs.clone();
    built.points = unit.forward_all(&built.vertices);
    // A body that crosses a wall lies in neither of its sides: walls are left out after the turns.
    let (mut mesh, turns) = oriented(built)?;
    let walls = match way {
        Way::Pushed(_) => None,
        Way::WallsAlone | Way::Walls => drop_walls(&mut mesh.vertices, &mut mesh.faces),
    };
    // The check dropped walls, and turned faces that it joined in another way.
    repairs.retain(|repair| {
        use Repair::{DroppedDuplicateFaces, ReorientedFaces, TurnedInward, TurnedOutward};
        let is_of_check = matches!(
            repair,
            DroppedDuplicateFaces { .. }
                | ReorientedFaces { .. }
                | TurnedInward { .. }
                | TurnedOutward { .. }
        );
        !is_of_check
    });
    repairs.extend(earlier.iter().cloned().chain(walls).chain(turns));
    let replaced = mesh.faces.len();
    match way {
        Way::WallsAlone => {
            let (apart, most) = apart(&mesh, unit);
            if contacts::has_contacts(&apart, most) {
                return None;
            }
        }
        Way::Pushed(order) => {
            let push;
            (mesh, push) = pushed_together(&mesh, unit, order)?;
            repairs.push(push);
        }
        Way::Walls => {}
    }
    let slits;
    (mesh, slits) = without_slits(mesh, unit);
    if way == Way::WallsAlone && slits.is_some() {
        return None;
    }
    repairs.extend(slits);
    // A weld may have been all that was missing.
    let found = examined(&mesh)?;
    if is_solid(&found) {
        return Some(loaded(found, repairs));
    }
    if way == Way::WallsAlone {
        return None;
    }
    let is_wall = |repair: &Repair| matches!(repair, Repair::DroppedDuplicateFaces { .. });
    if !found.report.self_intersecting && !found.report.repairs.iter().any(is_wall) {
        // Parts touch in common vertices and edges alone: nothing has to be arranged.
        let (found, separated) = drawn_apart(&mesh)?;
        if is_solid(&found) {
            repairs.extend(separated);
            return Some(loaded(found, repairs));
        }
    }
    let mut separations = Vec::new();
    for pass in 0..PASSES {
        let [simple, whole] = arranged(&mesh, unit)?;
        let all = volume(&whole, unit);
        let is_right = match pass {
            0 => is_region(&whole, &mesh, unit),
            // The first pass alone removes overlaps.
            _ => (all - volume(&mesh, unit)).abs() <= LOSS * all,
        };
        if !is_right {
            return None;
        }
        let mut next = None;
        let is_alike =
            reaches(&simple, &whole) && (volume(&simple, unit) - all).abs() <= LOSS * all;
        for candidate in is_alike.then_some(simple).into_iter().chain([whole]) {
            let (candidate, slits) = without_slits(candidate, unit);
            let Some(Closed { found, separated, contracted }) = closed(&candidate, unit, diagonal)
            else {
                continue;
            };
            if is_solid(&found) {
                let by = found.mesh.faces.len();
                repairs.push(Repair::ResolvedFaces { faces: replaced, by });
                let others = separations.into_iter().chain(separated).chain(contracted);
                repairs.extend(slits.into_iter().chain(others));
                return Some(loaded(found, repairs));
            }
            // The next pass takes the arrangement itself where the check opened it: of two opposite faces it drops one.
            next.get_or_insert(match found.refused {
                None => (found.mesh, slits, separated),
                Some(_) => (candidate, slits, None),
            });
        }
        let (slits, separated);
        (mesh, slits, separated) = next?;
        separations.extend(slits.into_iter().chain(separated));
    }
    None
}

/// What an arrangement gives.
struct Closed {
    found: Inspection,
    separated: Option<Repair>,
    contracted: Option<Repair>,
}

/// A surface without the cavities that bodies nearly in contact leave between them.
fn without_slits(mut mesh: TriMesh, unit: Unit) -> (TriMesh, Option<Repair>) {
    let scaled = TriMesh { vertices: unit.forward_all(&mesh.vertices), faces: mesh.faces.clone() };
    let extent = scaled.bounding_box().map_or(0.0, |(low, high)| (high - low).length());
    // Where rounding turned two faces around each other at an edge, they are a part of their own.
    let Some(Parted { faces: apart, vertices, .. }) = parted(&scaled.vertices, &scaled.faces)
    else {
        return (mesh, None);
    };
    let Topology { component, first_face, .. } = Topology::new(vertices.len(), &apart);
    // Six times the volume, and twice the area.
    let mut sizes = vec![(0.0, 0.0); first_face.len()];
    for (face, &own) in component.iter().enumerate() {
        let origin = scaled.triangle(first_face[own as usize] as usize)[0];
        let [a, b, c] = scaled.triangle(face).map(|p| p - origin);
        let (volume, area) = &mut sizes[own as usize];
        *volume += a.dot(b.cross(c));
        *area += (b - a).cross(c - a).length();
    }
    // Of a flat cavity, 2 volumes over the area are its thickness.
    let is_slit =
        |&(volume, area): &(f64, f64)| volume <= 0.0 && -2.0 / 3.0 * volume <= SLIT * extent * area;
    let components = sizes.iter().filter(|sizes| is_slit(sizes)).count();
    if components == 0 || components == sizes.len() {
        return (mesh, None);
    }
    let before = mesh.faces.len();
    let mut of_face = component.iter();
    mesh.faces.retain(|_| of_face.next().is_some_and(|&c| !is_slit(&sizes[c as usize])));
    let faces = before - mesh.faces.len();
    let kept = compact(mesh.vertices.len(), &mut mesh.faces);
    mesh.vertices = kept.into_iter().map(|v| mesh.vertices[v as usize]).collect();
    (mesh, Some(Repair::DroppedComponents { components, faces }))
}

/// An arrangement whose parts are separated where they touch, with short edges contracted.
fn closed(arranged: &TriMesh, unit: Unit, diagonal: f64) -> Option<Closed> {
    let (mut found, mut separated, mut contracted) = (examined(arranged)?, None, None);
    if !is_solid(&found) {
        (found, separated) = drawn_apart(&touching(arranged.clone()))?;
    }
    if found.refused.is_none() {
        let distance = SHORT * diagonal;
        let limits = vec![distance; found.mesh.vertices.len()];
        let Contraction { mesh: shorter, contracted: edges, dropped } =
            contract_short_edges(&found.mesh, &limits, Folds::Refused);
        let (all, left) = (volume(&found.mesh, unit), volume(&shorter, unit));
        // A plate as thin as that must not lose its walls.
        let is_alike = dropped == 0 && (all - left).abs() <= SLIGHT * all;
        if let Some(shorter) = examined(&shorter).filter(|found| is_alike && is_solid(found)) {
            contracted = (edges > 0).then_some(Repair::ContractedEdges { edges, distance });
            found = shorter;
        }
    }
    Some(Closed { found, separated, contracted })
}

/// Whether a surface extends as far as another.
fn reaches(found: &TriMesh, whole: &TriMesh) -> bool {
    let [Some(found), Some((low, high))] = [found, whole].map(TriMesh::bounding_box) else {
        return false;
    };
    let lost = (found.0 - low).abs().max((found.1 - high).abs()).max_element();
    lost <= LOSS * (high - low).max_element()
}

/// Whether bodies stand on each other in planes that rounding has parted.
pub(super) fn has_contacts(mesh: &TriMesh, unit: Unit) -> bool {
    let (scaled, most) = scaled(mesh, unit);
    contacts::has_contacts(&scaled, most)
}

/// The surface with such bodies pushed into each other.
fn pushed_together(mesh: &TriMesh, unit: Unit, order: Order) -> Option<(TriMesh, Repair)> {
    let (apart, most) = apart(mesh, unit);
    let (mut mesh, vertices, distance) = contacts::pushed(&apart, most, order)?;
    mesh.vertices.iter_mut().for_each(|v| *v = unit.restore(*v));
    let distance = unit.backward(distance, 1).unwrap_or_default();
    Some((mesh, Repair::PushedVertices { vertices, distance }))
}

/// The surface in scaled units, with the distance of bodies that stand on each other.
fn scaled(mesh: &TriMesh, unit: Unit) -> (TriMesh, f64) {
    let scaled = TriMesh { vertices: unit.forward_all(&mesh.vertices), faces: mesh.faces.clone() };
    let extent = scaled.bounding_box().map_or(0.0, |(low, high)| (high - low).length());
    (scaled, WALL * extent)
}

/// The same with vertices for each body.
fn apart(mesh: &TriMesh, unit: Unit) -> (TriMesh, f64) {
    let (scaled, most) = scaled(mesh, unit);
    let apart = match parted(&scaled.vertices, &scaled.faces) {
        Some(Parted { faces, vertices, .. }) => {
            let vertices = vertices.into_iter().map(|v| scaled.vertices[v as usize]).collect();
            TriMesh { vertices, faces }
        }
        None => scaled,
    };
    (apart, most)
}

/// Whether `found` bounds the region where the winding number of `surface` is at least 1, by points beside the faces of
/// `surface`, at least [`WALL`] away from them. One of [`SELDOM`] points may differ.
fn is_region(found: &TriMesh, surface: &TriMesh, unit: Unit) -> bool {
    let [of_found, of_surface] = [found, surface]
        .map(|mesh| InsideTest::of_scaled(unit, &unit.forward_all(&mesh.vertices), &mesh.faces));
    let (low, high) = surface.bounding_box().unwrap_or_default();
    let least = WALL * (unit.forward(high) - unit.forward(low)).length();
    let stride = surface.faces.len().div_ceil(COMPARED);
    let (mut compared, mut differing) = (0, 0);
    for face in (0..surface.faces.len()).step_by(stride.max(1)) {
        let [a, b, c] = surface.triangle(face).map(|p| unit.forward(p));
        let normal = (b - a).cross(c - a);
        let Some(across) = normal.try_normalize() else { continue };
        let at = PLACE[0] * a + PLACE[1] * b + PLACE[2] * c;
        for side in [-1.0, 1.0] {
            let p = at + side * (ASIDE * normal.length().sqrt()).max(least) * across;
            let windings = [&of_found, &of_surface].map(|test| test.winding_of_scaled(p));
            if let [Some(found), Some(surface)] = windings {
                compared += 1;
                differing += usize::from((found >= 1) != (surface >= 1));
            }
        }
    }
    differing * SELDOM <= compared
}

/// An examined solid after all repairs.
fn loaded(Inspection { mesh, mut report, .. }: Inspection, repairs: Vec<Repair>) -> Loaded {
    report.repairs = repairs;
    Loaded { mesh, report }
}

/// The vertices and faces of a mesh whose parts share a vertex wherever one touches another with a vertex.
fn touching(TriMesh { vertices, mut faces }: TriMesh) -> TriMesh {
    let welds = weld_within(&vertices, 0.0);
    faces.as_flattened_mut().iter_mut().for_each(|v| *v = welds[*v as usize]);
    faces.retain(|&[a, b, c]| a != b && b != c && c != a);
    let points = Unit::of(&vertices).forward_all(&vertices);
    let faces = split_at_vertices(&points, &faces);
    TriMesh { vertices, faces }
}

/// A surface whose parts are separated where they touch: the first way that gives a solid, or else the first. With the
/// displacement.
fn drawn_apart(mesh: &TriMesh) -> Option<(Inspection, Option<Repair>)> {
    let ways = [(false, Stays::Flattest), (true, Stays::Flattest), (true, Stays::Sharpest)];
    let mut tried = ways.into_iter().filter_map(|(halves, stays)| {
        let TriMesh { mut vertices, mut faces } = mesh.clone();
        if halves {
            halve_shared_edges(&mut vertices, &mut faces);
        }
        let separated = separate(&mut vertices, &mut faces, stays);
        Some((examined(&TriMesh { vertices, faces })?, separated))
    });
    let first = tried.next()?;
    if is_solid(&first.0) {
        return Some(first);
    }
    Some(tried.find(|(found, _)| is_solid(found)).unwrap_or(first))
}

/// The enclosed volume in scaled units.
fn volume(mesh: &TriMesh, unit: Unit) -> f64 {
    let origin = unit.forward(mesh.vertices[0]);
    let of_face = |face| {
        let [a, b, c] = mesh.triangle(face).map(|p| unit.forward(p) - origin);
        a.dot(b.cross(c)) / 6.0
    };
    (0..mesh.faces.len()).map(of_face).sum()
}

fn examined(mesh: &TriMesh) -> Option<Inspection> {
    let mut soup = PolygonSoup::of_triangles(&mesh.vertices, &mesh.faces).ok()?;
    Some(orient_and_examine(repair(&mut soup).ok()?))
}

/// Whether an oriented surface bounds a solid. One whose shells the check turns was not what its orientation said.
fn is_solid(found: &Inspection) -> bool {
    let is_turned = |repair: &Repair| {
        use Repair::{ReorientedFaces, TurnedInward, TurnedOutward};
        matches!(repair, ReorientedFaces { .. } | TurnedInward { .. } | TurnedOutward { .. })
    };
    let SurfaceReport { self_intersecting, repairs, .. } = &found.report;
    found.refused.is_none() && !self_intersecting && !repairs.iter().any(is_turned)
}

/// The triangles with doubled ones, after a weld within a distance.
fn welded(soup: &PolygonSoup, unit: Unit, distance: f64) -> Option<(Repaired, Option<Repair>)> {
    let exact = weld_within(&soup.vertices, 0.0);
    let welds = weld_within(&soup.vertices, distance);
    let built = build(soup, unit, &welds, Duplicates::Kept).ok()?;
    let vertices = welds.iter().zip(&exact).filter(|(a, b)| a != b).count();
    let repair = (vertices > 0).then_some(Repair::WeldedWithin { vertices, distance });
    Some((built, repair))
}

/// Leaves out the walls between bodies.
fn drop_walls(vertices: &mut Vec<Vec3>, faces: &mut Vec<[u32; 3]>) -> Option<Repair> {
    let unit = Unit::of(vertices);
    let points = unit.forward_all(vertices);
    let low = points.iter().fold(Vec3::INFINITY, |low, &p| low.min(p));
    let high = points.iter().fold(Vec3::NEG_INFINITY, |high, &p| high.max(p));
    let (is_wall, distance) = walls(unit, &points, faces, WALL * (high - low).length());
    let dropped = is_wall.iter().filter(|&&wall| wall).count();
    if dropped == 0 || dropped == faces.len() {
        return None;
    }
    let mut of_face = is_wall.iter();
    faces.retain(|_| of_face.next() == Some(&false));
    let kept = compact(vertices.len(), faces);
    *vertices = kept.into_iter().map(|v| vertices[v as usize]).collect();
    let distance = unit.backward(distance, 1).unwrap_or_default();
    Some(Repair::DroppedWalls { faces: dropped, distance })
}

/// Faces oriented like their neighbours, and bodies outward, or inward where they are cavities; with the repairs. None for
/// one-sided surfaces, which have no winding number.
fn oriented(built: Repaired) -> Option<(TriMesh, Vec<Repair>)> {
    let Repaired { mut vertices, mut faces, unit, points, .. } = built;
    let all = faces.len();
    let single = without_repeated(&faces);
    let Parted { faces: apart, vertices: of, turned } = match parted(&points, &single) {
        Some(found) => {
            faces = single;
            found
        }
        // A face of two bodies.
        None => parted(&points, &faces)?,
    };
    let repeated = all - faces.len();
    let points: Vec<Vec3> = of.iter().map(|&v| points[v as usize]).collect();
    let topology = Topology::new(points.len(), &apart);
    let found = intersections(&points, &apart, &topology.component);
    if !found.complete {
        // Without all pairs that touch, nesting is unknown.
        return None;
    }
    let shells = shells(unit, &points, &apart, &topology, &found).ok()?;
    let is_wrong: Vec<bool> =
        shells.iter().map(|shell| !shell.is_flat() && !shell.is_right()).collect();
    let mut repairs = repairs(&turned, &is_wrong, &shells, &topology.component);
    let dropped = Repair::DroppedDuplicateFaces { faces: repeated };
    repairs.extend((repeated > 0).then_some(dropped));
    let of_face = topology.component.iter().map(|&c| is_wrong[c as usize]);
    turn_over(&mut faces, turned.into_iter().zip(of_face).map(|(turned, wrong)| turned != wrong));
    let components = shells.iter().filter(|shell| shell.is_flat()).count();
    if components > 0 {
        let all = faces.len();
        let mut of_face = topology.component.iter();
        faces.retain(|_| of_face.next().is_some_and(|&c| !shells[c as usize].is_flat()));
        repairs.push(Repair::DroppedComponents { components, faces: all - faces.len() });
        let kept = compact(vertices.len(), &mut faces);
        vertices = kept.into_iter().map(|v| vertices[v as usize]).collect();
    }
    Some((TriMesh { vertices, faces }, repairs))
}

/// The corners of a face in their order, from the least one on.
fn from_least(mut face: [u32; 3]) -> [u32; 3] {
    let least = (0..3).min_by_key(|&k| face[k]).unwrap_or_default();
    face.rotate_left(least);
    face
}

/// Faces without those that have the corners and the orientation of an earlier one.
fn without_repeated(faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut seen = HashSet::new();
    let is_new = |face: &&[u32; 3]| seen.insert(from_least(**face));
    faces.iter().filter(is_new).copied().collect()
}

/// The boundary of the region with a winding number of at least 1: with few vertices in plane parts, where faces may overlap,
/// and with all vertices where faces of the surface meet. None if nothing is left.
fn arranged(mesh: &TriMesh, unit: Unit) -> Option<[TriMesh; 2]> {
    let triangle = |face| {
        mesh.triangle(face).map(|v| {
            let Vec3 { x, y, z } = unit.forward(v);
            linalg::Vec3::new(x, y, z)
        })
    };
    let triangles: Vec<_> = (0..mesh.faces.len()).map(triangle).collect();
    // The library panics where faces in one plane to within rounding leave it no way to find a side.
    let (graph, pieces) = catch_unwind(|| {
        let graph = build_graph(&triangles, &[]);
        let complex = build_cells(&graph);
        let windings = windings(&graph, &complex, [&triangles, &[]]);
        let pieces = extract(&graph, &complex, &windings, OpType::Add, WindingRule::Positive);
        (graph, pieces)
    })
    .ok()?;

    let position = |[x, y, z]: [f64; 3]| unit.restore(Vec3::new(x, y, z));
    let simple =
        assemble(&pieces, &graph.verts, &graph.verts_f64, |_| true, None).get_mesh_gl64(-1);
    let rows = simple.vert_properties.chunks_exact(simple.num_prop as usize);
    let corners = simple.tri_verts.chunks_exact(3);
    let simple = TriMesh {
        vertices: rows.map(|row| position([row[0], row[1], row[2]])).collect(),
        faces: corners.map(|t| [t[0], t[1], t[2]].map(|v| v as u32)).collect(),
    };

    let mut faces: Vec<[u32; 3]> = pieces.iter().map(|piece| piece.vi).collect();
    let kept = compact(graph.verts_f64.len(), &mut faces).into_iter();
    let kept = kept.map(|v| graph.verts_f64[v as usize]);
    let vertices = kept.map(|p| position([p.x, p.y, p.z])).collect();
    (!faces.is_empty()).then_some([simple, TriMesh { vertices, faces }])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron at a place, outward.
    fn tetrahedron(at: Vec3, first: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|v| v + at).to_vec();
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        (vertices, faces.map(|face| face.map(|v| v + first)).to_vec())
    }

    #[test]
    fn a_lost_body_is_noticed() {
        let (mut vertices, mut faces) = tetrahedron(Vec3::ZERO, 0);
        let one = TriMesh { vertices: vertices.clone(), faces: faces.clone() };
        let other = tetrahedron(Vec3::splat(0.05), 4);
        vertices.extend(other.0);
        faces.extend(other.1);
        let both = TriMesh { vertices, faces };
        let unit = Unit::of(&both.vertices);
        let [simple, whole] = arranged(&both, unit).expect("a body");
        assert!([&simple, &whole].iter().all(|found| is_region(found, &both, unit)));
        assert!(is_region(&one, &one, unit));
        assert!(!is_region(&one, &both, unit));
    }
}
