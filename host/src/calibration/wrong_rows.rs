//! Explanations of readings that do not fit: rows that disagree, rows shifted by one, or one mistake in all rows.

use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Reading, ReadingFrom, Readings};
use crate::fit::{Frame, Options, Solution, solve};
use crate::text::{count, in_lines};
use delta_cal::Sample;
use nalgebra::Vector3;
use serde::Serialize;
use std::fmt;

/// Files with more rows are not refitted.
const MOST_ROWS: usize = 2000;
/// Most rows for which each is left out in turn.
const ROWS_TRIED: usize = 100;
/// Fewer samples that disagree are individually wrong.
pub(super) const FEWEST: usize = 3;
/// Rows are shifted if a shift reduces their distance to this fraction.
const SHIFTED: f64 = 0.1;
const INCH: f64 = 25.4;

/// Rows whose positions belong to the joints of their neighbours: a row is missing or duplicated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ShiftedRows {
    /// The first of these rows.
    pub line: u64,
    /// The position belongs to the joints of the row after (1) or before (−1).
    pub belongs_to: i8,
}

impl ShiftedRows {
    /// Finds them among the rows that a robust fit rejected.
    pub(crate) fn find(solution: &Solution, readings: &Readings) -> Option<Self> {
        let rows = solution.rows.iter().enumerate();
        let suspected: Vec<_> = rows
            .filter(|(_, fit)| fit.suspected)
            .map(|(index, _)| index)
            .collect();
        let first = *suspected.first().filter(|_| suspected.len() >= FEWEST)?;
        // Median distance between positions and the robot at the joints of another row.
        let median = |by: i8| -> Option<f64> {
            let off = |index: &usize| {
                let other = index.checked_add_signed(by.into())?;
                let joints = readings.rows.get(other)?.value.joints;
                let reading = Reading {
                    joints,
                    ..readings.rows.get(*index)?.value
                };
                let [x, y, z, ..] = solution.places.expected(&solution.robot, &reading);
                Some((reading.sample()?.position - Vector3::new(x?, y?, z?)).norm())
            };
            let mut all: Vec<f64> = suspected.iter().filter_map(off).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied()
        };
        let own = median(0)?;
        let nearer = |by: &i8| median(*by).is_some_and(|other| other < SHIFTED * own);
        Some(Self {
            line: readings.rows.get(first)?.line,
            belongs_to: [1, -1].into_iter().find(nearer)?,
        })
    }
}

impl fmt::Display for ShiftedRows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "From line {} each position fits the joints of the row {} it: rows are shifted by one, as where a row is \
             missing or written twice. Put that right.",
            self.line,
            if self.belongs_to > 0 {
                "after"
            } else {
                "before"
            }
        )
    }
}

type Change = fn(&mut Reading);

/// Mistakes that affect all rows alike, for files without complete positions.
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

/// Wrong rows, or a mistake in all rows, that explain refused readings: a sentence with the remedy.
pub(crate) fn wrong_rows(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Option<String> {
    if readings.rows.len() > MOST_ROWS {
        return None;
    }
    if !readings.holds(Kind::Position)
        && let Some(mistake) = mistake(robot, readings, options)
    {
        return Some(mistake);
    }
    if options.robust {
        return None;
    }
    let robust = Options {
        robust: true,
        method: None,
        ..*options
    };
    let Some(solution) = solve(robot, readings, &robust)
        .ok()
        .filter(|_| robot.tolerance.is_some())
    else {
        let line = one_wrong(robot, readings, options)?;
        return Some(format!(
            "Line {line} disagrees with all others: measure it again or delete it."
        ));
    };
    if let Some(shifted) = ShiftedRows::find(&solution, readings) {
        return Some(shifted.to_string());
    }
    let rows = readings.rows.iter().zip(&solution.rows);
    let suspected = rows.filter(|(_, fit)| fit.suspected);
    let lines: Vec<_> = suspected.map(|(row, _)| row.line).collect();
    let (does, it) = if lines.len() == 1 {
        ("does", "it")
    } else {
        ("do", "them")
    };
    (!lines.is_empty()).then(|| {
        format!(
            "{} of {} agree; {} {does} not. --robust calibrates without {it}.",
            readings.rows.len() - lines.len(),
            count(readings.rows.len(), "sample"),
            in_lines(&lines)
        )
    })
}

/// The change whose readings fit best, if any fit.
fn best<T>(
    robot: &RobotFile,
    options: &Options,
    changed: impl Iterator<Item = (Readings, T)>,
) -> Option<T> {
    changed
        .filter_map(|(readings, what)| {
            let solution = solve(robot, &readings, options).ok()?;
            Some((solution.squares(), what))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, what)| what)
}

fn mistake(robot: &RobotFile, readings: &Readings, options: &Options) -> Option<String> {
    let changed = MISTAKES.iter().map(|(mistake, change)| {
        let mut changed = readings.clone();
        let rows = changed.rows.iter_mut();
        rows.for_each(|row| change(&mut row.value));
        (changed, (*mistake).to_owned())
    });
    best(
        robot,
        options,
        changed.filter(|(changed, _)| changed != readings),
    )
}

/// The line without which the other rows fit best, if they fit.
fn one_wrong(robot: &RobotFile, readings: &Readings, options: &Options) -> Option<u64> {
    let few = (0..readings.rows.len()).filter(|_| readings.rows.len() <= ROWS_TRIED);
    let others = few.map(|index| {
        let mut others = readings.clone();
        let row = others.rows.remove(index);
        (others, row.line)
    });
    best(robot, options, others)
}

/// All points share an offset if its mean is this many times the scatter about it…
const SAME: f64 = 4.0;
/// …and more than this fraction of the forearm…
const LEAST: f64 = 0.005;
/// …and more than this many σ of the arms' height within the tolerance: end stops move all points, too.
const SIGMAS: f64 = 3.0;

/// All points are off by nearly the same: the measured point may be a reflector or a tip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BesideThePlatformPoint {
    /// Mean offset in the robot's frame, mm.
    pub offset_mm: [f64; 3],
    /// Scatter of the offsets about it, mm rms.
    pub scatter_mm: f64,
}

impl BesideThePlatformPoint {
    pub(super) fn find(robot: &RobotFile, readings: &Readings, frame: Frame) -> Option<Self> {
        if frame == Frame::Sensor || robot.instruments.target.is_some() {
            return None;
        }
        let offset = |row: Sample<f64>| Some(row.position - robot.robot.forward(&row.joints).ok()?);
        let samples = readings.samples().map(|row| row.value);
        let offsets: Vec<Vector3<f64>> = samples.filter_map(offset).collect();
        let number = offsets.len() as f64;
        let mean = offsets.iter().sum::<Vector3<f64>>() / number;
        let squares: f64 = offsets.iter().map(|own| (own - mean).norm_squared()).sum();
        let scatter_mm = (squares / number).sqrt();
        let [arm, ..] = robot.robot.arms();
        let [_, _, height, ..] = robot
            .tolerance
            .map_or([0.0; 8], |tolerance| tolerance.of_places(arm));
        let least = (LEAST * arm.lb()).max(SIGMAS * height);
        // Without any points the mean is NaN.
        (mean.norm() > SAME * scatter_mm && mean.norm() > least).then_some(Self {
            offset_mm: mean.data.0[0],
            scatter_mm,
        })
    }
}

impl fmt::Display for BesideThePlatformPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([x, y, z], scatter) = (self.offset_mm, self.scatter_mm);
        write!(
            f,
            "All measured points are offset by ({x:.1}, {y:.1}, {z:.1}) mm from the platform point (scatter \
             {scatter:.1} mm). If a reflector or tip is mounted there, state [target] x_mm = {x:.1}, y_mm = {y:.1}, \
             z_mm = {z:.1}; if the coordinates are in another frame, use --frame sensor."
        )
    }
}
