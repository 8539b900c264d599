//! The cases of a campaign: every combination of the lists in its file.

use crate::files::robot_file::RobotFile;
use crate::fit::Method;
use delta_cal::calibration::Solver;
use delta_cal::robot::Arm;
use delta_cal::{Noise, Tolerance};
use serde::{Deserialize, Serialize};

/// The algorithm that solves the equations.
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

/// Distribution of the true robots about the nominal one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Spread {
    /// Every parameter uniform within ± the start error.
    #[default]
    Uniform,
    /// Every parameter normal, with the start error as σ.
    Normal,
}

/// The settings that identify a case: the first columns of the rows and of the summary. Lengths are in millimetres,
/// angles in degrees.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Case {
    /// A fingerprint of the nominal robot and its joint limits.
    pub geometry: String,
    /// Distribution of the true parameters.
    pub spread: Spread,
    /// Measured poses per robot.
    pub poses: usize,
    /// Whether the poses were planned.
    pub planned: bool,
    /// Start error of every length.
    pub start_error_mm: f64,
    /// Start error of every angle.
    pub start_error_deg: f64,
    /// Start error of every rotary joint zero; if 0, `La_x` and `La_y` have the error of lengths instead.
    #[serde(default)]
    pub start_error_zero_deg: f64,
    /// Start error of the radius common to all towers.
    pub start_error_radius_mm: f64,
    /// Noise of each coordinate (σ).
    pub noise_position_mm: f64,
    /// Noise of each joint angle (σ).
    pub noise_joint_deg: f64,
    /// Noise of each joint travel (σ).
    pub noise_joint_mm: f64,
    /// The estimator.
    pub method: Method,
    /// The solver.
    pub solver: CampaignSolver,
    /// Whether the calibration knew the noise.
    pub weights: bool,
    /// Whether it knew the tolerance.
    pub prior: bool,
}

impl Case {
    /// The noise of the measurements; `None` for exact ones.
    pub(super) fn noise(&self) -> Option<Noise<f64>> {
        // A drive is either rotary or linear: one of the two is 0.
        let joint = self.noise_joint_deg.to_radians() + self.noise_joint_mm;
        Noise::new(self.noise_position_mm, joint).ok()
    }

    /// The tolerance that a calibration with a prior assumes: the start error.
    pub(super) fn tolerance(&self) -> Option<Tolerance<f64>> {
        let angle = self.start_error_deg.to_radians();
        let tolerance = Tolerance::new(self.start_error_mm, angle)
            .and_then(|own| own.with_radius(self.start_error_radius_mm))
            .ok()?;
        let zero = self.start_error_zero_deg.to_radians();
        if zero > 0.0 {
            tolerance.with_joint_zero(zero).ok()
        } else {
            Some(tolerance)
        }
    }
}

/// A campaign read from a file and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The nominal robot and its joint limits.
    pub robot: RobotFile,
    /// Number of robots per case unless a range is requested.
    pub robots: u64,
    /// Seed of all random robots.
    pub seed: u64,
    /// Cases that share their robots and measurements, and differ in the calibration. The first one stands for all.
    pub(super) scenarios: Vec<Vec<Case>>,
}

impl Plan {
    /// The seed of a robot. It depends on the geometry and the case's values, not on its position in the file:
    /// extending a list adds cases without changing the robots of the others, and robots of different geometries are
    /// unrelated.
    pub(super) fn seed_of(&self, case: &Case, robot: u64) -> u64 {
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

/// A hash of the nominal robot and its joint limits: 16 hexadecimal digits.
pub(super) fn fingerprint(file: &RobotFile) -> String {
    let parameters = file.robot.arms().iter().flat_map(Arm::parameters);
    let limits = [file.limits.minimum(), file.limits.maximum()];
    let values = parameters.chain(limits);
    // Treat −0 as 0.
    let state = values.fold(0, |state, value| mixed(state ^ (value + 0.0).to_bits()));
    format!("{state:016x}")
}

/// The output function of SplitMix64 (Steele, Lea, Flood 2014): a bijection in which every output bit depends on every
/// input bit.
fn mixed(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

#[cfg(test)]
mod tests {
    use super::mixed;

    /// The first outputs that SplitMix64's authors publish for seed 1234567.
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
