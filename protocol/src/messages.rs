//! The messages.

use crate::geometry::Geometry;
use crate::wire::{fields, numbers};
use delta_cal::ArmIndex;
use delta_cal::calibration::{StartUsed, Termination};
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::stream::{Alarm, GateCounts, StreamRefusal};

/// What the driver asks, numbers of type `T` (`f32` or `f64`, see [`Identity::scalar`]).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Request<T> {
    /// Who are you? Answer: [`Response::Identity`], which has no numbers of type `T`.
    Identify,
    /// The geometry. Answer: [`Response::Parameters`].
    Parameters(ParameterSet),
    /// Begins a calibration without samples; one that is under way is dropped. If the session is open
    /// already with the same fields, nothing changes. Answer: [`Response::Taken`].
    Begin(Begin<T>),
    /// One measurement. Answer: [`Response::Taken`].
    Sample(SampleMessage<T>),
    /// Starts solving, if `samples` is the number of samples that have come. Answer: [`Response::Status`].
    Solve {
        /// The session.
        session: u32,
        /// How many samples the driver has sent.
        samples: u32,
    },
    /// What the controller is doing. Answer: [`Response::Status`].
    Status,
    /// One arm's result. Answer: [`Response::Outcome`].
    Outcome {
        /// The session.
        session: u32,
        /// Which arm.
        arm: ArmIndex,
    },
    /// Stores the result and switches the control loop to it. Parameters that are in use already are
    /// not stored again. Answer: [`Response::Parameters`].
    Apply {
        /// The session.
        session: u32,
        /// The [`fingerprint`](Geometry::fingerprint) of the result that is meant.
        fingerprint: u32,
        /// The [generation](Parameters::generation) of the parameters that it is to replace.
        from: u32,
    },
    /// Goes back to other parameters and stores that. Parameters that are in use already are not
    /// stored again. Answer: [`Response::Parameters`].
    Revert {
        /// The [generation](Parameters::generation) of the parameters that are no longer wanted.
        from: u32,
        /// Where to.
        to: RevertTo,
    },
    /// What went wrong on the link so far. Answer: [`Response::Counters`].
    Counters,
    /// Stores a geometry that was calibrated elsewhere and switches the control loop to it. One that is in use already
    /// is not stored again. Answer: [`Response::Parameters`].
    Adopt(Adopt<T>),
}

/// A geometry that was calibrated elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adopt<T> {
    /// The [generation](Parameters::generation) of the parameters that it is to replace.
    pub from: u32,
    /// The geometry.
    pub geometry: Geometry<T>,
}

/// Which of the controller's geometries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterSet {
    /// The one that the control loop uses.
    Current,
    /// The robot as drawn: what a calibration is expressed against.
    Nominal,
}

/// What a [`Request::Revert`] goes back to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RevertTo {
    /// What was in use before the last [`Request::Apply`]; going back twice is going back once.
    Previous,
    /// The robot as drawn.
    Nominal,
}

/// How the parameters are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// Each arm by itself, [`Ikm`](delta_cal::calibration::Ikm).
    Arms,
    /// All 24 parameters together, [`Joint`](delta_cal::calibration::Joint).
    Joint,
}

/// How a calibration begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Begin<T> {
    /// A number that the driver draws; not 0.
    pub session: u32,
    /// One σ of the manufacturing tolerance: millimetres, radians.
    pub tolerance: Option<(T, T)>,
    /// One σ of each rotary joint's zero, if it is uncertain by more than its tolerance of lengths says; radians. Needs a
    /// tolerance.
    pub joint_zero: Option<T>,
    /// One σ of each coordinate and of a joint angle in a measurement: millimetres, radians.
    pub noise: Option<([T; 3], T)>,
    /// Each arm by itself, or all 24 parameters together.
    pub estimator: Estimator,
    /// Test each sample against those before it, and leave out the ones that disagree.
    pub gate: bool,
    /// Older samples count less: N, the mean age of the samples in the estimate; see
    /// [`Forgetting`](delta_cal::stream::Forgetting).
    pub forgetting: Option<T>,
}

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleMessage<T> {
    /// The session.
    pub session: u32,
    /// Counted from 0; each sample is taken in once.
    pub index: u32,
    /// q₁, q₂, q₃ in radians.
    pub joints: [T; 3],
    /// Measured platform position, mm.
    pub position: [T; 3],
}

/// What the controller answers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
#[allow(clippy::large_enum_variant)] // no allocation
pub enum Response<T> {
    /// The request changed nothing, and why.
    Fault(Fault),
    /// Who answers.
    Identity(Identity),
    /// A geometry.
    Parameters(Parameters<T>),
    /// The session's samples are complete up to here.
    Taken {
        /// The session.
        session: u32,
        /// Index of the sample that is expected next: this many have come, rejected ones included.
        next: u32,
    },
    /// What the controller is doing.
    Status(Status<T>),
    /// One arm's result.
    Outcome(ArmReport<T>),
    /// What went wrong on the link so far.
    Counters(Counters),
}

/// Why a request changed nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// The frame was damaged on its way; the sequence number of the answer is
    /// [`UNKNOWN_SEQUENCE`](crate::UNKNOWN_SEQUENCE).
    Damaged,
    /// The frame is of a protocol version that is not spoken here.
    UnknownVersion {
        /// The version that is.
        spoken: u8,
    },
    /// The frame is whole, and its content not a request.
    UnknownRequest,
    /// There is no such session: it was never begun, another one was, or the controller restarted.
    NoSession,
    /// A sample, or a `Solve`, that leaves samples out.
    OutOfOrder {
        /// Index of the sample that is expected next.
        next: u32,
    },
    /// The sample is impossible.
    Sample(SampleError),
    /// The tolerance, the noise or `forgetting` is not valid, or the session is 0.
    Settings,
    /// The controller is solving: samples wait until it has finished.
    Busy,
    /// There is no outcome: not solved yet, or refused; [`Phase`] says which.
    NoOutcome,
    /// The fingerprint is not that of the outcome, or the generation not that of the current parameters.
    OtherParameters {
        /// The fingerprint of what is there.
        there: u32,
    },
    /// The parameters could not be stored, so they are not used either.
    Store,
    /// The numbers of an [`Adopt`] are not those of a robot.
    Geometry(GeometryError),
}

/// Who answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Major, minor, patch of the firmware.
    pub firmware: [u16; 3],
    /// The type `T` of every number in the other messages.
    pub scalar: Scalar,
    /// CPUID as read from the core: implementer, variant, part, revision.
    pub processor: u32,
    /// Fingerprint of the nominal geometry.
    pub nominal: u32,
}

/// The type in which a controller computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// `f32`.
    Single,
    /// `f64`.
    Double,
}

/// A geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<T> {
    /// Where it comes from.
    pub origin: Origin,
    /// Counts the changes of the current geometry, also over restarts, and around: the same parameters
    /// have another one when they come into use again. In an answer about the nominal geometry it is
    /// the current one's, too.
    pub generation: u32,
    /// Its numbers.
    pub geometry: Geometry<T>,
}

/// Where the current geometry comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Origin {
    /// The robot as drawn: nothing else was ever stored, or it was reverted to.
    Nominal,
    /// The robot as drawn, because what was stored is damaged or another robot's.
    NominalStoreDamaged,
    /// A calibration.
    Calibration,
    /// A calibration, and part of the store is damaged, or was cut off while it was written: it may be
    /// the one before the last.
    CalibrationStoreDamaged,
}

/// What the controller is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Status<T> {
    /// The open session, 0 without one.
    pub session: u32,
    /// How far it is.
    pub phase: Phase,
    /// What the gate has done, if the session has one.
    pub gate: Option<GateStatus>,
    /// The control loop.
    pub control: ControlLoop<T>,
}

/// What the gate has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GateStatus {
    /// Samples taken in, untested ones included.
    pub taken: u64,
    /// Of them, those that could not be tested.
    pub untested: u64,
    /// Samples rejected.
    pub rejected: u64,
    /// What the first run of eight rejected samples means, if there was one.
    pub alarm: Option<Alarm>,
}

impl GateStatus {
    /// Of a gate's counts.
    pub const fn new(counts: &GateCounts, alarm: Option<Alarm>) -> Self {
        Self {
            taken: counts.taken,
            untested: counts.untested,
            rejected: counts.rejected,
            alarm,
        }
    }
}

/// How far a calibration is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Phase {
    /// No session.
    Idle,
    /// Samples are taken in.
    Collecting {
        /// This many have come, rejected ones included.
        samples: u32,
    },
    /// The solver is at work.
    Solving,
    /// There is an outcome.
    Solved {
        /// This many samples had come, rejected ones included.
        samples: u32,
        /// Its fingerprint.
        fingerprint: u32,
    },
    /// There is no outcome: the samples cannot calibrate this robot. More samples may be sent.
    CalibrationRefused {
        /// This many samples had come, rejected ones included.
        samples: u32,
        /// Why.
        refusal: StreamRefusal,
    },
}

/// The control loop since the controller started.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlLoop<T> {
    /// Turns.
    pub turns: u32,
    /// Timer ticks of the longest turn, see `ticks_a_second`.
    pub longest_ticks: u32,
    /// Timer ticks of the longest turn while a calibration was at work.
    pub longest_ticks_calibrating: u32,
    /// Resolution of the two.
    pub ticks_a_second: u32,
    /// Turns that began late, or were left out.
    pub late: u32,
    /// Turns whose point could not be reached: the joints kept their targets.
    pub unreachable: u32,
    /// How often the loop switched to other parameters.
    pub switches: u32,
    /// Fingerprint of the parameters it uses.
    pub fingerprint: u32,
    /// The last point of the path, mm.
    pub point: [T; 3],
    /// The joint angles for it, radians.
    pub joints: [T; 3],
}

/// One arm's result; see [`delta_cal::calibration::ArmOutcome`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmReport<T> {
    /// Which arm.
    pub arm: ArmIndex,
    /// Its eight parameters: mm and radians.
    pub parameters: [T; 8],
    /// The five numbers of its transmission, which is the nominal robot's; `None` if it is exact.
    pub transmission: Option<[T; 5]>,
    /// Their standard uncertainties: mm and radians. `None` without a stated noise and too few samples to estimate it from.
    pub sigma: Option<[T; 8]>,
    /// rms of the residuals: σ with a stated noise, mm without.
    pub residual_rms: T,
    /// Estimated noise along the forearm, mm.
    pub estimated_noise: Option<T>,
    /// Samples less parameters.
    pub degrees_of_freedom: T,
    /// Samples.
    pub samples: u64,
    /// Linearisations.
    pub iterations: u16,
    /// Why the iteration stopped.
    pub termination: Termination,
    /// Where it had started.
    pub start: StartUsed,
    /// Condition number.
    pub condition: T,
    /// The share of each parameter that the tolerance decided.
    pub prior_share: [T; 8],
}

/// What the controller has received since it started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Whole frames.
    pub received: u32,
    /// Frames with a wrong checksum or length.
    pub damaged: u32,
    /// Frames of an unknown protocol version.
    pub unknown_version: u32,
    /// Whole frames that are no request.
    pub unknown_request: u32,
    /// Requests that came again with the sequence number of the one before.
    pub repeated: u32,
    /// Sequence numbers that were left out.
    pub lost: u32,
    /// Requests that were understood and answered with a fault.
    pub refused: u32,
    /// Bytes that came faster than they were read, and were lost.
    pub overrun: u32,
}

numbers!(Request<T> {
    0: Identify,
    1: Parameters(set),
    2: Begin(begin),
    3: Sample(sample),
    4: Solve { session, samples },
    5: Status,
    6: Outcome { session, arm },
    7: Apply { session, fingerprint, from },
    8: Revert { from, to },
    9: Counters,
    10: Adopt(adopt),
});

numbers!(Response<T> {
    0: Fault(fault),
    1: Identity(identity),
    2: Parameters(parameters),
    3: Taken { session, next },
    4: Status(status),
    5: Outcome(report),
    6: Counters(counters),
});

numbers!(Fault {
    0: Damaged,
    1: UnknownVersion { spoken },
    2: UnknownRequest,
    3: NoSession,
    4: OutOfOrder { next },
    5: Sample(error),
    6: Settings,
    7: Busy,
    8: NoOutcome,
    9: OtherParameters { there },
    10: Store,
    11: Geometry(error),
});

numbers!(ParameterSet {
    0: Current,
    1: Nominal,
});

numbers!(RevertTo {
    0: Previous,
    1: Nominal,
});

numbers!(Scalar {
    0: Single,
    1: Double,
});

numbers!(Origin {
    0: Nominal,
    1: NominalStoreDamaged,
    2: Calibration,
    3: CalibrationStoreDamaged,
});

numbers!(Phase {
    0: Idle,
    1: Collecting { samples },
    2: Solving,
    3: Solved {
        samples,
        fingerprint
    },
    4: CalibrationRefused { samples, refusal },
});

fields!(Adopt<T> { from, geometry });
numbers!(Estimator { 0: Arms, 1: Joint });
fields!(Begin<T> { session, tolerance, joint_zero, noise, estimator, gate, forgetting });
fields!(SampleMessage<T> { session, index, joints, position });
fields!(Identity {
    firmware,
    scalar,
    processor,
    nominal
});
fields!(Parameters<T> { origin, generation, geometry });
fields!(Status<T> { session, phase, gate, control });
fields!(GateStatus {
    taken,
    untested,
    rejected,
    alarm
});
fields!(ControlLoop<T> {
    turns, longest_ticks, longest_ticks_calibrating, ticks_a_second, late, unreachable, switches, fingerprint, point, joints,
});
fields!(ArmReport<T> {
    arm, parameters, transmission, sigma, residual_rms, estimated_noise, degrees_of_freedom, samples, iterations, termination,
    start, condition, prior_share,
});
fields!(Counters {
    received,
    damaged,
    unknown_version,
    unknown_request,
    repeated,
    lost,
    refused,
    overrun,
});
