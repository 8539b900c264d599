//! What measurements say before they are taken: how their readings change with the robot's parameters and the
//! unknowns of the instruments.

use super::error::PlanError;
use super::setup::Setup;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::READINGS;
use crate::fit::covariance::{COLUMNS, ENTRIES, MOST, PARAMETERS};
use crate::fit::covariance::{RobotCovariance, WITH_TRANSMISSIONS};
use crate::fit::observations::levels;
use crate::fit::options::Frame;
use crate::fit::solve::{GAUGE_ANGLE, GAUGE_LENGTH};
use delta_cal::calibration::Problem;
use delta_cal::observations::{
    Instruments, Observation, ObservationNoise, ObservationProblem, ObservationRow, Plane, Point,
    PositionFrame,
};
use delta_cal::{Settings, Tolerance};
use nalgebra::{DMatrix, DVector};

/// What rows say of all unknowns, in the units of the core's problem.
#[derive(Debug, Clone)]
pub(super) struct Information {
    /// Of each row how its readings change with the unknowns, in σ: a column a reading.
    pub(super) rows: Vec<DMatrix<f64>>,
    /// Before any measurement: what is known, and that no parameter is off by more than a forearm, so that
    /// there always is some.
    pub(super) prior: DMatrix<f64>,
    /// What an unknown is counted in: mm or radians.
    pub(super) units: DVector<f64>,
    /// How many of the unknowns are the robot's: with its transmissions, if they are to be found.
    pub(super) of_robot: usize,
}

impl Information {
    /// Of rows that a robot is measured in, whatever was read but for where it shows the instruments. `anchors`
    /// show that as well and say nothing else.
    pub(super) fn of(
        file: &RobotFile,
        setup: &Setup,
        rows: &[Observation<f64>],
        anchors: &[Observation<f64>],
    ) -> Result<Self, PlanError> {
        let (planes, points): (Vec<_>, Vec<_>) = (
            setup.planes.iter().map(|plane| plane.known).collect(),
            setup.points.iter().map(|point| point.known).collect(),
        );
        let mut all: Vec<_> = rows.iter().map(|own| ObservationRow::new(*own)).collect();
        all.extend(anchors.iter().map(|own| {
            let mut row = ObservationRow::new(*own);
            row.set_weight(0.0);
            row
        }));
        let instruments = instruments(&setup.robot, setup.frame, &planes, &points)?;
        let unknowns = PARAMETERS + instruments.unknowns();
        if unknowns > MOST {
            return Err(PlanError::TooManyInstruments);
        }
        let problem = ObservationProblem::<f64, MOST>::prepare(&file.robot, &instruments, &mut all)
            .map_err(|_| PlanError::Singular)?;
        let settings = Settings::new().with_tolerance(tolerance(file, setup.frame));
        let prior = problem.prior(&settings);
        let [arm, ..] = file.robot.arms();
        let least = (arm.upper_arm_length() / arm.lb()).powi(2);
        let row = |index: usize| {
            let columns = problem.linearized::<COLUMNS>(index);
            let columns = columns.unwrap_or([[0.0; READINGS]; COLUMNS]);
            DMatrix::from_fn(unknowns, READINGS, |unknown, reading| {
                columns[unknown][reading]
            })
        };
        let unit = |unknown: usize, _: usize| {
            Problem::<f64, MOST, COLUMNS, ENTRIES>::unit_of(&problem, unknown)
        };
        Ok(Self {
            rows: (0..rows.len()).map(row).collect(),
            prior: DMatrix::from_fn(unknowns, unknowns, |row, column| {
                let least = if row == column { least } else { 0.0 };
                prior.information(row, column) + least
            }),
            units: DVector::from_fn(unknowns, unit),
            of_robot: match file.transmission {
                Some(_) => WITH_TRANSMISSIONS,
                None => PARAMETERS,
            },
        })
    }

    /// Of all unknowns after these rows.
    pub(super) fn covariance(&self) -> Option<DMatrix<f64>> {
        let prior = self.prior.clone();
        let information = self
            .rows
            .iter()
            .fold(prior, |sum, rows| sum + rows * rows.transpose());
        Some(information.cholesky()?.inverse())
    }

    /// The part of the robot's own parameters, in mm and radians.
    pub(super) fn of_robot(&self, covariance: &DMatrix<f64>) -> RobotCovariance {
        RobotCovariance::from_fn(|row, column| {
            if row.max(column) < self.of_robot {
                covariance[(row, column)] * self.units[row] * self.units[column]
            } else {
                0.0
            }
        })
    }

    /// W of tr W C for the robot's own parameters in mm and radians, in the units and of the size of all unknowns.
    pub(super) fn weights(&self, of_robot: &RobotCovariance) -> DMatrix<f64> {
        let unknowns = self.units.len();
        DMatrix::from_fn(unknowns, unknowns, |row, column| {
            if row.max(column) < self.of_robot {
                of_robot[(row, column)] * self.units[row] * self.units[column]
            } else {
                0.0
            }
        })
    }
}

fn instruments<'a>(
    robot: &RobotFile,
    frame: Frame,
    planes: &'a [Plane<f64>],
    points: &'a [Point<f64>],
) -> Result<Instruments<'a, f64>, PlanError> {
    let sigma = levels(robot).ok_or(PlanError::Singular)?;
    let noise = ObservationNoise::new(sigma.position, sigma.height, sigma.distance);
    Ok(Instruments {
        frame: match frame {
            Frame::Base => PositionFrame::Base,
            Frame::Sensor => PositionFrame::Sensor,
        },
        planes,
        points,
        noise: noise.map_err(|_| PlanError::Singular)?,
        transmission: robot.transmission,
    })
}

/// What is known of the robot; in a sensor's frame something always is.
fn tolerance(file: &RobotFile, frame: Frame) -> Option<Tolerance<f64>> {
    let [arm, ..] = file.robot.arms();
    match frame {
        Frame::Base => file.tolerance,
        Frame::Sensor => file
            .tolerance
            .or_else(|| Tolerance::new(GAUGE_LENGTH * arm.lb(), GAUGE_ANGLE).ok()),
    }
}
