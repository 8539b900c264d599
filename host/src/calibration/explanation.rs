//! Single faults that explain readings that contradict noise or tolerance: a wrong number of the robot file (joint zeros,
//! gear ratio, radius, forearms, overall size), or an error that the model cannot represent. Those that explain them about
//! equally well are named together.

use super::causes::{Subject, explained_by};
use super::judge::{Case, agreeing};
use crate::effects::{Effect, EffectKind};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Readings};
use crate::fit::{Options, Solution, solve};
use crate::text::{capitalised, list, significant};
use delta_cal::robot::{Drive, Parameter};
use delta_cal::{ArmIndex, Robot};
use nalgebra::{DVector, Vector3};

/// Most linearisations per number; zeros that are ten degrees off need several.
const ROUNDS: u32 = 8;
/// A number has converged if its relative change is below this.
const SETTLED: f64 = 0.02;
/// A linearisation that leaves more than this fraction of the residuals' squares is the last.
const STALLED: f64 = 0.7;
/// Step of a difference quotient.
const STEP: f64 = 1e-6;
/// Twice the logarithm of 20: a smaller difference between explanations is not clear.
const CLEARLY: f64 = 6.0;
/// Tolerance of entirely unknown joint zeros, degrees.
const UNKNOWN_ZERO_DEG: f64 = 15.0;
/// Factors for noise and tolerance until the fault is found, because the readings contradict them; the largest may leave
/// parameters too uncertain.
const LOOSE: [f64; 3] = [30.0, 8.0, 3.0];
/// Penalty per coefficient in units of χ², and the χ² that a fault must explain.
const PER_COLUMN: f64 = 3.0;
const SIGNIFICANT: f64 = 20.0;
/// Files with more rows are not refitted.
const MOST_ROWS: usize = 300;

/// What is wrong, the easiest to measure first; numbers are common to all arms.
#[derive(Debug, Clone, PartialEq)]
enum Wrong {
    Forearm,
    UpperArm,
    /// Distance from the axis to the motors or towers.
    Radius,
    /// All joint zeros, by the same angle.
    Zero,
    /// The gear ratio: degrees per turn, or steps per mm of travel.
    Gear,
    /// All lengths.
    Size,
    /// An error that the model cannot represent.
    Cause(Effect),
}

/// In the order of a message, before the errors that the model cannot represent.
const NUMBERS: [Wrong; 6] = [
    Wrong::Forearm,
    Wrong::UpperArm,
    Wrong::Radius,
    Wrong::Zero,
    Wrong::Gear,
    Wrong::Size,
];

impl Wrong {
    const fn cause(&self) -> Option<EffectKind> {
        match self {
            Self::Cause(own) => Some(own.kind),
            _ => None,
        }
    }

    /// Whether the readings may be right in all but their scale.
    fn is_scale(&self) -> bool {
        *self == Self::Size || self.cause() == Some(EffectKind::Scale)
    }

    /// The robot with the number changed by an angle, or by a fraction of itself.
    fn changed(&self, robot: &Robot<f64>, by: f64) -> Option<Robot<f64>> {
        let drive = robot.drive();
        let mut parameters = robot.parameters();
        for own in &mut parameters {
            match self {
                Self::Zero => return turned(robot, by),
                Self::Gear | Self::Cause(_) => {}
                Self::Radius => (own[0], own[1]) = (own[0] * (1.0 + by), own[1] * (1.0 + by)),
                Self::Forearm => own[7] *= 1.0 + by,
                Self::UpperArm => (own[5], own[6]) = (own[5] * (1.0 + by), own[6] * (1.0 + by)),
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

    /// The readings without the fault.
    fn undone(&self, subject: &Subject<'_>, by: &[f64]) -> Readings {
        if let Self::Cause(own) = self {
            return subject.undone(own, by);
        }
        let mut undone = subject.readings.clone();
        for row in undone.rows.iter_mut().filter(|_| *self == Self::Gear) {
            row.value
                .each_pose(|joints| joints.map(|q| q * (1.0 + by[0])));
        }
        undone
    }

    /// The decrease of the sum of squares by more of the fault, and how much more.
    fn explained(&self, subject: &Subject<'_>) -> Option<(f64, Vec<f64>)> {
        let (solution, readings) = (subject.solution, subject.readings);
        let mut explained = if let Self::Cause(own) = self {
            let columns = (0..own.unknowns()).collect();
            explained_by(solution, readings, &[columns], subject.moves(own))
        } else {
            explained_by(solution, readings, &[vec![0]], |_, at| {
                vec![self.moves(&solution.robot, &at.joints).unwrap_or_default()]
            })
        };
        explained.pop()?
    }

    /// Derivative of the platform's position with respect to the number.
    fn moves(&self, robot: &Robot<f64>, joints: &[f64; 3]) -> Option<Vector3<f64>> {
        let here = robot.forward(joints).ok()?;
        let there = match self {
            Self::Gear => robot.forward(&joints.map(|q| q * (1.0 + STEP))).ok()?,
            _ => self.changed(robot, STEP)?.forward(joints).ok()?,
        };
        Some((there - here) / STEP)
    }

    /// In words, with its error and the corrected value.
    fn words(&self, robot: &RobotFile, all: &[f64], sigma: f64) -> String {
        let by = all[0];
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
                format!("the steps per mm are off by {percent}")
            }
            Self::Gear => format!("the gear ratio is off by {percent}"),
            Self::Radius => format!(
                "the radius is off by {percent} (base less platform {} mm)",
                length(arm.d().xy().norm())
            ),
            Self::Forearm => format!("the forearms are {} mm long ({percent})", length(arm.lb())),
            Self::UpperArm => format!(
                "the upper arms are {} mm long ({percent})",
                length(arm.upper_arm_length())
            ),
            Self::Size => format!(
                "all lengths are {:.2} % {}, or the instrument's scale is that far off",
                100.0 * by.abs(),
                if by > 0.0 { "larger" } else { "smaller" }
            ),
            Self::Cause(own) => {
                let drive = robot.robot.drive();
                own.described(all, sigma, drive, &robot.convention).2
            }
        }
    }

    /// The cheapest measurement that shows it, and what to write if this is the wrong number.
    fn advice(&self, alternatives: &[EffectKind]) -> [&'static str; 2] {
        match self {
            Self::Zero => [
                "the joint reading of an arm held level",
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
            Self::Forearm | Self::UpperArm => [
                "that length on each arm, with a calliper",
                "If it is that length, correct it in the robot file",
            ],
            Self::Size => [
                "one known length, such as a gauge block",
                "Measure one known length",
            ],
            Self::Cause(own) if own.kind.is_of_transmission() => [
                "a joint against a reference over its whole range",
                own.kind.remedy(&[]),
            ],
            Self::Cause(own) => ["", own.kind.remedy(alternatives)],
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
    wrong: Wrong,
    /// The explanation in words.
    what: String,
    /// −2 log of the likelihood up to a constant, and the penalty for coefficients.
    cost: f64,
}

/// All explanations of the readings, in sentences with remedies.
#[derive(Debug, Clone)]
pub(crate) struct Explained {
    pub(crate) text: String,
    /// Whether one of them is the scale of the instrument: then the robot's size is unknown.
    pub(crate) is_scale: bool,
}

/// The explanations by one fault or the joint zeros, of the readings as a least-squares fit sees them; `None` if there are
/// none.
pub(crate) fn explanation(case: &Case<'_>) -> Option<Explained> {
    let case = &Case {
        options: Options {
            robust: false,
            ..case.options
        },
        ..*case
    };
    if case.readings.rows.len() > MOST_ROWS {
        return None;
    }
    let turns = case.robot.robot.drive() == Drive::Rotary;
    // Without a tolerance the fit makes up for wrong numbers.
    let numbers = NUMBERS.into_iter().filter(|own| {
        case.robot.tolerance.is_some() && (turns || !matches!(own, Wrong::Zero | Wrong::UpperArm))
    });
    // Where all readings have the same scale, a wrong one looks like another size.
    let scales = case.readings.holds(Kind::Height) && case.readings.holds(Kind::Distance);
    let causes = Effect::all(case.robot.robot.drive()).into_iter();
    let causes = causes.filter(|own| own.kind != EffectKind::Scale || scales);
    let loose = loosened(case);
    let all = numbers.chain(causes.map(Wrong::Cause));
    let found = all.filter_map(|wrong| {
        // Individual zeros include a common one.
        let zeros = (wrong == Wrong::Zero).then(|| zeros(case)).flatten();
        zeros.or_else(|| tried(case, loose.as_ref()?, wrong))
    });
    let mut found: Vec<_> = found.collect();
    let best = found.iter().map(|own| own.cost).reduce(f64::min)?;
    let as_they_are = agreeing(case).map_or(f64::INFINITY, |own| cost(&own));
    found.retain(|own| own.cost < (best + CLEARLY).min(as_they_are - CLEARLY));
    let others = found.iter().skip(1).filter_map(|own| own.wrong.cause());
    let others: Vec<_> = others.collect();
    let [check, remedy] = found.first()?.wrong.advice(&others);
    let mut remedy = capitalised(remedy);
    if found.len() > 1 && !check.is_empty() {
        remedy = format!("Cheapest measurement that decides: {check}. {remedy}");
    }
    let all: Vec<_> = found.iter().map(|own| own.what.as_str()).collect();
    let text = match &all[..] {
        [one] => format!("This explains the readings: {one}. {remedy}."),
        several => format!(
            "Each of these explains the readings about equally well: {}. {remedy}.",
            several.join("; or ")
        ),
    };
    let is_scale = found.iter().any(|own| own.wrong.is_scale());
    Some(Explained { text, is_scale })
}

/// Tests individual joint zeros, if their tolerance is not stated.
fn zeros(case: &Case<'_>) -> Option<Explanation> {
    let tolerance = case.robot.tolerance?;
    if case.robot.robot.drive() == Drive::Linear
        || tolerance.joint_zero() > Some(UNKNOWN_ZERO_DEG.to_radians())
    {
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
        wrong: Wrong::Zero,
        what: format!("the joint zeros are off: {}{hang}", list(&each)),
        cost: cost(&solution) + PER_COLUMN,
    })
}

/// The factor, the robot file and the solution with loosened noise and tolerance.
pub(super) fn loosened(case: &Case<'_>) -> Option<(f64, RobotFile, Solution)> {
    LOOSE.into_iter().find_map(|factor| {
        let loose = case.robot.loosened(factor);
        let solution = solve(&loose, case.readings, &case.options).ok()?;
        Some((factor, loose, solution))
    })
}

/// The best correction of a fault, if the calibration then agrees with what is stated.
fn tried(
    case: &Case<'_>,
    (factor, loose, first): &(f64, RobotFile, Solution),
    wrong: Wrong,
) -> Option<Explanation> {
    let (mut robot, mut readings) = (case.robot.robot.clone(), case.readings.clone());
    let (mut solution, mut by, mut sigma) = (first.clone(), Vec::new(), None);
    let stated = first.estimated_freedom().is_none();
    for _ in 0..ROUNDS {
        let (gain, more) = wrong.explained(&Subject::new(&solution, &readings))?;
        by.resize(more.len(), 0.0);
        by.iter_mut()
            .zip(&more)
            .for_each(|(own, more)| *own += more);
        let [size, change] = [&by, &more].map(|own| DVector::from_column_slice(own).norm());
        let explained = if stated { factor * factor * gain } else { gain };
        if sigma.is_none() && !(explained > SIGNIFICANT) {
            return None;
        }
        sigma.get_or_insert(size / explained.sqrt());
        readings = wrong.undone(&Subject::new(&solution, case.readings), &by);
        robot = wrong.changed(&case.robot.robot, by[0])?;
        if change < SETTLED * size {
            break;
        }
        let next = solve(&loose.with_robot(&robot), &readings, &case.options).ok()?;
        let progresses = if stated {
            next.cost() < STALLED * solution.cost()
        } else {
            cost(&next) + CLEARLY < cost(&solution)
        };
        solution = next;
        if !progresses {
            break;
        }
    }
    let robot = case.robot.with_robot(&robot);
    let solution = agreeing(&Case::new(&robot, &readings, case.options))?;
    let rare = matches!(&wrong, Wrong::Cause(own) if own.kind.is_rare());
    let penalty = PER_COLUMN * by.len() as f64 + if rare { CLEARLY } else { 0.0 };
    Some(Explanation {
        what: wrong.words(case.robot, &by, sigma?),
        cost: cost(&solution) + penalty,
        wrong,
    })
}

fn cost(solution: &Solution) -> f64 {
    solution.cost() + 2.0 * solution.log_spread
}
