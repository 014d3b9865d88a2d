//! From the simplices of a file to the canonical form, with a note on every repair.

use super::error::MaErrorKind;
use super::{Annotations, LoadedMa, Radii};
use crate::complex::{MedialMesh, Sphere};

/// A few spheres of radius 0 are a medial mesh of little use; so many are the vertices of a surface.
const FEWEST_OF_A_SURFACE: usize = 4;

/// Brings the simplices of a file to canonical form: indices ascend, lists are sorted, every
/// simplex stands once, every side of a face is an edge. The set of points covered stays the same.
///
/// Precondition: indices are below the number of spheres, and numbers are finite.
///
/// # Errors
/// When radii are needed and all are 0.
pub(super) fn canonical(
    mut spheres: Vec<Sphere>,
    mut edges: Vec<[u32; 2]>,
    mut faces: Vec<[u32; 3]>,
    radii: Radii,
    mut notes: Vec<String>,
) -> Result<LoadedMa, MaErrorKind> {
    let all_are_points = spheres.iter().all(|sphere| sphere.radius == 0.0);
    if radii != Radii::NotNeeded && spheres.len() >= FEWEST_OF_A_SURFACE && all_are_points {
        return Err(MaErrorKind::Points);
    }
    let warnings = without_signs(&mut spheres, radii);
    note_disorder(&edges, "edge", &mut notes);
    note_disorder(&faces, "face", &mut notes);
    for edge in &mut edges {
        edge.sort_unstable();
    }
    for face in &mut faces {
        face.sort_unstable();
    }
    flatten_faces(&mut faces, &mut edges, &mut notes);
    let all = edges.len();
    edges.retain(|[a, b]| a != b);
    note(&mut notes, all - edges.len(), "edge", "edges", "dropped: both ends are the same sphere");
    sort_once(&mut edges, "edge", &mut notes);
    sort_once(&mut faces, "face", &mut notes);
    add_missing_edges(&mut edges, &faces, &mut notes);
    let mesh = MedialMesh { spheres, edges, faces, contacts: None };
    debug_assert_eq!(mesh.check(), Ok(()));
    Ok(LoadedMa { mesh, notes, warnings, kept: None, annotations: Annotations::default() })
}

/// Takes the absolute values of negative radii, which some tools write for spheres outside of a surface.
fn without_signs(spheres: &mut [Sphere], radii: Radii) -> Vec<String> {
    let mut negative = 0;
    for sphere in spheres {
        negative += usize::from(sphere.radius < 0.0);
        sphere.radius = sphere.radius.abs();
    }
    match negative {
        _ if radii == Radii::NotNeeded => Vec::new(),
        0 => Vec::new(),
        1 => vec!["1 radius is negative: its absolute value was taken".to_owned()],
        _ => vec![format!("{negative} radii are negative: their absolute values were taken")],
    }
}

/// Whether a list is in canonical order matters to nobody but those who compare files.
fn note_disorder<const N: usize>(
    simplices: &[[u32; N]],
    what: &'static str,
    notes: &mut Vec<String>,
) {
    let descending = simplices.iter().filter(|s| s.windows(2).any(|pair| pair[0] > pair[1]));
    note(notes, descending.count(), what, &format!("{what}s"), "written with descending indices");
    if simplices.windows(2).any(|pair| pair[0] > pair[1]) {
        notes.push(format!("the {what}s were not in ascending order and were sorted"));
    }
}

/// A face that names a sphere twice covers one edge: keep that, drop the face.
fn flatten_faces(faces: &mut Vec<[u32; 3]>, edges: &mut Vec<[u32; 2]>, notes: &mut Vec<String>) {
    let all = faces.len();
    faces.retain(|&[a, b, c]| {
        let proper = a != b && b != c;
        if !proper {
            edges.push([a, c]);
        }
        proper
    });
    let verb = "replaced by an edge: two corners are the same sphere";
    note(notes, all - faces.len(), "face", "faces", verb);
}

fn sort_once<T: Ord>(simplices: &mut Vec<T>, what: &'static str, notes: &mut Vec<String>) {
    let all = simplices.len();
    simplices.sort_unstable();
    simplices.dedup();
    let many = format!("{what}s");
    note(notes, all - simplices.len(), what, &many, "listed more than once and merged");
}

fn add_missing_edges(edges: &mut Vec<[u32; 2]>, faces: &[[u32; 3]], notes: &mut Vec<String>) {
    let listed = edges.len();
    let mut sides: Vec<[u32; 2]> =
        faces.iter().flat_map(|&[a, b, c]| [[a, b], [a, c], [b, c]]).collect();
    sides.sort_unstable();
    sides.dedup();
    sides.retain(|side| edges.binary_search(side).is_err());
    edges.append(&mut sides);
    edges.sort_unstable();
    let verb = "added: sides of faces that were not listed";
    note(notes, edges.len() - listed, "edge", "edges", verb);
}

/// Says what was done to a number of things, if there were any.
pub(super) fn note(notes: &mut Vec<String>, count: usize, one: &str, many: &str, verb: &str) {
    match count {
        0 => {}
        1 => notes.push(format!("1 {one} was {verb}")),
        _ => notes.push(format!("{count} {many} were {verb}")),
    }
}
