//! Advice that several refusals give.

pub(in crate::calibration) const CHECK: &str = "check the units, the order of the joints and their sign (a positive angle \
                     swings the arm towards the platform)";
pub(in crate::calibration) const SPREAD: &str =
    "spread the poses over the whole workspace, each joint over its whole range";

/// The first hint that applies, and the others after it.
pub(in crate::calibration) fn joined(hints: &[Option<String>]) -> String {
    let hints: Vec<_> = hints.iter().flatten().map(String::as_str).collect();
    hints.join("; otherwise ")
}
