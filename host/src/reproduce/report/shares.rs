//! What tables and findings have in common.

use crate::campaign::CaseSummary;

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
