//! A calibrated robot for another controller: the parameters that it holds, fitted, and the loss.
//!
//! ```text
//! RobotFile ─→ Shape ─→ Geometry of the target ──┐
//! positions of the workspace ────────────────────┴→ fit ─→ Geometry, Frame, Loss ─→ lines to paste
//! ```
//!
//! A controller's kinematics is that of a robot with some parameters zero or equal, so the core's inverse kinematics of that
//! robot is the controller's own.

mod correction_table;
pub mod error;
mod fit;
pub mod geometry;
pub mod positions;
pub mod target;
mod targets {
    pub(super) mod b_and_r;
    pub(super) mod four_lengths;
    pub(super) mod klipper;
    pub(super) mod linuxcnc;
    pub(super) mod marlin;
    pub(super) mod reprapfirmware;
}

use crate::files::robot_file::RobotFile;
use crate::text::degrees;
pub use correction_table::Table;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Robot, Tolerance};
use error::ExportError;
use fit::{LEAST_POSITIONS, fit};
use geometry::{Frame, Geometry, Holds, Shape, even_azimuths, nearest_symmetric, within_half_turn};
use positions::{Loss, Wanted};
use target::{Content, Fitted, Target, Written};
use targets::{b_and_r, four_lengths, klipper, linuxcnc, marlin, reprapfirmware};

/// The largest error of an angle that no controller holds, degrees.
const LARGEST_ANGLE: f64 = 10.0;
/// The same for a length, as a fraction of the upper arm.
const LARGEST_PART: f64 = 0.1;
/// The tolerance of a robot whose file states none: mm and degrees; with towers end stops in mm, and scale.
const TOLERANCE: (f64, f64) = (0.5, 0.2);
const TOWERS: (f64, f64) = (5.0, 0.001);

/// The platform radius if none is stated, mm.
const USUAL_PLATFORM: f64 = 25.0;

/// All targets.
pub const TARGETS: [&Target; 15] = [
    &klipper::ROTARY,
    &klipper::LINEAR,
    &reprapfirmware::ROTARY,
    &reprapfirmware::LINEAR,
    &marlin::MARLIN,
    &b_and_r::B_AND_R,
    &linuxcnc::LINUXCNC,
    &linuxcnc::COMPONENT,
    &four_lengths::SMOOTHIEWARE,
    &four_lengths::FLUIDNC,
    &four_lengths::GRBLHAL,
    &four_lengths::UCNC,
    &four_lengths::DELTA_X,
    &four_lengths::CODESYS,
    &correction_table::CORRECTION_TABLE,
];

/// The target of this name that supports these drives.
///
/// # Errors
/// There is no such target.
pub fn target(name: &str, drive: Drive) -> Result<&'static Target, ExportError> {
    let takes = |target: &&Target| target.drive.is_none_or(|own| own == drive);
    let taking = || TARGETS.into_iter().filter(takes);
    let found = taking().find(|target| target.name == name);
    found.ok_or_else(|| ExportError::OtherDrive {
        drive,
        others: taking().map(|target| target.name.to_owned()).collect(),
    })
}

/// The targets' names on the command line.
pub fn names() -> Vec<&'static str> {
    let mut names = TARGETS.map(|target| target.name).to_vec();
    names.dedup();
    names
}

/// Values that the user states beside the robot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// The height of the robot's origin above z = 0 of the controller, mm, if the controller holds a height; `None` for the
    /// smallest whole number of millimetres with which no wanted position is below 0.
    pub height: Option<f64>,
    /// The joint angle of each arm at its end stop, in the robot file's convention, radians; `None` for the smallest whole
    /// degrees that all three can have. With towers the travel, mm; `None` for the largest.
    pub home: Option<[f64; 3]>,
    /// The platform radius, mm; `None` for that of the robot file, or 25 mm. Controllers that hold base and platform radius
    /// use only the difference.
    pub platform_radius: Option<f64>,
    /// Whether the controller's unit is the inch.
    pub inches: bool,
    /// The largest error of interpolation between the nodes of a correction table, mm.
    pub limit: Option<f64>,
    /// The motion after which z is the height above the bed, if heights were measured. The fit keeps its level.
    pub level: Option<Frame>,
}

/// A robot to export.
#[derive(Debug)]
pub struct Case<'a> {
    /// The calibrated robot.
    pub robot: &'a RobotFile,
    /// The robot before its calibration, if a file states it; otherwise the nearest symmetric robot is assumed.
    pub nominal: Option<&'a Robot<f64>>,
    /// The wanted positions.
    pub wanted: &'a Wanted,
    /// Values that the user states.
    pub settings: Settings,
}

/// The result of an export.
#[derive(Debug, Clone)]
pub struct Export {
    /// The target.
    pub target: &'static Target,
    /// The parameters and the lines.
    pub written: Written,
    /// The rigid motion from the robot's frame to the controller's, if it was fitted.
    pub frame: Option<Frame>,
    /// The robot whose inverse kinematics is the target's, if it was fitted.
    pub controller: Option<Robot<f64>>,
    /// The corrections, if the target is a table.
    pub table: Option<Table>,
    /// The errors with the target's parameters.
    pub loss: Loss,
    /// The errors of a controller with the nominal robot.
    pub uncalibrated: Loss,
    /// The same after the best rigid motion.
    pub uncalibrated_moved: Loss,
    /// The largest distance of the positions from the z axis, mm, if the workspace was limited to it.
    pub within: Option<f64>,
}

impl Export {
    /// The fraction of the calibration's gain, after the best rigid motion, that the target keeps: 1 is everything, 0 or less
    /// nothing.
    pub fn kept(&self) -> Option<f64> {
        let before = self.uncalibrated_moved.rms;
        // Below this the robot equals its nominal one, and nothing was gained.
        (before > 1e-3).then(|| 1.0 - self.loss.rms / before)
    }
}

impl Case<'_> {
    /// Exports the robot for a target.
    ///
    /// # Errors
    /// The target cannot hold this robot, or the positions are too few.
    pub fn export(&self, target: &'static Target) -> Result<Export, ExportError> {
        let found = self.wanted.evaluated.len();
        if found < LEAST_POSITIONS {
            return Err(ExportError::TooFewPositions(found));
        }
        let (robot, wanted) = (&self.robot.robot, self.wanted);
        let level = self.settings.level.unwrap_or_default();
        let shapes = Shape::all(robot, &self.middle()?, &RigidTransform::identity());
        let nominal = match self.nominal {
            Some(nominal) => *nominal,
            None => {
                nearest_symmetric(&shapes, robot.drive()).map_err(|_| ExportError::Unreached)?
            }
        };
        let mut export = Export {
            target,
            written: Written::default(),
            frame: None,
            controller: None,
            table: None,
            loss: Loss::default(),
            uncalibrated: Loss::of_controller(robot, &nominal, &level.transform(), wanted),
            uncalibrated_moved: Loss::after_rigid_motion(robot, &nominal, wanted),
            within: wanted.within,
        };
        match &target.content {
            Content::Fitted { holds, write } => {
                let (fitted, frame) = self.fitted(holds)?;
                let controller = fitted.geometry.robot();
                let controller = controller.map_err(|_| ExportError::Unreached)?;
                export.written = write(&fitted)?;
                export.loss = Loss::of_controller(robot, &controller, &frame.transform(), wanted);
                export.controller = Some(controller);
                export.frame = Some(frame);
            }
            Content::Everything => {
                let (written, held) = linuxcnc::write_component(self.robot, self.settings.home)?;
                export.written = written;
                let same = RigidTransform::identity();
                export.loss = Loss::of_controller(robot, &held, &same, wanted);
            }
            Content::Corrections => {
                let limit = self.settings.limit;
                let (table, loss) = Table::of(self.robot, &nominal, wanted, limit)?;
                if loss.positions == 0 {
                    return Err(ExportError::Unreached);
                }
                export.written.lines = table.lines();
                if self.nominal.is_none() {
                    export
                        .written
                        .warnings
                        .push(assumed(&shapes, robot.drive()));
                }
                export.loss = loss;
                export.table = Some(table);
            }
        }
        Ok(export)
    }

    /// The joints in the middle of the wanted positions.
    fn middle(&self) -> Result<[f64; 3], ExportError> {
        match self.robot.robot.drive() {
            // Rotary arms have the same shape everywhere.
            Drive::Rotary => Ok([0.0; 3]),
            Drive::Linear => {
                let joints = self.robot.robot.inverse(&self.wanted.centre());
                joints.map_err(|_| ExportError::Unreached)
            }
        }
    }

    fn fitted(&self, holds: &Holds) -> Result<(Fitted, Frame), ExportError> {
        let Settings { home, level, .. } = self.settings;
        let (robot, limits) = (&self.robot.robot, self.robot.limits);
        let drive = robot.drive();
        let mut frame = level.unwrap_or_default();
        let shapes = Shape::all(robot, &self.middle()?, &frame.transform());
        let mut height = 0.0;
        if drive == Drive::Rotary {
            check(&shapes, holds)?;
            let usual = if holds.from_base_plane {
                0.0
            } else {
                (-self.wanted.lowest()).ceil()
            };
            height = self.settings.height.unwrap_or(usual);
        }
        let start = Geometry::start(drive, &shapes, holds, height);
        if holds.heights != geometry::Each::Fixed {
            frame.shift.z += height;
        }
        frame.turns.z += start.turn;
        let tolerance = match self.robot.tolerance {
            Some(tolerance) => tolerance,
            None => Tolerance::new(TOLERANCE.0, TOLERANCE.1.to_radians())
                .and_then(|own| match drive {
                    Drive::Linear => own.with_linear(TOWERS.0, TOWERS.1),
                    Drive::Rotary => Ok(own),
                })
                .map_err(|_| ExportError::Unreached)?,
        };
        // With towers z = 0 and level are the bed's.
        let level = level.is_some() || drive == Drive::Linear;
        let found = fit(
            (robot, &tolerance),
            (start, holds),
            (frame, level),
            self.wanted,
        );
        let (geometry, frame) = found.ok_or(ExportError::Unreached)?;
        let usual = || match drive {
            Drive::Linear => [limits.maximum(); 3],
            Drive::Rotary => [highest(self.robot); 3],
        };
        let fitted = Fitted {
            geometry,
            home: home.unwrap_or_else(usual),
            home_stated: home.is_some(),
            level: self.settings.level.is_some(),
            limits: [limits.minimum(), limits.maximum()],
            platform_radius: (self.settings.platform_radius)
                .or(self.robot.platform_radius)
                .unwrap_or(USUAL_PLATFORM),
            convention: self.robot.convention,
            target: self.robot.instruments.target,
            inches: self.settings.inches,
            reach: self.wanted.reach(),
        };
        Ok((fitted, frame))
    }
}

/// The lines of a target that describe a robot which the target holds exactly.
pub(crate) fn held(
    robot: &RobotFile,
    home: [f64; 3],
    target: &'static Target,
) -> Result<Written, ExportError> {
    let Content::Fitted { holds, write } = &target.content else {
        return Ok(Written::default());
    };
    let drive = robot.robot.drive();
    let shapes = Shape::all(&robot.robot, &home, &RigidTransform::identity());
    write(&Fitted {
        geometry: Geometry::start(drive, &shapes, holds, 0.0),
        home,
        home_stated: true,
        level: true,
        limits: [robot.limits.minimum(), robot.limits.maximum()],
        platform_radius: 0.0,
        convention: robot.convention,
        target: None,
        inches: false,
        reach: 0.0,
    })
}

/// Refuses a robot with large errors that the target does not hold: its fitted parameters would be meaningless.
fn check(arms: &[Shape; 3], holds: &Holds) -> Result<(), ExportError> {
    for ((arm, even), index) in arms.iter().zip(even_azimuths(arms)).zip(ArmIndex::ALL) {
        let refuse = |key, cause| {
            Err(ExportError::CannotHold {
                arm: index,
                key,
                cause,
            })
        };
        let tilt = degrees(arm.tilt);
        if tilt.abs() > LARGEST_ANGLE {
            let cause = format!(
                "its motor axis is tilted by {tilt:.3}°; no controller holds a tilt, and a fit compensates at most \
                 {LARGEST_ANGLE}°"
            );
            return refuse("alpha_deg", cause);
        }
        if arm.side.abs() > LARGEST_PART * arm.upper {
            let cause = format!(
                "its plane is {:.3} mm from the z axis; no controller holds that, and a fit compensates at most a tenth of \
                 the upper arm",
                arm.side.abs()
            );
            return refuse("theta_deg", cause);
        }
        let off = within_half_turn(arm.azimuth - even).to_degrees();
        if holds.fixed_azimuths.is_some() && off.abs() > LARGEST_ANGLE {
            let cause = format!(
                "its azimuth is {off:.3}° off arms 120° apart, which this target assumes; a fit compensates at most \
                 {LARGEST_ANGLE}°"
            );
            return refuse("theta_deg", cause);
        }
    }
    Ok(())
}

/// The smallest whole degree within the limits that all three arms can have, elbows out and clear of singularities,
/// radians.
fn highest(robot: &RobotFile) -> f64 {
    let (reach, limits) = (robot.reach(), robot.limits);
    let mut angle = limits.minimum().to_degrees().ceil();
    while angle <= limits.maximum().to_degrees() {
        let q = angle.to_radians();
        let at = reach.clear_position(&robot.robot, &[q; 3]).ok();
        let back = at.and_then(|at| robot.robot.inverse(&at).ok());
        if back.is_some_and(|back| back.iter().all(|own| (own - q).abs() < 1e-6)) {
            return q;
        }
        angle += 1.0;
    }
    limits.minimum()
}

/// The warning about a controller's robot that the user did not state.
fn assumed(arms: &[Shape; 3], drive: Drive) -> String {
    let mean = |value: fn(&Shape) -> f64| arms.iter().map(value).sum::<f64>() / 3.0;
    let radius = mean(|arm| arm.radius);
    let lower = mean(|arm| arm.lower);
    let robot = match drive {
        Drive::Rotary => format!(
            "base minus platform radius {radius:.4}, height {:.4}, upper arm {:.4}, forearm {lower:.4} mm, first arm at \
             {:.4}°, upper arm level at {:.4}°",
            mean(|arm| arm.height),
            mean(|arm| arm.upper),
            degrees(even_azimuths(arms)[0]),
            degrees(mean(|arm| arm.zero))
        ),
        Drive::Linear => format!("radius {radius:.4} mm, rods {lower:.4} mm"),
    };
    format!(
        "The table is right only for a controller that uses the symmetric robot ({robot}). Give the controller's robot with \
         --nominal."
    )
}
