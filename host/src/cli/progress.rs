//! Long commands: how far they are.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::path::Path;
use std::time::Duration;

/// A table of so many bytes is read in some tenths of a second.
const LONG: u64 = 1 << 24;
/// A robust fit of so many rows takes some tenths of a second.
const MANY_ROWS: usize = 2000;

/// A progress bar on a terminal, nothing elsewhere.
pub(super) struct Bar {
    bar: ProgressBar,
    what: &'static str,
}

impl Bar {
    /// Counts what is named, such as `robots`.
    pub(super) fn new(what: &'static str) -> Self {
        let target = ProgressDrawTarget::stderr();
        let bar = Self {
            bar: ProgressBar::with_draw_target(None, target),
            what,
        };
        bar.style("");
        bar
    }

    fn style(&self, time_left: &str) {
        let template = format!("[{{bar:40}}] {{pos}}/{{len}} {}{time_left}", self.what);
        if let Ok(style) = ProgressStyle::with_template(&template) {
            self.bar.set_style(style.progress_chars("=> "));
        }
    }

    pub(super) fn show(&self, finished: u64, whole: u64) {
        if self.bar.length().is_none() {
            // Those that were there before say nothing of the speed.
            self.bar.set_length(whole);
            self.bar.set_position(finished);
            self.bar.reset_eta();
        } else {
            self.bar.set_position(finished);
            // Once there is a speed to tell it from.
            self.style(", {eta} left");
        }
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// That something is computed whose length is not known beforehand: on a terminal, nothing elsewhere.
/// Gone when it is dropped.
pub(super) struct Waiting(ProgressBar);

impl Waiting {
    /// Says for what, such as `planning 20 poses`.
    pub(super) fn new(what: String) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
            bar.set_style(style);
        }
        bar.set_message(what);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    /// What is being computed now.
    pub(super) fn now(&self, what: &'static str) {
        self.0.set_message(what);
    }

    /// While a file is read that takes a while.
    pub(super) fn for_file(path: &Path) -> Option<Self> {
        let length = path.metadata().map_or(0, |metadata| metadata.len());
        (length > LONG).then(|| Self::new(format!("reading {}", path.display())))
    }

    /// While something is done to rows that takes a while.
    pub(super) fn for_rows(what: &str, rows: usize) -> Option<Self> {
        (rows > MANY_ROWS).then(|| Self::new(format!("{what} {rows} rows")))
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
