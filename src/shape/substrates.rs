//! The substrates of a shape, each built once, on demand.

use std::sync::Arc;

use super::refined::Refinement;
use super::{ContactSets, Cost, InnerBalls, Shape, ShapeError, Substrate, Use};
use crate::Vec3;
use crate::complex::{CellSpheres, MedialMesh, VoronoiFacets, voronoi_medial_mesh};
use crate::diagnostics::Diagnostics;
use crate::geometry::Delaunay;
use crate::metrics::{Judge, JudgeOptions, Truth};
use crate::surface::{InsideTest, Sampling, TriangleBvh, sample};

impl Shape {
    /// The boundary samples of the shape's own sampling.
    pub fn samples(&self) -> Arc<[Vec3]> {
        self.samples_by(&self.store.options.sampling)
    }

    /// Boundary samples by another sampling. [`Sampling::Auto`] costs several medial meshes, which
    /// count as the cost of the samples.
    pub fn samples_by(&self, sampling: &Sampling) -> Arc<[Vec3]> {
        let refined = match sampling {
            Sampling::Auto => self.surface_tree().ok().zip(Some(self.inside_test())),
            _ => None,
        };
        let built = self.store.samples.get(*sampling, || {
            let refined = refined.and_then(|(tree, inside)| self.refined(&tree, &inside));
            Ok(refined.unwrap_or_else(|| sample(&self.store.mesh, sampling).into()))
        });
        self.take(Substrate::Samples, built).expect("sampling cannot fail")
    }

    /// The samples of [`Sampling::Auto`]; none where the vertices do not span space, which
    /// triangulating them reports.
    fn refined(&self, tree: &TriangleBvh, inside: &InsideTest) -> Option<Arc<[Vec3]>> {
        let expected = self.expected_betti();
        let (mesh, dual) = (&self.store.mesh, self.store.options.dual);
        let refined = Refinement { mesh, tree, inside, expected, dual }.run().ok()?;
        if let Some(warning) = refined.warning() {
            // The first: another view that builds the same samples says the same.
            let _ = self.store.unmended.set(warning);
        }
        Some(refined.samples.into())
    }

    /// What is wrong with the medial mesh of the samples all the same, where [`Sampling::Auto`] reached
    /// one of its limits; once they are built.
    pub fn sampling_warning(&self) -> Option<&str> {
        self.store.unmended.get().map(String::as_str)
    }

    /// The Delaunay triangulation of the boundary samples.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn delaunay(&self) -> Result<Arc<Delaunay>, ShapeError> {
        let samples = self.samples();
        let built = self.store.delaunay.get(self.store.options.sampling, || {
            Delaunay::new(&samples).map(Arc::new).map_err(ShapeError::from)
        });
        self.take(Substrate::Delaunay, built)
    }

    /// The circumspheres of the Delaunay cells and which of them are centred inside.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn cells(&self) -> Result<Arc<CellSpheres>, ShapeError> {
        let delaunay = self.delaunay()?;
        let tree = self.surface_tree()?;
        let inside = self.inside_test();
        let built = self.store.cells.get(self.store.options.sampling, || {
            Ok(Arc::new(CellSpheres::classify(&delaunay, &inside, &tree)))
        });
        self.take(Substrate::Inside, built)
    }

    /// The Voronoi facets all of whose vertices are inside.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn facets(&self) -> Result<Arc<VoronoiFacets>, ShapeError> {
        let delaunay = self.delaunay()?;
        let cells = self.cells()?;
        let built = self.store.facets.get(self.store.options.sampling, || {
            Ok(Arc::new(VoronoiFacets::new(&delaunay, &cells)))
        });
        self.take(Substrate::Facets, built)
    }

    /// The Voronoi medial mesh, in normalised units, with contact points.
    ///
    /// # Errors
    /// When the samples do not span space, or no circumcentre lies inside the surface.
    pub fn voronoi(&self) -> Result<Arc<MedialMesh>, ShapeError> {
        let delaunay = self.delaunay()?;
        let cells = self.cells()?;
        let facets = self.facets()?;
        let options = &self.store.options;
        let built = self.store.medial.get(options.sampling, || {
            let samples = self.samples();
            let mesh = voronoi_medial_mesh(&delaunay, &cells, &facets, &samples, options.dual);
            if mesh.spheres.is_empty() {
                return Err(ShapeError::of_nothing_inside(&cells));
            }
            Ok(Arc::new(mesh))
        });
        self.take(Substrate::MedialMesh, built)
    }

    /// The balls whose union stands for the shape, in normalised units: the spheres of the given
    /// medial mesh, or the inner polar balls of the samples.
    ///
    /// # Errors
    /// When the samples do not span space, or no pole lies inside the surface; when the given mesh has
    /// no sphere or is not valid.
    pub fn inner_balls(&self) -> Result<Arc<InnerBalls>, ShapeError> {
        if let Some(given) = &self.given {
            return given.as_ref().map(|m| Arc::new(InnerBalls::of_mesh(m))).map_err(Clone::clone);
        }
        let delaunay = self.delaunay()?;
        let cells = self.cells()?;
        let built = self.store.balls.get(self.store.options.sampling, || {
            let balls = InnerBalls::of_poles(&delaunay, &cells, &self.samples());
            if balls.spheres.is_empty() {
                return Err(ShapeError::of_nothing_inside(&cells));
            }
            Ok(Arc::new(balls))
        });
        self.take(Substrate::Poles, built)
    }

    /// The medial mesh that every simplifier of this shape starts from, in normalised units: the
    /// given one, or the Voronoi medial mesh.
    ///
    /// # Errors
    /// As [`Shape::voronoi`]; when the given mesh has no sphere or is not valid.
    pub fn initial(&self) -> Result<Arc<MedialMesh>, ShapeError> {
        match &self.given {
            Some(given) => given.clone(),
            None => self.voronoi(),
        }
    }

    /// Whether [`Shape::initial`] is a given mesh, which need not be part of a Voronoi diagram.
    pub fn has_given_initial(&self) -> bool {
        self.given.is_some()
    }

    /// The contact points of each sphere of a medial mesh of this shape: those that it carries, or
    /// the samples nearest to the centre, to within a thousandth, where they are within
    /// `(1 + 1e-3) r`; which is then said in `diagnostics`.
    ///
    /// # Errors
    /// Never at present; reserved for samplings that can fail.
    pub fn contacts(
        &self,
        mesh: &MedialMesh,
        diagnostics: &mut Diagnostics,
    ) -> Result<ContactSets, ShapeError> {
        if let Some(known) = &mesh.contacts {
            return Ok(ContactSets::known(known));
        }
        let samples = self.samples();
        let (sets, cost) = Cost::of(|| ContactSets::search(mesh, &samples));
        self.note(Substrate::Contacts, Use { cost, built_here: true });
        let empty = sets.empty_sets();
        diagnostics.warn(format!(
            "the initial medial mesh has no contact points: they were taken to be the samples \
             nearest to a centre, to within 0.1 % ({empty} spheres have fewer than two)"
        ));
        Ok(sets)
    }

    /// The bounding-volume tree of the surface.
    ///
    /// # Errors
    /// When the surface has no face.
    pub fn surface_tree(&self) -> Result<Arc<TriangleBvh>, ShapeError> {
        let built = self
            .store
            .of_surface
            .tree
            .get((), || Ok(Arc::new(TriangleBvh::new(&self.store.mesh)?)));
        self.take(Substrate::SurfaceTree, built)
    }

    /// The inside test of the surface.
    pub fn inside_test(&self) -> Arc<InsideTest> {
        let built = self
            .store
            .of_surface
            .inside
            .get((), || Ok(Arc::new(InsideTest::new(&self.store.mesh))));
        self.take(Substrate::InsideTest, built).expect("a test of any mesh can be built")
    }

    /// A judge of medial meshes of this shape. `axis` is its exactly known medial axis, in input
    /// units. What the judge needs counts as nobody's use.
    ///
    /// # Errors
    /// When the surface has no face.
    pub fn judge(
        &self,
        axis: Option<&MedialMesh>,
        options: JudgeOptions,
    ) -> Result<Judge, ShapeError> {
        let normal = self.store.normalisation;
        let truth = Truth {
            betti: self.expected_betti(),
            axis: axis.map(|a| a.transformed(1.0 / normal.diagonal, |p| normal.forward(p))),
            diagonal: normal.diagonal,
        };
        let unseen = self.view();
        let (tree, inside) = (unseen.surface_tree()?, unseen.inside_test());
        Ok(Judge::new(self.mesh().clone(), tree, inside, truth, options))
    }
}
