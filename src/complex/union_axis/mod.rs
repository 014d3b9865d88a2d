//! The medial axis of a union of balls: exact, and piecewise linear.
//!
//! D. Attali, A. Montanvert: *Computing and simplifying 2D and 3D continuous skeletons*, Computer
//! Vision and Image Understanding 67 (1997), <https://doi.org/10.1006/cviu.1997.0536>; N. Amenta,
//! R. K. Kolluri: *The medial axis of a union of balls*, Computational Geometry 20 (2001),
//! <https://doi.org/10.1016/S0925-7721(01)00033-5>.
//!
//! Theorem (both papers): with the dual complex `K` of the balls and the vertices `V` of the
//! boundary of their union, the medial axis is the union of the singular simplices of `K` and of the
//! part of the Voronoi diagram of `V` inside the tetrahedra of `K`.
//!
//! 1. Regular triangulation, `K`, and `V` with the balls that meet in each of its *corners*
//!    (file `corners.rs`).
//! 2. *Sectors*: the triangles at an edge `ij` of `K` leave gaps and enclose solid sectors. The
//!    corners at the two sides of a sector are on the circle of `i` and `j`, and the edge is part of
//!    their Voronoi facet: on one side of it, in the sector, that facet is inside `K` or outside.
//!    They are in `corners.rs`, too.
//! 3. Delaunay triangulation of `V`. The Voronoi vertex of a cell whose corners share a ball is that
//!    ball's centre. A Voronoi edge whose corners share a ball passes through that ball's centre, and
//!    only there does it cross the boundary of `K`; where they share two it runs along an edge of `K`.
//!    So all other Voronoi edges join vertices on one side, and the sectors decide on which.
//! 4. The part of each Voronoi facet inside `K` is bounded by Voronoi edges inside, as far as the
//!    first ball centre on them, and by the solid sectors, among which a singular triangle is one of
//!    no width. These sides, directed, close up to polygons.
//! 5. The polygons with the singular edges and vertices of `K` are the axis. Radii: of a ball at its
//!    centre, the distance to the corners at a Voronoi vertex.
//!
//! In steps 2 to 4 only the Delaunay triangulation of the rounded corners depends on coordinates. So the
//! axis has the topology of `K` if that triangulation has every facet of step 2, and rounding moved no
//! corner into a ball. [`AxisTally`] counts violations; random balls have practically none. If balls
//! touch in single points, or many spheres meet in one corner, parts of the axis can coincide and are
//! then taken for one. Compare with [`UnionAxis::union_betti`]; a perturbation helps.
//!
//! Unperturbed polar balls are out of scope. They meet in samples by construction, but only up to
//! rounding: rounding decides their dual complex, and their other corners lie where spheres nearly
//! touch. The axis of such balls falls into many pieces, even with the samples in place of the corners.
//! With radii times 1.002 and slightly moved centres facets close up.
//!
//! Deviations from the papers
//!
//! * Amenta and Kolluri clip by classifying Voronoi vertices and keep facets all of whose vertices
//!   are inside. A facet that an edge of `K` cuts has vertices on both sides (four balls that meet
//!   have a single Voronoi vertex and six such facets); here it is cut along that edge.
//! * Where the spheres of several balls meet in one corner, polygons need not be convex.

use corners::{Corners, Voronoi};
use rayon::prelude::*;

use super::MedialMesh;
use super::mesh::run_starts;
use crate::Vec3;
use crate::geometry::dual_complex::Class;
use crate::geometry::triangulation::Facet;
use crate::geometry::{CellId, DualComplex, Sphere, TriangulationError, UnionVertex};

mod corners;

/// No ball, corner, or vertex.
const NONE: u32 = u32::MAX;

/// The medial axis of a union of balls.
///
/// ```
/// use medial::{Vec3, complex::{Sphere, UnionAxis}};
///
/// // Two balls that meet, one inside the first, one apart.
/// let balls = [(0.0, 2.0), (3.0, 1.5), (0.5, 1.0), (9.0, 1.0)];
/// let balls = balls.map(|(x, r)| Sphere::new(Vec3::new(x, 0.0, 0.0), r));
/// let axis = UnionAxis::of_balls(&balls)?.mesh();
/// assert_eq!(axis.spheres, [balls[0], balls[1], balls[3]]);
/// assert_eq!(axis.edges, [[0, 1]]);
/// # Ok::<(), medial::geometry::TriangulationError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct UnionAxis {
    spheres: Vec<Sphere>,
    /// For the first of the spheres the ball that each is.
    balls: Vec<u32>,
    edges: Vec<[u32; 2]>,
    polygons: Vec<Polygon>,
    corners: Vec<UnionVertex>,
    union_betti: [u64; 3],
    tally: AxisTally,
}

/// The sizes of the input of the axis, and counts of defects by rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisTally {
    /// Balls that are in the dual complex: those that contribute to the boundary of the union, or
    /// whose centre is inside its solid part.
    pub balls: usize,
    /// Different vertices of the boundary.
    pub corners: usize,
    /// Voronoi vertices inside the dual complex, ball centres not counted.
    pub inside: usize,
    /// Groups of Voronoi vertices that no sector or contradictory sectors put on a side. Zero but
    /// for rounding.
    pub doubtful: usize,
    /// Facets whose sides do not close up and are missing from the axis. Zero except for rounding.
    pub open: usize,
    /// Voronoi vertices that rounding had outside the box of all centres, moved into it.
    pub clamped: usize,
}

/// A convex polygon of the axis, unless several balls meet in its corners: a part of a Voronoi facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisFacet<'a> {
    /// The two points of the boundary of the union that are nearest to each point of it.
    pub corners: [Vec3; 2],
    /// The same as indices of [`UnionAxis::corners`].
    pub between: [u32; 2],
    /// The vertices in order, as indices of spheres.
    pub polygon: &'a [u32],
}

impl<'a> AxisFacet<'a> {
    /// The facet as triangles, those of [`UnionAxis::mesh`].
    pub fn fan(self) -> impl Iterator<Item = [u32; 3]> + 'a {
        fan(self.polygon)
    }
}

impl UnionAxis {
    /// The medial axis of the union of any number of balls.
    ///
    /// Costs a regular triangulation of the balls and a Delaunay triangulation of the vertices of the
    /// boundary, of which there are up to twice as many. The same for any number of threads.
    ///
    /// # Errors
    /// A centre or radius that is not finite or too large; a negative radius.
    pub fn of_balls(balls: &[Sphere]) -> Result<Self, TriangulationError> {
        let complex = DualComplex::of_balls(balls)?;
        let corners = Corners::of(&complex, balls)?;
        let sectors = corners::sectors_of(&complex, &corners);
        let mut tally = AxisTally {
            balls: complex.vertices().count(),
            corners: corners.count(),
            ..AxisTally::default()
        };
        let voronoi = corners::classify_sides(&corners, &sectors, &mut tally);
        // Step 4 begins with the sides along edges of the dual complex.
        let solid = sectors.all().iter().filter(|s| s.solid);
        let mut sides =
            solid.map(|s| Side { corners: s.corners, from: s.from, to: s.to }).collect();
        voronoi_sides(&corners, &voronoi, balls.len() as u32, &mut sides);
        let polygons = close_up(&sides, corners.with_anchors(), &mut tally);
        let mut edges: Vec<[u32; 2]> = lone_edges(&complex);
        edges.extend(voronoi.edges(&corners, balls.len() as u32));
        Ok(Self::assemble(balls, &complex, &corners, edges, polygons, tally))
    }

    /// Numbers the vertices: ball centres by ball, then Voronoi vertices by cell.
    fn assemble(
        balls: &[Sphere],
        complex: &DualComplex<'_>,
        corners: &Corners,
        mut edges: Vec<[u32; 2]>,
        mut polygons: Vec<Polygon>,
        mut tally: AxisTally,
    ) -> Self {
        let mut used = vec![false; balls.len() + corners.cell_count()];
        let singular = complex.vertices().filter(|v| v.1 == Class::Singular).map(|v| v.0.0);
        let on_sides = polygons.iter().flat_map(|p| p.vertices.iter().copied());
        for v in singular.chain(on_sides).chain(edges.iter().flatten().copied()) {
            used[v as usize] = true;
        }
        let mut number = vec![NONE; used.len()];
        let (mut spheres, mut of_ball) = (Vec::new(), Vec::new());
        let bounds = corners::bounds(balls);
        for old in (0..used.len()).filter(|&v| used[v]) {
            number[old] = spheres.len() as u32;
            spheres.push(if old < balls.len() {
                of_ball.push(old as u32);
                balls[old]
            } else {
                let (sphere, clamped) = corners.sphere(CellId((old - balls.len()) as u32), bounds);
                tally.clamped += usize::from(clamped);
                sphere
            });
        }
        for v in polygons.iter_mut().flat_map(|p| &mut p.vertices).chain(edges.iter_mut().flatten())
        {
            *v = number[*v as usize];
        }
        for polygon in &mut polygons {
            polygon.corners = polygon.between.map(|c| corners.point(c));
        }
        // The other sides are Voronoi edges.
        let sides = polygons.iter().flat_map(Polygon::edges);
        edges.extend(sides.filter(|ends| ends.iter().all(|&v| (v as usize) < of_ball.len())));
        for edge in &mut edges {
            edge.sort_unstable();
        }
        edges.par_sort_unstable_by_key(|&[a, b]| u64::from(a) << 32 | u64::from(b));
        edges.dedup();
        let union_betti = complex.betti();
        let corners = corners.vertices().to_vec();
        Self { spheres, balls: of_ball, edges, polygons, corners, union_betti, tally }
    }

    /// The vertices: centres of balls with their radii, ascending, then Voronoi vertices with their
    /// distances from the boundary.
    pub fn spheres(&self) -> &[Sphere] {
        &self.spheres
    }

    /// For the first of the spheres the ball that each is, ascending.
    pub fn balls(&self) -> &[u32] {
        &self.balls
    }

    /// All edges, as ascending pairs in lexicographic order: sides of facets, and singular edges.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// The facets, by corners.
    pub fn facets(&self) -> impl ExactSizeIterator<Item = AxisFacet<'_>> {
        self.polygons.iter().map(|p| AxisFacet {
            corners: p.corners,
            between: p.between,
            polygon: &p.vertices,
        })
    }

    /// The vertices of the boundary of the union, those at one position once, by any of them.
    pub fn corners(&self) -> &[UnionVertex] {
        &self.corners
    }

    /// The Betti numbers of the union, exact: those of the axis, except as described in
    /// [the module](self).
    pub fn union_betti(&self) -> [u64; 3] {
        self.union_betti
    }

    /// The sizes of its input, and counts of defects.
    pub fn tally(&self) -> &AxisTally {
        &self.tally
    }

    /// The axis as a medial mesh, facets cut into fans from their smallest vertex.
    pub fn mesh(&self) -> MedialMesh {
        self.part(|_| true, |_| true, |_| true)
    }

    /// The mesh of some facets, edges and spheres, by their indices, and of all that these have.
    pub fn part(
        &self,
        facet: impl Fn(usize) -> bool,
        edge: impl Fn(usize) -> bool,
        sphere: impl Fn(usize) -> bool,
    ) -> MedialMesh {
        let kept = self.polygons.iter().enumerate().filter(|(i, _)| facet(*i));
        let polygons: Vec<&Polygon> = kept.map(|(_, p)| p).collect();
        let kept = self.edges.iter().enumerate().filter(|(i, _)| edge(*i));
        let edges: Vec<[u32; 2]> = kept.map(|(_, e)| *e).collect();
        let mut keep: Vec<bool> = (0..self.spheres.len()).map(sphere).collect();
        let of_polygons = polygons.iter().flat_map(|p| &p.vertices);
        for &v in edges.iter().flatten().chain(of_polygons) {
            keep[v as usize] = true;
        }
        let faces = polygons.iter().flat_map(|p| p.fan()).collect();
        let mesh = MedialMesh::from_simplices(self.spheres.clone(), edges, faces)
            .expect("finite spheres and ids in range");
        if keep.contains(&false) { mesh.induced(&keep) } else { mesh }
    }
}

/// Edges of the dual complex without a triangle.
fn lone_edges(complex: &DualComplex<'_>) -> Vec<[u32; 2]> {
    let singular = complex.edges().filter(|e| e.1 == Class::Singular);
    singular.map(|(edge, _)| complex.edge_vertices(edge).map(|v| v.0)).collect()
}

// Step 4: the parts of the Voronoi facets inside the dual complex.

/// A directed side of the part of a facet, counter-clockwise about the direction from the smaller
/// corner to the larger. Vertices are balls, then cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    corners: [u32; 2],
    from: u32,
    to: u32,
}

/// A part of a facet.
#[derive(Clone, Debug, Default)]
struct Polygon {
    between: [u32; 2],
    /// The positions of the corners.
    corners: [Vec3; 2],
    vertices: Vec<u32>,
}

impl Polygon {
    /// The sides, in no particular direction.
    fn edges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let v = &self.vertices;
        (0..v.len()).map(move |k| [v[k], v[(k + 1) % v.len()]])
    }

    /// Triangles from the smallest vertex.
    fn fan(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        fan(&self.vertices)
    }
}

/// Triangles of a polygon from its smallest vertex.
fn fan(v: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let first = (0..v.len()).min_by_key(|&k| v[k]).unwrap_or(0);
    let at = move |k: usize| v[(first + k) % v.len()];
    (1..v.len().saturating_sub(1)).map(move |k| [at(0), at(k), at(k + 1)])
}

/// For each edge of a cell the indices of its other vertices: an even permutation.
const EDGES: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];

/// Adds the sides along Voronoi edges. Each starts or ends in a cell inside.
fn voronoi_sides(corners: &Corners, voronoi: &Voronoi, balls: u32, sides: &mut Vec<Side>) {
    let Some(delaunay) = corners.delaunay() else { return };
    let of_cell = |c: u32| {
        let cell = CellId(c);
        let v = delaunay.vertices(cell).map(|v| v.0);
        let neighbours = delaunay.neighbours(cell);
        let station = move |opposite| match voronoi.station(Facet { cell, opposite }) {
            NONE => (balls + neighbours[opposite].0, false),
            ball => (ball, true),
        };
        EDGES.into_iter().flat_map(move |[i, j, x, y]| {
            // Counter-clockwise about (i, j) the ring leaves through the facet without x.
            let ascending = v[i] < v[j];
            let (leave, enter) = if ascending { (x, y) } else { (y, x) };
            let corners = [v[i].min(v[j]), v[i].max(v[j])];
            let here = balls + c;
            let (to, _) = station(leave);
            // A side that enters from another cell inside is reported by that cell as leaving.
            let (from, is_ball) = station(enter);
            let entering = is_ball.then_some(Side { corners, from, to: here });
            [Some(Side { corners, from: here, to }), entering].into_iter().flatten()
        })
    };
    let cells = (0..voronoi.len() as u32).into_par_iter().with_min_len(1 << 9);
    let found: Vec<Side> =
        cells.filter(|&c| voronoi.contains(CellId(c))).flat_map_iter(of_cell).collect();
    sides.extend(found);
}

/// Joins the sides of each facet to polygons. `corners` is their number, anchors included.
fn close_up(sides: &[Side], corners: usize, tally: &mut AxisTally) -> Vec<Polygon> {
    let mut sides = by_first_corner(sides, corners);
    sides.par_chunk_by_mut(|a, b| a.corners[0] == b.corners[0]).for_each(<[Side]>::sort_unstable);
    let facets: Vec<&[Side]> = sides.chunk_by(|a, b| a.corners == b.corners).collect();
    let chunks = facets.par_iter().with_min_len(1 << 9);
    let traced: Vec<Traced> = chunks
        .map(|sides| match single(sides) {
            Some(polygon) => Traced { single: Some(polygon), ..Traced::default() },
            None => trace(sides),
        })
        .collect();
    tally.open += traced.iter().filter(|t| t.open).count();
    traced.into_iter().flat_map(|t| t.single.into_iter().chain(t.several)).collect()
}

/// The sides in the order of their smaller corners, by a counting sort: a comparison sort of all sides
/// would take longer than the rest of the axis.
fn by_first_corner(sides: &[Side], corners: usize) -> Vec<Side> {
    let mut next = run_starts(sides.iter().map(|side| side.corners[0]), corners);
    let mut sorted = vec![Side { corners: [NONE; 2], from: NONE, to: NONE }; sides.len()];
    for side in sides {
        let place = &mut next[side.corners[0] as usize];
        sorted[*place as usize] = *side;
        *place += 1;
    }
    sorted
}

/// The polygons of one facet.
#[derive(Default)]
struct Traced {
    single: Option<Polygon>,
    several: Vec<Polygon>,
    /// Whether some sides do not close up.
    open: bool,
}

/// If the sides form one simple polygon (the usual case), that polygon.
fn single(sides: &[Side]) -> Option<Polygon> {
    // Sorted by start: two sides from one vertex are neighbours, and make the polygon not simple.
    if sides.len() < 3 || sides.windows(2).any(|pair| pair[0].from == pair[1].from) {
        return None;
    }
    let mut vertices = Vec::with_capacity(sides.len());
    let mut at = 0;
    while vertices.len() < sides.len() {
        vertices.push(sides[at].from);
        at = sides.binary_search_by_key(&sides[at].to, |side| side.from).ok()?;
        if at == 0 {
            break;
        }
    }
    let is_whole = at == 0 && vertices.len() == sides.len();
    is_whole.then(|| Polygon { between: sides[0].corners, vertices, ..Polygon::default() })
}

/// The simple polygons of a facet in the general case.
fn trace(sides: &[Side]) -> Traced {
    let sides = without_opposites(sides);
    let between = sides.first().map_or([NONE; 2], |s| s.corners);
    // Sides from one vertex are consecutive; the index of the first is the id of the vertex.
    let vertex = |v: u32| sides.partition_point(|s| s.from < v);
    let mut taken = vec![false; sides.len()];
    let mut on_path = vec![NONE; sides.len()];
    let (mut polygons, mut open) = (Vec::new(), false);
    for start in 0..sides.len() {
        let mut path: Vec<u32> = Vec::new();
        let mut here = sides[start].from;
        loop {
            let at = vertex(here);
            if on_path.get(at).is_some_and(|&p| p != NONE) {
                // The path meets itself: the part since the first visit is a simple polygon.
                let cycle = path.split_off(on_path[at] as usize);
                for &v in &cycle {
                    on_path[vertex(v)] = NONE;
                }
                if cycle.len() > 2 {
                    polygons.push(Polygon { between, vertices: cycle, ..Polygon::default() });
                }
            }
            let free =
                (at..sides.len()).take_while(|&k| sides[k].from == here).find(|&k| !taken[k]);
            let Some(next) = free else { break };
            taken[next] = true;
            on_path[at] = path.len() as u32;
            path.push(here);
            here = sides[next].to;
        }
        open |= !path.is_empty();
        for v in path {
            on_path[vertex(v)] = NONE;
        }
    }
    Traced { single: None, several: polygons, open }
}

/// The sides that are left, in order, after each pair of opposite sides has cancelled.
fn without_opposites(sides: &[Side]) -> Vec<Side> {
    let mut left: Vec<Side> = Vec::with_capacity(sides.len());
    for run in sides.chunk_by(|a, b| a == b) {
        let side = run[0];
        let opposite = Side { from: side.to, to: side.from, ..side };
        let others =
            sides.partition_point(|s| *s <= opposite) - sides.partition_point(|s| *s < opposite);
        left.extend(std::iter::repeat_n(side, run.len().saturating_sub(others)));
    }
    left
}
