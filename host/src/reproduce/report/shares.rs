//! What tables and findings have in common.

use crate::campaign::CaseSummary;

/// Two decimals near 100, where they matter.
pub(super) fn percent(value: f64) -> String {
    let text = if (99.0..99.995).contains(&value) {
        format!("{value:.2}")
    } else {
        format!("{:.0}", value + 0.0)
    };
    text.replace('-', "−")
}

/// Never rounded up to all of them.
pub(super) fn share(value: f64) -> String {
    if value > 99.0 && value < 100.0 {
        format!("{:.1}", value.min(99.9))
    } else {
        format!("{value:.0}")
    }
}

/// FKM and IKM of the same scenario.
pub(super) fn pairs(cases: &[CaseSummary]) -> Vec<(&CaseSummary, &CaseSummary)> {
    let same = |a: &CaseSummary, b: &CaseSummary| {
        (a.case.poses, a.case.planned) == (b.case.poses, b.case.planned)
            && (a.case.noise_position_mm, a.case.noise_joint_deg)
                == (b.case.noise_position_mm, b.case.noise_joint_deg)
    };
    let of = |method: &'static str| {
        cases
            .iter()
            .filter(move |summary| summary.case.method == method)
    };
    of("fkm")
        .filter_map(|fkm| Some((fkm, of("ikm").find(|ikm| same(fkm, ikm))?)))
        .collect()
}

/// Of the parameter errors of the median robots, IKM over FKM.
pub(super) fn ratio(fkm: &CaseSummary, ikm: &CaseSummary) -> Option<f64> {
    Some(ikm.parameter_error_mm?.median / fkm.parameter_error_mm?.median)
}
