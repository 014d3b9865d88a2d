//! One solid at any resolution: its start set, its flux, its axis at an angle or at a count.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere as Ball, cubical_betti};
use medial::geometry::TriangleBvh;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};

use rayon::prelude::*;

use super::bricks::{Bricks, Place, Voxel};
use super::coarse_to_fine::{Descent, Surface, Wanted, coarse_to_fine};
use super::flux::Sphere;
use super::grid::Grid;
use super::lattice::{LatticeVoxel, LatticeVoxels};
use super::output::{medial_mesh, sorted};
use super::params::{AofParams, Variant};
use super::refine::refine;
use super::thinning::{Order, thin};

/// How often the lattice is made finer, half as fine again each time, for the topology of a start set.
const REFINEMENTS: u32 = 3;

/// A solid, ready for any lattice.
pub struct Solid<'s> {
    pub(super) shape: &'s Shape,
    surface: Surface,
    params: AofParams,
    run: RunContext,
    pub(super) volume: f64,
}

/// The lattice that the parameters ask for.
pub struct Base {
    /// Voxels along the longest side.
    pub resolution: u32,
    /// Its flux.
    pub descent: Descent,
    /// Betti numbers of its voxels, where the variant keeps them.
    pub topology: Option<[u64; 3]>,
    /// What is to be said of it.
    pub diagnostics: Diagnostics,
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
    /// A solid from a shape and its surface.
    pub fn new(shape: &'s Shape, surface: Surface, params: AofParams, run: RunContext) -> Self {
        let mesh = shape.mesh();
        let signed = |f: usize| {
            let [a, b, c] = mesh.triangle(f);
            a.dot(b.cross(c)) / 6.0
        };
        let volume = (0..mesh.faces.len()).map(signed).sum();
        Self { shape, surface, params, run, volume }
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

    /// What the run is surrounded by.
    pub(super) fn run(&self) -> &RunContext {
        &self.run
    }

    pub(super) fn wanted(&self) -> Wanted {
        if self.params.variant == Variant::Plain { Wanted::Kept } else { Wanted::All }
    }

    /// The lattice to work at.
    ///
    /// Variants that keep the topology of their start set make the lattice finer until that is
    /// the solid's.
    ///
    /// # Errors
    /// When no voxel fits into the solid; as [`Solid::descend`].
    pub fn base(&self) -> Result<Base, SimplifyError> {
        let mut diagnostics = Diagnostics::default();
        let mut resolution = self.params.resolution;
        let mut descent = self.descend(resolution, self.wanted())?;
        let mut topology = None;
        if self.params.variant != Variant::Plain {
            let mut betti = betti_of(&descent.voxels);
            if let Some(expected) = self.shape.expected_betti().filter(|&e| e != betti) {
                (resolution, betti) =
                    self.faithful_resolution(expected, &descent, betti, &mut diagnostics)?;
                if resolution != self.params.resolution {
                    descent = self.descend(resolution, self.wanted())?;
                }
            }
            topology = Some(betti);
        }
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
        Ok(Base { resolution, descent, topology, diagnostics })
    }

    /// The least resolution above the given one on whose start set has the topology of the solid,
    /// else the least that has voxels, with the Betti numbers of its start set.
    fn faithful_resolution(
        &self,
        expected: [u64; 3],
        asked: &Descent,
        betti: [u64; 3],
        diagnostics: &mut Diagnostics,
    ) -> Result<(u32, [u64; 3]), SimplifyError> {
        let coarsest = self.params.resolution;
        let mut first_with_voxels = (asked.tally.start > 0).then_some((coarsest, betti));
        for refinement in 1..=REFINEMENTS {
            let resolution = (f64::from(coarsest) * 1.5_f64.powi(refinement as i32)).round() as u32;
            let start = match self.descend(resolution, Wanted::Places) {
                Err(SimplifyError::Parameter(_)) => break,
                other => other?,
            };
            let betti = betti_of(&start.voxels);
            if betti == expected {
                diagnostics.warn(format!(
                    "resolution {resolution} instead of {coarsest}: below, the voxels whose \
                     spheres fit inside do not have the topology of the solid"
                ));
                return Ok((resolution, betti));
            }
            if start.tally.start > 0 {
                first_with_voxels.get_or_insert((resolution, betti));
            }
        }
        let Some((resolution, betti)) = first_with_voxels else {
            return Ok((coarsest, betti));
        };
        let start = match resolution == coarsest {
            true => &asked.voxels,
            false => &self.descend(resolution, Wanted::Places)?.voxels,
        };
        let side = self.grid(resolution).side * self.shape.normalisation().diagonal;
        let place = self.lost_vertex(resolution, start).map_or(String::new(), |p| {
            format!(", such as at ({:.6}, {:.6}, {:.6})", p.x, p.y, p.z)
        });
        diagnostics.warn(format!(
            "the voxels whose spheres fit inside have the Betti numbers {betti:?} instead of the \
             solid's {expected:?}: parts thinner than {:.4} or gaps narrower than {side:.4} in \
             units of the surface are not resolved{place}; give a higher resolution",
            2.0 * side
        ));
        Ok((resolution, betti))
    }

    /// The vertex of the surface, in input units, that is farthest from all voxels, if it is
    /// farther than those of a part that is resolved.
    fn lost_vertex(&self, resolution: u32, voxels: &Bricks) -> Option<Vec3> {
        const RESOLVED: i32 = 3;
        const FARTHEST: i32 = 12;
        const ASKED: usize = 2000;
        let grid = self.grid(resolution);
        let rings = |vertex: Vec3| {
            let at = ((vertex - grid.origin) / grid.side).to_array().map(|x| x.floor() as i32);
            (0..FARTHEST).find(|&ring| has_voxel(voxels, &grid, at, ring)).unwrap_or(FARTHEST)
        };
        let vertices = &self.shape.mesh().vertices;
        // It stands for many: some of them are enough.
        let (vertex, ring) = (0..vertices.len())
            .step_by(vertices.len().div_ceil(ASKED))
            .map(|index| (index, rings(vertices[index])))
            .max_by_key(|&(index, ring)| (ring, std::cmp::Reverse(index)))?;
        (ring > RESOLVED).then(|| self.shape.normalisation().backward(vertices[vertex]))
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
    pub fn medial_mesh(
        &self,
        axis: &Axis,
        tree: &TriangleBvh,
    ) -> Result<MedialMesh, SimplifyError> {
        let centres = axis.points();
        let balls = if self.params.refine {
            refine(&self.surface.triangles, tree, &axis.sphere, &centres, &self.run)?
                .into_iter()
                .map(|refined| refined.ball)
                .collect()
        } else {
            let ball = |&centre: &Vec3| Ball::new(centre, tree.closest(centre).distance);
            centres.par_iter().map(ball).collect()
        };
        medial_mesh(&axis.voxels, balls, &self.run)
    }

    fn axis_of(&self, grid: Grid, voxels: Vec<Voxel>) -> Axis {
        let counts = self.params.sample_counts().expect("validated");
        let count = counts[counts.len() - 1];
        Axis { sphere: Sphere::new(self.params.spiral, count, grid.side), grid, voxels }
    }
}

fn has_voxel(voxels: &Bricks, grid: &Grid, at: [i32; 3], ring: i32) -> bool {
    let side = 2 * ring + 1;
    (0..side.pow(3)).any(|k| {
        let step = [k % side - ring, k / side % side - ring, k / side / side - ring];
        let on_ring = step.iter().any(|x| x.abs() == ring);
        let place = [0, 1, 2].map(|axis| at[axis] + step[axis]);
        let within = (0..3).all(|axis| (0..grid.size[axis] as i32).contains(&place[axis]));
        on_ring && within && voxels.get(place.map(|x| x as u16)).is_some()
    })
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
