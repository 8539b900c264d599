//! What happened at one row: an encoder that jumped, a sensor or reflector that was moved.

use super::causes::{Subject, explained_by};
use super::judge::Case;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Readings};
use crate::fit::{Solution, solve};
use crate::text::{joint, significant};
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;
use nalgebra::Vector3;
use serde::Serialize;
use std::fmt;

/// Rows on either side of a step, at least.
const LEAST_ROWS: usize = 3;
/// More rows are not looked at.
const MOST_ROWS: usize = 300;
/// By how much the logarithm of the likelihood must grow: some chance of 1 in 10,000 for all rows and kinds.
const CLEARLY: f64 = 12.0;
/// The stated noise is multiplied by this while the step is in the readings.
const LOOSE: f64 = 30.0;
/// A sensor that was moved leaves less than this part of the residuals; a drift looks like a small step.
const NO_DRIFT: f64 = 0.5;
/// A step leaves at most this part of the residuals.
const LEFT: f64 = 0.85;

/// A step in the errors of a file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Step {
    /// The first row after it.
    pub line: u64,
    /// The arm whose joint it is in, 1 to 3; `null` of the positions.
    pub arm: Option<usize>,
    /// Of a joint: by how much its reading is too small after it, in degrees or mm of travel.
    pub joint: f64,
    /// Of the positions, mm in the robot's axes.
    pub position_mm: [f64; 3],
    /// σ of a coordinate with and without the step, mm.
    pub sigma_mm: [f64; 2],
    #[serde(skip)]
    drive: Drive,
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [with, without] = self.sigma_mm.map(|own| significant(own, 2));
        if let Some(arm) = self.arm {
            write!(
                f,
                "The joint zero of arm {arm} jumped by {}{} at line {}",
                significant(self.joint, 2),
                joint::mark(self.drive),
                self.line
            )?;
        } else {
            let [x, y, z] = self.position_mm.map(|own| format!("{own:.2}"));
            write!(
                f,
                "From line {} on all positions are off by ({x}, {y}, {z}) mm in the robot's axes",
                self.line
            )?;
        }
        write!(
            f,
            ": with that the residuals are {with} mm, without {without} mm. "
        )?;
        f.write_str(match self.arm {
            Some(_) => "An encoder or a coupling slipped: mend it, home the robot and measure again, or calibrate the rows on one side.",
            None => "The sensor, its reflector or the robot's base was moved there: calibrate the rows before and after separately.",
        })
    }
}

impl Step {
    /// Whether it explains what a drift does not: of the positions only one that leaves little of the residuals.
    pub(crate) fn is_no_drift(&self) -> bool {
        let [with, without] = self.sigma_mm;
        self.arm.is_some() || with < NO_DRIFT * without
    }
}

/// The step that explains most of the residuals, if one clearly does.
pub(crate) fn step(case: &Case<'_>) -> Option<Step> {
    let rows = case.readings.rows.len();
    if !(4 * LEAST_ROWS..=MOST_ROWS).contains(&rows) || !case.readings.holds(Kind::Position) {
        return None;
    }
    // Whatever noise is stated: the residuals may contradict it until the step is taken out.
    let loose = case.robot.loosened(LOOSE);
    let fit = |robot: &RobotFile, readings: &Readings| solve(robot, readings, &case.options).ok();
    let solution = fit(case.robot, case.readings).or_else(|| fit(&loose, case.readings))?;
    let candidates = candidates(&solution, case.readings);
    let (drive, convention) = (solution.robot.drive(), &case.robot.convention);
    let without = sigma(&solution)?;
    let tried = candidates.into_iter().flatten().filter_map(|found| {
        let mut mended = case.readings.clone();
        let mut total = found;
        // The second time from where the first one leads: a jump of degrees is not small.
        let mut with = without;
        for _ in 0..2 {
            mend(&mut mended, case.readings, &total, &solution);
            let again = fit(case.robot, &mended).or_else(|| fit(&loose, &mended))?;
            with = sigma(&again)?;
            total.add(&gains(&again, &mended, total.index).0);
        }
        let line = case.readings.rows.get(found.index)?.line;
        let count = case.readings.rows.iter().fold(0.0, |count, _| count + 3.0);
        let gain: f64 = count * (without / with).ln();
        (gain > CLEARLY && with < LEFT * without).then(|| Step {
            line,
            arm: total.arm.map(|arm| arm.index() + 1),
            joint: convention.degrees(total.joint),
            position_mm: convention.vector(&total.position).into(),
            sigma_mm: [with, without],
            drive,
        })
    });
    tried.min_by(|a, b| a.sigma_mm[0].total_cmp(&b.sigma_mm[0]))
}

fn sigma(solution: &Solution) -> Option<f64> {
    let mut noise = solution.noise.iter();
    let own = noise.find(|own| own.kind == Kind::Position)?;
    Some(if own.stated {
        own.sigma * own.ratio()
    } else {
        own.sigma
    })
}

/// A step from the row of an index on.
#[derive(Clone, Copy)]
struct Found {
    index: usize,
    arm: Option<ArmIndex>,
    /// Radians or mm.
    joint: f64,
    position: Vector3<f64>,
}

impl Found {
    fn add(&mut self, other: &[Self; 4]) {
        let same = other.iter().find(|own| own.arm == self.arm);
        if let Some(more) = same {
            self.joint += more.joint;
            self.position += more.position;
        }
    }
}

/// The best step of a joint and the best of the positions.
fn candidates(solution: &Solution, readings: &Readings) -> [Option<Found>; 2] {
    let mut best: [Option<(f64, Found)>; 2] = [None; 2];
    for index in LEAST_ROWS..readings.rows.len().saturating_sub(LEAST_ROWS) {
        let (found, gains) = gains(solution, readings, index);
        for (own, gain) in found.into_iter().zip(gains) {
            let place = usize::from(own.arm.is_none());
            if best[place].is_none_or(|(most, _)| gain > most) {
                best[place] = Some((gain, own));
            }
        }
    }
    best.map(|own| own.map(|(_, found)| found))
}

/// Steps of the three joints and of the positions at a row, and by how much each lowers the sum of squares.
fn gains(solution: &Solution, readings: &Readings, index: usize) -> ([Found; 4], [f64; 4]) {
    let groups = [vec![0], vec![1], vec![2], vec![3, 4, 5]];
    let of_position = |row: usize| readings.rows[row].value.kind() == Some(Kind::Position);
    let explained = explained_by(&Subject { solution, readings }, &groups, |row, at| {
        let joints = [0, 1, 2].map(|joint| at.by_joints.column(joint).into_owned());
        let axes = [0, 1, 2].map(|axis| Vector3::ith(axis, f64::from(u8::from(of_position(row)))));
        let after = if row >= index { 1.0 } else { 0.0 };
        joints
            .into_iter()
            .chain(axes)
            .map(|own| after * own)
            .collect()
    });
    let mut found = [Found {
        index,
        arm: None,
        joint: 0.0,
        position: Vector3::zeros(),
    }; 4];
    let mut sizes = [0.0; 4];
    for (place, explained) in explained.into_iter().enumerate() {
        let arm = ArmIndex::ALL.get(place).copied();
        found[place].arm = arm;
        let Some((gain, coefficients)) = explained else {
            continue;
        };
        sizes[place] = gain;
        match (arm, &coefficients[..]) {
            (Some(_), [joint]) => found[place].joint = *joint,
            (None, [x, y, z]) => found[place].position = Vector3::new(*x, *y, *z),
            _ => {}
        }
    }
    (found, sizes)
}

/// The readings without a step.
fn mend(mended: &mut Readings, readings: &Readings, found: &Found, solution: &Solution) {
    let turn = solution
        .places
        .frame
        .map_or(found.position, |frame| frame.rotation * found.position);
    let rows = mended.rows.iter_mut().zip(&readings.rows).skip(found.index);
    for (row, own) in rows {
        match found.arm {
            Some(arm) => {
                row.value.joints[arm.index()] = own.value.joints[arm.index()] + found.joint;
            }
            None => {
                for (axis, coordinate) in row.value.position.iter_mut().enumerate() {
                    *coordinate = own.value.position[axis].map(|value| value - turn[axis]);
                }
            }
        }
    }
}
