//! The files of a submission: for each class a script and the items of its tasks, and a script that collects.

use std::fmt::Write as _;
use std::path::Path;

use super::classes::Class;
use super::folder;
use crate::run::shell_line;

/// Name of the list of all items of a submission.
pub const SUBMITTED: &str = "submitted.txt";
/// Name of the folder of what the tasks print.
pub const LOGS: &str = "logs";
/// Name of the script that collects.
pub const COLLECT: &str = "collect.sh";

/// A submission before it is written.
pub struct Submission<'a> {
    /// The planned folder, absolute.
    pub dir: &'a Path,
    /// Its number, from 0.
    pub number: usize,
    /// The program, from the planned folder on.
    pub program: String,
    /// The most tasks of an array that run at the same time.
    pub throttle: Option<u32>,
    /// Options for the engine, as the user gave them.
    pub options: &'a [String],
    /// The arrays.
    pub classes: &'a [Class],
}

impl Submission<'_> {
    /// Number of items.
    pub fn items(&self) -> usize {
        self.classes.iter().map(Class::items).sum()
    }

    /// The script of a class, from the planned folder on.
    pub fn script(&self, class: usize) -> String {
        format!("{}/class-{class}.sh", folder(self.number).display())
    }

    /// The script that collects, from the planned folder on.
    pub fn collecting(&self) -> String {
        format!("{}/{COLLECT}", folder(self.number).display())
    }

    /// All files with their texts, from the planned folder on.
    pub fn files(&self) -> Vec<(String, String)> {
        if self.classes.is_empty() {
            return vec![];
        }
        let folder = folder(self.number);
        let folder = folder.display();
        let mut files = Vec::new();
        let mut submitted = String::new();
        for (index, class) in self.classes.iter().enumerate() {
            let tasks: String =
                class.tasks.iter().map(|task| format!("{}\n", ranges(task))).collect();
            class.tasks.iter().flatten().for_each(|item| {
                let _ = writeln!(submitted, "{item}");
            });
            files.push((self.script(index), self.array_script(index, class)));
            files.push((format!("{folder}/class-{index}.txt"), tasks));
        }
        files.push((self.collecting(), self.collect_script()));
        files.push((format!("{folder}/{SUBMITTED}"), submitted));
        files
    }

    /// A task runs the items of its line one after another. Each that is complete stays: a task that is ended or put into
    /// the queue again begins with the first item that is missing.
    fn array_script(&self, index: usize, class: &Class) -> String {
        let last = class.tasks.len() - 1;
        let throttle = self.throttle.map_or(String::new(), |most| format!("%{most}"));
        let mut head = self.head(&format!("medial-{index}"), "%A_%a");
        let _ = writeln!(head, "#SBATCH --array=0-{last}{throttle}");
        let _ = writeln!(head, "#SBATCH --time={}", class.minutes);
        if let Some(megabytes) = class.megabytes {
            // Slurm counts in powers of two: rounded up, the same bytes.
            let _ = writeln!(head, "#SBATCH --mem={}M", (megabytes * 1_000_000).div_ceil(1 << 20));
        }
        let _ = writeln!(head, "#SBATCH --cpus-per-task={}", class.threads);
        let list = format!("{}/class-{index}.txt", folder(self.number).display());
        head + &self.begin()
            + &format!("items=$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" {list})\n")
            + &format!("exec {} run-item . --quiet --number \"$items\"\n", self.program)
    }

    fn collect_script(&self) -> String {
        let head = self.head("medial-collect", "%A");
        head + &self.begin() + &format!("exec {} collect .\n", self.program)
    }

    fn head(&self, name: &str, log: &str) -> String {
        let log = self.dir.join(folder(self.number)).join(LOGS).join(log);
        let mut head = format!(
            "#!/bin/bash\n#SBATCH --job-name={name}\n#SBATCH --ntasks=1\n#SBATCH --requeue\n\
             #SBATCH --open-mode=append\n#SBATCH --output={}.txt\n",
            shell_line(&[log.display().to_string()])
        );
        for option in self.options {
            let _ = writeln!(head, "#SBATCH {option}");
        }
        head
    }

    /// Without `-e` a script goes on after a failure and ends well.
    fn begin(&self) -> String {
        format!("set -eu\ncd {}\n", shell_line(&[self.dir.display().to_string()]))
    }
}

/// Numbers in ascending order as `run-item` takes them: `0-99,105`.
fn ranges(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match (run[0], run[run.len() - 1]) {
        (first, last) if first == last => first.to_string(),
        (first, last) => format!("{first}-{last}"),
    });
    runs.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_follow_each_other_become_ranges() {
        assert_eq!(ranges(&[0, 1, 2, 5, 7, 8]), "0-2,5,7-8");
        assert_eq!(ranges(&[4]), "4");
    }

    #[test]
    fn scripts_say_what_a_class_needs() {
        let class = Class {
            threads: 2,
            minutes: 7,
            megabytes: Some(1500),
            tasks: vec![vec![3, 4], vec![9]],
        };
        let submission = Submission {
            dir: Path::new("/shared/a plan"),
            number: 1,
            program: "slurm/medial-12ab".into(),
            throttle: Some(5),
            options: &["--partition=long".into()],
            classes: &[class],
        };
        let files: std::collections::BTreeMap<_, _> = submission.files().into_iter().collect();
        assert_eq!(files["slurm/001/class-0.txt"], "3-4\n9\n");
        assert_eq!(files["slurm/001/submitted.txt"], "3\n4\n9\n");
        let script = &files["slurm/001/class-0.sh"];
        for line in [
            "#SBATCH --array=0-1%5",
            "#SBATCH --time=7",
            "#SBATCH --mem=1431M",
            "#SBATCH --cpus-per-task=2",
            "#SBATCH --requeue",
            "#SBATCH --partition=long",
            "set -eu",
            "cd '/shared/a plan'",
        ] {
            assert!(script.lines().any(|other| other == line), "{line}:\n{script}");
        }
        assert!(files["slurm/001/collect.sh"].contains("collect ."));
    }
}
