//! What an import gives.

use super::Firmware;
use super::stated::Stated;
use crate::files::input::InputError;
use crate::files::robot_file::{InstrumentFacts, KnownPlane, RobotFile};
use crate::files::samples_file::{Kind, Reading, ReadingFrom, Readings, Row};
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
const TOWERS: (f64, f64, f64, f64) = (0.4, 0.1, 5.0, 0.0005);
/// Of the radius and of the rods' length that all towers have in common, mm: owners seldom measure them. Printed distances
/// decide them, and all are too short where prints shrink: then so many times as much.
const COMMON: f64 = 1.0;
const WITH_DISTANCES: f64 = 2.0;
/// Of arms that motors turn, mm and degrees.
const ARMS: (f64, f64) = (0.5, 0.2);
/// A joint's zero is what an end stop is off by, degrees, and the shoulders' height above the bed is a tape's, mm.
const ARM_ZERO: f64 = 6.0;
const SHOULDERS: f64 = 20.0;
/// The plane of the probe's heights where others were measured by hand, and one σ of the probe's offset, mm.
pub(super) const PROBE: &str = "probe";
const PROBE_OFFSET: f64 = 0.3;
/// One σ of a length on a printed part, by a calliper, mm; it is measured in so many directions, degrees.
const CALLIPER: f64 = 0.1;
const DIRECTIONS: [f64; 3] = [0.0, 60.0, 120.0];
/// Rods whose length is no whole number of these were not made so, mm.
const ROUND: f64 = 0.1;

/// What a controller of towers is told: lengths in mm, azimuths in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Towers {
    pub(super) radius: f64,
    pub(super) azimuths: [f64; 3],
    pub(super) rods: [f64; 3],
    /// The height of the nozzle at x = y = 0 with each carriage at its end stop.
    pub(super) endstops: [f64; 3],
}

impl Towers {
    /// With what the owner states in place of the configuration's.
    pub(super) fn as_stated(self, stated: &Stated) -> Self {
        Self {
            radius: stated.radius.unwrap_or(self.radius),
            rods: stated.rods.unwrap_or(self.rods),
            ..self
        }
    }

    /// Upright towers whose carriages are so high at a travel of 0.
    fn arms(&self, name: &str, zeros: [f64; 3]) -> Result<[Arm<f64>; 3], InputError> {
        let arm = |index: usize| {
            let (sine, cosine) = self.azimuths[index].to_radians().sin_cos();
            let place = [self.radius * cosine, self.radius * sine, zeros[index]];
            let [x, y, z] = place;
            Arm::linear([x, y, z, 0.0, 0.0, 1.0, self.rods[index]])
        };
        possible(name, [arm(0), arm(1), arm(2)])
    }

    /// The travel of each carriage at its end stop.
    fn home(&self) -> [f64; 3] {
        let square = self.radius * self.radius;
        [0, 1, 2].map(|tower| {
            self.endstops[tower] + (self.rods[tower] * self.rods[tower] - square).sqrt()
        })
    }
}

/// A robot as its controller is told that it is, with the readings that the configuration holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// Whose configuration it was.
    pub firmware: Firmware,
    /// The robot with what its owner states, under the configuration's name.
    pub robot: RobotFile,
    /// The controller's robot as the configuration stands, at the same joints.
    pub configured: Robot<f64>,
    /// The readings; the line of each is that of the configuration.
    pub readings: Readings,
    /// What the configuration calls each reading.
    pub names: Vec<String>,
    /// The joints at their end stops: radians, or mm of travel.
    pub home: [f64; 3],
    /// The radius within which the nozzle is wanted, mm.
    pub bed_radius: Option<f64>,
    /// Whether Klipper ignores what it saved.
    pub saved_ignored: bool,
    /// What to know of the import, in sentences.
    pub notes: Vec<String>,
}

/// The arms of a controller and the height of the nozzle at x = y = 0 with each joint at its end stop, mm.
pub(super) struct Machine {
    arms: [Arm<f64>; 3],
    configured: [Arm<f64>; 3],
    endstops: [f64; 3],
    /// One σ of the radius and of the rods' length that all towers have in common, as stated.
    sigmas: [Option<f64>; 2],
}

fn possible<E: std::fmt::Display>(
    name: &str,
    [a, b, c]: [Result<Arm<f64>, E>; 3],
) -> Result<[Arm<f64>; 3], InputError> {
    let impossible =
        |error: E| InputError::new(name, format!("the geometry is impossible: {error}"));
    Ok([
        a.map_err(impossible)?,
        b.map_err(impossible)?,
        c.map_err(impossible)?,
    ])
}

impl Machine {
    /// Upright towers.
    pub(super) fn towers(
        name: &str,
        configured: &Towers,
        stated: &Stated,
    ) -> Result<Self, InputError> {
        let own = configured.as_stated(stated);
        let [now, then] = [configured.home(), own.home()];
        let arms = own.arms(name, [0.0; 3])?;
        let shift = [0, 1, 2].map(|tower| now[tower] - then[tower]);
        // Rods that cannot be are why others are stated.
        let as_configured = configured.arms(name, shift).unwrap_or(arms);
        Ok(Self {
            arms,
            configured: as_configured,
            endstops: own.endstops,
            sigmas: [stated.radius_sigma, stated.rods_sigma],
        })
    }

    /// Arms that motors turn.
    pub(super) fn rotary<E: std::fmt::Display>(
        name: &str,
        arms: [Result<Arm<f64>, E>; 3],
        endstops: [f64; 3],
    ) -> Result<Self, InputError> {
        let arms = possible(name, arms)?;
        Ok(Self {
            arms,
            configured: arms,
            endstops,
            sigmas: [None; 2],
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

    /// The controller's robot as the configuration stands.
    pub(super) fn configured(&self) -> Result<Robot<f64>, InputError> {
        Robot::new(self.configured).map_err(|error| {
            InputError::new(
                "the configuration",
                format!("the geometry is impossible: {error}"),
            )
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
        let usual = if readings.holds(Kind::Distance) {
            WITH_DISTANCES * COMMON
        } else {
            COMMON
        };
        let [radius_sigma, rods_sigma] = self.sigmas.map(|own| own.unwrap_or(usual));
        let (limits, tolerance) = match robot.drive() {
            Drive::Rotary => (
                JointLimits::new(low, high.max(LOWEST_ARM.to_radians())),
                Tolerance::new(ARMS.0, ARMS.1.to_radians())
                    .and_then(|own| own.with_joint_zero(ARM_ZERO.to_radians())),
            ),
            Drive::Linear => (
                JointLimits::travel(low.min(lowest_travel(&robot, bed)).floor(), high),
                Tolerance::new(TOWERS.0, TOWERS.1.to_radians())
                    .and_then(|own| own.with_linear(TOWERS.2, TOWERS.3))
                    .and_then(|own| own.with_radius(radius_sigma))
                    .and_then(|own| own.with_forearm(rods_sigma)),
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
                planes: level_planes(&readings.planes, robot.drive()),
                ..InstrumentFacts::default()
            },
            ..RobotFile::of(name, robot, limits)
        })
    }
}

/// The bed: z = 0 and level, and so is what a probe takes for it.
fn level_planes(names: &[String], drive: Drive) -> Vec<KnownPlane> {
    let plane = |name: &String| KnownPlane {
        name: name.clone(),
        line: 0,
        height: 0.0,
        sigma: match drive {
            Drive::Linear if name == PROBE => PROBE_OFFSET,
            Drive::Linear => BED,
            Drive::Rotary => SHOULDERS,
        },
        tilt: Some(BED.to_radians()),
        blocks: Vec::new(),
    };
    names.iter().map(plane).collect()
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
pub(super) fn rods_note(stated: Option<[f64; 3]>, configured: [f64; 3]) -> Option<String> {
    let of = |rods: [f64; 3]| rods.map(rounded).join(", ");
    if let Some(rods) = stated {
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
        let drive = self.robot.robot.drive();
        self.robot.instruments.planes = level_planes(&readings.planes, drive);
        self.readings = readings;
        self
    }

    /// With the printed length and the shrinkage that the owner states.
    ///
    /// # Errors
    /// A part that does not fit on the bed.
    pub fn with_prints(mut self, stated: &Stated) -> Result<Self, InputError> {
        let shrinkage = stated.shrinkage;
        for row in &mut self.readings.rows {
            if let Some((ReadingFrom::Pose(_), distance)) = &mut row.value.distance {
                *distance /= 1.0 - shrinkage;
            }
        }
        let Some([wanted, came_out]) = stated.printed else {
            return Ok(self);
        };
        for direction in DIRECTIONS {
            let (sine, cosine) = f64::to_radians(direction).sin_cos();
            let half = Vector3::new(cosine, sine, 0.0) * (0.5 * wanted);
            let ends = [
                self.configured.inverse(&half),
                self.configured.inverse(&-half),
            ];
            let [Ok(to), Ok(from)] = ends else {
                let cause = format!("--printed: no part of {wanted} mm fits on the bed");
                return Err(InputError::new(&self.robot.name, cause)
                    .with_remedy("state a length that was printed, as --printed 100=99.7"));
            };
            self.readings.rows.push(Row {
                line: 0,
                value: Reading {
                    distance: Some((ReadingFrom::Pose(from), came_out / (1.0 - shrinkage))),
                    // One measurement, taken for all directions.
                    sigma: Some(CALLIPER * (DIRECTIONS.len() as f64).sqrt()),
                    ..Reading::at(to)
                },
            });
            self.names.push("--printed".to_owned());
        }
        Ok(self)
    }

    /// That there is nothing to calibrate from, and how to get it.
    pub fn without_readings(&self) -> InputError {
        let (cause, remedy) = match self.firmware {
            Firmware::Klipper if self.saved_ignored => (
                "Klipper ignores the block of SAVE_CONFIG with the saved measurements: a line in or below it does not \
                 begin with #*#",
                "move such lines above the block (empty ones too), then run DELTA_CALIBRATE and SAVE_CONFIG again",
            ),
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
        let planes = self.readings.planes.len() > 1;
        if heights > 0 {
            text.push_str(if planes {
                ",height_mm,plane"
            } else {
                ",height_mm"
            });
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
                let value = height.map(|(_, height)| rounded(height));
                let _ = write!(text, ",{}", value.unwrap_or_default());
                if planes {
                    let name = height.and_then(|(plane, _)| self.readings.planes.get(plane));
                    let _ = write!(text, ",{}", name.map_or("", String::as_str));
                }
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
