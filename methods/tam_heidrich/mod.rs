//! Tam-Heidrich: pruning the medial axis by parts.
//!
//! R. Tam, W. Heidrich 2003, *Shape simplification based on the medial axis transform*, IEEE
//! Visualization, <https://doi.org/10.1109/VISUAL.2003.1250410>.
//!
//! 1. Sections 2.1 and 3: the medial axis of the union of the inner polar balls, triangulated (file
//!    `axis.rs`). Duplicates are recognised by their samples and merged: polar balls of cospherical samples
//!    before it is made, facets between corners at one sample after (file `parts.rs`), and vertices that
//!    are left nearly at one position.
//! 2. Section 4.2: each inner pole is the circumcentre of a Delaunay tetrahedron. The volume of a part
//!    is that of the tetrahedra whose poles lie on it, divided by the volume of the solid. A pole on
//!    several parts counts for each.
//! 3. Section 4.1: parts grow over edges of two triangles. Level 1 starts from free edges, each
//!    further level next to the one before (file `parts.rs`).
//! 4. Section 6: rounds by triangle count without any test of topology, at most `t_t_rounds`. *They end
//!    after the first that removes less than a quarter (`drop`) of what the one before it did*: the
//!    paper's "dramatic drop", for which it has no number (file `schedule.rs`).
//! 5. Section 4.3: rounds by volume with a test of topology, parts in ascending order. Only parts of
//!    level 1 go. The parts left are listed with ids, the largest first, in
//!    [`medial::simplifier::Extras`], as [`PartInfo`]. Parts named by hand, as in figure 12, are left out.
//!
//! # The level
//! `t_v` in per cent, for all rounds by volume. A number of spheres ends the published schedule as close
//! to it as whole parts allow, above or below: before the part whose removal would miss the number by
//! more. If the schedule ends too early, rounds with twice the threshold follow, until no part can be
//! removed. So results of fewer spheres are always contained in those of more, and a part is the smallest
//! step. The diagnostics name the count on the other side of the number.
//!
//! # Results that do not reproduce
//! - On an exact axis of a box, and on one that is sampled on a grid, there are twelve parts of level 1 and
//!   one of level 2, as in figure 5. With samples of blue noise there are not: neighbouring polar balls often
//!   share no sample, so that their union has dimples. Where one of the small parts ended at a seam, that
//!   has an edge of two triangles, and sheets grow together over it, by the rule of section 4.1.
//! - Rounds without a test of topology are not harmless: they can cut loops and split components.
//! - Pruning ends where all that is left is one sheet for each body, or sheets that hold loops, often
//!   far above the requested number of spheres. The paper reports the same of the bunny's feet.
//! - *The seed.* Moved balls make no loops: the axis of a solid has the same Betti numbers for every seed.
//!   They do decide which small parts there are, hence which sheets grow together when these go, and which
//!   single sheet is left in the end. Moved by `1e-4 r` results differ widely by the seed, moved by `1e-7 r`
//!   little; a tenth of that tears the axis of balls in special position. Other samples of the same surface
//!   still end elsewhere: that is the rule of section 4.1.
//!
//! # Deviations from the paper
//! - *The test of topology.* The paper keeps a part that lies on a cycle of its graph of parts and
//!   contact curves, or whose removal disconnects its neighbours. That graph sees neither a hole in
//!   a part nor a part that is bound to one connected contact curve at two ends, and a removal as it permits
//!   can lose a loop. Here the part's Euler number decides, which is exact and needs no graph (proof in
//!   `parts.rs`).
//! - Edges without triangles stay: on tubes they carry the loops. A part that is a whole component
//!   stays, also in the rounds without a test.
//! - Inner poles that are equally far from their sample, up to rounding, are all taken. On a grid which of
//!   them is farthest is decided by rounding, and sheets would end in other places at each corner of a box.
//! - Radii times 1.002 and centres moved by up to `1e-7 r` before the axis is made (`methods/levels.rs`),
//!   because rounding tears the axis of polar balls as they are, see [`medial::complex::union_axis`].
//!   The results are 0.2 % larger. The paper merges equal corners before it makes the Voronoi diagram of
//!   them; here those that stem from one sample are a little apart, and what the merging would not have
//!   made is removed afterwards, as far as that keeps the topology: the facets between two of them
//!   (`parts.rs`), and the vertices nearer than 1e-3 radii. Merged before, they contradict the dual complex
//!   of the balls, and facets stay open.
//! - The axis of the union is exact, not the subset of the Voronoi diagram of the corners that
//!   intersects the power shape.
//! - The inside test of the surface separates inner and outer poles.
//! - A given medial mesh is pruned in place of step 1. There are no poles on it: each interior tetrahedron
//!   counts for the face nearest to its circumcentre.
//! - A part that equals a threshold is removed.
//! - The power crust of the remaining poles (section 5) is not made.

mod axis;
mod fins;
mod parts;
mod schedule;
#[cfg(test)]
mod tests;

use axis::Axis;
use medial::Vec3;
use medial::complex::MedialMesh;
use medial::shape::Shape;
use medial::simplifier::{
    Capability, Diagnostics, Extras, Level, Method, MethodInfo, NativeLevel, ParamFields,
    RunContext, Simplification, Simplified,
};
use parts::{Parts, Remaining};
use schedule::Pruning;
use serde::{Deserialize, Serialize};

use crate::levels::{level_within, some_spheres, within};
use crate::{Prepared, Result};

/// Name of the extra that lists the parts, a `Vec` of [`PartInfo`].
pub const PARTS: &str = "parts";

/// A part of the axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartInfo {
    /// Consecutive from 0, the largest part first.
    pub id: u32,
    /// 1 at a free edge, 2 next to a part of level 1, and so on; 0 where no free edge can be reached.
    pub level: u32,
    /// Number of faces.
    pub triangles: usize,
    /// Volume of the part's feature, as a fraction of the solid's.
    pub volume: f64,
    /// Centroid, in normalised units.
    pub centre: [f64; 3],
    /// Whether removing it leaves components and loops of the whole as they are.
    pub removable: bool,
}

/// Pruning by parts as a method.
///
/// Supports all levels. The axis is computed once for all; a level costs a few passes over it.
pub fn method() -> Method<TamHeidrichParams> {
    let info = MethodInfo::new("tam-heidrich", "Tam-Heidrich part pruning")
        .seeded()
        .citation(
            "Roger Tam, Wolfgang Heidrich 2003. Shape simplification based on the medial axis \
             transform. IEEE Visualization. https://doi.org/10.1109/VISUAL.2003.1250410",
        )
        .bibtex(crate::references(&["TamHeidrich2003"]))
        .summary(
            "Cuts the axis of the polar balls into its sheets and removes small ones from the \
             outside in, loops and components kept.",
        )
        .native(NativeLevel::larger_is_coarser("t_v", "per cent of the solid's volume"))
        .published("up to three rounds with t_t = 5 triangles, then two with t_v = 1 %")
        .params(TamHeidrichParams::describe())
        .extra(Capability::new(PARTS, "the parts that the axis was cut into, the largest first"));
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: TamHeidrichParams, run: &RunContext) -> Prepared<'s> {
    let params = params.validate()?;
    let mut diagnostics = Diagnostics::default();
    let axis = Axis::of_shape(shape, run, &mut diagnostics)?;
    Ok(Box::new(PreparedTamHeidrich { axis, params, diagnostics, run: run.clone() }))
}

/// The axis of one shape.
struct PreparedTamHeidrich {
    axis: Axis,
    params: TamHeidrichParams,
    diagnostics: Diagnostics,
    run: RunContext,
}

impl Simplification for PreparedTamHeidrich {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let (t_v, enough) = self.schedule(level)?;
        let diagnostics = self.diagnostics.clone();
        let mut pruning = Pruning::new(&self.axis, &self.params, diagnostics, &self.run, enough);
        pruning.published(&t_v)?;
        if let Level::Spheres(count) = level {
            pruning.go_on(t_v.last().copied().unwrap_or(0.0))?;
            report_reached(&mut pruning, count);
        }
        let native_level = match level {
            Level::Native(t) => Some(t),
            _ => pruning.t_v,
        };
        let Pruning { remaining, parts, diagnostics, .. } = pruning;
        let extras = Extras::with(describe(&parts, &remaining));
        Ok(Simplified { mesh: remaining.mesh(), asked: level, native_level, diagnostics, extras })
    }
}

impl PreparedTamHeidrich {
    /// The thresholds of the rounds by volume, and the number of spheres that is enough.
    fn schedule(&self, level: Level) -> Result<(Vec<f64>, usize)> {
        let published = &self.params.t_v.0;
        match some_spheres(level)? {
            Level::Published => Ok((published.clone(), 0)),
            Level::Native(t) => {
                let t = level_within("t_v", t, 0.0..=100.0)?;
                Ok((vec![t; published.len().max(1)], 0))
            }
            Level::Spheres(count) => Ok((published.clone(), count)),
        }
    }
}

fn report_reached(pruning: &mut Pruning<'_>, count: usize) {
    let reached = pruning.remaining.spheres;
    if reached == count {
        return;
    }
    let at = match pruning.t_v {
        Some(t) => format!(", at t_v = {t} %"),
        None => String::new(),
    };
    let why = match (pruning.other_side, reached > count) {
        (Some(other), true) => {
            format!("the nearest level, from above; the next part to go would leave {other}")
        }
        (Some(other), false) => {
            format!("the nearest level, from below; before the last part went there were {other}")
        }
        (None, true) => "no further part can go without losing a loop or a component".to_owned(),
        (None, false) => "the whole axis has no more".to_owned(),
    };
    pruning.diagnostics.warn(format!("{reached} spheres instead of {count}{at}: {why}"));
}

/// The parts by decreasing number of triangles, then by smallest triangle: their ids.
fn by_size(parts: &Parts) -> Vec<usize> {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by_key(|&p| (std::cmp::Reverse(parts.faces(p).len()), p));
    order
}

fn describe(parts: &Parts, remaining: &Remaining<'_>) -> Vec<PartInfo> {
    let levels = parts::levels(parts, remaining);
    let described = (0..).zip(by_size(parts)).map(|(id, part)| PartInfo {
        id,
        level: levels[part],
        triangles: parts.faces(part).len(),
        volume: parts.volume[part],
        centre: centroid(&remaining.axis.mesh, parts.faces(part)).to_array(),
        removable: parts.free[part] && parts.is_removable(part),
    });
    described.collect()
}

/// The centroid of some faces by area, or the mean of their corners where they have none.
fn centroid(mesh: &MedialMesh, faces: &[u32]) -> Vec3 {
    let (mut weighted, mut area, mut plain) = (Vec3::ZERO, 0.0, Vec3::ZERO);
    for &face in faces {
        let [a, b, c] = mesh.faces[face as usize].map(|v| mesh.spheres[v as usize].centre);
        let (mean, weight) = ((a + b + c) / 3.0, (b - a).cross(c - a).length());
        weighted += weight * mean;
        area += weight;
        plain += mean;
    }
    let centroid = weighted / area;
    if centroid.is_finite() { centroid } else { plain / faces.len().max(1) as f64 }
}

/// For each face of a medial mesh the id of its part, as in [`PartInfo`].
pub fn parts_of_faces(mesh: &MedialMesh) -> Vec<u32> {
    let axis = Axis::of_mesh(mesh.clone());
    let parts = Parts::of(&Remaining::all(&axis));
    let mut ids = vec![0; mesh.faces.len()];
    for (id, part) in (0..).zip(by_size(&parts)) {
        parts.faces(part).iter().for_each(|&face| ids[face as usize] = id);
    }
    ids
}

// ----------------------------------------------------------------------------
// The parameters of part pruning.

medial::parameters! {
    /// Parameters of part pruning; the default is the paper's usual schedule.
    #[derive(Clone, Debug, PartialEq)]
    pub struct TamHeidrichParams {
        /// Largest number of rounds by triangle count; 0 for none.
        t_t_rounds: usize = 3, "rounds";
        /// These rounds end after one that removed less than this share of the previous one; 0 for the
        /// full number.
        drop: f64 = 0.25, "share";
        /// The later rounds remove parts of at most this volume, as far as the topology allows.
        t_v: List = List(vec![1.0, 1.0]), "per cent of the solid's volume, one for each round";
    }
}

/// Numbers, written as one number, as `1,5`, or as a JSON array.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Vec<f64>")]
pub struct List(pub Vec<f64>);

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number, numbers separated by commas, or an array")]
enum Written {
    One(f64),
    Many(Vec<f64>),
    Text(String),
}

impl TryFrom<Written> for List {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        Ok(Self(match written {
            Written::One(number) => vec![number],
            Written::Many(numbers) => numbers,
            Written::Text(text) if text.trim().is_empty() => vec![],
            Written::Text(text) => text
                .split(',')
                .map(|word| word.trim().parse().map_err(|error| format!("`{word}`: {error}")))
                .collect::<Result<_, String>>()?,
        }))
    }
}

impl From<List> for Vec<f64> {
    fn from(list: List) -> Self {
        list.0
    }
}

impl TamHeidrichParams {
    fn validate(self) -> Result<Self> {
        within("drop", self.drop, 0.0..=1.0)?;
        self.t_v.0.iter().try_for_each(|&t| within("t_v", t, 0.0..=100.0))?;
        Ok(self)
    }
}

// ----------------------------------------------------------------------------
// Parts of a medial mesh.

/// A subcomplex of a mesh, in the mesh's order. It contains the sides of its faces and the ends of its
/// edges.
fn kept_part(
    whole: &MedialMesh,
    sphere_kept: &[bool],
    edge_kept: &[bool],
    face_kept: &[bool],
) -> MedialMesh {
    let mut mesh = whole.induced(sphere_kept);
    let mut number = vec![u32::MAX; whole.spheres.len()];
    let kept = (0..number.len()).filter(|&v| sphere_kept[v]);
    kept.zip(0..).for_each(|(old, new)| number[old] = new);
    let edges = whole.edges.iter().zip(edge_kept).filter(|e| *e.1);
    mesh.edges = edges.map(|(edge, _)| edge.map(|v| number[v as usize])).collect();
    let faces = whole.faces.iter().zip(face_kept).filter(|f| *f.1);
    mesh.faces = faces.map(|(face, _)| face.map(|v| number[v as usize])).collect();
    mesh
}
