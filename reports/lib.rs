//! Reports on records: tables, plots, the page.
//!
//! | module | holds |
//! |---|---|
//! | [`editions`] | frozen results that others compare against |
//! | [`diff`] | an older and a newer set of records, and the regressions between them |
//! | `comparison` | records arranged by mesh, method and level |
//! | `metric` | the columns: name, unit, direction, definition |
//! | `summary` | means over meshes at equal numbers of spheres and at native levels |
//! | `overview` | all methods at one number of spheres: the end of a comparison |
//! | `answers` | which method for which purpose, at equal counts and equal errors |
//! | `statistics` | tests over meshes, intervals of ratios |
//! | `differences` | which differences between methods are established |
//! | `tables` | CSV, Markdown, LaTeX |
//! | `plots` | figures, and their SVG |
//! | [`history`] | one file for each run, change points over many runs |
//! | `pictures` | which results are shown next to each other |
//! | [`drawing`] | one picture by its options |
//! | `render` | pictures of surfaces and medial meshes as PNG |
//! | `view3d` | geometry of the 3D views |
//! | `page` | the self-contained `index.html` |
//! | `site` | [`write_site`], the report with a page for each method and mesh |
//! | `write` | [`write_report`], all of it into one folder |

mod answers;
mod comparison;
pub mod diff;
mod differences;
pub mod drawing;
pub mod editions;
mod header;
pub mod history;
mod metric;
mod overview;
mod page;
mod pictures;
mod plots;
mod render;
mod site;
mod statistics;
mod summary;
mod tables;
mod view3d;
mod write;

pub use comparison::remarks_of_meshes;
pub use header::{Header, MethodNote, RunNote};
pub use metric::{BRIEF, MeasuredRow, measured_rows};
pub use overview::{reasons, summary_text};
pub use pictures::{PictureStrip, picture_strips};
pub use site::write_site;
pub use tables::without_markup;
pub use view3d::View3d;
pub use write::{read_header, results_csv, write_report};

#[cfg(doctest)]
#[doc = include_str!("README.md")]
struct Readme;
