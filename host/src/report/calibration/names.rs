//! What solvers, starts and terminations are called.

use delta_cal::{Method, StartUsed, Termination};

pub(super) fn solver_name(solver: Method) -> &'static str {
    match solver {
        Method::GaussNewton => "gauss-newton",
        Method::LevenbergMarquardt => "levenberg-marquardt",
    }
}

pub(super) fn start_name(start: StartUsed) -> &'static str {
    match start {
        StartUsed::Reference => "robot file",
        StartUsed::Free => "without a guess",
        StartUsed::Search => "search",
        StartUsed::Ikm => "IKM solution",
    }
}

pub(super) fn termination_name(termination: Termination) -> &'static str {
    match termination {
        Termination::GradientVanished => "converged",
        Termination::RoundingReached => "rounding limit",
    }
}
