//! The panic-free proof. Each public function of the core is a symbol `core_<scalar>_<function>`
//! here. The panic handler calls a function that exists nowhere: what links has no path to it.
//!
//! `cargo verify budgets` links all symbols, and on failure each alone. `panics_on_purpose` must
//! not link, or the proof would prove nothing.
//!
//! Not among them: `Display`, `Debug` and the like (the formatting of `core::fmt` has panic paths),
//! and the features that add foreign traits.

#![cfg_attr(target_os = "none", no_std)]

#[cfg(target_os = "none")]
mod functions;
#[cfg(target_os = "none")]
mod handler;
