//! Work on all cores; one after the other where there are no threads, as in a browser.

use crate::halt;
#[cfg(not(target_family = "wasm"))]
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

/// Most pieces of the work for each core.
#[cfg(not(target_family = "wasm"))]
const PIECES: usize = 64;

/// As many robots or lines at a time keep every core busy.
pub(crate) fn count() -> usize {
    #[cfg(not(target_family = "wasm"))]
    return rayon::current_num_threads();
    #[cfg(target_family = "wasm")]
    return 1;
}

/// What a function makes of each item, in their order. Before each, it can be stopped.
pub(crate) fn map<I, R: Send>(items: I, of: impl Fn(I::Item) -> R + Send + Sync) -> Vec<R>
where
    I: IntoIterator<Item: Send>,
{
    let of = |item| {
        halt::check();
        of(item)
    };
    #[cfg(not(target_family = "wasm"))]
    {
        let items: Vec<_> = items.into_iter().collect();
        // Stopping unwinds each piece.
        let least = items.len() / (PIECES * count());
        let items = items.into_par_iter().with_min_len(least.max(1));
        items.map(of).collect()
    }
    #[cfg(target_family = "wasm")]
    return items.into_iter().map(of).collect();
}

pub(crate) fn join<A: Send, B: Send>(
    one: impl FnOnce() -> A + Send,
    other: impl FnOnce() -> B + Send,
) -> (A, B) {
    #[cfg(not(target_family = "wasm"))]
    return rayon::join(one, other);
    #[cfg(target_family = "wasm")]
    return (one(), other());
}
