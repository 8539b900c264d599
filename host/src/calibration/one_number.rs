//! Single numbers of the robot file that, if wrong, explain readings that contradict the stated tolerance: joint zeros,
//! gear ratio, radius, forearms, overall size. Numbers that explain them about equally well are named together.

use super::causes::explained_by;
use super::credibility::NoiseVerdict;
use super::judge::{Case, attempt};
use super::wrong_rows::each_pose;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Readings;
use crate::fit::{Solution, solve};
use crate::text::{list, significant};
use delta_cal::robot::{Drive, Parameter};
use delta_cal::{ArmIndex, Robot};
use nalgebra::Vector3;

/// Most linearisations per number; zeros that are ten degrees off need several.
const ROUNDS: u32 = 8;
/// A number has converged if its relative change is below this.
const SETTLED: f64 = 0.02;
/// Larger corrections explain anything: radians, or fraction of a length.
const LARGEST: f64 = 0.5;
/// Step of a difference quotient.
const STEP: f64 = 1e-6;
/// Twice the logarithm of 20: a smaller difference between explanations is not clear.
const CLEARLY: f64 = 6.0;
/// Tolerance of entirely unknown joint zeros, degrees.
const UNKNOWN_ZERO_DEG: f64 = 15.0;
/// Factor for the stated noise until the number is found, because the readings contradict it.
const LOOSE: f64 = 30.0;
/// Files with more rows are not refitted.
const MOST_ROWS: usize = 300;

/// A number common to all arms, the easiest to measure first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Wrong {
    Forearm,
    /// Distance from the axis to the motors or towers.
    Radius,
    /// All joint zeros, by the same angle.
    Zero,
    /// The gear ratio: degrees per turn, or steps per mm of travel.
    Gear,
    /// All lengths.
    Size,
}

/// In the order of a message.
const NUMBERS: [Wrong; 5] = [
    Wrong::Zero,
    Wrong::Forearm,
    Wrong::Radius,
    Wrong::Gear,
    Wrong::Size,
];

impl Wrong {
    /// The robot with the number changed by an angle, or by a fraction of itself.
    fn changed(self, robot: &Robot<f64>, by: f64) -> Option<Robot<f64>> {
        let drive = robot.drive();
        let mut parameters = robot.parameters();
        for own in &mut parameters {
            match self {
                Self::Zero => return turned(robot, by),
                Self::Gear => {}
                Self::Radius => (own[0], own[1]) = (own[0] * (1.0 + by), own[1] * (1.0 + by)),
                Self::Forearm => own[7] *= 1.0 + by,
                Self::Size => {
                    for (value, parameter) in own.iter_mut().zip(drive.places()) {
                        let length = parameter.is_some_and(|own| {
                            own.kind() == delta_cal::robot::ParameterKind::Length
                                || own == Parameter::Scale
                        });
                        if length {
                            *value *= 1.0 + by;
                        }
                    }
                }
            }
        }
        robot.with_parameters(parameters).ok()
    }

    /// The readings with the joints as the actual gear turned them.
    fn turned(self, readings: &Readings, by: f64) -> Readings {
        let mut turned = readings.clone();
        if self == Self::Gear {
            for row in &mut turned.rows {
                each_pose(&mut row.value, |joints| joints.map(|q| q * (1.0 + by)));
            }
        }
        turned
    }

    /// Derivative of the platform's position with respect to the number.
    fn moves(self, robot: &Robot<f64>, joints: &[f64; 3]) -> Option<Vector3<f64>> {
        let here = robot.forward(joints).ok()?;
        let there = match self {
            Self::Gear => robot.forward(&joints.map(|q| q * (1.0 + STEP))).ok()?,
            _ => self.changed(robot, STEP)?.forward(joints).ok()?,
        };
        Some((there - here) / STEP)
    }

    /// In words, with its error and the corrected value.
    fn words(self, robot: &RobotFile, by: f64) -> String {
        let [arm, ..] = robot.robot.arms();
        let percent = format!("{:+.2} %", 100.0 * by);
        let length = |own: f64| significant(own * (1.0 + by), 4);
        match self {
            Self::Zero => format!(
                "all joint zeros are off by {:+.1}° (the arms hang {} than their joints read)",
                by.to_degrees(),
                if by < 0.0 { "lower" } else { "higher" }
            ),
            Self::Gear if robot.robot.drive() == Drive::Linear => {
                format!("the steps of the carriages are off by {percent}")
            }
            Self::Gear => format!("the gear ratio is off by {percent}"),
            Self::Radius => format!(
                "the radius is off by {percent} (base less platform {} mm)",
                length(arm.d().xy().norm())
            ),
            Self::Forearm => format!("the forearms are {} mm long ({percent})", length(arm.lb())),
            Self::Size => format!(
                "everything is {:.2} % {}, or the instrument's scale is wrong by that",
                100.0 * by.abs(),
                if by > 0.0 { "larger" } else { "smaller" }
            ),
        }
    }

    /// The cheapest measurement that shows it, and what to write if this is the wrong number.
    const fn advice(self) -> [&'static str; 2] {
        match self {
            Self::Zero => [
                "an arm put level, and what its joint reads then",
                "Home the robot again, or state zero_deg in [tolerance], how many degrees its joint zeros may be off",
            ],
            Self::Gear => [
                "a known turn or travel of one joint, and what it reads",
                "If it is the gear, correct its ratio in the controller",
            ],
            Self::Radius => [
                "the distance between two motors or towers",
                "If it is that length, correct it in the robot file",
            ],
            Self::Forearm => [
                "a forearm's length with a calliper",
                "If it is that length, correct it in the robot file",
            ],
            Self::Size => [
                "one known length, as a gauge block",
                "Measure one known length",
            ],
        }
    }
}

/// The robot with all joint zeros changed by an angle.
pub(crate) fn turned(robot: &Robot<f64>, by: f64) -> Option<Robot<f64>> {
    let (sine, cosine) = by.sin_cos();
    let mut parameters = robot.parameters();
    for own in &mut parameters {
        let [x, y] = [own[5], own[6]];
        (own[5], own[6]) = (cosine * x - sine * y, sine * x + cosine * y);
    }
    robot.with_parameters(parameters).ok()
}

/// An explanation of the readings.
struct Explanation {
    /// `None` for individual joint zeros.
    wrong: Option<Wrong>,
    /// The explanation in words.
    what: String,
    /// Σ r² including the prior's part.
    cost: f64,
}

/// The explanations by one number or the joint zeros, in sentences with remedies; `None` if there are none.
pub(crate) fn explanation(case: &Case<'_>) -> Option<String> {
    if case.readings.rows.len() > MOST_ROWS {
        return None;
    }
    let turns = case.robot.robot.drive() == Drive::Rotary;
    let numbers = NUMBERS.into_iter();
    let numbers = numbers.filter(|own| turns || *own != Wrong::Zero);
    let numbers = numbers.filter_map(|wrong| tried(case, wrong));
    let mut found: Vec<_> = zeros(case).into_iter().chain(numbers).collect();
    let best = found.iter().map(|own| own.cost).reduce(f64::min)?;
    found.retain(|own| own.cost < best + CLEARLY);
    // Individual zeros include a common one.
    if found.iter().any(|own| own.wrong.is_none()) {
        found.retain(|own| own.wrong != Some(Wrong::Zero));
    }
    let first = found.first()?;
    let [_, remedy] = first.wrong.unwrap_or(Wrong::Zero).advice();
    Some(match &found[..] {
        [one] => format!("This explains the readings: {}. {remedy}.", one.what),
        several => {
            let all: Vec<_> = several.iter().map(|own| own.what.as_str()).collect();
            let numbers = several.iter().map(|own| own.wrong.unwrap_or(Wrong::Zero));
            let [check, _] = numbers.min().unwrap_or(Wrong::Zero).advice();
            format!(
                "Each of these explains the readings about equally well: {}. The cheapest measurement that decides is {check}. {remedy}.",
                all.join("; or ")
            )
        }
    })
}

/// Tests individual joint zeros, if their tolerance is not stated.
fn zeros(case: &Case<'_>) -> Option<Explanation> {
    let tolerance = case.robot.tolerance?;
    if case.robot.robot.drive() == Drive::Linear || tolerance.joint_zero().is_some() {
        return None;
    }
    let unknown = tolerance.with_joint_zero(UNKNOWN_ZERO_DEG.to_radians());
    let robot = case.robot.with_tolerance(unknown.ok());
    let solution = agreeing(&Case::new(&robot, case.readings, case.options))?;
    let angle = |robot: &Robot<f64>, arm| {
        let (x, y) = robot.arm(arm).la();
        y.atan2(x).to_degrees()
    };
    let off = ArmIndex::ALL.map(|arm| angle(&solution.robot, arm) - angle(&case.robot.robot, arm));
    let each: Vec<_> = (1..)
        .zip(off)
        .map(|(arm, off)| format!("arm {arm} {off:+.1}°"))
        .collect();
    let hang = |than: &str| format!(" (the arms hang {than} than their joints read)");
    let hang = if off.iter().all(|own| *own < 0.0) {
        hang("lower")
    } else if off.iter().all(|own| *own > 0.0) {
        hang("higher")
    } else {
        String::new()
    };
    Some(Explanation {
        wrong: None,
        what: format!("the joint zeros are off: {}{hang}", list(&each)),
        cost: solution.cost(),
    })
}

/// The solution, if the readings agree with the stated noise and tolerance.
fn agreeing(case: &Case<'_>) -> Option<Solution> {
    let judged = attempt(case).ok()?;
    let mut noise = judged.noise.iter();
    let understated = noise.any(|test| test.verdict == NoiseVerdict::Understated);
    (!judged.tolerance.is_some_and(|own| own.widened) && !understated).then_some(judged.solution)
}

/// The best correction of a number, if the calibration then agrees with what is stated.
fn tried(case: &Case<'_>, wrong: Wrong) -> Option<Explanation> {
    case.robot.tolerance?;
    let mut loose = case.robot.loosened(LOOSE);
    let mut by = 0.0;
    for _ in 0..ROUNDS {
        loose.robot = wrong.changed(&case.robot.robot, by)?;
        let readings = wrong.turned(case.readings, by);
        let solution = solve(&loose, &readings, &case.options).ok()?;
        let explained = explained_by(&solution, &readings, &[vec![0]], |_, at| {
            vec![wrong.moves(&solution.robot, &at.joints).unwrap_or_default()]
        });
        let (_, coefficients) = explained.into_iter().next()??;
        let more = *coefficients.first()?;
        by += more;
        if !(by.abs() < LARGEST) {
            return None;
        }
        if more.abs() < SETTLED * by.abs() {
            break;
        }
    }
    let robot = case
        .robot
        .with_robot(&wrong.changed(&case.robot.robot, by)?);
    let readings = wrong.turned(case.readings, by);
    let solution = agreeing(&Case::new(&robot, &readings, case.options))?;
    Some(Explanation {
        wrong: Some(wrong),
        what: wrong.words(case.robot, by),
        cost: solution.cost(),
    })
}
