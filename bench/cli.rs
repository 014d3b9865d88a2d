//! The arguments of the command, and the way from a verb to an exit code.

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::{Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::Shell;
use medial::simplifier::Registered;
use medial_run::timed::panic_message;

use crate::args::Global;
use crate::cmd;
use crate::exec::serve::serve;
use crate::exit::{Exit, Failure};
use crate::host::Host;
use crate::interrupt;
use crate::output::{exit_after_output, print_failure, print_raw};
use crate::plugin::ScriptLoader;
use crate::study::registry::Registry;

/// Simplify the 3D medial axis transform, and compare the published methods that do.
#[derive(Debug, Parser)]
#[command(name = "medial", version, arg_required_else_help = true)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Run methods on meshes, measure the results, write tables, plots and a page.
    Compare(Box<cmd::compare::Arguments>),
    /// Print counts, defects and topology of a mesh.
    Info(cmd::info::Arguments),
    /// Compute the initial Voronoi medial mesh.
    Axis(cmd::axis::Arguments),
    /// Simplify the medial axis of one mesh by one method.
    Simplify(cmd::simplify::Arguments),
    /// Measure medial meshes from anywhere against a surface.
    Evaluate(cmd::evaluate::Arguments),
    /// Make a surface from a medial mesh: the boundary of its union, or the power crust.
    Reconstruct(cmd::reconstruct::Arguments),
    /// Draw a surface, its medial meshes, or their reconstructions by error, as PNG.
    Render(cmd::render::Arguments),
    /// Show medial meshes side by side in three dimensions, as one page.
    View(cmd::view::Arguments),
    /// Repair a surface: fill its holes, keep its largest part, wrap it.
    Repair(cmd::repair::Arguments),
    /// Convert between surface formats, or between medial mesh formats.
    Convert(cmd::convert::Arguments),
    /// List the methods, or describe one.
    Methods(cmd::methods::Arguments),
    /// Run the conformance tests on methods, external ones too.
    Check(cmd::check::Arguments),
    /// List, write and fetch meshes.
    Datasets(cmd::datasets::Arguments),
    /// Find regressions between two stores of results, or two builds that run in turn.
    Diff(cmd::diff::Arguments),
    /// Rebuild the report of a store of results, or merge several stores.
    Report(cmd::report::Arguments),
    /// Find change points over many runs.
    History(cmd::history::Arguments),
    /// Print shell completions.
    #[command(hide = true)]
    Completions {
        /// The shell.
        #[arg(value_enum)]
        shell: Shell,
    },
    /// Serve the items on standard input; `compare` starts it.
    #[command(hide = true)]
    Worker {
        /// Limit of memory in bytes.
        #[arg(long, default_value_t = u64::MAX)]
        bytes: u64,
    },
}

/// The command with these methods: parses the command line, runs the verb, and turns the result into an exit code.
pub fn main_with(methods: Vec<Registered>) -> ExitCode {
    run_with(methods, None, std::env::args_os()).into()
}

/// [`main_with`] inside another program, which loads plug-ins written in its language.
///
/// # Panics
/// When called twice in a process.
pub fn main_hosted(methods: Vec<Registered>, host: Host, loader: Box<dyn ScriptLoader>) -> Exit {
    let words = std::iter::once(OsString::from("medial")).chain(host.words.iter().cloned());
    let words: Vec<OsString> = words.collect();
    host.enter();
    run_with(methods, Some(loader), words.into_iter())
}

fn run_with(
    methods: Vec<Registered>,
    loader: Option<Box<dyn ScriptLoader>>,
    words: impl Iterator<Item = OsString>,
) -> Exit {
    // First, so that a signal at any later moment removes temporary files.
    interrupt::install();
    let matches = command().try_get_matches_from(words);
    let cli = match matches.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        // Requested help and version belong on standard output.
        Err(error) if !error.use_stderr() => {
            print_raw(&error.render().to_string());
            return exit_after_output(Exit::Done);
        }
        Err(error) => {
            // Nothing can be reported where standard error is closed.
            let _ = error.print();
            return Exit::Usage;
        }
    };
    // Panics become failures of one line, unless a backtrace is requested.
    if std::env::var_os("RUST_BACKTRACE").is_none_or(|value| value == "0") {
        std::panic::set_hook(Box::new(|_| ()));
    }
    let Cli { global, verb } = cli;
    // The state after a panic is not used again.
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let registry = registry(methods, loader, &global);
        // The pool before anything else: rayon starts its own at the first use, and then keeps that.
        let ready = set_threads(global.threads).and(registry);
        ready.and_then(|mut registry| run(verb, &global, &mut registry))
    }));
    let outcome = outcome.unwrap_or_else(|panic| Err(Failure::bug(panic_message(panic.as_ref()))));
    let exit = outcome.unwrap_or_else(|failure| {
        print_failure(&failure, &global);
        failure.code
    });
    exit_after_output(exit)
}

/// The verbs of each group, in the order of the help.
const GROUPS: [(&str, &[&str]); 4] = [
    ("Compare methods", &["compare", "check", "methods"]),
    ("One mesh", &["simplify", "axis", "evaluate", "render", "view", "reconstruct"]),
    ("Files", &["info", "repair", "convert", "datasets"]),
    ("Results of comparisons", &["report", "diff", "history"]),
];

/// Examples at the end of the help: of the command for all verbs, then of each verb.
const EXAMPLES: &str = include_str!("examples.txt");

/// The examples of a verb, or of the command, as they are shown.
fn examples(name: &str) -> String {
    let lines = EXAMPLES.lines().skip_while(|line| *line != name).skip(1);
    let commands = lines.take_while(|line| line.starts_with(' '));
    commands.fold("Examples:".to_owned(), |text, command| text + "\n" + command)
}

/// The command line: as derived, with examples, and with the verbs in groups, which clap does not have.
pub fn command() -> Command {
    let command = Cli::command().mut_subcommands(|verb| {
        let examples = examples(verb.get_name());
        if verb.is_hide_set() { verb } else { verb.after_help(examples) }
    });
    let mut help = String::from("{about}\n\n{usage-heading} {usage}\n");
    for (group, verbs) in GROUPS {
        help.push_str(&format!("\n{group}:\n"));
        for verb in verbs {
            let about = command.find_subcommand(verb).and_then(Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            help.push_str(&format!("  {verb:<13}{about}\n"));
        }
    }
    help.push_str(&format!("\n{}\n\nGlobal options:\n{{options}}\n\n", examples("medial")));
    help.push_str("Describe the options of a verb by `medial VERB --help`.\n");
    command.help_template(help)
}

fn registry(
    methods: Vec<Registered>,
    loader: Option<Box<dyn ScriptLoader>>,
    global: &Global,
) -> Result<Registry, Failure> {
    let mut registry = Registry::new(methods).map_err(Failure::usage)?;
    registry.loader = loader;
    for file in &global.plugins {
        registry.add_plugins(file).map_err(Failure::usage)?;
    }
    Ok(registry)
}

fn run(verb: Verb, global: &Global, registry: &mut Registry) -> Result<Exit, Failure> {
    match verb {
        Verb::Compare(arguments) => cmd::compare::run(&arguments, global, registry),
        Verb::Info(arguments) => cmd::info::run(&arguments, global),
        Verb::Axis(arguments) => cmd::axis::run(&arguments, global),
        Verb::Simplify(arguments) => cmd::simplify::run(&arguments, global, registry),
        Verb::Evaluate(arguments) => cmd::evaluate::run(&arguments, global),
        Verb::Reconstruct(arguments) => cmd::reconstruct::run(&arguments, global),
        Verb::Render(arguments) => cmd::render::run(&arguments, global),
        Verb::View(arguments) => cmd::view::run(&arguments, global),
        Verb::Repair(arguments) => cmd::repair::run(&arguments, global),
        Verb::Convert(arguments) => cmd::convert::run(&arguments, global),
        Verb::Methods(arguments) => cmd::methods::run(&arguments, global, registry),
        Verb::Check(arguments) => cmd::check::run(&arguments, global, registry),
        Verb::Datasets(arguments) => cmd::datasets::run(&arguments, global),
        Verb::Diff(arguments) => cmd::diff::run(&arguments, global, registry),
        Verb::Report(arguments) => cmd::report::run(&arguments, global, registry),
        Verb::History(arguments) => cmd::history::run(&arguments, global),
        Verb::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut command(), "medial", &mut script);
            print_raw(&String::from_utf8_lossy(&script));
            Ok(Exit::Done)
        }
        Verb::Worker { bytes } => {
            serve(registry, bytes);
            Ok(Exit::Done)
        }
    }
}

fn set_threads(threads: Option<usize>) -> Result<(), Failure> {
    let Some(threads) = threads else {
        return Ok(());
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    pool.map_err(|error| Failure::usage(format!("--threads {threads}: {error}")))
}
