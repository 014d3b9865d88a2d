//! The published simplifiers of the medial axis, one module each.

pub mod qmat;
