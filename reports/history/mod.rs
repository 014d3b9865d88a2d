//! Results of many nights: one file for each in a folder, and what they tell together.
//!
//! | module | holds |
//! |---|---|
//! | `night` | [`Night`], one file: a line for each series |
//! | `folder` | [`History`], the folder: added to, read |
//! | `steps` | [`steps()`], lasting changes of one noisy sequence |
//! | `student` | the distribution of its test |
//! | `findings` | [`Findings`], steps and changes of all series, with their commits |
//! | `text` | what was found as Markdown and as JSON |
//! | `page`, `sparkline` | what was found as a page |

mod error;
mod findings;
mod folder;
mod night;
mod page;
mod sparkline;
mod steps;
mod student;
mod text;

pub use error::HistoryError;
pub use findings::{Change, Difference, Findings, FoundStep, Group, Quantity, Shared, Track};
pub use folder::History;
pub use night::{Figures, Night, SeriesName};
pub use steps::{Step, StepOptions, steps};
pub(crate) use student::beyond;
