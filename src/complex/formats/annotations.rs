//! What tools of the field write beside spheres, edges and faces: kept as data, used by nothing that measures.

use super::canonical::note;
use super::flags::{EDGE, FACE, Flags, SPHERE};
use super::trailer::RawPart;
use crate::complex::MedialMesh;

/// Types and structure of a medial mesh, as its tool wrote them.
///
/// Types are kept as numbers without a meaning, since tools number them differently: a sphere of type 3 is on a seam for
/// MATFP, and type 2 of an edge is an external feature.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Annotations {
    /// The type of each sphere, empty where the file has none; `None` for spheres without.
    pub sphere_types: Vec<Option<i32>>,
    /// The type of each edge, likewise. Of an edge that the file lists twice, the type of its first line.
    pub edge_types: Vec<Option<i32>>,
    /// The importance of each face, likewise.
    pub importance: Vec<Option<f64>>,
    /// Tetrahedra between spheres, with ascending indices. Their sides are no part of the medial mesh.
    pub tetrahedra: Vec<[u32; 4]>,
    /// The sheets, seams, boundaries and junctions that the file tells apart.
    pub parts: Vec<Part>,
}

/// One part of the structure of a medial mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The part's number in the file.
    pub id: u64,
    /// What it is a part of, and so what its members are.
    pub kind: PartKind,
    /// Indices into the faces, edges or spheres of the medial mesh, ascending.
    pub members: Vec<u32>,
}

/// Kinds of parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// A sheet: faces.
    Sheet,
    /// Where sheets meet: edges.
    Seam,
    /// The rim of a sheet: edges.
    Boundary,
    /// Where seams meet: spheres.
    Junction,
}

impl PartKind {
    /// The kind of a number in a file.
    pub(super) fn of(number: u64) -> Option<Self> {
        [Self::Sheet, Self::Seam, Self::Boundary, Self::Junction].get(number as usize).copied()
    }

    /// The kind of records that the members are.
    pub(super) fn members(self) -> usize {
        match self {
            Self::Sheet => FACE,
            Self::Seam | Self::Boundary => EDGE,
            Self::Junction => SPHERE,
        }
    }
}

/// The records of a file in their order, before any was dropped or merged.
pub(super) struct InFile {
    /// The place of each sphere among those left; `u32::MAX` for dropped ones.
    pub(super) renumbered: Vec<u32>,
    pub(super) edges: Vec<[u32; 2]>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) tetrahedra: Vec<[u32; 4]>,
    pub(super) parts: Vec<RawPart>,
}

impl InFile {
    /// Carries what stood beside the records of a file over to the medial mesh that they became.
    pub(super) fn annotate(
        self,
        mesh: &MedialMesh,
        flags: &Flags,
        warnings: &mut Vec<String>,
    ) -> Annotations {
        let sphere = |v: u32| Some(self.renumbered[v as usize]).filter(|&v| v != u32::MAX);
        let edge = |record: usize| place(&mesh.edges, self.edges[record].map(sphere));
        let face = |record: usize| place(&mesh.faces, self.faces[record].map(sphere));
        let types = |kind: usize| flags.values(kind).iter().map(|value| value.map(|v| v as i32));
        let spheres = types(SPHERE).enumerate().map(|(v, value)| (sphere(v as u32), value));
        let edges = types(EDGE).enumerate().map(|(record, value)| (edge(record), value));
        let faces =
            flags.values(FACE).iter().enumerate().map(|(record, &value)| (face(record), value));
        let (edge_types, conflicts) = spread(mesh.edges.len(), edges);
        let verb = "listed again with another type: the first is kept";
        note(warnings, conflicts, "edge", "edges", verb);
        let live = |corners: [u32; 4]| {
            let mut corners = all(corners.map(sphere))?;
            corners.sort_unstable();
            Some(corners)
        };
        let part = |part: &RawPart| {
            let member = |&index: &u64| match part.kind.members() {
                FACE => face(index as usize),
                EDGE => edge(index as usize),
                _ => sphere(index as u32),
            };
            let mut members: Vec<u32> = part.members.iter().filter_map(member).collect();
            members.sort_unstable();
            members.dedup();
            Part { id: part.id, kind: part.kind, members }
        };
        Annotations {
            sphere_types: spread(mesh.spheres.len(), spheres).0,
            edge_types,
            importance: spread(mesh.faces.len(), faces).0,
            tetrahedra: self.tetrahedra.iter().filter_map(|&corners| live(corners)).collect(),
            parts: self.parts.iter().map(part).collect(),
        }
    }
}

/// The values at their places, empty where there is none, and the number of those that contradict an earlier one.
fn spread<T: Copy + PartialEq>(
    len: usize,
    values: impl Iterator<Item = (Option<u32>, Option<T>)>,
) -> (Vec<Option<T>>, usize) {
    let mut all: Vec<Option<T>> = Vec::new();
    let mut conflicts = 0;
    for (place, value) in values {
        let (Some(place), Some(value)) = (place, value) else { continue };
        all.resize(len, None);
        let kept = *all[place as usize].get_or_insert(value);
        conflicts += usize::from(kept != value);
    }
    (all, conflicts)
}

/// The place of a simplex in a canonical list, unless one of its spheres was dropped or it was no proper one.
fn place<const N: usize>(list: &[[u32; N]], corners: [Option<u32>; N]) -> Option<u32> {
    let mut corners = all(corners)?;
    corners.sort_unstable();
    list.binary_search(&corners).ok().map(|place| place as u32)
}

fn all<const N: usize>(corners: [Option<u32>; N]) -> Option<[u32; N]> {
    corners.iter().all(Option::is_some).then(|| corners.map(Option::unwrap_or_default))
}
