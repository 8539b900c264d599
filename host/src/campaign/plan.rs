//! What a campaign computes: every combination of the lists in its file is a case.

use crate::files::robot_file::RobotFile;
use crate::fit::Method;
use delta_cal::calibration::Solver;
use delta_cal::robot::Arm;
use delta_cal::{Noise, Tolerance};
use serde::{Deserialize, Serialize};

/// How the equations are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CampaignSolver {
    /// Levenberg–Marquardt.
    #[default]
    Lm,
    /// Gauss–Newton.
    Gn,
}

impl From<CampaignSolver> for Solver {
    fn from(solver: CampaignSolver) -> Self {
        match solver {
            CampaignSolver::Lm => Self::LevenbergMarquardt,
            CampaignSolver::Gn => Self::GaussNewton,
        }
    }
}

/// How the true robots scatter about the nominal one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Spread {
    /// Every parameter evenly within ± the start error.
    #[default]
    Uniform,
    /// Every parameter normally, the start error being one σ.
    Normal,
}

/// What tells one case from another: the first columns of the rows and of the summary. Lengths are
/// in millimetres and angles in degrees.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Case {
    /// A fingerprint of the nominal robot and its joint limits.
    pub geometry: String,
    /// How the robots scatter.
    pub spread: Spread,
    /// Measured poses a robot.
    pub poses: usize,
    /// Whether the poses were planned.
    pub planned: bool,
    /// Of every length.
    pub start_error_mm: f64,
    /// Of every angle.
    pub start_error_deg: f64,
    /// Of every rotary joint's zero; 0 where `La_x` and `La_y` are off by the error of lengths.
    #[serde(default)]
    pub start_error_zero_deg: f64,
    /// Of the radius that all towers have in common.
    pub start_error_radius_mm: f64,
    /// One σ of each coordinate.
    pub noise_position_mm: f64,
    /// One σ of each joint angle.
    pub noise_joint_deg: f64,
    /// One σ of each travel.
    pub noise_joint_mm: f64,
    /// The estimator.
    pub method: Method,
    /// How it solves.
    pub solver: CampaignSolver,
    /// Whether the calibration knew the noise.
    pub weights: bool,
    /// Whether it knew the tolerance.
    pub prior: bool,
}

/// Robots and what is measured of them. All its cases see the same ones.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scenario {
    /// What all cases have in common.
    pub(super) shared: Case,
    /// One for each method, solver, weights and prior.
    pub(super) cases: Vec<Case>,
    /// `None` for exact measurements.
    pub(super) noise: Option<Noise<f64>>,
    /// What a calibration with a prior assumes: the start error.
    pub(super) tolerance: Option<Tolerance<f64>>,
}

/// A campaign, read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The nominal robot and its joint limits.
    pub robot: RobotFile,
    /// Robots of every case, unless a range is asked for.
    pub robots: u64,
    /// Another seed, other robots.
    pub seed: u64,
    pub(super) scenarios: Vec<Scenario>,
}

impl Plan {
    /// Every case, in the order of the rows.
    pub fn cases(&self) -> impl Iterator<Item = &Case> {
        self.scenarios.iter().flat_map(|scenario| &scenario.cases)
    }

    /// The seed of a robot. It depends on the geometry and on the scenario's values, not on its place
    /// in the file: a longer list adds cases and leaves the others' robots as they were, and robots
    /// of two geometries have nothing in common.
    pub(super) fn seed_of(&self, scenario: &Scenario, robot: u64) -> u64 {
        let case = &scenario.shared;
        let values = [
            case.poses as u64,
            u64::from(case.planned),
            case.start_error_mm.to_bits(),
            case.start_error_deg.to_bits(),
            case.start_error_zero_deg.to_bits(),
            case.start_error_radius_mm.to_bits(),
            case.noise_position_mm.to_bits(),
            case.noise_joint_deg.to_bits(),
            case.noise_joint_mm.to_bits(),
            robot,
        ];
        let geometry = case.geometry.bytes().map(u64::from);
        let values = geometry.chain(values);
        values.fold(mixed(self.seed), |state, value| mixed(state ^ value))
    }
}

/// The nominal robot and its limits as 16 hexadecimal digits.
pub(super) fn fingerprint(file: &RobotFile) -> String {
    let parameters = file.robot.arms().iter().flat_map(Arm::parameters);
    let limits = [file.limits.minimum(), file.limits.maximum()];
    let values = parameters.chain(limits);
    // −0 is 0.
    let state = values.fold(0, |state, value| mixed(state ^ (value + 0.0).to_bits()));
    format!("{state:016x}")
}

/// The output function of SplitMix64 (Steele, Lea, Flood 2014): a bijection, every bit of whose
/// result depends on every bit of its argument.
fn mixed(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

#[cfg(test)]
mod tests {
    use super::mixed;

    /// The first numbers of the generator that SplitMix64's authors publish, seeded with 1234567.
    #[test]
    fn the_mixing_is_that_of_splitmix64() {
        let published = [
            6_457_827_717_110_365_317_u64,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
        ];
        let mut state = 1_234_567_u64;
        for expected in published {
            assert_eq!(mixed(state), expected);
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        }
    }
}
