//! Lambda-medial axis: keeps the part of the medial axis whose closest boundary points need a large
//! enclosing ball.
//!
//! Chazal, Lieutier: *The lambda-medial axis*, Graphical Models 67(4), 2005,
//! doi:10.1016/j.gmod.2005.01.002.
//!
//! `F(x)` is the radius of the smallest ball enclosing the closest boundary points `Pi(x)` of `x`; points
//! with `F >= lambda` are kept. `lambda` is a length, a fraction of the input's bounding-box diagonal.
//! `F(x) <= r(x)`, with equality where `x` lies in the convex hull of its closest points.
//!
//! # Variants
//! - `vertex`: the vertices of the Voronoi medial mesh, with the edges and faces
//!   between them. The default: it meets every number of spheres.
//! - `cell`: facets, edges and vertices of the Voronoi diagram, each by its own
//!   value, as the definition has it.
//!
//! # The published level
//! The paper gives no universal `lambda`. [`Level::Published`](medial::simplifier::Level) is
//! the default of the program that Yan, Letscher and Ju published with *Voxel cores: efficient, robust,
//! and provably good approximation of 3D medial axes*, ACM Transactions on Graphics 37(4), 2018, which
//! prunes by the same measure: facets whose two samples are less than 4 % of the longest side of the
//! box of the Voronoi vertices inside apart, that is, `lambda` = 2 % of this side, with a warning.
//!
//! # Deviations from the paper
//! - The text of the Q-MAT paper has "circumradius of the closest points". For a Voronoi vertex
//!   the circumradius of its four samples is the ball's own radius, which would make this a size
//!   filter; the smallest enclosing ball is the definition of Chazal and Lieutier.

use std::sync::Arc;

use medial::complex::{Contacts, DualTriangulation, MedialMesh, VoronoiFacets};
use medial::geometry::enclosing_ball;
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, Method, MethodInfo, NativeLevel, ParamFields, RunContext, Simplification,
    Simplified,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::ranked::{FacetSet, Published, Ranked, Scale, Wanted};
use crate::{Prepared, Result};

medial::parameters! {
    /// Parameters of the lambda-medial axis.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct LambdaParams {
        /// The filtered elements: Voronoi vertices, or Voronoi facets, edges and vertices, each by
        /// its own value.
        variant: Variant = Variant::Vertex, "vertex or cell";
    }
}

/// The elements that are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Variant {
    /// Voronoi vertices.
    Vertex,
    /// Voronoi facets, edges and vertices.
    Cell,
}

/// `lambda` of [`Level::Published`](medial::simplifier::Level), as a fraction of the longest
/// side of the box of the spheres' centres.
const PUBLISHED: f64 = 0.02;

/// How enclosing balls are compared with `lambda`, on a medial mesh that has a sphere.
fn scale(mesh: &MedialMesh) -> Scale {
    let first = mesh.spheres[0].centre;
    let bounds = mesh
        .spheres
        .iter()
        .fold([first; 2], |[low, high], sphere| [low.min(sphere.centre), high.max(sphere.centre)]);
    let longest = (bounds[1] - bounds[0]).max_element();
    let published = Published::Documented(
        PUBLISHED * longest,
        "as in the authors' program of voxel cores: closest points 4 % of the longest side apart",
    );
    Scale { name: "lambda", range: 0.0..=1.0, inclusive: true, published }
}

/// The lambda-medial axis as a method.
pub fn method() -> Method<LambdaParams> {
    let info = MethodInfo::new("lambda", "Lambda-medial axis")
        .citation(
            "Frederic Chazal, Andre Lieutier 2005. The lambda-medial axis. Graphical Models 67(4). \
             https://doi.org/10.1016/j.gmod.2005.01.002",
        )
        .bibtex(crate::references(&["ChazalLieutier2005"]))
        .summary("Keeps the spheres whose contact points need the largest enclosing balls.")
        .native(NativeLevel::larger_is_coarser("lambda", "fraction of the bounding-box diagonal"))
        .published(
            "lambda = 2 % of the longest side of the box of the spheres' centres, the default of the \
             authors' program of voxel cores; the paper gives no universal lambda",
        )
        .params(LambdaParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: LambdaParams, run: &RunContext) -> Prepared<'s> {
    Ok(match params.variant {
        Variant::Vertex => Box::new(rank_spheres(shape, run)?),
        Variant::Cell => Box::new(rank_cells(shape, run)?),
    })
}

// Lambda-medial axis, per sphere.
//
// 1. The initial medial mesh with the contact points `Pi(x)` of each sphere.
// 2. `F(x)`, the radius of the smallest ball enclosing `Pi(x)`.
// 3. Keep the spheres with `F >= lambda`, or the given number of spheres with the largest `F`.
// 4. The induced subcomplex: edges and faces all of whose spheres are kept.
//
// # Deviations from the paper
// - The paper's set is a closed subset of the whole axis; the filter on Voronoi vertices with the
//   induced subcomplex supports a number of spheres like every other method.

fn rank_spheres(shape: &Shape, run: &RunContext) -> Result<Ranked> {
    Ranked::by_contacts(shape, run, |_, contacts| enclosing_ball(contacts).1, scale)
}

// Lambda-medial axis on the cells of the Voronoi diagram.
//
// | cell | dual | `F` |
// |---|---|---|
// | facet | edge `pq` | `abs(p - q) / 2` |
// | edge | triangle | its circumradius if it is acute, else half of its longest side |
// | vertex | tetrahedron | radius of the smallest ball enclosing its corners |
//
// 1. The Voronoi facets, edges and vertices inside, each with the value that all its relative
//    interior has.
// 2. Keep the cells with `F >= lambda`. The dual of a cell is part of the duals of its sides, so that
//    values grow from facets to edges to vertices, and the kept part is closed.
// 3. Facets are cut into triangles. Edges and vertices that pass without a facet stay as they are.
//
// A number of spheres selects the vertices of largest value; of several with the same value, all or
// none.
//
// # Deviations from the paper
// - Rounding must not open the result: a value is at least that of the cells around it.

/// The cells of the Voronoi diagram inside a surface with their values.
pub(super) struct Cells {
    mesh: Arc<MedialMesh>,
    facets: Arc<VoronoiFacets>,
    dual: DualTriangulation,
    facet_value: Vec<f64>,
    /// The Voronoi edges among the edges of the mesh; diagonals of facets are none.
    edges: Vec<[u32; 2]>,
    edge_value: Vec<f64>,
    vertex_value: Vec<f64>,
    /// The values of the vertices, descending.
    descending: Vec<f64>,
    scale: Scale,
}

/// Step 1. `O(n log n)`.
fn rank_cells(shape: &Shape, run: &RunContext) -> Result<Cells> {
    let FacetSet { mesh, facets, dual } = FacetSet::of(shape)?;
    let facet_value = facet_values(shape, &facets)?;
    let contacts = mesh.contacts.as_ref().expect("a Voronoi medial mesh has contacts");
    let found: Vec<([u32; 2], f64)> = mesh
        .edges
        .par_iter()
        .filter_map(|&ends| {
            // The ends of a Voronoi edge share its three samples, those of a diagonal only two.
            let [mine, theirs] = ends.map(|v| contacts.of_sphere[v as usize]);
            let shared: Vec<u32> = mine.into_iter().filter(|s| theirs.contains(s)).collect();
            (shared.len() >= 3).then(|| (ends, enclosing_radius(contacts, &shared)))
        })
        .collect();
    run.check()?;
    let (edges, mut edge_value): (Vec<[u32; 2]>, Vec<f64>) = found.into_iter().unzip();
    let mut vertex_value: Vec<f64> =
        contacts.of_sphere.par_iter().map(|ids| enclosing_radius(contacts, ids)).collect();
    for (facet, &value) in facet_value.iter().enumerate() {
        let v = facets.polygon(facet);
        for k in 0..v.len() {
            let (a, b) = (v[k], v[(k + 1) % v.len()]);
            if let Ok(edge) = edges.binary_search(&[a.min(b), a.max(b)]) {
                edge_value[edge] = edge_value[edge].max(value);
            }
        }
    }
    for (ends, &value) in edges.iter().zip(&edge_value) {
        for &v in ends {
            vertex_value[v as usize] = vertex_value[v as usize].max(value);
        }
    }
    let mut descending = vertex_value.clone();
    descending.sort_unstable_by(|a, b| b.total_cmp(a));
    let scale = scale(&mesh);
    Ok(Cells {
        mesh,
        facets,
        dual,
        facet_value,
        edges,
        edge_value,
        vertex_value,
        descending,
        scale,
    })
}

fn enclosing_radius(contacts: &Contacts, ids: &[u32]) -> f64 {
    enclosing_ball(&ids.iter().map(|&s| contacts.samples[s as usize]).collect::<Vec<_>>()).1
}

fn facet_values(shape: &Shape, facets: &VoronoiFacets) -> Result<Vec<f64>> {
    let delaunay = shape.delaunay()?;
    let ends = (0..facets.len()).map(|facet| facets.ends(facet).map(|v| delaunay.point(v)));
    Ok(ends.map(|[p, q]| p.distance(q) / 2.0).collect())
}

impl Cells {
    /// The least value of the largest set of at most `spheres` vertices, of which none has the same
    /// value as one that is left out; of all with the largest value where these are more.
    fn level_for(&self, spheres: usize) -> f64 {
        let values = &self.descending;
        let Some(&left_out) = values.get(spheres) else {
            return *self.scale.range.start();
        };
        let above = values.partition_point(|&value| value > left_out);
        values[above.saturating_sub(1)]
    }

    fn kept(&self, lambda: f64) -> MedialMesh {
        let edges: Vec<[u32; 2]> =
            passing(&self.edge_value, lambda).map(|edge| self.edges[edge as usize]).collect();
        let facets: Vec<u32> = passing(&self.facet_value, lambda).collect();
        let vertices: Vec<u32> = passing(&self.vertex_value, lambda).collect();
        self.facets.subcomplex(&self.mesh, self.dual, &facets, &edges, &vertices)
    }
}

/// The ids of the values from `lambda` on.
fn passing(values: &[f64], lambda: f64) -> impl Iterator<Item = u32> {
    (0..).zip(values).filter(move |&(_, &value)| value >= lambda).map(|(id, _)| id)
}

impl Simplification for Cells {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let mut diagnostics = Diagnostics::default();
        let lambda = match self.scale.wanted(level, &mut diagnostics)? {
            Wanted::Spheres(spheres) => self.level_for(spheres),
            Wanted::Native(lambda) => lambda,
        };
        let mesh = self.kept(lambda);
        let reached = mesh.spheres.len();
        match level {
            Level::Spheres(requested) if reached != requested => diagnostics.warn(format!(
                "{reached} spheres instead of {requested}: {}",
                if reached == self.mesh.spheres.len() {
                    "there are no more"
                } else {
                    "others have the same value"
                }
            )),
            _ if reached == 0 => diagnostics.warn(format!(
                "no vertex passes lambda = {lambda}: the largest is {}",
                self.descending.first().copied().unwrap_or(0.0)
            )),
            _ => {}
        }
        let native_level = Some(lambda);
        Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, level) })
    }
}
