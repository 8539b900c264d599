//! Serialisation: little-endian integers and numbers of fixed width, fields in sequence, and enum variants identified
//! by numbers assigned explicitly here rather than by declaration order.

use delta_cal::calibration::{Start, Termination};
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::{ArmIndex, Parameter, Refusal};

/// A value that can be sent over the wire.
pub trait Wire: Sized {
    /// Appends the value's bytes.
    fn put(&self, to: &mut Writer<'_>);

    /// Reads a value from the front; `None` if the bytes are not valid.
    fn get(from: &mut Reader<'_>) -> Option<Self>;
}

/// Writes bytes into a buffer.
#[derive(Debug)]
pub struct Writer<'a> {
    bytes: &'a mut [u8],
    /// Number of bytes put; exceeds the buffer's length if they did not fit.
    length: usize,
}

impl<'a> Writer<'a> {
    /// A writer to the beginning of a buffer.
    pub const fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes, length: 0 }
    }

    /// Appends raw bytes.
    pub fn bytes(&mut self, own: &[u8]) {
        let end = self.length.saturating_add(own.len());
        if let Some(place) = self.bytes.get_mut(self.length..end) {
            place.copy_from_slice(own);
        }
        self.length = end;
    }

    /// The number of bytes written; `None` if they did not fit.
    pub const fn finish(self) -> Option<usize> {
        if self.length <= self.bytes.len() {
            Some(self.length)
        } else {
            None
        }
    }
}

/// Reads bytes from a buffer.
#[derive(Debug, Clone)]
pub struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    /// A reader from the beginning of a buffer.
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (own, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*own)
    }

    /// The unread bytes.
    pub const fn rest(&self) -> &'a [u8] {
        self.0
    }
}

macro_rules! little_endian {
    ($($type:ty),+) => {$(
        impl Wire for $type {
            fn put(&self, to: &mut Writer<'_>) {
                to.bytes(&self.to_le_bytes());
            }
            fn get(from: &mut Reader<'_>) -> Option<Self> {
                from.take().map(Self::from_le_bytes)
            }
        }
    )+};
}

little_endian!(u8, u16, u32, u64, f32, f64);

impl Wire for bool {
    fn put(&self, to: &mut Writer<'_>) {
        u8::from(*self).put(to);
    }
    fn get(from: &mut Reader<'_>) -> Option<Self> {
        match u8::get(from)? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

/// 0 for `None`, or 1 and the value.
impl<V: Wire> Wire for Option<V> {
    fn put(&self, to: &mut Writer<'_>) {
        self.is_some().put(to);
        if let Some(value) = self {
            value.put(to);
        }
    }
    fn get(from: &mut Reader<'_>) -> Option<Self> {
        if bool::get(from)? {
            V::get(from).map(Some)
        } else {
            Some(None)
        }
    }
}

impl<V: Wire + Copy, const N: usize> Wire for [V; N] {
    fn put(&self, to: &mut Writer<'_>) {
        for value in self {
            value.put(to);
        }
    }
    fn get(from: &mut Reader<'_>) -> Option<Self> {
        let mut values = [V::get(from)?; N];
        for value in values.iter_mut().skip(1) {
            *value = V::get(from)?;
        }
        Some(values)
    }
}

impl<A: Wire, B: Wire> Wire for (A, B) {
    fn put(&self, to: &mut Writer<'_>) {
        self.0.put(to);
        self.1.put(to);
    }
    fn get(from: &mut Reader<'_>) -> Option<Self> {
        Some((A::get(from)?, B::get(from)?))
    }
}

/// Structs: their fields in the given order.
macro_rules! fields {
    ($($name:ident $(<$scalar:ident>)? { $($field:ident),+ $(,)? })+) => {$(
        impl$(<$scalar: $crate::wire::Wire + Copy>)? $crate::wire::Wire for $name$(<$scalar>)? {
            fn put(&self, to: &mut $crate::wire::Writer<'_>) {
                $(self.$field.put(to);)+
            }
            fn get(from: &mut $crate::wire::Reader<'_>) -> Option<Self> {
                Some(Self { $($field: $crate::wire::Wire::get(from)?),+ })
            }
        }
    )+};
}
pub(crate) use fields;

/// Enums: the variant's number in one byte, then its fields. A variant without a number is written as [`NO_NUMBER`],
/// which no reader accepts.
macro_rules! numbers {
    ($($name:ident $(<$scalar:ident>)? {
        $($number:literal: $variant:ident $(($content:ident))? $({ $($field:ident),+ })?,)+
    })+) => {$(
        impl$(<$scalar: $crate::wire::Wire + Copy>)? $crate::wire::Wire for $name$(<$scalar>)? {
            fn put(&self, to: &mut $crate::wire::Writer<'_>) {
                match self {
                    $(Self::$variant $(($content))? $({ $($field),+ })? => {
                        to.bytes(&[$number]);
                        $($content.put(to);)?
                        $($($field.put(to);)+)?
                    })+
                    #[allow(unreachable_patterns)] // of a non-exhaustive enum
                    _ => to.bytes(&[$crate::wire::NO_NUMBER]),
                }
            }
            fn get(from: &mut $crate::wire::Reader<'_>) -> Option<Self> {
                let number: u8 = $crate::wire::Wire::get(from)?;
                Some(match number {
                    $($number => Self::$variant
                        $(({ let $content = $crate::wire::Wire::get(from)?; $content }))?
                        $({ $($field: $crate::wire::Wire::get(from)?),+ })?,)+
                    _ => return None,
                })
            }
        }
    )+};
}
pub(crate) use numbers;

/// Declares messages and how they are sent: enums with the number of each variant, structs in the order of their fields.
/// Tuple variants name what they hold.
macro_rules! messages {
    () => {};
    ($(#[$meta:meta])* pub enum $name:ident $(<$scalar:ident>)? {$(
        $(#[$about:meta])*
        $number:literal: $variant:ident $(($content:ident: $inner:ty))?
            $({ $($(#[$of_field:meta])* $field:ident: $of:ty,)+ })?,
    )+} $($rest:tt)*) => {
        $(#[$meta])*
        pub enum $name $(<$scalar>)? {$(
            $(#[$about])*
            $variant $(($inner))? $({ $($(#[$of_field])* $field: $of,)+ })?,
        )+}
        $crate::wire::numbers! {
            $name $(<$scalar>)? {
                $($number: $variant $(($content))? $({ $($field),+ })?,)+
            }
        }
        $crate::wire::messages! { $($rest)* }
    };
    ($(#[$meta:meta])* pub struct $name:ident $(<$scalar:ident>)? {
        $($(#[$about:meta])* pub $field:ident: $of:ty,)+
    } $($rest:tt)*) => {
        $(#[$meta])*
        pub struct $name $(<$scalar>)? {
            $($(#[$about])* pub $field: $of,)+
        }
        $crate::wire::fields! { $name $(<$scalar>)? { $($field),+ } }
        $crate::wire::messages! { $($rest)* }
    };
}
pub(crate) use messages;

/// The number of variants that this version does not number.
pub(crate) const NO_NUMBER: u8 = 127;

numbers! {
    ArmIndex {
        0: First,
        1: Second,
        2: Third,
    }

    Parameter {
        0: Dx,
        1: Dy,
        2: Dz,
        3: Theta,
        4: Alpha,
        5: LaX,
        6: LaY,
        7: Lb,
    }

    Termination {
        0: GradientVanished,
        1: RoundingReached,
    }

    Start {
        0: Nominal,
        1: Free,
        2: Search,
    }
}

// The numbers below match the C library's status codes.

numbers! {
    GeometryError {
        30: NonFinite(parameter),
        31: NotPositive(parameter),
        32: TiltTooLarge,
        33: AzimuthTooLarge,
        34: RadiusInvalid,
        35: NoCommonUp,
        36: TransmissionTooLarge,
    }

    SampleError {
        50: PositionNonFinite,
        51: PositionTooFar(arm),
        52: JointNonFinite(arm),
        53: JointTooLarge(arm),
    }

    Refusal {
        70: TooFewSamples { arm, samples, needed },
        71: Undetermined { arm, parameter, condition },
        72: Uncertain { arm, parameter, sigma },
        73: NotConverged { arm, iterations },
        74: ResidualContradictsNoise { arm, ratio },
        75: FarFromNominal { arm, parameter, tolerances },
        76: ImpossibleGeometry { arm, error },
        77: ImpossibleRobot(error),
        78: WrongSide,
        81: NonFinite { arm },
        82: Unfinished,
        92: RobotChanged { first },
        93: EarlySamplesWrong { first },
        94: TooManyRejected { rejected, samples },
    }
}
