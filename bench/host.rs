//! The process that the command runs in: its program, or an interpreter that loaded it as a library.
//!
//! Workers are started like the command, and results carry the hash of the code that computed them. Usually both are
//! the running program's file. Inside an interpreter, that file neither contains the methods nor starts a worker
//! without further arguments.

use std::env;
use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// How to start the command again, and the file that contains its methods.
#[derive(Clone, Debug)]
pub struct Host {
    /// The program that is started.
    pub program: PathBuf,
    /// Its arguments before the verb.
    pub arguments: Vec<OsString>,
    /// The file that contains the methods: its hash identifies the build.
    pub code: PathBuf,
    /// The words of this command line, without the program's name.
    pub words: Vec<OsString>,
}

static HOST: OnceLock<Host> = OnceLock::new();

impl Host {
    /// Declares that the command runs inside another program. Call it first.
    ///
    /// # Panics
    /// When the host is already known: the command runs once in a process.
    pub fn enter(self) {
        assert!(HOST.set(self).is_ok(), "the command runs once in a process");
    }

    /// The host of this process: the one that was entered, or the running program itself.
    ///
    /// # Errors
    /// When the path of the running program is unknown.
    pub fn here() -> io::Result<&'static Self> {
        if let Some(host) = HOST.get() {
            return Ok(host);
        }
        let (program, code) = (own_program()?, env::current_exe()?);
        let words = env::args_os().skip(1).collect();
        // Another thread may have been first; both would write the same.
        Ok(HOST.get_or_init(|| Self { program, arguments: vec![], code, words }))
    }

    /// The start of another process of the command; its verb is to follow.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        command.args(&self.arguments);
        // An interpreter, which needs arguments, finds its library by its own name.
        if self.arguments.is_empty() { named(command) } else { command }
    }
}

/// A command under the name that lists of processes show, instead of the link by which it is started.
pub fn named(command: Command) -> Command {
    #[cfg(unix)]
    let command = {
        let mut command = command;
        std::os::unix::process::CommandExt::arg0(&mut command, "medial");
        command
    };
    command
}

/// The running program.
// On Linux by a link that stays valid when the program is rebuilt.
fn own_program() -> io::Result<PathBuf> {
    let link = PathBuf::from("/proc/self/exe");
    if cfg!(target_os = "linux") && link.exists() { Ok(link) } else { env::current_exe() }
}
