//! The exact stage of [`super::power_size`]: its polynomials in fixed-width integers.
//!
//! Tiers as in [`super::exact`]. The size of a tetrahedron, the longest value (degree 8), takes 8, 16
//! or 160 words. In the first two tiers weights have at most 122 and 250 bits in units of the squared
//! quantum. So a lift has at most 125 and 254 bits, and no sum below reaches its sign bit.

use super::differences::{Differences, differences, highest_bit, lowest_bit, to_wide, widen};
use super::exact::minor;
use super::wide::Wide;
use super::{Sign, Site};

/// A polynomial in `K` differences `d` to an origin of weight `w`, and the lifts `l`. The widths
/// are in words, named by degree.
pub(super) trait Form<const K: usize> {
    fn sign<
        const D: usize,
        const D2: usize,
        const D3: usize,
        const D4: usize,
        const D6: usize,
        const D8: usize,
    >(
        d: &[[Wide<D>; 3]; K],
        l: &[Wide<D2>; K],
        w: Wide<D2>,
    ) -> Sign;
}

/// The sign of a form of the differences of `others` to `origin`.
#[cold]
#[inline(never)]
pub(super) fn sign<F: Form<K>, const K: usize>(origin: &Site, others: [&Site; K]) -> Sign {
    let weights = others.map(|s| s.w);
    let (mut cap, mut top) = (lowest_bit(origin.w), highest_bit(origin.w));
    for w in weights {
        cap = cap.min(lowest_bit(w));
        top = top.max(highest_bit(w));
    }
    // Weights are integers in units of the squared quantum.
    let cap = if cap == i32::MAX { cap } else { cap.div_euclid(2) };
    let (d, quantum) = differences(others.map(|s| &s.p), &origin.p, cap);
    let unit = 2 * quantum;
    let below = |limit: i32| top == i32::MIN || top - unit <= limit;
    let w = (origin.w, weights);
    match d {
        Differences::One(d) if below(122) => {
            evaluate::<F, K, 1, 2, 3, 4, 6, 8>(&lengthen(&d), w, unit)
        }
        Differences::One(d) if below(250) => {
            evaluate::<F, K, 2, 4, 6, 8, 12, 16>(&lengthen(&d), w, unit)
        }
        Differences::Two(d) if below(250) => {
            evaluate::<F, K, 2, 4, 6, 8, 12, 16>(&widen(&d), w, unit)
        }
        Differences::One(d) => evaluate::<F, K, 20, 40, 60, 80, 120, 160>(&lengthen(&d), w, unit),
        Differences::Two(d) => evaluate::<F, K, 20, 40, 60, 80, 120, 160>(&widen(&d), w, unit),
        Differences::Any(d) => evaluate::<F, K, 20, 40, 60, 80, 120, 160>(&d, w, unit),
    }
}

fn lengthen<const K: usize, const N: usize>(d: &[[i64; 3]; K]) -> [[Wide<N>; 3]; K] {
    d.map(|p| p.map(|x| Wide::from_i128(x.into())))
}

fn evaluate<
    F: Form<K>,
    const K: usize,
    const D: usize,
    const D2: usize,
    const D3: usize,
    const D4: usize,
    const D6: usize,
    const D8: usize,
>(
    d: &[[Wide<D>; 3]; K],
    (w, weights): (f64, [f64; K]),
    unit: i32,
) -> Sign {
    let w: Wide<D2> = to_wide(w, unit);
    let mut l = [w; K];
    for i in 0..K {
        l[i] = dot::<D, D2>(&d[i], &d[i]).add(w).sub(to_wide(weights[i], unit));
    }
    F::sign::<D, D2, D3, D4, D6, D8>(d, &l, w)
}

#[inline]
fn dot<const D: usize, const D2: usize>(a: &[Wide<D>; 3], b: &[Wide<D>; 3]) -> Wide<D2> {
    a[0].mul::<D, D2>(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}

#[inline]
fn cross<const D: usize, const D2: usize>(a: &[Wide<D>; 3], b: &[Wide<D>; 3]) -> [Wide<D2>; 3] {
    [[1, 2], [2, 0], [0, 1]].map(|[y, z]| minor(&[a[y], a[z], a[y]], &[b[y], b[z], b[y]]))
}

#[inline]
fn twice<const N: usize>(a: Wide<N>) -> Wide<N> {
    a.add(a)
}

pub(super) struct TetrahedronSize;

impl Form<3> for TetrahedronSize {
    fn sign<
        const D: usize,
        const D2: usize,
        const D3: usize,
        const D4: usize,
        const D6: usize,
        const D8: usize,
    >(
        [a, b, c]: &[[Wide<D>; 3]; 3],
        l: &[Wide<D2>; 3],
        w: Wide<D2>,
    ) -> Sign {
        let normals: [[Wide<D2>; 3]; 3] = [cross(b, c), cross(c, a), cross(a, b)];
        let n: [Wide<D4>; 3] = [0, 1, 2].map(|k| {
            let term = |i: usize| normals[i][k].mul::<D2, D4>(l[i]);
            term(0).add(term(1)).add(term(2))
        });
        let n2: Wide<D8> = dot(&n, &n);
        let row = |k: usize| normals[0][k].mul::<D, D3>(a[k]);
        let det = row(0).add(row(1)).add(row(2));
        let det2: Wide<D6> = det.mul(det);
        n2.sub(det2.mul(twice(twice(w)))).sign()
    }
}

pub(super) struct TriangleSize;

impl Form<2> for TriangleSize {
    fn sign<
        const D: usize,
        const D2: usize,
        const D3: usize,
        const D4: usize,
        const D6: usize,
        const D8: usize,
    >(
        [a, b]: &[[Wide<D>; 3]; 2],
        [l, m]: &[Wide<D2>; 2],
        w: Wide<D2>,
    ) -> Sign {
        let (aa, bb, ab): (Wide<D2>, Wide<D2>, Wide<D2>) = (dot(a, a), dot(b, b), dot(a, b));
        let nu: Wide<D4> = aa.mul::<D2, D4>(bb).sub(ab.mul(ab));
        let squares: Wide<D6> =
            l.mul::<D2, D4>(*l).mul::<D2, D6>(bb).add(m.mul::<D2, D4>(*m).mul(aa));
        let mixed: Wide<D6> = l.mul::<D2, D4>(*m).mul(ab);
        squares.sub(twice(mixed)).sub(nu.mul(twice(twice(w)))).sign()
    }
}

pub(super) struct EdgeSize;

impl Form<1> for EdgeSize {
    fn sign<
        const D: usize,
        const D2: usize,
        const D3: usize,
        const D4: usize,
        const D6: usize,
        const D8: usize,
    >(
        [a]: &[[Wide<D>; 3]; 1],
        [l]: &[Wide<D2>; 1],
        w: Wide<D2>,
    ) -> Sign {
        let aa: Wide<D2> = dot(a, a);
        l.mul::<D2, D4>(*l).sub(aa.mul(twice(twice(w)))).sign()
    }
}

pub(super) struct TriangleClearance;

impl Form<3> for TriangleClearance {
    fn sign<
        const D: usize,
        const D2: usize,
        const D3: usize,
        const D4: usize,
        const D6: usize,
        const D8: usize,
    >(
        [a, b, v]: &[[Wide<D>; 3]; 3],
        [l, m, lv]: &[Wide<D2>; 3],
        _: Wide<D2>,
    ) -> Sign {
        let (aa, bb, ab): (Wide<D2>, Wide<D2>, Wide<D2>) = (dot(a, a), dot(b, b), dot(a, b));
        let (av, bv): (Wide<D2>, Wide<D2>) = (dot(a, v), dot(b, v));
        let nu: Wide<D4> = aa.mul::<D2, D4>(bb).sub(ab.mul(ab));
        let along_a: Wide<D4> = l.mul::<D2, D4>(bb).sub(m.mul(ab));
        let along_b: Wide<D4> = m.mul::<D2, D4>(aa).sub(l.mul(ab));
        nu.mul::<D2, D6>(*lv).sub(along_a.mul(av)).sub(along_b.mul(bv)).sign()
    }
}

pub(super) struct EdgeClearance;

impl Form<2> for EdgeClearance {
    fn sign<
        const D: usize,
        const D2: usize,
        const D3: usize,
        const D4: usize,
        const D6: usize,
        const D8: usize,
    >(
        [a, v]: &[[Wide<D>; 3]; 2],
        [l, lv]: &[Wide<D2>; 2],
        _: Wide<D2>,
    ) -> Sign {
        let (aa, av): (Wide<D2>, Wide<D2>) = (dot(a, a), dot(a, v));
        lv.mul::<D2, D4>(aa).sub(l.mul(av)).sign()
    }
}

pub(super) struct VertexClearance;

impl Form<1> for VertexClearance {
    fn sign<
        const D: usize,
        const D2: usize,
        const D3: usize,
        const D4: usize,
        const D6: usize,
        const D8: usize,
    >(
        _: &[[Wide<D>; 3]; 1],
        [lv]: &[Wide<D2>; 1],
        _: Wide<D2>,
    ) -> Sign {
        lv.sign()
    }
}
