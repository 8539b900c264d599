//! What solvers, starts and terminations are called.

use delta_cal::calibration::{Solver, StartUsed, Termination};

pub(super) fn solver_name(solver: Solver) -> &'static str {
    match solver {
        Solver::GaussNewton => "gauss-newton",
        Solver::LevenbergMarquardt => "levenberg-marquardt",
    }
}

pub(super) fn start_name(start: StartUsed) -> &'static str {
    match start {
        StartUsed::Nominal => "robot file",
        StartUsed::Free => "without a guess",
        StartUsed::Search => "search",
        StartUsed::Joint => "joint solution",
    }
}

pub(super) fn termination_name(termination: Termination) -> &'static str {
    match termination {
        Termination::GradientVanished => "converged",
        Termination::RoundingReached => "rounding limit",
    }
}
