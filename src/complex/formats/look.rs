//! What files for viewers show beside the medial mesh itself: a value at each sphere, as a colour.

use crate::ColourMap;
use crate::complex::{MedialMesh, stability_ratio};

/// A value at each sphere, and the colours that it stands for.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereValues {
    /// The word for it in files: `radius`, `stability`, `error`. Letters, digits and `_` only.
    pub name: &'static str,
    /// A finite value for each sphere.
    pub values: Vec<f64>,
    /// The value at the low end of the colours; what is below has the same colour.
    pub low: f64,
    /// The value at the high end.
    pub high: f64,
    /// The colours.
    pub map: ColourMap,
    /// What the value is, in a few words, with its unit.
    pub meaning: &'static str,
}

impl SphereValues {
    /// The radii, from the least to the largest.
    pub fn radius(mesh: &MedialMesh) -> Self {
        let values: Vec<f64> = mesh.spheres.iter().map(|sphere| sphere.radius).collect();
        let high = values.iter().copied().fold(0.0, f64::max);
        let low = values.iter().copied().fold(high, f64::min);
        let meaning = "radius, in the unit of the coordinates";
        Self { name: "radius", values, low, high, map: ColourMap::Viridis, meaning }
    }

    /// Stability ratios ([`stability_ratio`]), 0 to 1: of a sphere the least of its edges', of one without edges 1,
    /// since a ball alone is no spike. `diagonal` is the length that counts as 1 for edges without length, in the
    /// unit of the mesh.
    ///
    /// # Panics
    /// If the mesh is not in canonical form; see [`MedialMesh::check`].
    pub fn stability(mesh: &MedialMesh, diagonal: f64) -> Self {
        let mut values = vec![1.0_f64; mesh.spheres.len()];
        let scaled = |v: u32| {
            let mut sphere = mesh.spheres[v as usize];
            sphere.centre /= diagonal;
            sphere.radius /= diagonal;
            sphere
        };
        for &[a, b] in &mesh.edges {
            let ratio = stability_ratio(scaled(a), scaled(b));
            for v in [a, b] {
                values[v as usize] = values[v as usize].min(ratio);
            }
        }
        let meaning = "stability ratio, the least of the sphere's edges";
        Self { name: "stability", values, low: 0.0, high: 1.0, map: ColourMap::Viridis, meaning }
    }

    /// Errors of either sign, zero in the middle of the colours: of each sphere, by how much it reaches out of the
    /// surface (positive) or falls short of it (negative), in the unit of the mesh. 99 % of them are within the ends,
    /// so that a single bad sphere does not make all others look alike.
    pub fn error(values: Vec<f64>) -> Self {
        let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let place = (sizes.len().saturating_sub(1) as f64 * SPANNED) as usize;
        let high = sizes.get(place).copied().unwrap_or(0.0);
        let meaning = "radius less the depth of the centre below the surface, in the unit of the coordinates: positive \
                       outside";
        Self { name: "error", values, low: -high, high, map: ColourMap::Diverging, meaning }
    }

    /// Where the value of a sphere is between the ends, 0 to 1 inside; in the middle where they are equal.
    pub fn place(&self, sphere: usize) -> f64 {
        let extent = self.high - self.low;
        if extent > 0.0 { (self.values[sphere] - self.low) / extent } else { 0.5 }
    }
}

/// Share of the errors within the ends of their colours.
const SPANNED: f64 = 0.99;

/// How a file for viewers shows a medial mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Look {
    /// What it is coloured by; the radii where there is nothing. Only `.vtp` and `.glb` hold it.
    pub values: Option<SphereValues>,
    /// The spheres themselves as well, as round bodies of 80 triangles. Only in `.glb`.
    pub balls: bool,
}
