//! Lambda-medial axis on the cells of the Voronoi diagram.
//!
//! | cell | dual | `F` |
//! |---|---|---|
//! | facet | edge `pq` | `abs(p - q) / 2` |
//! | edge | triangle | its circumradius if it is acute, else half of its longest side |
//! | vertex | tetrahedron | radius of the smallest ball enclosing its corners |
//!
//! 1. The Voronoi facets, edges and vertices inside, each with the value that all its relative
//!    interior has.
//! 2. Keep the cells with `F >= lambda`. The dual of a cell is part of the duals of its sides, so that
//!    values grow from facets to edges to vertices, and what is kept is closed.
//! 3. Facets are cut into triangles. Edges and vertices that pass without a facet stay as they are, or
//!    are left out (`leftovers=false`).
//!
//! A number of spheres selects the vertices of largest value; of several with the same value, all or
//! none. Without leftovers it selects the facets of largest value.
//!
//! # Deviations from the paper
//! - Rounding must not open the result: a value is at least that of the cells around it.

use std::sync::Arc;

use medial::complex::{DualTriangulation, MedialMesh, VoronoiFacets};
use medial::geometry::enclosing_ball;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Extras, Level, Simplification, Simplified, SimplifyError};
use rayon::prelude::*;

use crate::ranked_facets::{FacetSet, RankedFacets};
use crate::scale::{Scale, Wanted};

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
pub(super) fn prepare(shape: &Shape) -> Result<Cells, SimplifyError> {
    let FacetSet { mesh, facets, dual } = FacetSet::of(shape)?;
    let facet_value = facet_values(shape, &facets)?;
    let contacts = mesh.contacts.as_ref().expect("a Voronoi medial mesh has contacts");
    let of_samples = |ids: &[u32]| {
        enclosing_ball(&ids.iter().map(|&s| contacts.samples[s as usize]).collect::<Vec<_>>()).1
    };
    let of_edge = |&[a, b]: &[u32; 2]| {
        let [mine, theirs] = [a, b].map(|v| contacts.of_sphere[v as usize]);
        let shared: Vec<u32> = mine.into_iter().filter(|s| theirs.contains(s)).collect();
        (shared.len() >= 3).then(|| ([a, b], of_samples(&shared)))
    };
    let found: Vec<([u32; 2], f64)> = mesh.edges.par_iter().filter_map(of_edge).collect();
    let (edges, mut edge_value): (Vec<[u32; 2]>, Vec<f64>) = found.into_iter().unzip();
    let mut vertex_value: Vec<f64> =
        contacts.of_sphere.par_iter().map(|ids| of_samples(ids)).collect();
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
    let scale = super::scale(&mesh);
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

/// The facets alone.
pub(super) fn prepare_facets(shape: &Shape) -> Result<RankedFacets<'static>, SimplifyError> {
    let set = FacetSet::of(shape)?;
    let value = facet_values(shape, &set.facets)?;
    let scale = super::scale(&set.mesh);
    Ok(RankedFacets::new(set, value, scale, Diagnostics::default()))
}

fn facet_values(shape: &Shape, facets: &VoronoiFacets) -> Result<Vec<f64>, SimplifyError> {
    let delaunay = shape.delaunay()?;
    let half = |facet: usize| {
        let [p, q] = facets.ends(facet).map(|v| delaunay.point(v));
        p.distance(q) / 2.0
    };
    Ok((0..facets.len()).map(half).collect())
}

impl Cells {
    /// The least value of a largest set of vertices of at most so many, of which none has the same
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
        let passing = |values: &[f64]| -> Vec<u32> {
            (0..).zip(values).filter(|&(_, &value)| value >= lambda).map(|(id, _)| id).collect()
        };
        let edges: Vec<[u32; 2]> =
            passing(&self.edge_value).into_iter().map(|e| self.edges[e as usize]).collect();
        let (facets, vertices) = (passing(&self.facet_value), passing(&self.vertex_value));
        self.facets.subcomplex(&self.mesh, self.dual, &facets, &edges, &vertices)
    }
}

impl Simplification for Cells {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let mut diagnostics = Diagnostics::default();
        let lambda = match self.scale.wanted(level, &mut diagnostics)? {
            Wanted::Spheres(spheres) => self.level_for(spheres),
            Wanted::Native(lambda) => lambda,
        };
        let mesh = self.kept(lambda);
        let reached = mesh.spheres.len();
        match level {
            Level::Spheres(asked) if reached != asked => diagnostics.warn(format!(
                "{reached} spheres instead of {asked}: {}",
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
        Ok(Simplified {
            mesh,
            asked: level,
            native_level: Some(lambda),
            diagnostics,
            extras: Extras::default(),
        })
    }
}
