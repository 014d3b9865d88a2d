//! Slurm's side: `sbatch` takes the scripts, `squeue` tells what is in the queue still.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;
use std::process::Command;

use medial::write_atomically;

use super::folder;
use super::script::Submission;
use crate::exit::Failure;

/// Name of the list of the jobs of a submission.
const JOBS: &str = "jobs.txt";

/// Gives the scripts to `sbatch`: the arrays, and then the collecting, which waits for them however they end. The numbers
/// of the jobs, that of the collecting last. Each is written down as soon as it is there.
///
/// # Errors
/// When there is no `sbatch`, or it refuses a script.
pub fn submit(submission: &Submission<'_>) -> Result<Vec<String>, Failure> {
    let mut jobs: Vec<String> = Vec::new();
    for class in 0..submission.classes.len() {
        jobs.push(sbatch(submission, &submission.script(class), &[])?);
        note(submission, &jobs)?;
    }
    let after = format!("--dependency=afterany:{}", jobs.join(":"));
    jobs.push(sbatch(submission, &submission.collecting(), &[after])?);
    note(submission, &jobs)?;
    Ok(jobs)
}

fn sbatch(
    submission: &Submission<'_>,
    script: &str,
    options: &[String],
) -> Result<String, Failure> {
    let path = submission.dir.join(script);
    let mut command = Command::new("sbatch");
    command.arg("--parsable").args(options).arg(&path);
    let printed = printed(command, &path)?;
    // On a cluster of several: NUMBER;CLUSTER.
    Ok(printed.trim().split(';').next().unwrap_or_default().to_owned())
}

fn note(submission: &Submission<'_>, jobs: &[String]) -> Result<(), Failure> {
    let path = submission.dir.join(folder(submission.number)).join(JOBS);
    let lines = jobs.join("\n") + "\n";
    write_atomically(&path, |out| out.write_all(lines.as_bytes()))
        .map_err(|error| Failure::input(format!("{}: {error}", path.display())))
}

/// The jobs of earlier submissions that are waiting or running.
///
/// # Errors
/// When there is no `squeue`, or it fails.
pub fn queued(dir: &Path, next: usize) -> Result<Vec<String>, Failure> {
    let lists =
        (0..next).filter_map(|number| fs::read_to_string(dir.join(folder(number)).join(JOBS)).ok());
    let ours: BTreeSet<String> =
        lists.flat_map(|list| list.lines().map(str::to_owned).collect::<Vec<_>>()).collect();
    if ours.is_empty() {
        return Ok(vec![]);
    }
    let mut command = Command::new("squeue");
    // The number of the array rather than of each of its tasks.
    command.args(["--noheader", "--format=%F"]);
    let listed = printed(command, dir)?;
    let listed: BTreeSet<String> = listed.lines().map(|line| line.trim().to_owned()).collect();
    Ok(ours.intersection(&listed).cloned().collect())
}

/// What a command prints on standard output.
fn printed(mut command: Command, about: &Path) -> Result<String, Failure> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => Failure::input(format!(
            "{name}: there is no such program here; run this where Slurm is, or see --dry-run"
        )),
        _ => Failure::input(format!("{name}: {error}")),
    })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Err(Failure::input(format!("{}: {name}: {said}", about.display())));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
