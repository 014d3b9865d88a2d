//! The part of the Python package `medialaxis` that is Rust: thin objects around the library, for `medial_axis/*.py`,
//! which has the documentation and the types that users meet.
//!
//! | file | holds |
//! |---|---|
//! | `surface` | a closed surface with its substrates, each built once |
//! | `axis` | a medial mesh, in the units of its surface |
//! | `geometry` | triangulations of points |
//! | `method` | a Python class as a `MedialSimplifier` |
//! | `command` | the command `medial`, which loads such classes |
//! | `work` | long calls: without the interpreter's lock, with progress, ended by Ctrl-C |
//! | `arrays`, `error` | numpy arrays and exceptions |

mod arrays;
mod axis;
mod command;
mod error;
mod geometry;
mod method;
mod surface;
mod work;

use pyo3::prelude::*;

/// Filled by name, so that `_medial.pyi` can be read beside it.
#[pymodule]
fn _medial(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<surface::Surface>()?;
    module.add_class::<axis::Axis>()?;
    module.add_class::<method::ShapeHandle>()?;
    module.add_class::<method::RunHandle>()?;
    module.add_function(wrap_pyfunction!(geometry::triangulate, module)?)?;
    module.add_function(wrap_pyfunction!(method::methods, module)?)?;
    module.add_function(wrap_pyfunction!(command::run_command, module)?)?;
    Ok(())
}
