//! Observability indices.

/// Five figures that the literature makes of the singular values σ₁ ≥ … ≥ σ_L of a calibration's
/// Jacobian with L parameters; larger is better. Zero if the poses do not determine the parameters.
/// They depend on how rows and columns are scaled, so only poses for the same robot compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Indices {
    /// (σ₁ ⋯ σ_L)^(1/L) / √n with n poses. J. H. Borm, C. H. Menq, "Experimental study of
    /// observability of parameter errors in robot calibration", ICRA 1989; "Determination of optimal
    /// measurement configurations for robot calibration based on observability measure", Int. J.
    /// Robotics Research 10(1), 1991.
    pub o1: f64,
    /// `σ_L/σ₁`, the inverse of the condition number. M. R. Driels, U. S. Pathre, "Significance of
    /// observation strategy on the design of robot calibration experiments", J. Robotic Systems
    /// 7(2), 1990.
    pub o2: f64,
    /// `σ_L`. A. Nahvi, J. M. Hollerbach, V. Hayward, "Calibration of a parallel robot using multiple
    /// kinematic closed loops", ICRA 1994.
    pub o3: f64,
    /// `σ_L²/σ₁`, the noise amplification index. A. Nahvi, J. M. Hollerbach, "The noise amplification
    /// index for optimal pose selection in robot calibration", ICRA 1996.
    pub o4: f64,
    /// `1/(1/σ₁ + … + 1/σ_L)`. Y. Sun, J. M. Hollerbach, "Observability index selection for robot
    /// calibration", ICRA 2008.
    pub o5: f64,
}

impl Indices {
    /// Of singular values, the largest first, from so many poses.
    ///
    /// ```
    /// use delta_cal_host::planning::observability::Indices;
    /// let indices = Indices::of(&[4.0, 2.0, 1.0], 4);
    /// assert!((indices.o1 - 1.0).abs() < 1e-15);
    /// assert!((indices.o2 - 0.25).abs() < 1e-15);
    /// assert!((indices.o5 - 1.0 / 1.75).abs() < 1e-15);
    /// ```
    pub fn of(singular_values: &[f64], poses: usize) -> Self {
        let (Some(first), Some(last)) = (singular_values.first(), singular_values.last()) else {
            return Self {
                o1: 0.0,
                o2: 0.0,
                o3: 0.0,
                o4: 0.0,
                o5: 0.0,
            };
        };
        #[allow(clippy::cast_precision_loss)] // counts of poses and parameters
        let (count, poses) = (singular_values.len() as f64, poses as f64);
        // By logarithms: a product of 24 factors may overflow.
        let logarithms: f64 = singular_values.iter().map(|value| value.ln()).sum();
        let reciprocals: f64 = singular_values.iter().map(|value| value.recip()).sum();
        let condition = if *first > 0.0 { last / first } else { 0.0 };
        Self {
            o1: (logarithms / count).exp() / poses.sqrt(),
            o2: condition,
            o3: *last,
            o4: last * condition,
            o5: reciprocals.recip(),
        }
    }
}
