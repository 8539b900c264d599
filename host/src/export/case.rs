//! A robot, and how it is exported for a target.

use super::choose::{Choice, names_for};
use super::correction_table;
use super::error::ExportError;
use super::exported::{Content, Export};
use super::fit::fit;
use super::geometry::{Geometry, Holds};
use super::linear;
use super::linuxcnc_component;
use super::loss::Loss;
use super::nominal::{nearest_symmetric, symmetric_arms};
use super::sdf;
use super::settings::Settings;
use super::shape::{ArmShape, within_half_turn};
use super::target::{Fitted, Target};
use super::wanted::Wanted;
use crate::files::robot_file::RobotFile;
use crate::text::units::degrees;
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Robot, Tolerance};

/// Fewer positions determine no fit.
const LEAST_POSITIONS: usize = 20;
/// What no controller holds may be off by this much: degrees.
const LARGEST_ANGLE: f64 = 10.0;
/// The same of a length, as a part of the upper arm.
const LARGEST_PART: f64 = 0.1;
/// The tolerance of a robot whose file states none: mm and degrees.
const TOLERANCE: (f64, f64) = (0.5, 0.2);

/// A robot and what it is exported with.
#[derive(Debug)]
pub struct Case<'a> {
    /// The calibrated robot.
    pub robot: &'a RobotFile,
    /// The robot before its calibration, if a file states it; otherwise the nearest symmetric one.
    pub nominal: Option<&'a RobotFile>,
    /// Where the robot is wanted.
    pub wanted: &'a Wanted,
    /// What the user states beside.
    pub settings: Settings,
}

impl Case<'_> {
    /// For a target.
    ///
    /// # Errors
    /// The target cannot hold this robot, or the positions are too few.
    pub fn export(&self, choice: Choice) -> Result<Export, ExportError> {
        let found = self.wanted.evaluated.len();
        if found < LEAST_POSITIONS {
            return Err(ExportError::TooFewPositions { found });
        }
        let robot = &self.robot.robot;
        let drive = robot.drive();
        let other_drive = || ExportError::OtherDrive {
            drive,
            others: names_for(drive),
        };
        if !choice.takes(drive) || self.nominal.is_some_and(|own| own.robot.drive() != drive) {
            return Err(other_drive());
        }
        let nominal = self.nominal_robot()?;
        let (mut uncalibrated, uncalibrated_moved) =
            Loss::uncalibrated(robot, &nominal, self.wanted);
        let Settings { home, level, .. } = self.settings;
        if let Some(level) = level {
            uncalibrated = Loss::of_controller(robot, &nominal, &level.transform(), self.wanted);
        }
        let export = match (choice, drive) {
            (Choice::Controller(Some(target), _), Drive::Rotary) => self.controller(target)?,
            (Choice::Controller(_, Some(target)), Drive::Linear) => {
                linear::case::export(self.robot, self.wanted, target, home, level)?
            }
            (Choice::Controller(..), _) => return Err(other_drive()),
            (Choice::Sdf, _) => sdf::export(self.robot, self.wanted),
            (Choice::LinuxcncComponent, _) => {
                linuxcnc_component::export(self.robot, self.wanted, home)?
            }
            (Choice::CorrectionTable, _) => {
                let settings = &self.settings;
                correction_table::export(
                    self.robot,
                    (&nominal, self.nominal.is_some()),
                    self.wanted,
                    (settings.corrections, settings.nodes),
                )?
            }
        };
        Ok(Export {
            uncalibrated,
            uncalibrated_moved,
            within: self.wanted.within,
            ..export
        })
    }

    fn nominal_robot(&self) -> Result<Robot<f64>, ExportError> {
        if let Some(nominal) = self.nominal {
            return Ok(nominal.robot);
        }
        let robot = &self.robot.robot;
        match robot.drive() {
            Drive::Rotary => nearest_symmetric(robot).map_err(|_| ExportError::Unreached),
            Drive::Linear => {
                linear::case::nominal(robot, self.wanted).ok_or(ExportError::Unreached)
            }
        }
    }

    fn controller(&self, target: &'static Target) -> Result<Export, ExportError> {
        let calibrated = &self.robot.robot;
        let arms = ArmShape::all(calibrated);
        check(&arms, &target.holds)?;
        let settings = &self.settings;
        let height = settings
            .height
            .unwrap_or_else(|| (-self.wanted.lowest()).ceil());
        let tolerance = match self.robot.tolerance {
            Some(tolerance) => tolerance,
            None => Tolerance::new(TOLERANCE.0, TOLERANCE.1.to_radians())
                .map_err(|_| ExportError::Unreached)?,
        };
        let start = Geometry::start(&arms, &target.holds, height);
        let (geometry, frame) = fit(
            calibrated,
            start,
            &target.holds,
            &tolerance,
            (height, settings.level.is_some()),
            self.wanted,
        )
        .ok_or(ExportError::Unreached)?;
        let controller = geometry.robot().map_err(|_| ExportError::Unreached)?;
        let loss = Loss::of_controller(calibrated, &controller, &frame.transform(), self.wanted);
        let limits = self.robot.limits;
        let written = (target.write)(&Fitted {
            geometry,
            home: settings.home.unwrap_or_else(|| [highest(self.robot); 3]),
            home_stated: settings.home.is_some(),
            limits: [limits.minimum(), limits.maximum()],
            platform_radius: settings.platform_radius,
            reach: self
                .wanted
                .evaluated
                .iter()
                .fold(0.0, |reach, at| f64::max(reach, at.xy().norm())),
        })?;
        Ok(Export {
            name: target.name,
            title: target.title,
            comment: target.comment,
            content: Content::Fitted(target.holds.count()),
            written,
            frame: Some(frame),
            loss,
            uncalibrated: loss,
            uncalibrated_moved: loss,
            within: None,
            controller: Some(controller),
            conventions: target.conventions.to_vec(),
            source: target.source,
            alternative: target.alternative,
        })
    }
}

/// What the target does not hold must be small: a robot of another kind would be fitted with parameters
/// that mean nothing.
fn check(arms: &[ArmShape; 3], holds: &Holds) -> Result<(), ExportError> {
    let even = symmetric_arms(arms);
    for ((arm, even), index) in arms.iter().zip(&even).zip(ArmIndex::ALL) {
        let refuse = |key, cause| {
            Err(ExportError::CannotHold {
                arm: index,
                key,
                cause,
            })
        };
        let tilt = degrees(arm.tilt);
        if tilt.abs() > LARGEST_ANGLE {
            return refuse(
                "alpha_deg",
                format!(
                    "its motor axis is tilted by {tilt:.3}°, and no controller holds a tilt; up to \
                     {LARGEST_ANGLE}° can be made up for"
                ),
            );
        }
        if arm.side.abs() > LARGEST_PART * arm.upper {
            return refuse(
                "theta_deg",
                format!(
                    "its plane passes the base's z axis at {:.3} mm, and no controller holds that; up to a tenth of \
                     the upper arm can be made up for",
                    arm.side.abs()
                ),
            );
        }
        let off = within_half_turn(arm.azimuth - even.azimuth).to_degrees();
        if holds.fixed_azimuths.is_some() && off.abs() > LARGEST_ANGLE {
            return refuse(
                "theta_deg",
                format!(
                    "its azimuth is {off:.3}° off arms 120° apart, which this target's source fixes; up to \
                     {LARGEST_ANGLE}° can be made up for"
                ),
            );
        }
    }
    Ok(())
}

/// The smallest joint angle of whole degrees, within the limits, at which all three arms can be, elbows out and
/// clear of singularities, radians.
fn highest(robot: &RobotFile) -> f64 {
    let (reach, limits) = (robot.reach(), robot.limits);
    let mut angle = limits.minimum().to_degrees().ceil();
    while angle <= limits.maximum().to_degrees() {
        let q = angle.to_radians();
        let back = reach
            .clear_position(&robot.robot, &[q; 3])
            .ok()
            .and_then(|at| robot.robot.inverse(&at).ok());
        if back.is_some_and(|back| back.iter().all(|own| (own - q).abs() < 1e-6)) {
            return q;
        }
        angle += 1.0;
    }
    limits.minimum()
}
