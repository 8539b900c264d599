//! What a session is begun with, and the rows that follow.

use super::convert::{self, Measurement};
use super::error::{DeviceError, RowError};
use super::number::Number;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, SamplesFile};
use crate::fit::options::Options;
use delta_cal::stream::Estimator;
use delta_cal_protocol::{
    Begin, BeginObservations, Fault, ObservationMessage, Request, SampleMessage,
};

/// All that a driver sends of a calibration. The sessions and indices in it are not looked at: each calibration draws
/// its own session.
#[derive(Debug, Clone, PartialEq)]
pub enum Sending<T> {
    /// Positions.
    Samples {
        /// How it begins.
        begin: Begin<T>,
        /// The measurements.
        rows: Vec<Measurement<T>>,
    },
    /// Heights, distances and single coordinates.
    Observations {
        /// How it begins.
        begin: BeginObservations<T>,
        /// The measurements.
        rows: Vec<ObservationMessage<T>>,
    },
}

impl<T: Number> Sending<T> {
    /// Of a file of positions.
    pub fn samples(robot: &RobotFile, samples: &SamplesFile, options: Options) -> Self {
        Self::Samples {
            begin: convert::begin(robot, options),
            rows: convert::measurements(samples),
        }
    }

    /// Of a file of observations.
    ///
    /// # Errors
    /// [`Fault::TooManyUnknowns`]: the file names more planes or points than a session has.
    pub fn observations(robot: &RobotFile, file: &ObservationsFile) -> Result<Self, DeviceError> {
        Ok(Self::Observations {
            begin: convert::begin_observations(robot, file)?,
            rows: convert::observations(file)?,
        })
    }

    /// How many rows there are.
    pub fn count(&self) -> usize {
        match self {
            Self::Samples { rows, .. } => rows.len(),
            Self::Observations { rows, .. } => rows.len(),
        }
    }

    /// Whether the parameters of all arms are estimated together.
    pub(super) fn is_joint(&self) -> bool {
        match self {
            Self::Samples { begin, .. } => begin.estimator == Estimator::Joint,
            Self::Observations { .. } => true,
        }
    }

    pub(super) fn has_places(&self) -> bool {
        matches!(self, Self::Observations { .. })
    }

    pub(super) fn begin(&self, session: u32) -> Request<T> {
        match self {
            Self::Samples { begin, .. } => Request::Begin(Begin { session, ..*begin }),
            Self::Observations { begin, .. } => {
                Request::BeginObservations(BeginObservations { session, ..*begin })
            }
        }
    }

    /// The request that sends a row; `None` behind the last one.
    pub(super) fn row(&self, session: u32, row: usize) -> Option<Request<T>> {
        let index = u32::try_from(row).unwrap_or(u32::MAX);
        Some(match self {
            Self::Samples { rows, .. } => {
                let Measurement { joints, position } = *rows.get(row)?;
                Request::Sample(SampleMessage {
                    session,
                    index,
                    joints,
                    position,
                })
            }
            Self::Observations { rows, .. } => Request::Observation(ObservationMessage {
                session,
                index,
                ..*rows.get(row)?
            }),
        })
    }

    /// What a fault in answer to a row means.
    pub(super) fn fault(&self, index: usize, fault: Fault) -> DeviceError {
        match fault {
            Fault::Sample(error) => DeviceError::Row {
                index,
                error: RowError::Sample(error),
            },
            Fault::Observation(error) => DeviceError::Row {
                index,
                error: RowError::Observation(error),
            },
            Fault::TooManyObservations { capacity } => DeviceError::TooManyRows {
                rows: self.count(),
                capacity,
            },
            other => DeviceError::Fault(other),
        }
    }
}
