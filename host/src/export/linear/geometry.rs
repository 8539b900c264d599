//! What a controller of a robot with towers holds.

use crate::export::shape::within_half_turn;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::{Arm, GeometryError, SymmetricLinearRobot};
use delta_cal::{ArmIndex, Parameter, Robot, Tolerance};
use nalgebra::Vector3;

/// Upright towers at one radius. mm and radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearGeometry {
    /// From the centre to each tower, platform offset subtracted.
    pub radius: f64,
    /// Where the towers stand.
    pub azimuths: [f64; 3],
    /// The rods.
    pub rods: [f64; 3],
    /// The height of the rod's upper end at travel 0.
    pub zeros: [f64; 3],
}

/// How many numbers that is.
pub const PARAMETERS: usize = 10;

impl LinearGeometry {
    /// The calibrated robot's towers where its carriages are at these travels, upright.
    /// `frame` takes the robot's frame to the controller's.
    pub(super) fn start(
        robot: &Robot<f64>,
        travels: &[f64; 3],
        frame: &RigidTransform<f64>,
    ) -> Self {
        let carriages = ArmIndex::ALL.map(|index| {
            let elbow = robot.arm(index).elbow(travels[index.index()]);
            frame.apply(&elbow)
        });
        let centre = centre(&carriages);
        let [a, b, c] = carriages.map(|at| (at - centre).xy());
        let [x, y, z] = travels;
        let [first, second, third] = carriages.map(|at| at.z);
        Self {
            radius: (a.norm() + b.norm() + c.norm()) / 3.0,
            azimuths: [a, b, c].map(|at| at.y.atan2(at.x)),
            rods: ArmIndex::ALL.map(|index| robot.arm(index).lb()),
            zeros: [first - x, second - y, third - z],
        }
    }

    /// The robot whose inverse kinematics is the controller's, with the robot's travels.
    ///
    /// # Errors
    /// The lengths and angles are no robot.
    pub fn robot(&self) -> Result<Robot<f64>, GeometryError> {
        let arm = |tower: usize| {
            let (sine, cosine) = self.azimuths[tower].sin_cos();
            let (x, y) = (self.radius * cosine, self.radius * sine);
            Arm::linear([x, y, self.zeros[tower], 0.0, 0.0, 1.0, self.rods[tower]])
        };
        Robot::new([arm(0)?, arm(1)?, arm(2)?])
    }

    /// With these changes, in σ.
    pub(super) fn changed(mut self, tolerance: &Tolerance<f64>, by: &[f64]) -> Self {
        let length = tolerance.of(Parameter::Lb);
        let zero = tolerance.of(Parameter::Zero);
        let azimuth = length / self.radius.max(1.0);
        let mut by = by.iter().copied();
        let mut next = || by.next().unwrap_or(0.0);
        self.radius += length * next();
        for value in &mut self.azimuths {
            *value += azimuth * next();
        }
        for value in &mut self.rods {
            *value += length * next();
        }
        for value in &mut self.zeros {
            *value += zero * next();
        }
        self
    }

    /// As it is written: lengths to 0.0001 mm, angles to 0.0001°.
    pub(super) fn rounded(mut self) -> Self {
        self.radius = to_decimals(self.radius);
        self.rods = self.rods.map(to_decimals);
        self.zeros = self.zeros.map(to_decimals);
        self.azimuths = self
            .azimuths
            .map(|angle| ((angle.to_degrees() * 1e4).round() / 1e4).to_radians());
        self
    }

    /// The height of the nozzle at x = y = 0 with each carriage at its end stop, mm.
    pub fn endstops(&self, home: &[f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|tower| {
            let rod = self.rods[tower];
            let above = (rod * rod - self.radius * self.radius).max(0.0).sqrt();
            home[tower] + self.zeros[tower] - above
        })
    }

    /// What is added to the azimuths 210°, 330° and 90°, radians.
    pub fn corrections(&self) -> [f64; 3] {
        let mut corrections = self.azimuths;
        for (own, usual) in corrections.iter_mut().zip([210f64, 330.0, 90.0]) {
            *own = within_half_turn(*own - usual.to_radians());
        }
        corrections
    }
}

fn to_decimals(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// Of the circle through three points, as seen from above; their mean if they are on one line.
fn centre(points: &[Vector3<f64>; 3]) -> Vector3<f64> {
    let [a, b, c] = points.map(|point| point.xy());
    let (u, v) = (b - a, c - a);
    let twice = 2.0 * (u.x * v.y - u.y * v.x);
    let mean = (a + b + c) / 3.0;
    let at = if twice.abs() > 1e-6 * u.norm() * v.norm() {
        let (uu, vv) = (u.norm_squared(), v.norm_squared());
        let x = (v.y * uu - u.y * vv) / twice;
        let y = (u.x * vv - v.x * uu) / twice;
        a + nalgebra::Vector2::new(x, y)
    } else {
        mean
    };
    Vector3::new(at.x, at.y, 0.0)
}

/// The robot with equal upright towers that is nearest to a calibrated one.
pub(super) fn nearest_symmetric(
    robot: &Robot<f64>,
    travels: &[f64; 3],
) -> Result<Robot<f64>, GeometryError> {
    let own = LinearGeometry::start(robot, travels, &RigidTransform::identity());
    let mean = |values: [f64; 3]| values.iter().sum::<f64>() / 3.0;
    let even = LinearGeometry {
        rods: [mean(own.rods); 3],
        zeros: [mean(own.zeros); 3],
        ..own
    };
    // Its towers keep their azimuths only if these are the usual ones.
    let usual = SymmetricLinearRobot {
        tower_radius: even.radius,
        forearm: mean(own.rods),
    };
    let near = own.corrections().iter().all(|by| by.abs() < 0.1);
    if !near {
        return even.robot();
    }
    let zero = mean(own.zeros);
    let parameters = usual.robot()?.parameters().map(|mut arm| {
        arm[Parameter::Zero.index()] = zero;
        arm
    });
    usual.robot()?.with_parameters(parameters)
}
