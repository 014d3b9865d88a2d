//! One normalised input with its substrates, each built once, on demand, and timed.
//!
//! A [`Shape`] is a view on a store that all methods share. A view lists each substrate
//! that is used through it with its cost, even if another view built it. So the record of a run names
//! the substrates of the method, and a filter does not look free next to a method that starts from the
//! mesh. [`Shape::view`] opens a fresh view on the same store.

mod balls;
mod closeness;
mod similarity;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Instant;

use cpu_time::ProcessTime;
use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::complex::{
    CellSpheres, ComplexError, Conforming, ConformingError, DualTriangulation, MedialMesh,
    VoronoiFacets, voronoi_medial_mesh, without_bulges,
};
use crate::diagnostics::Diagnostics;
use crate::geometry::{Delaunay, TriangulationError, VertexId};
use crate::heap::{Usage, usage_apart, usage_of};
use crate::metrics::{Judge, JudgeOptions, Truth};
use crate::surface::{
    BvhError, InsideTest, Normalisation, Sampling, SurfaceReport, TriMesh, TriangleBvh, sample,
};

pub use balls::{ContactSets, InnerBalls, PolarBalls};
pub use similarity::{Fit, FitSource, Similarity};

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
/// // Built now, and once: a second view finds it there, with its cost.
/// let (first, second) = (shape.view(), shape.view());
/// first.delaunay()?;
/// second.delaunay()?;
/// assert!(second.used().iter().any(|(substrate, _)| *substrate == Substrate::Delaunay));
/// assert!(second.spent().seconds < first.spent().seconds);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A clone is the same view: a use through either counts for both.
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
    of_samples: OfSamples,
    of_surface: Arc<OfSurface>,
}

/// The part that depends on the samples.
#[derive(Default)]
struct OfSamples {
    /// Whether the cost is work of the method that requests it, rather than of shared substrates.
    is_of_asker: bool,
    samples: Slot<Arc<[Vec3]>>,
    delaunay: Slot<Arc<Triangulated>>,
    cells: Slot<Arc<CellSpheres>>,
    centred: Slot<Arc<CellSpheres>>,
    facets: Slot<Arc<VoronoiFacets>>,
    /// The Voronoi medial mesh, and the one that methods start from.
    medial: Slot<[Arc<MedialMesh>; 2]>,
    balls: Slot<Arc<InnerBalls>>,
}

/// The samples with their Delaunay triangulation.
struct Triangulated {
    delaunay: Arc<Delaunay>,
    /// For each finite cell whether it is in the solid, where the surface is part of the triangulation; or why it
    /// is not, though that was requested.
    is_inside: Result<Vec<bool>, Option<String>>,
    /// Doubt about the topology of the cells inside.
    doubt: Option<String>,
}

impl Triangulated {
    /// The triangulation that [`Sampling::Conforming`] requests, or that of the vertices.
    fn conforming(
        mesh: &TriMesh,
        report: &SurfaceReport,
        least: usize,
    ) -> Result<Self, TriangulationError> {
        let begin = mesh.vertices.len().max(least);
        let found = match report.intersecting_pairs {
            0 => Conforming::new(mesh, begin, (8 * begin).max(LEAST_BUDGET), report.expected_betti),
            // No refinement would end.
            _ => Err(ConformingError::Crossing),
        };
        match found {
            Ok(Conforming { delaunay, is_inside, missing, .. }) => {
                let doubt = (missing > 0).then(|| {
                    format!(
                        "the initial medial mesh may have another topology than the solid: parts of the surface are too \
                         close to each other for samples ({missing} faces); {ADVICE}"
                    )
                });
                Ok(Self { delaunay: Arc::new(delaunay), is_inside: Ok(is_inside), doubt })
            }
            Err(ConformingError::Triangulation(error)) => Err(error),
            Err(why) => {
                let why = format!(
                    "the vertices alone are the samples, so the initial medial mesh may have another topology than the \
                     solid: {why}"
                );
                Ok(Self { is_inside: Err(Some(why)), ..Self::plain(&mesh.vertices)? })
            }
        }
    }

    fn plain(samples: &[Vec3]) -> Result<Self, TriangulationError> {
        let delaunay = Arc::new(Delaunay::new(samples)?);
        Ok(Self { delaunay, is_inside: Err(None), doubt: None })
    }
}

/// Points that may be added to a coarse surface; to others eight for each vertex.
const LEAST_BUDGET: usize = 20_000;

/// What helps where parts of a surface are too close to each other.
const ADVICE: &str = "give more samples (`--sampling conforming:N`), or wrap the surface (`medial repair FILE --wrap -o OUT`), which \
                      closes gaps narrower than 2 % of the diagonal";

/// The part that does not depend on the samples.
#[derive(Default)]
struct OfSurface {
    tree: Slot<Arc<TriangleBvh>>,
    inside: Slot<Arc<InsideTest>>,
}

impl Shape {
    /// Normalises a closed, oriented surface and opens a first view on it.
    ///
    /// `report` is that of [`crate::surface::validate`] or [`crate::surface::read`] for `mesh`.
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
            of_samples: OfSamples::default(),
            of_surface: Arc::default(),
        };
        Ok(Self { store: Arc::new(store), used: Arc::default(), given: None })
    }

    /// The shape with another initial medial mesh, in input units.
    /// [`Shape::initial`] refuses one without a sphere, and one that is not valid once normalised.
    pub fn with_initial(mut self, initial: &MedialMesh) -> Self {
        let mesh = initial.to_normal(&self.store.normalisation);
        self.given = Some(match mesh.check() {
            Ok(()) if mesh.spheres.is_empty() => Err(ShapeError::EmptyInitial),
            Ok(()) => Ok(Arc::new(mesh)),
            Err(error) => Err(ShapeError::Initial(error)),
        });
        self
    }

    /// The same surface with other samples, for a method whose level is the density of samples. The
    /// bounding-volume tree and the inside test are shared; all else is built again, kept as long as
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
            of_samples: OfSamples { is_of_asker: true, ..OfSamples::default() },
            of_surface: Arc::clone(of_surface),
        };
        Self { store: Arc::new(store), used: Arc::default(), given: None }
    }

    /// A fresh view: the same substrates, nothing used yet.
    pub fn view(&self) -> Self {
        Self { used: Arc::default(), ..self.clone() }
    }

    /// The shape with another initial medial mesh, in normalised units, on behalf of this view: a use
    /// through it counts as used here.
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

    /// The substrates used through this view with their costs, even if another view built them.
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

    fn note(&self, substrate: Substrate, used: Use) {
        let mut all = self.used.lock().expect("no panic while held");
        // The first use decides whether it was built here.
        all.entry(substrate).or_insert(used);
    }
}

/// Reason why a substrate is not built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum ShapeError {
    /// The bounding box is empty, flat to a point, or not finite.
    #[error("the surface has no extent: its bounding-box diagonal is zero or not finite")]
    Extent,
    /// The samples cannot be triangulated.
    #[error("triangulating the boundary samples: {0}")]
    Triangulation(#[from] TriangulationError),
    /// The surface has no bounding-volume tree.
    #[error("the surface: {0}")]
    Tree(#[from] BvhError),
    /// The medial mesh to start from has no sphere.
    #[error("the initial medial mesh has no sphere")]
    EmptyInitial,
    /// The medial mesh to start from is not valid in units of the surface's diagonal.
    #[error("the initial medial mesh, divided by the diagonal of the surface: {0}")]
    Initial(ComplexError),
    /// The inside of the shape holds no Voronoi vertex.
    #[error(
        "the initial medial mesh is empty: no circumcentre of the samples lies inside the surface; \
         sample more densely, for example --sampling blue:20000"
    )]
    EmptyMedialMesh,
    /// The inside of the shape holds Voronoi vertices, but all too close to the surface.
    #[error(
        "the initial medial mesh is empty: the circumcentres inside the surface ({centres}) are \
         all within a billionth of its diagonal of it; parts so thin or small relative to the whole \
         cannot be resolved: put parts that are far apart into files of their own"
    )]
    BelowResolution { centres: usize },
}

impl ShapeError {
    pub(super) fn of_nothing_inside(cells: &CellSpheres) -> Self {
        match cells.in_guard_band {
            0 => Self::EmptyMedialMesh,
            centres => Self::BelowResolution { centres },
        }
    }
}

// Substrates by name, their costs, and the place where they are kept.

/// A substrate that methods share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Substrate {
    /// Boundary samples.
    Samples,
    /// Delaunay triangulation of the samples.
    Delaunay,
    /// Circumspheres of the cells, each classified as inside or outside.
    Inside,
    /// Voronoi facets inside.
    Facets,
    /// Voronoi medial mesh.
    MedialMesh,
    /// Poles of the samples, and the polar balls inside.
    Poles,
    /// Bounding-volume tree of the surface.
    SurfaceTree,
    /// Inside test of the surface.
    InsideTest,
    /// Contact points of a medial mesh that came without them.
    Contacts,
}

impl Substrate {
    /// Name in records.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Delaunay => "delaunay",
            Self::Inside => "inside",
            Self::Facets => "facets",
            Self::MedialMesh => "medial_mesh",
            Self::Poles => "poles",
            Self::SurfaceTree => "surface_tree",
            Self::InsideTest => "inside_test",
            Self::Contacts => "contacts",
        }
    }
}

/// The cost of a piece of work, such as building a substrate, when it was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Seconds of the whole process on all processors, on Linux with those of the programs that it ran.
    pub cpu_seconds: f64,
    /// Bytes of the heap; 0 in a program that does not count them (see [`crate::heap`]).
    #[serde(default)]
    pub usage: Usage,
}

impl Cost {
    /// The result of `work` with its cost.
    pub fn of<T>(work: impl FnOnce() -> T) -> (T, Self) {
        Self::clocked(|| usage_of(work))
    }

    /// As [`Cost::of`], for a substrate: memory while it is built counts as its own, not as that of the work that
    /// requests it.
    fn of_substrate<T>(work: impl FnOnce() -> T) -> (T, Self) {
        Self::clocked(|| usage_apart(work))
    }

    fn clocked<T>(work: impl FnOnce() -> (T, Usage)) -> (T, Self) {
        let (wall, cpu, programs) = (Instant::now(), ProcessTime::now(), seconds_of_programs());
        let (value, usage) = work();
        let seconds = wall.elapsed().as_secs_f64();
        let cpu_seconds = cpu.elapsed().as_secs_f64() + (seconds_of_programs() - programs);
        (value, Self { seconds, cpu_seconds, usage })
    }
}

/// Processor time of the ended child processes, to a hundredth of a second; 0 where the system does not list it.
fn seconds_of_programs() -> f64 {
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else { return 0.0 };
    // The name of the program, in parentheses, can contain spaces.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks: u64 = fields.skip(13).take(2).filter_map(|field| field.parse::<u64>().ok()).sum();
    ticks as f64 / 100.0
}

impl std::ops::AddAssign for Cost {
    fn add_assign(&mut self, other: Self) {
        self.seconds += other.seconds;
        self.cpu_seconds += other.cpu_seconds;
        // The other work was done on top of what this one had left.
        let peak = self.usage.held_bytes + other.usage.peak_bytes;
        self.usage.peak_bytes = self.usage.peak_bytes.max(peak);
        self.usage.held_bytes += other.usage.held_bytes;
    }
}

/// The facts that a view remembers of a substrate.
#[derive(Clone, Copy)]
pub(super) struct Use {
    pub cost: Cost,
    /// Whether it was built through this view, rather than found.
    pub built_here: bool,
}

/// A substrate that is built once, with the cost of that.
type Slot<T> = OnceLock<(Result<T, ShapeError>, Cost)>;

// The substrates of a shape, each built once, on demand.

impl Shape {
    /// The boundary samples.
    pub fn samples(&self) -> Arc<[Vec3]> {
        let Store { of_samples, options, mesh, .. } = &*self.store;
        let triangulated = match options.sampling {
            Sampling::Conforming { .. } => self.triangulated().ok(),
            _ => None,
        };
        let build = || {
            Ok(match triangulated.as_deref() {
                Some(Triangulated { delaunay, .. }) => {
                    let all = 0..delaunay.point_count() as u32;
                    all.map(|v| delaunay.point(VertexId(v))).collect()
                }
                None => sample(mesh, &options.sampling).into(),
            })
        };
        let samples = self.built(Substrate::Samples, &of_samples.samples, build);
        samples.expect("sampling cannot fail")
    }

    /// The substrate of a slot, built now if it is not yet there; a second thread waits for the first.
    fn built<T: Clone>(
        &self,
        substrate: Substrate,
        slot: &Slot<T>,
        build: impl FnOnce() -> Result<T, ShapeError>,
    ) -> Result<T, ShapeError> {
        let is_of_surface = matches!(substrate, Substrate::SurfaceTree | Substrate::InsideTest);
        let is_of_asker = self.store.of_samples.is_of_asker && !is_of_surface;
        let mut built_here = false;
        let (value, cost) = slot.get_or_init(|| {
            built_here = true;
            if is_of_asker { Cost::of(build) } else { Cost::of_substrate(build) }
        });
        self.note(substrate, Use { cost: *cost, built_here });
        value.clone()
    }

    /// Why [`Sampling::Conforming`] could not be had, once the samples are triangulated.
    pub fn sampling_warning(&self) -> Option<String> {
        let (triangulated, _) = self.store.of_samples.delaunay.get()?;
        match &**triangulated.as_ref().ok()? {
            Triangulated { is_inside: Err(why), .. } => why.clone(),
            Triangulated { doubt, .. } => doubt.clone(),
        }
    }

    /// What a user has to know of the surface and the start of a result: changes to the solid, warnings of its report,
    /// [`Shape::sampling_warning`], and places where the start is far from the surface. Of substrates that were not built
    /// nothing is said. Cost: a bounded search in the tree of the surface for each sphere of the start; on coarse surfaces also
    /// the tree of the start.
    pub fn remarks(&self) -> Vec<String> {
        let report = self.report();
        let changes = report.repairs.iter().filter(|repair| repair.changes_solid());
        let mut remarks: Vec<String> =
            changes.map(|repair| format!("repaired: {repair}")).collect();
        remarks.extend(report.warnings.iter().cloned());
        remarks.extend(self.sampling_warning());
        remarks.extend(self.far_places());
        remarks
    }

    fn triangulated(&self) -> Result<Arc<Triangulated>, ShapeError> {
        let Store { options, mesh, report, .. } = &*self.store;
        let (least, samples) = match options.sampling {
            Sampling::Conforming { least } => (least, None),
            _ => (0, Some(self.samples())),
        };
        self.built(Substrate::Delaunay, &self.store.of_samples.delaunay, || {
            let triangulated = match &samples {
                None => Triangulated::conforming(mesh, report, least),
                Some(samples) => Triangulated::plain(samples),
            };
            Ok(Arc::new(triangulated?))
        })
    }

    /// The Delaunay triangulation of the boundary samples.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn delaunay(&self) -> Result<Arc<Delaunay>, ShapeError> {
        Ok(Arc::clone(&self.triangulated()?.delaunay))
    }

    /// The circumspheres of the Delaunay cells, and which of them are inside: in a conforming triangulation the
    /// cells of the solid, with centres moved into them where they are outside, else the spheres centred inside.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn cells(&self) -> Result<Arc<CellSpheres>, ShapeError> {
        let triangulated = self.triangulated()?;
        let tree = self.surface_tree()?;
        let inside = self.inside_test();
        self.built(Substrate::Inside, &self.store.of_samples.cells, || {
            let Triangulated { delaunay, is_inside, .. } = &*triangulated;
            Ok(Arc::new(match is_inside {
                Ok(known) => CellSpheres::of_cells(delaunay, known.clone(), &inside, &tree),
                Err(_) => CellSpheres::classify(delaunay, &inside, &tree),
            }))
        })
    }

    /// As [`Shape::cells`], but by the place of the circumcentres alone, as poles need it.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn centred(&self) -> Result<Arc<CellSpheres>, ShapeError> {
        let triangulated = self.triangulated()?;
        if triangulated.is_inside.is_err() {
            return self.cells();
        }
        let tree = self.surface_tree()?;
        let inside = self.inside_test();
        self.built(Substrate::Inside, &self.store.of_samples.centred, || {
            Ok(Arc::new(CellSpheres::classify(&triangulated.delaunay, &inside, &tree)))
        })
    }

    /// The Voronoi facets all of whose vertices are inside.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn facets(&self) -> Result<Arc<VoronoiFacets>, ShapeError> {
        let delaunay = self.delaunay()?;
        let cells = self.cells()?;
        self.built(Substrate::Facets, &self.store.of_samples.facets, || {
            Ok(Arc::new(VoronoiFacets::new(&delaunay, &cells)))
        })
    }

    /// The Voronoi medial mesh, in normalised units, with contact points.
    ///
    /// # Errors
    /// When the samples do not span space, or no circumcentre lies inside the surface.
    pub fn voronoi(&self) -> Result<Arc<MedialMesh>, ShapeError> {
        self.medial().map(|[voronoi, _]| voronoi)
    }

    /// The Voronoi medial mesh; and that with split edges, where the samples are the conforming ones.
    fn medial(&self) -> Result<[Arc<MedialMesh>; 2], ShapeError> {
        let delaunay = self.delaunay()?;
        let cells = self.cells()?;
        let facets = self.facets()?;
        let inside = matches!(self.options().sampling, Sampling::Conforming { .. })
            .then(|| self.inside_test());
        self.built(Substrate::MedialMesh, &self.store.of_samples.medial, || {
            let (samples, dual) = (self.samples(), self.store.options.dual);
            let mesh = voronoi_medial_mesh(&delaunay, &cells, &facets, &samples, dual);
            if mesh.spheres.is_empty() {
                return Err(ShapeError::of_nothing_inside(&cells));
            }
            let split = inside.and_then(|inside| without_bulges(&mesh, &inside)).map(Arc::new);
            let mesh = Arc::new(mesh);
            Ok([Arc::clone(&mesh), split.unwrap_or(mesh)])
        })
    }

    /// The balls whose union approximates the shape, in normalised units: the spheres of the given
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
        let cells = self.centred()?;
        self.built(Substrate::Poles, &self.store.of_samples.balls, || {
            let balls = InnerBalls::of_poles(&delaunay, &cells, &self.samples());
            if balls.spheres.is_empty() {
                return Err(ShapeError::of_nothing_inside(&cells));
            }
            Ok(Arc::new(balls))
        })
    }

    /// The medial mesh that every simplifier of this shape starts from, in normalised units: the
    /// given one, or the Voronoi medial mesh, on conforming samples with spheres on the edges that reach far beyond the
    /// surface.
    ///
    /// # Errors
    /// As [`Shape::voronoi`]; when the given mesh has no sphere or is not valid.
    pub fn initial(&self) -> Result<Arc<MedialMesh>, ShapeError> {
        match &self.given {
            Some(given) => given.clone(),
            None => self.medial().map(|[_, initial]| initial),
        }
    }

    /// Whether [`Shape::initial`] is a given mesh, which need not be part of a Voronoi diagram.
    pub fn has_given_initial(&self) -> bool {
        self.given.is_some()
    }

    /// The contact points of each sphere of a medial mesh of this shape: those that it carries, or
    /// the samples nearest to the centre, to within a thousandth, where they are within
    /// `(1 + 1e-3) r`; which `diagnostics` then reports.
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
        let Store { mesh, of_surface, .. } = &*self.store;
        let build = || Ok(Arc::new(TriangleBvh::new(mesh)?));
        self.built(Substrate::SurfaceTree, &of_surface.tree, build)
    }

    /// The inside test of the surface.
    pub fn inside_test(&self) -> Arc<InsideTest> {
        let Store { mesh, of_surface, .. } = &*self.store;
        let build = || Ok(Arc::new(InsideTest::new(mesh)));
        let test = self.built(Substrate::InsideTest, &of_surface.inside, build);
        test.expect("a test of any mesh can be built")
    }

    /// A judge of medial meshes of this shape. `axis` is its exactly known medial axis, in input
    /// units. The substrates of the judge count as used by no method.
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
            axis: axis.map(|axis| axis.to_normal(&normal)),
            diagonal: normal.diagonal,
        };
        let unseen = self.view();
        let (tree, inside) = (unseen.surface_tree()?, unseen.inside_test());
        Ok(Judge::new(self.mesh().clone(), tree, inside, truth, options))
    }
}
