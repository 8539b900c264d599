//! Stopping long computations from another thread, as when a user presses Ctrl-C, and seeing from there how far they are.
//!
//! Their loops call [`check`], which unwinds while anyone wants them stopped: no result is half done, and no function
//! needs another kind of error. Where panics abort, as in a browser, nobody calls [`Halt::new`].

use std::sync::atomic::{AtomicUsize, Ordering};

static WANTED: AtomicUsize = AtomicUsize::new(0);

/// How many steps of a computation are done.
#[derive(Debug, Default)]
pub struct Steps([AtomicUsize; 2]);

impl Steps {
    /// Those done, and all that are known to be needed so far.
    pub fn counted(&self) -> [usize; 2] {
        self.0.each_ref().map(|own| own.load(Ordering::Relaxed))
    }

    /// So many more will be needed.
    pub(crate) fn expect(&self, more: usize) {
        self.0[1].fetch_add(more, Ordering::Relaxed);
    }

    /// One is done.
    pub(crate) fn step(&self) {
        self.0[0].fetch_add(1, Ordering::Relaxed);
    }
}

/// The payload with which [`check`] unwinds.
#[derive(Debug)]
pub struct Halted;

/// All computations of the process stop as long as there is one.
#[derive(Debug)]
#[must_use]
pub struct Halt(());

impl Halt {
    /// Stops them.
    #[expect(clippy::new_without_default, reason = "it acts")]
    pub fn new() -> Self {
        WANTED.fetch_add(1, Ordering::Relaxed);
        Self(())
    }

    /// Whether there is one.
    pub fn is_wanted() -> bool {
        WANTED.load(Ordering::Relaxed) > 0
    }
}

impl Drop for Halt {
    fn drop(&mut self) {
        WANTED.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Returns, unless computations are to stop; of no measurable cost. Outside a pool of threads, whose owner expects it, it
/// always returns.
#[inline]
pub fn check() {
    #[cfg(not(target_family = "wasm"))]
    if Halt::is_wanted() && rayon::current_thread_index().is_some() {
        std::panic::resume_unwind(Box::new(Halted));
    }
}
