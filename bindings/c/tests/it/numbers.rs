//! The numbers that C programs are compiled with: they never change.

use delta_cal_c::{kind, status};

/// A number that is taken out stays here, so that it is not used again.
const STATUSES: &str = "
    OK 0, WORKING 1,
    NULL_POINTER 10, MISALIGNED 11, WRONG_SIZE 12, NOT_INITIALIZED 13, WRONG_KIND 14, OVERLAP 15, NO_SUCH_ARM 16,
    NO_SUCH_CHOICE 17, BUSY 18,
    NOISE_OF_POSITION 20, NOISE_OF_JOINT 21, NOISE_OF_HEIGHT 22, NOISE_OF_DISTANCE 23, TOLERANCE_OF_LENGTH 24,
    TOLERANCE_OF_ANGLE 25, WIDTH_OF_GATE 26, FORGETTING 27, KNOWN_PLACE 28, TOLERANCE_OF_JOINT_ZERO 29,
    GEOMETRY_NOT_FINITE 30, GEOMETRY_NOT_POSITIVE 31, GEOMETRY_TILT 32, GEOMETRY_AZIMUTH 33, GEOMETRY_RADIUS 34,
    GEOMETRY_NO_COMMON_UP 35, GEOMETRY_TRANSMISSION 36,
    UNREACHABLE 40, SINGULAR_SERIAL 41, SINGULAR_PARALLEL 42, POSE_NOT_FINITE 43,
    SAMPLE_POSITION_NOT_FINITE 50, SAMPLE_POSITION_TOO_FAR 51, SAMPLE_JOINT_NOT_FINITE 52, SAMPLE_JOINT_TOO_LARGE 53,
    DIFFERENT_NOMINAL 54,
    OBSERVATION_EMPTY 60, OBSERVATION_NOT_FINITE 61, OBSERVATION_DISTANCE 62, NO_SUCH_PLANE 63, NO_SUCH_POINT 64,
    OBSERVATION_SAME_PLACE 65, TOO_MANY_UNKNOWNS 66, OBSERVATIONS_FULL 67,
    TOO_FEW_SAMPLES 70, UNDETERMINED 71, UNCERTAIN 72, NOT_CONVERGED 73, RESIDUAL_CONTRADICTS_NOISE 74,
    FAR_FROM_NOMINAL 75, IMPOSSIBLE_GEOMETRY 76, IMPOSSIBLE_ROBOT 77, WRONG_SIDE 78, TOO_FEW_OBSERVATIONS 79,
    UNDETERMINED_INSTRUMENT 80, OVERFLOW 81, UNFINISHED 82, NO_COVARIANCE 83,
    NO_ESTIMATE 90, NO_NOISE 91, ROBOT_HAS_CHANGED 92, EARLY_SAMPLES 93, TOO_MANY_REJECTED 94,
    SNAPSHOT_BUFFER 100, SNAPSHOT_DAMAGED 101, SNAPSHOT_OTHER_VERSION 102,
    SNAPSHOT_OTHER_KIND 103, SNAPSHOT_OTHER_CALIBRATION 104,
    OTHER 127";

/// Kinds in single and in double precision.
const KINDS: &str = "
    robot 1025 2049, ikm 1026 2050, ikm_outcome 1028 2052, joint 1029 2053, joint_outcome 1031 2055, gate 1032 2056,
    fkm 1033 2057, fkm_outcome 1034 2058";

fn list(text: &str) -> Vec<String> {
    text.split(',').map(|part| part.trim().to_owned()).collect()
}

#[test]
fn a_status_keeps_its_number() {
    let found: Vec<String> = status::ALL
        .iter()
        .map(|(name, number)| format!("{name} {number}"))
        .collect();
    assert_eq!(found, list(STATUSES));
}

#[test]
fn a_kind_keeps_its_number() {
    let found: Vec<String> = kind::ALL
        .iter()
        .map(|kind| format!("{} {} {}", kind.in_c, kind.scalars[0].0, kind.scalars[1].0))
        .collect();
    assert_eq!(found, list(KINDS));
}

/// Also a number that is no status.
#[test]
fn every_status_has_a_sentence() {
    let numbers = status::ALL.iter().map(|(_, number)| *number);
    for number in numbers.chain([-1, 9999]) {
        let text = delta_cal_c::library::status_text(number);
        let text = unsafe { core::ffi::CStr::from_ptr(text) }.to_str().unwrap();
        assert!(text.ends_with('.') && text.len() > 10, "{number}: {text}");
        assert!(!text.starts_with(' '), "{number}: {text}");
    }
}
