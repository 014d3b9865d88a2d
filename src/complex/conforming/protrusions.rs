//! Points of the surface that shrink balls of the start that reach far out of the solid.

use rayon::prelude::*;

use super::Refinement;
use super::skin::{Place, Skin, key, sides};
use crate::Vec3;
use crate::complex::Sphere;
use crate::geometry::CellId;
use crate::surface::{InsideTest, PointGrid, Side, TriMesh, TriangleBvh};

/// Distance to a segment below which a point moves onto it, as a share of the tolerated depth.
const SNAP: f64 = 0.25;

/// Distance from the surface, as a fraction of its diagonal, that is rounding.
const ROUNDING: f64 = 1e-12;

/// Depth of a ball, as a share of the tolerated one, from which it must not close a gap.
const LEAST: f64 = 0.01;

/// Least cosine of the angle between the way to a centre beyond the surface and the surface's normal.
const STRAIGHT: f64 = 0.99;

/// Distance that stays free in front of the deepest point of a ball, in depths.
const FREE: f64 = 1.5;

/// A ball that is too large for its place: that of a cell inside, or of the circle in which one that is centred beyond the
/// surface meets a plane of it, as in thin plates.
struct Protrusion {
    /// Radius less the distance from the centre to the surface.
    depth: f64,
    centre: Vec3,
    radius: f64,
    /// The point of the surface nearest to the centre, and its triangle.
    foot: Vec3,
    triangle: u32,
}

impl Refinement {
    /// Whether a ball of a cell inside contains a point of the surface deeper than a fraction of the diagonal.
    pub fn has_protrusions(&self, depth: f64) -> bool {
        let depth = depth * self.skin.diagonal;
        !self.protrusions(depth, depth).is_empty()
    }

    /// Adds points until every such ball contains one of them. Each is at least as far from all vertices of its plane as three
    /// quarters of the depth, so that the area of the surface bounds their number.
    /// None is near to a place of `closed`, a point with a distance. The points are moved from flipped triangles to the surface
    /// itself.
    pub fn split_protrusions(
        &mut self,
        depth: f64,
        surface: &TriangleBvh,
        closed: &[(Vec3, f64)],
        keeps_gaps: bool,
    ) {
        let first = self.skin.points.len();
        let depth = depth * self.skin.diagonal;
        let least = if keeps_gaps { LEAST * depth } else { depth };
        let mut protrusions = self.protrusions(least, depth);
        protrusions.retain(|ball| ball.depth > depth);
        if keeps_gaps {
            protrusions.extend(self.closing_gaps(least, surface));
        }
        // The deepest first.
        protrusions.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        let mut fresh = PointGrid::new(depth);
        for Protrusion { depth: ball, centre, radius, foot, triangle } in protrusions {
            if !closed.iter().any(|(at, radius)| at.distance(foot) < *radius)
                && !fresh.any_within(centre, radius)
                && let Some(at) = self.skin.split_at(triangle, foot, SNAP * ball.min(depth))
            {
                fresh.insert(at);
            }
        }
        self.skin.move_to(surface, first);
    }

    /// Halves edges of the surface at vertices that no ball is near, until these are closer than a fraction of the diagonal:
    /// those of blades and needles, whose cells have no centre inside.
    pub fn split_at_bare_vertices(
        &mut self,
        depth: f64,
        surface: &TriangleBvh,
        closed: &[(Vec3, f64)],
    ) {
        let first = self.skin.points.len();
        let depth = depth * self.skin.diagonal;
        let is_bare = self.bare_vertices(depth);
        let skin = &mut self.skin;
        let ends = |[a, b]: [u32; 2]| (skin.points[a as usize], skin.points[b as usize]);
        let all = skin.triangles.iter().flat_map(|&t| sides(t)).filter(|[a, b]| a < b);
        let mut edges: Vec<(f64, [u32; 2])> = all
            .filter(|edge| edge.iter().any(|&v| is_bare[v as usize]))
            .map(|edge| (ends(edge).0.distance(ends(edge).1), edge))
            .filter(|&(length, _)| length > depth)
            .collect();
        edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, edge) in edges {
            let [a, b] = edge.map(|v| skin.points[v as usize]);
            let at = a.midpoint(b);
            // Splits of this round can have flipped it.
            if skin.across.contains_key(&key(edge))
                && !closed.iter().any(|(place, radius)| place.distance(at) < *radius)
            {
                skin.split_edge(edge, at);
            }
        }
        skin.move_to(surface, first);
    }

    /// For each point whether it is farther than a distance from all corners of cells that are centred inside, and from the
    /// centroids of its cells.
    fn bare_vertices(&self, depth: f64) -> Vec<bool> {
        let Self { skin, delaunay, is_inside, .. } = self;
        let cells = delaunay.finite_cells().filter(|cell| is_inside[cell.index()]);
        let centred = cells.map(|cell| {
            let corners = delaunay.vertices(cell).map(|v| delaunay.point(v));
            let centroid = corners.into_iter().sum::<Vec3>() / 4.0;
            (
                cell,
                delaunay.circumsphere(cell).map_or(Vec3::INFINITY, |(centre, _)| centre),
                centroid,
            )
        });
        let cells: Vec<(CellId, Vec3, Vec3)> = centred.collect();
        let mesh = TriMesh { vertices: skin.points.clone(), faces: skin.triangles.clone() };
        let centres: Vec<Vec3> = cells.iter().map(|&(_, centre, _)| centre).collect();
        let sides = InsideTest::new(&mesh).sides(&centres);
        // No cell of a vertex that was merged with another one has it as a corner.
        let mut is_bare = vec![false; skin.points.len()];
        let mut grid = PointGrid::new(depth);
        let all = || cells.iter().zip(&sides);
        let corners = |cell: CellId| delaunay.vertices(cell).map(|v| v.index());
        for ((cell, ..), _) in all() {
            corners(*cell).into_iter().for_each(|v| is_bare[v] = true);
        }
        for ((cell, ..), _) in all().filter(|(_, side)| **side == Side::Inside) {
            for v in corners(*cell) {
                if std::mem::take(&mut is_bare[v]) {
                    grid.insert(skin.points[v]);
                }
            }
        }
        for ((cell, _, centroid), _) in all() {
            for v in corners(*cell) {
                is_bare[v] &= skin.points[v].distance(*centroid) > depth;
            }
        }
        let points = is_bare.iter().zip(&skin.points);
        points.map(|(&is_bare, &p)| is_bare && !grid.any_within(p, depth)).collect()
    }

    /// Whether a ball reaches over a third of the way to another part of the surface: together with that of the other side it
    /// would close the gap, however deep that is.
    fn closes_gap(&self, ball: &Protrusion, surface: &TriangleBvh) -> bool {
        let [a, b, c] = self.skin.corners(ball.triangle);
        let outward = (b - a).cross(c - a).normalize_or_zero();
        let way = FREE * ball.depth;
        let tip = ball.foot + way * outward;
        let nearest = surface.closest(tip);
        // A surface sideways of the tip, as behind an edge, bounds no gap.
        nearest.distance < 0.9 * way
            && outward.dot(nearest.point - tip).abs() > 0.5 * nearest.distance
    }

    /// For each ball inside the deepest place where it closes a gap, and is deeper than `least`. The nearest part of the
    /// surface may be another one.
    fn closing_gaps(&self, least: f64, surface: &TriangleBvh) -> Vec<Protrusion> {
        let Some((large, tree)) = self.large_triangles(least) else { return Vec::new() };
        let spheres = self.delaunay.circumspheres();
        let inside = spheres.par_iter().zip(&self.is_inside).filter(|&(_, &is_inside)| is_inside);
        let found = inside.filter_map(|(sphere, _)| {
            let Sphere { centre, radius } = (*sphere).filter(|sphere| sphere.radius > least)?;
            let mut deepest: Option<Protrusion> = None;
            tree.each_within(centre, radius - least, |face, foot| {
                let depth = radius - centre.distance(foot);
                let triangle = large[face as usize];
                let ball = Protrusion { depth, centre, radius, foot, triangle };
                let is_deeper = deepest.as_ref().is_none_or(|deepest| deepest.depth < depth);
                if is_deeper && self.closes_gap(&ball, surface) {
                    deepest = Some(ball);
                }
            });
            deepest
        });
        found.collect()
    }

    /// Plane triangles that a ball without vertices inside can pass deeper than `depth`, with their tree.
    fn large_triangles(&self, depth: f64) -> Option<(Vec<u32>, TriangleBvh)> {
        let skin = &self.skin;
        // A ball without vertices inside reaches beyond a triangle no deeper than the triangle's points are far from its
        // corners, which is at most the longest side divided by the root of three.
        let is_large = |t: &u32| {
            let squared = sides(skin.triangles[*t as usize])
                .map(|edge| edge.map(|v| skin.points[v as usize]))
                .map(|[a, b]| a.distance_squared(b));
            let is_flat = skin.plane[skin.patch[*t as usize] as usize].is_some();
            is_flat && squared.into_iter().any(|squared| squared > 3.0 * depth * depth)
        };
        let large: Vec<u32> = (0..skin.triangles.len() as u32).filter(is_large).collect();
        let corners: Vec<[Vec3; 3]> = large.iter().map(|&t| skin.corners(t)).collect();
        let tree = TriangleBvh::from_triangles(&corners).ok()?;
        Some((large, tree))
    }

    /// Balls deeper than `depth`, and circles with a radius above `wide` where the solid is thin.
    fn protrusions(&self, depth: f64, wide: f64) -> Vec<Protrusion> {
        let found = self.all_protrusions(depth, wide);
        let circles: Vec<CellId> = found.iter().filter_map(|&(cell, _)| cell).collect();
        let mut is_thin = self.is_thin(&circles).into_iter();
        let kept =
            found.into_iter().filter(|(cell, _)| cell.is_none() || is_thin.next() == Some(true));
        kept.map(|(_, protrusion)| protrusion).collect()
    }

    /// For each of some cells whether no corner of it is one of a cell inside that is centred inside.
    fn is_thin(&self, cells: &[CellId]) -> Vec<bool> {
        if cells.is_empty() {
            return Vec::new();
        }
        let Self { skin, delaunay, is_inside, .. } = self;
        let corners = |cell: &CellId| delaunay.vertices(*cell).map(|v| v.index());
        let mut is_asked = vec![false; skin.points.len()];
        cells.iter().flat_map(corners).for_each(|v| is_asked[v] = true);
        let is_near = |cell: &CellId| corners(cell).iter().any(|&v| is_asked[v]);
        let around =
            delaunay.finite_cells().filter(|cell| is_inside[cell.index()] && is_near(cell));
        let centred = around.filter_map(|cell| Some((cell, delaunay.circumsphere(cell)?.0)));
        let (around, centres): (Vec<CellId>, Vec<Vec3>) = centred.unzip();
        let mesh = TriMesh { vertices: skin.points.clone(), faces: skin.triangles.clone() };
        let mut is_centred = vec![false; skin.points.len()];
        let sides = InsideTest::new(&mesh).sides(&centres);
        let inside = around.iter().zip(sides).filter(|&(_, side)| side == Side::Inside);
        inside.flat_map(|(cell, _)| corners(cell)).for_each(|v| is_centred[v] = true);
        cells.iter().map(|cell| !corners(cell).iter().any(|&v| is_centred[v])).collect()
    }

    /// Balls and circles anywhere, circles with their cells.
    fn all_protrusions(&self, depth: f64, wide: f64) -> Vec<(Option<CellId>, Protrusion)> {
        let Self { skin, delaunay, is_inside, .. } = self;
        let Some((large, tree)) = self.large_triangles(depth) else { return Vec::new() };
        let spheres = delaunay.circumspheres();
        let all = (0..spheres.len() as u32).into_par_iter().zip(&spheres).zip(is_inside);
        let balls = all.filter(|&(_, &is_inside)| is_inside).map(|(ball, _)| ball);
        let found = balls.filter_map(|(cell, sphere)| {
            let sphere = (*sphere).filter(|sphere| sphere.radius > depth)?;
            let nearest = tree.closest_within_from(sphere.centre, sphere.radius, None)?;
            let (foot, triangle) = (nearest.point, large[nearest.face as usize]);
            let Sphere { centre, radius } = sphere;
            let reach = radius - nearest.distance;
            if reach > depth {
                let ball = Protrusion { depth: reach, centre, radius, foot, triangle };
                return Some((None, ball));
            }
            let [a, b, c] = skin.corners(triangle);
            let outward = (b - a).cross(c - a).normalize_or_zero();
            let height = outward.dot(centre - foot);
            let width = (radius * radius - height * height).sqrt();
            let circle = Protrusion { depth: width, centre: foot, radius: width, foot, triangle };
            let is_circle = height > STRAIGHT * nearest.distance && width > wide;
            is_circle.then_some((Some(CellId(cell)), circle))
        });
        found.collect()
    }
}

impl Skin {
    /// Moves the points from `first` on to the surface, where flips have left it.
    pub fn move_to(&mut self, surface: &TriangleBvh, first: usize) {
        for point in &mut self.points[first..] {
            let nearest = surface.closest(*point);
            if nearest.distance > ROUNDING * self.diagonal {
                *point = nearest.point;
            }
        }
    }

    /// Adds a point of a triangle that other points of this round may have split. None where the way to it leaves the patch.
    fn split_at(&mut self, triangle: u32, p: Vec3, snap: f64) -> Option<Vec3> {
        let place = self.locate(triangle, p);
        let edge = match place {
            Place::Edge(edge) => Some(edge),
            Place::Triangle(t) => sides(self.triangles[t as usize]).into_iter().find(|&edge| {
                self.is_segment(t, edge) && self.nearest_on(edge, p).distance(p) < snap
            }),
        };
        let Some(edge) = edge else {
            let Place::Triangle(t) = place else { return None };
            // The ball of a flat cell is only as exact as its circumcentre.
            return self.takes(t, p, snap).then(|| {
                self.split_triangle(t, p);
                p
            });
        };
        let t = self.across[&key(edge)];
        let at = if self.is_segment(t, edge) { self.nearest_on(edge, p) } else { p };
        if at.distance(p) > snap || !self.takes(t, at, snap) {
            return None;
        }
        self.split_edge(edge, at);
        Some(at)
    }

    /// The point of an edge that is nearest to another point.
    fn nearest_on(&self, edge: [u32; 2], p: Vec3) -> Vec3 {
        let [a, b] = edge.map(|v| self.points[v as usize]);
        let along = b - a;
        a + along * ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0)
    }
}
