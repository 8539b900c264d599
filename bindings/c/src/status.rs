//! Status codes. The numbers never change; `tests/it/errors.rs` checks those of refusals.

/// The result of a call: `DCAL_OK`, `DCAL_WORKING`, or why nothing was done.
pub type Status = i32;

macro_rules! statuses {
    ($($(#[doc = $text:literal])+ $name:ident = $number:literal,)+) => {
        $($(#[doc = $text])+ pub const $name: Status = $number;)+

        /// The text of a status, zero-terminated.
        pub const fn text(status: Status) -> &'static core::ffi::CStr {
            match status {
                $($number => {
                    match core::ffi::CStr::from_bytes_with_nul(concat!($($text),+, "\0").as_bytes()) {
                        Ok(text) => text,
                        Err(_) => c"",
                    }
                })+
                _ => c" There is no status of this number.",
            }
        }

        /// Every status: its name and its number.
        pub const ALL: &[(&str, Status)] = &[$((stringify!($name), $number)),+];
    };
}

statuses! {
    /// The call succeeded.
    OK = 0,
    /// The solver has more steps to run.
    WORKING = 1,

    /// A pointer is NULL.
    NULL_POINTER = 10,
    /// A pointer is not aligned as its type requires.
    MISALIGNED = 11,
    /// The stated size is smaller than the object.
    WRONG_SIZE = 12,
    /// The memory holds no object of this version of the library: it was never initialised, or it was overwritten.
    NOT_INITIALIZED = 13,
    /// The memory holds an object of another kind.
    WRONG_KIND = 14,
    /// Two objects overlap.
    OVERLAP = 15,
    /// There is no arm with this index: the arms are 0, 1 and 2.
    NO_SUCH_ARM = 16,
    /// A choice is not one of the constants in the header.
    NO_SUCH_CHOICE = 17,
    /// The calibrator is solving: step it to the end, or stop it, before its samples change.
    BUSY = 18,

    /// The noise of positions must be greater than 0, and not too large to be squared.
    NOISE_OF_POSITION = 20,
    /// The noise of joint angles must be 0 or greater, and not too large to be squared.
    NOISE_OF_JOINT = 21,
    /// The noise of heights must be greater than 0, and not too small or large to be squared.
    NOISE_OF_HEIGHT = 22,
    /// The noise of distances must be greater than 0, and not too small or large to be squared.
    NOISE_OF_DISTANCE = 23,
    /// The tolerance of lengths must be greater than 0, and not too small or large to be squared.
    TOLERANCE_OF_LENGTH = 24,
    /// The tolerance of angles must be greater than 0, and not too small or large to be squared.
    TOLERANCE_OF_ANGLE = 25,
    /// The width of the gate must be a finite number greater than 0.
    WIDTH_OF_GATE = 26,
    /// The forgetting factor must lie between 0 and 1; the mean age of samples must be a finite number greater than 0.
    FORGETTING = 27,
    /// The known position of an instrument must be finite, and its sigma must not be negative.
    KNOWN_PLACE = 28,
    /// The tolerance of the joints' zeros must be greater than 0, and not too small or large to be squared.
    TOLERANCE_OF_JOINT_ZERO = 29,

    /// A parameter of the geometry is not a finite number.
    GEOMETRY_NOT_FINITE = 30,
    /// The length of an upper arm or forearm is not greater than 0.
    GEOMETRY_NOT_POSITIVE = 31,
    /// The tilt alpha must lie within 90 degrees.
    GEOMETRY_TILT = 32,
    /// The azimuth theta must lie within 360 degrees.
    GEOMETRY_AZIMUTH = 33,
    /// The radius of the base or platform is negative.
    GEOMETRY_RADIUS = 34,
    /// The arms have no common upward direction.
    GEOMETRY_NO_COMMON_UP = 35,
    /// A transmission is too far from exact: gain and harmonics together must be below 0.1.
    GEOMETRY_TRANSMISSION = 36,

    /// The forearms do not meet at these joint angles, or an arm does not reach the position.
    UNREACHABLE = 40,
    /// An upper arm and its forearm are in line: the edge of the workspace.
    SINGULAR_SERIAL = 41,
    /// The three forearms lie in one plane: the joints do not hold the platform.
    SINGULAR_PARALLEL = 42,
    /// A joint angle or coordinate is not finite.
    POSE_NOT_FINITE = 43,

    /// The position of the sample is not finite.
    SAMPLE_POSITION_NOT_FINITE = 50,
    /// The position of the sample is thousands of forearms away from the robot.
    SAMPLE_POSITION_TOO_FAR = 51,
    /// A joint angle of the sample is not finite.
    SAMPLE_JOINT_NOT_FINITE = 52,
    /// A joint angle of the sample is beyond two turns; joint angles are in radians.
    SAMPLE_JOINT_TOO_LARGE = 53,
    /// The two calibrators have different robots or noises.
    DIFFERENT_NOMINAL = 54,

    /// The observation has no reading.
    OBSERVATION_EMPTY = 60,
    /// A reading of the observation is not finite, or is thousands of forearms.
    OBSERVATION_NOT_FINITE = 61,
    /// A distance is not greater than 0.
    OBSERVATION_DISTANCE = 62,
    /// There is no plane with this index.
    NO_SUCH_PLANE = 63,
    /// There is no point with this index.
    NO_SUCH_POINT = 64,
    /// The nominal robot is at the same position in both poses of a distance.
    OBSERVATION_SAME_PLACE = 65,
    /// The instruments have more unknowns than there is room for, or more than four planes or points.
    TOO_MANY_UNKNOWNS = 66,
    /// There is no room for another observation.
    OBSERVATIONS_FULL = 67,
    /// The nominal robot does not reach the joint angles of the observation.
    OBSERVATION_UNREACHED = 68,

    /// There are fewer samples than needed.
    TOO_FEW_SAMPLES = 70,
    /// The poses do not determine the parameters.
    UNDETERMINED = 71,
    /// The noise leaves a parameter undetermined.
    UNCERTAIN = 72,
    /// The iteration did not converge within its limit.
    NOT_CONVERGED = 73,
    /// The residuals are larger than the stated noise, or without one the tolerance, allows.
    RESIDUAL_CONTRADICTS_NOISE = 74,
    /// A parameter is farther from nominal than the tolerance allows.
    FAR_FROM_NOMINAL = 75,
    /// The solution is not a valid arm.
    IMPOSSIBLE_GEOMETRY = 76,
    /// The three arms of the solution do not form a robot.
    IMPOSSIBLE_ROBOT = 77,
    /// The platform was measured above its elbows: the measuring frame is upside down or left-handed.
    WRONG_SIDE = 78,
    /// An instrument has fewer readings than unknowns.
    TOO_FEW_OBSERVATIONS = 79,
    /// The poses do not determine the position of an instrument.
    UNDETERMINED_INSTRUMENT = 80,
    /// The arithmetic overflowed.
    OVERFLOW = 81,
    /// The result was requested before the last step.
    UNFINISHED = 82,
    /// There is no covariance: the noise is not stated, and there are too few redundant samples to estimate it.
    NO_COVARIANCE = 83,

    /// The sample was not tested: there is no estimate yet.
    NO_ESTIMATE = 90,
    /// The sample was not tested: the noise is neither stated nor estimated.
    NO_NOISE = 91,
    /// The gate rejected a run of samples: the robot or its measuring frame has changed.
    ROBOT_HAS_CHANGED = 92,
    /// The gate rejected a run of samples, after too few earlier ones to decide which are right.
    EARLY_SAMPLES = 93,
    /// The gate rejected too many samples to tell which are wrong.
    TOO_MANY_REJECTED = 94,

    /// The memory for the snapshot is shorter than the header states.
    SNAPSHOT_BUFFER = 100,
    /// The bytes are not a complete snapshot: truncated, damaged, or never written.
    SNAPSHOT_DAMAGED = 101,
    /// The snapshot is of another version of the library.
    SNAPSHOT_OTHER_VERSION = 102,
    /// The snapshot is of another kind of object, or in the other precision.
    SNAPSHOT_OTHER_KIND = 103,
    /// The snapshot is of another robot or other settings, or of a calibrator in another state.
    SNAPSHOT_OTHER_CALIBRATION = 104,

    /// A refusal that has no number in this version of the library.
    OTHER = 127,
}
