//! The messages.

use crate::geometry::Geometry;
use crate::wire::messages;
use delta_cal::calibration::{ArmOutcome, Start, Termination};
use delta_cal::robot::{GeometryError, Transmission};
use delta_cal::samples::SampleError;
use delta_cal::stream::{Forgetting, GateCounts, Selection};
use delta_cal::{ArmIndex, Noise, Real, Refusal, SettingError, Settings, Tolerance};

messages! {
    /// Requests of the driver, with numbers of type `T` (`f32` or `f64`, see [`Identity::scalar`]).
    #[derive(Debug, Clone, Copy, PartialEq)]
    #[non_exhaustive]
    pub enum Request<T> {
        /// Asks for the identity. Answer: [`Response::Identity`], which has no numbers of type `T`.
        0: Identify,
        /// Asks for a geometry. Answer: [`Response::Parameters`].
        1: Parameters(set: ParameterSet),
        /// Begins a calibration without samples; one in progress is discarded. If the session is already open with
        /// the same fields, nothing changes. Answer: [`Response::Taken`].
        2: Begin(begin: Begin<T>),
        /// Adds a sample. Answer: [`Response::Taken`].
        3: Sample(sample: SampleMessage<T>),
        /// Starts solving if `samples` is the number received. Answer: [`Response::Status`].
        4: Solve {
            /// The session.
            session: u32,
            /// Number of samples sent by the driver.
            samples: u32,
        },
        /// Asks for the status. Answer: [`Response::Status`].
        5: Status,
        /// Asks for the result of one arm. Answer: [`Response::Outcome`].
        6: Outcome {
            /// The session.
            session: u32,
            /// The arm.
            arm: ArmIndex,
        },
        /// Stores the result and switches the control loop to it. Parameters already in use are not stored again.
        /// Answer: [`Response::Parameters`].
        7: Apply {
            /// The session.
            session: u32,
            /// The [`fingerprint`](Geometry::fingerprint) of the result to apply.
            fingerprint: u32,
            /// The [generation](Parameters::generation) of the parameters to replace.
            from: u32,
        },
        /// Reverts to other parameters and stores that. Parameters already in use are not stored again. Answer:
        /// [`Response::Parameters`].
        8: Revert {
            /// The [generation](Parameters::generation) of the parameters to abandon.
            from: u32,
            /// The parameters to revert to.
            to: RevertTo,
        },
        /// Asks for the link statistics. Answer: [`Response::Counters`].
        9: Counters,
        /// Stores a geometry calibrated elsewhere and switches the control loop to it. A geometry already in use is
        /// not stored again. Answer: [`Response::Parameters`].
        10: Adopt {
            /// The [generation](Parameters::generation) of the parameters to replace.
            from: u32,
            /// The geometry.
            geometry: Geometry<T>,
        },
        /// Lets the joints approach the path again after a stop; nothing changes if they did not stop at that turn.
        /// Answer: [`Response::Status`], of the turn before.
        11: Resume {
            /// The turn of the [stop](ControlLoop::stopped).
            stopped: u32,
        },
    }

    /// One of the controller's geometries.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum ParameterSet {
        /// The geometry used by the control loop.
        0: Current,
        /// The nominal robot: calibrations are relative to it.
        1: Nominal,
    }

    /// Target of a [`Request::Revert`].
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum RevertTo {
        /// The parameters in use before the last [`Request::Apply`]; reverting twice has the same effect as once.
        0: Previous,
        /// The nominal robot.
        1: Nominal,
    }

    /// How the parameters are estimated.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Estimator {
        /// Each arm separately, [`Ikm`](delta_cal::calibration::Ikm).
        0: Arms,
        /// All 24 parameters together, [`Joint`](delta_cal::calibration::Joint).
        1: Joint,
    }

    /// Settings of a calibration.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Begin<T> {
        /// A number chosen by the driver; not 0.
        pub session: u32,
        /// Manufacturing tolerance (σ): millimetres, radians.
        pub tolerance: Option<(T, T)>,
        /// Tolerance (σ) of each rotary joint zero, radians, if larger than the tolerance of lengths implies. Requires
        /// `tolerance`.
        pub joint_zero: Option<T>,
        /// Noise (σ) of each coordinate and of a joint angle: millimetres, radians.
        pub noise: Option<([T; 3], T)>,
        /// Each arm separately, or all 24 parameters together.
        pub estimator: Estimator,
        /// Whether to test each sample against earlier ones and reject outliers.
        pub gate: bool,
        /// Weights older samples less: N, the mean age of the samples in the estimate; see
        /// [`Forgetting`](delta_cal::stream::Forgetting).
        pub forgetting: Option<T>,
    }

    /// One measurement.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct SampleMessage<T> {
        /// The session.
        pub session: u32,
        /// Index of the sample, from 0; each index is accepted once.
        pub index: u32,
        /// q₁, q₂, q₃ in radians.
        pub joints: [T; 3],
        /// Measured platform position, mm.
        pub position: [T; 3],
    }

    /// Responses of the controller.
    #[derive(Debug, Clone, Copy, PartialEq)]
    #[non_exhaustive]
    #[allow(clippy::large_enum_variant)] // no allocation
    pub enum Response<T> {
        /// The request changed nothing; the reason.
        0: Fault(fault: Fault),
        /// The controller's identity.
        1: Identity(identity: Identity),
        /// A geometry.
        2: Parameters(parameters: Parameters<T>),
        /// The session's samples are complete up to `next`.
        3: Taken {
            /// The session.
            session: u32,
            /// Index of the next expected sample: the number received, rejected ones included.
            next: u32,
        },
        /// The controller's status.
        4: Status(status: Status<T>),
        /// One arm's result.
        5: Outcome(report: ArmReport<T>),
        /// The link statistics.
        6: Counters(counters: Counters),
    }

    /// Why a request changed nothing.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Fault {
        /// The frame was damaged; the sequence number of the answer is
        /// [`UNKNOWN_SEQUENCE`](crate::UNKNOWN_SEQUENCE).
        0: Damaged,
        /// The frame has an unsupported protocol version.
        1: UnknownVersion {
            /// The supported version.
            spoken: u8,
        },
        /// The frame is intact but its content is not a request.
        2: UnknownRequest,
        /// No such session: it was never begun, another one was begun, or the controller restarted.
        3: NoSession,
        /// A sample or a `Solve` that skips samples.
        4: OutOfOrder {
            /// Index of the next expected sample.
            next: u32,
        },
        /// The sample is impossible.
        5: Sample(error: SampleError),
        /// The tolerance, noise or `forgetting` is invalid, or the session is 0.
        6: Settings,
        /// The controller is solving; samples must wait until it has finished.
        7: Busy,
        /// There is no outcome: not solved yet, or refused; see [`Phase`].
        8: NoOutcome,
        /// The fingerprint does not match the outcome, or the generation does not match the current parameters.
        9: OtherParameters {
            /// The fingerprint present on the controller.
            there: u32,
        },
        /// The parameters could not be stored and are therefore not used.
        10: Store,
        /// The numbers of an [`Request::Adopt`] do not describe a valid robot.
        11: Geometry(error: GeometryError),
        /// Not the controller's robot: an arm is not positive, or a work point is out of reach or moves by more
        /// than a twentieth of the nominal forearm.
        12: OtherRobot,
        /// The robot cannot reach the point that the platform is at.
        13: Unreachable,
        /// The store holds parameters of another firmware version or robot. Only a [`Request::Revert`] to the
        /// nominal robot replaces them.
        14: OtherStore,
        /// Too many changes in the last hour: each wears the flash.
        15: TooOften,
        /// A flash region does not fit: too small, or not two halves of whole pages.
        16: Region,
    }

    /// Identity of a controller.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub struct Identity {
        /// Firmware version: major, minor, patch.
        pub firmware: [u16; 3],
        /// The type `T` of every number in the other messages.
        pub scalar: Scalar,
        /// CPUID register of the core: implementer, variant, part, revision.
        pub processor: u32,
        /// Fingerprint of the nominal geometry.
        pub nominal: u32,
    }

    /// The number type of a controller.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Scalar {
        /// `f32`.
        0: Single,
        /// `f64`.
        1: Double,
    }

    /// A geometry and its origin.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters<T> {
        /// Its origin.
        pub origin: Origin,
        /// Number of changes of the current geometry, across restarts, modulo 2³²: parameters that come into use again
        /// get a new generation. In an answer about the nominal geometry it is that of the current one.
        pub generation: u32,
        /// The geometry.
        pub geometry: Geometry<T>,
    }

    /// Origin of the current geometry.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Origin {
        /// The nominal robot: nothing else was ever stored, or it was reverted to.
        0: Nominal,
        /// The nominal robot, because the stored data is damaged.
        1: NominalStoreDamaged,
        /// A calibration.
        2: Calibration,
        /// A calibration, but part of the store is damaged or was interrupted while being written: it may be the
        /// one before the last.
        3: CalibrationStoreDamaged,
        /// The nominal robot, because the stored parameters are those of another firmware version or robot.
        4: NominalStoreOther,
    }

    /// Status of the controller.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Status<T> {
        /// The open session, 0 if none.
        pub session: u32,
        /// Progress of the calibration.
        pub phase: Phase,
        /// Counts of the gate, if the session has one.
        pub gate: Option<GateStatus>,
        /// Status of the control loop.
        pub control: ControlLoop<T>,
    }

    /// Counts of the gate that rejects outliers.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct GateStatus {
        /// Samples accepted, untested ones included.
        pub taken: u64,
        /// Accepted samples that could not be tested.
        pub untested: u64,
        /// Rejected samples.
        pub rejected: u64,
        /// Cause of the first run of eight rejected samples, if any.
        pub alarm: Option<Refusal>,
    }

    /// Progress of a calibration.
    #[derive(Debug, Clone, Copy, PartialEq)]
    #[non_exhaustive]
    pub enum Phase {
        /// No session.
        0: Idle,
        /// Samples are being collected.
        1: Collecting {
            /// Number received, rejected ones included.
            samples: u32,
        },
        /// The solver is running.
        2: Solving,
        /// An outcome exists.
        3: Solved {
            /// Number of samples received, rejected ones included.
            samples: u32,
            /// Its fingerprint.
            fingerprint: u32,
        },
        /// No outcome: the samples cannot calibrate this robot. More samples may be sent.
        4: CalibrationRefused {
            /// Number of samples received, rejected ones included.
            samples: u32,
            /// The reason.
            refusal: Refusal,
        },
    }

    /// What the joints do.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    #[non_exhaustive]
    pub enum Motion {
        /// They approach the last point.
        #[default]
        0: Approaching,
        /// They follow the path.
        1: Following,
        /// They stopped, because a point was out of reach.
        2: Unreachable,
        /// They stopped, because the path asked for more speed or acceleration than the drives have.
        3: TooFast,
    }

    /// Statistics of the control loop since the controller started.
    #[derive(Debug, Clone, Copy, PartialEq, Default)]
    pub struct ControlLoop<T> {
        /// Number of cycles.
        pub turns: u32,
        /// Duration of the longest cycle in timer ticks, see `ticks_a_second`.
        pub longest_ticks: u32,
        /// Duration of the longest cycle during a calibration, in timer ticks.
        pub longest_ticks_calibrating: u32,
        /// Timer resolution.
        pub ticks_a_second: u32,
        /// Cycles that began late or were skipped.
        pub late: u32,
        /// Number of stops, see [`Motion`].
        pub stops: u32,
        /// Number of switches to other parameters.
        pub switches: u32,
        /// Fingerprint of the parameters in use.
        pub fingerprint: u32,
        /// Cycles per second.
        pub turns_a_second: u32,
        /// The cycle of the last stop; 0 if there was none.
        pub stopped: u32,
        /// What the joints do.
        pub motion: Motion,
        /// The last point of the path, mm.
        pub point: [T; 3],
        /// The joint targets, radians; while following, those of that point.
        pub joints: [T; 3],
    }

    /// One arm's result; see [`delta_cal::calibration::ArmOutcome`].
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct ArmReport<T> {
        /// The arm.
        pub arm: ArmIndex,
        /// The eight parameters: mm and radians.
        pub parameters: [T; 8],
        /// The five numbers of its transmission, which is that of the nominal robot; `None` if it is exact.
        pub transmission: Option<[T; 5]>,
        /// Standard uncertainties: mm, radians. `None` if the noise is not stated and too few samples show it.
        pub sigma: Option<[T; 8]>,
        /// rms residual: in units of σ with a stated noise, otherwise in mm.
        pub residual_rms: T,
        /// Estimated noise along the forearm, mm.
        pub estimated_noise: Option<T>,
        /// Number of samples minus number of parameters.
        pub degrees_of_freedom: T,
        /// Number of samples.
        pub samples: u64,
        /// Number of linearisations.
        pub iterations: u16,
        /// Why the iteration stopped.
        pub termination: Termination,
        /// Starting point of the iteration.
        pub start: Start,
        /// Condition number of the problem.
        pub condition: T,
        /// Share of each parameter that comes from the tolerance.
        pub prior_share: [T; 8],
    }

    /// Link statistics since the controller started.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    pub struct Counters {
        /// Intact frames.
        pub received: u32,
        /// Frames with a wrong checksum or length.
        pub damaged: u32,
        /// Frames of an unknown protocol version.
        pub unknown_version: u32,
        /// Intact frames that are not requests.
        pub unknown_request: u32,
        /// Requests repeated with the previous sequence number.
        pub repeated: u32,
        /// Sequence numbers skipped.
        pub lost: u32,
        /// Valid requests answered with a fault.
        pub refused: u32,
        /// Bytes lost because they arrived faster than they were read.
        pub overrun: u32,
    }
}

impl GateStatus {
    /// The status from a gate's counts.
    pub const fn new(counts: &GateCounts, alarm: Option<Refusal>) -> Self {
        Self {
            taken: counts.taken,
            untested: counts.untested,
            rejected: counts.rejected,
            alarm,
        }
    }
}

impl<T: Real> ControlLoop<T> {
    /// Before the first cycle, with these parameters.
    pub fn new(fingerprint: u32) -> Self {
        Self {
            ticks_a_second: 1,
            fingerprint,
            ..Self::default()
        }
    }
}

impl<T: Real> Begin<T> {
    /// The settings and selection of the session's [`StreamCalibrator`](delta_cal::stream::StreamCalibrator), which
    /// is large and best constructed in place.
    ///
    /// # Errors
    /// [`Fault::Settings`] if they are invalid.
    pub fn calibrator(&self) -> Result<(Settings<T>, Selection<T>), Fault> {
        if self.session == 0 || self.joint_zero.is_some() && self.tolerance.is_none() {
            return Err(Fault::Settings);
        }
        let made = || {
            let tolerance = self.tolerance.map(|(length, angle)| {
                let own = Tolerance::new(length, angle)?;
                (self.joint_zero).map_or(Ok(own), |zero| own.with_joint_zero(zero))
            });
            let noise = self
                .noise
                .map(|(position, joint)| Noise::by_axis(position, joint));
            let settings = Settings::default().with_noise(noise.transpose()?);
            let gated = self.gate;
            let forgetting = self.forgetting.map(Forgetting::new).transpose()?;
            let selection = Selection { gated, forgetting };
            Ok((settings.with_tolerance(tolerance.transpose()?), selection))
        };
        made().map_err(|_: SettingError| Fault::Settings)
    }
}

impl<T: Real> ArmReport<T> {
    /// The report of one arm's outcome.
    pub fn new(arm: ArmIndex, outcome: &ArmOutcome<T>) -> Self {
        let [prior_share] = outcome.prior_share.data.0;
        let sigma = outcome.covariance.map(|covariance| {
            let [variances] = covariance.diagonal().data.0;
            variances.map(Real::square_root)
        });
        Self {
            arm,
            parameters: outcome.arm.parameters(),
            transmission: outcome.arm.transmission().map(Transmission::numbers),
            sigma,
            residual_rms: outcome.residual_rms,
            estimated_noise: outcome.estimated_noise,
            degrees_of_freedom: outcome.degrees_of_freedom,
            samples: outcome.samples,
            iterations: outcome.iterations,
            termination: outcome.termination,
            start: outcome.start,
            condition: outcome.condition,
            prior_share,
        }
    }
}
