//! The coarsest level within an error bound, by a search over sphere counts, for every method alike.

use medial::metrics::Judge;
use medial::simplifier::{Level, Simplification, Simplified, SimplifyError};

/// What [`search_error`] found.
pub struct Found {
    /// The simplified mesh.
    pub simplified: Simplified,
    /// Its symmetric Hausdorff distance, a fraction of the diagonal.
    pub hausdorff: f64,
    /// Number of levels that were tried.
    pub tried: usize,
}

/// The smallest sphere count found with a symmetric Hausdorff distance of at most `bound`.
///
/// Halves the count from `initial` until the bound is exceeded, then bisects between the last two
/// counts; `trying` is told each before it is tried. The error does not fall strictly with the count, so a smaller count that happens to
/// satisfy the bound can be missed; the returned mesh does satisfy it.
///
/// # Errors
/// [`SimplifyError::Level`] when even the initial mesh exceeds the bound, and what the method says.
pub fn search_error(
    simplification: &mut dyn Simplification,
    judge: &Judge,
    initial: usize,
    bound: f64,
    trying: impl Fn(usize),
) -> Result<Found, SimplifyError> {
    let mut tried = 0;
    let mut probe = |count: usize| -> Result<(Simplified, f64), SimplifyError> {
        tried += 1;
        trying(count);
        let simplified = simplification.at(Level::Spheres(count))?;
        let distances = judge.distances(&simplified.mesh);
        let hausdorff = distances.map_err(|e| SimplifyError::Level(e.to_string()))?.hausdorff;
        Ok((simplified, hausdorff))
    };
    let mut best = probe(initial)?;
    if best.1 > bound {
        return Err(SimplifyError::Level(format!(
            "no sphere count meets the bound: the initial medial mesh of {initial} spheres already \
             has a Hausdorff error of {:.3e} of the diagonal, more than {bound:.3e}; sample more densely",
            best.1
        )));
    }
    let (mut within, mut beyond) = (initial, 0);
    while within > 1 && beyond == 0 {
        let count = within / 2;
        let (simplified, hausdorff) = probe(count)?;
        if hausdorff > bound {
            beyond = count;
        } else {
            // The method may stop above the count; asking for less would give the same mesh.
            let stopped = simplified.mesh.spheres.len() > count;
            best = (simplified, hausdorff);
            within = count;
            if stopped {
                break;
            }
        }
    }
    while beyond > 0 && within - beyond > 1 {
        let count = beyond.midpoint(within);
        let (simplified, hausdorff) = probe(count)?;
        if hausdorff > bound {
            beyond = count;
        } else {
            best = (simplified, hausdorff);
            within = count;
        }
    }
    let (simplified, hausdorff) = best;
    Ok(Found { simplified, hausdorff, tried })
}
