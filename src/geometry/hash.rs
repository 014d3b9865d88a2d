//! A hash of numbers, the same on every machine.

/// The finaliser of SplitMix64, whose high and low bits both mix: G. L. Steele, D. Lea, C. H. Flood:
/// *Fast splittable pseudorandom number generators*, OOPSLA 2014, doi:10.1145/2660193.2660195.
#[inline]
pub fn splitmix(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}
