//! Generated solids with known medial axes, and declared noise.
