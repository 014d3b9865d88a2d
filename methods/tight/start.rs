//! The medial mesh that everything starts from.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use medial::complex::{MedialMesh, betti};
use medial::geometry::DisjointSets;
use medial::geometry::trees::PointTree;
use medial::metrics::topology_warning;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Level, MedialSimplifier, Params, RunContext, SimplifyError};
use medial::surface::{Sampling, Side};

use super::MANY;
use super::params::TightParams;

/// Times that the samples are doubled at most.
const DOUBLINGS: usize = 2;

/// Components that are joined at most, and points between two spheres that must be inside for that.
const JOINED: usize = 64;
const BETWEEN: usize = 16;

/// A start: the given medial mesh of a shape, or one of denser samples with a method that simplifies it.
pub(super) struct Start {
    shape: Shape,
    starter: Arc<dyn MedialSimplifier>,
    least: usize,
    is_given: bool,
    samples: usize,
    joined: usize,
    betti: [u64; 3],
}

impl Start {
    /// Samples the surface until the Betti numbers of the medial mesh are right.
    ///
    /// # Errors
    /// When the samples do not span space, or the given mesh has no sphere.
    pub fn new(
        shape: &Shape,
        starter: Arc<dyn MedialSimplifier>,
        params: &TightParams,
        run: &RunContext,
    ) -> Result<Self, SimplifyError> {
        // Built here, so that they count as substrates of the shape.
        shape.surface_tree()?;
        shape.inside_test();
        let least = params.start;
        if shape.has_given_initial() {
            let initial = shape.initial()?;
            let betti = betti(&initial);
            let shape = shape.starting_from(initial)?;
            return Ok(Self {
                shape,
                starter,
                least,
                is_given: true,
                samples: 0,
                joined: 0,
                betti,
            });
        }
        let expected = shape.expected_betti();
        let mut best: Option<(u64, Self)> = None;
        for doubling in 0..=DOUBLINGS {
            run.step(doubling, DOUBLINGS + 1)?;
            let samples = params.samples << doubling;
            let fine = shape.resampled(Sampling::BlueNoise { count: samples, seed: run.seed });
            let mut mesh = MedialMesh::clone(fine.initial()?.as_ref());
            let joined = joined(&mut mesh, shape, expected.map_or(u64::MAX, |[parts, ..]| parts));
            let betti = betti(&mesh);
            let fine = if joined > 0 { fine.starting_from(Arc::new(mesh))? } else { fine };
            let wrong = expected.map_or(0, |expected| {
                expected.iter().zip(betti).map(|(&expected, found)| expected.abs_diff(found)).sum()
            });
            // More samples can make it worse: the least wrong is kept, of equal ones the first.
            if best.as_ref().is_none_or(|(least, _)| wrong < *least) {
                let starter = Arc::clone(&starter);
                let start =
                    Self { shape: fine, starter, least, is_given: false, samples, joined, betti };
                best = Some((wrong, start));
            }
            if wrong == 0 {
                break;
            }
        }
        let (_, start) = best.expect("there is a first one");
        Ok(start)
    }

    /// What is to be said of it.
    pub fn describe(&self, diagnostics: &mut Diagnostics) {
        diagnostics.count("samples_of_the_start", self.samples);
        if self.joined > 0 {
            diagnostics.count("components_joined", self.joined);
        }
        if let Some(warning) = topology_warning(self.betti, self.shape.expected_betti()) {
            diagnostics.warn(format!("the start is wrong, and the result with it: {warning}"));
        }
    }

    /// The start for a number of spheres.
    ///
    /// # Errors
    /// Those of the other method.
    pub fn mesh(
        &self,
        count: usize,
        run: &RunContext,
        diagnostics: &mut Diagnostics,
    ) -> Result<MedialMesh, SimplifyError> {
        let initial = self.shape.initial()?;
        let wanted = self.least.max(MANY.saturating_mul(count));
        let mesh = if initial.spheres.len() <= if self.is_given { count } else { wanted } {
            MedialMesh::clone(&initial)
        } else {
            let mut levels = self.starter.prepare(&self.shape, &Params::none(), run)?;
            let found = levels.at(Level::Spheres(wanted))?;
            // More spheres are left than wanted where nothing more can be collapsed.
            if found.mesh.spheres.len() > wanted {
                found
                    .diagnostics
                    .warnings
                    .into_iter()
                    .for_each(|warning| diagnostics.warn(warning));
            }
            found.mesh
        };
        Ok(MedialMesh { contacts: None, ..mesh })
    }
}

/// Joins components by edges inside the solid until `parts` are left, the smallest one to what is closest to it.
/// Where the solid is thinner than the samples are apart, its medial mesh can fall into pieces. Returns how many
/// edges were added.
pub(super) fn joined(mesh: &mut MedialMesh, shape: &Shape, parts: u64) -> usize {
    let mut sets = DisjointSets::singletons(mesh.spheres.len());
    mesh.edges.iter().for_each(|&[a, b]| {
        sets.join(a, b);
    });
    let extra = sets.len().saturating_sub(usize::try_from(parts).unwrap_or(usize::MAX));
    if extra == 0 || extra > JOINED {
        return 0;
    }
    let mut stuck = BTreeSet::new();
    let mut joined = 0;
    while joined < extra {
        let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        (0..mesh.spheres.len() as u32)
            .for_each(|v| members.entry(sets.find(v)).or_default().push(v));
        let left = members.iter().filter(|(set, _)| !stuck.contains(*set));
        let Some((&set, own)) = left.min_by_key(|(_, own)| own.len()) else { break };
        match bridge(mesh, shape, own) {
            Some([a, b]) => {
                mesh.edges.push([a.min(b), a.max(b)]);
                sets.join(a, b);
                joined += 1;
            }
            None => {
                stuck.insert(set);
            }
        }
    }
    mesh.edges.sort_unstable();
    joined
}

/// The shortest edge from some spheres to any other one, if it is inside the solid.
fn bridge(mesh: &MedialMesh, shape: &Shape, own: &[u32]) -> Option<[u32; 2]> {
    let centre = |v: u32| mesh.spheres[v as usize].centre;
    let is_own: BTreeSet<u32> = own.iter().copied().collect();
    let others: Vec<u32> = (0..mesh.spheres.len() as u32).filter(|v| !is_own.contains(v)).collect();
    let tree = PointTree::new(&others.iter().map(|&v| centre(v)).collect::<Vec<_>>());
    let nearest = own.iter().filter_map(|&v| {
        let (place, squared) = tree.nearest(centre(v))?;
        Some((squared, [v, others[place as usize]]))
    });
    let (_, [a, b]) = nearest.min_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)))?;
    let between = (1..BETWEEN).map(|k| centre(a).lerp(centre(b), k as f64 / BETWEEN as f64));
    let sides = shape.inside_test().sides(&between.collect::<Vec<_>>());
    sides.iter().all(|&side| side == Side::Inside).then_some([a, b])
}
