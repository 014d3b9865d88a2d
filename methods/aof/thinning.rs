//! Homotopic deletion of voxels in a given order.
//!
//! - *Outermost first* (section 6.3): voxels above the flux threshold, by distance to the surface.
//! - *By flux*: K. Siddiqi, S. Bouix, A. Tannenbaum, S. W. Zucker, *Hamilton-Jacobi skeletons*,
//!   International Journal of Computer Vision 48(3), 2002, doi:10.1023/A:1016376116653, section
//!   3.3: simple voxels in a heap, the least medial first; an end point with a flux below a threshold
//!   is never deleted.
//!
//! 1. All border voxels that may be deleted are queued by key (file `queue.rs`).
//! 2. The first is taken. If it is simple and need not be kept, it is deleted, and those of its
//!    neighbours that may be deleted and are not queued are queued.
//!
//! An *end point* ends an open curve in one of nine digital planes through it: of its eight neighbours
//! in the plane exactly one exists, or two that touch.

use medial::simplifier::{RunContext, SimplifyError};

use super::bricks::{Bricks, Marks, Voxel};
use super::queue::BucketQueue;
use super::simple::{CENTRE, SimpleTable, is_simple, offset};

/// The voxels that are deleted, and their order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Those with a flux above the threshold, the smallest distance first.
    OutermostFirst {
        /// Flux at or below which a voxel stays.
        threshold: f32,
    },
    /// All but end points with a flux at or below the threshold, the largest flux first.
    ByFlux {
        /// Flux at or below which an end point stays.
        threshold: f32,
    },
    /// All, the largest flux first, until `to` voxels are left.
    Down {
        /// Number of voxels to leave.
        to: usize,
    },
}

impl Order {
    fn key(self, voxel: &Voxel) -> f32 {
        match self {
            Self::OutermostFirst { .. } => voxel.distance,
            Self::ByFlux { .. } | Self::Down { .. } => -voxel.flux,
        }
    }

    /// The range of the keys.
    fn keys(self, voxels: &Bricks) -> [f32; 2] {
        match self {
            Self::OutermostFirst { .. } => {
                [0.0, voxels.iter().map(|voxel| voxel.distance).fold(0.0, f32::max)]
            }
            Self::ByFlux { .. } | Self::Down { .. } => [-1.0, 1.0],
        }
    }

    fn may_go(self, voxel: &Voxel) -> bool {
        match self {
            Self::OutermostFirst { threshold } => voxel.flux > threshold,
            Self::ByFlux { .. } | Self::Down { .. } => true,
        }
    }

    fn stays(self, voxel: &Voxel, neighbourhood: u32) -> bool {
        match self {
            Self::ByFlux { threshold } => voxel.flux <= threshold && is_end_point(neighbourhood),
            Self::OutermostFirst { .. } | Self::Down { .. } => false,
        }
    }

    fn leaves(self) -> usize {
        match self {
            Self::Down { to } => to,
            Self::OutermostFirst { .. } | Self::ByFlux { .. } => 0,
        }
    }
}

/// From this number of voxels on the table of simple neighbourhoods is worth building.
const WITH_TABLE: usize = 40_000_000;

/// Deletes the voxels that are simple at the time they are taken from the queue.
///
/// # Errors
/// When the run was cancelled.
pub fn thin(voxels: &mut Bricks, order: Order, run: &RunContext) -> Result<(), SimplifyError> {
    let total = voxels.len();
    let table = (total >= WITH_TABLE).then(SimpleTable::get);
    let mut queue = BucketQueue::new(order.keys(voxels));
    // Places in the queue, and end points that must not be queued again.
    let mut barred = Marks::of(voxels);
    for voxel in voxels.iter() {
        // With all six face neighbours a voxel is not simple; a deletion beside it will queue it.
        let surrounded = voxels.neighbourhood(voxel.place) & FACES == FACES;
        if order.may_go(&voxel) && !surrounded {
            barred.set(voxel.place);
            queue.push(order.key(&voxel), voxel.place);
        }
    }
    let mut steps = 0_usize;
    while let Some(place) = queue.pop() {
        if voxels.len() <= order.leaves() {
            break;
        }
        steps += 1;
        if steps.is_multiple_of(65_536) {
            run.step((total - voxels.len()).min(total), total)?;
        }
        barred.clear(place);
        let neighbourhood = voxels.neighbourhood(place);
        let simple = match table {
            Some(table) => table.is_simple(neighbourhood),
            None => is_simple(neighbourhood),
        };
        // Not simple now; a deletion beside it will queue it again.
        if !simple {
            continue;
        }
        let voxel = voxels.get(place).expect("queued voxels are there");
        if order.stays(&voxel, neighbourhood) {
            barred.set(place);
            continue;
        }
        voxels.remove(place);
        for bit in ones(neighbourhood & !(1 << CENTRE) & !barred.neighbourhood(place)) {
            let step = offset(bit);
            let near = [0, 1, 2].map(|axis| (i32::from(place[axis]) + step[axis]) as u16);
            let voxel = voxels.get(near).expect("a neighbour that is there");
            if order.may_go(&voxel) {
                barred.set(near);
                queue.push(order.key(&voxel), near);
            }
        }
    }
    Ok(())
}

/// The six neighbours that share a face.
pub(super) const FACES: u32 = 1 << 4 | 1 << 10 | 1 << 12 | 1 << 14 | 1 << 16 | 1 << 22;

fn ones(mut bits: u32) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = (bits != 0).then(|| bits.trailing_zeros())?;
        bits &= bits - 1;
        Some(bit)
    })
}

/// Whether a voxel ends an open curve in one of the nine digital planes through it.
pub fn is_end_point(neighbourhood: u32) -> bool {
    PLANES.iter().any(|plane| {
        let there = neighbourhood & plane;
        match there.count_ones() {
            1 => true,
            2 => touch(there.trailing_zeros(), 31 - there.leading_zeros()),
            _ => false,
        }
    })
}

fn touch(a: u32, b: u32) -> bool {
    let (p, q) = (offset(a), offset(b));
    (0..3).all(|axis| (p[axis] - q[axis]).abs() <= 1)
}

/// The neighbours in the planes `x = 0`, `y = 0`, `z = 0`, `x = +-y`, `y = +-z`, `z = +-x`.
const PLANES: [u32; 9] = planes();

const fn planes() -> [u32; 9] {
    let normals = [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
        [1, -1, 0],
        [1, 1, 0],
        [0, 1, -1],
        [0, 1, 1],
        [1, 0, -1],
        [1, 0, 1],
    ];
    let mut masks = [0; 9];
    let mut plane = 0;
    while plane < 9 {
        let mut bit = 0;
        while bit < 27 {
            let (o, n) = (offset(bit), normals[plane]);
            if bit != CENTRE && o[0] * n[0] + o[1] * n[1] + o[2] * n[2] == 0 {
                masks[plane] |= 1 << bit;
            }
            bit += 1;
        }
        plane += 1;
    }
    masks
}
