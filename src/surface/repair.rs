//! From a polygon soup to an indexed triangle mesh. Nothing is changed without being reported.
//!
//! 1. Set coordinates below 2^-150 of the largest to zero, so that exact predicates stay exact.
//! 2. Weld vertices at exactly the same position. There is no tolerance, because none is right for
//!    every file: it would close intended slits and tear thin walls. Formats that repeat vertices
//!    (STL, OBJ with seams) repeat them bit by bit.
//! 3. Drop corners that repeat their predecessor, then faces with fewer than three corners.
//! 4. Drop faces with the same corners as an earlier one, in any orientation. Two faces that
//!    share all sides with each other and none with a third face stay: they are a component without
//!    volume, which is reported as such.
//! 5. Triangulate polygons.
//! 6. Drop vertices without faces.
//!
//! A surface is a set of points: two bodies that touch in a vertex or along an edge are not
//! manifold there, even if the file gives each its own vertices. Welding brings that to light.

use std::collections::HashMap;

use super::mesh::Unit;
use super::report::{Fault, Repair};
use super::soup::PolygonSoup;
use super::topology::Topology;
use crate::Vec3;
use crate::geometry::predicates::{Point2, Sign, orient2d, project};

/// A triangle mesh with the repairs made. Its faces have distinct corners, but may be defective
/// otherwise.
#[derive(Clone, Debug)]
pub(super) struct Repaired {
    pub vertices: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
    /// For each vertex its index in the file.
    pub file_vertex: Vec<u32>,
    pub topology: Topology,
    pub unit: Unit,
    /// The vertices in scaled units.
    pub points: Vec<Vec3>,
    pub repairs: Vec<Repair>,
    pub warnings: Vec<String>,
}

/// Repairs a soup as far as indices go; orientation comes later.
pub(super) fn repair(soup: &mut PolygonSoup) -> Result<Repaired, Fault> {
    let unit = Unit::of(&soup.vertices);
    let flushed = flush(unit, &mut soup.vertices);
    let welds = weld(&soup.vertices);
    let merged = welds.iter().enumerate().filter(|&(i, &w)| i != w as usize).count();
    let mut repaired = build(soup, unit, &welds, Duplicates::Dropped)?;
    let unreferenced = soup.vertices.len() - repaired.vertices.len() - merged;
    let first = [
        Repair::FlushedCoordinates { coordinates: flushed },
        Repair::WeldedVertices { vertices: merged },
    ];
    let last = Repair::DroppedUnreferencedVertices { vertices: unreferenced };
    let all = first.into_iter().chain(repaired.repairs).chain([last]);
    repaired.repairs = all.filter(|r| r.count() > 0).collect();
    repaired.warnings.splice(0..0, soup.warnings.clone());
    Ok(repaired)
}

/// Sets tiny coordinates to zero, in place; returns how many.
fn flush(unit: Unit, vertices: &mut [Vec3]) -> usize {
    let mut flushed = 0;
    for vertex in vertices {
        let scaled = unit.forward(*vertex);
        for axis in 0..3 {
            if scaled[axis] == 0.0 && vertex[axis] != 0.0 {
                vertex[axis] = 0.0;
                flushed += 1;
            }
        }
    }
    flushed
}

/// For each vertex the first one at the same position.
fn weld(vertices: &[Vec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(vertices.len());
    // Adding zero turns -0 into 0.
    let bits = vertices.iter().map(|v| v.to_array().map(|x| (x + 0.0).to_bits()));
    (0..).zip(bits).map(|(i, bits)| *first.entry(bits).or_insert(i)).collect()
}

/// For each vertex the first one that is not farther away than a distance and stays itself.
pub(super) fn weld_within(vertices: &[Vec3], distance: f64) -> Vec<u32> {
    if distance == 0.0 {
        return weld(vertices);
    }
    // As floating-point numbers, which hold the cells of vertices far from the origin as well as their coordinates do.
    // Adding zero turns -0 into 0.
    let key = |cell: Vec3| cell.to_array().map(|x| (x + 0.0).to_bits());
    let mut kept: HashMap<[u64; 3], Vec<u32>> = HashMap::new();
    let near = |(i, &v): (u32, &Vec3)| {
        let cell = (v / distance).floor();
        let step = |k: i32| f64::from(k % 3 - 1);
        let around = (0..27).map(|k| key(cell + Vec3::new(step(k), step(k / 3), step(k / 9))));
        let candidates = around.filter_map(|cell| kept.get(&cell)).flatten().copied();
        let first = candidates.filter(|&k| vertices[k as usize].distance(v) <= distance).min();
        first.unwrap_or_else(|| {
            kept.entry(key(cell)).or_default().push(i);
            i
        })
    };
    (0..).zip(vertices).map(near).collect()
}

/// Treatment of faces with the same corners as an earlier one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Duplicates {
    Dropped,
    Kept,
}

/// Steps 3 to 6, with vertices replaced by those they are welded to.
pub(super) fn build(
    soup: &PolygonSoup,
    unit: Unit,
    welds: &[u32],
    repeated: Duplicates,
) -> Result<Repaired, Fault> {
    let (polygons, collapsed) = merge_corners(soup, welds);
    let duplicate = match repeated {
        Duplicates::Dropped => duplicates(&polygons),
        Duplicates::Kept => vec![false; polygons.len()],
    };
    let points = unit.forward_all(&soup.vertices);
    let mut faces = Vec::with_capacity(polygons.corners.len().saturating_sub(2 * polygons.len()));
    let mut triangulator = Triangulator::new(polygons.corners.len());
    let (mut cut, mut pieces, mut first_crossing) = (0, 0, None);
    for index in (0..polygons.len()).filter(|&i| !duplicate[i]) {
        let polygon = polygons.polygon(index);
        let (before, crossing) = (faces.len(), triangulator.crossing);
        if triangulator.cut(polygon, &points, &mut faces).is_err() {
            // The number in the file is lost where faces were dropped; the line is not.
            let (at, corners) = (polygons.place(index), polygon.len());
            return Err(Fault::Polygon { at, face: index, corners });
        }
        if triangulator.crossing > crossing {
            first_crossing.get_or_insert(polygons.place(index));
        }
        if polygon.len() > 3 {
            cut += 1;
            pieces += faces.len() - before;
        }
    }
    if faces.is_empty() {
        return Err(Fault::Collapsed { faces: soup.len() });
    }
    let warnings = first_crossing.map(|first| {
        format!(
            "{} polygons cross themselves or are far from planar, the first at {first}",
            triangulator.crossing
        )
    });
    let repairs = vec![
        Repair::DroppedDegenerateFaces { faces: collapsed },
        Repair::DroppedDuplicateFaces { faces: duplicate.iter().filter(|&&d| d).count() },
        Repair::TriangulatedPolygons { polygons: cut, triangles: pieces },
    ];
    let file_vertex = compact(soup.vertices.len(), &mut faces);
    let (vertices, points): (Vec<_>, Vec<_>) =
        file_vertex.iter().map(|&v| (soup.vertices[v as usize], points[v as usize])).unzip();
    let topology = Topology::new(vertices.len(), &faces);
    let warnings = warnings.into_iter().collect();
    Ok(Repaired { vertices, faces, file_vertex, topology, unit, points, repairs, warnings })
}

/// Replaces corners by the vertices they are welded to and drops those that repeat their
/// predecessor; returns the polygons that are left and the number of those that are not.
fn merge_corners(soup: &PolygonSoup, welds: &[u32]) -> (PolygonSoup, usize) {
    let mut merged = PolygonSoup::default();
    merged.corners.reserve(soup.corners.len());
    let mut collapsed = 0;
    for index in 0..soup.len() {
        let start = merged.corners.len();
        for &corner in soup.polygon(index) {
            let corner = welds[corner as usize];
            if merged.corners.len() == start || merged.corners.last() != Some(&corner) {
                merged.corners.push(corner);
            }
        }
        while merged.corners.len() > start + 1
            && merged.corners.last() == Some(&merged.corners[start])
        {
            merged.corners.pop();
        }
        if merged.corners.len() < start + 3 {
            merged.corners.truncate(start);
            collapsed += 1;
            continue;
        }
        merged.ends.push(merged.corners.len() as u32);
        merged.lines.extend(soup.lines.get(index));
    }
    (merged, collapsed)
}

/// For each polygon whether it repeats the corners of an earlier one.
fn duplicates(polygons: &PolygonSoup) -> Vec<bool> {
    let mut sorted = polygons.corners.clone();
    let mut start = 0;
    for &end in &polygons.ends {
        sorted[start..end as usize].sort_unstable();
        start = end as usize;
    }
    let sorted =
        PolygonSoup { corners: sorted, ends: polygons.ends.clone(), ..PolygonSoup::default() };
    let mut order: Vec<u32> = (0..polygons.len() as u32).collect();
    order.sort_unstable_by(|&i, &j| {
        sorted.polygon(i as usize).cmp(sorted.polygon(j as usize)).then(i.cmp(&j))
    });
    let mut duplicate = vec![false; polygons.len()];
    let mut pairs = Vec::new();
    let groups = order.chunk_by(|&i, &j| sorted.polygon(i as usize) == sorted.polygon(j as usize));
    for group in groups.filter(|group| group.len() > 1) {
        group[1..].iter().for_each(|&i| duplicate[i as usize] = true);
        if let &[first, second] = group {
            pairs.push([first, second]);
        }
    }
    if !pairs.is_empty() {
        let sides = sorted_sides(polygons);
        for [first, second] in pairs {
            duplicate[second as usize] = !closes_up(polygons, &sides, first, second);
        }
    }
    duplicate
}

/// All sides of all polygons, as ascending pairs, sorted.
fn sorted_sides(polygons: &PolygonSoup) -> Vec<[u32; 2]> {
    let mut sides: Vec<_> =
        (0..polygons.len()).flat_map(|i| sides_of(polygons, i as u32)).collect();
    sides.sort_unstable();
    sides
}

fn sides_of(polygons: &PolygonSoup, index: u32) -> impl Iterator<Item = [u32; 2]> {
    let corners = polygons.polygon(index as usize);
    corners.iter().zip(corners.iter().cycle().skip(1)).map(|(&a, &b)| [a.min(b), a.max(b)])
}

/// Whether two polygons have all their sides in common, and with no third one.
fn closes_up(polygons: &PolygonSoup, sides: &[[u32; 2]], first: u32, second: u32) -> bool {
    [first, second].into_iter().flat_map(|polygon| sides_of(polygons, polygon)).all(|side| {
        let start = sides.partition_point(|&other| other < side);
        sides[start..].iter().take(3).take_while(|&&other| other == side).count() == 2
    })
}

/// Renumbers the vertices that occur in faces, in their order; returns their former numbers.
pub(super) fn compact(vertices: usize, faces: &mut [[u32; 3]]) -> Vec<u32> {
    let mut number = vec![u32::MAX; vertices];
    for &vertex in faces.as_flattened() {
        number[vertex as usize] = 0;
    }
    let kept: Vec<u32> = (0..vertices as u32).filter(|&v| number[v as usize] == 0).collect();
    for (new, &old) in (0..).zip(&kept) {
        number[old as usize] = new;
    }
    for vertex in faces.as_flattened_mut() {
        *vertex = number[*vertex as usize];
    }
    kept
}

// Cuts a polygon in space into triangles by clipping ears.
//
// G. H. Meisters, Polygons have ears, Amer. Math. Monthly 82 (1975), 10.2307/2319703; the normal
// is M. E. Newell's (in I. Sutherland, R. Sproull, R. Schumacker, 10.1145/356625.356626).
//
// 1. Project along the axis that is closest to Newell's normal, which needs no planar polygon.
// 2. A quadrilateral: cut along the shorter of the diagonals that leave two left turns.
// 3. Otherwise clip ears: strictly convex corners whose triangle holds no reflex corner.
// 4. Where no ear is left, the polygon crosses itself in projection: clip the next convex
//    corner, or any. In any case the triangles fill a disc bounded by the polygon, so the
//    surface stays as closed as it was, and the check for self-intersections finds the rest.
//
// All turns are decided by exact predicates. A hole joined to the outline by a doubled edge
// (the same vertices twice) is cut correctly.

/// The budget for cutting polygons, and the defects found.
#[derive(Debug)]
pub(super) struct Triangulator {
    /// Point-in-triangle tests that may still be made.
    budget: u64,
    /// Polygons that cross themselves in projection.
    pub crossing: usize,
}

/// The budget of tests ran out.
#[derive(Debug)]
pub(super) struct TooIntricate;

impl Triangulator {
    /// For a soup with this number of corners in all. Ear clipping is cubic at worst; the budget makes
    /// the time of a whole file linear.
    pub fn new(corners: usize) -> Self {
        Self { budget: 50_000_000 + 2_000 * corners as u64, crossing: 0 }
    }

    /// Appends the triangles of a polygon. Those that name a vertex twice are left out.
    pub fn cut(
        &mut self,
        polygon: &[u32],
        points: &[Vec3],
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<(), TooIntricate> {
        if let &[a, b, c] = polygon {
            push(triangles, [a, b, c]);
            return Ok(());
        }
        let flat = flatten(polygon, points);
        if let (&[a, b, c, d], &[p, q, r, s]) = (polygon, &flat[..]) {
            let [first, second] = [[[p, q, r], [p, r, s]], [[q, r, s], [q, s, p]]]
                .map(|cut| cut.iter().all(|&[a, b, c]| orient2d(a, b, c) == Sign::Positive));
            let [ac, bd] = [(a, c), (b, d)]
                .map(|(i, j)| points[i as usize].distance_squared(points[j as usize]));
            if second && (!first || bd < ac) {
                triangles.extend([[b, c, d], [b, d, a]]);
                return Ok(());
            }
            if first {
                triangles.extend([[a, b, c], [a, c, d]]);
                return Ok(());
            }
        }
        self.clip_ears(polygon, &flat, triangles)
    }

    fn clip_ears(
        &mut self,
        polygon: &[u32],
        flat: &[Point2],
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<(), TooIntricate> {
        let mut ring = Ring::new(polygon, flat);
        let mut corner = 0;
        let mut since_last_ear = 0;
        let mut crosses = false;
        while ring.len > 3 {
            let (before, after) = ring.neighbours(corner);
            let tests = ring.reflex.len() as u64 + 1;
            self.budget = self.budget.checked_sub(tests).ok_or(TooIntricate)?;
            // After a full turn without an ear take any convex corner, after two any corner.
            let ear = match since_last_ear / ring.len {
                0 => ring.is_ear(corner),
                1 => ring.turn(corner) == Sign::Positive,
                _ => true,
            };
            if ear {
                crosses |= since_last_ear >= ring.len;
                push(triangles, [before, corner, after].map(|i| polygon[i]));
                ring.remove(corner);
                since_last_ear = 0;
                // Going on two corners further makes fewer thin triangles than a fan has.
                corner = ring.neighbours(after).1;
            } else {
                since_last_ear += 1;
                corner = after;
            }
        }
        let (before, after) = ring.neighbours(corner);
        push(triangles, [before, corner, after].map(|i| polygon[i]));
        self.crossing += usize::from(crosses);
        Ok(())
    }
}

fn push(triangles: &mut Vec<[u32; 3]>, [a, b, c]: [u32; 3]) {
    if a != b && b != c && c != a {
        triangles.push([a, b, c]);
    }
}

/// The polygon in the plane, counter-clockwise.
fn flatten(polygon: &[u32], points: &[Vec3]) -> Vec<Point2> {
    let origin = points[polygon[0] as usize];
    let corners: Vec<Vec3> = polygon.iter().map(|&i| points[i as usize] - origin).collect();
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let normal = sides.fold(Vec3::ZERO, |sum, (&a, &b)| sum + a.cross(b));
    let axis = normal.abs().max_position();
    let is_clockwise = normal[axis] < 0.0;
    let flat = polygon.iter().map(|&i| project(points[i as usize], axis));
    flat.map(|[u, v]| if is_clockwise { [v, u] } else { [u, v] }).collect()
}

/// The corners that are left, linked in a ring.
struct Ring<'a> {
    polygon: &'a [u32],
    flat: &'a [Point2],
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Corners that are not strictly convex, in no order.
    reflex: Vec<u32>,
    /// The place of a corner in `reflex`.
    position: Vec<u32>,
    len: usize,
}

const CONVEX: u32 = u32::MAX;

impl<'a> Ring<'a> {
    fn new(polygon: &'a [u32], flat: &'a [Point2]) -> Self {
        let len = polygon.len();
        let n = len as u32;
        let next = (0..n).map(|i| (i + 1) % n).collect();
        let previous = (0..n).map(|i| (i + n - 1) % n).collect();
        let position = vec![CONVEX; len];
        let mut ring = Self { polygon, flat, next, previous, reflex: Vec::new(), position, len };
        for corner in 0..len {
            ring.classify(corner);
        }
        ring
    }

    fn neighbours(&self, corner: usize) -> (usize, usize) {
        (self.previous[corner] as usize, self.next[corner] as usize)
    }

    fn turn(&self, corner: usize) -> Sign {
        let (before, after) = self.neighbours(corner);
        orient2d(self.flat[before], self.flat[corner], self.flat[after])
    }

    /// Brings `reflex` up to date.
    fn classify(&mut self, corner: usize) {
        let convex = self.turn(corner) == Sign::Positive;
        let at = self.position[corner];
        if convex && at != CONVEX {
            self.reflex.swap_remove(at as usize);
            if let Some(&moved) = self.reflex.get(at as usize) {
                self.position[moved as usize] = at;
            }
            self.position[corner] = CONVEX;
        } else if !convex && at == CONVEX {
            self.position[corner] = self.reflex.len() as u32;
            self.reflex.push(corner as u32);
        }
    }

    fn is_ear(&self, corner: usize) -> bool {
        if self.position[corner] != CONVEX {
            return false;
        }
        let (before, after) = self.neighbours(corner);
        let own = [before, corner, after].map(|i| self.polygon[i]);
        let [a, b, c] = [before, corner, after].map(|i| self.flat[i]);
        !self.reflex.iter().any(|&r| {
            let p = self.flat[r as usize];
            // The ends of a doubled edge are the same vertex twice and do not block.
            !own.contains(&self.polygon[r as usize])
                && orient2d(a, b, p) != Sign::Negative
                && orient2d(b, c, p) != Sign::Negative
                && orient2d(c, a, p) != Sign::Negative
        })
    }

    fn remove(&mut self, corner: usize) {
        let (before, after) = self.neighbours(corner);
        self.next[before] = after as u32;
        self.previous[after] = before as u32;
        self.len -= 1;
        if self.position[corner] != CONVEX {
            let at = self.position[corner] as usize;
            self.reflex.swap_remove(at);
            if let Some(&moved) = self.reflex.get(at) {
                self.position[moved as usize] = at as u32;
            }
        }
        self.classify(before);
        self.classify(after);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of a polygon in a tilted plane, and the sum of their signed areas in it.
    fn cut(outline: &[[f64; 2]], polygon: &[u32]) -> (Vec<[u32; 3]>, f64, usize) {
        // Shears and swaps axes without rounding: collinear points stay so.
        let points: Vec<_> = outline.iter().map(|&[x, y]| Vec3::new(y, x + y, 4.0 * x)).collect();
        let mut triangles = Vec::new();
        let mut triangulator = Triangulator::new(polygon.len());
        triangulator.cut(polygon, &points, &mut triangles).unwrap();
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| outline[i as usize]);
            let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
            assert!(area > 0.0, "{t:?} is turned over or flat");
            area
        };
        let sum = triangles.iter().map(area).sum();
        (triangles, sum, triangulator.crossing)
    }

    #[test]
    fn convex_reflex_collinear_and_keyhole() {
        let square = [[0., 0.], [1., 0.], [2., 0.], [2., 2.], [0., 2.], [0., 1.]];
        assert_eq!(cut(&square, &[0, 1, 2, 3, 4, 5]).1, 4.0);
        let arrow = [[0., 0.], [4., -3.], [1., 0.], [4., 3.]];
        for start in 0..4 {
            let rotated: Vec<u32> = (0..4).map(|i| (i + start) % 4).collect();
            let (triangles, area, _) = cut(&arrow, &rotated);
            assert_eq!((triangles.len(), area), (2, 3.0));
        }
        let hole = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [1., 1.], [1., 3.], [3., 3.], [3., 1.]];
        let (triangles, area, crossing) = cut(&hole, &[0, 1, 2, 3, 0, 4, 5, 6, 7, 4]);
        assert_eq!((triangles.len(), area, crossing), (8, 12.0, 0));
    }

    #[test]
    fn a_comb_is_cut_into_its_area() {
        let teeth = 300;
        let mut outline = vec![[0.0, -1.0], [2.0 * f64::from(teeth), -1.0]];
        for tooth in (0..teeth).rev() {
            let x = 2.0 * f64::from(tooth);
            outline.extend([[x + 2.0, 0.0], [x + 1.0, 8.0]]);
        }
        outline.push([0.0, 0.0]);
        let polygon: Vec<u32> = (0..outline.len() as u32).collect();
        let (triangles, area, crossing) = cut(&outline, &polygon);
        assert_eq!(triangles.len(), outline.len() - 2);
        assert_eq!((area, crossing), (f64::from(teeth) * (2.0 + 8.0), 0));
    }

    #[test]
    fn a_crossing_polygon_still_becomes_a_disc() {
        let points =
            [[0., 0.], [2., 2.], [2., 0.], [0., 2.], [5., 1.]].map(|[x, y]| Vec3::new(x, y, 0.));
        let mut triangles = Vec::new();
        Triangulator::new(5).cut(&[0, 1, 2, 3, 4], &points, &mut triangles).unwrap();
        assert_eq!(triangles.len(), 3);
    }
}
