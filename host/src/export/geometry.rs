//! What a controller holds: which lengths and angles, for each arm or for all.

use super::nominal::{counter_clockwise, first_azimuth};
use super::shape::{ArmShape, within_half_turn};
use delta_cal::robot::{GeometryError, ParameterKind};
use delta_cal::{Robot, Tolerance};

/// How a controller holds one kind of parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Each {
    /// One value for each arm.
    Arm,
    /// One value for all arms.
    Shared,
    /// No value: it is zero, or as the controller's source has it.
    Fixed,
}

/// What a controller holds. What is not named here (the side, the tilt) no controller holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holds {
    /// The azimuths of the motors, if the controller's source fixes them, in degrees; otherwise it
    /// holds one for each arm.
    pub fixed_azimuths: Option<[f64; 3]>,
    /// Radii of the motor axes less that of the platform.
    pub radii: Each,
    /// Heights of the motor axes.
    pub heights: Each,
    /// Upper arms.
    pub upper: Each,
    /// Forearms.
    pub lower: Each,
    /// Joint zeros.
    pub zeros: Each,
}

impl Holds {
    /// How many numbers the fit determines, without the frame.
    pub fn count(&self) -> usize {
        let azimuths = if self.fixed_azimuths.is_none() { 3 } else { 0 };
        let others = [self.radii, self.heights, self.upper, self.lower, self.zeros];
        let of = |each: Each| match each {
            Each::Arm => 3,
            Each::Shared => 1,
            Each::Fixed => 0,
        };
        azimuths + others.into_iter().map(of).sum::<usize>()
    }
}

/// The arms as a controller has them, in the order of the robot's joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    /// Side and tilt are zero.
    pub arms: [ArmShape; 3],
    /// `motors[k]` is the arm, counted from 0, that the controller's motor k drives.
    pub motors: [usize; 3],
    /// The turn about z from the robot's frame to the controller's, radians.
    pub turn: f64,
}

/// A number that the fit may change.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Free {
    field: Field,
    /// `None` for all arms.
    arm: Option<usize>,
    /// One σ: mm or radians.
    pub(crate) sigma: f64,
}

#[derive(Debug, Clone, Copy)]
enum Field {
    Azimuth,
    Radius,
    Height,
    Upper,
    Lower,
    Zero,
}

impl Field {
    const fn of(self, arm: &mut ArmShape) -> &mut f64 {
        match self {
            Self::Azimuth => &mut arm.azimuth,
            Self::Radius => &mut arm.radius,
            Self::Height => &mut arm.height,
            Self::Upper => &mut arm.upper,
            Self::Lower => &mut arm.lower,
            Self::Zero => &mut arm.zero,
        }
    }

    const fn kind(self) -> ParameterKind {
        match self {
            Self::Azimuth | Self::Zero => ParameterKind::Angle,
            _ => ParameterKind::Length,
        }
    }
}

impl Geometry {
    /// The calibrated arms as far as the controller holds them, the mean where it has one value for all.
    /// `height` is the height of the robot's origin in the controller's frame, mm.
    pub fn start(arms: &[ArmShape; 3], holds: &Holds, height: f64) -> Self {
        let mut own = *arms;
        let mut motors = [0, 1, 2];
        let mut turn = 0.0;
        let first = first_azimuth(arms);
        if let Some(fixed) = holds.fixed_azimuths {
            let fixed = fixed.map(f64::to_radians);
            let [zeroth, one, _] = fixed;
            if (within_half_turn(one - zeroth) >= 0.0) != counter_clockwise(arms) {
                motors = [0, 2, 1];
            }
            turn = within_half_turn(zeroth - first);
            for (azimuth, arm) in fixed.into_iter().zip(motors) {
                own[arm].azimuth = azimuth;
            }
        }
        let mean = |value: fn(&ArmShape) -> f64| arms.iter().map(value).sum::<f64>() / 3.0;
        let held = |each: Each, own: f64, mean: f64, fixed: f64| match each {
            Each::Arm => own,
            Each::Shared => mean,
            Each::Fixed => fixed,
        };
        for arm in &mut own {
            arm.side = 0.0;
            arm.tilt = 0.0;
            arm.radius = held(holds.radii, arm.radius, mean(|arm| arm.radius), 0.0);
            let at = height + arm.height;
            arm.height = held(holds.heights, at, height + mean(|arm| arm.height), 0.0);
            arm.upper = held(holds.upper, arm.upper, mean(|arm| arm.upper), 0.0);
            arm.lower = held(holds.lower, arm.lower, mean(|arm| arm.lower), 0.0);
            arm.zero = held(holds.zeros, arm.zero, mean(|arm| arm.zero), 0.0);
        }
        Self {
            arms: own,
            motors,
            turn,
        }
    }

    /// The robot whose inverse kinematics is the controller's, with the robot's joint angles.
    ///
    /// # Errors
    /// The lengths and angles are no robot.
    pub fn robot(&self) -> Result<Robot<f64>, GeometryError> {
        Robot::from_parameters(self.arms.map(|arm| arm.parameters()))
    }

    /// The arm that the controller's motor drives.
    pub fn arm_of_motor(&self, motor: usize) -> &ArmShape {
        let [first, second, third] = &self.arms;
        match self.motors.get(motor) {
            Some(0) => first,
            Some(1) => second,
            _ => third,
        }
    }

    /// The arms in the order of the controller's motors.
    pub fn by_motor(&self) -> [&ArmShape; 3] {
        [0, 1, 2].map(|motor| self.arm_of_motor(motor))
    }

    pub(crate) fn free(holds: &Holds, tolerance: &Tolerance<f64>) -> Vec<Free> {
        let azimuths = if holds.fixed_azimuths.is_none() {
            Each::Arm
        } else {
            Each::Fixed
        };
        let fields = [
            (Field::Azimuth, azimuths),
            (Field::Radius, holds.radii),
            (Field::Height, holds.heights),
            (Field::Upper, holds.upper),
            (Field::Lower, holds.lower),
            (Field::Zero, holds.zeros),
        ];
        let mut free = Vec::new();
        for (field, each) in fields {
            let arms: &[Option<usize>] = match each {
                Each::Arm => &[Some(0), Some(1), Some(2)],
                Each::Shared => &[None],
                Each::Fixed => &[],
            };
            let sigma = match field.kind() {
                ParameterKind::Length => tolerance.of(delta_cal::Parameter::Lb),
                ParameterKind::Angle | ParameterKind::Ratio => {
                    tolerance.of(delta_cal::Parameter::Theta)
                }
            };
            free.extend(arms.iter().map(|arm| Free {
                field,
                arm: *arm,
                sigma,
            }));
        }
        free
    }

    /// With these changes, in σ.
    pub(crate) fn changed(mut self, free: &[Free], by: &[f64]) -> Self {
        for (own, by) in free.iter().zip(by) {
            for (index, arm) in self.arms.iter_mut().enumerate() {
                if own.arm.is_none_or(|only| only == index) {
                    *own.field.of(arm) += by * own.sigma;
                }
            }
        }
        self
    }

    /// As it is written: lengths to 0.0001 mm, angles to 0.0001°.
    pub(crate) fn rounded(mut self) -> Self {
        let length = |value: &mut f64| *value = (*value * 1e4).round() / 1e4;
        for arm in &mut self.arms {
            length(&mut arm.radius);
            length(&mut arm.height);
            length(&mut arm.upper);
            length(&mut arm.lower);
            for angle in [&mut arm.azimuth, &mut arm.zero] {
                *angle = ((angle.to_degrees() * 1e4).round() / 1e4).to_radians();
            }
        }
        self
    }
}
