//! What an object can be, and how much memory it is given in C.
//!
//! The sizes are the same on every target, so that they can stand in the header; each leaves room for targets that
//! align differently. Assertions hold the Rust types to them wherever the library is built.

use crate::observed::Observed;
use delta_cal::calibration::{JointCalibrator, JointOutcome, JointSolver};
use delta_cal::observations::ObservationRow;
use delta_cal::stream::Gate;
use delta_cal::{Calibrator, Robot, RobotOutcome, RobotSolver};

/// Every object's alignment in C. Bytes.
pub const ALIGNMENT: usize = 8;

/// The bytes of an observation in the workspace, in single precision.
pub const OBSERVATION_ROW_F32: usize = 192;
/// The bytes of an observation in the workspace, in double precision.
pub const OBSERVATION_ROW_F64: usize = 368;

const _: () = assert!(size_of::<ObservationRow<f32>>() <= OBSERVATION_ROW_F32);
const _: () = assert!(size_of::<ObservationRow<f64>>() <= OBSERVATION_ROW_F64);
const _: () = assert!(align_of::<ObservationRow<f64>>() <= ALIGNMENT);

/// "DCAL".
const MAGIC: u32 = 0x4c41_4344;
/// What the number of a kind begins with, in single and in double precision.
const SINGLE: i32 = 0x400;
const DOUBLE: i32 = 0x800;

/// What stands in front of every object.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tag {
    magic: u32,
    number: i32,
}

impl Tag {
    pub(crate) const fn of<K: Kind>() -> Self {
        Self {
            magic: MAGIC,
            number: K::NUMBER,
        }
    }

    pub(crate) const fn is_known(self) -> bool {
        self.magic == MAGIC && size_of_kind(self.number) > 0
    }
}

/// An object in memory of the caller.
#[repr(C, align(8))]
#[derive(Debug, Clone, Copy)]
pub struct Stored<K> {
    pub(crate) tag: Tag,
    pub(crate) value: K,
}

/// What an object can be.
pub trait Kind: Copy {
    /// What the tag holds; never changes.
    const NUMBER: i32;
    /// The size in C. Bytes.
    const SIZE: usize;
}

/// A kind for whoever makes the header.
#[derive(Debug, Clone, Copy)]
pub struct Described {
    /// The name in Rust.
    pub name: &'static str,
    /// The name in C, without the library's and the scalar's.
    pub in_c: &'static str,
    /// What it is.
    pub about: &'static str,
    /// In single and in double precision: number, size in C, and the size that it takes on this target.
    pub scalars: [(i32, usize, usize); 2],
}

macro_rules! kinds {
    ($($name:ident $in_c:literal = $number:literal, $single:literal, $double:literal, $about:literal;)+) => {
        $(
            impl Kind for $name<f32> {
                const NUMBER: i32 = SINGLE + $number;
                const SIZE: usize = $single;
            }
            impl Kind for $name<f64> {
                const NUMBER: i32 = DOUBLE + $number;
                const SIZE: usize = $double;
            }
            const _: () = fits::<$name<f32>>();
            const _: () = fits::<$name<f64>>();
        )+

        /// Every kind.
        pub const ALL: &[Described] = &[$(Described {
            name: stringify!($name),
            in_c: $in_c,
            about: $about,
            scalars: [
                (SINGLE + $number, $single, size_of::<Stored<$name<f32>>>()),
                (DOUBLE + $number, $double, size_of::<Stored<$name<f64>>>()),
            ],
        }),+];
    };
}

kinds! {
    Robot "robot" = 1, 384, 752, "A robot: three arms of eight parameters.";
    Calibrator "calibrator" = 2, 2048, 3968, "The per-arm calibrator: three arms' samples, each arm by itself.";
    RobotSolver "solver" = 3, 2560, 4992, "The solver of the per-arm calibrator.";
    RobotOutcome "outcome" = 4, 1728, 3392, "A calibrated robot with the covariance of each arm.";
    JointCalibrator "joint_calibrator" = 5, 4160, 8256, "The joint calibrator: all 24 parameters together.";
    JointSolver "joint_solver" = 6, 7168, 14208, "The solver of the joint calibrator.";
    JointOutcome "joint_outcome" = 7, 2944, 5824, "A calibrated robot with the covariance of all 24 parameters.";
    Gate "gate" = 8, 1280, 2368, "The gate: tests each sample before the per-arm calibrator takes it in.";
    Observed "observation_outcome" = 9, 6400, 12672, "A robot calibrated from observations, and where the instruments are.";
}

/// The bytes of a snapshot, in single and in double precision: of what, and how many.
pub const SNAPSHOTS: [(&str, [usize; 2]); 3] = [
    (
        "calibrator",
        [
            Calibrator::<f32>::SNAPSHOT_BYTES,
            Calibrator::<f64>::SNAPSHOT_BYTES,
        ],
    ),
    (
        "joint_calibrator",
        [
            JointCalibrator::<f32>::SNAPSHOT_BYTES,
            JointCalibrator::<f64>::SNAPSHOT_BYTES,
        ],
    ),
    (
        "gate",
        [Gate::<f32>::SNAPSHOT_BYTES, Gate::<f64>::SNAPSHOT_BYTES],
    ),
];

/// Fails to compile where an object does not fit its memory in C.
const fn fits<K: Kind>() {
    assert!(size_of::<Stored<K>>() <= K::SIZE);
    assert!(align_of::<Stored<K>>() == ALIGNMENT);
    assert!(K::SIZE.is_multiple_of(ALIGNMENT));
}

/// The bytes that an object of this kind takes on this target; 0 if there is no such kind.
pub const fn size_of_kind(number: i32) -> usize {
    let mut kinds = ALL;
    while let [kind, rest @ ..] = kinds {
        let [single, double] = kind.scalars;
        if number == single.0 {
            return single.2;
        }
        if number == double.0 {
            return double.2;
        }
        kinds = rest;
    }
    0
}
