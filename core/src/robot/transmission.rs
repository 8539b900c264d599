use super::parameter::GeometryError;
use crate::Real;

/// Numbers per transmission.
pub(crate) const NUMBERS: usize = 5;

/// Errors of a joint's gear and encoder: the arm angle differs slightly from the joint angle q that the controller
/// reads.
///
/// ```text
/// arm angle = q + gain · q + c₁ cos q + s₁ sin q + c₂ cos 2q + s₂ sin 2q
/// ```
///
/// The gain is an error of the gear ratio; an eccentric gear or encoder causes the first harmonic, an oval one the
/// second. A constant offset belongs to (`La_x`, `La_y`).
///
/// Without the feature `transmission` every transmission is exact and takes no memory.
///
/// ```
/// # #[cfg(feature = "transmission")] {
/// use delta_cal::SymmetricRobot;
/// use delta_cal::robot::Transmission;
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
///     .robot()?;
/// // The gear of arm 1 is eccentric: 0.05° at q = 90°, −0.05° at −90°.
/// let eccentric = Transmission::new([0.0, 0.0, 0.05_f64.to_radians(), 0.0, 0.0])?;
/// let real = robot.with_transmissions([eccentric, Transmission::EXACT, Transmission::EXACT])?;
/// let moved = real.forward(&[0.5, 0.5, 0.5])? - robot.forward(&[0.5, 0.5, 0.5])?;
/// assert!(moved.norm() > 0.05);
/// // Inverse kinematics takes it into account.
/// let joints = real.inverse(&real.forward(&[0.5, 0.4, 0.3])?)?;
/// assert!((joints[0] - 0.5).abs() < 1e-12);
/// # Ok(())
/// # }
/// # main().unwrap();
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transmission<T> {
    numbers: Stored<T, NUMBERS>,
}

/// σ of the transmission numbers to be estimated, each about its nominal value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransmissionTolerance<T> {
    sigma: Stored<T, 1>,
}

/// Numbers that exist only with the feature: without it, neither do the objects that hold them.
#[cfg(feature = "transmission")]
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stored<T, const N: usize>([T; N]);

#[cfg(not(feature = "transmission"))]
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stored<T, const N: usize>(core::convert::Infallible, core::marker::PhantomData<T>);

impl<T: Real, const N: usize> Stored<T, N> {
    #[cfg(feature = "transmission")]
    #[expect(clippy::unnecessary_wraps, reason = "`None` without the feature")]
    const fn new(numbers: [T; N]) -> Option<Self> {
        Some(Self(numbers))
    }

    #[cfg(not(feature = "transmission"))]
    const fn new(_: [T; N]) -> Option<Self> {
        None
    }

    const fn get(&self) -> [T; N] {
        #[cfg(feature = "transmission")]
        return self.0;
        #[cfg(not(feature = "transmission"))]
        match self.0 {}
    }
}

/// Upper bound on |d(arm angle)/d(joint angle) − 1|.
const STEEPEST: f64 = 0.1;
/// Newton steps from arm angle to joint angle. The initial error is below π/10 and the second derivative below 2/10, so
/// each error is less than a ninth of the square of the previous one.
const STEPS: usize = 4;

impl<T: Real> Transmission<T> {
    /// The arm angle equals the joint angle.
    #[cfg(feature = "transmission")]
    pub const EXACT: Self = Self {
        numbers: Stored([T::ZERO; NUMBERS]),
    };

    /// gain (no unit), c₁, s₁, c₂ and s₂ (radians).
    ///
    /// # Errors
    /// [`GeometryError::TransmissionTooLarge`] if |gain| + |c₁| + |s₁| + 2 |c₂| + 2 |s₂| is not below 0.1, and always
    /// without the feature `transmission`.
    pub fn new(numbers: [T; NUMBERS]) -> Result<Self, GeometryError> {
        let [gain, c1, s1, c2, s2] = numbers.map(Real::magnitude);
        let usable = gain + c1 + s1 + T::TWO * (c2 + s2) < T::from_f64(STEEPEST);
        let numbers = Stored::new(numbers).filter(|_| usable);
        let numbers = numbers.ok_or(GeometryError::TransmissionTooLarge)?;
        Ok(Self { numbers })
    }

    /// gain (no unit), c₁, s₁, c₂ and s₂ (radians).
    pub const fn numbers(&self) -> [T; NUMBERS] {
        self.numbers.get()
    }

    /// How far the arm is ahead of the joint, and its derivative by the joint angle. Radians, no unit.
    fn ahead(&self, q: T) -> (T, T) {
        let [gain, c1, s1, c2, s2] = self.numbers();
        let [_, cosine, sine, double_cosine, double_sine] = by_numbers(q);
        (
            gain * q + c1 * cosine + s1 * sine + c2 * double_cosine + s2 * double_sine,
            gain + s1 * cosine - c1 * sine + T::TWO * (s2 * double_cosine - c2 * double_sine),
        )
    }

    /// The arm angle for a joint angle, and its derivative. Radians, no unit.
    pub(crate) fn arm_angle(&self, q: T) -> (T, T) {
        let (ahead, slope) = self.ahead(q);
        (q + ahead, T::ONE + slope)
    }

    /// The joint angle for an arm angle, by Newton's method. Radians.
    pub(crate) fn joint_angle(&self, arm_angle: T) -> T {
        let mut q = arm_angle;
        for _ in 0..STEPS {
            let (ahead, slope) = self.ahead(q);
            let step = (q - arm_angle + ahead) / (T::ONE + slope);
            q -= step;
            // The remaining error is less than a ninth of this step squared.
            if step.squared() <= T::from_f64(8.0) * T::EPSILON {
                break;
            }
        }
        q
    }
}

/// Derivatives of the arm angle by the numbers: q, cos q, sin q, cos 2q, sin 2q. No unit, except the first: radians.
pub(crate) fn by_numbers<T: Real>(q: T) -> [T; NUMBERS] {
    let (sine, cosine) = q.sine_cosine();
    [
        q,
        cosine,
        sine,
        (cosine - sine) * (cosine + sine),
        T::TWO * sine * cosine,
    ]
}

impl<T: Real> TransmissionTolerance<T> {
    /// σ of c₁, s₁, c₂ and s₂ in radians; the gain has the same σ, without unit.
    ///
    /// # Errors
    /// [`GeometryError::TransmissionTooLarge`] unless it is above 0 and below 0.1, and always without the feature
    /// `transmission`.
    pub fn new(sigma: T) -> Result<Self, GeometryError> {
        let usable = sigma > T::ZERO && sigma < T::from_f64(STEEPEST);
        let sigma = Stored::new([sigma]).filter(|_| usable);
        let sigma = sigma.ok_or(GeometryError::TransmissionTooLarge)?;
        Ok(Self { sigma })
    }

    /// Radians.
    pub const fn sigma(&self) -> T {
        let [sigma] = self.sigma.get();
        sigma
    }
}

#[cfg(test)]
#[cfg(feature = "transmission")]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{Transmission, by_numbers};
    use crate::fixtures::paper;
    use crate::robot::GeometryError;

    const NUMBERS: [f64; 5] = [0.012, -0.02, 0.015, 0.006, -0.01];

    fn angles() -> impl Iterator<Item = f64> {
        (-31..=31).map(|step| 0.1 * f64::from(step))
    }

    /// Against the definition, computed with library functions of the double angle.
    #[test]
    fn the_arm_turns_as_the_definition_says() {
        let transmission = Transmission::new(NUMBERS).unwrap();
        let [gain, c1, s1, c2, s2] = NUMBERS;
        for q in angles() {
            let expected = q
                + gain * q
                + c1 * q.cos()
                + s1 * q.sin()
                + c2 * (2.0 * q).cos()
                + s2 * (2.0 * q).sin();
            let (angle, slope) = transmission.arm_angle(q);
            assert!((angle - expected).abs() < 1e-15);
            let step = 1e-5;
            let [up, down] = [q + step, q - step].map(|q| transmission.arm_angle(q).0);
            // step² θ‴/6 and ε/step are 1e-11.
            assert!((slope - (up - down) / (2.0 * step)).abs() < 1e-10);
            let product: f64 = by_numbers(q).iter().zip(NUMBERS).map(|(a, b)| a * b).sum();
            assert!((angle - q - product).abs() < 1e-15);
        }
    }

    /// The largest accepted numbers, one at a time and all together, in both precisions.
    #[test]
    fn the_joint_angle_leads_back_to_the_arms() {
        for which in 0..6 {
            let mut numbers = [0.0; 5];
            match numbers.get_mut(which) {
                Some(number) => *number = if which < 3 { 0.0999 } else { -0.0499 },
                None => numbers = [0.019, -0.019, 0.019, 0.01, -0.01],
            }
            let double = Transmission::new(numbers).unwrap();
            #[allow(clippy::cast_possible_truncation)]
            let single = Transmission::new(numbers.map(|number| number as f32)).unwrap();
            for q in angles() {
                // A few roundings of a number below π.
                let found = double.joint_angle(double.arm_angle(q).0);
                assert!((found - q).abs() < 2e-15, "{which} {q} {found}");
                #[allow(clippy::cast_possible_truncation)]
                let q = q as f32;
                let found = single.joint_angle(single.arm_angle(q).0);
                assert!((found - q).abs() < 1e-6, "{which} {q} {found}");
            }
        }
    }

    /// And so is one of a linear drive.
    #[test]
    fn transmissions_that_are_not_nearly_exact_are_refused() {
        for numbers in [
            [0.1, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.05, 0.0],
            [0.03, -0.03, 0.03, 0.003, 0.003],
            [f64::NAN, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, f64::INFINITY],
        ] {
            let refused = Transmission::new(numbers);
            assert_eq!(refused, Err(GeometryError::TransmissionTooLarge));
        }
        #[cfg(feature = "linear")]
        {
            let arm = crate::robot::Arm::linear([140.0, 0.0, 0.0, 0.0, 0.0, 1.0, 330.0]).unwrap();
            let refused = arm.with_transmission(Transmission::new(NUMBERS).unwrap());
            assert_eq!(refused, Err(GeometryError::TransmissionTooLarge));
        }
    }

    /// A robot with transmissions equals the robot without them at the arm angles, in every function.
    #[test]
    fn a_robot_is_at_the_angles_of_its_arms() {
        let drawn = paper();
        let transmissions =
            [1.0, -1.0, 0.5].map(|by| Transmission::new(NUMBERS.map(|own| by * own)).unwrap());
        let real = drawn.with_transmissions(transmissions).unwrap();
        assert_eq!(real.transmissions(), transmissions);
        let joints = [0.5, -0.1, 0.8];
        let mut angles = joints;
        let mut slopes = [1.0; 3];
        for ((angle, slope), own) in angles.iter_mut().zip(&mut slopes).zip(transmissions) {
            (*angle, *slope) = own.arm_angle(*angle);
        }
        let position = real.forward(&joints).unwrap();
        assert_eq!(position, drawn.forward(&angles).unwrap());
        for (found, expected) in real.inverse(&position).unwrap().iter().zip(joints) {
            assert!((found - expected).abs() < 1e-14);
        }
        let found = real.platform_jacobian(&position, &joints).unwrap();
        let expected = drawn.platform_jacobian(&position, &angles).unwrap();
        assert_eq!(found.by_parameters, expected.by_parameters);
        for (joint, slope) in slopes.iter().enumerate() {
            let expected = expected.by_joints.column(joint) * *slope;
            assert!((found.by_joints.column(joint) - expected).norm() < 1e-12);
        }
    }

    #[test]
    fn an_arm_keeps_its_transmission_when_it_is_moved_or_cast() {
        let transmission = Transmission::new(NUMBERS).unwrap();
        let [plain, ..] = *paper().arms();
        let arm = plain.with_transmission(transmission).unwrap();
        let moved = arm
            .with_parameters([160.0, 1.0, 2.0, 0.1, 0.0, 261.0, 1.0, 479.0])
            .unwrap();
        assert_eq!(moved.transmission(), Some(&transmission));
        let single = arm.cast::<f32>().unwrap();
        #[allow(clippy::cast_possible_truncation)]
        let expected = NUMBERS.map(|number| number as f32);
        assert_eq!(
            single.transmission(),
            Some(&Transmission::new(expected).unwrap())
        );
        // An exact transmission is stored as none: the arm is unchanged.
        assert_eq!(plain.with_transmission(Transmission::EXACT).unwrap(), plain);
    }
}
