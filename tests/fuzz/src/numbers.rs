//! Robots, samples and settings from arbitrary bytes: mostly realistic, occasionally any bit pattern. And assertions
//! that hold for every accepted result.

use arbitrary::Unstructured;
use delta_cal::robot::{Arm, GeometryError};
use delta_cal::{Noise, Parameter, Real, Robot, RobotOutcome, Sample, Settings, Tolerance};
use delta_cal_controller::Number;
use delta_cal_firmware_example::nominal;
use nalgebra::Vector3;

/// A scalar with arbitrary bits.
pub(crate) trait Bits: Number {
    /// The number with this bit pattern; `f32` takes the lower half.
    fn of_bits(bits: u64) -> Self;
}

impl Bits for f32 {
    fn of_bits(bits: u64) -> Self {
        let [a, b, c, d, ..] = bits.to_le_bytes();
        Self::from_le_bytes([a, b, c, d])
    }
}

impl Bits for f64 {
    fn of_bits(bits: u64) -> Self {
        Self::from_bits(bits)
    }
}

/// Zero, denormal, tiny, huge, infinite and NaN values.
const SPECIAL: [f64; 16] = [
    0.0,
    -0.0,
    1e-45,
    1e-38,
    1e-30,
    1e-20,
    1e-10,
    1.0,
    -1.0,
    1e10,
    1e19,
    3e38,
    1e154,
    1e308,
    f64::INFINITY,
    f64::NAN,
];

/// The bytes of one input, followed by zeros.
pub(crate) struct Source<'a>(Unstructured<'a>);

impl<'a> Source<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Self(Unstructured::new(data))
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.0.arbitrary().unwrap_or_default()
    }

    pub(crate) fn word(&mut self) -> u16 {
        self.0.arbitrary().unwrap_or_default()
    }

    pub(crate) fn wide(&mut self) -> u32 {
        self.0.arbitrary().unwrap_or_default()
    }

    /// A number less than `count`.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count.max(1)
    }

    /// Up to 255 bytes.
    pub(crate) fn bytes(&mut self) -> &'a [u8] {
        let count = usize::from(self.byte()).min(self.0.len());
        self.0.bytes(count).unwrap_or_default()
    }

    /// The usual number, one within `spread` of it, one of another magnitude, a special value, or any bit pattern.
    pub(crate) fn number<T: Bits>(&mut self, usual: f64, spread: f64) -> T {
        match self.byte() {
            0..0x60 => T::from_f64(usual),
            0x60..0xc8 => {
                let part: i16 = self.0.arbitrary().unwrap_or_default();
                T::from_f64(usual + spread * f64::from(part) / 32768.0)
            }
            0xc8..0xe0 => {
                let exponent: i8 = self.0.arbitrary().unwrap_or_default();
                T::from_f64(usual * 2f64.powi(i32::from(exponent)))
            }
            0xe0..0xf0 => T::from_f64(SPECIAL[self.below(SPECIAL.len())]),
            0xf0.. => T::of_bits(self.0.arbitrary().unwrap_or_default()),
        }
    }

    pub(crate) fn vector<T: Bits>(&mut self, usual: [f64; 3], spread: f64) -> Vector3<T> {
        Vector3::from(usual.map(|usual| self.number(usual, spread)))
    }

    /// 24 parameters: nominal, or each from the bytes.
    pub(crate) fn geometry<T: Bits>(&mut self) -> Result<[[T; 8]; 3], GeometryError> {
        let drawn = nominal::<f64>()?.arms().map(|arm| arm.parameters());
        if self.byte() < 0x40 {
            return Ok(drawn.map(|arm| arm.map(T::from_f64)));
        }
        let (length, angle) = (self.number(1.0, 100.0), self.number(0.01, 1.0));
        Ok(drawn.map(|arm| {
            let mut index = 0;
            arm.map(|usual| {
                let spread = if matches!(index, 3 | 4) {
                    angle
                } else {
                    length
                };
                index += 1;
                self.number(usual, spread)
            })
        }))
    }

    /// A valid robot.
    pub(crate) fn robot<T: Bits>(&mut self) -> Result<Robot<T>, GeometryError> {
        let [first, second, third] = self.geometry()?;
        Robot::new([Arm::new(first)?, Arm::new(second)?, Arm::new(third)?])
    }

    /// Noise, tolerance and solver settings.
    pub(crate) fn settings<T: Bits>(&mut self) -> Settings<T> {
        let kind = self.byte();
        let noise = (kind & 1 != 0).then(|| {
            let (position, joint) = (self.number(0.02, 0.02), self.number(3e-5, 3e-5));
            Noise::new(position, joint).ok()
        });
        let tolerance = (kind & 2 != 0).then(|| {
            let (length, angle) = (self.number(0.5, 0.5), self.number(3e-3, 3e-3));
            Tolerance::new(length, angle).ok()
        });
        Settings::default()
            .with_noise(noise.flatten())
            .with_tolerance(tolerance.flatten())
            .with_damping(kind & 4 == 0)
            .with_free_start(kind & 0x18 == 0x18)
            .with_iteration_limit(if kind & 0x20 == 0 {
                50
            } else {
                u16::from(self.byte() & 0x3f)
            })
    }

    /// Up to `most` measurements of a robot close to nominal; each number may be altered.
    pub(crate) fn samples<T: Bits>(&mut self, most: usize) -> Vec<Sample<T>> {
        let count = self.below(most + 1);
        let length: f64 = self.number(0.5, 20.0);
        let wrong = self.byte();
        let truth = nominal::<f64>().and_then(|robot| {
            let [first, second, third] = *robot.arms();
            let moved = |arm: Arm<f64>, part: f64| {
                let mut parameters = arm.parameters();
                for (value, sign) in parameters.iter_mut().zip([1, -2, 1, 0, 0, 2, -1, 1]) {
                    *value += length * part * f64::from(sign);
                }
                Arm::new(parameters)
            };
            Robot::new([moved(first, 1.0)?, moved(second, -0.5)?, moved(third, 0.7)?])
        });
        (0..count)
            .map(|index| {
                let phase = f64::from(u32::try_from(index).unwrap_or_default());
                let joints = [1.0, 1.7, 2.3].map(|rate| 0.3 + 0.6 * (rate * phase).sin());
                let truth = truth.as_ref();
                let position: [f64; 3] = match truth.map(|robot| robot.forward(&joints)) {
                    Ok(Ok(position)) => position.into(),
                    _ => [0.0, 0.0, -450.0],
                };
                if self.is_empty() || wrong < 0x40 {
                    Sample {
                        joints: joints.map(T::from_f64),
                        position: Vector3::from(position.map(T::from_f64)),
                    }
                } else {
                    Sample {
                        joints: joints.map(|q| self.number(q, 1e-3)),
                        position: self.vector(position, 0.1),
                    }
                }
            })
            .collect()
    }
}

/// Asserts that every parameter is finite.
pub(crate) fn finite_robot<T: Real>(robot: &Robot<T>) {
    for arm in robot.arms() {
        assert!(
            arm.parameters().iter().all(|value| value.finite()),
            "{robot:?}"
        );
    }
}

/// Asserts that every figure of a calibration is finite and within its possible range.
pub(crate) fn finite_outcome<T: Real>(outcome: &RobotOutcome<T>) {
    finite_robot(&outcome.robot);
    for arm in &outcome.arms {
        let figures = [arm.residual_rms, arm.condition, arm.degrees_of_freedom];
        let all = figures.iter().chain(&arm.estimated_noise);
        for figure in all {
            assert!(figure.finite() && *figure >= T::ZERO, "{outcome:?}");
        }
        for share in &arm.prior_share {
            let most = T::ONE + T::EPSILON.square_root();
            assert!(*share >= T::ZERO && *share <= most, "{outcome:?}");
        }
        if let Some(covariance) = &arm.covariance {
            assert!(covariance.iter().all(|entry| entry.finite()), "{outcome:?}");
            for parameter in Parameter::ROTARY {
                let sigma = arm.standard_deviation(parameter);
                assert!(
                    sigma.is_some_and(|sigma| sigma.finite() && sigma >= T::ZERO),
                    "{outcome:?}"
                );
            }
        }
    }
}
