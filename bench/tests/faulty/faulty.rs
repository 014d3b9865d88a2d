//! The command with methods that go wrong in every way that was thought of: what the tests of the
//! runner run. `cargo run --example faulty -- compare builtin:box --methods panics,qmat`.

use std::hint::black_box;
use std::process::{Command, ExitCode};
use std::time::Duration;

use medial::shape::Shape;
use medial::simplifier::{
    Level, Method, MethodInfo, NoParams, Registered, RunContext, Simplification, Simplified,
    SimplifyError,
};

type Prepared<'s> = Result<Box<dyn Simplification + 's>, SimplifyError>;

/// The largest balls: what the faulty methods give where they are not at fault.
fn largest(shape: &Shape, level: Level) -> Result<Simplified, SimplifyError> {
    let initial = shape.initial()?;
    let Level::Spheres(count @ 1..) = level else {
        return Err(SimplifyError::unsupported("ask for a number of spheres, at least 1"));
    };
    let mut order: Vec<usize> = (0..initial.spheres.len()).collect();
    order.sort_by(|&a, &b| initial.spheres[b].radius.total_cmp(&initial.spheres[a].radius));
    let mut keep = vec![false; initial.spheres.len()];
    order.iter().take(count).for_each(|&i| keep[i] = true);
    Ok(Simplified::new(initial.induced(&keep), level))
}

/// The level at which the methods below that work for a while go wrong.
const AT: Level = Level::Spheres(20);

fn panics<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    Ok(Box::new(move |level| {
        assert!(level != AT, "this method panics at 20 spheres");
        largest(shape, level)
    }))
}

fn loops<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    Ok(Box::new(move |level| {
        if level == AT {
            wait_for_ever();
        }
        largest(shape, level)
    }))
}

/// Reads from a pipe that nobody writes to and nobody closes.
fn wait_for_ever() {
    let (mut reader, writer) = std::io::pipe().expect("a pipe");
    let _ = std::io::Read::read(&mut reader, &mut [0]);
    drop(writer);
}

/// Hangs at its published level, which a search for an error bound tries once no count is within it.
fn hangs_late<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    Ok(Box::new(move |level| {
        if level == Level::Published {
            wait_for_ever();
        }
        largest(shape, level)
    }))
}

/// Waits until the pipe that `FAULTY_GATE` names is opened and closed by its writer.
fn waits<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    if let Some(gate) = std::env::var_os("FAULTY_GATE") {
        std::fs::read(gate).map_err(|error| SimplifyError::Failed(error.to_string()))?;
    }
    Ok(Box::new(move |level| largest(shape, level)))
}

/// Fails with words that speak of memory, of which there is plenty.
fn complains<'s>(_: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    Err(SimplifyError::Failed("unable to allocate a licence: out of memory".into()))
}

fn allocates<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    Ok(Box::new(move |level| {
        if level == AT {
            black_box(vec![1_u8; 10_000_000_000]);
        }
        largest(shape, level)
    }))
}

/// Allocates little by little, so that no single request is refused.
fn grows<'s>(_: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    let mut all = Vec::new();
    loop {
        all.push(black_box(vec![1_u8; 1 << 20]));
        std::thread::sleep(Duration::from_micros(100));
    }
}

fn overflows<'s>(_: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    fn deeper(depth: u64) -> u64 {
        let room = black_box([depth; 64]);
        if depth == u64::MAX { 0 } else { deeper(depth + 1) + room[7] }
    }
    Err(SimplifyError::Failed(format!("came back with {}", deeper(0))))
}

fn aborts<'s>(_: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    std::process::abort()
}

fn exits<'s>(_: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    std::process::exit(0)
}

fn invalid<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    Ok(Box::new(move |level| {
        let mut result = largest(shape, level)?;
        result.mesh.spheres[0].radius = f64::NAN;
        Ok(result)
    }))
}

fn empty<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    Ok(Box::new(move |level| {
        let mut result = largest(shape, level)?;
        result.mesh = Default::default();
        Ok(result)
    }))
}

/// Prints on standard output without an end of line, and forges a message.
#[allow(clippy::print_stdout)]
fn talks<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    println!("\u{1e}\"Finished");
    print!("{}", "no end of line ".repeat(1 << 20));
    Ok(Box::new(move |level| largest(shape, level)))
}

/// Leaves a process behind that leaves the process group.
fn strays<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    let started = Command::new("setsid").args(["sleep", "7654"]).spawn();
    if started.is_err() {
        Command::new("sleep")
            .arg("7654")
            .spawn()
            .map_err(|e| SimplifyError::Failed(e.to_string()))?;
    }
    Ok(Box::new(move |level| largest(shape, level)))
}

/// Gives another result each time.
fn random<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let nanos = now.map_or(0, |now| now.subsec_nanos());
    Ok(Box::new(move |level| {
        let mut result = largest(shape, level)?;
        result.mesh.spheres[0].radius *= 1.0 + f64::from(nanos) * 1e-12;
        Ok(result)
    }))
}

/// Gives one ball at the first level that it is asked for, whichever that is: a level that a search found
/// among others is not the same when it is asked alone.
fn warms_up<'s>(shape: &'s Shape, _: NoParams, _: &RunContext) -> Prepared<'s> {
    let mut was_asked = false;
    Ok(Box::new(move |level| {
        let is_first = !std::mem::replace(&mut was_asked, true);
        largest(shape, if is_first { Level::Spheres(1) } else { level })
    }))
}

fn main() -> ExitCode {
    let method = |id: &'static str, prepare| {
        Registered::from(Method::<NoParams>::new(MethodInfo::new(id, id), prepare))
    };
    let mut methods = medial_methods::registry();
    methods.extend([
        method("panics", panics),
        method("loops", loops),
        method("allocates", allocates),
        method("grows", grows),
        method("overflows", overflows),
        method("aborts", aborts),
        method("exits", exits),
        method("invalid", invalid),
        method("empty", empty),
        method("talks", talks),
        method("strays", strays),
        method("random", random),
        method("warms-up", warms_up),
        method("waits", waits),
        method("hangs-late", hangs_late),
        method("complains", complains),
    ]);
    medial_bench::main_with(methods)
}
