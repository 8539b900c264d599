//! Why a call failed, with all details from the core.

use crate::memory::{Out, plain};
use crate::plain::{FRAME, NO_ARM, NO_PARAMETER, PLANE, POINT, TRANSMISSION};
use crate::status::{self, Status};
use delta_cal::calibration::Instrument;
use delta_cal::kinematics::KinematicsError;
use delta_cal::observations::ObservationError;
use delta_cal::robot::GeometryError;
use delta_cal::samples::{MergeError, SampleError};
use delta_cal::snapshot::SnapshotError;
use delta_cal::{ArmIndex, Busy, Parameter, Refusal, SettingError};

plain! {
    /// Why a call failed. Every function that takes a pointer to one accepts NULL.
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
}

impl From<Status> for Error {
    fn from(status: Status) -> Self {
        Self {
            status,
            arm: NO_ARM,
            parameter: NO_PARAMETER,
            ..Self::default()
        }
    }
}

/// The index of an arm in C.
#[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // 0, 1, 2
pub(crate) const fn number_of(arm: ArmIndex) -> i32 {
    arm.index() as i32
}

impl Error {
    fn arm(self, arm: ArmIndex) -> Self {
        Self {
            arm: number_of(arm),
            ..self
        }
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // 0 to 7
    fn parameter(self, parameter: Parameter) -> Self {
        Self {
            parameter: parameter.index() as i32,
            ..self
        }
    }

    fn of_instrument(self, instrument: Instrument) -> Self {
        let (instrument, index, own) = match instrument {
            Instrument::Frame => (FRAME, 0, self),
            Instrument::Plane(index) => (PLANE, index, self),
            Instrument::Point(index) => (POINT, index, self),
            Instrument::Transmission(arm) => (TRANSMISSION, 0, self.arm(arm)),
        };
        Self {
            instrument,
            index: u32::from(index),
            ..own
        }
    }
}

/// The status of a call; also writes the reason if the caller wants it.
pub(crate) fn report(mut error: Out<Error>, call: impl FnOnce() -> Result<(), Error>) -> Status {
    if let Err(status) = error.usable_or_null() {
        return status;
    }
    status_of(|| call().inspect_err(|why| error.put_if_there(*why)))
}

/// The status of a call without further details.
pub(crate) fn status_of(call: impl FnOnce() -> Result<(), Error>) -> Status {
    call().map_or_else(|why| why.status, |()| status::OK)
}

/// The status of a call whose errors are no more than that.
pub(crate) fn status_alone(result: Result<(), Status>) -> Status {
    result.err().unwrap_or(status::OK)
}

impl From<Busy> for Error {
    fn from(_: Busy) -> Self {
        status::BUSY.into()
    }
}

/// Errors that say no more than their status, and perhaps the arm or the parameter.
macro_rules! statuses {
    ($($error:ident {$(
        $variant:ident $(($inner:ident))? $({ $($any:tt)+ })? => $status:ident $(.$detail:ident($of:expr))?,
    )+})+) => {$(
        impl From<$error> for Error {
            fn from(error: $error) -> Self {
                match error {
                    $($error::$variant $(($inner))? $({ $($any)+ })? => {
                        Self::from(status::$status) $(.$detail($of))?
                    })+
                    _ => status::OTHER.into(),
                }
            }
        }
    )+};
}

statuses! {
    GeometryError {
        NonFinite(parameter) => GEOMETRY_NOT_FINITE.parameter(parameter),
        NotPositive(parameter) => GEOMETRY_NOT_POSITIVE.parameter(parameter),
        TiltTooLarge => GEOMETRY_TILT.parameter(Parameter::Alpha),
        AzimuthTooLarge => GEOMETRY_AZIMUTH.parameter(Parameter::Theta),
        RadiusInvalid => GEOMETRY_RADIUS,
        NoCommonUp => GEOMETRY_NO_COMMON_UP,
        TransmissionTooLarge => GEOMETRY_TRANSMISSION,
    }
    KinematicsError {
        Unreachable(arm) => UNREACHABLE.arm(arm),
        Serial(arm) => SINGULAR_SERIAL.arm(arm),
        Parallel(arm) => SINGULAR_PARALLEL.arm(arm),
        NonFinite(arm) => POSE_NOT_FINITE.arm(arm),
    }
    SampleError {
        PositionNonFinite => SAMPLE_POSITION_NOT_FINITE,
        PositionTooFar(arm) => SAMPLE_POSITION_TOO_FAR.arm(arm),
        JointNonFinite(arm) => SAMPLE_JOINT_NOT_FINITE.arm(arm),
        JointTooLarge(arm) => SAMPLE_JOINT_TOO_LARGE.arm(arm),
        Busy { .. } => BUSY,
    }
    MergeError {
        DifferentNominal => DIFFERENT_NOMINAL,
        Busy { .. } => BUSY,
    }
    SettingError {
        PositionNoise => NOISE_OF_POSITION,
        JointNoise => NOISE_OF_JOINT,
        HeightNoise => NOISE_OF_HEIGHT,
        DistanceNoise => NOISE_OF_DISTANCE,
        LengthTolerance => TOLERANCE_OF_LENGTH,
        AngleTolerance => TOLERANCE_OF_ANGLE,
        JointZeroTolerance => TOLERANCE_OF_JOINT_ZERO,
        AgeTooShort => FORGETTING,
        AgeTooLong => FORGETTING,
        GateWidth => WIDTH_OF_GATE,
    }
    SnapshotError {
        BufferTooShort => SNAPSHOT_BUFFER,
        Damaged => SNAPSHOT_DAMAGED,
        OtherVersion { .. } => SNAPSHOT_OTHER_VERSION,
        OtherKind => SNAPSHOT_OTHER_KIND,
        OtherCalibration => SNAPSHOT_OTHER_CALIBRATION,
        Busy { .. } => BUSY,
    }
}

impl From<ObservationError> for Error {
    fn from(error: ObservationError) -> Self {
        Self::from(match error {
            ObservationError::Joints(error) => return error.into(),
            ObservationError::Nothing => status::OBSERVATION_EMPTY,
            ObservationError::NonFinite | ObservationError::TooFar => {
                status::OBSERVATION_NOT_FINITE
            }
            ObservationError::DistanceNotPositive => status::OBSERVATION_DISTANCE,
            ObservationError::NoSuchPlane(_) => status::NO_SUCH_PLANE,
            ObservationError::NoSuchPoint(_) => status::NO_SUCH_POINT,
            ObservationError::Unreached => status::OBSERVATION_UNREACHED,
            ObservationError::SamePlace => status::OBSERVATION_SAME_PLACE,
            ObservationError::Full => status::OBSERVATIONS_FULL,
            ObservationError::Busy(_) => status::BUSY,
            _ => status::OTHER,
        })
    }
}

impl From<Refusal> for Error {
    fn from(refusal: Refusal) -> Self {
        let mut error = Self::from(Status::from(refusal.code()));
        match refusal {
            Refusal::TooFewSamples {
                samples, needed, ..
            } => (error.count, error.needed) = (samples, needed),
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
            } => {
                error = error.parameter(parameter);
                error.figure = figure;
            }
            Refusal::NotConverged { iterations, .. } => error.count = iterations.into(),
            Refusal::RobotChanged { first: count }
            | Refusal::EarlySamplesWrong { first: count }
            | Refusal::TooManyRejected {
                rejected: count, ..
            } => error.count = count,
            Refusal::ResidualContradictsNoise { ratio, .. } => error.figure = ratio,
            Refusal::ImpossibleGeometry { error: cause, .. } | Refusal::ImpossibleRobot(cause) => {
                let cause = Self::from(cause);
                (error.cause, error.parameter) = (cause.status, cause.parameter);
            }
            Refusal::TooFewObservations {
                instrument,
                observations,
                needed,
            } => {
                error = error.of_instrument(instrument);
                (error.count, error.needed) = (observations, needed);
            }
            Refusal::UnusableInstrument(instrument)
            | Refusal::UndeterminedInstrument(instrument) => {
                error = error.of_instrument(instrument);
            }
            _ => {}
        }
        match refusal.arm() {
            Some(arm) => error.arm(arm),
            None => error,
        }
    }
}
