//! What a stage costs: the time that passed, and the time that its processes used, which says on a busy
//! machine what the stage would take on an idle one.

use std::time::{Duration, Instant};

/// Linux counts a process's time in hundredths of a second for every program that asks.
const TICK: Duration = Duration::from_millis(10);

/// Since when something runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    at: Instant,
    used: Option<Duration>,
}

/// What something took.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cost {
    passed: Duration,
    /// Of all its processes together; `None` where the system does not say.
    used: Option<Duration>,
}

impl Start {
    pub(crate) fn now() -> Self {
        Self {
            at: Instant::now(),
            used: used(),
        }
    }

    pub(crate) fn cost(self) -> Cost {
        Cost {
            passed: self.at.elapsed(),
            used: used()
                .zip(self.used)
                .map(|(now, then)| now.saturating_sub(then)),
        }
    }
}

impl std::fmt::Display for Cost {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{:>6.1} s", self.passed.as_secs_f64())?;
        match self.used {
            Some(used) => write!(
                formatter,
                "  {:>6.1} s of processor time",
                used.as_secs_f64()
            ),
            None => Ok(()),
        }
    }
}

/// Of all processes that this one has started and that have ended.
fn used() -> Option<Duration> {
    ended(&std::fs::read_to_string("/proc/self/stat").ok()?)
}

/// `cutime` and `cstime` of proc(5); the name before them may hold spaces and brackets.
fn ended(stat: &str) -> Option<Duration> {
    let (_, behind_name) = stat.rsplit_once(')')?;
    let mut fields = behind_name.split_whitespace().skip(13);
    let mut ticks = || fields.next()?.parse::<u32>().ok();
    Some(TICK * (ticks()? + ticks()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fields in the order of proc(5).
    #[test]
    fn the_time_of_ended_processes_is_read() {
        let stat = "77 (a (b) c) S 1 77 77 0 -1 4194560 1 2 3 4 5 6 1234 66 20 0 1 0 9 8 7\n";
        assert_eq!(ended(stat), Some(Duration::from_secs(13)));
        assert_eq!(ended("77 (a) S 1"), None);
    }
}
