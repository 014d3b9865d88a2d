//! One normalised input with its substrates, each built once, on demand, and timed.
//!
//! A [`Shape`] is a view on a store that all methods share. What is asked for through a view is
//! remembered in it with its cost, whoever built it first, so that the record of a run names the
//! substrates that the method used, and a filter does not look free beside a method that starts
//! from the mesh. [`Shape::view`] opens a fresh view on the same store.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

use crate::Vec3;
use crate::complex::{CellSpheres, DualTriangulation, MedialMesh, VoronoiFacets};
use crate::geometry::Delaunay;
use crate::surface::TriangleBvh;
use crate::surface::{InsideTest, Normalisation, Sampling, SurfaceReport, TriMesh};

mod contacts;
mod error;
mod growing;
mod inner_balls;
mod power_crust;
mod refined;
mod similarity;
mod substrate;
mod substrates;

pub use contacts::ContactSets;
pub use error::ShapeError;
pub use inner_balls::InnerBalls;
pub use power_crust::PolarBalls;
pub use refined::{BOUND, ENOUGH, MOST_TIMES, ROUNDS, Refined, Refinement};
pub use similarity::{Fit, FitSource, Similarity};
pub use substrate::{Cost, Substrate};

use substrate::{Cache, Use};

/// One input shape, normalised to a bounding-box diagonal of 1, and its substrates.
///
/// ```
/// use medial::shape::{Shape, ShapeOptions, Substrate};
/// use medial::surface::{self, Format};
///
/// let tetrahedron = b"OFF 4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
/// let loaded = surface::read_bytes(tetrahedron, Format::Off)?;
/// let options = ShapeOptions { sampling: "uniform:300".parse()?, ..ShapeOptions::default() };
/// let shape = Shape::new("tetrahedron", &loaded.mesh, loaded.report, options)?;
/// assert_eq!(shape.samples().len(), 300);
/// // Built now, and once: a second view finds it there, and is told what it cost.
/// let (first, second) = (shape.view(), shape.view());
/// first.delaunay()?;
/// second.delaunay()?;
/// assert!(second.used().iter().any(|(substrate, _)| *substrate == Substrate::Delaunay));
/// assert!(second.spent().seconds < first.spent().seconds);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A clone is the same view: what is used through either counts for both.
#[derive(Clone)]
pub struct Shape {
    store: Arc<Store>,
    /// Shared by a view and those that start from another medial mesh on its behalf.
    used: Arc<Mutex<BTreeMap<Substrate, Use>>>,
    given: Option<Result<Arc<MedialMesh>, ShapeError>>,
}

/// How the substrates of a shape are built; the same for every method in a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeOptions {
    /// Boundary samples of the Voronoi methods.
    pub sampling: Sampling,
    /// How dual Voronoi polygons are triangulated.
    pub dual: DualTriangulation,
}

struct Store {
    name: String,
    mesh: Arc<TriMesh>,
    normalisation: Normalisation,
    report: SurfaceReport,
    options: ShapeOptions,
    samples: Cache<Sampling, Arc<[Vec3]>>,
    /// Defects that [`Sampling::Auto`] could not mend.
    unmended: OnceLock<String>,
    delaunay: Cache<Sampling, Arc<Delaunay>>,
    cells: Cache<Sampling, Arc<CellSpheres>>,
    facets: Cache<Sampling, Arc<VoronoiFacets>>,
    medial: Cache<Sampling, Arc<MedialMesh>>,
    balls: Cache<Sampling, Arc<InnerBalls>>,
    of_surface: Arc<OfSurface>,
}

/// The part that does not depend on the samples.
#[derive(Default)]
struct OfSurface {
    tree: Cache<(), Arc<TriangleBvh>>,
    inside: Cache<(), Arc<InsideTest>>,
}

impl Shape {
    /// Normalises a closed, oriented surface and opens a first view on it.
    ///
    /// `report` is what [`crate::surface::validate`] or [`crate::surface::read`] said of `mesh`.
    ///
    /// # Errors
    /// [`ShapeError::Extent`] when the bounding box has no finite positive diagonal.
    pub fn new(
        name: impl Into<String>,
        mesh: &TriMesh,
        report: SurfaceReport,
        options: ShapeOptions,
    ) -> Result<Self, ShapeError> {
        let normalisation = Normalisation::of(mesh).ok_or(ShapeError::Extent)?;
        let mesh = TriMesh {
            vertices: mesh.vertices.iter().map(|&v| normalisation.forward(v)).collect(),
            faces: mesh.faces.clone(),
        };
        let store = Store {
            name: name.into(),
            mesh: Arc::new(mesh),
            normalisation,
            report,
            options,
            samples: Cache::default(),
            unmended: OnceLock::new(),
            delaunay: Cache::default(),
            cells: Cache::default(),
            facets: Cache::default(),
            medial: Cache::default(),
            balls: Cache::default(),
            of_surface: Arc::default(),
        };
        Ok(Self { store: Arc::new(store), used: Arc::default(), given: None })
    }

    /// The shape with an initial medial mesh from elsewhere, in input units, in place of its own.
    /// [`Shape::initial`] refuses one without a sphere, and one that is not valid once normalised.
    pub fn with_initial(mut self, initial: &MedialMesh) -> Self {
        let to_normal = self.store.normalisation;
        let mesh = initial.transformed(1.0 / to_normal.diagonal, |p| to_normal.forward(p));
        self.given = Some(match mesh.check() {
            Ok(()) if mesh.spheres.is_empty() => Err(ShapeError::EmptyInitial),
            Ok(()) => Ok(Arc::new(mesh)),
            Err(error) => Err(ShapeError::Initial(error)),
        });
        self
    }

    /// The same surface with other samples, for a method whose level is the density of samples. The
    /// bounding-volume tree and the inside test are shared; all else is built anew, kept as long as
    /// this shape, and part of the work of the method that asks for it: seconds and memory both. A
    /// given medial mesh is left behind.
    pub fn resampled(&self, sampling: Sampling) -> Self {
        let Store { name, mesh, normalisation, report, options, of_surface, .. } = &*self.store;
        let store = Store {
            name: name.clone(),
            mesh: Arc::clone(mesh),
            normalisation: *normalisation,
            report: report.clone(),
            options: ShapeOptions { sampling, ..options.clone() },
            samples: Cache::of_asker(),
            delaunay: Cache::of_asker(),
            cells: Cache::of_asker(),
            facets: Cache::of_asker(),
            medial: Cache::of_asker(),
            balls: Cache::of_asker(),
            of_surface: Arc::clone(of_surface),
            unmended: OnceLock::new(),
        };
        Self { store: Arc::new(store), used: Arc::default(), given: None }
    }

    /// A fresh view: the same substrates, nothing used yet.
    pub fn view(&self) -> Self {
        Self { used: Arc::default(), ..self.clone() }
    }

    /// The shape with an initial medial mesh in place of its own, in normalised units, on behalf of
    /// this view: what is used through it counts as used here.
    ///
    /// # Errors
    /// [`ShapeError::EmptyInitial`] for one without a sphere.
    pub fn starting_from(&self, initial: Arc<MedialMesh>) -> Result<Self, ShapeError> {
        if initial.spheres.is_empty() {
            return Err(ShapeError::EmptyInitial);
        }
        Ok(Self { given: Some(Ok(initial)), ..self.clone() })
    }

    /// Name of the input.
    pub fn name(&self) -> &str {
        &self.store.name
    }

    /// The surface, normalised to a bounding-box diagonal of 1.
    pub fn mesh(&self) -> &TriMesh {
        &self.store.mesh
    }

    /// The similarity from input to normalised coordinates.
    pub fn normalisation(&self) -> &Normalisation {
        &self.store.normalisation
    }

    /// The findings and repairs of reading the surface, in input units.
    pub fn report(&self) -> &SurfaceReport {
        &self.store.report
    }

    /// Betti numbers that the solid's topology demands of its medial axis.
    pub fn expected_betti(&self) -> Option<[u64; 3]> {
        self.store.report.expected_betti.map(|betti| betti.map(|number| number as u64))
    }

    /// How the substrates are built.
    pub fn options(&self) -> &ShapeOptions {
        &self.store.options
    }

    /// The substrates used through this view and what each cost, whoever built it.
    pub fn used(&self) -> Vec<(Substrate, Cost)> {
        let used = self.used.lock().expect("no panic while held");
        used.iter().map(|(&substrate, used)| (substrate, used.cost)).collect()
    }

    /// The part of the cost of [`Shape::used`] that was spent through this view.
    pub fn spent(&self) -> Cost {
        let used = self.used.lock().expect("no panic while held");
        let mut sum = Cost::default();
        used.values().filter(|used| used.built_here).for_each(|used| sum += used.cost);
        sum
    }

    fn take<T>(
        &self,
        substrate: Substrate,
        (built, used): (Result<T, ShapeError>, Use),
    ) -> Result<T, ShapeError> {
        self.note(substrate, used);
        built
    }

    fn note(&self, substrate: Substrate, used: Use) {
        let mut all = self.used.lock().expect("no panic while held");
        // The first use tells whether it was built here.
        all.entry(substrate).or_insert(used);
    }
}
