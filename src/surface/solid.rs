//! From a polygon soup that crosses, overlaps or touches itself to the solid that it means.
//!
//! The solid is where the winding number of the surface is at least 1. The crate `manifold-rust` computes it with an exact
//! arrangement of the triangles (B. Lévy 2025, *Exact predicates, exact constructions and combinatorics for mesh CSG*,
//! <https://doi.org/10.1145/3744642>, describes the approach); walls between bodies and doubled faces have the solid on both
//! sides, or on none, and disappear. New vertices are rounded to double precision, so the result is checked like any
//! file.
//!
//! 1. *Weld*: vertices at one place; if the surface is open then, the smallest of [`TOLERANCES`] that closes it.
//! 2. *Orient*: neighbours alike, then every component that encloses a negative volume outward, if it is not a cavity.
//! 3. *Resolve*: the winding number. Repeated while rounding makes faces cross.
//! 4. *Separate*: parts that touch in a vertex.

use manifold_rust::manifold::Manifold;
use manifold_rust::types::{Error, MeshGL64, WindingRule};

use super::check::orient_and_examine;
use super::mend::separate;
use super::mesh::{TriMesh, Unit};
use super::repair::{Duplicates, Repaired, build, repair, weld_within};
use super::report::Repair;
use super::soup::PolygonSoup;
use super::topology::turn_over;
use super::{Folds, Inspection, Loaded, contract_short_edges};
use crate::Vec3;

/// Largest distances of welded vertices, as fractions of the diagonal of the bounding box.
const TOLERANCES: [f64; 5] = [0.0, 1e-12, 1e-9, 1e-7, 1e-6];

/// Length below which edges of the result are contracted, as a fraction of the diagonal.
const SHORT: f64 = 1e-5;

/// Change of the volume by a further pass, as a share, above which the arrangement is taken for wrong.
const LOSS: f64 = 1e-6;

/// Limit of passes through the arrangement.
const PASSES: usize = 4;

/// The solid of a closed surface, whose triangles after exact welds are `checked`. None if it is open, or no pass gives a
/// surface without crossings.
pub(super) fn resolve(soup: &PolygonSoup, unit: Unit, checked: &Inspection) -> Option<Loaded> {
    let diagonal = checked.report.diagonal;
    let mut repairs = checked.report.repairs.clone();
    let mut mesh = match &checked.refused {
        // Oriented by nesting, it needs no guess.
        None => checked.mesh.clone(),
        Some(_) => {
            let (built, weld) = closed(soup, unit, diagonal)?;
            repairs.extend(weld);
            oriented(built)?
        }
    };
    let replaced = mesh.faces.len();
    // A weld may have been all that was missing.
    let welded = examined(&mesh)?;
    if is_solid(&welded) {
        let Inspection { mesh, mut report, .. } = welded;
        report.repairs = repairs;
        return Some(Loaded { mesh, report });
    }
    for pass in 0..PASSES {
        let before = volume(&mesh);
        mesh = arranged(&mesh)?;
        // The first pass alone removes overlaps.
        if pass > 0 && (volume(&mesh) - before).abs() > LOSS * before.abs() {
            return None;
        }
        // Vertices at one place have to be one vertex to be seen as touching parts.
        let TriMesh { mut vertices, mut faces } = examined(&mesh)?.mesh;
        let separated = separate(&mut vertices, &mut faces);
        let mut found = examined(&TriMesh { vertices, faces })?;
        if found.refused.is_none() {
            let limits = vec![SHORT * diagonal; found.mesh.vertices.len()];
            let contracted = contract_short_edges(&found.mesh, &limits, Folds::Refused);
            found = examined(&contracted.mesh).filter(is_solid).unwrap_or(found);
        }
        if is_solid(&found) {
            let Inspection { mesh, mut report, .. } = found;
            repairs.push(Repair::ResolvedFaces { faces: replaced, by: mesh.faces.len() });
            repairs.extend(separated);
            report.repairs = repairs;
            return Some(Loaded { mesh, report });
        }
        mesh = found.mesh;
    }
    None
}

/// The enclosed volume.
fn volume(mesh: &TriMesh) -> f64 {
    let origin = mesh.vertices[0];
    let of_face = |face| {
        let [a, b, c] = mesh.triangle(face).map(|p| p - origin);
        a.dot(b.cross(c)) / 6.0
    };
    (0..mesh.faces.len()).map(of_face).sum()
}

fn examined(mesh: &TriMesh) -> Option<Inspection> {
    let mut soup = PolygonSoup::of_triangles(&mesh.vertices, &mesh.faces).ok()?;
    Some(orient_and_examine(repair(&mut soup).ok()?))
}

fn is_solid(found: &Inspection) -> bool {
    found.refused.is_none() && !found.report.self_intersecting
}

/// The triangles with doubled ones, welded within the smallest of [`TOLERANCES`] that closes the surface.
fn closed(soup: &PolygonSoup, unit: Unit, diagonal: f64) -> Option<(Repaired, Option<Repair>)> {
    let exact = weld_within(&soup.vertices, 0.0);
    TOLERANCES.into_iter().find_map(|tolerance| {
        let distance = tolerance * diagonal;
        let welds = weld_within(&soup.vertices, distance);
        let built = build(soup, unit, &welds, Duplicates::Kept).ok()?;
        let vertices = welds.iter().zip(&exact).filter(|(a, b)| a != b).count();
        let repair = (vertices > 0).then_some(Repair::WeldedWithin { vertices, distance });
        (built.topology.boundary_edges == 0).then_some((built, repair))
    })
}

/// Faces oriented like their neighbours, and components that are within no other outward. None for one-sided surfaces, which
/// have no winding number.
fn oriented(built: Repaired) -> Option<TriMesh> {
    let Repaired { vertices, mut faces, topology, .. } = built;
    let turned = topology.turns(&faces).ok()?;
    turn_over(&mut faces, turned.into_iter());
    let components = topology.first_face.len();
    let mut volumes = vec![0.0; components];
    let mut boxes = vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); components];
    for (face, &component) in faces.iter().zip(&topology.component) {
        let component = component as usize;
        let origin = vertices[faces[topology.first_face[component] as usize][0] as usize];
        let [a, b, c] = face.map(|v| vertices[v as usize]);
        volumes[component] += (a - origin).dot((b - origin).cross(c - origin));
        let (low, high) = &mut boxes[component];
        (*low, *high) = (low.min(a).min(b).min(c), high.max(a).max(b).max(c));
    }
    let is_within = |inner: usize, outer: usize| {
        let ((low, high), (from, to)) = (boxes[inner], boxes[outer]);
        inner != outer && low.cmpge(from).all() && high.cmple(to).all()
    };
    let is_wrong: Vec<bool> = (0..components)
        .map(|c| volumes[c] < 0.0 && !(0..components).any(|outer| is_within(c, outer)))
        .collect();
    turn_over(&mut faces, topology.component.iter().map(|&c| is_wrong[c as usize]));
    Some(TriMesh { vertices, faces })
}

/// The boundary of the region with a winding number of at least 1.
fn arranged(mesh: &TriMesh) -> Option<TriMesh> {
    let input = MeshGL64 {
        num_prop: 3,
        vert_properties: mesh.vertices.iter().flat_map(|v| v.to_array()).collect(),
        tri_verts: mesh.faces.iter().flatten().map(|&v| v.into()).collect(),
        ..MeshGL64::default()
    };
    let soup = Manifold::from_mesh_gl64_robust(&input);
    let solid = soup.rebuild_solid(WindingRule::Positive);
    if [soup.status(), solid.status()] != [Error::NoError; 2] {
        return None;
    }
    let output = solid.get_mesh_gl64(-1);
    let width = output.num_prop as usize;
    let position = |row: &[f64]| Vec3::new(row[0], row[1], row[2]);
    let vertices = output.vert_properties.chunks_exact(width).map(position).collect();
    let faces = output.tri_verts.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|v| v as u32));
    let mesh = TriMesh { vertices, faces: faces.collect() };
    (!mesh.faces.is_empty()).then_some(mesh)
}
