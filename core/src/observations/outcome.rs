use super::instruments::{Instruments, OF_ROBOT};
use crate::Real;
use crate::calibration::{Estimate, JointOutcome};
use crate::frame::RigidTransform;
use crate::robot::Robot;
use nalgebra::SMatrix;

/// A robot calibrated from observations, and the unknowns of the instruments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservationOutcome<T: Real, const N: usize> {
    /// The calibrated robot.
    pub robot: Robot<T>,
    /// All parameters, the robot's 24 first, and how far they can be trusted.
    pub estimate: Estimate<T, N>,
    unknowns: [T; N],
    frame: RigidTransform<T>,
}

impl<T: Real, const N: usize> ObservationOutcome<T, N> {
    pub(super) const fn new(
        robot: Robot<T>,
        estimate: Estimate<T, N>,
        unknowns: [T; N],
        frame: RigidTransform<T>,
    ) -> Self {
        Self {
            robot,
            estimate,
            unknowns,
            frame,
        }
    }

    /// The unknowns at their places among all parameters; what stands before them has no meaning.
    pub const fn unknowns(&self) -> &[T; N] {
        &self.unknowns
    }

    /// The frame of the coordinates: from the robot's frame to it.
    pub const fn frame(&self) -> RigidTransform<T> {
        self.frame
    }

    /// c (length), a and b of a plane z = c + a x + b y.
    pub fn plane(&self, instruments: &Instruments<'_, T>, plane: u8) -> [T; 3] {
        self.from(instruments.plane_column(plane))
    }

    /// x, y and z of a point and what its sensor reads too much. Length.
    pub fn point(&self, instruments: &Instruments<'_, T>, point: u8) -> [T; 4] {
        let [x, y, z, offset] = self.from(instruments.point_column(point));
        let has_offset = instruments.points.get(usize::from(point));
        let has_offset = has_offset.is_some_and(|point| point.offset);
        [x, y, z, if has_offset { offset } else { T::ZERO }]
    }

    fn from<const K: usize>(&self, column: usize) -> [T; K] {
        let mut values = [T::ZERO; K];
        for (value, unknown) in values.iter_mut().zip(self.unknowns.iter().skip(column)) {
            *value = *unknown;
        }
        values
    }

    /// The robot's 24 geometric parameters alone; the covariance takes the share of all other unknowns into account.
    /// The robot has the transmissions that were found.
    pub fn of_robot(&self) -> JointOutcome<T> {
        let whole = &self.estimate;
        let mut correction = [T::ZERO; OF_ROBOT];
        let mut prior_share = [T::ZERO; OF_ROBOT];
        for (own, value) in correction.iter_mut().zip(whole.correction) {
            *own = value;
        }
        for (own, value) in prior_share.iter_mut().zip(whole.prior_share) {
            *own = value;
        }
        let block = |all: &SMatrix<T, N, N>| {
            SMatrix::<T, OF_ROBOT, OF_ROBOT>::from_fn(|row, column| {
                all.get((row, column)).copied().unwrap_or(T::ZERO)
            })
        };
        JointOutcome {
            robot: self.robot,
            estimate: Estimate {
                correction,
                covariance: whole.covariance.as_ref().map(block),
                prior_share,
                residual_rms: whole.residual_rms,
                estimated_noise: whole.estimated_noise,
                degrees_of_freedom: whole.degrees_of_freedom,
                effective_samples: whole.effective_samples,
                samples: whole.samples,
                iterations: whole.iterations,
                termination: whole.termination,
                start: whole.start,
                conditions: whole.conditions,
            },
        }
    }
}
