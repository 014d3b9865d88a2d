//! Steps 1 and 2: the axis to be pruned, and the volume that each of its simplices represents.

use medial::Vec3;
use medial::complex::{Contacts, Incidence, MedialMesh, UnionAxis, betti};
use medial::metrics::enclosed_volume;
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{Diagnostics, RunContext, SimplifyError};
use medial::surface::TriangleBvh;

use super::crust::AxisPoles;
use super::duplicates::{DistinctBalls, tetrahedron};
use super::fins::without_fins;
use super::merge;
use super::params::{AxisChoice, TamHeidrichParams};
use crate::perturb::perturbed;

/// A medial mesh with everything that pruning needs.
pub(super) struct Axis {
    pub(super) mesh: MedialMesh,
    pub(super) incidence: Incidence,
    /// For each sphere whether it is the end of an edge without faces, or has no edge: it stays.
    pub(super) on_curve: Vec<bool>,
    /// For each sphere the relative volume of the tetrahedra whose pole it is.
    pub(super) at_sphere: Vec<f64>,
    /// For each face the relative volume of the tetrahedra whose pole is nearest to it, if the spheres
    /// of the mesh are not poles.
    pub(super) at_face: Vec<f64>,
    /// The number of voids.
    pub(super) b2: u64,
    /// The poles on it; `None` if its spheres are not polar balls of samples.
    pub(super) poles: Option<AxisPoles>,
}

impl Axis {
    /// An axis without volumes and voids, which are still to be computed.
    pub(super) fn of_mesh(mesh: MedialMesh) -> Self {
        let incidence = Incidence::of(&mesh);
        // Spheres without edges stay as well as the ends of edges without faces.
        let mut on_curve = vec![true; mesh.spheres.len()];
        let edges = || mesh.edges.iter().zip(incidence.faces_at());
        for v in edges().filter(|e| *e.1 > 0).flat_map(|e| e.0) {
            on_curve[*v as usize] = false;
        }
        for v in edges().filter(|e| *e.1 == 0).flat_map(|e| e.0) {
            on_curve[*v as usize] = true;
        }
        let at_sphere = vec![0.0; mesh.spheres.len()];
        let at_face = vec![0.0; mesh.faces.len()];
        Self { mesh, incidence, on_curve, at_sphere, at_face, b2: 0, poles: None }
    }

    /// The axis of a shape, as the parameters specify it.
    pub(super) fn of_shape(
        shape: &Shape,
        params: &TamHeidrichParams,
        run: &RunContext,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self, SimplifyError> {
        let given = shape.has_given_initial();
        let from_union = match params.axis {
            AxisChoice::Auto => !given,
            AxisChoice::Union => true,
            AxisChoice::Initial => false,
        };
        let mut axis = match from_union {
            true => of_union(shape, params, run, diagnostics)?,
            false => {
                let mesh = shape.initial()?;
                let mut axis = Self::of_mesh(mesh.as_ref().clone());
                axis.b2 = betti(&axis.mesh)[2];
                if let Some(contacts) = mesh.contacts.as_ref().filter(|_| !given) {
                    axis.at_sphere = volumes(contacts, 0..contacts.of_sphere.len());
                }
                axis
            }
        };
        run.step(0, 1)?;
        if given {
            axis.share_out(shape)?;
            diagnostics.warn(
                "the given medial mesh has no poles: each interior Delaunay tetrahedron of the \
                 samples counts for the part nearest to its circumcentre",
            );
        }
        let whole = enclosed_volume(shape.mesh());
        if whole > 0.0 {
            axis.at_sphere.iter_mut().chain(&mut axis.at_face).for_each(|v| *v /= whole);
        }
        Ok(axis)
    }

    /// Gives each face the volume of the interior tetrahedra whose circumcentre it is nearest to.
    fn share_out(&mut self, shape: &Shape) -> Result<(), SimplifyError> {
        if self.mesh.faces.is_empty() {
            return Ok(());
        }
        let delaunay = shape.delaunay()?;
        let cells = shape.cells()?;
        let centre = |v: u32| self.mesh.spheres[v as usize].centre;
        let mut targets: Vec<[Vec3; 3]> =
            self.mesh.faces.iter().map(|face| face.map(centre)).collect();
        // Curves take part in the search, since a tetrahedron nearest to a curve belongs to no part.
        let curves = self.mesh.edges.iter().zip(self.incidence.faces_at()).filter(|e| *e.1 == 0);
        targets.extend(curves.map(|(&[a, b], _)| [centre(a), centre(b), centre(b)]));
        let tree = TriangleBvh::from_triangles(&targets).map_err(ShapeError::from)?;
        let inside: Vec<_> = delaunay.finite_cells().filter(|&c| cells.is_inside(c)).collect();
        let circumcentre = |&c| delaunay.circumsphere(c).map_or(Vec3::ZERO, |s| s.0);
        let centres: Vec<Vec3> = inside.iter().map(circumcentre).collect();
        for (cell, nearest) in inside.iter().zip(tree.closest_batch(&centres)) {
            if let Some(volume) = self.at_face.get_mut(nearest.face as usize) {
                *volume += tetrahedron(delaunay.vertices(*cell).map(|v| delaunay.point(v)));
            }
        }
        Ok(())
    }
}

/// The exact axis of the union of the perturbed balls.
fn of_union(
    shape: &Shape,
    params: &TamHeidrichParams,
    run: &RunContext,
    diagnostics: &mut Diagnostics,
) -> Result<Axis, SimplifyError> {
    let poles = match shape.has_given_initial() {
        true => DistinctBalls::given(&shape.inner_balls()?.spheres),
        false => DistinctBalls::of_samples(shape)?,
    };
    run.step(0, 1)?;
    let spheres = perturbed(&poles.balls, params.radius_factor, params.jitter, run.seed);
    let union = UnionAxis::of_balls(&spheres).map_err(ShapeError::from)?;
    run.step(0, 1)?;
    let whole = union.mesh();
    let at = poles.samples_of_corners(shape, &spheres, &union);
    let is_fin = fins_of(&whole, &union, &at);
    let (finless, first_into, fins_left) = without_fins(&whole, &is_fin);
    run.step(0, 1)?;
    let (mesh, into) = merge::merged(&finless, params.merge, run)?;
    let mut axis = Axis::of_mesh(mesh);
    // The first vertices of the axis are centres of balls.
    let on_axis = || union.balls().iter().zip(&first_into).map(|(&b, &v)| (b, into[v as usize]));
    for (ball, sphere) in on_axis() {
        axis.at_sphere[sphere as usize] += poles.volumes[ball as usize];
    }
    if !shape.has_given_initial() {
        axis.poles = Some(AxisPoles::of(shape.samples().len(), &poles, on_axis()));
    }
    diagnostics.count("fins", is_fin.iter().filter(|&&fin| fin).count());
    diagnostics.count("fins_left", fins_left);
    diagnostics.count("balls", spheres.len());
    diagnostics.count("balls_on_the_axis", union.balls().len());
    diagnostics.count("vertices", whole.spheres.len());
    diagnostics.count("vertices_merged", finless.spheres.len() - axis.mesh.spheres.len());
    diagnostics.count("facets_left_open", union.tally().open);
    diagnostics.count("doubtful_groups", union.tally().doubtful);
    let found = betti(&axis.mesh);
    axis.b2 = found[2];
    if found != union.union_betti() {
        diagnostics.warn(format!(
            "the axis has Betti numbers {found:?}, the union of balls {:?}: rounding left {} facets \
             open and {} groups of vertices in doubt",
            union.union_betti(),
            union.tally().open,
            union.tally().doubtful
        ));
    }
    Ok(axis)
}

/// For each triangle of the axis of a union whether it lies between two corners at the same sample.
fn fins_of(mesh: &MedialMesh, union: &UnionAxis, at: &[Option<u32>]) -> Vec<bool> {
    let sample = |corner: u32| at.get(corner as usize).copied().flatten();
    let is_between = |[a, b]: [u32; 2]| sample(a).is_some() && sample(a) == sample(b);
    let facets = union.facets().filter(|f| is_between(f.between));
    let mut fins: Vec<[u32; 3]> = facets.flat_map(|f| f.fan()).collect();
    fins.iter_mut().for_each(|fin| fin.sort_unstable());
    fins.sort_unstable();
    mesh.faces.iter().map(|face| fins.binary_search(face).is_ok()).collect()
}

/// The volumes of the Delaunay tetrahedra of some poles.
fn volumes(contacts: &Contacts, poles: impl Iterator<Item = usize>) -> Vec<f64> {
    let corners = |pole: usize| contacts.of_sphere[pole].map(|s| contacts.samples[s as usize]);
    poles.map(|pole| tetrahedron(corners(pole))).collect()
}
