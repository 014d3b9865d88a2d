//! Profiles of the built-in prisms and solids of revolution: their medial axes in closed form, and their triangles.

use medial::Vec3;
use medial::geometry::glam::DVec2;
use medial::surface::TriMesh;

use crate::bisectors::{Profile, Site};
use crate::solids::{between, parts, share, split};

/// Half the sides of the plate with a hole along y.
pub(crate) const HOLED_HALF: Vec3 = Vec3::new(1.2, 0.15, 0.9);

// Medial axes. Each head names the junctions: the points with three nearest sites.

fn point(x: f64, z: f64) -> DVec2 {
    DVec2::new(x, z)
}

/// The triangle with base `2 half` on `z = 0` and its apex at `(0, height)`: three bisectors that meet in the
/// centre of the inscribed circle, whose radius is twice the area over the perimeter.
pub(crate) fn triangle(half: f64, height: f64) -> Profile {
    let corners = [point(-half, 0.0), point(half, 0.0), point(0.0, height)];
    let inscribed = half * height / (half + half.hypot(height));
    let sides = [0, 1, 2].map(|i| Site::line(corners[i], corners[(i + 1) % 3]));
    Profile {
        sites: sides.to_vec(),
        nodes: [&corners[..], &[point(0.0, inscribed)]].concat(),
        // Side `i` goes from corner `i` on.
        branches: (0..3).map(|i| ([i, 3], [i, (i + 2) % 3])).collect(),
    }
}

/// An elbow: a foot along the x axis and a leg along the z axis, with a fillet or a reflex corner between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elbow {
    /// Length of the foot and height of the leg, both from the outer corner.
    pub(crate) length: f64,
    pub(crate) height: f64,
    /// Thickness of foot and leg.
    pub(crate) foot: f64,
    pub(crate) leg: f64,
    /// Radius of the fillet; 0 for a reflex corner.
    pub(crate) fillet: f64,
    /// Whether the foot ends flat; else it ends on a mirror plane at `length`.
    pub(crate) ends: bool,
}

impl Elbow {
    /// The centre of the fillet, which is the reflex corner where there is none.
    pub(crate) fn centre(&self) -> DVec2 {
        point(self.leg + self.fillet, self.foot + self.fillet)
    }

    /// The radius at the junction of the two outer lines and the fillet with centre `(a, b)` and radius `f`: the
    /// smaller root of `(s + f)^2 = (a - s)^2 + (b - s)^2`.
    fn junction(&self) -> f64 {
        let DVec2 { x: a, y: b } = self.centre();
        let sum = a + b + self.fillet;
        sum - (sum * sum - (a * a + b * b - self.fillet * self.fillet)).sqrt()
    }

    /// From the outer corner a diagonal to the junction; from there, between the fillet and each outer line, a
    /// parabola whose focus is the fillet's centre and whose directrix is the line, moved outward by the
    /// fillet's radius; beyond the fillet the middle lines of foot and leg, which fork at flat ends.
    pub(crate) fn profile(&self) -> Profile {
        let Self { length, height, foot, leg, fillet, ends } = *self;
        let (centre, s) = (self.centre(), self.junction());
        let end = length - if ends { foot / 2.0 } else { 0.0 };
        let nodes = vec![
            point(0.0, 0.0),
            point(s, s),
            point(centre.x, foot / 2.0),
            point(end, foot / 2.0),
            point(leg / 2.0, centre.y),
            point(leg / 2.0, height - leg / 2.0),
            point(0.0, height),
            point(leg, height),
            point(length, 0.0),
            point(length, foot),
        ];
        let [below, left, round, above, right, top, far]: [usize; 7] = [0, 1, 2, 3, 4, 5, 6];
        let sites = vec![
            Site::line(point(0.0, 0.0), point(1.0, 0.0)),
            Site::line(point(0.0, 1.0), point(0.0, 0.0)),
            Site::Round { centre, radius: fillet },
            Site::line(point(1.0, foot), point(0.0, foot)),
            Site::line(point(leg, 0.0), point(leg, 1.0)),
            Site::line(point(1.0, height), point(0.0, height)),
            Site::line(point(length, 0.0), point(length, 1.0)),
        ];
        let mut branches = vec![
            ([0, 1], [below, left]),
            ([1, 2], [below, round]),
            ([2, 3], [below, above]),
            ([1, 4], [round, left]),
            ([4, 5], [right, left]),
            ([5, 6], [left, top]),
            ([5, 7], [right, top]),
        ];
        if ends {
            branches.extend([([3, 8], [below, far]), ([3, 9], [above, far])]);
        }
        Profile { sites, nodes, branches }
    }

    /// The same with the leg at `outer` and the foot towards the axis of revolution: `x` becomes `outer - x`.
    pub(crate) fn mirrored(&self, outer: f64) -> Profile {
        let mut profile = self.profile();
        profile.nodes.iter_mut().for_each(|node| node.x = outer - node.x);
        for site in &mut profile.sites {
            match site {
                Site::Line { at, inward } => (at.x, inward.x) = (outer - at.x, -inward.x),
                Site::Round { centre, .. } => centre.x = outer - centre.x,
            }
        }
        profile
    }
}

/// A plate on the x axis with a rib across its middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rib {
    /// Half the length of the plate, and its thickness.
    pub(crate) half: f64,
    pub(crate) plate: f64,
    /// Half the thickness of the rib, and the height of its top.
    pub(crate) half_rib: f64,
    pub(crate) height: f64,
}

impl Rib {
    /// The plate's middle line on both sides; below the rib two parabolas, each between the bottom and one of the
    /// two reflex corners, which meet where both corners and the bottom are equally near; from there upward
    /// the bisector of the corners, then of the rib's sides.
    ///
    /// With thickness `t` and half thickness `w` of the rib, `w^2 + (t - z)^2 = z^2` at the junction.
    pub(crate) fn profile(&self) -> Profile {
        let Self { half, plate: t, half_rib: w, height } = *self;
        let junction = (w * w + t * t) / (2.0 * t);
        let [below, top, centre]: [usize; 3] = [0, 1, 2];
        let mut sites = vec![
            Site::line(point(0.0, 0.0), point(1.0, 0.0)),
            Site::line(point(1.0, height), point(0.0, height)),
        ];
        let mut nodes = vec![point(0.0, junction), point(0.0, t), point(0.0, height - w)];
        let mut branches = Vec::new();
        for side in [-1.0, 1.0] {
            let (site, node) = (sites.len(), nodes.len());
            let [reflex, above, flank, end] = [0, 1, 2, 3].map(|i| site + i);
            sites.extend([
                Site::Round { centre: point(side * w, t), radius: 0.0 },
                Site::Line { at: point(0.0, t), inward: point(0.0, -1.0) },
                Site::Line { at: point(side * w, 0.0), inward: point(-side, 0.0) },
                Site::Line { at: point(side * half, 0.0), inward: point(-side, 0.0) },
            ]);
            nodes.extend([
                point(side * w, t / 2.0),
                point(side * (half - t / 2.0), t / 2.0),
                point(side * half, 0.0),
                point(side * half, t),
                point(side * w, height),
            ]);
            branches.extend([
                ([0, node], [below, reflex]),
                ([node, node + 1], [below, above]),
                ([node + 1, node + 2], [below, end]),
                ([node + 1, node + 3], [above, end]),
                ([centre, node + 4], [flank, top]),
            ]);
        }
        // The sites of the other side come four later.
        let (reflex, flank) = (2, 4);
        branches.push(([0, 1], [reflex, reflex + 4]));
        branches.push(([1, 2], [flank, flank + 4]));
        Profile { sites, nodes, branches }
    }
}

/// A cone frustum between `z = -half` and `z = half`, with the larger radius below.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum {
    pub(crate) below: f64,
    pub(crate) above: f64,
    pub(crate) half: f64,
}

impl Frustum {
    /// On the axis the side is at the distance `R(z) c`, with `c` the cosine of its slope; it is as near as the
    /// bottom at the height `below c / (1 + k c)` and as near as the top at the depth `above c / (1 - k c)`,
    /// `k` being the loss of radius for each unit of height. From there a cone goes out to each crease.
    pub(crate) fn half_profile(&self) -> Profile {
        let Self { below, above, half } = *self;
        let loss = (below - above) / (2.0 * half);
        let cosine = 1.0 / 1.0_f64.hypot(loss);
        let low = below * cosine / (1.0 + loss * cosine) - half;
        let high = half - above * cosine / (1.0 - loss * cosine);
        let [bottom, top] = [point(below, -half), point(above, half)];
        let [bottom_cap, top_cap, side, other]: [usize; 4] = [0, 1, 2, 3];
        Profile {
            sites: vec![
                Site::line(point(0.0, -half), bottom),
                Site::line(top, point(0.0, half)),
                Site::line(bottom, top),
                Site::line(point(-above, half), point(-below, -half)),
            ],
            nodes: vec![point(0.0, low), point(0.0, high), bottom, top],
            branches: vec![
                ([0, 1], [side, other]),
                ([0, 2], [bottom_cap, side]),
                ([1, 3], [top_cap, side]),
            ],
        }
    }
}

// Planar profiles as triangles, and prisms over them.

/// A line across a profile, from its outer to its inner boundary, both in `(x, z)`.
pub(crate) type Across = [[f64; 2]; 2];

/// A triangulated profile in the plane `y = 0`, counter-clockwise in `(x, z)`.
pub(crate) struct Flat(TriMesh);

/// The profile that lines across it, in counter-clockwise order about the inner side, divide; each line in
/// `layers` parts. Where `closed`, the last line is followed by the first.
pub(crate) fn strip(lines: &[Across], layers: u32, closed: bool) -> Flat {
    let mut mesh = TriMesh::default();
    for &[outer, inner] in lines {
        mesh.vertices.extend((0..=layers).map(|k| {
            let [x, z] = [0, 1].map(|i| between(outer[i], inner[i], share(k, layers)));
            Vec3::new(x, 0.0, z)
        }));
    }
    let count = lines.len() as u32;
    for i in 0..if closed { count } else { count - 1 } {
        let [from, to] = [i, (i + 1) % count].map(|line| line * (layers + 1));
        for k in 0..layers {
            split(&mut mesh, [from + k + 1, from + k, to + k, to + k + 1]);
        }
    }
    Flat(mesh)
}

/// The triangle with base `2 half` on `z = 0` and its apex at `height`, its sides in `n` parts each.
pub(crate) fn flat_triangle(half: f64, height: f64, n: u32) -> Flat {
    let mut mesh = TriMesh::default();
    // First vertices of this row and of the one below.
    let (mut first, mut first_below) = (0, 0);
    for row in 0..=n {
        let up = f64::from(row) / f64::from(n);
        mesh.vertices.extend((0..=n - row).map(|i| {
            // Symmetric in `i`, so that the sides are as exact as the base.
            let across = f64::from(2 * i) - f64::from(n - row);
            Vec3::new(half * across / f64::from(n), 0.0, height * up)
        }));
        for i in 0..if row == 0 { 0 } else { n - row + 1 } {
            let (below, above) = (first_below + i, first + i);
            mesh.faces.push([below, below + 1, above]);
            if i < n - row {
                mesh.faces.push([below + 1, above + 1, above]);
            }
        }
        (first_below, first) = (first, mesh.vertices.len() as u32);
    }
    Flat(mesh)
}

/// Lines from a rectangle with half sides `half` to a circle inside it, counter-clockwise from its lower right
/// corner; `sides` parts for each vertical and each horizontal side.
///
/// The arcs belong to the sides of the holed plate for any rectangle, so that lines of rectangles of
/// several sizes meet their circles in the same directions.
pub(crate) fn around_hole(radius: f64, half: [f64; 2], sides: [u32; 2]) -> Vec<Across> {
    use std::f64::consts::PI;
    let [x, z] = half;
    let corner = HOLED_HALF.z.atan2(HOLED_HALF.x);
    let quarters = [
        (-corner, corner, [x, -z], [x, z], sides[0]),
        (corner, PI - corner, [x, z], [-x, z], sides[1]),
        (PI - corner, PI + corner, [-x, z], [-x, -z], sides[0]),
        (PI + corner, 2.0 * PI - corner, [-x, -z], [x, -z], sides[1]),
    ];
    let mut lines = Vec::new();
    for (from, to, start, end, n) in quarters {
        for i in 0..n {
            let t = share(i, n);
            let (sin, cos) = between(from, to, t).sin_cos();
            let outer = [0, 1].map(|axis| between(start[axis], end[axis], t));
            lines.push([outer, [radius * cos, radius * sin]]);
        }
    }
    lines
}

/// Lines across an elbow with a fillet, from the top of its leg to the end of its foot.
pub(crate) fn across_elbow(elbow: &Elbow, edge: f64) -> Vec<Across> {
    let Elbow { length, height, foot, leg, fillet, .. } = *elbow;
    let centre = elbow.centre();
    let quarter = std::f64::consts::FRAC_PI_2;
    // The outer sides of the corner are longer than half the fillet: parts of about `edge` between both.
    let n = parts((centre.x + quarter * fillet / 2.0) / 2.0, edge, 1);
    let upright = parts(height - centre.y, edge, 1);
    let flat = parts(length - centre.x, edge, 1);
    let leg_lines = (0..upright).map(|i| {
        let z = between(height, centre.y, share(i, upright));
        [[0.0, z], [leg, z]]
    });
    let corner_lines = (0..2 * n).map(|i| {
        let (sin, cos) = (2.0 * quarter + quarter * share(i, 2 * n)).sin_cos();
        let outer = match i < n {
            true => [0.0, between(centre.y, 0.0, share(i, n))],
            false => [between(0.0, centre.x, share(i - n, n)), 0.0],
        };
        [outer, [centre.x + fillet * cos, centre.y + fillet * sin]]
    });
    let foot_lines = (0..=flat).map(|i| {
        let x = between(centre.x, length, share(i, flat));
        [[x, 0.0], [x, foot]]
    });
    leg_lines.chain(corner_lines).chain(foot_lines).collect()
}

impl Flat {
    /// The prism `|y - middle| <= half` with layers of about `edge`, oriented outward.
    pub(crate) fn prism(&self, middle: f64, half: f64, edge: f64) -> TriMesh {
        let Self(flat) = self;
        let layers = parts(2.0 * half, edge, 1);
        let side = self.boundary();
        let mut mesh = TriMesh::default();
        // Vertex of each layer: all of the profile in the first and the last, its boundary between.
        let mut layer_ids: Vec<Vec<u32>> = Vec::new();
        for layer in 0..=layers {
            let y = between(middle - half, middle + half, share(layer, layers));
            let ids = (0..flat.vertices.len()).map(|v| {
                if layer > 0 && layer < layers && !side.on_it[v] {
                    return u32::MAX;
                }
                mesh.vertices.push(flat.vertices[v].with_y(y));
                mesh.vertices.len() as u32 - 1
            });
            layer_ids.push(ids.collect());
        }
        let at = |layer: u32, v: u32| layer_ids[layer as usize][v as usize];
        mesh.faces.extend(flat.faces.iter().map(|face| face.map(|v| at(0, v))));
        mesh.faces.extend(flat.faces.iter().map(|&[a, b, c]| [a, c, b].map(|v| at(layers, v))));
        for layer in 0..layers {
            for &[a, b] in &side.edges {
                split(&mut mesh, [at(layer, b), at(layer, a), at(layer + 1, a), at(layer + 1, b)]);
            }
        }
        mesh
    }

    /// The edges of one triangle alone, as that triangle has them.
    fn boundary(&self) -> Boundary {
        let Self(flat) = self;
        let sides = flat.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut directed: Vec<[u32; 2]> = sides.collect();
        directed.sort_unstable();
        let mut edges = directed.clone();
        edges.retain(|&[a, b]| directed.binary_search(&[b, a]).is_err());
        let mut on_it = vec![false; flat.vertices.len()];
        edges.as_flattened().iter().for_each(|&v| on_it[v as usize] = true);
        Boundary { edges, on_it }
    }
}

struct Boundary {
    edges: Vec<[u32; 2]>,
    /// Whether each vertex is on the boundary.
    on_it: Vec<bool>,
}
