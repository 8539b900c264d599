//! `defmt` on the target, nothing on the host.

/// As `defmt::info!`.
macro_rules! info {
    ($format:literal $(, $argument:expr)* $(,)?) => {{
        #[cfg(target_os = "none")]
        defmt::info!($format $(, $argument)*);
        #[cfg(not(target_os = "none"))]
        let _ = ($(&$argument,)*);
    }};
}

/// As `defmt::warn!`.
macro_rules! warning {
    ($format:literal $(, $argument:expr)* $(,)?) => {{
        #[cfg(target_os = "none")]
        defmt::warn!($format $(, $argument)*);
        #[cfg(not(target_os = "none"))]
        let _ = ($(&$argument,)*);
    }};
}
