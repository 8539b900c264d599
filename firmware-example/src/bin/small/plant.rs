//! Simulates the robot as built, its probe, and the person who places gauge blocks on the plate.

use delta_cal::Robot;
use delta_cal::nalgebra::Vector3;

/// The actual machine, unknown to the controller.
pub(crate) struct Plant {
    built: Robot<f32>,
    /// The height of the gauge block below the probe. Millimetres.
    pub(crate) block: f32,
    /// How far the tracker's reflector slips at every other pose. Millimetres.
    pub(crate) slip: f32,
    /// State of the noise generator.
    state: u32,
}

impl Plant {
    /// A robot that differs from the designed one by about 0.5 mm and 0.2°.
    pub(crate) fn new(drawn: &Robot<f32>) -> Self {
        let mut plant = Self {
            built: drawn.clone(),
            block: 0.0,
            slip: 0.0,
            state: 1,
        };
        let mut parameters = drawn.parameters();
        for arm in &mut parameters {
            for (index, parameter) in arm.iter_mut().enumerate() {
                let sigma = if index == 3 || index == 4 {
                    0.0035
                } else {
                    0.5
                };
                *parameter += sigma * plant.noise();
            }
        }
        plant.built = Robot::from_parameters(parameters).unwrap_or_else(|_| drawn.clone());
        plant
    }

    /// Whether the probe touches the block, which stands on a slightly tilted plate.
    pub(crate) fn touches(&self, joints: &[f32; 3]) -> bool {
        self.built
            .forward(joints)
            .is_ok_and(|at| at.z <= -500.0 + 0.002 * at.x - 0.001 * at.y + self.block)
    }

    /// The reading of a tracker: the position with a noise of 0.02 mm.
    pub(crate) fn position(&mut self, joints: &[f32; 3]) -> Option<Vector3<f32>> {
        let mut position = self.built.forward(joints).ok()?;
        self.slip = -self.slip;
        position.z += self.slip;
        Some(position.map(|coordinate| coordinate + 0.02 * self.noise()))
    }

    /// Noise of variance 1: the sum of twelve uniform numbers in (0, 1), minus its mean.
    #[allow(clippy::cast_precision_loss)] // 24 bits
    fn noise(&mut self) -> f32 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.state = self
                .state
                .wrapping_mul(1_664_525)
                .wrapping_add(1_013_904_223);
            sum += (self.state >> 8) as f32 / 16_777_216.0;
        }
        sum
    }
}
