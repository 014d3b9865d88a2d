//! The record of everything measured on one medial mesh: the `evaluate` object of the command.
//!
//! All lengths are fractions of the input's bounding-box diagonal. METHODOLOGY.md defines each number; the other
//! modules compute them.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::Vec3;

/// Everything measured on one medial mesh against one surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Distances between the surface and the union of spheres, cones and slabs.
    #[serde(flatten)]
    pub distances: Distances,
    /// An interval that contains the Hausdorff distance, if it was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certified: Option<Certificate>,
    /// One-sided errors: of spheres without edges, and of every medial mesh with a certificate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cover: Option<Cover>,
    /// Volume of the symmetric difference of solid and union, over the solid's volume.
    pub volume_error: Option<f64>,
    /// Volume of the union over the solid's volume.
    #[serde(default)]
    pub volume_ratio: Option<f64>,
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
    /// Sheets, seams and features.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub structure: Option<Structure>,
    /// Bounding-box diagonal of the input, in the input's units.
    pub diagonal: f64,
    /// Seed of every random sample.
    pub seed: u64,
    /// Remarks for the reader, such as radii that do not fit the mesh.
    pub warnings: Vec<String>,
}

impl Evaluation {
    /// Whether the Betti numbers are the solid's; `None` if these are unknown, or of spheres without edges, which have no
    /// connectivity.
    pub fn has_right_topology(&self) -> Option<bool> {
        let is_connected = self.counts.spheres == 1 || self.counts.edges > 0;
        self.expected_betti.filter(|_| is_connected).map(|expected| self.betti == expected)
    }

    /// Maps the witnesses of all intervals, as to the units of the input.
    pub fn move_witnesses(&mut self, map: impl Fn(Vec3) -> Vec3) {
        if let Some(certified) = &mut self.certified {
            certified.witness.point = map(certified.witness.point);
        }
        if let Some(cover) = &mut self.cover {
            cover.uncovered.witness = cover.uncovered.witness.map(&map);
            cover.overshoot.witness = cover.overshoot.witness.map(&map);
        }
    }
}

/// One-sided errors against a solid, as fractions of the diagonal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cover {
    /// Largest distance from a point of the solid, boundary and interior, to the union.
    pub uncovered: OneSided,
    /// Largest distance from a point of the union to the solid.
    pub overshoot: OneSided,
    /// Distances to the union over the area of the surface; covered points count as 0.
    pub uncovered_over_surface: MeanAndP95,
    /// Distances to the solid over the boundary of the union; points in the solid count as 0.
    pub overshoot_over_boundary: MeanAndP95,
}

/// Mean and 95th percentile of sampled distances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanAndP95 {
    /// The mean.
    pub mean: f64,
    /// The 95th percentile.
    pub p95: f64,
}

impl MeanAndP95 {
    /// Of signed distances, where negative ones count as 0; 0 of none.
    pub(super) fn of(mut signed: Vec<f64>) -> Self {
        signed.iter_mut().for_each(|distance| *distance = distance.max(0.0));
        signed.sort_unstable_by(f64::total_cmp);
        let Some(last) = signed.len().checked_sub(1) else { return Self::default() };
        let mean = signed.iter().sum::<f64>() / signed.len() as f64;
        Self { mean, p95: signed[(0.95 * last as f64) as usize] }
    }
}

/// Distances between the surface S and the boundary of the union U of the medial primitives.
///
/// Maxima are over samples, the points that are reached from the largest of them by local ascent, and those
/// where a sweep of both surfaces finds a larger `hausdorff`: distances at actual points, and so lower bounds
/// of the true maxima.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Largest distance from a point of S to the nearest primitive's surface, buried or not:
    /// the reading of the Q-MAT paper.
    pub epsilon: f64,
    /// Largest distance from a point of S to the union's boundary.
    pub epsilon_union: f64,
    /// Largest distance from a point of the union's boundary to the surface.
    pub reverse: f64,
    /// `max(epsilon_union, reverse)`.
    pub hausdorff: f64,
    /// Mean over the area-uniform surface samples of the distance to the union's boundary.
    pub mean: f64,
    /// Root mean square of the same.
    pub rms: f64,
    /// 95th percentile of the same.
    pub p95: f64,
    /// 99th percentile of the same.
    pub p99: f64,
    /// Mean distance from the boundary of the union to the surface, by area.
    pub reverse_mean: f64,
    /// Largest absolute signed distance from a point of S to the spheres alone, without cones and slabs.
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

/// Distances between a computed medial axis and the true one, as sets of points in space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisDistances {
    /// Largest distance from the computed axis to the true one.
    pub computed_to_true_max: f64,
    /// Mean of the same.
    pub computed_to_true_mean: f64,
    /// Largest distance from the true axis to the computed one.
    pub true_to_computed_max: f64,
    /// Mean of the same.
    pub true_to_computed_mean: f64,
    /// Half the sum of the mean squared distances both ways, in squared diagonals; against a reference only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chamfer: Option<f64>,
}

/// An interval that holds the Hausdorff distance between a surface and the boundary of a union.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// A lower bound: the distance at the witness, less the bound on rounding.
    pub lower: f64,
    /// An upper bound.
    pub upper: f64,
    /// The requested bound on `upper - lower`.
    pub tolerance: f64,
    /// Number of pieces that were evaluated.
    pub pieces: u64,
    /// A point at which the distance is `lower`, up to rounding.
    pub witness: Witness,
}

/// A point on one of the two surfaces, by which the lower end of an interval can be checked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Witness {
    /// Where it is.
    pub point: Vec3,
    /// The surface that it is on.
    pub on: WitnessSide,
}

/// The surface that a [`Witness`] is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WitnessSide {
    /// The surface, where `|sigma|` is the distance.
    Surface,
    /// The boundary of the union, whose distance to the surface it is.
    Union,
}

/// An interval that holds the largest of some distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneSided {
    /// A lower bound: the distance at the witness, less the bound on rounding.
    pub lower: f64,
    /// An upper bound; 0 if it is proven that there is no such distance.
    pub upper: f64,
    /// A point at which the distance is `lower`, up to rounding; absent if `lower` is 0.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub witness: Option<Vec3>,
}

/// The structure of a medial mesh: JSON key `structure`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Structure {
    /// Sizes of the sheet graph.
    pub graph: GraphSizes,
    /// Contacts at samples.
    pub contacts: ContactTable,
    /// How central samples are.
    pub centrality: Centrality,
    /// Sharp edges and corners that are reached.
    pub features: Features,
    /// Medial balls that are found.
    pub completeness: Completeness,
    /// Parts outside of the solid.
    pub outside: Outside,
    /// Sheets against those of the known axis, or of a reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known: Option<SheetDifference>,
}

/// Sizes of a sheet graph.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphSizes {
    /// Number of sheets.
    pub sheets: u64,
    /// Their total area.
    pub sheet_area: f64,
    /// Number of pieces that are too narrow to be sheets.
    pub small_pieces: u64,
    /// Their area.
    pub small_area: f64,
    /// Closed pockets: the second Betti number beyond the cavities of the solid.
    pub pockets: u64,
    /// Number of seams.
    pub seams: u64,
    /// Their total length.
    pub seam_length: f64,
    /// Share of that length where exactly three sheets meet.
    pub seams_of_three: Option<f64>,
    /// Number of curves.
    pub curves: u64,
    /// Number of junctions.
    pub junctions: u64,
}

impl fmt::Display for GraphSizes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sheets, seams, junctions, curves, pockets, small_pieces, .. } = self;
        write!(f, "sheets {sheets}, seams {seams}, junctions {junctions}, curves {curves}")?;
        let area =
            100.0 * self.small_area / (self.small_area + self.sheet_area).max(f64::MIN_POSITIVE);
        write!(f, "; small pieces {small_pieces} ({area:.1} % of the area), pockets {pockets}")
    }
}

/// The contacts at a point inside a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactType {
    /// One, or the point is on the surface.
    Boundary,
    /// Two.
    Sheet,
    /// Three.
    Seam,
    /// Four or more.
    Junction,
    /// One or more, of which one surrounds the point.
    Curve,
    /// The point is outside of the solid.
    Outside,
}

/// How many samples of each part of a medial mesh have which contacts, in the order of [`ContactType`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactTable {
    /// Where sheets end.
    pub boundary: [u32; 6],
    /// On sheets.
    pub sheet: [u32; 6],
    /// On seams.
    pub seam: [u32; 6],
    /// At junctions.
    pub junction: [u32; 6],
    /// On curves.
    pub curve: [u32; 6],
}

impl ContactTable {
    /// Share of the samples with the contacts of their part.
    pub fn right(&self) -> Option<f64> {
        let rows = [self.boundary, self.sheet, self.seam, self.junction, self.curve];
        let right: u32 = (0..5).map(|k| rows[k][k]).sum();
        // Curves meet sheets in points that are surrounded.
        let right = right + self.junction[ContactType::Curve as usize];
        share(right, rows.as_flattened().iter().sum())
    }

    /// The same of seams alone.
    pub fn seams_right(&self) -> Option<f64> {
        share(self.seam[ContactType::Seam as usize], self.seam.iter().sum())
    }
}

/// How central samples of sheets and curves are; absent where there are none inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Centrality {
    /// 95th percentile of the difference of the distances to the two contacts.
    pub p95: Option<f64>,
}

/// Sharp features of the surface, and the shares of them that the medial mesh reaches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Features {
    /// Share of the length of the sharp convex edges that is reached.
    pub convex_reached: Option<f64>,
    /// Share of the length of the sharp concave edges that is reached, which is an error.
    pub concave_reached: Option<f64>,
}

/// Distances from the medial balls of surface points to the medial mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Completeness {
    /// Share of the centres within [`REACHED`](super::REACHED).
    pub found: Option<f64>,
    /// 95th percentile of the distances.
    pub p95: Option<f64>,
}

/// Parts of a medial mesh outside of the solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outside {
    /// Edges that leave the solid.
    pub edges: u64,
    /// Their length outside.
    pub length: f64,
    /// Faces that leave the solid.
    pub faces: u64,
    /// Their area outside.
    pub area: f64,
    /// Largest distance from the surface of a point outside.
    pub deepest: f64,
}

/// A part of a whole, if there is a whole.
pub(super) fn share(part: u32, all: u32) -> Option<f64> {
    (all > 0).then(|| f64::from(part) / f64::from(all))
}

/// Sheets of two medial meshes of one solid, matched where most of each is nearest to the other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SheetDifference {
    /// Number of pairs of matched sheets.
    pub matched: usize,
    /// Number of sheets of the first mesh without a partner.
    pub spurious: usize,
    /// Number of sheets of the second mesh without a partner.
    pub missing: usize,
    /// Share of the first mesh's sheet area that is spurious.
    pub spurious_share: Option<f64>,
    /// Share of the second mesh's sheet area that is missing.
    pub missing_share: Option<f64>,
}
