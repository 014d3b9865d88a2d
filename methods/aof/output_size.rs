//! The memory of a medial mesh before it is made.
//!
//! A sheet of a plain result is at least two voxels thick, and voxels that touch are joined. The
//! triangles between them, and the tetrahedra that are checked for voids, far outnumber the voxels.

use medial::simplifier::SimplifyError;

use super::advice::BYTES_PER_VOXEL;
use super::base::Base;
use super::bricks::Bricks;
use super::simple::{CENTRE, offset};
use super::solid::{Axis, Solid};

/// Bytes for each voxel of a result: its neighbours, its ball while it is moved, what is returned.
const PER_VOXEL: f64 = 450.0;
/// Bytes for each edge, triangle and tetrahedron, in vectors that grow.
const PER_SIMPLEX: [f64; 3] = [16.0, 50.0, 40.0];

/// Resident bytes for each byte in use: what is freed on the way does not all go back.
const RESIDENT: f64 = 1.75;

impl Solid<'_> {
    /// Refuses a result whose medial mesh does not fit into memory beside the voxels of its base.
    pub(super) fn check_output(&self, base: &Base, axis: &Axis) -> Result<(), SimplifyError> {
        let limit = self.params().max_memory;
        let needed = self.megabytes_with_output(base, axis);
        if needed <= limit {
            return Ok(());
        }
        // Voxels of sheets grow with the square of the resolution.
        let fits = f64::from(base.resolution) * (limit / needed).sqrt() * 0.97;
        Err(SimplifyError::Parameter(format!(
            "resolution = {}: about {needed:.0} MB for {} voxels and the medial mesh of {}, above \
             max_memory = {limit}; about resolution = {} fits, or raise max_memory",
            base.resolution,
            base.descent.tally.start,
            axis.len(),
            fits.max(1.0) as u32
        )))
    }

    /// Memory for the voxels of a base and for the medial mesh of an axis, in megabytes.
    pub(super) fn megabytes_with_output(&self, base: &Base, axis: &Axis) -> f64 {
        let mut voxels = Bricks::new(axis.grid.size);
        axis.voxels.iter().for_each(|&voxel| voxels.insert(voxel));
        let mut numbers = [0_u64; 3];
        for voxel in &axis.voxels {
            let own = simplices(voxels.neighbourhood(voxel.place));
            numbers.iter_mut().zip(own).for_each(|(all, own)| *all += u64::from(own));
        }
        let simplices = numbers.iter().zip(PER_SIMPLEX).map(|(&n, bytes)| n as f64 * bytes);
        let output = axis.len() as f64 * PER_VOXEL + simplices.sum::<f64>();
        let start = base.descent.tally.start as f64 * BYTES_PER_VOXEL;
        RESIDENT * (output + start) / 1e6
    }
}

/// Edges, triangles and tetrahedra of mutually adjacent voxels of which a voxel is the first.
fn simplices(neighbourhood: u32) -> [u32; 3] {
    let after = neighbourhood & !((2 << CENTRE) - 1);
    let mut numbers = [after.count_ones(), 0, 0];
    for b in ones(after) {
        let with_b = after & ADJACENT_AFTER[b as usize];
        numbers[1] += with_b.count_ones();
        for c in ones(with_b) {
            numbers[2] += (with_b & ADJACENT_AFTER[c as usize]).count_ones();
        }
    }
    numbers
}

fn ones(bits: u32) -> impl Iterator<Item = u32> {
    (0..27).filter(move |bit| bits >> bit & 1 == 1)
}

/// For each of the 27 places the later ones that touch it.
const ADJACENT_AFTER: [u32; 27] = adjacent_after();

const fn adjacent_after() -> [u32; 27] {
    let mut masks = [0; 27];
    let mut a = 0;
    while a < 27 {
        let mut b = a + 1;
        while b < 27 {
            let (p, q) = (offset(a), offset(b));
            let near =
                (p[0] - q[0]).abs() <= 1 && (p[1] - q[1]).abs() <= 1 && (p[2] - q[2]).abs() <= 1;
            if near {
                masks[a as usize] |= 1 << b;
            }
            b += 1;
        }
        a += 1;
    }
    masks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simplices_of_a_full_block_are_its_cliques() {
        // A voxel with all its 26 neighbours: 13 come after it.
        assert_eq!(simplices((1 << 27) - 1)[0], 13);
        // The corner of a block of 2 x 2 x 2: all subsets of the seven others.
        let block = (0..27).filter(|&bit| offset(bit).iter().all(|&x| x >= 0));
        let block = block.fold(0, |bits, bit| bits | 1 << bit);
        assert_eq!(simplices(block), [7, 21, 35]);
        assert_eq!(simplices(1 << CENTRE), [0, 0, 0]);
    }
}
