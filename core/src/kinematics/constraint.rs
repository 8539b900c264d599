use crate::Real;
use crate::robot::{Arm, Drive, TRANSMISSION_NUMBERS, by_transmission};
use nalgebra::{SVector, Vector3};

impl<T: Real> Arm<T> {
    /// f(P; X, q) = |X − B(q)|² − Lb² (paper, equation (3.8)). Length².
    ///
    /// ```
    /// use delta_cal::robot::Arm;
    /// use nalgebra::Vector3;
    /// # fn main() -> Result<(), delta_cal::robot::GeometryError> {
    /// let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0])?;
    /// // The elbow is at (424, 0, 0); a forearm hanging straight down ends 480 below.
    /// assert_eq!(arm.constraint(&Vector3::new(424.0, 0.0, -480.0), 0.0), 0.0);
    /// # Ok(())
    /// # }
    /// ```
    pub fn constraint(&self, x: &Vector3<T>, q: T) -> T {
        let forearm = x - self.elbow(q);
        forearm.dot(&forearm) - self.lb() * self.lb()
    }

    /// ∂f/∂X = 2 (X − B(q)). Length.
    pub fn constraint_by_position(&self, x: &Vector3<T>, q: T) -> Vector3<T> {
        (x - self.elbow(q)) * T::TWO
    }

    /// ∂f/∂q = −2 (X − B(q)) · B′(q). Length² per radian, or length with a linear drive.
    pub fn constraint_by_joint(&self, x: &Vector3<T>, q: T) -> T {
        -((x - self.elbow(q)).dot(&self.elbow_derivative(q)) * T::TWO)
    }

    /// ∂f by the numbers of the [transmission](crate::robot::Transmission), of a rotary drive: ∂f/∂(arm's angle)
    /// times q, cos q, sin q, cos 2q and sin 2q. Length² per radian; the first length².
    pub fn constraint_by_transmission(&self, x: &Vector3<T>, q: T) -> [T; TRANSMISSION_NUMBERS] {
        let slope = match self.transmission() {
            None => T::ONE,
            Some(transmission) => transmission.arm_angle(q).1,
        };
        let by_arm_angle = self.constraint_by_joint(x, q) / slope;
        by_transmission(q).map(|by_number| by_number * by_arm_angle)
    }

    /// ∂f/∂P: one row of the Jacobian (3.21), by the parameters' [places](Drive::places).
    /// Length for a length, length² for an angle or a ratio.
    pub fn constraint_by_parameters(&self, x: &Vector3<T>, q: T) -> SVector<T, 8> {
        if self.drive() == Drive::Linear {
            let basis = self.basis();
            let forearm = x - self.elbow(q);
            return linear_gradient(
                &basis.ex,
                &basis.ey,
                &basis.ez,
                self.la().0,
                self.lb(),
                &forearm,
                q,
            );
        }
        let (sin_q, cos_q) = self.arm_angle(q).sine_cosine();
        let basis = self.basis();
        let elbow = self.d() + basis.u * cos_q + basis.v * sin_q;
        constraint_gradient(
            &basis.ex,
            &basis.ey,
            &basis.ez,
            self.la(),
            self.lb(),
            &(x - elbow),
            (sin_q, cos_q),
        )
    }
}

/// ∂f/∂P from the arm's directions and the forearm vector w = X − B.
///
/// With a = La_x cos q + La_y sin q (radial) and b = La_y cos q − La_x sin q (up), the elbow is
/// B = D + a ex + b ez, and ∂f/∂p = −2 w · ∂B/∂p, ∂f/∂Lb = −2 Lb. The derivatives of the
/// directions are ∂ex/∂θ = t, ∂ez/∂θ = sin α · ex, ∂ez/∂α = −ey, with the tangent
/// t = (−sin θ, cos θ, 0).
#[allow(clippy::too_many_arguments)]
pub(crate) fn constraint_gradient<T: Real>(
    ex: &Vector3<T>,
    ey: &Vector3<T>,
    ez: &Vector3<T>,
    (la_x, la_y): (T, T),
    lb: T,
    forearm: &Vector3<T>,
    (sin_q, cos_q): (T, T),
) -> SVector<T, 8> {
    let radial = la_x * cos_q + la_y * sin_q;
    let up = la_y * cos_q - la_x * sin_q;
    let tangent = Vector3::new(-ex.y, ex.x, T::ZERO);
    let sin_alpha = ey.z;
    let w = forearm * -T::TWO;
    let (along_ex, along_ez) = (w.dot(ex), w.dot(ez));
    SVector::from([
        w.x,
        w.y,
        w.z,
        radial * w.dot(&tangent) + up * sin_alpha * along_ex,
        -(up * w.dot(ey)),
        along_ex * cos_q - along_ez * sin_q,
        along_ex * sin_q + along_ez * cos_q,
        -(lb * T::TWO),
    ])
}

/// The same with a linear drive, s its travel: ∂B/∂D = 1, ∂B/∂lean = s · scale · ∂n/∂lean, ∂B/∂scale = s n.
pub(crate) fn linear_gradient<T: Real>(
    by_lean_x: &Vector3<T>,
    by_lean_y: &Vector3<T>,
    direction: &Vector3<T>,
    scale: T,
    lb: T,
    forearm: &Vector3<T>,
    travel: T,
) -> SVector<T, 8> {
    let w = forearm * -T::TWO;
    let scaled = travel * scale;
    SVector::from([
        w.x,
        w.y,
        w.z,
        scaled * w.dot(by_lean_x),
        scaled * w.dot(by_lean_y),
        travel * w.dot(direction),
        T::ZERO,
        -(lb * T::TWO),
    ])
}
