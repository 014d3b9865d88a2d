//! The medial ball of a surface point, by shrinking.
//!
//! J. Ma, S. W. Bae, S. Choi 2012, *3D medial axis point approximation using nearest neighbors and the
//! normal field*, The Visual Computer 28, <https://doi.org/10.1007/s00371-011-0594-7>; as the
//! implementations that we read agree on it.
//!
//! The ball that touches the surface at `p`, with outward unit normal `n`, and passes through `q` has the
//! centre `p - r n` and `r = |p - q|^2 / (2 n . (p - q))`. Beginning with a ball that is too large, `q`
//! is the surface point nearest to the centre, again and again; `r` decreases, and in the end the ball is
//! empty.

use medial::Vec3;
use medial::complex::Sphere;
use medial::geometry::trees::PointTree;
use medial::surface::TriangleBvh;

/// Steps at most.
const STEPS: usize = 30;

/// A ball is empty if it holds nothing deeper than this, as a fraction of the box's longest side.
const EMPTY: f64 = 1e-5;

/// After the first step a ball that touches at points less than this angle apart, in degrees, seen from its
/// centre, is that of noise: the one before it is kept.
const SEPARATION: f64 = 20.0;

/// A contact is in front of the surface if the cosine of its angle to the normal is at most this.
const IN_FRONT: f64 = 1e-12;

/// What a ball may touch.
#[derive(Clone, Copy)]
pub(super) enum Touched<'a> {
    Points { tree: &'a PointTree, positions: &'a [Vec3] },
    Mesh(&'a TriangleBvh),
}

impl Touched<'_> {
    /// The nearest point, `None` if the query is not finite.
    fn nearest(&self, query: Vec3) -> Option<(Vec3, f64)> {
        match self {
            Self::Points { tree, positions } => {
                let (id, squared) = tree.nearest(query)?;
                Some((positions[id as usize], squared.sqrt()))
            }
            Self::Mesh(tree) => {
                let closest = tree.closest(query);
                closest.distance.is_finite().then_some((closest.point, closest.distance))
            }
        }
    }
}

/// A ball that has been shrunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ball {
    pub sphere: Sphere,
    /// Times that it shrank.
    pub steps: usize,
    pub end: End,
}

/// Why a ball shrinks no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// It is empty.
    Empty,
    /// The next contact is too near to the first, seen from the centre.
    Noise,
    /// The nearest point lies in front of the tangent plane: by rounding, or because of a wrong normal.
    InFront,
    /// All steps were taken.
    StepLimit,
}

/// The ball that touches at `p`, with outward unit normal `n`. `side` is the longest side of the bounding
/// box: no ball inside is as large.
pub(super) fn shrinking_ball(p: Vec3, n: Vec3, side: f64, touched: Touched<'_>) -> Ball {
    let mut radius = side;
    let ball = |radius: f64, steps: usize, end: End| Ball {
        sphere: Sphere::new(p - radius * n, radius),
        steps,
        end,
    };
    let half_separation = (0.5 * SEPARATION.to_radians()).sin();
    for steps in 0..STEPS {
        let nearest = touched.nearest(p - radius * n);
        let Some((q, distance)) = nearest.filter(|&(q, _)| q != p) else {
            return ball(radius, steps, End::Empty);
        };
        if distance >= radius - EMPTY * side {
            return ball(radius, steps, End::Empty);
        }
        let chord = p - q;
        let depth = n.dot(chord);
        if depth <= IN_FRONT * chord.length() {
            return ball(radius, steps, End::InFront);
        }
        let smaller = chord.length_squared() / (2.0 * depth);
        if smaller >= radius {
            return ball(radius, steps, End::Empty);
        }
        if steps > 0 && chord.length() < 2.0 * smaller * half_separation {
            return ball(radius, steps, End::Noise);
        }
        radius = smaller;
    }
    ball(radius, STEPS, End::StepLimit)
}
