use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use delta_cal::Real;

/// A checksum of 24 parameters, bit by bit: names a set of parameters in a message, so that
/// nothing else than what was looked at is applied or reverted.
///
/// CRC-32 of the parameters as `f64`, little-endian, arm by arm.
pub fn fingerprint<T: Real>(arms: &[[T; 8]; 3]) -> u32 {
    let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    for value in arms.as_flattened() {
        digest.update(&value.to_f64().to_bits().to_le_bytes());
    }
    digest.finalize()
}
