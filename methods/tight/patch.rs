//! Steps of a few spheres: those around the places where the mesh was just edited.
//!
//! The spheres within [`RINGS`] edges of the places move, with the simplices that have one of them as a
//! corner. All other simplices stay, so for each sample their distance is one number. A step costs what the
//! samples around the places cost.

use medial::complex::{MedialMesh, MedialUnion, Sphere};
use medial::simplifier::{RunContext, SimplifyError};

use super::descent::{Descent, Objective, Rest};
use super::goal::{Goal, Points};
use super::guard::Still;
use super::rows::union_of;
use super::sheets::corners;

/// Edges from a place to the spheres that move with it.
const RINGS: usize = 2;

/// Samples that the rest of the mesh serves are looked at up to this distance from the moving part.
const REACH: f64 = 0.02;

/// The solid and the samples that a part of a mesh is moved against.
pub(super) struct Patch<'a> {
    pub goal: &'a Goal,
    pub points: &'a Points,
}

impl Patch<'_> {
    /// Moves the spheres around `places`, at one power after the other, with so many steps each.
    ///
    /// # Errors
    /// When the run is cancelled.
    pub fn settle(
        &self,
        mesh: &mut MedialMesh,
        places: &[u32],
        stages: &[(f64, usize)],
        run: &RunContext,
    ) -> Result<(), SimplifyError> {
        let moving = around(mesh, places);
        let part = Part::of(mesh, &moving);
        let rest = match rest_of(mesh, &moving) {
            Some(rest) => Some(union_of(&rest)?),
            None => None,
        };
        let (points, limits) = self.nearby(&union_of(&part.mesh)?, rest.as_ref());
        let share = part.mesh.spheres.len() as f64 / mesh.spheres.len() as f64;
        let still = part.still(mesh, &moving);
        let Part { mesh: own, fixed, .. } = part;
        let around = Rest { fixed, limits, still };
        let mut descent = Descent::of_part(self.goal, points, own, around, share)?;
        for &(power, steps) in stages {
            descent.run(Objective::power(power, descent.largest()), steps, run)?;
        }
        for (&v, &sphere) in part.spheres.iter().zip(&descent.mesh.spheres) {
            mesh.spheres[v as usize] = sphere;
        }
        Ok(())
    }

    /// The samples that the moving part serves or may come to serve, and their distances to the rest.
    fn nearby(&self, part: &MedialUnion, rest: Option<&MedialUnion>) -> (Points, Vec<f64>) {
        let (lo, hi) = part.bounding_box();
        let places = || {
            let samples = self.points.samples.iter().map(|sample| sample.point);
            samples.chain(self.points.interior.iter().map(|x| x.point))
        };
        let is_in_box =
            |p: medial::Vec3| (p - lo).min_element() > -REACH && (hi - p).min_element() > -REACH;
        let kept: Vec<usize> =
            places().enumerate().filter(|&(_, p)| is_in_box(p)).map(|(i, _)| i).collect();
        let all: Vec<medial::Vec3> = places().filter(|&p| is_in_box(p)).collect();
        let moving = part.signed_batch(&all);
        let staying =
            rest.map_or_else(|| vec![f64::INFINITY; all.len()], |rest| rest.signed_batch(&all));
        let mut points = Points::default();
        let mut limits = vec![];
        for ((i, moving), staying) in kept.into_iter().zip(moving).zip(staying) {
            if moving > staying + REACH {
                continue;
            }
            let samples = self.points.samples.len();
            match self.points.samples.get(i) {
                Some(&sample) => points.samples.push(sample),
                None => points.interior.push(self.points.interior[i - samples]),
            }
            limits.push(staying);
        }
        (points, limits)
    }
}

/// Which spheres are at most [`RINGS`] edges away from a place.
fn around(mesh: &MedialMesh, places: &[u32]) -> Vec<bool> {
    let mut reached = vec![false; mesh.spheres.len()];
    places.iter().for_each(|&v| reached[v as usize] = true);
    for _ in 0..RINGS {
        let before = reached.clone();
        for &[a, b] in &mesh.edges {
            reached[a as usize] |= before[b as usize];
            reached[b as usize] |= before[a as usize];
        }
    }
    reached
}

/// The simplices with a moving corner, as a mesh of their own.
struct Part {
    mesh: MedialMesh,
    /// The places of its spheres in the whole mesh.
    spheres: Vec<u32>,
    /// Which of its spheres stay.
    fixed: Vec<bool>,
}

impl Part {
    fn of(mesh: &MedialMesh, moving: &[bool]) -> Self {
        let is_moving = |v: &u32| moving[*v as usize];
        let edges: Vec<_> = mesh.edges.iter().filter(|e| e.iter().any(is_moving)).collect();
        let faces: Vec<_> = mesh.faces.iter().filter(|f| f.iter().any(is_moving)).collect();
        let mut used = moving.to_vec();
        edges.iter().for_each(|e| e.iter().for_each(|&v| used[v as usize] = true));
        faces.iter().for_each(|f| f.iter().for_each(|&v| used[v as usize] = true));
        // The side of a face opposite to its moving corner is part of the rest.
        let sides = mesh.edges.iter().filter(|&&[a, b]| {
            let is_side = |f: &&[u32; 3]| f.contains(&a) && f.contains(&b);
            !is_moving(&a)
                && !is_moving(&b)
                && used[a as usize]
                && used[b as usize]
                && faces.iter().any(is_side)
        });
        let mut kept: Vec<[u32; 2]> = edges.into_iter().chain(sides).copied().collect();
        kept.sort_unstable();
        let spheres: Vec<u32> = (0..used.len() as u32).filter(|&v| used[v as usize]).collect();
        let mut place = vec![0; used.len()];
        for (new, &v) in (0..).zip(&spheres) {
            place[v as usize] = new;
        }
        let edges = kept.into_iter().map(|e| e.map(|v| place[v as usize])).collect();
        let faces = faces.into_iter().map(|f| f.map(|v| place[v as usize])).collect();
        let fixed = spheres.iter().map(|v| !is_moving(v)).collect();
        let own: Vec<Sphere> = spheres.iter().map(|&v| mesh.spheres[v as usize]).collect();
        let mesh = MedialMesh { spheres: own, edges, faces, contacts: None };
        Self { mesh, spheres, fixed }
    }

    /// The faces of the whole mesh without a moving corner, with its spheres numbered as in the part, and
    /// those that are not in it after them.
    fn still(&self, whole: &MedialMesh, moving: &[bool]) -> Still {
        let own = self.spheres.len() as u32;
        let mut place: Vec<u32> = (0..whole.spheres.len() as u32).map(|v| own + v).collect();
        for (new, &v) in (0..).zip(&self.spheres) {
            place[v as usize] = new;
        }
        let still = whole.faces.iter().filter(|face| !face.iter().any(|&v| moving[v as usize]));
        let (faces, corners) =
            still.map(|face| (face.map(|v| place[v as usize]), corners(whole, *face))).unzip();
        Still { faces, corners }
    }
}

/// The simplices without a moving corner, if there are any.
fn rest_of(mesh: &MedialMesh, moving: &[bool]) -> Option<MedialMesh> {
    let stays = |v: &u32| !moving[*v as usize];
    let spheres: Vec<u32> = (0..moving.len() as u32).filter(stays).collect();
    let mut place = vec![0; moving.len()];
    for (new, &v) in (0..).zip(&spheres) {
        place[v as usize] = new;
    }
    let edges = mesh.edges.iter().filter(|e| e.iter().all(stays));
    let faces = mesh.faces.iter().filter(|f| f.iter().all(stays));
    let rest = MedialMesh {
        spheres: spheres.iter().map(|&v| mesh.spheres[v as usize]).collect(),
        edges: edges.map(|e| e.map(|v| place[v as usize])).collect(),
        faces: faces.map(|f| f.map(|v| place[v as usize])).collect(),
        contacts: None,
    };
    (!rest.spheres.is_empty()).then_some(rest)
}
