//! The structure of a medial mesh, measured without labels: its sheet graph, and how far each part is where the
//! surface wants it.
//!
//! 1. *Graph*: sheets, seams, curves and junctions ([`SheetGraph`]).
//! 2. *Contacts* of a point: the connected parts of the surface within `(1 + CONTACT)` times its distance. One makes it a
//!    point of a boundary, two of a sheet, three of a seam, more of a junction; one that surrounds it, of a curve (P. Giblin,
//!    B. Kimia 2004, *A formal classification of 3D medial axis points and their local geometry*,
//!    <https://doi.org/10.1109/TPAMI.2004.1262192>).
//! 3. *Centrality* of a point: the ball that touches the surface where it is closest to the point is shrunk to a medial one.
//!    The distances to the two contacts differ by 0 on the axis.
//! 4. *Features*: points of sharp convex edges that the boundary of the medial mesh reaches with small radii; concave
//!    edges, which it must not reach.
//! 5. *Completeness*: distance from the medial balls of surface points ([`shrinking_ball`]) to the medial mesh.
//! 6. *Outside*: edges and faces that leave the solid.
//!
//! METHODOLOGY.md defines the numbers. All lengths are fractions of the surface's diagonal.

use std::sync::Arc;

use rayon::prelude::*;

use super::axis_distance::{PreparedAxis, sample_segments};
use super::error::MetricError;
use super::evaluation::{
    Centrality, Completeness, ContactTable, ContactType, Features, GraphSizes, Outside,
    SheetDifference, Structure, share,
};
use super::hausdorff::Summary;
use super::samples::place_on_triangles;
use crate::Vec3;
use crate::complex::{Incidence, MedialMesh, SheetGraph, SheetOptions};
use crate::geometry::DisjointSets;
use crate::geometry::trees::in_morton_order;
use crate::surface::{
    End, InsideTest, Side, Touched, TriMesh, TriangleBvh, sharp_edges, shrinking_ball,
    smooth_normals,
};

/// Excess over the least distance, as a share of it, up to which the surface touches a ball. So two planes count as one
/// contact if they turn by less than 28 degrees.
pub const CONTACT: f64 = 0.03;

/// Distance within which a feature is reached and a medial ball is found, as a fraction of the diagonal.
pub const REACHED: f64 = 0.01;

/// Angle, in degrees, by which the surface turns at a sharp edge.
pub const SHARP_ANGLE: f64 = 30.0;

/// Depth below which a point counts as one of the surface, as a fraction of the diagonal.
const ON_SURFACE: f64 = 1e-3;

/// Distance from the solid below which a point is outside by rounding, as a fraction of the diagonal.
const ROUNDING: f64 = 1e-6;

/// Number of samples of sheets.
const SHEET_SAMPLES: usize = 600;

/// Number of samples of seams, of boundaries and of curves. Limit of junctions.
const CURVE_SAMPLES: usize = 200;

/// Number of surface points whose medial balls are sought.
const SURFACE_SAMPLES: usize = 1_000;

/// Spacing of the samples along sharp edges, as a fraction of the diagonal.
const FEATURE_SPACING: f64 = 0.005;

/// Limit of samples along sharp edges.
const FEATURE_SAMPLES: f64 = 4_000.0;

/// Spacing of the samples that look for parts outside, as a fraction of the diagonal.
const OUTSIDE_SPACING: f64 = 0.02;

/// Limit of these samples along a side.
const OUTSIDE_SIDE: f64 = 16.0;

/// Approximate limit of all of these samples.
const OUTSIDE_SAMPLES: f64 = 2e5;

/// What the structure of all medial meshes is measured against: one surface.
pub struct StructureSurface {
    tree: Arc<TriangleBvh>,
    inside: Arc<InsideTest>,
    /// For each face those across its sides, and the corners.
    around: Vec<[u32; 3]>,
    corners: Vec<[Vec3; 3]>,
    /// Samples along convex and along concave sharp edges.
    edges: [Vec<Vec3>; 2],
    /// Centres of the medial balls of surface points.
    balls: Vec<Vec3>,
}

impl StructureSurface {
    /// Prepares a closed surface with its tree, its inside test, and area-uniform points of it. `O(n log n)`.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(
        surface: &TriMesh,
        tree: Arc<TriangleBvh>,
        inside: Arc<InsideTest>,
        points: &[Vec3],
    ) -> Self {
        let corners: Vec<_> = (0..surface.faces.len()).map(|f| surface.triangle(f)).collect();
        let flat: Vec<Vec3> =
            corners.iter().map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero()).collect();
        let smooth = SHARP_ANGLE.to_radians().cos();
        let sharp = sharp_edges(surface, &flat, smooth);
        let place = |v: u32| surface.vertices[v as usize];
        let edges = [true, false].map(|convex| {
            let chosen = sharp.iter().filter(|edge| edge.convex == convex);
            let segments: Vec<_> = chosen.map(|e| e.vertices.map(place)).collect();
            let length = segments.iter().map(|[a, b]| a.distance(*b)).sum::<f64>();
            let count = (length / FEATURE_SPACING).clamp(1.0, FEATURE_SAMPLES);
            sample_segments(&segments, count as usize)
        });
        let normals = smooth_normals(surface, &flat, smooth);
        let stride = points.len().div_ceil(SURFACE_SAMPLES).max(1);
        let ball = |&p: &Vec3| {
            let on = tree.closest(p);
            let weights = weights(on.point, &corners[on.face as usize]);
            let normals = normals(on.face as usize);
            let normal = (0..3).map(|k| weights[k] * normals[k]).sum::<Vec3>().try_normalize()?;
            let ball = shrinking_ball(on.point, normal, 0.5, Touched::Mesh(&tree));
            let is_medial = ball.steps > 0 && ball.end != End::InFront;
            (is_medial && ball.sphere.radius > ON_SURFACE).then_some(ball.sphere.centre)
        };
        let chosen: Vec<Vec3> = points.iter().step_by(stride).copied().collect();
        let balls = chosen.par_iter().filter_map(ball).collect();
        Self { around: around(&surface.faces), tree, inside, corners, edges, balls }
    }

    /// The contacts at a point: see the head of this module. Cost that of the faces within reach.
    pub fn contacts(&self, p: Vec3) -> ContactType {
        let distance = self.tree.closest(p).distance;
        if distance < ON_SURFACE {
            return ContactType::Boundary;
        }
        if self.inside.side(p) != Side::Inside {
            return ContactType::Outside;
        }
        let limit = (1.0 + CONTACT) * distance;
        let mut near: Vec<(u32, Vec3)> = Vec::new();
        self.tree.each_within(p, limit, |face, point| near.push((face, point - p)));
        near.sort_unstable_by_key(|&(face, _)| face);
        let mut parts = DisjointSets::singletons(near.len());
        for (k, &(face, _)) in (0..).zip(&near) {
            for (side, &other) in self.around[face as usize].iter().enumerate() {
                let Ok(at) = near.binary_search_by_key(&other, |&(face, _)| face) else { continue };
                let corners = &self.corners[face as usize];
                let (a, b) = (corners[side], corners[(side + 1) % 3]);
                if other > face && distance_to_segment(p, a, b) <= limit {
                    parts.join(k, at as u32);
                }
            }
        }
        let mut ways: Vec<(u32, Vec3)> =
            (0..).zip(&near).map(|(k, (_, to))| (parts.find(k), to.normalize_or_zero())).collect();
        ways.sort_by_key(|way| way.0);
        match parts.len() {
            _ if ways.chunk_by(|a, b| a.0 == b.0).any(surrounds) => ContactType::Curve,
            1 => ContactType::Boundary,
            2 => ContactType::Sheet,
            3 => ContactType::Seam,
            _ => ContactType::Junction,
        }
    }

    /// The difference of the distances to two contacts; `None` of a point that is not inside.
    fn central(&self, p: Vec3) -> Option<f64> {
        let closest = self.tree.closest(p);
        if closest.distance < ON_SURFACE || self.inside.side(p) != Side::Inside {
            return None;
        }
        let outward = (closest.point - p) / closest.distance;
        let contact =
            shrinking_ball(closest.point, outward, 0.5, Touched::Mesh(&self.tree)).contact?;
        Some((contact.distance(p) - closest.distance).abs())
    }

    /// The structure of a medial mesh in normalised units; `pockets` is its second Betti number beyond the cavities.
    /// The samples follow the order of its spheres.
    pub(super) fn measure(
        &self,
        mesh: &MedialMesh,
        axis: &PreparedAxis,
        pockets: u64,
        known: Option<&MedialMesh>,
    ) -> Structure {
        let graph = SheetGraph::new(mesh, SheetOptions::default());
        let ((contacts, centrality), outside) =
            rayon::join(|| self.at_samples(mesh, &graph), || self.outside(mesh));
        Structure {
            contacts,
            centrality,
            outside,
            features: self.features(mesh),
            completeness: self.completeness(axis),
            known: known.and_then(|known| sheet_difference(mesh, known).ok()),
            graph: sizes(&graph, pockets),
        }
    }

    fn at_samples(&self, mesh: &MedialMesh, graph: &SheetGraph) -> (ContactTable, Centrality) {
        let on_sheets = mesh.faces.iter().zip(&graph.sheet_of_face).filter(|(_, s)| s.is_some());
        let triangles: Vec<[Vec3; 3]> =
            on_sheets.map(|(&face, _)| mesh.spheres_of(face).map(|s| s.centre)).collect();
        let placed = place_on_triangles(&triangles, SHEET_SAMPLES, 0).unwrap_or_default();
        let sheet: Vec<Vec3> = placed.into_iter().map(|(_, point)| point).collect();
        let along = |edges: &mut dyn Iterator<Item = [u32; 2]>| -> Vec<Vec3> {
            let segments: Vec<_> =
                edges.map(|edge| mesh.spheres_of(edge).map(|s| s.centre)).collect();
            sample_segments(&segments, CURVE_SAMPLES)
        };
        let seam = along(&mut graph.seams.iter().flat_map(|seam| seam.edges.iter().copied()));
        let curve = along(&mut graph.curves.iter().flat_map(|curve| curve.edges.iter().copied()));
        let boundary = along(&mut graph.boundary.iter().copied());
        let stride = graph.junctions.len().div_ceil(CURVE_SAMPLES).max(1);
        let junctions = graph.junctions.iter().step_by(stride);
        let junction: Vec<Vec3> = junctions.map(|&v| mesh.spheres[v as usize].centre).collect();
        let rows = [&boundary, &sheet, &seam, &junction, &curve].map(|points| {
            let mut row = [0; 6];
            let types: Vec<_> = points.par_iter().map(|&p| self.contacts(p)).collect();
            types.into_iter().for_each(|found| row[found as usize] += 1);
            row
        });
        let [boundary, sheet_row, seam, junction, curve_row] = rows;
        let table = ContactTable { boundary, sheet: sheet_row, seam, junction, curve: curve_row };
        let samples = [sheet, curve].concat();
        let differences: Vec<f64> = samples.par_iter().filter_map(|&p| self.central(p)).collect();
        (table, Centrality { p95: p95(&differences) })
    }

    fn features(&self, mesh: &MedialMesh) -> Features {
        let reach = thin_boundary(mesh);
        let reached = |points: &[Vec3]| {
            let near = |p: Vec3| reach.as_ref().is_some_and(|tree| tree.any_within(p, REACHED));
            let near = in_morton_order(points, |(): &mut (), p| near(p));
            share(near.iter().filter(|&&near| near).count() as u32, near.len() as u32)
        };
        let [convex_reached, concave_reached] = self.edges.each_ref().map(|points| reached(points));
        Features { convex_reached, concave_reached }
    }

    fn completeness(&self, axis: &PreparedAxis) -> Completeness {
        let distances = axis.tree.distance_batch(&self.balls);
        let found = distances.iter().filter(|&&distance| distance <= REACHED).count() as u32;
        Completeness { found: share(found, distances.len() as u32), p95: p95(&distances) }
    }

    /// By samples of every edge and face. A sample within the clearance of a sphere of the same simplex is inside.
    fn outside(&self, mesh: &MedialMesh) -> Outside {
        let centres: Vec<Vec3> = mesh.spheres.iter().map(|s| s.centre).collect();
        let clearance: Vec<f64> = (self.inside.sides(&centres).into_iter())
            .zip(self.tree.distance_batch(&centres))
            .map(|(side, distance)| if side == Side::Inside { distance } else { -distance })
            .collect();
        let depth = |p: Vec3, of: &[u32]| {
            let covers = |&v: &u32| p.distance(centres[v as usize]) < clearance[v as usize];
            if of.iter().any(covers) || self.inside.side(p) == Side::Inside {
                return 0.0;
            }
            self.tree.closest(p).distance
        };
        let longest = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| centres[v as usize]);
            a.distance(b).max(b.distance(c)).max(c.distance(a))
        };
        let sides = |length: f64, spacing: f64| (length / spacing).ceil().clamp(2.0, OUTSIDE_SIDE);
        let longest: Vec<f64> = mesh.faces.iter().map(longest).collect();
        let mut spacing = OUTSIDE_SPACING;
        while spacing < 1.0
            && longest.iter().map(|&l| sides(l, spacing).powi(2)).sum::<f64>() > OUTSIDE_SAMPLES
        {
            spacing *= 2.0;
        }
        // For each simplex its samples, how many are outside, and the deepest.
        let count = |depths: &mut dyn Iterator<Item = f64>| {
            let (mut all, mut out, mut deepest) = (0.0, 0.0, 0.0_f64);
            for depth in depths {
                all += 1.0;
                out += f64::from(u8::from(depth > ROUNDING));
                deepest = deepest.max(depth);
            }
            (out / all, if deepest > ROUNDING { deepest } else { 0.0 })
        };
        let edges: Vec<(f64, f64)> = (mesh.edges.par_iter())
            .map(|edge| {
                let [a, b] = edge.map(|v| centres[v as usize]);
                let (length, n) = (a.distance(b), sides(a.distance(b), spacing / 2.0));
                let at = |k: u32| a.lerp(b, (f64::from(k) + 0.5) / n);
                let (share, deepest) = count(&mut (0..n as u32).map(|k| depth(at(k), edge)));
                (share * length, deepest)
            })
            .collect();
        let faces: Vec<(f64, f64)> = (mesh.faces.par_iter().zip(&longest))
            .map(|(face, &longest)| {
                let [a, b, c] = face.map(|v| centres[v as usize]);
                let n = sides(longest, spacing) as u32;
                // The centroids of n * n equal triangles.
                let cells = (0..n).flat_map(|i| (0..2 * (n - i) - 1).map(move |j| (i, j)));
                let at = |(i, j): (u32, u32)| {
                    let third = f64::from(1 + j % 2) / 3.0;
                    let (s, t) = (f64::from(i) + third, f64::from(j / 2) + third);
                    a + (s * (b - a) + t * (c - a)) / f64::from(n)
                };
                let (share, deepest) = count(&mut cells.map(|cell| depth(at(cell), face)));
                (share * (b - a).cross(c - a).length() / 2.0, deepest)
            })
            .collect();
        let leaves =
            |all: &[(f64, f64)]| all.iter().filter(|&&(_, deepest)| deepest > 0.0).count() as u64;
        let deepest = edges.iter().chain(&faces).map(|&(_, deepest)| deepest);
        Outside {
            edges: leaves(&edges),
            length: edges.iter().map(|&(length, _)| length).sum::<f64>() + 0.0,
            faces: leaves(&faces),
            area: faces.iter().map(|&(area, _)| area).sum::<f64>() + 0.0,
            deepest: deepest.fold(0.0, f64::max),
        }
    }
}

fn sizes(graph: &SheetGraph, pockets: u64) -> GraphSizes {
    let seam_length: f64 = graph.seams.iter().map(|seam| seam.length).sum();
    let of_three = graph.seams.iter().filter(|seam| seam.sheets.len() == 3);
    let of_three: f64 = of_three.map(|seam| seam.length).sum();
    let positive = |sum: f64| sum + 0.0; // an empty sum is -0.0
    GraphSizes {
        sheets: graph.areas.len() as u64,
        sheet_area: positive(graph.areas.iter().sum()),
        small_pieces: graph.small_pieces,
        small_area: graph.small_area,
        pockets,
        seams: graph.seams.len() as u64,
        seam_length: positive(seam_length),
        seams_of_three: (seam_length > 0.0).then(|| of_three / seam_length),
        curves: graph.curves.len() as u64,
        junctions: graph.junctions.len() as u64,
    }
}

/// The parts of boundary edges, lone edges and isolated spheres where the radius is below [`REACHED`].
fn thin_boundary(mesh: &MedialMesh) -> Option<TriangleBvh> {
    let incidence = Incidence::of(mesh);
    let ends = mesh.edges.iter().zip(incidence.faces_at()).filter(|&(_, &faces)| faces <= 1);
    let mut thin: Vec<[Vec3; 3]> = Vec::new();
    for (&edge, _) in ends {
        let [a, b] = mesh.spheres_of(edge);
        let (low, high) = if a.radius <= b.radius { (a, b) } else { (b, a) };
        if low.radius <= REACHED {
            let rise = high.radius - low.radius;
            let part = if rise > 0.0 { ((REACHED - low.radius) / rise).min(1.0) } else { 1.0 };
            let end = low.centre.lerp(high.centre, part);
            thin.push([low.centre, end, end]);
        }
    }
    let isolated = mesh.isolated().into_iter().map(|v| mesh.spheres[v as usize]);
    thin.extend(isolated.filter(|s| s.radius <= REACHED).map(|s| [s.centre; 3]));
    TriangleBvh::from_triangles(&thin).ok()
}

/// For each face the faces across its sides from corner `k` to `k + 1`; itself where there is none.
fn around(faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut sides: Vec<([u32; 2], u32)> = (0..)
        .zip(faces.as_flattened())
        .map(|(side, &a)| {
            let b = faces[side as usize / 3][(side as usize + 1) % 3];
            ([a.min(b), a.max(b)], side)
        })
        .collect();
    sides.par_sort_unstable();
    let mut around: Vec<[u32; 3]> = (0..faces.len() as u32).map(|face| [face; 3]).collect();
    for pair in sides.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let [a, b] = [pair[0].1, pair[1].1];
        around[a as usize / 3][a as usize % 3] = b / 3;
        around[b as usize / 3][b as usize % 3] = a / 3;
    }
    around
}

/// Weights of the corners of a triangle, a segment or a point for a point on it.
fn weights(p: Vec3, &[a, b, c]: &[Vec3; 3]) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let squared = normal.length_squared();
    if squared > 1e-30 * (b - a).length_squared() * (c - a).length_squared() {
        let v = (p - a).cross(c - a).dot(normal) / squared;
        let w = (b - a).cross(p - a).dot(normal) / squared;
        return [1.0 - v - w, v, w];
    }
    // The longer of two sides holds the whole segment, if the third corner repeats another.
    let along = |to: Vec3| (p - a).dot(to - a) / (to - a).length_squared().max(f64::MIN_POSITIVE);
    let (v, w) = (along(b), along(c));
    if a.distance_squared(b) >= a.distance_squared(c) {
        [1.0 - v, v, 0.0]
    } else {
        [1.0 - w, 0.0, w]
    }
}

fn distance_to_segment(p: Vec3, a: Vec3, b: Vec3) -> f64 {
    let along = b - a;
    let squared = along.length_squared();
    let t = if squared > 0.0 { ((p - a).dot(along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + t * along)
}

fn p95(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| Summary::new(values).p95)
}

// Sheets of two medial meshes against each other.

/// Number of samples of each medial mesh.
const MATCH_SAMPLES: usize = 4_000;

/// Matches the sheets of a medial mesh to those of a reference, both in units of the solid's diagonal.
///
/// Samples of each sheet look for the nearest point of the other mesh, within [`REACHED`]. Two sheets match if each has more
/// than half of its samples at the other.
///
/// # Errors
/// When a mesh is empty or not valid.
pub(super) fn sheet_difference(
    mesh: &MedialMesh,
    reference: &MedialMesh,
) -> Result<SheetDifference, MetricError> {
    let sides = [mesh, reference]
        .map(|mesh| Ok((PreparedAxis::new(mesh)?, SheetGraph::new(mesh, SheetOptions::default()))));
    let [first, second]: [Result<_, MetricError>; 2] = sides;
    let (first, second) = (first?, second?);
    let there = partners(&first, &second);
    let back = partners(&second, &first);
    let (areas, known) = (&first.1.areas, &second.1.areas);
    // Areas of the sheets without a partner that has them as its own.
    let unmatched = |own: &[Option<u32>], others: &[Option<u32>], areas: &[f64]| -> Vec<f64> {
        let is_matched = |&sheet: &usize| {
            own[sheet].is_some_and(|other| others[other as usize] == Some(sheet as u32))
        };
        (0..areas.len()).filter(|sheet| !is_matched(sheet)).map(|sheet| areas[sheet]).collect()
    };
    let spurious = unmatched(&there, &back, areas);
    let missing = unmatched(&back, &there, known);
    let share = |part: &[f64], all: &[f64]| {
        let all: f64 = all.iter().sum();
        (all > 0.0).then(|| (part.iter().sum::<f64>() + 0.0) / all)
    };
    Ok(SheetDifference {
        spurious_share: share(&spurious, areas),
        missing_share: share(&missing, known),
        matched: known.len() - missing.len(),
        spurious: spurious.len(),
        missing: missing.len(),
    })
}

/// For each sheet of a mesh the sheet of another that is nearest to more than half of it.
fn partners(
    (axis, graph): &(PreparedAxis, SheetGraph),
    (other, other_graph): &(PreparedAxis, SheetGraph),
) -> Vec<Option<u32>> {
    let placed = place_on_triangles(&axis.triangles, MATCH_SAMPLES, 0).unwrap_or_default();
    let (faces, points): (Vec<usize>, Vec<Vec3>) = placed.into_iter().unzip();
    let mut found: Vec<Vec<u32>> = vec![Vec::new(); graph.areas.len()];
    for (face, closest) in faces.into_iter().zip(other.tree.closest_batch(&points)) {
        let Some(sheet) = graph.sheet_of_face[face] else { continue };
        // Curves and isolated spheres follow the faces.
        let there = other_graph.sheet_of_face.get(closest.face as usize).copied().flatten();
        found[sheet as usize].push(match there {
            Some(there) if closest.distance <= REACHED => there,
            _ => u32::MAX,
        });
    }
    let best = found.into_iter().map(|mut votes| {
        votes.sort_unstable();
        let most = votes.chunk_by(|a, b| a == b).max_by_key(|run| run.len())?;
        (most[0] != u32::MAX && 2 * most.len() > votes.len()).then_some(most[0])
    });
    best.collect()
}

/// Whether two of the directions to one part of the surface are more than a right angle apart.
fn surrounds(ways: &[(u32, Vec3)]) -> bool {
    // Directions within 45 degrees of one of them are within 90 degrees of each other.
    let is_narrow = ways.iter().all(|way| way.1.dot(ways[0].1) >= std::f64::consts::FRAC_1_SQRT_2);
    let is_opposite =
        |(k, way): (usize, &(u32, Vec3))| ways[..k].iter().any(|w| w.1.dot(way.1) < 0.0);
    !is_narrow && ways.iter().enumerate().any(is_opposite)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::complex::Sphere;
    use crate::metrics::spikes::tests::box_axis;
    use crate::surface::fixtures::cuboid;

    fn half() -> Vec3 {
        Vec3::new(1.5, 1.0, 0.5) / 14f64.sqrt()
    }

    /// The 3 by 2 by 1 box of diagonal 1.
    fn surface() -> StructureSurface {
        let mesh = cuboid(-half(), half());
        let mut random = Pcg64::seed_from_u64(1);
        let side = |k: usize, random: &mut Pcg64| {
            let mut p = Vec3::from([0, 1, 2].map(|k| random.random_range(-1.0..1.0) * half()[k]));
            p[k % 3] = if k < 3 { half()[k % 3] } else { -half()[k % 3] };
            p
        };
        let points: Vec<Vec3> = (0..600).map(|k| side(k % 6, &mut random)).collect();
        let (tree, inside) = (TriangleBvh::new(&mesh).unwrap(), InsideTest::new(&mesh));
        StructureSurface::new(&mesh, Arc::new(tree), Arc::new(inside), &points)
    }

    /// A prism whose wall is an arc of 120 degrees around an axis, and far from it elsewhere.
    #[test]
    fn contacts_do_not_depend_on_the_order_of_faces() {
        let turn = |degrees: f64| (degrees.to_radians().cos(), degrees.to_radians().sin());
        let mut ring: Vec<(f64, f64)> = (0..=24).map(|k| turn(f64::from(k) * 5.0 - 60.0)).collect();
        ring.extend([(-4.0, 3.0), (-4.0, -3.0)]);
        let count = ring.len() as u32;
        let at = |z: f64| ring.iter().map(move |&(x, y)| 0.1 * Vec3::new(x, y, z));
        let vertices = at(-4.0).chain(at(4.0)).collect();
        let mut faces: Vec<[u32; 3]> = Vec::new();
        for a in 0..count {
            let b = (a + 1) % count;
            faces.extend([[a, b, b + count], [a, b + count, a + count]]);
        }
        faces.extend(
            (1..count - 1).flat_map(|k| [[0, k + 1, k], [count, count + k, count + k + 1]]),
        );
        let mut mesh = TriMesh { vertices, faces };
        for turn in 0..mesh.faces.len() {
            mesh.faces.rotate_left(1);
            let (tree, inside) = (TriangleBvh::new(&mesh).unwrap(), InsideTest::new(&mesh));
            let surface = StructureSurface::new(&mesh, Arc::new(tree), Arc::new(inside), &[]);
            assert_eq!(surface.contacts(Vec3::ZERO), ContactType::Curve, "turned by {turn}");
        }
    }

    fn structure(mesh: &MedialMesh) -> Structure {
        surface().measure(mesh, &PreparedAxis::new(mesh).unwrap(), 0, Some(&box_axis()))
    }

    /// The exact axis without one of its faces.
    fn without(face: usize) -> MedialMesh {
        let MedialMesh { spheres, edges, mut faces, .. } = box_axis();
        faces.remove(face);
        let edges = edges
            .into_iter()
            .filter(|edge| faces.iter().any(|face| edge.iter().all(|v| face.contains(v))));
        MedialMesh::from_simplices(spheres, edges.collect(), faces.clone()).unwrap()
    }

    #[test]
    fn the_exact_axis_of_a_box_has_the_structure_of_the_box() {
        let found = structure(&box_axis());
        let graph = &found.graph;
        assert_eq!((graph.sheets, graph.seams, graph.junctions, graph.curves), (13, 12, 4, 0));
        assert_eq!((graph.small_pieces, graph.seams_of_three), (0, Some(1.0)));
        let features = found.features;
        assert_eq!((features.convex_reached, features.concave_reached), (Some(1.0), None));
        assert!(found.completeness.p95.unwrap() < 1e-3, "{:?}", found.completeness);
        assert_eq!(found.completeness.found, Some(1.0));
        assert!(found.centrality.p95.unwrap() < 1e-4);
        assert_eq!(found.outside, Outside::default());
        // Next to a junction a seam has four contacts.
        assert!(found.contacts.seams_right().unwrap() > 0.97);
        assert!(found.contacts.right().unwrap() > 0.9, "{:?}", found.contacts);
        let known = found.known.unwrap();
        assert_eq!((known.matched, known.missing_share), (13, Some(0.0)));
    }

    #[test]
    fn contacts_are_counted_in_closed_form() {
        let (surface, half) = (surface(), half());
        let seam = Vec3::new(half.x - half.z, 0.0, 0.0);
        let junction = Vec3::new(half.x - half.z, half.y - half.z, 0.0);
        assert_eq!(surface.contacts(Vec3::ZERO), ContactType::Sheet);
        assert_eq!(surface.contacts(Vec3::new(0.0, 0.0, 0.05)), ContactType::Boundary);
        assert_eq!(surface.contacts(seam), ContactType::Seam);
        assert_eq!(surface.contacts(junction), ContactType::Junction);
        assert_eq!(surface.contacts(half), ContactType::Boundary);
        assert_eq!(surface.contacts(2.0 * half), ContactType::Outside);
    }

    /// By the planes of the box, away from the margin where two distances differ by about [`CONTACT`].
    #[test]
    fn contacts_agree_with_the_planes_of_a_box() {
        let (surface, half) = (surface(), half());
        let mut random = Pcg64::seed_from_u64(2);
        let mut checked = [0; 6];
        for _ in 0..4_000 {
            let p = Vec3::from([0, 1, 2].map(|k| random.random_range(-1.0..1.0) * half[k]));
            let p = if random.random_bool(0.5) { Vec3::new(p.x, p.y, 0.0) } else { p };
            let depths = [half - p, half + p].map(|d| d.to_array()).concat();
            let least = depths.iter().copied().fold(f64::INFINITY, f64::min);
            let excess: Vec<f64> = depths.iter().map(|depth| depth / least - 1.0).collect();
            if least < 0.01 || excess.iter().any(|e| (e - CONTACT).abs() < 1e-9) {
                continue;
            }
            let planes = excess.iter().filter(|&&e| e < CONTACT).count();
            let expected = [ContactType::Boundary, ContactType::Sheet, ContactType::Seam];
            let expected = expected.get(planes - 1).copied().unwrap_or(ContactType::Junction);
            assert_eq!(surface.contacts(p), expected, "{p}");
            checked[expected as usize] += 1;
        }
        assert!(checked[..3].iter().all(|&count| count > 20), "{checked:?}");
    }

    #[test]
    fn off_the_axis_the_difference_is_twice_the_shift() {
        let surface = surface();
        let difference = surface.central(Vec3::new(0.02, 0.01, 0.013)).unwrap();
        assert!((difference - 0.026).abs() < 1e-9, "{difference}");
        assert!(surface.central(2.0 * half()).is_none());
    }

    #[test]
    fn a_missing_sheet_is_missed_by_the_balls_that_touch_it() {
        // One of the triangles at the box's upright edges.
        let axis = box_axis();
        let upright = axis.faces.iter().position(|face| face == &[0, 4, 8]).unwrap();
        let found = structure(&without(upright));
        let known = found.known.unwrap();
        assert_eq!((known.matched, known.missing, known.spurious), (12, 1, 0));
        assert!(found.completeness.found.unwrap() < 1.0);
        let reached = found.features.convex_reached.unwrap();
        // One of twelve edges, 1 of 24 units long; its ends are near others.
        assert!((0.955..0.968).contains(&reached), "{reached}");
        let back = sheet_difference(&axis, &without(upright)).unwrap();
        assert_eq!((back.matched, back.missing, back.spurious), (12, 0, 1));
    }

    #[test]
    fn parts_outside_are_measured_in_closed_form() {
        let half = half();
        let at = |x: f64, y: f64| Sphere::new(Vec3::new(x, y, 0.0), 0.1);
        let spheres =
            vec![at(0.0, 0.0), at(half.x + 0.2, 0.0), at(half.x + 0.2, 0.1), at(0.0, 0.1)];
        let mesh = MedialMesh::from_simplices(spheres.clone(), vec![[0, 1]], vec![]).unwrap();
        let found = structure(&mesh).outside;
        assert_eq!((found.edges, found.faces), (1, 0));
        assert!((found.length - 0.2).abs() < 0.02 && found.deepest > 0.18, "{found:?}");
        let faces = vec![[0, 1, 2], [0, 2, 3]];
        let found = structure(&MedialMesh::from_simplices(spheres, vec![], faces).unwrap()).outside;
        assert_eq!(found.faces, 2);
        assert!((found.area - 0.02).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn hostile_meshes_have_a_structure() {
        let one = MedialMesh::from_simplices(vec![Sphere::new(Vec3::ZERO, 0.0)], vec![], vec![]);
        let found = structure(&one.unwrap());
        assert_eq!(
            (found.graph.sheets, found.contacts.right(), found.centrality.p95),
            (0, None, None)
        );
        let spheres = vec![Sphere::new(Vec3::ZERO, 0.1); 4];
        let faces = vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
        let same = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
        assert_eq!(structure(&same).graph.sheets, 0);
        let far = vec![Sphere::new(Vec3::splat(1e9), 1.0), Sphere::new(Vec3::splat(-1e9), 0.0)];
        let far = MedialMesh::from_simplices(far, vec![[0, 1]], vec![]).unwrap();
        assert!(structure(&far).outside.length > 0.0);
        assert!(sheet_difference(&MedialMesh::default(), &far).is_err());
    }
}
