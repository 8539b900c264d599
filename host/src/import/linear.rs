//! A printer with three towers, as Klipper, RepRapFirmware and Marlin compute it.

/// Lengths in mm, angles in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearPrinter {
    /// From the centre to the towers, the platform's radius subtracted.
    pub radius: f64,
    /// Where the towers stand.
    pub azimuths: [f64; 3],
    /// The rods.
    pub rods: [f64; 3],
    /// The height of the nozzle at x = y = 0 with that carriage at its end stop.
    pub endstops: [f64; 3],
}

impl LinearPrinter {
    /// The carriages at their end stops, mm above z = 0.
    pub fn home(&self) -> [f64; 3] {
        let mut home = self.endstops;
        for (carriage, rod) in home.iter_mut().zip(self.rods) {
            *carriage += (rod * rod - self.radius * self.radius).sqrt();
        }
        home
    }

    /// The carriages after so many steps from their end stops, mm.
    pub fn carriages(&self, steps: [f64; 3], step_lengths: [f64; 3]) -> [f64; 3] {
        let mut carriages = self.home();
        for ((carriage, steps), length) in carriages.iter_mut().zip(steps).zip(step_lengths) {
            *carriage -= steps * length;
        }
        carriages
    }

    /// The carriages with the nozzle at a position, mm; `None` if a rod is too short for it.
    pub fn inverse(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 3]> {
        let mut carriages = [z; 3];
        for ((carriage, azimuth), rod) in carriages.iter_mut().zip(self.azimuths).zip(self.rods) {
            let (sine, cosine) = azimuth.to_radians().sin_cos();
            let (across, along) = (x - self.radius * cosine, y - self.radius * sine);
            let square = rod * rod - across * across - along * along;
            if !(square > 0.0) {
                return None;
            }
            *carriage += square.sqrt();
        }
        Some(carriages)
    }
}
