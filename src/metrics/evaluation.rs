//! The record of everything measured on one medial mesh: the `evaluate` object of the command.
//!
//! All lengths are fractions of the input's bounding-box diagonal. METHODOLOGY.md defines each
//! number; the modules beside this one compute them.

use serde::{Deserialize, Serialize};

use super::Certificate;

/// Everything measured on one medial mesh against one surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Distances between the surface and the union of spheres, cones and slabs.
    #[serde(flatten)]
    pub distances: Distances,
    /// An interval that contains the Hausdorff distance, if it was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certified: Option<Certificate>,
    /// Volume of the symmetric difference of solid and union, over the solid's volume.
    pub volume_error: Option<f64>,
    /// Largest distance from the surface of a boundary point of the union that is outside the solid.
    #[serde(default)]
    pub protrusion: Option<f64>,
    /// Share of the centres that are outside the solid.
    #[serde(default)]
    pub centres_outside: Option<f64>,
    /// Angles of the medial triangles.
    pub quality: TriangleQuality,
    /// Spike measures.
    pub spikes: Spikes,
    /// Betti numbers `[b0, b1, b2]` of the medial mesh over Z2.
    pub betti: [u64; 3],
    /// Euler number of the medial mesh, vertices - edges + faces.
    pub euler: i64,
    /// The Betti numbers that the solid's topology implies: components, total genus, cavities.
    pub expected_betti: Option<[u64; 3]>,
    /// Sizes of the complex.
    pub counts: Counts,
    /// Distances to the exactly known medial axis, where the shape carries one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<AxisDistances>,
    /// Bounding-box diagonal of the input, in the input's units.
    pub diagonal: f64,
    /// Seed of every random sample.
    pub seed: u64,
    /// Remarks for the reader, such as radii that do not fit the mesh.
    pub warnings: Vec<String>,
}

/// Distances between the surface S and the boundary of the union U of the medial primitives.
///
/// Maxima are over samples and the points that are reached from the largest of them by local ascent:
/// distances at actual points, and so lower bounds of the true maxima.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Largest distance from a point of S to the nearest primitive's surface, buried or not:
    /// the reading of the Q-MAT paper.
    pub epsilon: f64,
    /// Largest absolute signed distance from a point of S to the union.
    pub epsilon_union: f64,
    /// Largest distance from a point of the union's boundary to the surface.
    pub reverse: f64,
    /// `max(epsilon_union, reverse)`.
    pub hausdorff: f64,
    /// Mean over the area-uniform surface samples of the absolute signed distance to the union.
    pub mean: f64,
    /// Root mean square of the same.
    pub rms: f64,
    /// 95th percentile of the same.
    pub p95: f64,
    /// 99th percentile of the same.
    pub p99: f64,
    /// Mean distance from the boundary of the union to the surface, by area.
    pub reverse_mean: f64,
    /// `epsilon_union` with the spheres alone, without cones and slabs.
    pub spheres_only: f64,
    /// Number of surface samples, the mesh vertices included.
    pub samples: usize,
    /// Number of samples on the boundary of the union, which no primitive buries. If it is small,
    /// nearly all of the primitives' area is buried, and `reverse` rests on few samples.
    pub reverse_samples: usize,
}

/// Angles of the medial triangles, in degrees: Table I of the Q-MAT paper and two further shares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TriangleQuality {
    /// Mean over the triangles of the smallest angle.
    pub min_angle_mean: Option<f64>,
    /// Mean over the triangles of the largest angle.
    pub max_angle_mean: Option<f64>,
    /// Share of the triangles with a smallest angle below 30 degrees.
    pub below_30: Option<f64>,
    /// The same below 10 degrees.
    pub below_10: Option<f64>,
    /// The same below 1 degree.
    pub below_1: Option<f64>,
    /// Triangles with a height below 1e-12, which are counted here only and enter no mean or share.
    pub zero_area: u64,
}

/// Spike measures. No paper defines them; METHODOLOGY.md does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spikes {
    /// For each threshold on the stability ratio: shares and counts.
    pub by_ratio: Vec<RatioSpikes>,
    /// Edges without a face that end in a sphere with no other edge.
    pub dangling_edges: u64,
    /// Faces with two or three boundary edges and a smallest angle below 10 degrees.
    pub fins: u64,
    /// Boundary spheres whose ball protrudes by less than 0.001 from the ball of a neighbour at least
    /// as large.
    pub idle_spheres: u64,
    /// Spheres with a separation angle below 20 degrees, where contact points are known.
    pub angle_spikes: Option<u64>,
}

/// Spike measures for one threshold on the stability ratio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RatioSpikes {
    /// The threshold on the stability ratio of an edge.
    pub threshold: f64,
    /// Share of the edges below the threshold.
    pub edge_share: f64,
    /// Share of the total edge length below the threshold.
    pub length_share: f64,
    /// Connected components of the edges below the threshold that reach the boundary of the mesh.
    pub spikes: u64,
    /// Dangling edges below the threshold.
    pub dangling_edges: u64,
}

/// Sizes of a medial mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Spheres.
    pub spheres: u64,
    /// Edges.
    pub edges: u64,
    /// Faces.
    pub faces: u64,
    /// Edges without a face.
    pub lone_edges: u64,
    /// Spheres without an edge.
    pub isolated: u64,
    /// Edges with three faces or more.
    pub nonmanifold_edges: u64,
}

impl Counts {
    /// Floats that are stored: four for each sphere.
    pub fn numbers(&self) -> u64 {
        4 * self.spheres
    }

    /// Bytes in the plainest binary form: 8 for each float, 4 for each index; three indices for each
    /// face, two for each edge without one, since the sides of faces need not be stored.
    pub fn bytes(&self) -> u64 {
        8 * self.numbers() + 4 * (3 * self.faces + 2 * self.lone_edges)
    }
}

/// Distances between a computed medial axis and the true one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisDistances {
    /// As sets of points in space.
    #[serde(flatten)]
    pub in_space: AxisSpan,
    /// As sets of points with radii, in four-dimensional space.
    pub with_radius: AxisSpan,
    /// For each sheet of the true axis how much of it the computed axis covers; the largest sheet
    /// first.
    pub coverage: Vec<SheetCoverage>,
}

/// Distances between two axes, both ways.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisSpan {
    /// Largest distance from the computed axis to the true one.
    pub computed_to_true_max: f64,
    /// Mean of the same.
    pub computed_to_true_mean: f64,
    /// Largest distance from the true axis to the computed one.
    pub true_to_computed_max: f64,
    /// Mean of the same.
    pub true_to_computed_mean: f64,
}

/// How much of one sheet of the true axis is covered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SheetCoverage {
    /// Area of the sheet.
    pub area: f64,
    /// Share of it that is covered; `None` where no sample fell on it.
    pub covered: Option<f64>,
}
