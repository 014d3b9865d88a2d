//! Points on the unit sphere along a spiral.
//!
//! E. B. Saff, A. B. J. Kuijlaars, *Distributing many points on a sphere*, The Mathematical
//! Intelligencer 19(1), 1997, doi:10.1007/BF03024331 (the paper prints 1991).

use std::f64::consts::TAU;

use medial::Vec3;
use serde::{Deserialize, Serialize};

/// How points are put on a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spiral {
    /// Heights `-1 + (2k - 1) / N`, in the middle of zones of equal area.
    EqualArea,
    /// Heights `-1 + 2 (k - 1) / (N - 1)`, from pole to pole, as published.
    Classic,
}

impl Spiral {
    /// `count` unit vectors from the south pole up: each longitude is the one before plus
    /// `3.6 / sqrt(N (1 - h^2))`, and 0 at a pole.
    pub fn directions(self, count: usize) -> Vec<Vec3> {
        let n = count as f64;
        let mut longitude = 0.0_f64;
        (0..count)
            .map(|k| {
                let k = k as f64;
                let height = match self {
                    Self::EqualArea => -1.0 + (2.0 * k + 1.0) / n,
                    Self::Classic if count == 1 => -1.0,
                    Self::Classic => -1.0 + 2.0 * k / (n - 1.0),
                };
                let across = (1.0 - height * height).max(0.0).sqrt();
                let at_pole = across < 1e-9;
                longitude = if k == 0.0 || at_pole {
                    0.0
                } else {
                    (longitude + 3.6 / (n.sqrt() * across)) % TAU
                };
                Vec3::new(across * longitude.cos(), across * longitude.sin(), height)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest deviation of the flux through a sphere whose centre is on a sheet, over many
    /// orientations of the sheet.
    fn error_on_planes(spiral: Spiral, count: usize) -> f64 {
        let points = spiral.directions(count);
        let normals = Spiral::EqualArea.directions(4001);
        let flux = |n: &Vec3| -points.iter().map(|p| p.dot(*n).abs()).sum::<f64>() / count as f64;
        normals.iter().map(|n| (flux(n) + 0.5).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn quadrature_errors_on_planes_are_those_of_the_literature() {
        for (count, classic, equal) in [(50, 0.018, 0.011), (60, 0.013, 0.008), (70, 0.011, 0.007)]
        {
            let [c, e] = [Spiral::Classic, Spiral::EqualArea].map(|s| error_on_planes(s, count));
            // The published maxima are over random planes, to three digits after the point.
            assert!((c - classic).abs() < 1.5e-3, "classic {count}: {c}");
            assert!((e - equal).abs() < 1.5e-3, "equal area {count}: {e}");
        }
        assert!(error_on_planes(Spiral::EqualArea, 500) < 0.002);
    }

    #[test]
    fn points_are_on_the_sphere_and_the_classic_ones_reach_the_poles() {
        for spiral in [Spiral::Classic, Spiral::EqualArea] {
            for count in [1, 2, 3, 50, 1000] {
                let points = spiral.directions(count);
                assert_eq!(points.len(), count);
                assert!(points.iter().all(|p| (p.length() - 1.0).abs() < 1e-12));
            }
        }
        let classic = Spiral::Classic.directions(60);
        assert_eq!([classic[0].z, classic[59].z], [-1.0, 1.0]);
    }
}
