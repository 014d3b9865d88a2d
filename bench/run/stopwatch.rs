//! Wall-clock and processor time of a piece of work.

use std::time::Instant;

use cpu_time::ProcessTime;

/// Started when it is made.
pub struct Stopwatch {
    wall: Instant,
    cpu: ProcessTime,
}

/// What a stopwatch showed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lap {
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Seconds of the whole process on all processors.
    pub cpu_seconds: f64,
}

impl Stopwatch {
    /// Starts now.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu: ProcessTime::now() }
    }

    /// Time since the start.
    pub fn lap(&self) -> Lap {
        Lap {
            seconds: self.wall.elapsed().as_secs_f64(),
            cpu_seconds: self.cpu.elapsed().as_secs_f64(),
        }
    }

    /// Does `work` and says how long it took.
    pub fn time<T>(work: impl FnOnce() -> T) -> (T, Lap) {
        let watch = Self::start();
        let value = work();
        (value, watch.lap())
    }
}

impl std::ops::AddAssign for Lap {
    fn add_assign(&mut self, other: Self) {
        self.seconds += other.seconds;
        self.cpu_seconds += other.cpu_seconds;
    }
}
