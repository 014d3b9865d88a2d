//! The command with faulty methods, for the tests of the runner:
//! `cargo run --example faulty -- compare builtin:box --methods panics,qmat`.

use std::hint::black_box;
use std::process::{Command, ExitCode};
use std::time::Duration;

use medial::shape::Shape;
use medial::simplifier::{
    Level, MedialSimplifier, MethodInfo, Params, Registered, RunContext, Simplification,
    Simplified, SimplifyError,
};

type Outcome = Result<Simplified, SimplifyError>;

/// A method as two functions: its preparation, and one level. The last argument of `at` is true at the first level.
struct Faulty {
    info: MethodInfo,
    prepare: fn() -> Result<(), SimplifyError>,
    at: fn(&Shape, Level, bool) -> Outcome,
}

impl MedialSimplifier for Faulty {
    fn info(&self) -> &MethodInfo {
        assert!(std::env::var_os("FAULTY_INFO").is_none(), "FAULTY_INFO is set");
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        _: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        params.typed::<medial::simplifier::NoParams>()?;
        (self.prepare)()?;
        let (at, mut is_first) = (self.at, true);
        Ok(Box::new(move |level| at(shape, level, std::mem::take(&mut is_first))))
    }
}

/// The largest balls: the result of the faulty methods where they have no fault.
fn largest(shape: &Shape, level: Level, _: bool) -> Outcome {
    let initial = shape.initial()?;
    let Level::Spheres(count @ 1..) = level else {
        return Err(SimplifyError::unsupported("give a number of spheres, at least 1"));
    };
    let mut order: Vec<usize> = (0..initial.spheres.len()).collect();
    order.sort_by(|&a, &b| initial.spheres[b].radius.total_cmp(&initial.spheres[a].radius));
    let mut keep = vec![false; initial.spheres.len()];
    order.iter().take(count).for_each(|&i| keep[i] = true);
    Ok(Simplified::new(initial.induced(&keep), level))
}

/// The level at which the methods that fail late have their fault.
const AT: Level = Level::Spheres(20);

fn panics(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    assert!(level != AT, "this method panics at 20 spheres");
    largest(shape, level, is_first)
}

fn loops(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    if level == AT {
        wait_for_ever();
    }
    largest(shape, level, is_first)
}

/// Reads from a pipe that has no data and stays open.
fn wait_for_ever() {
    let (mut reader, writer) = std::io::pipe().expect("a pipe");
    let _ = std::io::Read::read(&mut reader, &mut [0]);
    drop(writer);
}

/// Hangs at its published level, which a search for an error bound tries once no count is within it.
fn hangs_late(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    if level == Level::Published {
        wait_for_ever();
    }
    largest(shape, level, is_first)
}

/// Waits until the pipe that `FAULTY_GATE` names is opened and closed by its writer.
fn waits() -> Result<(), SimplifyError> {
    if let Some(gate) = std::env::var_os("FAULTY_GATE") {
        std::fs::read(gate).map_err(|error| SimplifyError::Failed(error.to_string()))?;
    }
    Ok(())
}

/// Fails with a misleading message about memory.
fn complains() -> Result<(), SimplifyError> {
    Err(SimplifyError::Failed("unable to allocate a licence: out of memory".into()))
}

fn allocates(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    if level == AT {
        black_box(vec![1_u8; 10_000_000_000]);
    }
    largest(shape, level, is_first)
}

/// Allocates little by little, so that no single request is refused.
fn grows() -> Result<(), SimplifyError> {
    let mut all = Vec::new();
    loop {
        all.push(black_box(vec![1_u8; 1 << 20]));
        std::thread::sleep(Duration::from_micros(100));
    }
}

fn overflows() -> Result<(), SimplifyError> {
    fn deeper(depth: u64) -> u64 {
        let room = black_box([depth; 64]);
        if depth == u64::MAX { 0 } else { deeper(depth + 1) + room[7] }
    }
    Err(SimplifyError::Failed(format!("came back with {}", deeper(0))))
}

fn invalid(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    let mut result = largest(shape, level, is_first)?;
    result.mesh.spheres[0].radius = f64::NAN;
    Ok(result)
}

fn empty(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    let result = largest(shape, level, is_first)?;
    Ok(Simplified { mesh: Default::default(), ..result })
}

/// Prints on standard output without an end of line, and forges a message.
#[allow(clippy::print_stdout)]
fn talks() -> Result<(), SimplifyError> {
    println!("\u{1e}\"Finished");
    print!("{}", "no end of line ".repeat(1 << 20));
    Ok(())
}

/// Leaves a running process outside of the process group.
fn orphans() -> Result<(), SimplifyError> {
    let started = Command::new("setsid").args(["sleep", "7654"]).spawn();
    let started = started.or_else(|_| Command::new("sleep").arg("7654").spawn());
    started.map(|_| ()).map_err(|error| SimplifyError::Failed(error.to_string()))
}

/// Sends events without a pause, while a program that it started takes memory, 4 GB at most.
#[allow(clippy::print_stdout)]
fn chatters() -> Result<(), SimplifyError> {
    let script = "ulimit -S -d 4000000; exec tail -n 1 /dev/zero";
    let started = Command::new("sh").args(["-c", script]).spawn();
    started.map_err(|error| SimplifyError::Failed(error.to_string()))?;
    loop {
        println!("\n\u{1e}\"Loading\"");
    }
}

/// Returns another result each time.
fn random(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let nanos = now.map_or(0, |now| now.subsec_nanos());
    let mut result = largest(shape, level, is_first)?;
    result.mesh.spheres[0].radius *= 1.0 + f64::from(nanos) * 1e-12;
    Ok(result)
}

/// Returns one ball at its first level: a level of a search has another result when it runs alone.
fn warms_up(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    largest(shape, if is_first { Level::Spheres(1) } else { level }, is_first)
}

/// Returns half of the balls at its first level.
fn forgets(shape: &Shape, level: Level, is_first: bool) -> Outcome {
    match level {
        Level::Spheres(count) if is_first => {
            largest(shape, Level::Spheres(count.div_ceil(2)), is_first)
        }
        _ => largest(shape, level, is_first),
    }
}

fn main() -> ExitCode {
    let method = |id: &'static str, prepare, at| {
        Registered::from(Faulty { info: MethodInfo::new(id, id).incremental(), prepare, at })
    };
    let late = |id, at| method(id, || Ok(()), at);
    let early = |id, prepare| method(id, prepare, largest);
    let mut methods = medial_methods::registry();
    methods.extend([
        late("panics", panics),
        late("loops", loops),
        late("allocates", allocates),
        early("grows", grows),
        early("overflows", overflows),
        early("aborts", || std::process::abort()),
        early("exits", || std::process::exit(0)),
        late("invalid", invalid),
        late("empty", empty),
        early("talks", talks),
        early("orphans", orphans),
        late("random", random),
        late("warms-up", warms_up),
        late("forgets", forgets),
        early("waits", waits),
        late("hangs-late", hangs_late),
        early("complains", complains),
        early("chatters", chatters),
    ]);
    medial_bench::main_with(methods)
}
