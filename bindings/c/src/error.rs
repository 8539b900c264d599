//! Why a call failed, with all details from the core.

use crate::memory::{Out, Plain};
use crate::plain::{FRAME, NO_ARM, NO_INSTRUMENT, NO_PARAMETER, PLANE, POINT, TRANSMISSION};
use crate::status::{self, Status};
use delta_cal::calibration::{Instrument, ToleranceError};
use delta_cal::kinematics::{KinematicsError, Singularity};
use delta_cal::observations::ObservationError;
use delta_cal::robot::GeometryError;
use delta_cal::samples::{AddError, MergeError, NoiseError, SampleError};
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{Alarm, ForgettingError, GateError, StreamRefusal, Untested};
use delta_cal::{ArmIndex, Parameter, Refusal};

/// Why a call failed. Every function that takes a pointer to one accepts NULL.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Error {
    /// How many samples or readings there are, or the linearisations spent; 0 where that says nothing.
    pub count: u64,
    /// How many samples or readings are needed; 0 where that says nothing.
    pub needed: u64,
    /// The status that the call returned.
    pub status: Status,
    /// The arm at fault: 0, 1, 2, or `DCAL_NO_ARM`.
    pub arm: i32,
    /// The parameter at fault: `DCAL_DX` to `DCAL_LB`, or `DCAL_NO_PARAMETER`.
    pub parameter: i32,
    /// Why a solution is impossible (`DCAL_GEOMETRY_...`), otherwise `DCAL_OK`.
    pub cause: Status,
    /// The instrument at fault: `DCAL_NO_INSTRUMENT`, `DCAL_FRAME`, `DCAL_PLANE`, `DCAL_POINT` or
    /// `DCAL_TRANSMISSION`.
    pub instrument: i32,
    /// Index of the plane or point at fault.
    pub index: u32,
    /// The figure of a refusal: condition number (undetermined), sigma in length or radians (uncertain), ratio of the
    /// residuals to what the noise allows (residual contradicts noise), or tolerances (far from nominal); otherwise 0.
    pub figure: f32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: C layout, only numbers, no padding (checked by the header's test).
#[allow(unsafe_code)]
unsafe impl Plain for Error {}

impl From<Status> for Error {
    fn from(status: Status) -> Self {
        Self {
            count: 0,
            needed: 0,
            status,
            arm: NO_ARM,
            parameter: NO_PARAMETER,
            cause: status::OK,
            instrument: NO_INSTRUMENT,
            index: 0,
            figure: 0.0,
            reserved: 0,
        }
    }
}

/// The index of an arm in C.
#[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // 0, 1, 2
pub(crate) const fn number_of(arm: ArmIndex) -> i32 {
    arm.index() as i32
}

impl Error {
    fn of_arm(self, arm: ArmIndex) -> Self {
        Self {
            arm: number_of(arm),
            ..self
        }
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // 0 to 7
    fn of_parameter(self, parameter: Parameter) -> Self {
        Self {
            parameter: parameter.index() as i32,
            ..self
        }
    }

    fn of_instrument(self, instrument: Instrument) -> Self {
        let (instrument, index) = match instrument {
            Instrument::Frame => (FRAME, 0),
            Instrument::Plane(index) => (PLANE, index),
            Instrument::Point(index) => (POINT, index),
            Instrument::Transmission(arm) => {
                return Self {
                    instrument: TRANSMISSION,
                    ..self
                }
                .of_arm(arm);
            }
        };
        Self {
            instrument,
            index: u32::from(index),
            ..self
        }
    }

    fn because(self, error: GeometryError) -> Self {
        let cause = Self::from(error);
        Self {
            cause: cause.status,
            parameter: cause.parameter,
            ..self
        }
    }
}

/// The status of a call; also writes the reason if the caller wants it.
pub(crate) fn report(
    mut error: Out<Error>,
    call: impl FnOnce() -> Result<Status, Error>,
) -> Status {
    let result = match error.usable_or_null() {
        Ok(()) => call(),
        Err(status) => return status,
    };
    match result {
        Ok(status) => status,
        Err(why) => {
            error.put_if_there(why);
            why.status
        }
    }
}

/// The status of a call without further details.
pub(crate) fn status_of(call: impl FnOnce() -> Result<Status, Error>) -> Status {
    match call() {
        Ok(status) => status,
        Err(why) => why.status,
    }
}

impl From<GeometryError> for Error {
    fn from(error: GeometryError) -> Self {
        match error {
            GeometryError::NonFinite(parameter) => {
                Self::from(status::GEOMETRY_NOT_FINITE).of_parameter(parameter)
            }
            GeometryError::NotPositive(parameter) => {
                Self::from(status::GEOMETRY_NOT_POSITIVE).of_parameter(parameter)
            }
            GeometryError::TiltTooLarge => {
                Self::from(status::GEOMETRY_TILT).of_parameter(Parameter::Alpha)
            }
            GeometryError::AzimuthTooLarge => {
                Self::from(status::GEOMETRY_AZIMUTH).of_parameter(Parameter::Theta)
            }
            GeometryError::RadiusInvalid => status::GEOMETRY_RADIUS.into(),
            GeometryError::NoCommonUp => status::GEOMETRY_NO_COMMON_UP.into(),
            GeometryError::TransmissionTooLarge => status::GEOMETRY_TRANSMISSION.into(),
            _ => status::OTHER.into(),
        }
    }
}

impl From<KinematicsError> for Error {
    fn from(error: KinematicsError) -> Self {
        Self::from(match error {
            KinematicsError::Unreachable(_) => status::UNREACHABLE,
            KinematicsError::Singular(_, Singularity::Serial) => status::SINGULAR_SERIAL,
            KinematicsError::Singular(_, Singularity::Parallel) => status::SINGULAR_PARALLEL,
            KinematicsError::NonFinite(_) => status::POSE_NOT_FINITE,
            _ => status::OTHER,
        })
        .of_arm(error.arm())
    }
}

impl From<SampleError> for Error {
    fn from(error: SampleError) -> Self {
        match error {
            SampleError::PositionNonFinite => status::SAMPLE_POSITION_NOT_FINITE.into(),
            SampleError::PositionTooFar(arm) => {
                Self::from(status::SAMPLE_POSITION_TOO_FAR).of_arm(arm)
            }
            SampleError::JointNonFinite(arm) => {
                Self::from(status::SAMPLE_JOINT_NOT_FINITE).of_arm(arm)
            }
            SampleError::JointTooLarge(arm) => {
                Self::from(status::SAMPLE_JOINT_TOO_LARGE).of_arm(arm)
            }
            _ => status::OTHER.into(),
        }
    }
}

impl From<AddError> for Error {
    fn from(error: AddError) -> Self {
        match error {
            AddError::Sample(error) => error.into(),
            AddError::Busy => status::BUSY.into(),
        }
    }
}

impl From<MergeError> for Error {
    fn from(error: MergeError) -> Self {
        Self::from(match error {
            MergeError::DifferentNominal => status::DIFFERENT_NOMINAL,
            MergeError::Busy => status::BUSY,
            _ => status::OTHER,
        })
    }
}

impl From<ForgettingError> for Error {
    fn from(_: ForgettingError) -> Self {
        status::FORGETTING.into()
    }
}

impl From<NoiseError> for Error {
    fn from(error: NoiseError) -> Self {
        Self::from(match error {
            NoiseError::Position => status::NOISE_OF_POSITION,
            NoiseError::Joint => status::NOISE_OF_JOINT,
            NoiseError::Height => status::NOISE_OF_HEIGHT,
            NoiseError::Distance => status::NOISE_OF_DISTANCE,
            _ => status::OTHER,
        })
    }
}

impl From<ToleranceError> for Error {
    fn from(error: ToleranceError) -> Self {
        Self::from(match error {
            ToleranceError::Length => status::TOLERANCE_OF_LENGTH,
            ToleranceError::Angle => status::TOLERANCE_OF_ANGLE,
            ToleranceError::JointZero => status::TOLERANCE_OF_JOINT_ZERO,
            _ => status::OTHER,
        })
    }
}

impl From<GateError> for Error {
    fn from(_: GateError) -> Self {
        status::WIDTH_OF_GATE.into()
    }
}

impl From<SnapshotError> for Error {
    fn from(error: SnapshotError) -> Self {
        Self::from(match error {
            SnapshotError::BufferTooShort => status::SNAPSHOT_BUFFER,
            SnapshotError::Damaged => status::SNAPSHOT_DAMAGED,
            SnapshotError::OtherVersion { .. } => status::SNAPSHOT_OTHER_VERSION,
            SnapshotError::OtherKind => status::SNAPSHOT_OTHER_KIND,
            SnapshotError::OtherCalibration => status::SNAPSHOT_OTHER_CALIBRATION,
            SnapshotError::Busy => status::BUSY,
            _ => status::OTHER,
        })
    }
}

impl From<Untested> for Error {
    fn from(why: Untested) -> Self {
        Self::from(match why {
            Untested::NoEstimate => status::NO_ESTIMATE,
            Untested::NoNoise => status::NO_NOISE,
            _ => status::OTHER,
        })
    }
}

impl From<ObservationError> for Error {
    fn from(error: ObservationError) -> Self {
        Self::from(match error {
            ObservationError::Joints(error) => return error.into(),
            ObservationError::Nothing => status::OBSERVATION_EMPTY,
            ObservationError::NonFinite => status::OBSERVATION_NOT_FINITE,
            ObservationError::DistanceNotPositive => status::OBSERVATION_DISTANCE,
            ObservationError::NoSuchPlane(_) => status::NO_SUCH_PLANE,
            ObservationError::NoSuchPoint(_) => status::NO_SUCH_POINT,
            ObservationError::SamePlace => status::OBSERVATION_SAME_PLACE,
            ObservationError::Full => status::OBSERVATIONS_FULL,
            ObservationError::Busy => status::BUSY,
            _ => status::OTHER,
        })
    }
}

impl From<StreamRefusal> for Error {
    fn from(refusal: StreamRefusal) -> Self {
        match refusal {
            StreamRefusal::Calibration(refusal) => refusal.into(),
            StreamRefusal::Alarm(alarm) => Self {
                count: alarm.first(),
                ..Self::from(match alarm {
                    Alarm::RobotChanged { .. } => status::ROBOT_HAS_CHANGED,
                    _ => status::EARLY_SAMPLES,
                })
            },
            StreamRefusal::TooManyRejected { rejected, .. } => Self {
                count: rejected,
                ..Self::from(status::TOO_MANY_REJECTED)
            },
            _ => status::OTHER.into(),
        }
    }
}

impl From<Refusal> for Error {
    fn from(refusal: Refusal) -> Self {
        let own = Self::from(Status::from(refusal.code()));
        let error = match refusal {
            Refusal::TooFewSamples {
                samples, needed, ..
            } => Self {
                count: samples,
                needed,
                ..own
            },
            Refusal::Undetermined {
                parameter,
                condition: figure,
                ..
            }
            | Refusal::Uncertain {
                parameter,
                sigma: figure,
                ..
            }
            | Refusal::FarFromNominal {
                parameter,
                tolerances: figure,
                ..
            } => Self {
                figure,
                ..own.of_parameter(parameter)
            },
            Refusal::NotConverged { iterations, .. } => Self {
                count: u64::from(iterations),
                ..own
            },
            Refusal::ResidualContradictsNoise { ratio, .. } => Self {
                figure: ratio,
                ..own
            },
            Refusal::ImpossibleGeometry { error, .. } | Refusal::ImpossibleRobot(error) => {
                own.because(error)
            }
            Refusal::TooFewObservations {
                instrument,
                observations,
                needed,
            } => Self {
                count: observations,
                needed,
                ..own.of_instrument(instrument)
            },
            Refusal::UnusableInstrument(instrument)
            | Refusal::UndeterminedInstrument(instrument) => own.of_instrument(instrument),
            _ => own,
        };
        match refusal.arm() {
            Some(arm) => error.of_arm(arm),
            None => error,
        }
    }
}
