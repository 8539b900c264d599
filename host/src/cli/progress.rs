//! Progress of long commands.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};
use std::borrow::Cow;
use std::time::Duration;

/// A progress bar, or a spinner for computations of unknown duration: on a terminal, nothing elsewhere. Removed when
/// dropped.
pub(super) struct Progress(ProgressBar);

impl Progress {
    fn new(template: &str) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        Self(bar.with_finish(ProgressFinish::AndClear))
    }

    /// A bar; `what` is being counted, such as `robots`.
    pub(super) fn bar(what: &str) -> Self {
        Self::new(&format!(
            "[{{bar:40}}] {{pos}}/{{len}} {what}, {{eta}} left"
        ))
    }

    /// A spinner; `what` is being done, such as `planning 20 poses`.
    pub(super) fn spinner(what: impl Into<Cow<'static, str>>) -> Self {
        let own = Self::new("{spinner} {msg}, {elapsed}");
        own.0.set_message(what);
        own.0.enable_steady_tick(Duration::from_millis(200));
        own
    }

    pub(super) fn show(&self, finished: u64, whole: u64) {
        self.0.set_length(whole);
        self.0.set_position(finished);
    }

    /// Shows what is being computed now.
    pub(super) fn now(&self, what: &'static str) {
        self.0.set_message(what);
    }
}
