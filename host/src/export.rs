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

use crate::files::{Convention, RobotFile, Tool};
use crate::text::{degrees, joint, rounded};
pub use correction_table::Table;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Parameter, Robot, Tolerance};
use error::ExportError;
use fit::{LEAST_POSITIONS, fit};
use geometry::{Frame, Geometry, Holds, Shape, even_azimuths, nearest_symmetric, within_half_turn};
use positions::{Loss, Place, Wanted};
use serde::Serialize;
use target::{Content, Fitted, Target, Written};
pub use target::{names, target, targets};

/// End stops may be beyond the joint limits by this part of their range.
const BEYOND_LIMITS: f64 = 0.1;
/// The largest error of an angle that no controller holds, degrees.
const LARGEST_ANGLE: f64 = 10.0;
/// The same for a length, as a fraction of the upper arm.
const LARGEST_PART: f64 = 0.1;
/// The tolerance of a robot whose file states none: mm and degrees; with towers end stops in mm, and scale.
const TOLERANCE: (f64, f64) = (0.5, 0.2);
const TOWERS: (f64, f64) = (5.0, 0.001);
/// Below this error, mm, the robot equals its nominal one, and nothing was gained.
const NO_GAIN: f64 = 1e-3;

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
    /// The radius of the printed area, mm; `None` for the largest distance of a wanted position from the axis.
    pub bed_radius: Option<f64>,
    /// With towers: the heights of the nozzle at x = y = 0 with each carriage at its end stop, mm, if they are kept.
    pub endstops: Option<[f64; 3]>,
    /// Steps of a mm, if end stops are in steps.
    pub steps: Option<f64>,
    /// The motion after which z is the height above the bed, if heights were measured. The fit keeps its level.
    pub level: Option<Frame>,
}

/// A robot to export.
#[derive(Debug)]
pub struct Case<'a> {
    /// The calibrated robot.
    pub robot: &'a RobotFile,
    /// The robot before its calibration, if a file states it; otherwise the nearest symmetric robot is assumed.
    pub nominal: Option<&'a RobotFile>,
    /// The wanted positions.
    pub wanted: &'a Wanted,
    /// Values that the user states.
    pub settings: Settings,
}

/// The result of an export, as its JSON report has it.
#[derive(Debug, Clone, Serialize)]
pub struct Export {
    /// The target.
    #[serde(flatten)]
    pub target: &'static Target,
    /// The file of the calibrated robot.
    pub robot: String,
    /// That of the robot before its calibration, if there is one.
    pub nominal: Option<String>,
    /// How many parameters of the target were fitted, without the frame.
    pub fitted_parameters: Option<usize>,
    /// The corrections, if the target is a table.
    pub table: Option<Table>,
    /// The parameters and the lines.
    #[serde(flatten)]
    pub written: Written,
    /// The rigid motion from the robot's frame to the controller's, if it was fitted.
    pub frame: Option<Frame>,
    /// What a correction table for the tool leaves at each target of a platform that tilts.
    pub other_targets: Vec<(String, Loss)>,
    /// The errors with the target's parameters.
    pub loss: Loss,
    /// The errors of a controller with the nominal robot.
    pub not_calibrated: Loss,
    /// The same after the best rigid motion.
    pub not_calibrated_after_rigid_motion: Loss,
    /// The fraction of the calibration's gain, after the best rigid motion, that the target keeps: 1 is everything, 0 or
    /// less nothing.
    pub kept: Option<f64>,
    /// The robot whose inverse kinematics is the target's, if it was fitted.
    #[serde(skip)]
    pub controller: Option<Robot<f64>>,
    /// Where the errors are compared.
    #[serde(skip)]
    pub place: Place,
}

impl Case<'_> {
    /// Exports the robot for a target.
    ///
    /// # Errors
    /// The target cannot hold this robot, or the positions are too few.
    pub fn export(&self, target: &'static Target) -> Result<Export, ExportError> {
        let home = self
            .settings
            .home
            .map(|own| self.inwards(own))
            .transpose()?;
        let settings = Settings {
            home,
            ..self.settings
        };
        Case { settings, ..*self }.exported(target)
    }

    /// Joints at the end stops without the convention of the robot file.
    fn inwards(&self, stated: [f64; 3]) -> Result<[f64; 3], ExportError> {
        let RobotFile {
            convention, limits, ..
        } = self.robot;
        let home = stated.map(|own| convention.sense() * own);
        let (low, high) = (limits.minimum(), limits.maximum());
        let beyond = BEYOND_LIMITS * (high - low);
        let outside = |arm: &ArmIndex| !(low - beyond..=high + beyond).contains(&home[arm.index()]);
        let Some(arm) = ArmIndex::ALL.into_iter().find(outside) else {
            return Ok(home);
        };
        let mark = joint::mark(limits.drive());
        let own = |value: f64| format!("{}{mark}", rounded(convention.degrees(value)));
        let (low, high) = convention.limits(low, high);
        let [low, high] = [low, high].map(|own| rounded(joint::in_file(limits.drive(), own)));
        Err(ExportError::HomeOutside {
            arm,
            at: own(home[arm.index()]),
            limits: format!("{low} to {high}{mark}"),
        })
    }

    fn exported(&self, target: &'static Target) -> Result<Export, ExportError> {
        let found = self.wanted.evaluated.len();
        if found < LEAST_POSITIONS {
            return Err(ExportError::TooFewPositions(found));
        }
        let (robot, wanted) = (&self.robot.robot, self.wanted);
        let level = self.settings.level.unwrap_or_default();
        let shapes = Shape::all(robot, &self.middle()?, &RigidTransform::identity());
        let nominal = match self.nominal {
            Some(nominal) => nominal.robot.clone(),
            None => {
                nearest_symmetric(&shapes, robot.drive()).map_err(|_| ExportError::Unreached)?
            }
        };
        let tool = self.robot.tool();
        let calibrated = (robot, &tool);
        let before = Loss::after_rigid_motion(calibrated, &nominal, wanted);
        let mut export = Export {
            target,
            robot: self.robot.name.clone(),
            nominal: self.nominal.map(|own| own.name.clone()),
            fitted_parameters: None,
            table: None,
            other_targets: Vec::new(),
            written: Written::default(),
            frame: None,
            loss: Loss::default(),
            not_calibrated: Loss::of_controller(calibrated, &nominal, &level.transform(), wanted),
            not_calibrated_after_rigid_motion: before,
            kept: None,
            controller: None,
            place: wanted.place.clone(),
        };
        match target.content {
            Content::Fitted => {
                let (fitted, frame) = self.fitted(target)?;
                let controller = fitted.geometry.robot();
                let controller = controller.map_err(|_| ExportError::Unreached)?;
                export.written = target.write(&fitted)?;
                export.loss =
                    Loss::of_controller(calibrated, &controller, &frame.transform(), wanted);
                export.fitted_parameters = Some(target.holds.count());
                export.controller = Some(controller);
                export.frame = Some(frame.between(&self.robot.convention, &fitted.convention));
            }
            Content::Everything => {
                let same = RigidTransform::identity();
                export.written = held(self.robot, &self.settings, [0.0; 3], target)?;
                export.loss = Loss::of_controller(calibrated, robot, &same, wanted);
                let controller = target.convention(self.robot);
                let frame = Frame::default().between(&self.robot.convention, &controller);
                export.frame = (frame != Frame::default()).then_some(frame);
            }
            Content::Corrections => {
                let limit = self.settings.limit;
                let (table, loss) = Table::of(self.robot, &nominal, wanted, limit)?;
                if loss.positions == 0 {
                    return Err(ExportError::Unreached);
                }
                export.written.lines = table.lines();
                if self.nominal.is_none() {
                    let warning = assumed(&shapes, &self.robot.convention);
                    export.written.warnings.push(warning);
                }
                export.loss = loss;
                export.other_targets = self.other_targets(&table, &nominal);
                export.table = Some(table);
            }
        }
        export.kept = (before.rms > NO_GAIN).then(|| 1.0 - export.loss.rms / before.rms);
        let losses = [
            &mut export.loss,
            &mut export.not_calibrated,
            &mut export.not_calibrated_after_rigid_motion,
        ];
        for loss in losses {
            loss.at = self.robot.convention.vector(&loss.at);
        }
        Ok(export)
    }

    /// What a table for the tool leaves at the targets of a platform that tilts.
    fn other_targets(&self, table: &Table, nominal: &Robot<f64>) -> Vec<(String, Loss)> {
        let tool = self.robot.tool();
        if tool.parallelograms.is_none_or(|own| own.are_exact()) {
            return Vec::new();
        }
        let targets = self.robot.instruments.targets.iter();
        let others = targets.filter(|own| own.place != tool.place);
        let of_target = others.map(|own| {
            let target = Tool {
                place: own.place,
                ..tool
            };
            let calibrated = (self.robot, &target);
            let evaluated = self.wanted.evaluated.iter();
            let is = |at| table.reached(calibrated, nominal, at);
            let loss = Loss::of(evaluated.map(|at| (at, is(at))));
            (own.name.clone(), loss)
        });
        of_target.collect()
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

    fn fitted(&self, target: &Target) -> Result<(Fitted<'_>, Frame), ExportError> {
        let convention = target.convention(self.robot);
        let holds = &target.holds.turned(&convention);
        let level = self.settings.level;
        let robot = &self.robot.robot;
        let drive = robot.drive();
        let mut frame = level.unwrap_or_default();
        let shapes = Shape::all(robot, &self.middle()?, &frame.transform());
        let mut height = 0.0;
        if drive == Drive::Rotary {
            check(robot, &shapes, holds)?;
            let usual = if holds.from_base_plane {
                0.0
            } else {
                (-self.wanted.lowest()).ceil()
            };
            height = self.settings.height.unwrap_or(usual);
        }
        let usual = || match drive {
            Drive::Linear => [self.robot.limits.maximum(); 3],
            Drive::Rotary => [highest(self.robot); 3],
        };
        let home = self.settings.home.unwrap_or_else(usual);
        let mut start = Geometry::start(drive, &shapes, holds, height);
        if holds.zeros == geometry::Each::Shared {
            // All arms have the same angle at their end stops.
            let mean = home.iter().sum::<f64>() / 3.0;
            for (arm, home) in start.arms.iter_mut().zip(home) {
                arm.zero += home - mean;
            }
        }
        if holds.heights == geometry::Each::Fixed {
            // The controller's z = 0 is in the plane of its arms.
            frame.shift.z -= Shape::mean(&shapes).height;
        } else {
            frame.shift.z += height;
        }
        frame.turns.z += start.turn;
        let tolerance = match self.robot.tolerance {
            Some(tolerance) => tolerance,
            None => Tolerance::new(TOLERANCE.0, TOLERANCE.1.to_radians())
                .and_then(|own| match drive {
                    Drive::Linear => own
                        .with(Parameter::Zero, TOWERS.0)?
                        .with(Parameter::Scale, TOWERS.1),
                    Drive::Rotary => Ok(own),
                })
                .map_err(|_| ExportError::Unreached)?,
        };
        // With towers z = 0 and level are the bed's.
        let level = level.is_some() || drive == Drive::Linear;
        let found = fit(
            ((robot, &self.robot.tool()), &tolerance),
            (start, holds),
            (frame, level),
            self.wanted,
        );
        let (geometry, frame) = found.ok_or(ExportError::Unreached)?;
        let fitted = Fitted {
            robot: self.robot,
            convention,
            settings: &self.settings,
            geometry,
            home,
            reach: self.wanted.reach(),
        };
        Ok((fitted, frame))
    }
}

/// The lines of a target that describe a robot which the target holds exactly.
pub(crate) fn held(
    robot: &RobotFile,
    settings: &Settings,
    home: [f64; 3],
    target: &Target,
) -> Result<Written, ExportError> {
    let drive = robot.robot.drive();
    let shapes = Shape::all(&robot.robot, &home, &RigidTransform::identity());
    target.write(&Fitted {
        robot,
        convention: target.convention(robot),
        settings,
        geometry: Geometry::start(drive, &shapes, &target.holds, 0.0),
        home,
        reach: 0.0,
    })
}

/// Refuses a robot with large errors that the target does not hold: its fitted parameters would be meaningless.
fn check(robot: &Robot<f64>, shapes: &[Shape; 3], holds: &Holds) -> Result<(), ExportError> {
    let even = even_azimuths(shapes);
    for index in ArmIndex::ALL {
        let shape = &shapes[index.index()];
        let [dx, dy, _, theta, alpha, ..] = robot.arm(index).parameters();
        let (tilt, side) = (degrees(alpha), dy * theta.cos() - dx * theta.sin());
        let off = within_half_turn(shape.azimuth - even[index.index()]).to_degrees();
        let fault = if tilt.abs() > LARGEST_ANGLE {
            let cause = format!(
                "its motor axis is tilted by {tilt:.3}°; no controller holds a tilt, and a fit compensates at most \
                 {LARGEST_ANGLE}°"
            );
            ("alpha_deg", cause)
        } else if side.abs() > LARGEST_PART * shape.upper {
            let cause = format!(
                "its plane is {:.3} mm from the z axis; no controller holds that, and a fit compensates at most a tenth of \
                 the upper arm",
                side.abs()
            );
            ("theta_deg", cause)
        } else if holds.azimuths_deg.is_some() && off.abs() > LARGEST_ANGLE {
            let cause = format!(
                "its azimuth is {off:.3}° off arms 120° apart, which this target assumes; a fit compensates at most \
                 {LARGEST_ANGLE}°"
            );
            ("theta_deg", cause)
        } else {
            continue;
        };
        let (key, cause) = fault;
        return Err(ExportError::CannotHold {
            arm: index,
            key,
            cause,
        });
    }
    Ok(())
}

/// The smallest whole degree within the limits that all three arms can have, elbows out and clear of singularities,
/// radians.
fn highest(robot: &RobotFile) -> f64 {
    let (reach, limits) = (robot.reach(), robot.limits);
    let first = limits.minimum().to_degrees().ceil();
    let angles = (0..360).map(|step| first + f64::from(step));
    let angles = angles.take_while(|angle| *angle <= limits.maximum().to_degrees());
    let goes_back = |q: &f64| {
        let at = reach.clear_position(&robot.robot, &[*q; 3]).ok();
        let back = at.and_then(|at| robot.robot.inverse(&at).ok());
        back.is_some_and(|back| back.iter().all(|own| (own - q).abs() < 1e-6))
    };
    let highest = angles.map(f64::to_radians).find(goes_back);
    highest.unwrap_or_else(|| limits.minimum())
}

/// The warning about a controller's robot that the user did not state.
fn assumed(arms: &[Shape; 3], convention: &Convention) -> String {
    let mean = Shape::mean(arms);
    let (radius, lower) = (mean.radius, mean.lower);
    let robot = match convention.drive {
        Drive::Rotary => format!(
            "base minus platform radius {radius:.4}, height {:.4}, upper arm {:.4}, forearm {lower:.4} mm, first arm at \
             {:.4}°, upper arm level at {:.4}°",
            convention.height(mean.height),
            mean.upper,
            degrees(convention.angle(even_azimuths(arms)[0])),
            convention.degrees(mean.zero)
        ),
        Drive::Linear => format!("radius {radius:.4} mm, rods {lower:.4} mm"),
    };
    format!(
        "The table is right only for a controller that uses the symmetric robot ({robot}). Give the controller's robot with \
         --nominal."
    )
}
