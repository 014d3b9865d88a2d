//! Tangent planes of slabs and cones, and the quadrics that are made of them.

use medial_geometry::Vec3;
use medial_geometry::{Cone, Slab, Sphere};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

type Matrix = [[f64; 4]; 4];

fn vector(rng: &mut Pcg64) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0
}

fn sphere(rng: &mut Pcg64) -> Sphere {
    Sphere::new(vector(rng), rng.random::<f64>() * 0.5)
}

/// Sum of `(n, 1)(n, 1)^T` over planes.
fn quadric(normals: &[Vec3]) -> Matrix {
    let mut sum = [[0.0; 4]; 4];
    for n in normals {
        let n = [n.x, n.y, n.z, 1.0];
        for i in 0..4 {
            for j in 0..4 {
                sum[i][j] += n[i] * n[j];
            }
        }
    }
    sum
}

/// `(m - o)^T A (m - o)`.
fn error(a: &Matrix, m: Sphere, origin: Sphere) -> f64 {
    let d = m.centre - origin.centre;
    let d = [d.x, d.y, d.z, m.radius - origin.radius];
    (0..4).map(|i| (0..4).map(|j| d[i] * a[i][j] * d[j]).sum::<f64>()).sum()
}

/// Rank by elimination with full pivoting.
fn rank(mut a: Matrix) -> usize {
    for step in 0..4 {
        let pivots = (step..4).flat_map(|i| (step..4).map(move |j| (i, j)));
        let Some((i, j)) = pivots.max_by(|p, q| a[p.0][p.1].abs().total_cmp(&a[q.0][q.1].abs()))
        else {
            return step;
        };
        if a[i][j].abs() < 1e-9 {
            return step;
        }
        a.swap(step, i);
        for row in &mut a {
            row.swap(step, j);
        }
        for row in step + 1..4 {
            let factor = a[row][step] / a[step][step];
            for column in step..4 {
                a[row][column] -= factor * a[step][column];
            }
        }
    }
    4
}

#[test]
fn slab_planes_touch_all_three_balls() {
    let mut rng = Pcg64::seed_from_u64(5);
    let (mut with, mut without) = (0, 0);
    for _ in 0..2000 {
        let m = [(); 3].map(|()| sphere(&mut rng));
        let slab = Slab::new(m);
        let Some(planes) = slab.planes() else {
            without += 1;
            continue;
        };
        with += 1;
        let normals = planes.normals();
        for n in normals {
            assert!((n.length() - 1.0).abs() < 1e-12);
            let offsets = m.map(|m| n.dot(m.centre) + m.radius);
            let spread = offsets.map(|o| (o - offsets[0]).abs());
            assert!(spread.iter().all(|&s| s < 1e-11), "{offsets:?}");
            // The touched points are on the boundary of the hull, so the plane is outside.
            for ball in m {
                assert!(slab.signed_distance(ball.centre + ball.radius * n).abs() < 1e-10);
            }
        }
        let turn = (m[1].centre - m[0].centre).cross(m[2].centre - m[0].centre);
        assert!(
            planes.centre_normal.dot(turn) > 0.0 && normals[0].dot(turn) > normals[1].dot(turn)
        );

        let a = quadric(&normals);
        let g = planes.gradient;
        let block = 2.0 * g.x * g.y
            + 2.0 * planes.rise.powi(2) * planes.centre_normal.x * planes.centre_normal.y;
        assert!((a[0][1] - block).abs() < 1e-12 && (a[0][3] + 2.0 * g.x).abs() < 1e-12);
        assert_eq!(rank(a), 2);
        for _ in 0..4 {
            let [s, t] = [(); 2].map(|()| rng.random::<f64>() * 6.0 - 3.0);
            let affine = Sphere::new(
                m[0].centre + s * (m[1].centre - m[0].centre) + t * (m[2].centre - m[0].centre),
                m[0].radius + s * (m[1].radius - m[0].radius) + t * (m[2].radius - m[0].radius),
            );
            assert!(error(&a, affine, m[0]).abs() < 1e-11);
        }
    }
    assert!(with > 1000 && without > 20, "{with} with planes, {without} without");
}

#[test]
fn cone_planes_do_not_depend_on_the_frame() {
    let mut rng = Pcg64::seed_from_u64(6);
    for _ in 0..2000 {
        let [a, b] = [(); 2].map(|()| sphere(&mut rng));
        let Some(frame) = Cone::new(a, b).frame() else {
            assert!(a.centre.distance(b.centre) <= (a.radius - b.radius).abs());
            continue;
        };
        let sum = quadric(&frame.normals());
        let (s, u) = (frame.s, frame.u);
        for i in 0..3 {
            for j in 0..3 {
                let across = f64::from(u8::from(i == j)) - u[i] * u[j];
                let closed = 4.0 * s * s * u[i] * u[j] + 2.0 * (1.0 - s * s) * across;
                assert!((sum[i][j] - closed).abs() < 1e-13);
            }
            assert!((sum[i][3] + 4.0 * s * u[i]).abs() < 1e-13);
            let along: f64 = (0..3).map(|j| sum[i][j] * u[j]).sum::<f64>() + sum[i][3] * s;
            assert!(along.abs() < 1e-13, "the null vector is (u, s)");
        }
        assert!((sum[3][3] - 4.0).abs() < 1e-13);
        if s.abs() < 0.9999 {
            assert_eq!(rank(sum), 3);
        }
        assert!(error(&sum, a.lerp(b, 7.0 * rng.random::<f64>()), a).abs() < 1e-11);
        for n in frame.normals() {
            assert!((n.dot(b.centre - a.centre) + b.radius - a.radius).abs() < 1e-13);
        }
    }
}
