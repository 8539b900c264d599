//! What an import gives.

use super::Firmware;
use crate::files::input::InputError;
use crate::files::robot_file::{InstrumentFacts, KnownPlane, RobotFile};
use crate::files::samples_file::{Reading, ReadingFrom, Readings};
use crate::geometry::reaches_anywhere;
use crate::text::{joint, rounded};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Arm, Drive};
use delta_cal::{Robot, Tolerance};
use nalgebra::Vector3;
use std::fmt::Write;

/// Where the towers of a printer usually stand, degrees.
pub(super) const USUAL_TOWERS: [f64; 3] = [210.0, 330.0, 90.0];
/// The lowest that a motor turns an arm, degrees: Klipper states no limit.
const LOWEST_ARM: f64 = 90.0;
/// One σ of the bed, which is z = 0 and level: mm and degrees.
const BED: f64 = 0.001;
/// Of a printer that nobody calibrated: a place or a rod in mm, a lean in degrees, an end stop in mm, the scale.
const TOWERS: (f64, f64, f64, f64) = (0.3, 0.1, 5.0, 0.0005);
/// Of the radius and of the rods' length that all towers have in common, mm: owners seldom measure them.
const COMMON: f64 = 1.0;
/// Of arms that motors turn, mm and degrees.
const ARMS: (f64, f64) = (0.5, 0.2);
/// Rods whose length is no whole number of these were not made so, mm.
const ROUND: f64 = 0.1;

/// A robot as its controller is told that it is, with the readings that the configuration holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// Whose configuration it was.
    pub firmware: Firmware,
    /// The robot, under the configuration's name.
    pub robot: RobotFile,
    /// The readings; the line of each is that of the configuration.
    pub readings: Readings,
    /// What the configuration calls each reading.
    pub names: Vec<String>,
    /// The joints at their end stops: radians, or mm of travel.
    pub home: [f64; 3],
    /// The radius within which the nozzle is wanted, mm.
    pub bed_radius: Option<f64>,
    /// What to know of the import, in sentences.
    pub notes: Vec<String>,
}

/// The arms of a controller and the height of the nozzle at x = y = 0 with each joint at its end stop, mm.
pub(super) struct Machine {
    pub(super) arms: [Arm<f64>; 3],
    pub(super) endstops: [f64; 3],
}

impl Machine {
    /// Upright towers: lengths in mm, azimuths in degrees.
    pub(super) fn towers(
        name: &str,
        radius: f64,
        azimuths: [f64; 3],
        rods: [f64; 3],
        endstops: [f64; 3],
    ) -> Result<Self, InputError> {
        let arm = |index: usize| {
            let (sine, cosine) = azimuths[index].to_radians().sin_cos();
            let place = [radius * cosine, radius * sine, 0.0];
            let [x, y, z] = place;
            Arm::linear([x, y, z, 0.0, 0.0, 1.0, rods[index]])
        };
        Self::of(name, [arm(0), arm(1), arm(2)], endstops)
    }

    pub(super) fn of<E: std::fmt::Display>(
        name: &str,
        [a, b, c]: [Result<Arm<f64>, E>; 3],
        endstops: [f64; 3],
    ) -> Result<Self, InputError> {
        let impossible =
            |error: E| InputError::new(name, format!("the geometry is impossible: {error}"));
        Ok(Self {
            arms: [
                a.map_err(impossible)?,
                b.map_err(impossible)?,
                c.map_err(impossible)?,
            ],
            endstops,
        })
    }

    /// The joints at their end stops; `None` for an end stop that no joint gives.
    pub(super) fn home(&self) -> [Option<f64>; 3] {
        [0, 1, 2].map(|index| {
            let robot = Robot::new([self.arms[index]; 3]).ok()?;
            let at = Vector3::new(0.0, 0.0, self.endstops[index]);
            robot.inverse(&at).ok().map(|[joint, ..]| joint)
        })
    }

    /// The robot file. `bed`: the radius and lowest height of the printed area, mm.
    pub(super) fn robot_file(
        &self,
        name: &str,
        home: [f64; 3],
        bed: (f64, f64),
        readings: &Readings,
    ) -> Result<RobotFile, InputError> {
        let fault = |cause: String| {
            InputError::new(name, cause)
                .with_remedy("check the lengths of the configuration, in mm")
        };
        let impossible =
            |cause: &dyn std::fmt::Display| fault(format!("the geometry is impossible: {cause}"));
        let robot = Robot::new(self.arms).map_err(|error| impossible(&error))?;
        let mut joints: Vec<f64> = home.to_vec();
        for row in &readings.rows {
            joints.extend(row.value.joints);
            if let Some((ReadingFrom::Pose(from), _)) = row.value.distance {
                joints.extend(from);
            }
        }
        let low = joints.iter().copied().fold(f64::INFINITY, f64::min);
        let high = joints.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (limits, tolerance) = match robot.drive() {
            Drive::Rotary => (
                JointLimits::new(low, high.max(LOWEST_ARM.to_radians())),
                Tolerance::new(ARMS.0, ARMS.1.to_radians()),
            ),
            Drive::Linear => (
                JointLimits::travel(low.min(lowest_travel(&robot, bed)).floor(), high),
                Tolerance::new(TOWERS.0, TOWERS.1.to_radians())
                    .and_then(|own| own.with_linear(TOWERS.2, TOWERS.3))
                    .and_then(|own| own.with_radius(COMMON))
                    .and_then(|own| own.with_forearm(COMMON)),
            ),
        };
        let limits = limits.map_err(|error| impossible(&error))?;
        if !reaches_anywhere(&robot, &limits) {
            return Err(impossible(&"the forearms do not meet anywhere"));
        }
        Ok(RobotFile {
            tolerance: tolerance.ok(),
            instruments: InstrumentFacts {
                joint_noise: Some(0.0),
                planes: readings.planes.iter().map(|name| level_bed(name)).collect(),
                ..InstrumentFacts::default()
            },
            ..RobotFile::of(name, robot, limits)
        })
    }
}

/// The bed: z = 0 and level.
fn level_bed(name: &str) -> KnownPlane {
    KnownPlane {
        name: name.to_owned(),
        line: 0,
        height: 0.0,
        sigma: BED,
        tilt: Some(BED.to_radians()),
        blocks: Vec::new(),
    }
}

/// The lowest carriage that the printed area needs, mm: opposite of each tower, as far as its rod gets.
fn lowest_travel(robot: &Robot<f64>, (radius, lowest): (f64, f64)) -> f64 {
    let mut low = f64::INFINITY;
    for arm in robot.arms() {
        let towards = arm.d().xy().normalize();
        let parts = (0..=20).map(|step| radius * (1.0 - 0.05 * f64::from(step)));
        let mut reached = parts.filter_map(|out| {
            let at = Vector3::new(-out * towards.x, -out * towards.y, lowest);
            robot.inverse(&at).ok()
        });
        low = reached.next().into_iter().flatten().fold(low, f64::min);
    }
    low
}

/// What to say of rods: those of `--rods` are another length, or those of the configuration were not made so.
pub(super) fn rods_note(rods: [f64; 3], configured: [f64; 3], stated: bool) -> Option<String> {
    let of = |rods: [f64; 3]| rods.map(rounded).join(", ");
    if stated {
        return Some(format!(
            "The rods are {} mm as --rods states; the configuration has {}.",
            of(rods),
            of(configured)
        ));
    }
    let round = |rod: &f64| (rod / ROUND - (rod / ROUND).round()).abs() < 1e-6;
    (!configured.iter().all(round)).then(|| {
        format!(
            "The rods of {} mm are the result of an earlier calibration. State with --rods how long they were made, if \
             you know it.",
            of(configured)
        )
    })
}

impl Imported {
    /// With these readings in place of those of the configuration, their only plane being the bed.
    #[must_use]
    pub fn with_readings(mut self, readings: Readings) -> Self {
        let line = |line| format!("line {line} of {}", readings.name);
        self.names = readings.rows.iter().map(|row| line(row.line)).collect();
        let planes = readings.planes.iter();
        self.robot.instruments.planes = planes.map(|name| level_bed(name)).collect();
        self.readings = readings;
        self
    }

    /// That there is nothing to calibrate from, and how to get it.
    pub fn without_readings(&self) -> InputError {
        let (cause, remedy) = match self.firmware {
            Firmware::Klipper => (
                "the configuration holds no saved measurements (height0, … in [delta_calibrate])",
                "run DELTA_CALIBRATE in Klipper, then SAVE_CONFIG, and give the file that it wrote; docs/printers.md has the \
                 steps",
            ),
            Firmware::RepRapFirmware | Firmware::Marlin => (
                "this firmware saves no measurements",
                "give a samples file as well; delta-cal import and delta-cal plan --measure plane write one to fill in",
            ),
        };
        InputError::new(&self.robot.name, cause).with_remedy(remedy)
    }

    /// Heights, and distances.
    pub fn counts(&self) -> [usize; 2] {
        let rows = || self.readings.rows.iter();
        [
            rows().filter(|row| row.value.height.is_some()).count(),
            rows().filter(|row| row.value.distance.is_some()).count(),
        ]
    }

    /// The robot file's text.
    pub fn robot_text(&self) -> String {
        let firmware = self.firmware.title();
        let mut comment = format!(
            "Imported by delta-cal {} from {}: the robot as {firmware} is told that it is.\n\
             delta-cal calibrate finds what it is really like.\n",
            env!("CARGO_PKG_VERSION"),
            self.robot.name,
        );
        comment.push_str(match self.robot.robot.drive() {
            Drive::Linear => {
                "The travel of a carriage is the height of its rod's upper end above z = 0.\n\
                 Tolerance, one sigma: of a tower's place and a rod (2 mm if nobody ever measured the radius), the lean of \
                 a tower, end stops, belts.\n"
            }
            Drive::Rotary => {
                "The joint angle is 0 with the upper arm level, and positive downwards: Klipper's with the other sign.\n"
            }
        });
        comment.push_str(
            "The noise of heights and distances is estimated from them. If you know it, state height_mm and distance_mm.\n",
        );
        if !self.readings.planes.is_empty() {
            comment.push_str("z = 0 is the bed, and level.\n");
        }
        for note in &self.notes {
            comment.push_str(note);
            comment.push('\n');
        }
        self.robot.to_toml(&comment)
    }

    /// The samples file's text, if there are readings.
    pub fn samples_text(&self) -> Option<String> {
        let [heights, distances] = self.counts();
        if heights + distances == 0 {
            return None;
        }
        let drive = self.robot.robot.drive();
        let names = |prefix: &str| {
            let (letter, unit) = match drive {
                Drive::Rotary => ("q", "deg"),
                Drive::Linear => ("s", "mm"),
            };
            [1, 2, 3]
                .map(|number| format!("{prefix}{letter}{number}_{unit}"))
                .join(",")
        };
        let mut text = names("");
        if heights > 0 {
            text.push_str(",height_mm");
        }
        if distances > 0 {
            let _ = write!(text, ",distance_mm,{}", names("to_"));
        }
        text.push('\n');
        for row in &self.readings.rows {
            let Reading {
                joints,
                height,
                distance,
                ..
            } = row.value;
            let cells = |joints: [f64; 3]| {
                joints
                    .map(|own| rounded(joint::in_file(drive, own)))
                    .join(",")
            };
            text.push_str(&cells(joints));
            if heights > 0 {
                let height = height.map(|(_, height)| rounded(height));
                let _ = write!(text, ",{}", height.unwrap_or_default());
            }
            match distance {
                Some((ReadingFrom::Pose(from), distance)) => {
                    let _ = write!(text, ",{},{}", rounded(distance), cells(from));
                }
                _ if distances > 0 => text.push_str(",,,,"),
                _ => {}
            }
            text.push('\n');
        }
        Some(text)
    }
}
