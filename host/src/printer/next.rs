//! What to measure next.

use super::area::{Uncertain, bed, poses, radius_of};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Reading, ReadingFrom, Readings, Row};
use crate::fit::Frame;
use crate::fit::solution::RobotCovariance;
use crate::halt;
use crate::import::{Imported, OF_PROBE};
use crate::planning::covariance_after;
use crate::text::tenths;
use delta_cal::Real;
use nalgebra::Vector3;
use serde::Serialize;

/// Heights to propose.
const HEIGHTS: usize = 4;
/// Where they may be.
const CIRCLES: u32 = 2;
const ON_A_CIRCLE: u32 = 12;
/// The outermost of them, as a part of the bed's radius.
const OUT: f64 = 0.9;
/// The object of Klipper's docs/prints/calibrate_size.stl: directions of its pillars, degrees, and their middle's
/// and ridge's distances from the centre, mm.
const DIRECTIONS: [f64; 6] = [210.0, 270.0, 330.0, 30.0, 90.0, 150.0];
const OUTER: f64 = 65.0;
const RIDGE: f64 = 4.5;

/// What more measurements are expected to leave of the error: one σ, rms over the printed area, mm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Next {
    /// With what was measured.
    #[serde(rename = "sigma_now_mm")]
    pub now: f64,
    /// Where more heights are best measured, mm.
    #[serde(rename = "heights_at_mm")]
    pub heights: Vec<[f64; 2]>,
    /// What these leave.
    #[serde(rename = "sigma_with_heights_mm")]
    pub with_heights: Option<f64>,
    /// What the twelve distances on the printed object leave; `None` if it does not fit.
    #[serde(rename = "sigma_with_printed_object_mm")]
    pub with_object: Option<f64>,
}

/// Of a calibrated robot and its measurements over a bed of this radius; tr(W C) is the mean square that counts, now the
/// square of `now`.
pub(super) fn next(
    robot: &RobotFile,
    file: &Readings,
    (radius, weights): (f64, &RobotCovariance),
    now: f64,
) -> Option<Next> {
    let leaves = |file: &Readings| {
        let covariance = covariance_after(robot, file, Frame::Base)?;
        Some(weights.dot(&covariance).sqrt())
    };
    let scale = now / leaves(file)?;
    let leaves = |file: &Readings| Some(scale * leaves(file)?);
    let places = bed(OUT * radius, CIRCLES, ON_A_CIRCLE);
    let (heights, with_heights) = chosen((robot, 0), file, places, HEIGHTS, leaves);
    let with_object = object(robot).and_then(|rows| {
        let mut more = file.clone();
        more.rows.extend(rows);
        leaves(&more)
    });
    Some(Next {
        now,
        with_heights: leaves(&with_heights).filter(|_| !heights.is_empty()),
        heights,
        with_object,
    })
}

/// So many touches of the bed, each at another place, each as good as possible after those before it; and the readings with
/// these.
fn chosen(
    (robot, target): (&RobotFile, usize),
    file: &Readings,
    places: Vec<[f64; 2]>,
    count: usize,
    leaves: impl Fn(&Readings) -> Option<f64>,
) -> (Vec<[f64; 2]>, Readings) {
    let mut with = file.clone();
    let mut places: Vec<_> = places
        .into_iter()
        .filter_map(|place| Some((place, height(robot, place, target)?)))
        .collect();
    let mut chosen = Vec::new();
    for _ in 0..count {
        let added = places.iter().enumerate().filter_map(|(index, (_, row))| {
            halt::check();
            with.rows.push(*row);
            let left = leaves(&with);
            with.rows.pop();
            Some((left?, index))
        });
        let best = added.min_by(|one, other| one.0.total_cmp(&other.0));
        let Some((_, index)) = best else {
            break;
        };
        let (place, row) = places.swap_remove(index);
        with.rows.push(row);
        chosen.push(place);
    }
    (chosen, with)
}

fn row(reading: &Reading) -> Row<Reading> {
    Row {
        line: 0,
        value: *reading,
    }
}

/// A touch of the bed, which is the first plane, with the nozzle at a place: by itself, or by the probe.
fn height(robot: &RobotFile, [x, y]: [f64; 2], target: usize) -> Option<Row<Reading>> {
    let joints = robot.robot.inverse(&Vector3::new(x, y, 0.0)).ok()?;
    Some(row(&Reading {
        height: Some((0, 0.0)),
        target,
        ..Reading::at(joints)
    }))
}

/// Where to touch a printer's bed so many times, each at another place, for the flattest bed: the radius of the bed, and
/// x and y of the nozzle in the controller's frame, mm. Nozzle and probe stay over the bed.
pub fn touches_of_bed(imported: &Imported, count: usize) -> (f64, Vec<[f64; 2]>) {
    let radius = radius_of(imported);
    let mut nothing = Readings::of_name(&imported.robot.name);
    nothing.planes = vec!["plane".to_owned()];
    let targets = imported.robot.instruments.targets.iter();
    nothing.targets = targets.map(|own| own.name.clone()).collect();
    let imported = imported.clone().with_readings(nothing);
    let robot = &imported.robot;
    let Some(weights) = Uncertain::of(robot, &poses(robot, radius)) else {
        return (radius, Vec::new());
    };
    let leaves = |file: &Readings| {
        let covariance = covariance_after(robot, file, Frame::Base)?;
        Some(weights.height.dot(&covariance))
    };
    let on_a_circle = usize::try_from(ON_A_CIRCLE).unwrap_or(1);
    let circles = u32::try_from(count / on_a_circle).unwrap_or(0) + CIRCLES;
    let out = f64::min(OUT * radius, radius - imported.probe.distance());
    let places = bed(out.max(0.0), circles, ON_A_CIRCLE);
    let (places, _) = chosen((robot, OF_PROBE), &imported.readings, places, count, leaves);
    let places = places.into_iter().map(|own| own.map(tenths));
    (radius, places.collect())
}

/// The distances of `DELTA_ANALYZE`: six from the centre to the pillars, six between the pillars.
fn object(robot: &RobotFile) -> Option<Vec<Row<Reading>>> {
    let towards = |degrees: f64, out: f64| {
        let (sine, cosine) = degrees.to_radians().sine_cosine();
        Vector3::new(out * cosine, out * sine, 0.0)
    };
    let mut rows = Vec::new();
    for (index, direction) in DIRECTIONS.into_iter().enumerate() {
        let across = DIRECTIONS[(index + 2) % DIRECTIONS.len()];
        let pillar = towards(direction, OUTER);
        for (middle, along) in [(Vector3::zeros(), direction), (pillar, across)] {
            let from = middle + towards(along, RIDGE);
            let to = middle + towards(along, OUTER + RIDGE);
            let from_joints = robot.robot.inverse(&from).ok()?;
            rows.push(row(&Reading {
                distance: Some((ReadingFrom::Pose(from_joints), (to - from).norm())),
                ..Reading::at(robot.robot.inverse(&to).ok()?)
            }));
        }
    }
    Some(rows)
}
