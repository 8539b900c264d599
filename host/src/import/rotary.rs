//! A robot whose motors turn its arms, as Klipper computes it.

/// Lengths in mm, azimuths in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotaryPrinter {
    /// From the centre to the motors' axes, the platform's radius subtracted.
    pub radius: f64,
    /// The height of the motors' axes.
    pub height: f64,
    /// The azimuths of the arms.
    pub azimuths: [f64; 3],
    /// The upper arms.
    pub upper: [f64; 3],
    /// The forearms.
    pub lower: [f64; 3],
    /// The height of the nozzle at x = y = 0 with that arm at its end stop.
    pub endstops: [f64; 3],
}

impl RotaryPrinter {
    /// The joint angles at the end stops as the robot file counts them, down positive: radians. `None` for an end
    /// stop that no angle gives.
    pub fn home(&self) -> [Option<f64>; 3] {
        let mut home = [None; 3];
        let arms = self.upper.into_iter().zip(self.lower).zip(self.endstops);
        for (angle, ((upper, lower), endstop)) in home.iter_mut().zip(arms) {
            *angle = self.above_level(upper, lower, endstop).map(|up| -up);
        }
        home
    }

    /// Klipper's angle of an upper arm above level with the nozzle on the z axis at a height, the elbow outwards.
    fn above_level(&self, upper: f64, lower: f64, height: f64) -> Option<f64> {
        let (out, up) = (-self.radius, height - self.height);
        let distance = out.hypot(up);
        let cosine =
            (distance * distance + upper * upper - lower * lower) / (2.0 * upper * distance);
        if !(cosine.abs() <= 1.0) {
            return None;
        }
        let (towards, opening) = (up.atan2(out), cosine.acos());
        let both = [towards + opening, towards - opening];
        let outwards = both
            .into_iter()
            .max_by(|one, other| one.cos().total_cmp(&other.cos()))?;
        let (sine, cosine) = outwards.sin_cos();
        Some(sine.atan2(cosine))
    }
}
