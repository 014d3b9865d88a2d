//! The runner behind the command `medial`.
