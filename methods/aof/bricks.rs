//! Voxels in sparse bricks of 8 x 8 x 8.
//!
//! Bricks are there where voxels are: memory is 4.2 KB for each brick with a voxel, and four bytes
//! for each brick of the bounding box.

/// Voxels along a side of a brick.
const SIDE: u32 = 8;
const ABSENT: u32 = u32::MAX;

/// Indices of a voxel along the three axes, from the lower corner of the bounding box.
pub type Place = [u16; 3];

/// What is known of a voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voxel {
    /// Where it is.
    pub place: Place,
    /// Distance of its centre to the surface, a fraction of the diagonal.
    pub distance: f32,
    /// `AOF'`; 0 where it was dismissed at a coarser level.
    pub flux: f32,
}

/// A set of voxels with values.
#[derive(Clone, Debug)]
pub struct Bricks {
    /// Bricks along each axis.
    size: [u32; 3],
    table: Vec<u32>,
    bricks: Vec<Brick>,
    len: usize,
}

#[derive(Clone, Debug)]
struct Brick {
    at: [u32; 3],
    /// One bit for each voxel: a byte for each row along x, a word for each layer.
    there: [u64; 8],
    distance: Vec<f32>,
    flux: Vec<f32>,
}

impl Bricks {
    /// No voxel of a grid of so many along each axis.
    pub fn new(grid: [u32; 3]) -> Self {
        let size = grid.map(|n| n.div_ceil(SIDE));
        let table = vec![ABSENT; size.iter().map(|&n| n as usize).product()];
        Self { size, table, bricks: Vec::new(), len: 0 }
    }

    /// Whether there is no voxel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Puts in a voxel that is not there yet.
    pub fn insert(&mut self, voxel: Voxel) {
        let at = voxel.place.map(|x| u32::from(x) / SIDE);
        let slot = self.slot(at);
        if self.table[slot] == ABSENT {
            self.table[slot] = self.bricks.len() as u32;
            let values = vec![0.0; (SIDE * SIDE * SIDE) as usize];
            self.bricks.push(Brick { at, there: [0; 8], distance: values.clone(), flux: values });
        }
        let brick = &mut self.bricks[self.table[slot] as usize];
        let (layer, bit) = inside(voxel.place);
        debug_assert!(brick.there[layer] >> bit & 1 == 0, "inserted twice");
        brick.there[layer] |= 1 << bit;
        brick.distance[64 * layer + bit] = voxel.distance;
        brick.flux[64 * layer + bit] = voxel.flux;
        self.len += 1;
    }

    /// Takes out a voxel that is there.
    pub fn remove(&mut self, place: Place) {
        let slot = self.slot(place.map(|x| u32::from(x) / SIDE));
        let (layer, bit) = inside(place);
        self.bricks[self.table[slot] as usize].there[layer] &= !(1 << bit);
        self.len -= 1;
    }

    /// The voxel at a place, if there is one.
    pub fn get(&self, place: Place) -> Option<Voxel> {
        let brick = self.brick(place.map(|x| u32::from(x) / SIDE))?;
        let (layer, bit) = inside(place);
        (brick.there[layer] >> bit & 1 == 1).then(|| brick.voxel(layer, bit))
    }

    /// Which of a voxel's 27 neighbours are there, itself included: bit
    /// `dx + 1 + 3 (dy + 1) + 9 (dz + 1)`.
    pub fn neighbourhood(&self, place: Place) -> u32 {
        let [x, y, z] = place.map(i32::from);
        let within = |v: i32| (1..SIDE as i32 - 1).contains(&(v % SIDE as i32));
        if within(x) && within(y) && within(z) {
            let Some(brick) = self.brick(place.map(|x| u32::from(x) / SIDE)) else {
                return 0;
            };
            let (layer, bit) = inside(place);
            return (0..3).fold(0, |bits, k| {
                let rows = brick.there[layer + k - 1] >> (bit - 9);
                let nine = (rows & 7) | (rows >> 8 & 7) << 3 | (rows >> 16 & 7) << 6;
                bits | (nine as u32) << (9 * k)
            });
        }
        (0..27).fold(0, |bits, k| {
            bits | u32::from(self.has([x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1])) << k
        })
    }

    fn has(&self, place: [i32; 3]) -> bool {
        let limit = |axis: usize| (self.size[axis] * SIDE) as i32;
        if (0..3).any(|axis| place[axis] < 0 || place[axis] >= limit(axis)) {
            return false;
        }
        let place = place.map(|x| x as u16);
        let (layer, bit) = inside(place);
        let brick = self.brick(place.map(|x| u32::from(x) / SIDE));
        brick.is_some_and(|brick| brick.there[layer] >> bit & 1 == 1)
    }

    /// All voxels, brick by brick.
    pub fn iter(&self) -> impl Iterator<Item = Voxel> + '_ {
        self.bricks.iter().flat_map(|brick| {
            (0..8).flat_map(move |layer| {
                let mut bits = brick.there[layer];
                std::iter::from_fn(move || {
                    let bit = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
                    bits &= bits - 1;
                    Some(brick.voxel(layer, bit))
                })
            })
        })
    }

    /// Resident bytes, about.
    pub fn bytes(&self) -> usize {
        let brick = size_of::<Brick>() + 8 * (SIDE * SIDE * SIDE) as usize;
        4 * self.table.len() + brick * self.bricks.len()
    }

    fn slot(&self, at: [u32; 3]) -> usize {
        let [x, y, z] = at.map(|n| n as usize);
        x + self.size[0] as usize * (y + self.size[1] as usize * z)
    }

    fn brick(&self, at: [u32; 3]) -> Option<&Brick> {
        self.bricks.get(self.table[self.slot(at)] as usize)
    }
}

/// A mark for each place of a set of bricks.
pub struct Marks {
    size: [u32; 3],
    table: Vec<u32>,
    marks: Vec<[u64; 8]>,
}

impl Marks {
    /// No mark on any place of these bricks.
    pub fn of(bricks: &Bricks) -> Self {
        let marks = vec![[0; 8]; bricks.bricks.len()];
        Self { size: bricks.size, table: bricks.table.clone(), marks }
    }

    /// Marks a place; whether it had no mark.
    pub fn set(&mut self, place: Place) -> bool {
        let (word, bit) = self.word(place);
        let new = *word >> bit & 1 == 0;
        *word |= 1 << bit;
        new
    }

    /// Takes the mark from a place.
    pub fn clear(&mut self, place: Place) {
        let (word, bit) = self.word(place);
        *word &= !(1 << bit);
    }

    fn word(&mut self, place: Place) -> (&mut u64, usize) {
        let [x, y, z] = place.map(|v| usize::from(v) / SIDE as usize);
        let slot = x + self.size[0] as usize * (y + self.size[1] as usize * z);
        let (layer, bit) = inside(place);
        (&mut self.marks[self.table[slot] as usize][layer], bit)
    }
}

impl Brick {
    fn voxel(&self, layer: usize, bit: usize) -> Voxel {
        let inner = [bit as u32 % SIDE, bit as u32 / SIDE, layer as u32];
        let place = [0, 1, 2].map(|axis| (self.at[axis] * SIDE + inner[axis]) as u16);
        let index = 64 * layer + bit;
        Voxel { place, distance: self.distance[index], flux: self.flux[index] }
    }
}

/// Layer of a place in its brick, and bit in the layer.
fn inside(place: Place) -> (usize, usize) {
    let [x, y, z] = place.map(|v| usize::from(v) % SIDE as usize);
    (z, x + SIDE as usize * y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_come_back_and_neighbourhoods_cross_bricks() {
        let mut bricks = Bricks::new([20, 17, 30]);
        let mut state = 5_u64;
        let mut kept = Vec::new();
        for k in 0..20 * 17 * 30_u64 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let place = [k % 20, k / 20 % 17, k / 340].map(|x| x as u16);
            if state >> 62 == 0 {
                let voxel = Voxel { place, distance: k as f32, flux: -(k as f32) };
                bricks.insert(voxel);
                kept.push(voxel);
            }
        }
        assert_eq!(bricks.len(), kept.len());
        assert_eq!(bricks.iter().count(), kept.len());
        for voxel in &kept {
            assert_eq!(bricks.get(voxel.place), Some(*voxel));
            let around = bricks.neighbourhood(voxel.place);
            for k in 0..27 {
                let [dx, dy, dz] = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                let at = [dx, dy, dz];
                let at = [0, 1, 2].map(|i| i32::from(voxel.place[i]) + at[i]);
                let there = kept.iter().any(|v| v.place.map(i32::from) == at);
                assert_eq!(around >> k & 1 == 1, there);
            }
        }
        let gone = kept[kept.len() / 2];
        bricks.remove(gone.place);
        assert_eq!((bricks.get(gone.place), bricks.len()), (None, kept.len() - 1));
        assert_eq!(bricks.neighbourhood(gone.place) >> 13 & 1, 0);
    }
}
