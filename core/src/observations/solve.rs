//! The prior, a one-call solve, and the outcome.

use super::equation::frame_at;
use super::instruments::{Instruments, OF_FRAME, OF_PLANE, OF_POINT, OF_TRANSMISSIONS};
use super::problem::{InstrumentsAt, ObservationProblem, ReadingRows};
use crate::Real;
use crate::calibration::{
    Estimate, JointOutcome, Judged, Minimizer, Progress, Refusal, Settings, TolerancePrior,
    enough_samples,
};
use crate::frame::RigidTransform;
use crate::robot::{ArmIndex, OF_ROBOT, Robot};
use crate::samples::{Unknowns, part};

impl<T: Unknowns<N>, const N: usize> ObservationProblem<'_, T, N> {
    /// Calibrates the robot. There is no free start, whatever `settings` ask for.
    ///
    /// # Errors
    /// A [`Refusal`]; keep the robot's current parameters.
    pub fn solve(&self, settings: &Settings<T>) -> Result<ObservationOutcome<T, N>, Refusal> {
        self.solve_watched(settings, || ())
    }

    /// The same; `watch` is called between the bounded steps.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn solve_watched(
        &self,
        settings: &Settings<T>,
        mut watch: impl FnMut(),
    ) -> Result<ObservationOutcome<T, N>, Refusal> {
        let mut outcome = ObservationOutcome::vacant(self.robot);
        let mut minimizer = self.minimizer(settings)?;
        while minimizer.step(self, &mut outcome.estimate)? == Progress::Working {
            watch();
        }
        self.complete(&mut outcome)?;
        Ok(outcome)
    }

    /// The correction at which the minimisation ends, without searching for other solutions and without judging it.
    /// `None` if it does not converge.
    pub fn end(&self, settings: &Settings<T>) -> Option<[T; N]> {
        let minimizer = self.minimizer(settings);
        let mut minimizer = minimizer.ok()?.for_its_end();
        let mut estimate = Estimate::vacant();
        while minimizer.step(self, &mut estimate) == Ok(Progress::Working) {}
        minimizer.end()
    }

    fn minimizer(&self, settings: &Settings<T>) -> Result<ObservationMinimizer<T, N>, Refusal> {
        let settings = &settings.with_free_start(false);
        enough_samples(&self.extent(), ArmIndex::First, settings)?;
        let mut minimizer = Minimizer::unstarted(ArmIndex::First, self.prior(settings), settings);
        minimizer.begin(self);
        Ok(minimizer)
    }
}

impl<T: Real, const N: usize> ObservationProblem<'_, T, N> {
    /// Converts an estimate to the robot and the unknowns.
    ///
    /// # Errors
    /// [`Refusal::ImpossibleGeometry`] or [`Refusal::ImpossibleRobot`].
    pub(super) fn complete(&self, outcome: &mut ObservationOutcome<T, N>) -> Result<(), Refusal> {
        let correction = &outcome.estimate.correction;
        outcome.robot = self.robot_at(correction)?;
        outcome.unknowns = self.unknowns_at(correction);
        let of_frame = outcome.unknowns.get(self.instruments.frame_column()..);
        let start = self.prepared.start.frame();
        let (_, rotation, translation) = frame_at(start, of_frame.unwrap_or_default());
        outcome.frame = RigidTransform {
            rotation,
            translation,
        };
        Ok(())
    }

    /// Prior knowledge of the parameters, in units of [`unit_of`](Self::unit_of).
    pub fn prior(&self, settings: &Settings<T>) -> TolerancePrior<T, N> {
        let [first, second, third] = self.robot.arms();
        let arms = [first, second, third];
        let mut prior =
            TolerancePrior::new(arms, &self.prepared.units, settings.tolerance.as_ref());
        self.hold_instruments(prior.weights_mut());
        prior
    }

    /// 1/σ of the prior on each instrument unknown; 0 if nothing is known, 1 at unused places.
    fn hold_instruments(&self, weights: &mut [T; N]) {
        let mut put = |column: usize, count: usize, sigma: T| {
            let places = weights
                .iter_mut()
                .zip(self.prepared.units)
                .skip(column)
                .take(count);
            for (weight, unit) in places {
                *weight = unit / sigma;
            }
        };
        if let Some(tolerance) = &self.instruments.transmission {
            put(OF_ROBOT, OF_TRANSMISSIONS, tolerance.sigma());
        }
        for (index, plane) in (0..).zip(self.instruments.planes) {
            if let Some((_, sigma)) = plane.known {
                put(self.instruments.first_of_plane(index), 1, sigma);
            }
            if let Some(sigma) = plane.level {
                put(
                    self.instruments.first_of_plane(index) + 1,
                    OF_PLANE - 1,
                    sigma,
                );
            }
        }
        for (index, point) in (0..).zip(self.instruments.points) {
            if let Some((_, sigma)) = point.known {
                put(self.instruments.first_of_point(index), OF_POINT, sigma);
            }
        }
        if let (Some(column), Some(sigma)) =
            (self.instruments.of_scale(), self.instruments.noise.scale())
        {
            put(column, 1, sigma);
        }
        let used = OF_ROBOT + self.instruments.unknowns();
        for weight in weights.iter_mut().skip(used) {
            *weight = T::ONE;
        }
        if self.instruments.sensor_frame {
            let first = self.instruments.frame_column();
            let numbers = weights.iter_mut().skip(first).take(OF_FRAME);
            for (number, weight) in numbers.enumerate() {
                if self.prepared.start.is_free(number) {
                    *weight = T::ONE;
                }
            }
        }
    }
}

pub(super) type ObservationMinimizer<T, const N: usize> =
    Minimizer<T, InstrumentsAt<T, N>, ReadingRows<T, N>, N>;

/// A robot calibrated from observations, and the unknowns of the instruments.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationOutcome<T: Real, const N: usize> {
    /// The calibrated robot.
    pub robot: Robot<T>,
    /// All parameters, the robot's 24 first, and their uncertainty.
    pub estimate: Estimate<T, N>,
    unknowns: [T; N],
    frame: RigidTransform<T>,
}

impl<T: Real, const N: usize> ObservationOutcome<T, N> {
    /// A placeholder: the uncalibrated robot.
    pub(super) fn vacant(robot: &Robot<T>) -> Self {
        Self {
            robot: robot.clone(),
            estimate: Estimate::vacant(),
            unknowns: [T::ZERO; N],
            frame: RigidTransform::identity(),
        }
    }

    /// The unknowns at their indices among all parameters; entries before them have no meaning.
    pub const fn unknowns(&self) -> &[T; N] {
        &self.unknowns
    }

    /// The coordinate frame: the transform from the robot's frame to it.
    pub const fn frame(&self) -> RigidTransform<T> {
        self.frame
    }

    /// c (length), a and b of a plane z = c + a x + b y.
    pub fn plane(&self, instruments: &Instruments<'_, T>, plane: u8) -> [T; 3] {
        part(&self.unknowns, instruments.first_of_plane(plane))
    }

    /// x, y and z of a point and the offset of its sensor. Length.
    pub fn point(&self, instruments: &Instruments<'_, T>, point: u8) -> [T; 4] {
        let [x, y, z, offset] = part(&self.unknowns, instruments.first_of_point(point));
        let has_offset = instruments.points.get(usize::from(point));
        let has_offset = has_offset.is_some_and(|point| point.offset);
        [x, y, z, if has_offset { offset } else { T::ZERO }]
    }

    /// The robot's 24 geometric parameters alone; their covariance accounts for all other unknowns. The robot includes
    /// the estimated transmissions.
    pub fn of_robot(&self) -> JointOutcome<T> {
        JointOutcome {
            robot: self.robot.clone(),
            estimate: self.estimate.part(0),
        }
    }
}
