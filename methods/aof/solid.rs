//! One solid at any resolution: its start set, its flux, its axis at an angle or at a count.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere as Ball, cubical_betti};
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};
use medial::surface::TriangleBvh;

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

/// A solid, ready for any lattice.
pub struct Solid<'s> {
    pub(super) shape: &'s Shape,
    surface: Surface,
    params: AofParams,
    run: RunContext,
    pub(super) volume: f64,
    /// Area of the surface.
    pub(super) area: f64,
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
        let doubled = |f: usize| {
            let [a, b, c] = mesh.triangle(f);
            (b - a).cross(c - a).length()
        };
        let area = (0..mesh.faces.len()).map(doubled).sum::<f64>() / 2.0;
        Self { shape, surface, params, run, volume, area }
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
