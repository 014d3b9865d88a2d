//! Inputs, items, workers, records: everything from a study to the kept results.
//!
//! A run is a list of [`Item`]s. An item is plain data and determines its records. In a worker process
//! it takes three steps: the method answers and is timed ([`answer()`], a [`LevelRun`] for each level),
//! its results are measured ([`judge`]), and both become records ([`record::record`]). The
//! [`Supervisor`] gives items to workers and turns every way in which one can end into records; the
//! [`Store`] keeps the records.
//!
//! | files | step |
//! |---|---|
//! | `source`, `item`, `registry`, `axis_file`, `given` | what is run |
//! | `scene`, `answer`, `search`, `bounds`, `verdict`, `record` | the path of one item, inside a worker |
//! | `protocol`, `serve`, `worker` | processes and their messages |
//! | `ending`, `supervise`, `plan` | limits, ends, lists of items |
//! | `store` | the folder of results |
//! | `alternate` | two builds that take turns |
//! | `public` | published meshes, fetched and kept by name |

mod alternate;
mod answer;
mod axis_file;
mod bounds;
mod ending;
mod given;
mod item;
mod plan;
mod progress;
mod protocol;
mod provenance;
pub mod public;
pub mod record;
mod registry;
mod scene;
mod search;
mod serve;
mod similar;
mod source;
mod stage_line;
mod store;
mod study;
mod supervise;
mod verdict;
mod worker;

pub use alternate::{Build, BuildError, Contender, missing_in_either, run_alternately};
pub use answer::{Fault, LevelRun, Times, answer};
pub use axis_file::{AxisError, AxisOptions, FitBy, RadiiFrom, percent, read_axis};
pub use given::{GIVEN, Given};
pub use item::{Dual, Item, Limits, Measure, MethodSpec, Noise, SceneSpec};
pub use plan::{PlanError, Tally, count, missing, refused_params, run_items};
pub use progress::{Progress, Verbosity};
pub use protocol::CheckItem;
pub use provenance::{Provenance, hex, hex_digest, peak_bytes, shell_line};
pub use registry::{Entry, INITIAL, Registry, RegistryError};
pub use scene::Scene;
pub use search::{Found, Probe, Search};
pub use serve::serve;
pub use similar::did_you_mean;
pub use source::{Input, InputError, Source};
pub use stage_line::StageLine;
pub use store::{AXES, Failures, RESULTS, Store, StoreError};
pub use study::{
    Here, MOST_REPEATS, Shard, Study, StudyError, StudyMethod, VOLUME_DEPTH, no_such_method,
};
pub use supervise::{RunError, Supervisor};
pub use verdict::{Verdict, judge, reach};
