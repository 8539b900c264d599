use crate::device::Step;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar on a terminal, nothing elsewhere.
pub(super) struct Bar(ProgressBar);

impl Bar {
    pub(super) fn new(samples: usize) -> Self {
        let length = u64::try_from(samples).unwrap_or(u64::MAX);
        let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg:<22} [{bar:40}] {pos}/{len} samples")
        {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message("sending");
        Self(bar)
    }

    pub(super) fn show(&self, step: Step) {
        match step {
            Step::Taken(count) => self
                .0
                .set_position(u64::try_from(count).unwrap_or(u64::MAX)),
            Step::Solving(Some(arm)) => self.0.set_message(format!("solving {arm}")),
            Step::Solving(None) => self.0.set_message("solving"),
            Step::BegunAgain => self.0.set_message("restarted, sending"),
        }
    }

    pub(super) fn finish(&self) {
        self.0.finish_and_clear();
    }
}
