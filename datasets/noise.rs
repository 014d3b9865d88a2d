//! Declared noise.

use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::str::FromStr;

use medial::Vec3;
use medial::geometry::predicates::projection_axis;
use medial::geometry::triangles_meet;
use medial::surface::{Normalisation, TriMesh, validate};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// What noise does to a mesh, and what its magnitude is a fraction of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseKind {
    /// Every vertex is displaced uniformly in a ball; its radius as a fraction of the diagonal.
    #[default]
    Isotropic,
    /// Every vertex is displaced along its normal, uniformly to both sides; at most this fraction of the diagonal.
    Normal,
    /// Samples are missing: a share of the vertices is removed, and the surface closed over them.
    Dropped,
}

impl NoiseKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Isotropic, Self::Normal, Self::Dropped];

    fn name(self) -> &'static str {
        match self {
            Self::Isotropic => "isotropic",
            Self::Normal => "normal",
            Self::Dropped => "dropped",
        }
    }
}

impl fmt::Display for NoiseKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for NoiseKind {
    type Err = NoiseError;

    fn from_str(text: &str) -> Result<Self, NoiseError> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| NoiseError::Kind(text.to_owned()))
    }
}

/// Why there is no noisy mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoiseError {
    /// No kind has the name.
    #[error("{0:?} is no kind of noise; use isotropic, normal or dropped")]
    Kind(String),
    /// Not a fraction.
    #[error("{kind} noise of {magnitude}: give a fraction from 0 to 1")]
    Magnitude {
        /// The kind.
        kind: NoiseKind,
        /// What was asked.
        magnitude: f64,
    },
    /// The mesh does not bound a solid.
    #[error("no vertex can be dropped: {0}")]
    NotManifold(String),
    /// No further vertex can go without a crossing, a fold or a loss of topology.
    #[error(
        "{asked} of {vertices} vertices were to be dropped, but after {dropped} none can go without a crossing or a fold; \
         ask for a smaller share"
    )]
    TooFew {
        /// Vertices to be dropped.
        asked: usize,
        /// Those that could be.
        dropped: usize,
        /// Vertices of the mesh.
        vertices: usize,
    },
}

/// The mesh with noise of a kind; see [`NoiseKind`] for what the magnitude, from 0 to 1, is a fraction of.
///
/// The same seed gives the same mesh on every machine. Displacements are in proportion to the magnitude; they
/// leave the faces as they are, which may intersect each other where the magnitude exceeds the edge length. A
/// mesh without extent is returned as it is.
///
/// *Dropped* samples are those of a random order that can go: the vertex is merged into that neighbour which sweeps
/// the least volume, if the link condition holds, no face turns by more than 60 degrees or gets an angle below
/// 5 degrees, and no new face meets another one (exact). So the mesh stays closed, oriented, manifold, of the same
/// topology, and embedded if it was; all vertices that are left stay where they are. A vertex that cannot go
/// is tried again once others have gone. Cost about `O(V)` for even meshes.
///
/// # Errors
/// [`NoiseError`] when the magnitude is not a fraction, or too few vertices can be dropped.
pub fn noisy(
    mesh: &TriMesh,
    kind: NoiseKind,
    magnitude: f64,
    seed: u64,
) -> Result<TriMesh, NoiseError> {
    if !(0.0..=1.0).contains(&magnitude) {
        return Err(NoiseError::Magnitude { kind, magnitude });
    }
    match kind {
        NoiseKind::Isotropic => Ok(add_noise(mesh, magnitude, seed)),
        NoiseKind::Normal => Ok(along_normals(mesh, magnitude, seed)),
        NoiseKind::Dropped => without_share(mesh, magnitude, seed),
    }
}

/// The mesh with every vertex displaced by a random vector, independent and uniform in the ball of
/// radius `eta` times the bounding-box diagonal.
///
/// Isotropic: papers give a magnitude and leave the direction open. The same seed gives the same
/// displacements on every machine, in proportion to `eta`. The faces stay as they are and may
/// intersect each other when `eta` exceeds the edge length. A mesh without extent is returned as
/// it is.
///
/// # Panics
/// If `eta` is negative or not finite.
pub fn add_noise(mesh: &TriMesh, eta: f64, seed: u64) -> TriMesh {
    assert!(eta.is_finite() && eta >= 0.0, "noise of {eta} times the diagonal");
    let Some(Normalisation { diagonal, .. }) = Normalisation::of(mesh) else {
        return mesh.clone();
    };
    let mut random = Pcg64::seed_from_u64(seed);
    let vertices =
        mesh.vertices.iter().map(|&v| v + in_unit_ball(&mut random) * (eta * diagonal)).collect();
    TriMesh { vertices, faces: mesh.faces.clone() }
}

/// A point uniform in the unit ball: the first of points uniform in the cube around it that hits.
fn in_unit_ball(random: &mut Pcg64) -> Vec3 {
    loop {
        let point = Vec3::from([(); 3].map(|()| random.random_range(-1.0..1.0)));
        if point.length_squared() <= 1.0 {
            return point;
        }
    }
}

/// [`NoiseKind::Normal`].
fn along_normals(mesh: &TriMesh, eta: f64, seed: u64) -> TriMesh {
    let Some(Normalisation { diagonal, .. }) = Normalisation::of(mesh) else {
        return mesh.clone();
    };
    let mut random = Pcg64::seed_from_u64(seed);
    let displaced = mesh.vertices.iter().zip(vertex_normals(mesh));
    let vertices = displaced
        .map(|(&v, normal)| v + normal * (random.random_range(-1.0..1.0) * eta * diagonal));
    TriMesh { vertices: vertices.collect(), faces: mesh.faces.clone() }
}

/// The normals of the faces at each vertex, weighted by their angles there, so that a division of the faces does not
/// change them; zero where they cancel.
fn vertex_normals(mesh: &TriMesh) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; mesh.vertices.len()];
    for (face, corners) in mesh.faces.iter().enumerate() {
        let places = mesh.triangle(face);
        let [a, b, c] = places;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for (i, &corner) in corners.iter().enumerate() {
            let [to_next, to_last] = [1, 2].map(|step| places[(i + step) % 3] - places[i]);
            let angle = to_next.cross(to_last).length().atan2(to_next.dot(to_last));
            sums[corner as usize] += normal * angle;
        }
    }
    sums.into_iter().map(Vec3::normalize_or_zero).collect()
}

// Surfaces with samples missing: vertices merged into neighbours, while the surface stays embedded.
//
// The link condition is that of T. K. Dey, H. Edelsbrunner, S. Guha, D. V. Nekhayev, *Topology preserving edge
// contraction*, Publications de l'Institut Mathématique 66 (1999).

/// A face may turn by 60 degrees.
const LEAST_COSINE: f64 = 0.5;
/// Sine of the smallest angle that a new face may have: 5 degrees.
const LEAST_SINE: f64 = 0.087;

/// The mesh without a share of its vertices; see [`crate::noisy`].
pub(crate) fn without_share(mesh: &TriMesh, share: f64, seed: u64) -> Result<TriMesh, NoiseError> {
    let vertices = mesh.vertices.len();
    let asked = (share * vertices as f64).round() as usize;
    if asked == 0 {
        return Ok(mesh.clone());
    }
    validate(mesh).map_err(|error| NoiseError::NotManifold(error.to_string()))?;
    let mut surface = Surface::new(mesh);
    let mut waiting = VecDeque::from(shuffled(vertices, seed));
    // Ends when every vertex that waits was refused since the last one that went.
    let (mut dropped, mut refused) = (0, 0);
    while dropped < asked && refused < waiting.len() {
        let Some(vertex) = waiting.pop_front() else { break };
        if surface.drop_vertex(vertex) {
            (dropped, refused) = (dropped + 1, 0);
        } else {
            waiting.push_back(vertex);
            refused += 1;
        }
    }
    if dropped < asked {
        return Err(NoiseError::TooFew { asked, dropped, vertices });
    }
    Ok(surface.into_mesh())
}

fn shuffled(count: usize, seed: u64) -> Vec<u32> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut order: Vec<u32> = (0..count as u32).collect();
    for i in (1..count).rev() {
        order.swap(i, random.random_range(0..=i));
    }
    order
}

/// A closed surface in the making; faces that are gone are `None`.
struct Surface {
    vertices: Vec<Vec3>,
    faces: Vec<Option<[u32; 3]>>,
    /// The faces of each vertex, and of vertices that are gone none.
    stars: Vec<Vec<u32>>,
    grid: Grid,
}

impl Surface {
    fn new(mesh: &TriMesh) -> Self {
        let mut surface = Self {
            vertices: mesh.vertices.clone(),
            faces: Vec::new(),
            stars: vec![Vec::new(); mesh.vertices.len()],
            grid: Grid { spacing: mean_edge(mesh), faces: HashMap::new() },
        };
        mesh.faces.iter().for_each(|&face| surface.add(face));
        surface
    }

    fn places(&self, face: [u32; 3]) -> [Vec3; 3] {
        face.map(|v| self.vertices[v as usize])
    }

    fn add(&mut self, face: [u32; 3]) {
        let id = self.faces.len() as u32;
        self.faces.push(Some(face));
        face.iter().for_each(|&v| self.stars[v as usize].push(id));
        self.grid.insert(id, self.places(face));
    }

    fn remove(&mut self, id: u32) {
        let face = self.faces[id as usize].take().expect("a face that is there");
        face.iter().for_each(|&v| self.stars[v as usize].retain(|&other| other != id));
    }

    fn star(&self, v: u32) -> Vec<[u32; 3]> {
        let faces = self.stars[v as usize].iter().map(|&id| self.faces[id as usize]);
        faces.map(|face| face.expect("a star holds faces that are there")).collect()
    }

    fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut all: Vec<u32> =
            self.star(v).into_flattened().into_iter().filter(|&u| u != v).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Merges a vertex into the neighbour that sweeps the least volume, if there is one that may.
    fn drop_vertex(&mut self, v: u32) -> bool {
        let star = self.star(v);
        let mut choices: Vec<(f64, u32, Vec<[u32; 3]>)> = Vec::new();
        for into in self.neighbours(v) {
            let kept = star.iter().filter(|face| !face.contains(&into));
            let moved: Vec<[u32; 3]> =
                kept.map(|face| face.map(|u| if u == v { into } else { u })).collect();
            choices.push((self.swept(v, &moved), into, moved));
        }
        choices.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let fitting = choices.into_iter().find(|(_, into, moved)| {
            self.keeps_topology(v, *into)
                && self.keeps_shape(v, *into, moved)
                && !self.crosses(v, moved)
        });
        let Some((_, _, moved)) = fitting else { return false };
        for id in self.stars[v as usize].clone() {
            self.remove(id);
        }
        moved.into_iter().for_each(|face| self.add(face));
        true
    }

    /// Volume between a vertex and the faces that would replace its star.
    fn swept(&self, v: u32, moved: &[[u32; 3]]) -> f64 {
        let apex = self.vertices[v as usize];
        let corners = moved.iter().map(|&face| self.places(face).map(|p| p - apex));
        corners.map(|[a, b, c]| a.dot(b.cross(c)).abs()).sum()
    }

    /// The link condition: the two vertices have no common neighbour but the two across their edge.
    fn keeps_topology(&self, v: u32, into: u32) -> bool {
        let others = self.neighbours(into);
        let common = self.neighbours(v).iter().filter(|u| others.binary_search(u).is_ok()).count();
        let tetrahedron = [v, into].iter().all(|&u| self.stars[u as usize].len() == 3);
        common == 2 && !tetrahedron
    }

    /// Whether no face turns too far or becomes too thin.
    fn keeps_shape(&self, v: u32, into: u32, moved: &[[u32; 3]]) -> bool {
        moved.iter().all(|&face| {
            let before = face.map(|u| if u == into { v } else { u });
            let (new, old) = (self.places(face), self.places(before));
            let turned = normal(new).dot(normal(old)) < LEAST_COSINE;
            !turned && smallest_sine(new) >= LEAST_SINE && projection_axis(new).is_some()
        })
    }

    fn meets(&self, face: [u32; 3], other: [u32; 3]) -> bool {
        triangles_meet(face, self.places(face), other, self.places(other))
    }

    /// Whether a face that would replace the star of `v` meets another one outside common corners and edges.
    fn crosses(&self, v: u32, moved: &[[u32; 3]]) -> bool {
        moved.iter().enumerate().any(|(i, &face)| {
            // The grid still lists faces that are gone, and the star goes with `v`.
            let near = self.grid.near(self.places(face)).into_iter();
            let near = near.filter_map(|id| self.faces[id as usize]);
            let near = near.filter(|other| !other.contains(&v));
            moved[..i].iter().copied().chain(near).any(|other| self.meets(face, other))
        })
    }

    /// What is left, in the old order.
    fn into_mesh(self) -> TriMesh {
        let Self { vertices, faces, stars, .. } = self;
        let mut new_id = vec![u32::MAX; vertices.len()];
        let mut mesh = TriMesh::default();
        for (v, star) in stars.iter().enumerate().filter(|(_, star)| !star.is_empty()) {
            debug_assert!(star.len() >= 3, "a closed fan");
            new_id[v] = mesh.vertices.len() as u32;
            mesh.vertices.push(vertices[v]);
        }
        mesh.faces = faces.into_iter().flatten().map(|f| f.map(|v| new_id[v as usize])).collect();
        mesh
    }
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// Sine of the smallest angle: twice the area over the two longer sides.
fn smallest_sine([a, b, c]: [Vec3; 3]) -> f64 {
    let mut sides = [a.distance(b), b.distance(c), c.distance(a)];
    sides.sort_by(f64::total_cmp);
    (b - a).cross(c - a).length() / (sides[1] * sides[2])
}

pub(crate) fn mean_edge(mesh: &TriMesh) -> f64 {
    let perimeters = (0..mesh.faces.len()).map(|face| {
        let [a, b, c]: [Vec3; 3] = mesh.triangle(face);
        a.distance(b) + b.distance(c) + c.distance(a)
    });
    perimeters.sum::<f64>() / (3 * mesh.faces.len()) as f64
}

/// Faces by the cubes that their boxes overlap. Faces that are gone stay in it.
struct Grid {
    spacing: f64,
    faces: HashMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    fn insert(&mut self, id: u32, triangle: [Vec3; 3]) {
        for cube in self.cubes(triangle) {
            self.faces.entry(cube).or_default().push(id);
        }
    }

    /// Faces that share a cube with the triangle, ascending.
    fn near(&self, triangle: [Vec3; 3]) -> Vec<u32> {
        let cubes = self.cubes(triangle);
        let mut ids: Vec<u32> =
            cubes.iter().filter_map(|cube| self.faces.get(cube)).flatten().copied().collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    fn cubes(&self, [a, b, c]: [Vec3; 3]) -> Vec<[i64; 3]> {
        let [low, high] = [a.min(b).min(c), a.max(b).max(c)]
            .map(|p| (p / self.spacing).floor().to_array().map(|x| x as i64));
        let mut cubes = Vec::new();
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                cubes.extend((low[2]..=high[2]).map(|k| [i, j, k]));
            }
        }
        cubes
    }
}
