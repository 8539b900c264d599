//! What is to be calibrated, from what, and how.

use super::advice::{SPREAD, joined};
use super::reason::{Reason, Refused};
use crate::accuracy::position_error::{PositionError, distances};
use crate::files::input_error::InputError;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::options::{Frame, Options};
use crate::fit::samples::{Samples, in_frame};
use crate::fit::sensor_frame;
use crate::geometry::directions::Directions;
use delta_cal::frame::RigidTransform;
use delta_cal::{Sample, Settings};

/// What is to be calibrated, from what, and how.
pub(crate) struct Case<'a> {
    /// The nominal robot: the centre of the tolerance and the start of the fit.
    pub(crate) robot: &'a RobotFile,
    /// The robot as it is in use; of a controller it may be calibrated already.
    pub(crate) before: &'a RobotFile,
    pub(crate) samples: &'a SamplesFile,
    pub(crate) options: Options,
    /// The samples in the robot's frame.
    /// Of a file with many rows some, which stand for all.
    pub(crate) measured: Vec<Sample<f64>>,
    /// In which direction each joint moved last before each of these samples.
    pub(crate) directions: Vec<[f64; 3]>,
    /// From the robot's frame to the sensor's, if that was looked for.
    pub(crate) sensor_frame: Option<RigidTransform<f64>>,
    /// Of the nominal robot.
    pub(crate) error_before: PositionError,
    /// Whether the samples went to a controller, so that advice on options names the other command.
    pub(crate) on_controller: bool,
}

impl<'a> Case<'a> {
    /// Whether the measured points lie where another frame, unit or order of joints would put them.
    pub(crate) fn starts_elsewhere(&self) -> bool {
        let poses = self.measured.iter().map(|sample| sample.joints);
        self.error_before.contradicts(self.robot, poses)
    }

    /// A calibration on this computer. Finds the sensor's frame, if that is asked for.
    ///
    /// # Errors
    /// Options that exclude each other, or points that do not fix the sensor's frame.
    pub(crate) fn new(
        robot: &'a RobotFile,
        samples: &'a SamplesFile,
        options: Options,
    ) -> Result<Self, Reason> {
        options.check()?;
        if robot.transmission.is_some() {
            return Err(InputError::new(
                &robot.name,
                "positions alone do not tell transmissions apart from the rest",
            )
            .at_key("[tolerance] transmission_deg")
            .with_remedy("calibrate them as observations, or delete the line")
            .into());
        }
        let sensor_frame = match options.frame {
            Frame::Base => None,
            Frame::Sensor => {
                let frame = sensor_frame::find(robot, samples, options)
                    .map_err(|cause| unknown_frame(samples, &cause))?;
                let settings = settings(robot, options)?;
                let refined = sensor_frame::refined;
                Some(if options.no_guess {
                    frame
                } else {
                    refined(frame, &robot.robot, samples, &settings, options.loss)
                })
            }
        };
        let case = Self::in_frame(robot, robot, samples, options, sensor_frame);
        case.settings()?;
        Ok(case)
    }

    /// A calibration on a controller.
    pub(crate) fn on_controller(
        robot: &'a RobotFile,
        before: &'a RobotFile,
        samples: &'a SamplesFile,
        options: Options,
    ) -> Self {
        Self {
            on_controller: true,
            ..Self::in_frame(robot, before, samples, options, None)
        }
    }

    fn in_frame(
        robot: &'a RobotFile,
        before: &'a RobotFile,
        samples: &'a SamplesFile,
        options: Options,
        sensor_frame: Option<RigidTransform<f64>>,
    ) -> Self {
        let to_robot = sensor_frame.as_ref().map(RigidTransform::inverse);
        let rows = samples.rows.iter();
        let measured: Vec<_> = rows
            .map(|row| in_frame(&row.value, to_robot.as_ref()))
            .collect();
        let mut moves = Directions::default();
        let directions = match &samples.all {
            Some(all) => all
                .chosen()
                .iter()
                .map(|chosen| chosen.directions)
                .collect(),
            None => measured
                .iter()
                .map(|sample| moves.next(&sample.joints))
                .collect(),
        };
        Self {
            directions,
            error_before: PositionError::of(&distances(&robot.robot, &measured), &samples.rows),
            robot,
            before,
            samples,
            options,
            measured,
            sensor_frame,
            on_controller: false,
        }
    }

    /// All samples, for a fit.
    pub(crate) fn all(&self) -> Samples<'_> {
        match &self.samples.all {
            None => Samples::InMemory(&self.measured),
            Some(all) => Samples::on_disk(all, &self.measured, self.sensor_frame.as_ref()),
        }
    }

    /// How many samples each of those stands for that are in memory.
    #[allow(clippy::cast_precision_loss)] // samples of a file
    pub(crate) fn stands_for(&self) -> f64 {
        self.samples.count() as f64 / self.measured.len().max(1) as f64
    }

    /// A sample as it was measured, in the robot's frame.
    pub(crate) fn in_robot_frame(&self, sample: &Sample<f64>) -> Sample<f64> {
        in_frame(
            sample,
            self.sensor_frame.map(|frame| frame.inverse()).as_ref(),
        )
    }

    /// What the core is told.
    pub(crate) fn settings(&self) -> Result<Settings<f64>, InputError> {
        settings(self.robot, self.options)
    }

    /// An option as it is to be typed.
    pub(crate) fn command(&self, option: &str) -> String {
        if self.on_controller {
            format!("delta-cal calibrate {option}")
        } else {
            option.to_owned()
        }
    }
}

/// What the core is told.
///
/// # Errors
/// A tolerance about a robot that is no guess; a noise by axis whose axes are unknown.
pub fn settings(robot: &RobotFile, options: Options) -> Result<Settings<f64>, InputError> {
    if options.no_guess && robot.tolerance.is_some() {
        let cause = "the [tolerance] is about the values of the robot file, but --no-guess says \
                     not to use them";
        return Err(InputError::new(&robot.name, cause)
            .at_key("[tolerance]")
            .with_remedy("leave out --no-guess, or delete the section [tolerance]"));
    }
    if options.frame == Frame::Sensor
        && let Some(noise) = &robot.noise
        && noise.isotropic().is_none()
    {
        let cause = "the three numbers are along the axes of the robot's frame, and with --frame \
                     sensor the program does not know how these lie in the sensor's frame";
        return Err(InputError::new(&robot.name, cause)
            .at_key("position_mm")
            .with_remedy("state one number, or give the positions in the robot's frame"));
    }
    Ok(Settings::default()
        .with_noise(robot.noise)
        .with_tolerance(robot.tolerance)
        .with_solver(options.solver)
        .with_start(options.start()))
}

/// The points do not fix the sensor's frame.
pub(crate) fn unknown_frame(samples: &SamplesFile, cause: &str) -> Refused {
    Refused {
        cause: format!("{}: {cause}", samples.name),
        remedy: joined(&[
            samples.unit_hint(),
            Some(format!("measure more poses and {SPREAD}")),
        ]),
    }
}
