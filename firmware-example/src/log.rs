//! `defmt` on a target with that feature, otherwise no-ops.

/// Like `defmt::info!`.
macro_rules! info {
    ($format:literal $(, $argument:expr)* $(,)?) => {{
        #[cfg(all(target_os = "none", feature = "defmt"))]
        defmt::info!($format $(, $argument)*);
        #[cfg(not(all(target_os = "none", feature = "defmt")))]
        let _ = ($(&$argument,)*);
    }};
}

/// Like `defmt::warn!`.
macro_rules! warning {
    ($format:literal $(, $argument:expr)* $(,)?) => {{
        #[cfg(all(target_os = "none", feature = "defmt"))]
        defmt::warn!($format $(, $argument)*);
        #[cfg(not(all(target_os = "none", feature = "defmt")))]
        let _ = ($(&$argument,)*);
    }};
}
