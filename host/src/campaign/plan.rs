//! What a campaign computes: its scenarios, its variants, and which robots.

use crate::files::robot_file::RobotFile;
use crate::fit::options::CalibrationMethod;
use crate::planning::Instrument;
use delta_cal::calibration::{Solver, Start};
use delta_cal::robot::Drive;
use delta_cal::{Noise, Tolerance};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// The name of positions.
const POSITIONS: &str = "xyz";

/// How a simulated robot is calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CampaignMethod {
    /// The joint calibration in double precision: all 24 parameters at once.
    #[serde(rename = "joint")]
    Joint,
    /// The joint calibration in single precision, as a controller computes it.
    #[serde(rename = "joint-f32")]
    JointSingle,
    /// The joint calibration in double precision, without a start guess.
    #[serde(rename = "joint-no-guess")]
    JointNoGuess,
    /// The IKM method in double precision: each arm by itself.
    #[serde(rename = "ikm")]
    Ikm,
    /// The IKM method in single precision, as a controller computes it.
    #[serde(rename = "ikm-f32")]
    IkmSingle,
    /// The IKM method in double precision, without a start guess.
    #[serde(rename = "ikm-no-guess")]
    IkmNoGuess,
    /// The FKM method: all 24 parameters at once.
    #[serde(rename = "fkm")]
    Fkm,
    /// The FKM method, without a start guess.
    #[serde(rename = "fkm-no-guess")]
    FkmNoGuess,
}

impl CampaignMethod {
    /// As in the campaign file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::JointSingle => "joint-f32",
            Self::JointNoGuess => "joint-no-guess",
            Self::Ikm => "ikm",
            Self::IkmSingle => "ikm-f32",
            Self::IkmNoGuess => "ikm-no-guess",
            Self::Fkm => "fkm",
            Self::FkmNoGuess => "fkm-no-guess",
        }
    }

    /// Which method, whatever the precision.
    pub(super) const fn calibration_method(self) -> CalibrationMethod {
        match self {
            Self::Joint | Self::JointSingle | Self::JointNoGuess => CalibrationMethod::Joint,
            Self::Ikm | Self::IkmSingle | Self::IkmNoGuess => CalibrationMethod::Ikm,
            Self::Fkm | Self::FkmNoGuess => CalibrationMethod::Fkm,
        }
    }

    /// Where its iteration begins.
    pub(super) const fn start(self) -> Start {
        match self {
            Self::Joint | Self::JointSingle | Self::Ikm | Self::IkmSingle | Self::Fkm => {
                Start::Nominal
            }
            Self::JointNoGuess | Self::IkmNoGuess | Self::FkmNoGuess => Start::Free,
        }
    }

    /// A parameter error below this is that of the arithmetic, mm.
    pub(super) const fn exact(self) -> f64 {
        match self {
            Self::IkmSingle | Self::JointSingle => 5e-3,
            _ => 1e-6,
        }
    }
}

/// How the equations are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CampaignSolver {
    /// Levenberg–Marquardt.
    Lm,
    /// Gauss–Newton.
    Gn,
}

impl CampaignSolver {
    /// As in the campaign file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lm => "lm",
            Self::Gn => "gn",
        }
    }

    /// The core's name for it.
    pub const fn calibration_solver(self) -> Solver {
        match self {
            Self::Lm => Solver::LevenbergMarquardt,
            Self::Gn => Solver::GaussNewton,
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

impl Spread {
    const fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Normal => "normal",
        }
    }
}

/// What is measured of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measure {
    /// x, y and z in the robot's frame.
    Positions,
    /// What an instrument of [`Instrument::ALL`] reads; its noise is the case's.
    With(Instrument),
}

impl Measure {
    /// As in the campaign file: `xyz`, or the instrument's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Positions => POSITIONS,
            Self::With(instrument) => instrument.name,
        }
    }

    /// All of them.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        std::iter::once(Self::Positions).chain(Instrument::ALL.map(Self::With))
    }
}

/// A length and an angle: a start error, or a tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthAngle {
    /// Of every length, mm.
    pub length_mm: f64,
    /// Of every angle, degrees.
    pub angle_deg: f64,
    /// Of the radius that all towers have in common, mm; 0 with other drives.
    pub radius_mm: f64,
}

/// One σ of the simulated measurements; both 0 for exact ones.
///
/// Of heights and distances as of coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseLevel {
    /// Of each coordinate, height or distance, mm.
    pub position_mm: f64,
    /// Of each joint angle, degrees; 0 with linear drives.
    pub joint_deg: f64,
    /// Of each travel, mm; 0 with other drives.
    pub joint_mm: f64,
}

/// What is measured, on which robots. All variants of a scenario see the same robots and the same
/// measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scenario {
    /// What is measured.
    pub measure: Measure,
    /// Measured poses of each robot.
    pub poses: usize,
    /// How far the robots are from nominal.
    pub start_error: LengthAngle,
    /// Of the measurements.
    pub noise_level: NoiseLevel,
    /// The noise in the core's units; `None` for exact measurements.
    pub noise: Option<Noise<f64>>,
    /// What a calibration with a prior assumes.
    pub tolerance: Option<Tolerance<f64>>,
    /// Whether the poses are chosen by experiment design, not drawn.
    pub planned: bool,
}

/// How the robots of a scenario are calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// IKM or FKM.
    pub method: CampaignMethod,
    /// Levenberg–Marquardt or Gauss–Newton.
    pub solver: CampaignSolver,
    /// Whether the calibration knows the noise.
    pub weights: bool,
    /// Whether it knows the tolerance.
    pub prior: bool,
}

/// A campaign, read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The nominal robot and its joint limits.
    pub robot: RobotFile,
    /// Robots of every case.
    pub robots: u64,
    /// Another seed, other robots.
    pub seed: u64,
    /// How they scatter.
    pub spread: Spread,
    /// The tolerance of every case in place of its start error, if stated.
    pub tolerance: Option<LengthAngle>,
    /// What is measured.
    pub measure: Vec<Measure>,
    /// Pose counts.
    pub poses: Vec<usize>,
    /// Start errors.
    pub start_errors: Vec<LengthAngle>,
    /// Noise levels.
    pub noise_levels: Vec<NoiseLevel>,
    /// Whether the poses are chosen.
    pub planned: Vec<bool>,
    /// Methods.
    pub methods: Vec<CampaignMethod>,
    /// Solvers.
    pub solvers: Vec<CampaignSolver>,
    /// With and without knowledge of the noise.
    pub weights: Vec<bool>,
    /// With and without a prior.
    pub prior: Vec<bool>,
    /// Whether each parameter's gain is written, too.
    pub parameters: bool,
    /// In the order of the rows.
    pub(super) scenarios: Vec<Scenario>,
}

impl Plan {
    /// What is measured × poses × start errors × noise levels × random or planned, in the order of the rows.
    pub fn scenarios(&self) -> &[Scenario] {
        &self.scenarios
    }

    /// Methods × solvers × weights × prior, in the order of the rows.
    pub fn variants(&self) -> Vec<Variant> {
        let mut variants = Vec::new();
        for &method in &self.methods {
            for &solver in &self.solvers {
                for &weights in &self.weights {
                    for &prior in &self.prior {
                        variants.push(Variant {
                            method,
                            solver,
                            weights,
                            prior,
                        });
                    }
                }
            }
        }
        variants
    }

    /// The plan as a campaign file beside its robot file: every key, in one order. Two campaigns
    /// compute the same if and only if both texts are the same.
    pub fn to_toml(&self, robot_file: &str) -> String {
        let mut text = format!(
            "# Computed by delta-cal {}.\n\nrobot = \"{robot_file}\"\nrobots = {}\nseed = {}\n\
             spread = \"{}\"\nmeasure = {:?}\nposes = {:?}\n",
            env!("CARGO_PKG_VERSION"),
            self.robots,
            self.seed,
            self.spread.name(),
            self.measure
                .iter()
                .map(|own| own.name())
                .collect::<Vec<_>>(),
            self.poses
        );
        text.push_str("start_errors = [\n");
        for error in &self.start_errors {
            let LengthAngle {
                length_mm,
                angle_deg,
                radius_mm,
            } = error;
            let _ = write!(
                text,
                "    {{ length_mm = {length_mm:?}, angle_deg = {angle_deg:?}"
            );
            if *radius_mm > 0.0 {
                let _ = write!(text, ", radius_mm = {radius_mm:?}");
            }
            text.push_str(" },\n");
        }
        text.push_str("]\nnoise_levels = [\n");
        for level in &self.noise_levels {
            let NoiseLevel {
                position_mm,
                joint_deg,
                joint_mm,
            } = level;
            let joint = match self.robot.robot.drive() {
                Drive::Rotary => format!("joint_deg = {joint_deg:?}"),
                Drive::Linear => format!("joint_mm = {joint_mm:?}"),
            };
            let _ = writeln!(text, "    {{ position_mm = {position_mm:?}, {joint} }},");
        }
        let methods: Vec<_> = self.methods.iter().map(|method| method.name()).collect();
        let solvers: Vec<_> = self.solvers.iter().map(|solver| solver.name()).collect();
        let _ = writeln!(
            text,
            "]\nmethods = {methods:?}\nsolvers = {solvers:?}\nweights = {:?}\nprior = {:?}\n\
             planned = {:?}\nparameters = {}",
            self.weights, self.prior, self.planned, self.parameters
        );
        if let Some(tolerance) = &self.tolerance {
            let _ = writeln!(
                text,
                "\n[tolerance]\nlength_mm = {:?}\nangle_deg = {:?}",
                tolerance.length_mm, tolerance.angle_deg
            );
            if tolerance.radius_mm > 0.0 {
                let _ = writeln!(text, "radius_mm = {:?}", tolerance.radius_mm);
            }
        }
        text
    }

    /// The plan's robot file.
    pub fn robot_toml(&self) -> String {
        self.robot.to_toml("The nominal robot of the campaign.")
    }
}

/// Part `number` of `of` equal parts of a campaign; every scenario's robots are dealt in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Counted from 1.
    pub number: u64,
    /// How many there are.
    pub of: u64,
}

impl Shard {
    /// The whole campaign.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Robots of each scenario that fall to this shard.
    pub const fn robots(self, plan: &Plan) -> u64 {
        (plan.robots + self.of - self.number) / self.of
    }

    /// The `index`th robot of the shard.
    pub const fn robot(self, index: u64) -> u64 {
        index * self.of + self.number - 1
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}/{}", self.number, self.of)
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let shard = text.split_once('/').and_then(|(number, of)| {
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            Some(Self { number, of })
        });
        match shard {
            Some(shard) if (1..=shard.of).contains(&shard.number) => Ok(shard),
            Some(_) => Err("a shard is counted from 1: 1/4, 2/4, 3/4, 4/4".to_owned()),
            None => Err("a shard is written K/N, such as 1/4".to_owned()),
        }
    }
}
