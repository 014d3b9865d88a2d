//! Classes of items of like needs, since an array of jobs has one limit of time and one of memory for all its tasks.
//!
//! Two items are alike if they take as many threads and their times and memories lie in the same step of a factor of
//! four and of two. A class asks for the most that one of its tasks needs.

use std::collections::BTreeMap;

use super::estimate::Need;

/// Tasks of an array: Slurm's default `MaxArraySize` of 1001 bounds the indices, which begin at 0.
const MOST_TASKS: usize = 1000;
/// Seconds for the start of a task, beside its items.
const START: f64 = 60.0;

/// An array of tasks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Class {
    /// Threads of each task.
    pub threads: usize,
    /// Limit of time of each task.
    pub minutes: u64,
    /// Memory of each task; none where the study has no limit.
    pub megabytes: Option<u64>,
    /// The items of each task, which runs them one after another.
    pub tasks: Vec<Vec<usize>>,
}

impl Class {
    /// Number of items.
    pub fn items(&self) -> usize {
        self.tasks.iter().map(Vec::len).sum()
    }
}

/// The classes of some items, each with tasks of about so many seconds: items that follow each other stay together, since
/// they are often of one mesh, which is prepared once then.
pub fn classes(needs: &[Need], task_seconds: f64) -> Vec<Class> {
    let mut groups: BTreeMap<(usize, i32, i32), Vec<Need>> = BTreeMap::new();
    for &need in needs {
        let step = |value: f64, base: f64| value.max(1.0).log(base).ceil().min(1e6) as i32;
        let key = (need.threads, step(need.bytes, 2.0), step(need.seconds, 4.0));
        groups.entry(key).or_default().push(need);
    }
    groups.into_values().map(|group| class(&group, task_seconds)).collect()
}

fn class(needs: &[Need], task_seconds: f64) -> Class {
    let total: f64 = needs.iter().map(|need| need.seconds).sum();
    let tasks = ((total / task_seconds).ceil() as usize).clamp(1, MOST_TASKS.min(needs.len()));
    let tasks: Vec<&[Need]> = needs.chunks(needs.len().div_ceil(tasks)).collect();
    let seconds = |task: &&[Need]| task.iter().map(|need| need.seconds).sum::<f64>();
    let longest = tasks.iter().map(seconds).fold(0.0, f64::max);
    let bytes = needs.iter().map(|need| need.bytes).fold(0.0, f64::max);
    Class {
        threads: needs[0].threads,
        minutes: ((START + longest) / 60.0).ceil() as u64,
        megabytes: bytes.is_finite().then(|| (bytes / 1e6).ceil() as u64),
        tasks: tasks.iter().map(|task| task.iter().map(|need| need.number).collect()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn need(number: usize, seconds: f64, bytes: f64) -> Need {
        Need { number, threads: 1, seconds, bytes }
    }

    #[test]
    fn every_item_is_in_one_task_whose_limits_hold_it() {
        let needs: Vec<Need> = (0..12_345)
            .map(|k| need(k, 1.0 + (k * k % 997) as f64, 1e8 * (1 + k % 50) as f64))
            .collect();
        let classes = classes(&needs, 600.0);
        let mut items: Vec<usize> = Vec::new();
        for class in &classes {
            assert!(class.tasks.len() <= MOST_TASKS);
            for task in &class.tasks {
                let seconds: f64 = task.iter().map(|&k| needs[k].seconds).sum();
                assert!(seconds <= class.minutes as f64 * 60.0);
                let fits = |&k: &usize| needs[k].bytes <= class.megabytes.unwrap() as f64 * 1e6;
                assert!(task.iter().all(fits));
                items.extend(task);
            }
        }
        items.sort_unstable();
        assert_eq!(items, (0..12_345).collect::<Vec<_>>());
    }

    #[test]
    fn many_items_need_no_more_tasks_than_an_array_has() {
        let needs: Vec<Need> = (0..100_000).map(|k| need(k, 900.0, f64::INFINITY)).collect();
        let [class] = &classes(&needs, 60.0)[..] else { panic!("they are alike") };
        assert_eq!((class.tasks.len(), class.megabytes), (MOST_TASKS, None));
        assert_eq!(class.tasks[0].len(), 100);
        assert!(classes(&[], 60.0).is_empty());
    }
}
