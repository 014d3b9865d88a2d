//! The table of the edges, by their ends.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::edge::Edge;

/// Edges by their ends, ascending. Never iterated.
pub(super) type Edges = HashMap<[u32; 2], Edge, BuildHasherDefault<EndsHasher>>;

/// Two ends in order.
pub(super) fn ascending(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Hash of two ids: multiply and mix.
#[derive(Default)]
pub(super) struct EndsHasher(u64);

impl Hasher for EndsHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u32(u32::from(byte));
        }
    }

    #[inline]
    fn write_u32(&mut self, id: u32) {
        let mixed = (self.0 ^ u64::from(id)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ (mixed >> 29);
    }

    fn write_usize(&mut self, _length: usize) {
        // The length of the array, which is always two.
    }
}
