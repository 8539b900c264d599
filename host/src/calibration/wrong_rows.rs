//! What explains readings that do not fit: rows that disagree, a sensor that was moved, or one mistake in all rows.

use super::findings::Finding;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Reading, ReadingFrom, Readings};
use crate::fit::{Frame, Options, Solution, solve};
use crate::text::{count, in_lines, significant};
use nalgebra::Vector3;
use serde::Serialize;
use std::fmt;

/// More rows are not fitted again.
const MOST_ROWS: usize = 2000;
/// Rows that are left out one by one at most.
const ROWS_TRIED: usize = 100;
/// Fewer samples that disagree in a row are wrong ones rather than a change.
const FEWEST: usize = 3;
/// At least this part of the samples on one side of the change disagrees, and of those that disagree at
/// least this part lies there.
const MOST: f64 = 0.9;
/// Rows are shifted if that brings them nearer by this factor.
const SHIFTED: f64 = 0.1;
const INCH: f64 = 25.4;

/// Samples at the beginning or the end of the file that all disagree with the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Shift {
    /// The line of the first sample after the change.
    pub line: u64,
    /// Whether the samples from that line on disagree with the calibrated robot, or those before.
    pub after: bool,
    /// How many they are.
    pub samples: usize,
    /// Their mean distance from where the calibrated robot is, mm in the frame of the coordinates.
    pub mean_mm: [f64; 3],
    /// How far they scatter about that, rms in mm.
    pub scatter_mm: f64,
    /// They fit the joints of the row after their own (1) or before it (−1): a row is missing or there twice.
    pub belongs_to: Option<i8>,
}

fn number(samples: usize) -> f64 {
    samples as f64
}

impl Shift {
    /// Of a robust fit.
    pub(crate) fn find(solution: &Solution, readings: &Readings) -> Option<Self> {
        let suspected: Vec<bool> = solution.rows.iter().map(|row| row.suspected).collect();
        let count = suspected.len();
        let all = suspected.iter().filter(|own| **own).count();
        if all < FEWEST {
            return None;
        }
        let part = |a: usize, b: usize| number(a) >= MOST * number(b);
        let (mut before, mut best) = (0, None::<(usize, usize, bool)>);
        for first in 1..count {
            before += usize::from(suspected[first - 1]);
            for (within, side, after) in
                [(all - before, count - first, true), (before, first, false)]
            {
                // Right if it is suspected on that side, or not suspected on the other.
                let right = within + (count - side) - (all - within);
                let agrees = part(within, side) && part(within, all);
                if agrees && best.is_none_or(|(most, ..)| right >= most) {
                    best = Some((right, first, after));
                }
            }
        }
        let (_, first, after) = best?;
        let side = if after { first..count } else { 0..first };
        let apart = |index: usize| {
            let reading = &readings.rows.get(index)?.value;
            let sample = reading.sample()?;
            let [x, y, z, ..] = solution.places.expected(&solution.robot, reading);
            Some(sample.position - Vector3::new(x?, y?, z?))
        };
        let apart: Vec<_> = side
            .filter(|index| suspected[*index])
            .filter_map(apart)
            .collect();
        if apart.is_empty() {
            return None;
        }
        let mean = apart.iter().sum::<Vector3<f64>>() / number(apart.len());
        let squares: f64 = apart.iter().map(|own| (own - mean).norm_squared()).sum();
        let own = if after { first..count } else { 0..first };
        Some(Self {
            belongs_to: belongs_to(solution, readings, own),
            line: readings.rows.get(first)?.line,
            after,
            samples: apart.len(),
            mean_mm: mean.data.0[0],
            scatter_mm: (squares / number(apart.len())).sqrt(),
        })
    }
}

/// The joints that positions fit: of the row after their own, or before it; `None` of neither.
fn belongs_to(
    solution: &Solution,
    readings: &Readings,
    rows: std::ops::Range<usize>,
) -> Option<i8> {
    let median = |by: i8| -> Option<f64> {
        let off = |index: usize| {
            let other = index.checked_add_signed(by.into())?;
            let joints = readings.rows.get(other)?.value.joints;
            let reading = Reading {
                joints,
                ..readings.rows.get(index)?.value
            };
            let [x, y, z, ..] = solution.places.expected(&solution.robot, &reading);
            Some((reading.sample()?.position - Vector3::new(x?, y?, z?)).norm())
        };
        let mut all: Vec<f64> = rows.clone().filter_map(off).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    };
    let own = median(0)?;
    [1, -1]
        .into_iter()
        .find(|by| median(*by).is_some_and(|other| other < SHIFTED * own))
}

impl fmt::Display for Shift {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.mean_mm;
        if let Some(by) = self.belongs_to {
            return write!(
                f,
                "{} line {} each position fits the joints of the row {} it: rows are shifted by one, as where a row is \
                 missing or written twice. Put that right.",
                if self.after { "From" } else { "Before" },
                self.line,
                if by > 0 { "after" } else { "before" }
            );
        }
        write!(
            f,
            "The {} {} line {} are offset by ({x:.3}, {y:.3}, {z:.3}) mm from the others (scatter {} mm): the sensor, its \
             target or the robot's base moved there. Calibrate the rows before and after it separately.",
            count(self.samples, "sample"),
            if self.after { "from" } else { "before" },
            self.line,
            significant(self.scatter_mm, 2)
        )
    }
}

type Change = fn(&mut Reading);

/// Mistakes that change all rows alike, of files without complete positions.
const MISTAKES: [(&str, Change); 7] = [
    ("The heights have the wrong sign: change it.", |row| {
        row.height = row.height.map(|(plane, height)| (plane, -height));
    }),
    (
        "The heights are in inches: name the column height_in.",
        |row| {
            row.height = row.height.map(|(plane, height)| (plane, INCH * height));
        },
    ),
    (
        "The distances are in inches: name the column distance_in.",
        |row| {
            row.distance = row.distance.map(|(from, distance)| (from, INCH * distance));
        },
    ),
    ("The joint angles have the wrong sign: change it.", |row| {
        each_pose(row, |joints| joints.map(|q| -q));
    }),
    (
        "Joint columns 1 and 2 are exchanged: exchange their names.",
        |row| {
            each_pose(row, |[a, b, c]| [b, a, c]);
        },
    ),
    (
        "Joint columns 2 and 3 are exchanged: exchange their names.",
        |row| {
            each_pose(row, |[a, b, c]| [a, c, b]);
        },
    ),
    (
        "Joint columns 1 and 3 are exchanged: exchange their names.",
        |row| {
            each_pose(row, |[a, b, c]| [c, b, a]);
        },
    ),
];

fn each_pose(row: &mut Reading, change: fn([f64; 3]) -> [f64; 3]) {
    row.joints = change(row.joints);
    if let Some((ReadingFrom::Pose(joints), _)) = &mut row.distance {
        *joints = change(*joints);
    }
}

/// What explains readings that were refused, in sentences with what to do.
pub(crate) fn explanations(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Vec<String> {
    let mut found = Vec::new();
    if readings.rows.len() > MOST_ROWS {
        return found;
    }
    if !readings.holds(Kind::Position)
        && let Some(mistake) = mistake(robot, readings, options)
    {
        found.push(mistake);
        return found;
    }
    if options.robust {
        return found;
    }
    let robust = Options {
        robust: true,
        method: None,
        ..*options
    };
    if let Ok(solution) = solve(robot, readings, &robust)
        && robot.tolerance.is_some()
    {
        let rows = readings.rows.iter().zip(&solution.rows);
        let lines: Vec<_> = rows
            .filter(|(_, fit)| fit.suspected)
            .map(|(row, _)| row.line)
            .collect();
        if let Some(shift) = Shift::find(&solution, readings) {
            found.push(shift.to_string());
        } else if !lines.is_empty() {
            found.push(format!(
                "{} of {} agree; {} {} not. --robust calibrates without {}.",
                readings.rows.len() - lines.len(),
                count(readings.rows.len(), "sample"),
                in_lines(&lines),
                if lines.len() == 1 { "does" } else { "do" },
                if lines.len() == 1 { "it" } else { "them" },
            ));
        }
    } else if let Some(line) = one_wrong(robot, readings, options) {
        found.push(format!(
            "Line {line} disagrees with all others: measure it again or delete it."
        ));
    }
    found
}

/// Σ of the squared residuals, if there is a solution.
fn fits(robot: &RobotFile, readings: &Readings, options: &Options) -> Option<f64> {
    let solution = solve(robot, readings, options).ok()?;
    Some(solution.noise.iter().map(|own| own.squares).sum())
}

fn mistake(robot: &RobotFile, readings: &Readings, options: &Options) -> Option<String> {
    let mut best: Option<(f64, &str)> = None;
    for (mistake, change) in MISTAKES {
        let mut changed = readings.clone();
        changed
            .rows
            .iter_mut()
            .for_each(|row| change(&mut row.value));
        if changed == *readings {
            continue;
        }
        if let Some(squares) = fits(robot, &changed, options)
            && best.is_none_or(|(least, _)| squares < least)
        {
            best = Some((squares, mistake));
        }
    }
    best.map(|(_, mistake)| mistake.to_owned())
}

/// The line without which the others fit best, if they fit.
fn one_wrong(robot: &RobotFile, readings: &Readings, options: &Options) -> Option<u64> {
    if readings.rows.len() > ROWS_TRIED {
        return None;
    }
    let mut wrong: Option<(f64, u64)> = None;
    for index in 0..readings.rows.len() {
        let mut others = readings.clone();
        let row = others.rows.remove(index);
        if let Some(squares) = fits(robot, &others, options)
            && wrong.is_none_or(|(least, _)| squares < least)
        {
            wrong = Some((squares, row.line));
        }
    }
    Some(wrong?.1)
}

/// The points are off by the same if their mean offset is so many times their scatter about it…
const SAME: f64 = 4.0;
/// …and more than this part of the forearm.
const LEAST: f64 = 0.005;
/// …and more than so many σ of the arms' height as the tolerance has it: end stops move all points, too.
const SIGMAS: f64 = 3.0;

/// That the measured point may be a reflector or a tip, where all points are off by nearly the same.
pub(super) fn beside_the_platform_point(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
) -> Option<Finding> {
    if frame == Frame::Sensor || robot.instruments.target.is_some() {
        return None;
    }
    let offsets: Vec<Vector3<f64>> = readings
        .samples()
        .filter_map(|row| Some(row.value.position - robot.robot.forward(&row.value.joints).ok()?))
        .collect();
    let number = offsets.len() as f64;
    let mean = offsets.iter().sum::<Vector3<f64>>() / number;
    let squares: f64 = offsets.iter().map(|own| (own - mean).norm_squared()).sum();
    let scatter_mm = (squares / number).sqrt();
    let [arm, ..] = robot.robot.arms();
    let [_, _, height, ..] = robot
        .tolerance
        .map_or([0.0; 8], |tolerance| tolerance.of_places(arm));
    let least = (LEAST * arm.lb()).max(SIGMAS * height);
    // Of no points at all the mean is no number.
    let offset_mm = mean.data.0[0];
    (mean.norm() > SAME * scatter_mm && mean.norm() > least).then_some(Finding::Target {
        offset_mm,
        scatter_mm,
    })
}
