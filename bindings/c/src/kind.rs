//! Kinds of objects, and their sizes in C.
//!
//! The sizes are the same on every target, so that the header can state them; each leaves room for targets with
//! different alignment. Assertions check the Rust types against them whenever the library is built.
#![allow(unsafe_code)] // guarantees about kinds

use crate::plain::{FKM_ROWS, UNKNOWNS};
use delta_cal::Robot;
use delta_cal::calibration::{Ikm as EachArm, IkmCalibrator, Joint as AllArms, JointCalibrator};
use delta_cal::observations::FkmCalibrator;
use delta_cal::stream::StreamCalibrator;

/// The version of this library: major, minor and patch, one byte each, like `DCAL_VERSION`.
pub const VERSION: u32 = number(env!("CARGO_PKG_VERSION_MAJOR")) << 16
    | number(env!("CARGO_PKG_VERSION_MINOR")) << 8
    | number(env!("CARGO_PKG_VERSION_PATCH"));

const fn number(text: &str) -> u32 {
    match u32::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => u8::MAX as u32,
    }
}

/// The alignment of every object in C. Bytes.
pub const ALIGNMENT: usize = 8;

/// "DCAL".
const MAGIC: u32 = 0x4c41_4344;
/// Base of a kind's number, in single and in double precision.
const SINGLE: i32 = 0x400;
const DOUBLE: i32 = 0x800;

/// The tag in front of every object. Memory that survives a firmware update holds no valid object for the new firmware:
/// the tag includes version and size.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tag {
    of_version: u32,
    number: u16,
    size: u16,
}

impl Tag {
    pub(crate) const fn of<K: Kind>() -> Self {
        Self::new(K::NUMBER, size_of::<Stored<K>>())
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // `fits` holds sizes and numbers to it
    const fn new(number: i32, size: usize) -> Self {
        Self {
            of_version: MAGIC ^ VERSION,
            number: number as u16,
            size: size as u16,
        }
    }

    pub(crate) fn is_known(self) -> bool {
        let number = i32::from(self.number);
        let size = size_of_kind(number);
        size > 0 && self == Self::new(number, size)
    }
}

/// An object in the caller's memory.
#[repr(C, align(8))]
#[derive(Debug, Clone, Copy)]
pub struct Stored<K> {
    pub(crate) tag: Tag,
    pub(crate) value: K,
}

/// The per-arm calibrator.
pub type Ikm<T> = IkmCalibrator<T>;
/// The joint calibrator.
pub type Joint<T> = JointCalibrator<T>;
/// The per-arm calibrator behind a gate.
pub type Gate<T> = StreamCalibrator<T, EachArm>;
/// The joint calibrator behind a gate.
pub type JointGate<T> = StreamCalibrator<T, AllArms>;
/// The calibrator from any readings, with all its parameters.
pub type Fkm<T> = FkmCalibrator<T, FKM_ROWS, PARAMETERS>;

const PARAMETERS: usize = 24 + UNKNOWNS;

/// A kind of object.
///
/// # Safety
/// Its number is unique: the tag alone identifies the contents of the memory.
pub unsafe trait Kind {
    /// The number in the tag; it never changes.
    const NUMBER: i32;
    /// The size in C. Bytes.
    const SIZE: usize;
}

/// A description of a kind, for generating the header.
#[derive(Debug, Clone, Copy)]
pub struct Described {
    /// The name in Rust.
    pub name: &'static str,
    /// Its documentation.
    pub about: &'static str,
    /// In single and in double precision: number, size in C, and actual size on this target.
    pub scalars: [(i32, usize, usize); 2],
}

macro_rules! kinds {
    ($($name:ident = $number:literal, $single:literal, $double:literal, $about:literal;)+) => {
        $(
            // SAFETY: every number occurs once below.
            unsafe impl Kind for $name<f32> {
                const NUMBER: i32 = SINGLE + $number;
                const SIZE: usize = $single;
            }
            // SAFETY: as above.
            unsafe impl Kind for $name<f64> {
                const NUMBER: i32 = DOUBLE + $number;
                const SIZE: usize = $double;
            }
            const _: () = fits::<$name<f32>>();
            const _: () = fits::<$name<f64>>();
        )+

        /// Every kind.
        pub const ALL: &[Described] = &[$(Described {
            name: stringify!($name),
            about: $about,
            scalars: [
                (SINGLE + $number, $single, size_of::<Stored<$name<f32>>>()),
                (DOUBLE + $number, $double, size_of::<Stored<$name<f64>>>()),
            ],
        }),+];
    };
}

kinds! {
    Robot = 1, 384, 752, "A robot: three arms of eight parameters.";
    Ikm = 2, 5296, 10272, "The per-arm calibrator: samples and solver, each arm by itself.";
    Joint = 5, 11968, 23776, "The joint calibrator: samples and solver, all 24 parameters together.";
    Gate = 8, 6664, 12816, "The per-arm calibrator behind a gate, which tests each sample before it is taken in.";
    JointGate = 10, 15432, 30352, "The joint calibrator behind a gate, which tests each sample before it is taken in.";
    Fkm = 9, 26304, 52448, "The calibrator from any readings: up to DCAL_FKM_ROWS observations and solver.";
}

/// Snapshot sizes in single and in double precision, by kind. Bytes.
#[rustfmt::skip]
pub const SNAPSHOTS: [(&str, [usize; 2]); 5] = [
    ("ikm", [Ikm::<f32>::SNAPSHOT_BYTES, Ikm::<f64>::SNAPSHOT_BYTES]),
    ("joint", [Joint::<f32>::SNAPSHOT_BYTES, Joint::<f64>::SNAPSHOT_BYTES]),
    ("gate", [Gate::<f32>::SNAPSHOT_BYTES, Gate::<f64>::SNAPSHOT_BYTES]),
    ("joint_gate", [JointGate::<f32>::SNAPSHOT_BYTES, JointGate::<f64>::SNAPSHOT_BYTES]),
    ("fkm", [Fkm::<f32>::SNAPSHOT_BYTES, Fkm::<f64>::SNAPSHOT_BYTES]),
];

/// Fails to compile if an object does not fit its memory in C.
const fn fits<K: Kind>() {
    // The caller's memory is overwritten and never dropped.
    assert!(!core::mem::needs_drop::<K>());
    assert!(size_of::<Stored<K>>() <= K::SIZE);
    assert!(align_of::<Stored<K>>() == ALIGNMENT);
    assert!(K::SIZE.is_multiple_of(ALIGNMENT) && K::SIZE < 0x1_0000);
}

/// The size of an object of this kind on this target, bytes; 0 if there is no such kind.
pub fn size_of_kind(number: i32) -> usize {
    let mut kinds = ALL.iter().flat_map(|kind| kind.scalars);
    kinds.find(|own| own.0 == number).map_or(0, |own| own.2)
}
