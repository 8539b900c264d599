//! Progress of long commands.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;

/// A fit of this many rows takes some tenths of a second.
const MANY_ROWS: usize = 2000;

/// A progress bar on a terminal, nothing elsewhere. Removed when dropped.
pub(super) struct Bar(ProgressBar);

impl Bar {
    /// `what` is being counted, such as `robots`.
    pub(super) fn new(what: &str) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        let template = format!("[{{bar:40}}] {{pos}}/{{len}} {what}, {{eta}} left");
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style.progress_chars("=> "));
        }
        Self(bar)
    }

    pub(super) fn show(&self, finished: u64, whole: u64) {
        self.0.set_length(whole);
        self.0.set_position(finished);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// A spinner for computations of unknown duration, on a terminal only. Removed when dropped.
pub(super) struct Waiting(ProgressBar);

impl Waiting {
    /// `what` is being done, such as `planning 20 poses`.
    pub(super) fn new(what: String) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
            bar.set_style(style);
        }
        bar.set_message(what);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    /// Shows what is being computed now.
    pub(super) fn now(&self, what: &'static str) {
        self.0.set_message(what);
    }

    /// A spinner, if there are so many rows that the work takes noticeable time.
    pub(super) fn for_rows(what: &str, rows: usize) -> Option<Self> {
        (rows > MANY_ROWS).then(|| Self::new(format!("{what} {rows} rows")))
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
