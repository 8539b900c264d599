//! `defmt` on a target with that feature, otherwise a no-op.

/// `log!(info, …)` is `defmt::info!(…)`; likewise for the other levels.
macro_rules! log {
    ($level:ident, $format:literal $(, $argument:expr)* $(,)?) => {{
        #[cfg(all(target_os = "none", feature = "defmt"))]
        defmt::$level!($format $(, $argument)*);
        #[cfg(not(all(target_os = "none", feature = "defmt")))]
        let _ = ($(&$argument,)*);
    }};
}
