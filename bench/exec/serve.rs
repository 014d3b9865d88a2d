//! The worker: a child process that runs items one after another and reports the results.
//!
//! It keeps the scene of its last item, so that substrates and judge are built once for all items
//! of a mesh. It ends when its standard input ends, even in the middle of an item: the supervisor
//! that would read the result has ended.

use std::io::BufRead;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;
use std::{io, thread};

use medial::complex::MedialMesh;
use medial::shape::ShapeOptions;
use medial::simplifier::{Level, MethodInfo, RunContext, SimplifyError};
use medial_run::hash::mesh_hash;
use medial_run::input::{Input, Source};
use medial_run::item::{GIVEN, Item, MethodSpec};
use medial_run::journal::to_line;
use medial_run::outcome::{failure_record, record, repetition};
use medial_run::record::{Provenance, Status};
use medial_run::scene::{Scene, judge};
use medial_run::timed::{Bounds, Budget, Fault, LevelRun, answer, panic_message, preparing};

use crate::check::{Outcome, Subject};
use crate::exec::protocol::{CheckItem, Event, PROTOCOL, Request, send};
use crate::plugin::SCRATCH;
use crate::study::registry::{Entry, Registry};
use crate::{check, process_tree};

/// Serves requests until standard input ends. `bytes` is the memory limit of this process.
pub fn serve(registry: &Registry, bytes: u64) -> ExitCode {
    // Before anything is allocated for an item.
    limit(bytes);
    process_tree::become_worker();
    medial::heap::on_refusal(crate::exec::protocol::send_out_of_memory);
    let mut scene = None;
    // The supervisor notices by itself when the pipe is closed.
    let _ = send(&Event::Ready(PROTOCOL));
    for request in requests() {
        let served = match request {
            Request::Run { item, axes, provenance } => {
                run(registry, &mut scene, &item, &mut |scene, runs| {
                    send_records(&item, axes.as_deref(), &provenance, scene, &runs)
                })
            }
            Request::Probe { item } => probe(registry, &item),
            Request::Again { item } => {
                run(registry, &mut scene, &item, &mut |_, runs| send_repetitions(runs))
            }
            Request::Check(item) => run_case(registry, &item),
        };
        if served.and_then(|()| send(&Event::Finished)).is_err() {
            break;
        }
    }
    process_tree::end_descendants();
    ExitCode::SUCCESS
}

/// Forbids core files and limits the memory.
// An allocation beyond the limit fails at once, while the supervisor might notice too late. On systems
// without such a limit only the supervisor watches.
fn limit(bytes: u64) {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        let _ = setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: Some(0) });
        // The hard limit stays: only the supervisor limits programs that the worker starts.
        let Rlimit { maximum, .. } = getrlimit(Resource::Data);
        let current = Some(bytes.min(maximum.unwrap_or(u64::MAX)));
        #[cfg(target_os = "linux")]
        let _ = setrlimit(Resource::Data, Rlimit { current, maximum });
    }
    let _ = bytes;
}

/// The requests, until standard input ends.
// It is read by a separate thread, so that its end is noticed in the middle of an item.
fn requests() -> Receiver<Request> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        for line in io::stdin().lock().lines() {
            let request = line.ok().and_then(|line| serde_json::from_str(&line).ok());
            // An invalid line comes from another version, which cannot be served.
            let Some(request) = request else { break };
            if sender.send(request).is_err() {
                break;
            }
        }
        drop(sender);
        // Time for an idle worker to end by itself.
        thread::sleep(Duration::from_millis(200));
        process_tree::end_descendants();
        // The supervisor removes it, too, unless it was killed.
        if let Some(scratch) = std::env::var_os(SCRATCH) {
            let _ = std::fs::remove_dir_all(scratch);
        }
        std::process::exit(0);
    });
    receiver
}

/// The scene of an item: the present one if it fits, else a new one.
fn enter<'s>(scene: &'s mut Option<Scene>, item: &Item) -> Result<&'s mut Scene, String> {
    if !scene.as_ref().is_some_and(|scene| scene.serves(&item.scene)) {
        // Drop the old scene first, so that two never share the memory.
        *scene = None;
        *scene = Some(Scene::load(&item.scene)?);
    }
    let scene = scene.as_mut().expect("just made");
    scene.set_noise(item.scene.noise)?;
    Ok(scene)
}

/// Runs the method of an item: `report` gets the results of its levels, then that of each bound.
fn run(
    registry: &Registry,
    scene: &mut Option<Scene>,
    item: &Item,
    report: &mut dyn FnMut(&Scene, Vec<LevelRun>) -> io::Result<()>,
) -> io::Result<()> {
    let scene = match enter(scene, item) {
        Ok(scene) => &*scene,
        Err(why) => return send(&Event::Refused(why)),
    };
    send(&Event::Preparing(scene.input.hash.clone()))?;
    // An unknown method is a fault of each level, so that every requested record has its reason.
    let entry = find(registry, &item.method);
    let (unknown, context) = (MethodInfo::default(), RunContext::with_seed(item.seed));
    let info = entry.as_ref().map_or(&unknown, |entry| entry.method().info());
    let prepare = preparing(|view| match &entry {
        Ok(entry) => entry.method().prepare(view, &item.method.params, &context),
        Err(why) => Err(SimplifyError::Failed(why.clone())),
    });
    let budget = Budget::from_now(item.limits.budget);
    let levels: Vec<Level> = item.levels.iter().filter_map(|target| target.level().ok()).collect();
    if !levels.is_empty() {
        let view = scene.shape().view();
        // The supervisor notices by itself when the pipe is closed.
        let begin = |level: Level| drop(send(&Event::Simplifying(level.into())));
        report(scene, answer(&view, info, || prepare(&view), &levels, &budget, begin))?;
    }
    let mut bounds: Vec<f64> =
        item.levels.iter().filter_map(|target| target.level().err()).collect();
    if bounds.is_empty() {
        return Ok(());
    }
    // A loose bound costs few probes, from which the search for a tighter one starts.
    bounds.sort_by(|a, b| b.total_cmp(a));
    let measure = |mesh: &MedialMesh| {
        let distances = scene.judge.distances(&scene.judged(mesh));
        distances.map(|distances| distances.hausdorff).map_err(|error| error.to_string())
    };
    let search = Bounds {
        shape: scene.shape(),
        info,
        sweep: entry.as_ref().map_or(&[], |entry| &entry.presentation.sweep),
        prepare: &prepare,
        measure: &measure,
        budget: &budget,
        searching: &|bound| drop(send(&Event::Simplifying(bound))),
        trying: &|_| Ok(()),
    };
    // Each bound is recorded before the next, tighter one: a method that ends its worker at a tight
    // bound loses none of the looser ones.
    search.answer(&bounds, &mut |run, _| report(scene, vec![run]))
}

/// Measures results and sends their records.
fn send_records(
    item: &Item,
    axes: Option<&Path>,
    provenance: &Provenance,
    scene: &Scene,
    runs: &[LevelRun],
) -> io::Result<()> {
    send(&Event::Measuring)?;
    for (run, evaluation) in runs.iter().zip(judge(scene, runs)) {
        let mut record = record(item, scene, run, evaluation, provenance, axes);
        // JSON has no infinity and no NaN, and writes `null`: reading the record back would change it.
        if to_line(&record).is_err() {
            let reason = "the record has a number that is not finite".to_owned();
            let fault = Fault { status: Status::InvalidOutput, reason };
            record = failure_record(item, run.level, &fault, provenance);
        }
        send(&Event::Record(Box::new(record)))?;
    }
    Ok(())
}

/// Sends times and hashes.
// Not the meshes: the supervisor compares hashes with those of the first run.
fn send_repetitions(runs: Vec<LevelRun>) -> io::Result<()> {
    runs.into_iter().try_for_each(|LevelRun { level, outcome, times }| {
        let outcome = outcome.map(|result| (repetition(&times), mesh_hash(&result.mesh)));
        send(&Event::Repeated(level, outcome))
    })
}

/// Prepares the method of an item on a very small shape.
fn probe(registry: &Registry, item: &Item) -> io::Result<()> {
    let resolution = medial_datasets::find("sphere").map(|shape| *shape.resolutions().start());
    let source = Source::BuiltIn { id: "sphere".into(), resolution };
    // A probe that cannot be made finds nothing wrong: the run itself will.
    let Ok(input) = Input::load(&source) else { return Ok(()) };
    let Ok(shape) = input.shape(ShapeOptions::default()) else { return Ok(()) };
    send(&Event::Preparing(input.hash))?;
    let Ok(entry) = find(registry, &item.method) else { return Ok(()) };
    let method = entry.method();
    let context = RunContext::with_seed(item.seed);
    // A panic is reported by the run itself, not here.
    let prepared = catch_unwind(AssertUnwindSafe(|| {
        method.prepare(&shape, &item.method.params, &context).map(|_| ())
    }));
    match prepared {
        Ok(Err(error @ SimplifyError::Parameter(_))) => {
            send(&Event::WrongParameter(error.to_string()))
        }
        _ => Ok(()),
    }
}

/// Runs one case of the conformance corpus on a method.
fn run_case(registry: &Registry, item: &CheckItem) -> io::Result<()> {
    send(&Event::Doing("starting".into()))?;
    let outcome = match (find(registry, &item.method), check::find(&item.case)) {
        (Err(why), _) => Outcome::Failed(why),
        (_, None) => Outcome::Failed(format!("unknown case `{}`", item.case)),
        (Ok(entry), Some(case)) => {
            let subject = Subject {
                method: entry.method(),
                params: &item.method.params,
                seed: 0,
                external: entry.fingerprint.is_some(),
                // The supervisor notices by itself when the pipe is closed.
                doing: &|what| drop(send(&Event::Doing(what.to_owned()))),
            };
            let run = catch_unwind(AssertUnwindSafe(|| case.run(&subject)));
            run.unwrap_or_else(|payload| Outcome::Failed(panic_message(payload.as_ref())))
        }
    };
    send(&Event::Checked(outcome))
}

/// The method of an item, which must be the one that it was planned with.
fn find<'r>(registry: &'r Registry, method: &MethodSpec) -> Result<&'r Entry, String> {
    let id = &method.id;
    let entry = registry.entry(id).ok_or_else(|| format!("unknown method `{id}`"))?;
    let now = if id == GIVEN {
        crate::study::external::fingerprint(&method.params)
    } else {
        entry.fingerprint.clone()
    };
    if now != method.fingerprint {
        let what = if id == GIVEN { "its file" } else { "its plug-in file or program" };
        let label = method.label();
        return Err(format!("{label}: {what} has changed since the run was planned; run again"));
    }
    Ok(entry)
}
