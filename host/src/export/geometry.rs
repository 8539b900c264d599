//! An arm or a tower in the parameters that controllers use, and which of these a controller holds.

use crate::files::Convention;
pub use crate::geometry::Shape;
use crate::import::USUAL_TOWERS;
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::{Arm, Drive, GeometryError};
use nalgebra::{Rotation3, Vector2, Vector3};
use serde::{Deserialize, Serialize, Serializer};
use std::f64::consts::TAU;

/// Towers this close to the usual azimuths are assumed to stand there in the nominal robot, radians.
const USUAL: f64 = 0.1;

impl Shape {
    /// Of a rotary arm, without its tilt and the distance of its plane from the z axis.
    fn of_arm(arm: &Arm<f64>) -> Self {
        let [dx, dy, height, azimuth, _, la_x, la_y, lower] = arm.parameters();
        let (sin, cos) = azimuth.sin_cos();
        Self {
            azimuth,
            radius: dx * cos + dy * sin,
            height,
            upper: la_x.hypot(la_y),
            lower,
            zero: la_y.atan2(la_x),
        }
    }

    /// The three arms of a robot. Towers are taken as upright through the carriages at `joints`; `frame` transforms the
    /// robot's frame to the controller's, whose z axis passes through the centre of the towers.
    pub fn all(robot: &Robot<f64>, joints: &[f64; 3], frame: &RigidTransform<f64>) -> [Self; 3] {
        let arms = robot.arms();
        if robot.drive() == Drive::Rotary {
            return arms.each_ref().map(Self::of_arm);
        }
        let carriages = [0, 1, 2].map(|index| frame.apply(&arms[index].elbow(joints[index])));
        let centre = centre(carriages.map(|at| at.xy()));
        [0, 1, 2].map(|index| {
            let at: Vector3<f64> = carriages[index];
            let out = at.xy() - centre;
            Self {
                azimuth: out.y.atan2(out.x),
                radius: out.norm(),
                height: at.z - joints[index],
                lower: arms[index].lb(),
                ..Self::default()
            }
        })
    }

    /// The azimuth counted from another one in degrees, radians.
    pub(super) fn azimuth_beyond(&self, degrees: f64) -> f64 {
        within_half_turn(self.azimuth - degrees.to_radians())
    }

    /// What controllers hold, as [`Holds::each`].
    pub(super) fn held(&mut self) -> [&mut f64; 6] {
        [
            &mut self.azimuth,
            &mut self.radius,
            &mut self.height,
            &mut self.upper,
            &mut self.lower,
            &mut self.zero,
        ]
    }

    /// The mean of what controllers hold.
    pub(super) fn mean(arms: &[Self; 3]) -> Self {
        let mut mean = Self::default();
        for (index, value) in mean.held().into_iter().enumerate() {
            let own = arms.map(|mut arm| *arm.held()[index]);
            *value = own.iter().sum::<f64>() / 3.0;
        }
        mean
    }
}

/// The centre of the circle through three points; their mean if they are collinear.
fn centre([a, b, c]: [Vector2<f64>; 3]) -> Vector2<f64> {
    let (u, v) = (b - a, c - a);
    let twice = 2.0 * u.perp(&v);
    if !(twice.abs() > 1e-6 * u.norm() * v.norm()) {
        return (a + b + c) / 3.0;
    }
    let (uu, vv) = (u.norm_squared(), v.norm_squared());
    a + Vector2::new(v.y * uu - u.y * vv, u.x * vv - v.x * uu) / twice
}

/// The same angle in (−π, π].
pub(crate) fn within_half_turn(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    sin.atan2(cos)
}

/// The angle from one arm to the next if they were evenly spaced, radians: its sign is the direction of numbering.
fn spacing(arms: &[Shape; 3]) -> f64 {
    let [first, second, _] = arms;
    let counter_clockwise = within_half_turn(second.azimuth - first.azimuth) >= 0.0;
    (if counter_clockwise { TAU } else { -TAU }) / 3.0
}

/// The azimuths of the evenly spaced arms that are nearest to these, radians.
pub(super) fn even_azimuths(arms: &[Shape; 3]) -> [f64; 3] {
    let step = spacing(arms);
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (number, arm) in [0.0, 1.0, 2.0].into_iter().zip(arms) {
        let (sin, cos) = (arm.azimuth - number * step).sin_cos();
        sine += sin;
        cosine += cos;
    }
    [0.0, 1.0, 2.0].map(|number| within_half_turn(sine.atan2(cosine) + number * step))
}

/// The nearest robot with three equal arms 120° apart: its lengths are the means. Towers near 210°, 330° and 90° are
/// assumed to stand there.
///
/// # Errors
/// The means are not a valid robot.
pub fn nearest_symmetric(arms: &[Shape; 3], drive: Drive) -> Result<Robot<f64>, GeometryError> {
    let usual = USUAL_TOWERS.map(f64::to_radians);
    let mut pairs = usual.iter().zip(arms);
    let near = pairs.all(|(usual, arm)| within_half_turn(arm.azimuth - usual).abs() < USUAL);
    let azimuths = if drive == Drive::Linear && near {
        usual
    } else {
        even_azimuths(arms)
    };
    let mean = Shape::mean(arms);
    Shape::robot(&azimuths.map(|azimuth| Shape { azimuth, ..mean }), drive)
}

/// How a controller holds one kind of parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Each {
    /// One value for each arm.
    Arm,
    /// One value for all arms.
    Shared,
    /// No value: it is zero, or fixed in the controller's source.
    #[default]
    Fixed,
}

/// The parameters that a controller holds. No controller holds offset, tilt or scale.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Holds {
    /// The azimuths of the motors in degrees, if the controller's source fixes them; otherwise it holds one for each arm.
    pub azimuths_deg: Option<[f64; 3]>,
    /// Radii of the motor axes or towers minus that of the platform.
    pub radii: Each,
    /// Heights of the motor axes, or zeros of the carriages' travels.
    pub heights: Each,
    /// Whether z = 0 is the plane of the motor axes if the user states no height; otherwise it is below all positions.
    pub from_base_plane: bool,
    /// Upper arms.
    pub upper: Each,
    /// Forearms or rods.
    pub lower: Each,
    /// Joint zeros.
    pub zeros: Each,
}

impl Holds {
    /// Azimuths, radii, heights, upper arms, forearms and joint zeros.
    pub(super) const fn each(&self) -> [Each; 6] {
        let azimuths = match self.azimuths_deg {
            None => Each::Arm,
            Some(_) => Each::Fixed,
        };
        [
            azimuths,
            self.radii,
            self.heights,
            self.upper,
            self.lower,
            self.zeros,
        ]
    }

    /// With azimuths about the internal z axis.
    pub(super) fn turned(mut self, convention: &Convention) -> Self {
        let stated = self.azimuths_deg;
        self.azimuths_deg = stated.map(|all| all.map(|own| convention.angle(own)));
        self
    }

    /// The number of fitted parameters, without the frame.
    pub fn count(&self) -> usize {
        let counts = self.each().map(|each| match each {
            Each::Arm => 3,
            Each::Shared => 1,
            Each::Fixed => 0,
        });
        counts.into_iter().sum()
    }
}

/// The arms in a controller's parameters, in the order of the robot's joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    /// The type of drive.
    pub drive: Drive,
    /// What the controller holds of each.
    pub arms: [Shape; 3],
    /// `motors[k]` is the index of the arm that the controller's motor k drives.
    pub motors: [usize; 3],
    /// The turn about z from the robot's frame to the controller's, radians.
    pub turn: f64,
}

impl Geometry {
    /// The calibrated arms in the controller's parameters, with the mean where it holds one value for all. `height` is the
    /// height of the robot's origin in the controller's frame, mm.
    pub fn start(drive: Drive, arms: &[Shape; 3], holds: &Holds, height: f64) -> Self {
        let mut own = *arms;
        let mut motors = [0, 1, 2];
        let mut turn = 0.0;
        if let Some(fixed) = holds.azimuths_deg {
            let fixed = fixed.map(f64::to_radians);
            if within_half_turn(fixed[1] - fixed[0]).signum() != spacing(arms).signum() {
                motors = [0, 2, 1];
            }
            turn = within_half_turn(fixed[0] - even_azimuths(arms)[0]);
            for (azimuth, arm) in fixed.into_iter().zip(motors) {
                own[arm].azimuth = azimuth;
            }
        }
        let mut mean = Shape::mean(arms);
        for arm in &mut own {
            let held = arm.held().into_iter().zip(mean.held()).zip(holds.each());
            // The azimuths are as above.
            for ((own, mean), each) in held.skip(1) {
                match each {
                    Each::Arm => {}
                    Each::Shared => *own = *mean,
                    Each::Fixed => *own = 0.0,
                }
            }
            if holds.heights != Each::Fixed {
                arm.height += height;
            }
        }
        Self {
            drive,
            arms: own,
            motors,
            turn,
        }
    }

    /// The robot whose inverse kinematics is the controller's, with the robot's joints.
    ///
    /// # Errors
    /// The parameters are not a valid robot.
    pub fn robot(&self) -> Result<Robot<f64>, GeometryError> {
        Shape::robot(&self.arms, self.drive)
    }

    /// The geometry as it is written: lengths to 0.0001 mm, angles to 0.0001°.
    pub(super) fn rounded(mut self) -> Self {
        for arm in &mut self.arms {
            let [azimuth, lengths @ .., zero] = arm.held();
            for angle in [azimuth, zero] {
                *angle = rounded(*angle);
            }
            for length in lengths {
                *length = to_decimals(*length);
            }
        }
        self
    }
}

/// An angle in radians, to 0.0001°.
fn rounded(angle: f64) -> f64 {
    to_decimals(angle.to_degrees()).to_radians()
}

/// To 4 decimals.
pub(super) fn to_decimals(value: f64) -> f64 {
    (value * 1e4).round() / 1e4 + 0.0
}

/// A rigid motion: a position x in the calibrated robot's frame is at R x + (x, y, z) in the controller's, with
/// R = Rz Ry Rx.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Frame {
    /// The shift, mm.
    #[serde(rename = "shift_mm", serialize_with = "coordinates")]
    pub shift: Vector3<f64>,
    /// The turns about x, y and z, radians.
    #[serde(rename = "turn_deg", serialize_with = "in_degrees")]
    pub turns: Vector3<f64>,
}

pub(super) fn coordinates<S: Serializer>(
    own: &Vector3<f64>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    [own.x, own.y, own.z].serialize(serializer)
}

fn in_degrees<S: Serializer>(turns: &Vector3<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    coordinates(&turns.map(f64::to_degrees), serializer)
}

impl Frame {
    /// The transform from the robot's frame to the controller's.
    pub fn transform(&self) -> RigidTransform<f64> {
        let [x, y, z] = [self.turns.x, self.turns.y, self.turns.z];
        RigidTransform {
            rotation: Rotation3::from_euler_angles(x, y, z).into_inner(),
            translation: self.shift,
        }
    }

    /// The smallest rotation after which z is the height above a plane, `normal · x − offset`.
    pub fn on_plane(normal: &Vector3<f64>, offset: f64) -> Self {
        let turn = Rotation3::rotation_between(normal, &Vector3::z()).unwrap_or_default();
        let (x, y, z) = turn.euler_angles();
        Self {
            shift: Vector3::new(0.0, 0.0, -offset),
            turns: Vector3::new(x, y, z),
        }
    }

    /// This motion between internal axes, for positions in the axes of a robot file and of a controller.
    pub(super) fn between(self, from: &Convention, to: &Convention) -> Self {
        if [from, to].iter().all(|own| own.height(1.0) > 0.0) {
            return self;
        }
        let rotation = to.turn() * self.transform().rotation * from.turn();
        let (x, y, z) = Rotation3::from_matrix_unchecked(rotation).euler_angles();
        Self {
            shift: to.vector(&self.shift),
            turns: Vector3::new(x, y, z),
        }
    }

    /// The frame to 0.0001 mm and 0.0001°, as it is stated.
    pub(super) fn rounded(&self) -> Self {
        Self {
            shift: self.shift.map(to_decimals),
            turns: self.turns.map(rounded),
        }
    }
}
