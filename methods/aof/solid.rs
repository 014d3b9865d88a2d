//! One solid on any lattice: the lattice to work at, what it loses, its axis at an angle or with a
//! number of voxels.

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, Sphere as Ball, cubical_betti};
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Level, RunContext, SimplifyError};
use medial::surface::TriangleBvh;
use rayon::prelude::*;

use super::flux::{Sphere, Surface};
use super::lattice::{
    Bricks, Descent, Grid, LatticeVoxel, LatticeVoxels, Place, Voxel, Wanted, coarse_to_fine,
};
use super::output::{medial_mesh, sorted};
use super::thinning::{FACES, Order, thin};
use super::{AofParams, AofSettings, MAX_RESOLUTION, Start, Variant};

/// A solid, ready for any lattice.
pub struct Solid<'s> {
    shape: &'s Shape,
    surface: Surface,
    params: AofParams,
    run: RunContext,
    volume: f64,
    /// Area of the surface.
    area: f64,
}

/// The voxels of an axis.
#[derive(Clone)]
pub struct Axis {
    /// The lattice.
    pub grid: Grid,
    /// Voxels by `z`, then `y`, then `x`.
    pub voxels: Vec<Voxel>,
    /// The sphere of the finest level.
    sphere: Sphere,
}

impl<'s> Solid<'s> {
    /// The solid of a shape.
    ///
    /// # Errors
    /// When its surface has no face.
    pub fn new(
        shape: &'s Shape,
        params: AofParams,
        run: RunContext,
    ) -> Result<Self, SimplifyError> {
        let surface = Surface::of(shape)?;
        let mesh = shape.mesh();
        let signed = |f: usize| {
            let [a, b, c] = mesh.triangle(f);
            a.dot(b.cross(c)) / 6.0
        };
        let volume = (0..mesh.faces.len()).map(signed).sum();
        let doubled = |f: usize| {
            let [a, b, c] = mesh.triangle(f);
            (b - a).cross(c - a).length()
        };
        let area = (0..mesh.faces.len()).map(doubled).sum::<f64>() / 2.0;
        Ok(Self { shape, surface, params, run, volume, area })
    }

    /// The parameters.
    pub fn params(&self) -> &AofParams {
        &self.params
    }

    /// The lattice of a resolution.
    pub fn grid(&self, resolution: u32) -> Grid {
        Grid::new(self.shape.mesh(), resolution, self.params.d.pow(self.params.levels - 1))
    }

    /// Flux and distances at a resolution.
    ///
    /// # Errors
    /// When the lattice is too fine, or its voxels would not fit into memory; when the run was
    /// cancelled.
    pub fn descend(&self, resolution: u32, wanted: Wanted) -> Result<Descent, SimplifyError> {
        let grid = self.grid(resolution);
        self.check_resolution(resolution)?;
        coarse_to_fine(&self.surface, &grid, &self.params, wanted, &self.run)
    }

    /// The context of the run.
    pub(super) fn run(&self) -> &RunContext {
        &self.run
    }

    pub(super) fn wanted(&self) -> Wanted {
        if self.params.variant == Variant::Plain { Wanted::Kept } else { Wanted::All }
    }

    /// The axis of a lattice for an object angle in degrees.
    ///
    /// # Errors
    /// When the run was cancelled.
    pub fn axis(&self, resolution: u32, base: &Descent, angle: f64) -> Result<Axis, SimplifyError> {
        let threshold = self.params.threshold(angle);
        let grid = self.grid(resolution);
        let kept = match self.params.variant {
            Variant::Plain => {
                let mut kept = sorted(&base.voxels);
                kept.retain(|voxel| voxel.flux <= threshold);
                kept
            }
            Variant::Homotopy | Variant::Thinning => {
                let mut voxels = base.voxels.clone();
                let order = match self.params.variant {
                    Variant::Homotopy => Order::OutermostFirst { threshold },
                    _ => Order::ByFlux { threshold },
                };
                thin(&mut voxels, order, &self.run)?;
                sorted(&voxels)
            }
        };
        Ok(self.axis_of(grid, kept))
    }

    /// The medial mesh of an axis, with centres on the axis or in the voxels.
    ///
    /// # Errors
    /// When the run was cancelled.
    pub fn medial_mesh(&self, axis: &Axis) -> Result<MedialMesh, SimplifyError> {
        let centres = axis.points();
        let balls = if self.params.refine {
            let refined = self.surface.refine(&axis.sphere, &centres, &self.run)?;
            refined.into_iter().map(|refined| refined.ball).collect()
        } else {
            let distance = |centre| self.surface.closest(centre, None).distance;
            centres.par_iter().map(|&centre| Ball::new(centre, distance(centre))).collect()
        };
        medial_mesh(&axis.voxels, balls, &self.run)
    }

    fn axis_of(&self, grid: Grid, voxels: Vec<Voxel>) -> Axis {
        let counts = self.params.sample_counts().expect("validated");
        let count = counts[counts.len() - 1];
        Axis { sphere: Sphere::new(self.params.spiral, count, grid.side), grid, voxels }
    }
}

/// Betti numbers of the union of closed voxels.
pub fn betti_of(voxels: &Bricks) -> [u64; 3] {
    cubical_betti(&voxels.iter().map(|voxel| voxel.place.map(u32::from)).collect::<Vec<_>>())
}

impl Axis {
    /// Number of voxels.
    pub(super) fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Centres of the voxels, normalised.
    pub fn points(&self) -> Vec<Vec3> {
        self.voxels.iter().map(|voxel| self.grid.centre(voxel.place)).collect()
    }

    /// Betti numbers of the union of the closed voxels.
    pub fn betti(&self) -> [u64; 3] {
        cubical_betti(&self.places().map(|place| place.map(u32::from)).collect::<Vec<_>>())
    }

    fn places(&self) -> impl Iterator<Item = Place> + '_ {
        self.voxels.iter().map(|voxel| voxel.place)
    }

    /// The voxels as data, normalised.
    pub fn lattice_voxels(&self) -> LatticeVoxels {
        let voxel = |voxel: &Voxel| LatticeVoxel {
            place: voxel.place.map(u32::from),
            distance: f64::from(voxel.distance),
            flux: f64::from(voxel.flux),
        };
        LatticeVoxels {
            origin: self.grid.origin,
            side: self.grid.side,
            size: self.grid.size,
            voxels: self.voxels.iter().map(voxel).collect(),
        }
    }

    pub(super) fn diagnose(&self, angle: f64, diagnostics: &mut Diagnostics) {
        if self.voxels.is_empty() {
            diagnostics.warn(format!("no voxel passes an object angle of {angle} degrees"));
        }
        for (name, number) in ["voxel_b0", "voxel_b1", "voxel_b2"].into_iter().zip(self.betti()) {
            diagnostics.count(name, number as usize);
        }
    }
}

// The lattice to work at.
//
// The lattice of the parameters, or a finer one if that loses parts of the solid.
//
// Variants that keep the topology of their start set need a start set with the solid's topology and
// without missing limbs. Lattices finer by half are tried until one has both; else the best is taken:
// the least difference of Betti numbers, then the least loss (below), then the finest. A
// warning names what is lost.

/// How often the lattice is made finer, half as fine again each time.
const REFINEMENTS: u32 = 3;

/// The lattice to work at.
pub struct Base {
    /// Voxels along the longest side.
    pub resolution: u32,
    /// Its flux.
    pub descent: Descent,
    /// Betti numbers of its voxels, where the variant keeps them.
    pub topology: Option<[u64; 3]>,
    /// The part of the surface that it loses.
    pub loss: Option<Loss>,
    /// Counts and warnings about it.
    pub diagnostics: Diagnostics,
}

/// A start set that was tried.
struct Tried {
    resolution: u32,
    betti: [u64; 3],
    voxels: u64,
    loss: Option<Loss>,
}

impl Tried {
    fn difference(&self, expected: [u64; 3]) -> u64 {
        self.betti.iter().zip(expected).map(|(&b, e)| b.abs_diff(e)).sum()
    }

    fn lost(&self) -> f64 {
        self.loss.map_or(0.0, |loss| loss.distance)
    }
}

impl Solid<'_> {
    /// The lattice to work at.
    ///
    /// # Errors
    /// When no voxel fits into the solid; as [`Solid::descend`].
    pub fn base(&self) -> Result<Base, SimplifyError> {
        let mut diagnostics = Diagnostics::default();
        let asked = self.params().resolution;
        let mut descent = self.descend(asked, self.wanted())?;
        let first = self.tried(asked, &descent)?;
        let chosen = match self.params().variant {
            Variant::Plain => first,
            _ => self.faithful(first, &mut diagnostics)?,
        };
        if chosen.resolution != asked {
            descent = self.descend(chosen.resolution, self.wanted())?;
        }
        let Tried { resolution, betti, loss, .. } = chosen;
        let tally = &descent.tally;
        if tally.start == 0 {
            return Err(self.nothing_fits(resolution, tally.deepest));
        }
        diagnostics.count("resolution", resolution as usize);
        diagnostics.count("start_voxels", tally.start as usize);
        for (level, &dismissed) in tally.dismissed.iter().enumerate() {
            diagnostics.count(&format!("dismissed_at_level_{}", level + 1), dismissed as usize);
        }
        diagnostics.count("spheres_evaluated", tally.evaluated.iter().sum::<u64>() as usize);
        let topology = (self.params().variant != Variant::Plain).then_some(betti);
        Ok(Base { resolution, descent, topology, loss, diagnostics })
    }

    fn tried(&self, resolution: u32, start: &Descent) -> Result<Tried, SimplifyError> {
        let betti = match self.params().variant {
            Variant::Plain => [0; 3],
            _ => betti_of(&start.voxels),
        };
        let loss = self.loss(resolution, &start.voxels, self.allowed())?;
        Ok(Tried { resolution, betti, voxels: start.tally.start, loss })
    }

    /// The largest loss that is accepted, a fraction of the diagonal.
    fn allowed(&self) -> f64 {
        LOST * self.grid(self.params().resolution).side
    }

    /// The least resolution from the one asked on whose start set has the topology of the solid and
    /// loses nothing, else the best that was tried.
    fn faithful(
        &self,
        first: Tried,
        diagnostics: &mut Diagnostics,
    ) -> Result<Tried, SimplifyError> {
        let expected = self.shape.expected_betti();
        let difference = |tried: &Tried| expected.map_or(0, |e| tried.difference(e));
        let is_faithful = |t: &Tried| t.voxels > 0 && t.loss.is_none() && difference(t) == 0;
        let asked = first.resolution;
        let mut all = vec![first];
        for refinement in 1..=REFINEMENTS {
            if all.last().is_some_and(is_faithful) {
                break;
            }
            let resolution = (f64::from(asked) * 1.5_f64.powi(refinement as i32)).round() as u32;
            match self.descend(resolution, Wanted::Places) {
                Ok(start) => all.push(self.tried(resolution, &start)?),
                // It does not fit into memory.
                Err(SimplifyError::Parameter(_)) => break,
                Err(other) => return Err(other),
            }
        }
        let rank = |a: &Tried, b: &Tried| {
            let empty = (a.voxels == 0).cmp(&(b.voxels == 0));
            let topology = || difference(a).cmp(&difference(b));
            let loss = || a.lost().total_cmp(&b.lost());
            empty.then_with(topology).then_with(loss).then_with(|| b.resolution.cmp(&a.resolution))
        };
        let best = match all.last().is_some_and(is_faithful) {
            true => all.pop(),
            false => all.into_iter().min_by(rank),
        };
        let best = best.expect("the first was tried");
        self.say_what_was_chosen(&best, expected, diagnostics);
        Ok(best)
    }

    fn say_what_was_chosen(
        &self,
        best: &Tried,
        expected: Option<[u64; 3]>,
        diagnostics: &mut Diagnostics,
    ) {
        let (resolution, asked) = (best.resolution, self.params().resolution);
        if resolution != asked {
            diagnostics.warn(format!(
                "resolution {resolution} instead of {asked}: below, the voxels whose spheres fit \
                 inside do not have the topology of the solid, or a part of it has none"
            ));
        }
        if let Some(expected) = expected.filter(|&e| best.voxels > 0 && best.difference(e) > 0) {
            let side = self.grid(resolution).side * self.shape.normalisation().diagonal;
            diagnostics.warn(format!(
                "the voxels whose spheres fit inside have the Betti numbers {:?} instead of the \
                 solid's {expected:?} at resolution {resolution}, the best that was tried: parts \
                 thinner than {:.4} or gaps narrower than {side:.4} in units of the surface are not \
                 resolved; give a higher resolution",
                best.betti,
                2.0 * side
            ));
        }
    }

    /// Warns about the losses of a lattice other than that of the base.
    ///
    /// # Errors
    /// As [`Solid::descend`].
    pub(super) fn say_what_is_lost(
        &self,
        base: &Base,
        resolution: u32,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), SimplifyError> {
        let loss = if resolution == base.resolution {
            base.loss
        } else {
            let start: Bricks = self.descend(resolution, Wanted::Places)?.voxels;
            self.loss(resolution, &start, LOST * self.grid(resolution).side)?
        };
        if let Some(loss) = loss {
            diagnostics.warn(self.in_words(resolution, &loss));
        }
        Ok(())
    }
}

// Losses.
//
// Parts of a solid that a lattice loses: found, and named.
//
// A part thinner than two voxels has no voxel whose sphere fits inside. If it is a limb, its loss does
// not change the Betti numbers. So points of the surface, its vertices and the middles of its faces,
// are measured against the spheres of the voxels:
//
// 1. The spheres of voxels at the border of the start set; those inside reach no farther.
// 2. The point that is farthest from all of them is lost where it is farther than [`LOST`] voxels.
//    Along sharp edges spheres stay one to three voxels away without anything being lost.
// 3. What it would take: around that point the largest ball inside that touches the surface, found by
//    shrinking (Ma, Bae, Choi 2012), and the lattice whose voxels fit into it.

/// Distance from all spheres, in voxels, from which on a point of the surface is lost.
pub(super) const LOST: f64 = 3.0;
/// Points of the surface that are measured, at most.
const MAX_POINTS: usize = 60_000;
/// Points around the lost one at which balls are shrunk, at most.
const MAX_BALLS: usize = 400;
/// Steps of a shrinking ball, at most.
const STEPS: usize = 40;

/// A part of the surface that is far from every voxel's sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// The farthest point, normalised.
    pub place: Vec3,
    /// Its distance from the nearest sphere, a fraction of the diagonal.
    pub distance: f64,
    /// Voxels along the longest side at which the part around it has some.
    pub needed: u32,
}

/// A point of the surface with an outward unit normal.
type Point = (Vec3, Vec3);

impl Solid<'_> {
    /// The part of the surface that is farthest from the voxels of a lattice, if that is more than
    /// `allowed`, a fraction of the diagonal.
    ///
    /// # Errors
    /// When the surface has no face.
    pub(super) fn loss(
        &self,
        resolution: u32,
        voxels: &Bricks,
        allowed: f64,
    ) -> Result<Option<Loss>, SimplifyError> {
        let is_border = |place| voxels.neighbourhood(place) & FACES != FACES;
        let border = voxels.iter().filter(|voxel| is_border(voxel.place)).collect::<Vec<_>>();
        self.loss_of(resolution, &border, allowed)
    }

    /// As [`Solid::loss`], of the spheres of some voxels.
    pub(super) fn loss_of(
        &self,
        resolution: u32,
        voxels: &[Voxel],
        allowed: f64,
    ) -> Result<Option<Loss>, SimplifyError> {
        let grid = self.grid(resolution);
        let ball = |v: &Voxel| Ball::new(grid.centre(v.place), f64::from(v.distance));
        let balls: Vec<Ball> = voxels.iter().map(ball).collect();
        let Ok(union) = MedialUnion::of_spheres(&balls) else {
            // Without voxels everything is lost, which has a message of its own.
            return Ok(None);
        };
        let points = self.surface_points();
        let places: Vec<Vec3> = points.iter().map(|point| point.0).collect();
        let distances = union.signed_batch(&places);
        // Reversed, because `max_by` returns the last of equal elements.
        let farthest =
            (0..places.len()).rev().max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        let Some(farthest) = farthest.filter(|&f| distances[f] > allowed) else {
            return Ok(None);
        };
        let tree = self.shape.surface_tree()?;
        let (place, distance) = (places[farthest], distances[farthest]);
        let around = points.iter().filter(|p| p.0.distance(place) <= allowed.max(0.2 * distance));
        let around: Vec<&Point> = around.collect();
        // The thickest ball nearby decides: a lattice that fits it has voxels in the part.
        let some = around.iter().step_by(around.len().div_ceil(MAX_BALLS).max(1));
        let thickest = some.map(|&&point| shrunk(&tree, point)).fold(f64::MIN_POSITIVE, f64::max);
        let longest = grid.side * f64::from(resolution);
        let needed = (SURELY * longest / thickest).ceil().min(f64::from(u32::MAX)) as u32;
        Ok(Some(Loss { place, distance, needed: needed.max(resolution + 1) }))
    }

    /// The middles of faces, and vertices with the normal of one of their faces.
    fn surface_points(&self) -> Vec<Point> {
        let mesh = self.shape.mesh();
        let mut seen = vec![false; mesh.vertices.len()];
        let mut points = Vec::with_capacity(mesh.faces.len() + seen.len());
        for (index, face) in mesh.faces.iter().enumerate() {
            let [a, b, c] = mesh.triangle(index);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal == Vec3::ZERO {
                continue;
            }
            points.push(((a + b + c) / 3.0, normal));
            for (&v, place) in face.iter().zip([a, b, c]) {
                if !std::mem::replace(&mut seen[v as usize], true) {
                    points.push((place, normal));
                }
            }
        }
        let step = points.len().div_ceil(MAX_POINTS).max(1);
        points.into_iter().step_by(step).collect()
    }

    /// A loss in words, with the place in the units of the surface.
    pub(super) fn in_words(&self, resolution: u32, loss: &Loss) -> String {
        let normal = self.shape.normalisation();
        let place = normal.backward(loss.place);
        let advice = if loss.needed > MAX_RESOLUTION {
            "no lattice is fine enough".to_owned()
        } else {
            let (fine, limit) = (self.megabytes(loss.needed).0, self.params().max_memory);
            let memory = if fine > limit {
                format!(", and max_memory = {}", fine.ceil())
            } else {
                String::new()
            };
            format!("it takes about resolution = {}{memory}", loss.needed)
        };
        format!(
            "the surface at ({:.6}, {:.6}, {:.6}) is {:.1} % of the diagonal away from every voxel's \
             sphere: parts thinner than {:.4} in units of the surface are not resolved at resolution \
             {resolution}; {advice}",
            place.x,
            place.y,
            place.z,
            100.0 * loss.distance,
            2.0 * self.grid(resolution).side * normal.diagonal
        )
    }
}

/// Radius of the largest ball inside the solid that touches the surface at a point.
fn shrunk(tree: &TriangleBvh, (place, normal): Point) -> f64 {
    let mut radius = 1.0;
    for _ in 0..STEPS {
        let nearest = tree.closest(place - radius * normal);
        if nearest.distance >= radius * (1.0 - 1e-6) {
            break;
        }
        let chord = place - nearest.point;
        // The ball through both points that touches the surface at `place`.
        let smaller = chord.length_squared() / (2.0 * normal.dot(chord));
        // Fails only by rounding, when the ball has shrunk to its point.
        if !(smaller > 0.0 && smaller < radius) {
            break;
        }
        radius = smaller;
    }
    radius
}

// Refusals.
//
// Lattices that are refused, and which one to ask for instead.
//
// A suggested lattice was tried, or follows from a measured distance. The effort of trying is bounded:
// for a nearly flat solid the voxels grow with the square of the resolution.

/// Bytes for each voxel of the start set: values in bricks that are not full, twice while one is
/// thinned, lists of blocks, the heap.
pub(super) const BYTES_PER_VOXEL: f64 = 64.0;

/// Voxels that a lattice tried for advice may visit.
pub(super) const MAX_VISITS: f64 = 2e7;

/// A lattice of this resolution tells how deep a solid is, where the one asked has too many voxels.
const SOUNDING: u32 = 54;

/// A voxel whose sphere fits is there wherever the distance is so many sides: its centre is at most
/// half a diagonal away.
pub(super) const SURELY: f64 = 1.9;

impl Solid<'_> {
    /// Refuses lattices that have too many voxels along a side or do not fit into memory.
    pub(super) fn check_resolution(&self, resolution: u32) -> Result<(), SimplifyError> {
        if resolution > MAX_RESOLUTION {
            return Err(SimplifyError::Parameter(format!(
                "resolution = {resolution}: above {MAX_RESOLUTION} voxels along the longest side"
            )));
        }
        let (megabytes, voxels) = self.megabytes(resolution);
        let limit = self.params().max_memory;
        if megabytes <= limit {
            return Ok(());
        }
        let advice = match self.fitting(resolution) {
            Some(fits) => format!("resolution = {fits} fits, or raise max_memory"),
            None => format!("give max_memory = {}", megabytes.ceil()),
        };
        Err(SimplifyError::Parameter(format!(
            "resolution = {resolution}: about {megabytes:.3} MB for {voxels:.3e} voxels, above \
             max_memory = {limit}; {advice}"
        )))
    }

    /// The largest resolution below a given one that fits into memory, if it surely has voxels.
    pub(super) fn fitting(&self, resolution: u32) -> Option<u32> {
        let limit = self.params().max_memory;
        // Not quite a cube root: the lattice is a whole number of coarse voxels.
        let estimate = f64::from(resolution) * (limit / self.megabytes(resolution).0).cbrt();
        let mut fits = (estimate.ceil() as u32).min(resolution - 1);
        while fits > 0 && self.megabytes(fits).0 > limit {
            fits -= 1;
        }
        let tried = if self.visits(fits.max(1)) > MAX_VISITS { SOUNDING } else { fits };
        if fits == 0 || tried > fits {
            return None;
        }
        let tally = self.descend(tried, Wanted::Places).ok()?.tally;
        let surely = tally.deepest >= SURELY * self.grid(fits).side;
        (surely || (tried == fits && tally.start > 0)).then_some(fits)
    }

    /// Memory for the voxels of a resolution, in megabytes, and their number. That of the medial mesh is
    /// known when its voxels are (`output.rs`).
    pub(super) fn megabytes(&self, resolution: u32) -> (f64, f64) {
        let grid = self.grid(resolution);
        let voxels = self.volume / grid.side.powi(3);
        let bricks: f64 = grid.size.iter().map(|&n| f64::from(n) / 8.0).product();
        ((voxels * BYTES_PER_VOXEL + bricks * 4.0) / 1e6, voxels)
    }

    /// About how many voxels a lattice of a resolution visits: those inside, and a layer along the
    /// surface.
    pub(super) fn visits(&self, resolution: u32) -> f64 {
        let side = self.grid(resolution).side;
        self.volume / side.powi(3) + 2.0 * self.area / (side * side)
    }

    /// The error for a lattice without voxels. It names a resolution that was tried and has some,
    /// where there is one.
    pub(super) fn nothing_fits(&self, resolution: u32, deepest: f64) -> SimplifyError {
        match self.advice(resolution, deepest) {
            Ok(advice) => SimplifyError::Parameter(format!(
                "resolution = {resolution}: the solid is thinner than a voxel everywhere, no sphere \
                 of a voxel's side lies inside; {advice}"
            )),
            Err(error) => error,
        }
    }

    fn advice(&self, resolution: u32, mut deepest: f64) -> Result<String, SimplifyError> {
        let longest = self.grid(resolution).side * f64::from(resolution);
        // No ball inside is wider than the box around the solid.
        let extent =
            self.shape.mesh().bounding_box().map_or(0.0, |(lo, hi)| (hi - lo).min_element());
        let needed = (2.0 * longest / extent).ceil();
        if needed > f64::from(MAX_RESOLUTION) {
            return Ok(format!(
                "it would take {needed:.3e} voxels along the longest side, above the most of \
                 {MAX_RESOLUTION}: this solid is too thin for a lattice"
            ));
        }
        let mut tried = resolution;
        loop {
            // No voxel can be there while its side is above the largest distance.
            let least = if deepest > 0.0 { 1.1 * longest / deepest } else { 0.0 };
            let next = least.max(needed).max(1.5 * f64::from(tried));
            let next = next.min(3.0 * f64::from(tried)).ceil();
            let none = format!("none up to resolution = {tried} does");
            if next > f64::from(MAX_RESOLUTION) {
                return Ok(format!("{none}, and {MAX_RESOLUTION} is the most"));
            }
            let next = next as u32;
            if self.megabytes(next).0 > self.params().max_memory {
                return Ok(format!("{none}, beyond which max_memory ends; raise it"));
            }
            if self.visits(next) > MAX_VISITS {
                return Ok(format!("{none}, and finer lattices take too long to be tried here"));
            }
            let start = self.descend(next, Wanted::Places)?.tally;
            if start.start > 0 {
                return Ok(format!("resolution = {next} does"));
            }
            (tried, deepest) = (next, deepest.max(start.deepest));
        }
    }
}

// The published level.
//
// The published level: the paper's lattice, or the finest that fits.
//
// Parameters set by the user are not changed. Otherwise the resolution is lowered until the voxels and
// the medial mesh fit into memory, and a solid without a coarse voxel starts with fine ones.

/// How often the resolution is lowered for the medial mesh.
const MAX_LOWERINGS: usize = 4;
/// The memory that a lower resolution aims at, as a share of the limit.
const AIMED_MEMORY: f64 = 0.95;

/// The solid at the published level.
///
/// # Errors
/// As [`Solid::base`].
pub(super) fn published<'s>(
    shape: &'s Shape,
    settings: &AofSettings,
    run: &RunContext,
) -> Result<(Solid<'s>, Base), SimplifyError> {
    let mut params = settings.at(Level::Published).validate()?;
    let published = params.resolution;
    let is_free = settings.resolution.is_auto();
    let mut solid = Solid::new(shape, params.clone(), run.clone())?;
    if is_free && let Some(fits) = solid.finest_up_to(published) {
        params.resolution = fits;
        solid.params = params.clone();
    }
    let mut is_fine = false;
    if settings.start.is_auto() && solid.is_without_coarse_voxels()? {
        (params.start, is_fine) = (Start::Fine, true);
        solid.params = params.clone();
    }
    let mut base = solid.base()?;
    for _ in 0..MAX_LOWERINGS {
        let share = solid.share_of_memory(&base)?;
        if !is_free || share <= 1.0 {
            break;
        }
        // Voxels of sheets grow with the square of the resolution.
        let lower = f64::from(params.resolution) * (AIMED_MEMORY / share).sqrt();
        params.resolution = (lower as u32).clamp(1, params.resolution - 1);
        solid.params = params.clone();
        base = solid.base()?;
    }
    if params.resolution != published {
        base.diagnostics.warn(format!(
            "resolution {} instead of the published {published}: more does not fit into max_memory = {}",
            params.resolution, params.max_memory
        ));
    }
    if is_fine {
        base.diagnostics.warn(
            "start=fine instead of the published coarse: no sphere of a coarse voxel fits into the \
             solid",
        );
    }
    Ok((solid, base))
}

impl Solid<'_> {
    /// The resolution if its voxels fit into memory, else the finest that does.
    fn finest_up_to(&self, resolution: u32) -> Option<u32> {
        match self.megabytes(resolution).0 <= self.params().max_memory {
            true => Some(resolution),
            false => self.fitting(resolution),
        }
    }

    fn is_without_coarse_voxels(&self) -> Result<bool, SimplifyError> {
        let start = self.descend(self.params().resolution, Wanted::Places)?.tally.start;
        Ok(self.params().start == Start::Coarse && start == 0)
    }

    /// Memory of the base and of its medial mesh, as a share of the limit.
    fn share_of_memory(&self, base: &Base) -> Result<f64, SimplifyError> {
        let axis = self.axis(base.resolution, &base.descent, self.params().angle)?;
        Ok(self.megabytes_with_output(base, &axis) / self.params().max_memory)
    }
}

// A number of voxels.
//
// The axis with a number of voxels: a lattice as coarse as the count allows, then deletion.
//
// 1. The axis of the base has too many voxels, or too few. Of these, those on sheets grow in number
//    with the square of the resolution, those on curves with the resolution itself. This gives the
//    resolution that should have the count; every lattice that is tried corrects the estimate.
// 2. Too few: finer lattices are tried, each at most twice as fine as the one before, until one has
//    the count, memory or effort ends, or finer lattices bring no more voxels.
// 3. Too many: the search ends with a lattice that has the topology of the base, loses no more of the
//    surface, and has a few more voxels than asked. Where either is lost, the next one lies half way
//    to the coarsest lattice that has both.
// 4. The rest is deleted, simple voxels of the largest flux first.
//
// No lattice is tried twice.

/// A lattice with at most this share of voxels above the count is not made coarser.
const ENOUGH: f64 = 1.15;
/// A lattice may lose so much more of the surface than the base does or may.
const WORSE: f64 = 1.2;
/// The size that the estimate aims at, in requested counts.
const AIM: f64 = 1.06;
/// Lattices that are tried for a count.
const MAX_TRIES: usize = 8;
/// Neighbours from which on a voxel of a thinned axis is taken to be on a sheet.
const ON_A_SHEET: u32 = 4;

impl Solid<'_> {
    /// The axis of a lattice about as coarse as `count` voxels allow, with the topology of the base,
    /// taken down to the count.
    ///
    /// # Errors
    /// When the run was cancelled.
    pub(super) fn with_count(
        &self,
        base: &Base,
        count: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<Axis, SimplifyError> {
        let angle = self.params().angle;
        let first = self.axis(base.resolution, &base.descent, angle)?;
        let mut search = Search {
            growth: Growth::of(&first, base.resolution),
            best: first,
            high: base.resolution,
            low: 1,
            tried: 0,
        };
        if search.best.len() < count {
            self.climb(base, count, &mut search)?;
        }
        if search.best.len() > count {
            self.descend_to(base, count, &mut search)?;
        }
        let mut axis = search.best;
        if axis.len() < count {
            diagnostics.warn(format!(
                "{} spheres instead of {count}: the axis has no more voxels at resolution {}, the \
                 finest that was tried",
                axis.len(),
                search.high
            ));
        }
        if axis.len() > count {
            self.take_down(&mut axis, count, diagnostics)?;
            self.say_what_the_count_loses(&axis, search.high, diagnostics)?;
        }
        self.say_what_is_lost(base, search.high, diagnostics)?;
        diagnostics.count("lattice", search.high as usize);
        diagnostics.count("lattices_tried", search.tried);
        Ok(axis)
    }

    /// Step 2.
    fn climb(&self, base: &Base, count: usize, search: &mut Search) -> Result<(), SimplifyError> {
        let mut at = search.high;
        while search.tried < MAX_TRIES && search.best.len() < count {
            let ideal = search.growth.resolution_of(AIM * count as f64);
            // At least a sixteenth finer, so that few tries suffice; at most twice, since estimates
            // from a coarse lattice are poor.
            let next = ideal.clamp(at + 1 + at / 16, 2 * at + 1);
            if self.check_resolution(next).is_err() || self.visits(next) > MAX_VISITS {
                break;
            }
            search.tried += 1;
            let lattice = self.faithful_axis(next, base)?;
            let found = lattice.as_ref().map_or(0, Axis::len);
            if let Some(lattice) = lattice
                && found > search.best.len()
            {
                search.growth.correct(next, found);
                (search.low, search.high) = (search.high, next);
                search.best = lattice;
            } else if found > 0 && 2 * next >= 3 * at {
                // The axis is a curve's end, or a point: it has no more voxels on any lattice.
                break;
            }
            at = next;
        }
        Ok(())
    }

    /// Step 3.
    fn descend_to(
        &self,
        base: &Base,
        count: usize,
        search: &mut Search,
    ) -> Result<(), SimplifyError> {
        let mut is_lost = false;
        while search.tried < MAX_TRIES && search.best.len() as f64 > ENOUGH * count as f64 {
            let Search { low, high, .. } = *search;
            // The bracket is narrow enough, the sooner if its lower end lost the topology.
            if high - low <= 1 + high / if is_lost { 8 } else { 16 } {
                break;
            }
            search.tried += 1;
            let ideal = search.growth.resolution_of(AIM * count as f64);
            // An estimate outside the bracket has been refuted: bisect.
            let next = if low < ideal && ideal < high { ideal } else { low.midpoint(high) };
            let lattice = self.faithful_axis(next, base)?;
            is_lost |= lattice.is_none();
            let found = lattice.as_ref().map_or(0, Axis::len);
            if found > 0 {
                search.growth.correct(next, found);
            }
            match lattice {
                Some(lattice) if found >= count => {
                    (search.best, search.high) = (lattice, next);
                }
                _ => search.low = next,
            }
        }
        Ok(())
    }

    /// The axis of a lattice; `None` where the topology or a part of the base is lost.
    fn faithful_axis(&self, resolution: u32, base: &Base) -> Result<Option<Axis>, SimplifyError> {
        let start = self.descend(resolution, self.wanted())?;
        let (topology, base_loss) = (base.topology, base.loss.map_or(0.0, |loss| loss.distance));
        // Another topology than the base's is accepted if it is the solid's: the base may lack it.
        let is_other = |b, t| b != t && Some(b) != self.shape.expected_betti();
        if topology.is_some_and(|t| is_other(betti_of(&start.voxels), t)) {
            return Ok(None);
        }
        let most = base_loss.max(LOST * self.grid(self.params().resolution).side);
        if self.loss(resolution, &start.voxels, WORSE * most)?.is_some() {
            return Ok(None);
        }
        self.axis(resolution, &start, self.params().angle).map(Some)
    }

    /// Warns about parts of the surface far from all spheres of an axis that was taken down to a count.
    fn say_what_the_count_loses(
        &self,
        axis: &Axis,
        resolution: u32,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), SimplifyError> {
        let allowed = LOST * axis.grid.side;
        if let Some(loss) = self.loss_of(resolution, &axis.voxels, allowed)? {
            let place = self.shape.normalisation().backward(loss.place);
            diagnostics.warn(format!(
                "the surface at ({:.6}, {:.6}, {:.6}) is {:.1} % of the diagonal away from every sphere: \
                 {} of them do not reach all of the solid",
                place.x,
                place.y,
                place.z,
                100.0 * loss.distance,
                axis.len()
            ));
        }
        Ok(())
    }

    fn take_down(
        &self,
        axis: &mut Axis,
        count: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), SimplifyError> {
        let before = axis.voxels.len();
        if self.params().variant == Variant::Plain {
            // Most negative flux first. Stable, so ties go by place; then back to the order of places.
            axis.voxels.sort_by(|a, b| a.flux.total_cmp(&b.flux));
            axis.voxels.truncate(count);
            axis.voxels.sort_unstable_by_key(|v| [v.place[2], v.place[1], v.place[0]]);
        } else {
            let mut voxels = bricks_of(axis);
            thin(&mut voxels, Order::Down { to: count }, self.run())?;
            axis.voxels = sorted(&voxels);
            if axis.voxels.len() > count {
                diagnostics.warn(format!(
                    "{} spheres instead of {count}: to delete another voxel would change the \
                     topology",
                    axis.voxels.len()
                ));
            }
        }
        diagnostics.count("deleted_to_the_count", before - axis.voxels.len());
        Ok(())
    }
}

/// Lattices on both sides of a count.
struct Search {
    growth: Growth,
    /// The coarsest with the count, or the finest that was tried.
    best: Axis,
    /// Its resolution.
    high: u32,
    /// A coarser resolution that has too few voxels, or not the topology.
    low: u32,
    tried: usize,
}

fn bricks_of(axis: &Axis) -> Bricks {
    let mut voxels = Bricks::new(axis.grid.size);
    axis.voxels.iter().for_each(|&voxel| voxels.insert(voxel));
    voxels
}

/// Number of voxels by resolution `R`: `sheets R^2 + curves R`.
struct Growth {
    sheets: f64,
    curves: f64,
}

impl Growth {
    fn of(axis: &Axis, resolution: u32) -> Self {
        let voxels = bricks_of(axis);
        let neighbours = |place| voxels.neighbourhood(place).count_ones() - 1;
        let places = axis.voxels.iter().map(|voxel| voxel.place);
        let sheets = places.filter(|&place| neighbours(place) >= ON_A_SHEET).count();
        let r = f64::from(resolution);
        Self { sheets: sheets as f64 / (r * r), curves: (axis.voxels.len() - sheets) as f64 / r }
    }

    /// The resolution, rounded up, that should give this number of voxels.
    fn resolution_of(&self, voxels: f64) -> u32 {
        // The root of a quadratic without cancellation, and without division where it is linear.
        let root = (self.curves * self.curves + 4.0 * self.sheets * voxels).sqrt();
        (2.0 * voxels / (self.curves + root)).ceil() as u32
    }

    /// Makes the numbers fit those of a lattice.
    fn correct(&mut self, resolution: u32, found: usize) {
        let r = f64::from(resolution);
        let factor = found as f64 / (self.sheets * r * r + self.curves * r);
        self.sheets *= factor;
        self.curves *= factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_solved_for_the_resolution() {
        for (sheets, curves) in [(2.0, 0.0), (0.0, 3.0), (0.5, 7.0)] {
            let mut growth = Growth { sheets, curves };
            let at = |r: f64| sheets * r * r + curves * r;
            assert_eq!(growth.resolution_of(at(40.0) * (1.0 - 1e-12)), 40);
            assert_eq!(growth.resolution_of(at(40.0) * 1.001), 41);
            growth.correct(20, (2.0 * at(20.0)) as usize);
            assert_eq!(growth.resolution_of(2.0 * at(30.0) * (1.0 - 1e-12)), 30);
        }
    }
}
