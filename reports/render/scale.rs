//! A colour map over a range of values.

use medial::ColourMap;
use medial::complex::MedialMesh;

/// A colour map over a range of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    pub(crate) lo: f64,
    pub(crate) hi: f64,
    pub(crate) map: ColourMap,
}

impl Scale {
    /// Radii from the least to the largest of some medial meshes.
    pub(crate) fn radii<'m>(meshes: impl IntoIterator<Item = &'m MedialMesh>) -> Self {
        let radii = meshes.into_iter().flat_map(|mesh| mesh.spheres.iter().map(|s| s.radius));
        let (lo, hi) = radii.fold((f64::INFINITY, 0.0), |(lo, hi), r| (r.min(lo), r.max(hi)));
        Self { lo: lo.min(hi), hi, map: ColourMap::Viridis }
    }

    /// Errors of either sign up to a largest.
    pub(crate) fn errors(largest: f64) -> Self {
        Self { lo: -largest, hi: largest, map: ColourMap::Diverging }
    }

    /// Where a value is, 0 to 1 inside the range; in the middle of a range without extent.
    pub(super) fn place(&self, value: f64) -> f32 {
        let extent = self.hi - self.lo;
        if extent > 0.0 { ((value - self.lo) / extent) as f32 } else { 0.5 }
    }
}
