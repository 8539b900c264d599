use core::fmt;
use delta_cal::Real;

/// A scalar whose bits can be compared.
pub trait Scalar: Real {
    /// `f32` or `f64`.
    const NAME: &'static str;
    /// How many hexadecimal digits its bits take.
    const DIGITS: usize;

    /// Its bits, zero-extended.
    fn bits(self) -> u64;
}

impl Scalar for f32 {
    const NAME: &'static str = "f32";
    const DIGITS: usize = 8;

    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }
}

impl Scalar for f64 {
    const NAME: &'static str = "f64";
    const DIGITS: usize = 16;

    fn bits(self) -> u64 {
        self.to_bits()
    }
}

/// Writes `BITS <scalar> <label>: <bits> <bits> …`, one line.
pub(crate) fn record<T: Scalar>(
    out: &mut dyn fmt::Write,
    label: fmt::Arguments<'_>,
    values: &[T],
) -> fmt::Result {
    write!(out, "BITS {} {label}:", T::NAME)?;
    for value in values {
        write!(out, " {:0width$x}", value.bits(), width = T::DIGITS)?;
    }
    out.write_char('\n')
}
