//! Edges of the Voronoi medial mesh that bulge are split.
//!
//! Along an edge of the Voronoi diagram the radius is a convex function, the distance to the samples that both ends touch. A
//! medial mesh interpolates it linearly. Where a ball rolls around a concave edge of a coarse surface, the cone between
//! two spheres reaches far beyond that edge, and fills grooves. Such an edge gets a sphere with the exact radius where it
//! bulges most; so does a diagonal of a Voronoi facet. A subdivision changes no topology.
//!
//! No paper has this step. Filters that select Voronoi facets take the mesh without it.

use std::collections::{HashMap, HashSet};

use super::{Contacts, MedialMesh, Sphere};
use crate::Vec3;
use crate::surface::{InsideTest, Side};

/// Excess of an interpolated radius, as a fraction of the diagonal, above which a mesh is subdivided.
const WIDE: f64 = 0.01;

/// Excess that is left then.
const CLOSE: f64 = 0.005;

/// Places along an edge where it may be split.
const PLACES: [f64; 3] = [0.5, 0.25, 0.75];

/// Limit of rounds. Each shortens the longest edges by a quarter or more, and few meshes need ten.
const ROUNDS: usize = 100;

/// The Voronoi medial mesh, in normalised units, with spheres on the edges that bulge inside the solid. None where none does.
/// Cost: `O(n)` for each round, with few rounds.
pub(crate) fn without_bulges(mesh: &MedialMesh, inside: &InsideTest) -> Option<MedialMesh> {
    let mut refined: Option<MedialMesh> = None;
    for _ in 0..ROUNDS {
        let mesh = refined.as_ref().unwrap_or(mesh);
        let contacts = mesh.contacts.as_ref()?;
        let bulges = bulges(mesh, contacts, inside);
        let least = if refined.is_some() { CLOSE } else { WIDE };
        if !bulges.values().any(|bulge| bulge.excess > least) {
            return refined;
        }
        refined = Some(subdivided(mesh, contacts, bulges));
    }
    refined
}

/// Where an edge bulges most.
struct Bulge {
    excess: f64,
    /// Length of the edge.
    length: f64,
    sphere: Sphere,
    /// What the sphere touches.
    samples: [u32; 4],
}

/// The bulges above [`CLOSE`] by edge.
fn bulges(mesh: &MedialMesh, contacts: &Contacts, inside: &InsideTest) -> HashMap<[u32; 2], Bulge> {
    let found = mesh.edges.iter().filter_map(|&edge| Some((edge, bulge(mesh, contacts, edge)?)));
    let found: Vec<([u32; 2], Bulge)> = found.collect();
    let centres: Vec<Vec3> = found.iter().map(|(_, bulge)| bulge.sphere.centre).collect();
    let sides = inside.sides(&centres);
    let found = found.into_iter().zip(sides).filter(|(_, side)| *side == Side::Inside);
    found.map(|(found, _)| found).collect()
}

/// Splits the edges that are the longest bulging ones of all faces around them.
fn subdivided(
    mesh: &MedialMesh,
    contacts: &Contacts,
    mut bulging: HashMap<[u32; 2], Bulge>,
) -> MedialMesh {
    let mut is_shorter = HashSet::new();
    for &[a, b, c] in &mesh.faces {
        let sides = [[a, b], [a, c], [b, c]];
        let lengths = sides.iter().filter_map(|side| Some((bulging.get(side)?.length, side)));
        let mut around: Vec<_> = lengths.collect();
        around.sort_by(|(l, a), (m, b)| m.total_cmp(l).then(a.cmp(b)));
        is_shorter.extend(around.into_iter().skip(1).map(|(_, &side)| side));
    }
    bulging.retain(|edge, _| !is_shorter.contains(edge));
    let (mut spheres, mut of_sphere) = (mesh.spheres.clone(), contacts.of_sphere.clone());
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut edges = Vec::new();
    for &[a, b] in &mesh.edges {
        match bulging.get(&[a, b]) {
            Some(bulge) => {
                let v = spheres.len() as u32;
                spheres.push(bulge.sphere);
                of_sphere.push(bulge.samples);
                middles.insert([a, b], v);
                edges.extend([[a, v], [b, v]]);
            }
            None => edges.push([a, b]),
        }
    }
    let faces = mesh.faces.iter().flat_map(|&[a, b, c]| {
        let sides = [([a, b], c), ([a, c], b), ([b, c], a)];
        let split = sides.iter().find_map(|&(side, apex)| Some((side, apex, *middles.get(&side)?)));
        match split {
            Some(([a, b], apex, v)) => vec![[a, apex, v], [b, apex, v]],
            None => vec![[a, b, c]],
        }
    });
    let faces = faces.collect();
    let mut mesh =
        MedialMesh::from_simplices(spheres, edges, faces).expect("a subdivision is a complex");
    mesh.contacts = Some(Contacts { samples: contacts.samples.clone(), of_sphere });
    mesh
}

/// The bulge of an edge, if it is above [`CLOSE`].
fn bulge(mesh: &MedialMesh, contacts: &Contacts, edge: [u32; 2]) -> Option<Bulge> {
    let [a, b] = mesh.spheres_of(edge);
    let length = a.centre.distance(b.centre);
    // The excess is at most half the length.
    if length <= 2.0 * CLOSE {
        return None;
    }
    let [own, other] = edge.map(|v| contacts.of_sphere[v as usize]);
    let mut shared = own.into_iter().filter(|id| other.contains(id));
    let first = shared.next()?;
    let samples = [Some(first), shared.next(), shared.next(), shared.next()];
    let samples = samples.map(|id| id.unwrap_or(first));
    let places = PLACES.map(|t| {
        let centre = a.centre.lerp(b.centre, t);
        let distances = samples.map(|id| centre.distance(contacts.samples[id as usize]));
        let radius = distances.into_iter().fold(f64::INFINITY, f64::min);
        (a.radius + t * (b.radius - a.radius) - radius, Sphere::new(centre, radius))
    });
    let (excess, sphere) = places.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    (excess > CLOSE).then_some(Bulge { excess, length, sphere, samples })
}
