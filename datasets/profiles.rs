//! Profiles of the built-in prisms and solids of revolution, with their medial axes in closed form.
//!
//! Each head names the junctions: the points with three nearest sites.

use medial::geometry::glam::DVec2;

use crate::planar::{Profile, Site};

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
        let across = |p: DVec2| point(outer - p.x, p.y);
        profile.nodes.iter_mut().for_each(|node| *node = across(*node));
        for site in &mut profile.sites {
            match site {
                Site::Line { at, inward } => (*at, inward.x) = (across(*at), -inward.x),
                Site::Round { centre, .. } => *centre = across(*centre),
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
        let corner = |x: f64| Site::Round { centre: point(x, t), radius: 0.0 };
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
                corner(side * w),
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
