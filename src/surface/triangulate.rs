//! Cuts a polygon in space into triangles by clipping ears.
//!
//! G. H. Meisters, Polygons have ears, Amer. Math. Monthly 82 (1975), 10.2307/2319703; the normal
//! is M. E. Newell's (in I. Sutherland, R. Sproull, R. Schumacker, 10.1145/356625.356626).
//!
//! 1. Project along the axis that is closest to Newell's normal, which needs no planar polygon.
//! 2. A quadrilateral: cut along the shorter of the diagonals that leave two left turns.
//! 3. Otherwise clip ears: strictly convex corners whose triangle holds no reflex corner.
//! 4. Where no ear is left, the polygon crosses itself in projection: clip the next convex
//!    corner, or any. Whatever happens, the triangles fill a disc bounded by the polygon, so the
//!    surface stays as closed as it was, and the check for self-intersections tells the rest.
//!
//! All turns are decided by exact predicates. A hole joined to the outline by a doubled edge
//! (the same vertices twice) is cut correctly.

use crate::Vec3;
use crate::geometry::predicates::{Point2, Sign, orient2d, project};

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
    /// For a soup with so many corners in all. Ear clipping is cubic at worst; the budget makes
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
            let left = |a, b, c| orient2d(a, b, c) == Sign::Positive;
            let first = left(p, q, r) && left(p, r, s);
            let second = left(q, r, s) && left(q, s, p);
            let length =
                |i: u32, j: u32| (points[i as usize] - points[j as usize]).length_squared();
            match (first, second) {
                (true, true) if length(b, d) < length(a, c) => {
                    triangles.extend([[b, c, d], [b, d, a]]);
                    return Ok(());
                }
                (true, _) => {
                    triangles.extend([[a, b, c], [a, c, d]]);
                    return Ok(());
                }
                (false, true) => {
                    triangles.extend([[b, c, d], [b, d, a]]);
                    return Ok(());
                }
                (false, false) => {}
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
    let at = |i: usize| points[polygon[i % polygon.len()] as usize] - origin;
    let normal = (0..polygon.len()).fold(Vec3::ZERO, |sum, i| sum + at(i).cross(at(i + 1)));
    let axis = normal.abs().max_position();
    let clockwise = normal[axis] < 0.0;
    let turned = |[u, v]: Point2| if clockwise { [v, u] } else { [u, v] };
    polygon.iter().map(|&i| turned(project(points[i as usize], axis))).collect()
}

/// The corners that are left, linked in a ring.
struct Ring<'a> {
    polygon: &'a [u32],
    flat: &'a [Point2],
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Corners that are not strictly convex, in no order.
    reflex: Vec<u32>,
    /// Where a corner stands in `reflex`.
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
