//! One method on one shape, timed and measured, as a record: the work of the verbs for one mesh, for the command and for
//! Python alike. Registry, files and processes belong to the callers.
//!
//! | module | content |
//! |---|---|
//! | [`input`], [`library`] | a surface that a user names: a file, a published mesh, a built-in shape |
//! | [`axis`] | a medial mesh that a user names, in any unit |
//! | [`settings`], [`level`] | all that decides a result except input and method |
//! | [`item`], [`scene`] | one method on one input as data, and what its levels share |
//! | [`timed`], `search` | the timed run, the search for an error bound |
//! | [`outcome`], [`record`], [`journal`] | from a result to a line of `results.jsonl` |
//! | [`simplify`], [`evaluate`], [`reconstruct`] | the work of three verbs |
//! | [`error`] | the errors of inputs and files |
//! | [`hash`], [`text`] | hashes, numbers and names as text |

pub mod axis;
pub mod error;
pub mod evaluate;
pub mod hash;
pub mod input;
pub mod item;
pub mod journal;
pub mod level;
pub mod library;
pub mod outcome;
pub mod reconstruct;
pub mod record;
pub mod scene;
mod search;
pub mod settings;
pub mod simplify;
pub mod text;
pub mod timed;

#[cfg(doctest)]
#[doc = include_str!("README.md")]
struct Readme;
