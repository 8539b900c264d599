//! Kinematics of many poses at once, in the widest vector instructions of the processor.
//!
//! The formulas are those of the core (`core/src/kinematics.rs`) without its branches. Results agree with the core's to
//! about 1e-13 of the robot's size: sine, cosine and arctangent are other polynomials, and sums are rounded in another order. A pose of which
//! that does not hold, within 1 % of a singularity or outside the limits, is NaN here; the caller leaves it to the core.

use crate::wide::{Vectors, Which, Wide};
use delta_cal::robot::{Arm, Drive};
use delta_cal_host::RobotFile;
use delta_cal_host::files::robot_file::Tool;
use pulp::{Arch, Simd, WithSimd};

/// Poses that are computed with one call.
pub(crate) const LANES: usize = 64;
/// A number of each pose for each of its coordinates.
pub(crate) type Block<const WIDTH: usize> = [[f64; LANES]; WIDTH];

/// A pose is this far from every singularity, as a sine.
const CLEAR: f64 = 0.01;

/// How far a joint may be outside the limits, because encoder zeros differ: a degree or a millimetre.
pub(crate) fn margin(robot: &RobotFile) -> f64 {
    match robot.limits.drive() {
        Drive::Rotary => 1f64.to_radians(),
        Drive::Linear => 1.0,
    }
}

/// A robot whose joints are exact and whose platform does not tilt.
pub(crate) struct Lanes {
    arms: [ArmNumbers; 3],
    up: [f64; 3],
    linear: bool,
    /// Joints that are within the limits.
    range: [f64; 2],
    /// What the convention multiplies joints and coordinates by.
    sense: f64,
    axes: [f64; 3],
    /// The point that moves, from the platform point, mm, in the convention's axes.
    place: [f64; 3],
}

struct ArmNumbers {
    d: [f64; 3],
    u: [f64; 3],
    v: [f64; 3],
    lb: f64,
    lb_squared: f64,
    /// Length of v: the upper arm, or the scale of a linear drive.
    speed: f64,
}

impl ArmNumbers {
    fn of(arm: &Arm<f64>) -> Self {
        Self {
            d: arm.d().into(),
            u: arm.basis().u.into(),
            v: arm.basis().v.into(),
            lb: arm.lb(),
            lb_squared: arm.lb() * arm.lb(),
            speed: arm.basis().v.norm(),
        }
    }

    /// The elbow, and how it moves with the joint.
    #[inline(always)]
    fn elbow<S: Simd>(&self, q: Wide<S>, linear: bool) -> (Vectors<S>, Vectors<S>) {
        if linear {
            let (zero, one) = (Wide::all(q.0, 0.0), Wide::all(q.0, 1.0));
            let elbow = Vectors::sum(self.d, (self.u, zero), (self.v, q));
            return (elbow, Vectors::sum([0.0; 3], (self.u, zero), (self.v, one)));
        }
        let (sine, cosine) = q.sine_cosine();
        (
            Vectors::sum(self.d, (self.u, cosine), (self.v, sine)),
            Vectors::sum([0.0; 3], (self.u, -sine), (self.v, cosine)),
        )
    }

    /// The joint that brings the forearm to `x`, the elbow there, and whether it is clear of the edge of what it reaches.
    #[inline(always)]
    fn joint<S: Simd>(&self, x: Vectors<S>, linear: bool) -> (Wide<S>, Vectors<S>, Which<S>) {
        let w = x - self.d;
        let (a, b) = (w.along(self.u), w.along(self.v));
        let speed_squared = self.speed * self.speed;
        if linear {
            let along = b * (1.0 / speed_squared);
            let [v1, v2, v3] = self.v;
            let beside = w - Vectors([along * v1, along * v2, along * v3]);
            let rise_squared = -beside.dot(beside) + self.lb_squared;
            let s = along + (rise_squared * (1.0 / speed_squared)).sqrt();
            let (elbow, _) = self.elbow(s, true);
            let least = Wide::all(s.0, CLEAR * CLEAR * self.lb_squared);
            return (s, elbow, rise_squared.above(least));
        }
        let c = (w.dot(w) + (speed_squared - self.lb_squared)) * 0.5;
        let reach_squared = a * a + b * b;
        let root_squared = reach_squared - c * c;
        let s = root_squared.sqrt();
        let (sine, cosine) = (b * c - a * s, a * c + b * s);
        let inverse = Wide::all(c.0, 1.0) / reach_squared;
        let elbow = Vectors::sum(self.d, (self.u, cosine * inverse), (self.v, sine * inverse));
        let clear = root_squared.above(reach_squared * (CLEAR * CLEAR));
        (sine.angle_over(cosine), elbow, clear)
    }
}

/// The platform point, the forearms, how the elbows move, and which poses are clear.
struct Poses<S: Simd> {
    x: Vectors<S>,
    forearms: [Vectors<S>; 3],
    moves: [Vectors<S>; 3],
    clear: Which<S>,
}

impl Lanes {
    /// `None` of transmissions and of a platform that tilts.
    pub(crate) fn of(file: &RobotFile, point: &Tool) -> Option<Self> {
        let arms = file.robot.arms();
        if point.parallelograms.is_some() || arms.iter().any(|own| own.transmission().is_some()) {
            return None;
        }
        let margin = margin(file);
        let limits = file.limits;
        Some(Self {
            arms: arms.each_ref().map(ArmNumbers::of),
            up: file.robot.up().into(),
            linear: file.robot.drive() == Drive::Linear,
            range: [limits.minimum() - margin, limits.maximum() + margin],
            sense: file.convention.sense(),
            axes: file.convention.axes(),
            place: file.convention.vector(&point.place).into(),
        })
    }

    #[inline(always)]
    fn poses<S: Simd>(&self, [q1, q2, q3]: [Wide<S>; 3]) -> Poses<S> {
        let [arm1, arm2, arm3] = &self.arms;
        let (q1, q2, q3) = (q1 * self.sense, q2 * self.sense, q3 * self.sense);
        let (b1, move1) = arm1.elbow(q1, self.linear);
        let (b2, move2) = arm2.elbow(q2, self.linear);
        let (b3, move3) = arm3.elbow(q3, self.linear);
        let (edge2, edge3) = (b2 - b1, b3 - b1);
        let normal = edge2.cross(edge3);
        let normal_squared = normal.dot(normal);
        let (squared2, squared3) = (edge2.dot(edge2), edge3.dot(edge3));
        let inverse = Wide::all(q1.0, 1.0) / normal_squared;
        let along2 = (squared2 + (arm1.lb_squared - arm2.lb_squared)) * (inverse * 0.5);
        let along3 = (squared3 + (arm1.lb_squared - arm3.lb_squared)) * (inverse * 0.5);
        let within = edge3
            .cross(normal)
            .times(along2, normal.cross(edge2) * along3);
        let height_squared = -within.dot(within) + arm1.lb_squared;
        let height = (height_squared * inverse).sqrt();
        let below = -height.signed_by(normal.along(self.up));
        // From the first elbow.
        let forearm = normal.times(below, within);
        let least = Wide::all(q1.0, CLEAR * CLEAR * arm1.lb_squared);
        let clear = normal_squared.above(squared2 * squared3 * (CLEAR * CLEAR))
            & height_squared.above(least)
            & q1.is_within(self.range)
            & q2.is_within(self.range)
            & q3.is_within(self.range);
        Poses {
            x: forearm - (Vectors([Wide::all(q1.0, 0.0); 3]) - b1),
            forearms: [forearm, forearm - edge2, forearm - edge3],
            moves: [move1, move2, move3],
            clear,
        }
    }
}

/// A function of the three numbers of a pose.
pub(crate) trait Kernel<const WIDTH: usize>: Sync + Sized {
    /// NaN of poses that are not clear.
    fn of<S: Simd>(&self, from: [Wide<S>; 3]) -> [Wide<S>; WIDTH];

    /// The function of all.
    fn fill(&self, from: &Block<3>, into: &mut Block<WIDTH>) {
        Arch::new().dispatch(Fill(self, from, into));
    }
}

struct Fill<'a, K, const WIDTH: usize>(&'a K, &'a Block<3>, &'a mut Block<WIDTH>);

impl<K: Kernel<WIDTH>, const WIDTH: usize> WithSimd for Fill<'_, K, WIDTH> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self(kernel, [first, second, third], into) = self;
        let width = S::F64_LANES;
        for lane in (0..LANES).step_by(width) {
            let found = kernel.of([
                Wide(simd, simd.partial_load_f64s(&first[lane..lane + width])),
                Wide(simd, simd.partial_load_f64s(&second[lane..lane + width])),
                Wide(simd, simd.partial_load_f64s(&third[lane..lane + width])),
            ]);
            for place in 0..WIDTH {
                simd.partial_store_f64s(&mut into[place][lane..lane + width], found[place].1);
            }
        }
    }
}

/// No kernel.
pub(crate) enum Exact {}

impl<const WIDTH: usize> Kernel<WIDTH> for Exact {
    fn of<S: Simd>(&self, _: [Wide<S>; 3]) -> [Wide<S>; WIDTH] {
        match *self {}
    }
}

/// Joints to positions.
pub(crate) struct Forward(pub(crate) Lanes);

impl Kernel<3> for Forward {
    #[inline(always)]
    fn of<S: Simd>(&self, q: [Wide<S>; 3]) -> [Wide<S>; 3] {
        let own = &self.0;
        let Poses {
            x: Vectors([x, y, z]),
            clear,
            ..
        } = own.poses(q);
        let nan = Wide::all(x.0, f64::NAN);
        let ([x_axis, y_axis, z_axis], [a, b, c]) = (own.axes, own.place);
        [
            (x * x_axis + a).where_it(clear, nan),
            (y * y_axis + b).where_it(clear, nan),
            (z * z_axis + c).where_it(clear, nan),
        ]
    }
}

/// Positions to joints.
pub(crate) struct Inverse(pub(crate) Lanes);

impl Kernel<3> for Inverse {
    #[inline(always)]
    fn of<S: Simd>(&self, [x, y, z]: [Wide<S>; 3]) -> [Wide<S>; 3] {
        let own = &self.0;
        let ([x_axis, y_axis, z_axis], [a, b, c]) = (own.axes, own.place);
        let x = Vectors([(x - a) * x_axis, (y - b) * y_axis, (z - c) * z_axis]);
        let [arm1, arm2, arm3] = &own.arms;
        let (q1, b1, clear1) = arm1.joint(x, own.linear);
        let (q2, b2, clear2) = arm2.joint(x, own.linear);
        let (q3, b3, clear3) = arm3.joint(x, own.linear);
        let normal = (b2 - b1).cross(b3 - b1);
        // The platform hangs below the plane of the elbows.
        let depth = -(x - b1).dot(normal).signed_by(normal.along(own.up));
        let least = normal.dot(normal) * (CLEAR * CLEAR * arm1.lb_squared);
        let clear = clear1
            & clear2
            & clear3
            & depth.above(Wide::all(q1.0, 0.0))
            & (depth * depth).above(least)
            & q1.is_within(own.range)
            & q2.is_within(own.range)
            & q3.is_within(own.range);
        let nan = Wide::all(q1.0, f64::NAN);
        [
            (q1 * own.sense).where_it(clear, nan),
            (q2 * own.sense).where_it(clear, nan),
            (q3 * own.sense).where_it(clear, nan),
        ]
    }
}

/// Joints to the nine derivatives of positions, row by row.
pub(crate) struct Derivatives(pub(crate) Lanes);

impl Kernel<9> for Derivatives {
    #[inline(always)]
    fn of<S: Simd>(&self, q: [Wide<S>; 3]) -> [Wide<S>; 9] {
        let own = &self.0;
        let [arm1, arm2, arm3] = &own.arms;
        let Poses {
            forearms: [w1, w2, w3],
            moves: [move1, move2, move3],
            clear,
            ..
        } = own.poses(q);
        let (normal1, normal2, normal3) = (w2.cross(w3), w3.cross(w1), w1.cross(w2));
        let volume = w1.dot(normal1);
        let (by1, by2, by3) = (w1.dot(move1), w2.dot(move2), w3.dot(move3));
        let above = |found: Wide<S>, most: f64| found.abs().above(Wide::all(found.0, CLEAR * most));
        let clear = clear
            & above(volume, arm1.lb * arm2.lb * arm3.lb)
            & above(by1, arm1.lb * arm1.speed)
            & above(by2, arm2.lb * arm2.speed)
            & above(by3, arm3.lb * arm3.speed);
        let inverse = Wide::all(volume.0, own.sense) / volume;
        let inverse = inverse.where_it(clear, Wide::all(volume.0, f64::NAN));
        let (by1, by2, by3) = (by1 * inverse, by2 * inverse, by3 * inverse);
        let (Vectors([x1, y1, z1]), Vectors([x2, y2, z2]), Vectors([x3, y3, z3])) =
            (normal1 * by1, normal2 * by2, normal3 * by3);
        let [x, y, z] = own.axes;
        [
            x1 * x,
            x2 * x,
            x3 * x,
            y1 * y,
            y2 * y,
            y3 * y,
            z1 * z,
            z2 * z,
            z3 * z,
        ]
    }
}
