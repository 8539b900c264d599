//! Kinematics of many poses at once, in the widest vector instructions of the processor.
//!
//! The formulas are those of the core (`core/src/kinematics.rs`) without its branches. Results agree with the core's to
//! about 1e-14 of the robot's size, those in 32 bits to about 1e-6: sine, cosine and arcsine are other polynomials, and sums
//! are rounded in another order. A pose of which that does not hold, near a singularity or outside the limits, is NaN
//! here; the caller leaves it to the core.

#![allow(
    clippy::needless_bitwise_bool,
    clippy::needless_range_loop,
    reason = "loops without branches become vector instructions"
)]

use crate::wide::{Lane, Vector, cross, dot, less, sum, times};
use delta_cal::robot::{Arm, Drive};
use delta_cal_host::RobotFile;
use delta_cal_host::files::convention::Convention;
use delta_cal_host::files::robot_file::Tool;
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::marker::PhantomData;

/// Poses that are computed with one call.
pub(crate) const LANES: usize = 64;

/// How far a joint may be outside the limits, because encoder zeros differ: a degree or a millimetre.
pub(crate) fn margin(robot: &RobotFile) -> f64 {
    match robot.limits.drive() {
        Drive::Rotary => 1f64.to_radians(),
        Drive::Linear => 1.0,
    }
}

/// A robot whose joints are exact and whose platform does not tilt, in the axes and with the joints of its convention: there
/// the same formulas hold, as only signs differ. Joints count from the middle of the limits, where angles within these are
/// right ones at most.
pub(crate) struct Lanes<N> {
    arms: [ArmNumbers<N>; 3],
    up: [N; 3],
    linear: bool,
    /// Joints that are within the limits: the middle, and how far from there.
    range: [N; 2],
}

struct ArmNumbers<N> {
    /// With the point that moves, from the platform point.
    d: [N; 3],
    u: [N; 3],
    v: [N; 3],
    lb: N,
    /// Length of v, negative where joints count upwards: the upper arm, or the scale of a linear drive.
    speed: N,
    /// Of w·w / 2 from there: the joint's u·w cos q + v·w sin q.
    offset: N,
}

fn numbers<N: Lane>(vector: Vector3<f64>) -> Vector<N> {
    <[f64; 3]>::from(vector).map(N::of)
}

/// Sine and cosine of a joint; of a linear drive the travel and 0.
type Turn<N> = [N; 2];

impl<N: Lane> ArmNumbers<N> {
    fn of(arm: &Arm<f64>, convention: &Convention, place: &Vector3<f64>, middle: f64) -> Self {
        let (basis, sense) = (arm.basis(), convention.sense());
        let (speed, lb) = (basis.v.norm(), arm.lb());
        let (d, u, v) = (arm.d() + place, basis.u, basis.v * sense);
        let (sine, cosine) = middle.sin_cos();
        let (d, u, v) = match arm.drive() {
            Drive::Rotary => (d, u * cosine + v * sine, v * cosine - u * sine),
            Drive::Linear => (d + v * middle, u, v),
        };
        Self {
            d: numbers(convention.vector(&d)),
            u: numbers(convention.vector(&u)),
            v: numbers(convention.vector(&v)),
            lb: N::of(lb),
            speed: N::of(speed * sense),
            offset: N::of((speed * speed - lb * lb) / 2.0),
        }
    }

    #[inline(always)]
    fn elbow(&self, [sine, cosine]: Turn<N>) -> Vector<N> {
        sum(self.d, (self.u, cosine), (self.v, sine))
    }

    /// How the elbow moves with the joint.
    #[inline(always)]
    fn motion<const LINEAR: bool>(&self, [sine, cosine]: Turn<N>) -> Vector<N> {
        if LINEAR {
            return self.v;
        }
        sum([N::default(); 3], (self.u, -sine), (self.v, cosine))
    }

    /// Whether it is not stretched, given w·v: then the joint moves the platform at all.
    #[inline(always)]
    fn moves(&self, by: N) -> bool {
        by.size() > (self.lb * self.speed).size() * N::of(1e-3 * N::CLEAR)
    }

    /// What brings the forearm to a position; NaN at the edge of what it reaches.
    #[inline(always)]
    fn reach<const LINEAR: bool>(&self, x: Vector<N>) -> Turn<N> {
        let long = self.lb * self.lb;
        let (least, nearly) = (
            N::of(N::CLEAR * N::CLEAR),
            N::of(0.04 * N::CLEAR * N::CLEAR),
        );
        let w = less(x, self.d);
        let (a, b) = (dot(w, self.u), dot(w, self.v));
        if LINEAR {
            let along = b / (self.speed * self.speed);
            let beside = times(self.v, -along, w);
            let root = long - dot(beside, beside);
            let travel = along + root.root() / self.speed;
            return [
                if root > long * least {
                    travel
                } else {
                    N::nan()
                },
                N::default(),
            ];
        }
        let c = dot(w, w).times(N::of(0.5), self.offset);
        // From the joint's axis in its plane.
        let squared = a.times(a, b * b);
        let root = squared - c * c;
        let (s, inverse) = (root.root().signed_by(self.speed), N::of(1.0) / squared);
        let sine = b.times(c, -(a * s)) * inverse;
        let cosine = a.times(c, b * s) * inverse;
        let clear = root > squared * nearly;
        [if clear { sine } else { N::nan() }, cosine]
    }
}

/// The platform point, the forearms, and whether the pose is clear.
struct Pose<N> {
    x: Vector<N>,
    forearms: [Vector<N>; 3],
    clear: bool,
}

impl<N: Lane> Lanes<N> {
    /// `None` of transmissions and of a platform that tilts.
    pub(crate) fn of(file: &RobotFile, point: &Tool) -> Option<Self> {
        let arms = file.robot.arms();
        if point.parallelograms.is_some() || arms.iter().any(|own| own.transmission().is_some()) {
            return None;
        }
        let (low, high) = file
            .convention
            .limits(file.limits.minimum(), file.limits.maximum());
        let middle = N::of(f64::midpoint(low, high));
        // More than a turn is no angle in radians.
        let most = match file.robot.drive() {
            Drive::Rotary => FRAC_PI_2.min(TAU - middle.into().abs()),
            Drive::Linear => f64::INFINITY,
        };
        Some(Self {
            arms: arms
                .each_ref()
                .map(|own| ArmNumbers::of(own, &file.convention, &point.place, middle.into())),
            up: numbers(file.convention.vector(&file.robot.up())),
            linear: file.robot.drive() == Drive::Linear,
            range: [middle, N::of(most.min((high - low) / 2.0 + margin(file)))],
        })
    }

    /// Whether the joints, from the middle, are within the limits.
    #[inline(always)]
    fn within(&self, [q1, q2, q3]: Vector<N>) -> bool {
        q1.size().larger(q2.size()).larger(q3.size()) < self.range[1]
    }

    #[inline(always)]
    fn pose(&self, q: Vector<N>, turns: [Turn<N>; 3]) -> Pose<N> {
        let [arm1, arm2, arm3] = &self.arms;
        let (long1, long2, long3) = (arm1.lb * arm1.lb, arm2.lb * arm2.lb, arm3.lb * arm3.lb);
        let b1 = arm1.elbow(turns[0]);
        let (edge2, edge3) = (
            less(arm2.elbow(turns[1]), b1),
            less(arm3.elbow(turns[2]), b1),
        );
        let normal = cross(edge2, edge3);
        let normal_squared = dot(normal, normal);
        let (squared2, squared3) = (dot(edge2, edge2), dot(edge3, edge3));
        let inverse = N::of(1.0) / normal_squared;
        let half = inverse * N::of(0.5);
        let along2 = (squared2 + (long1 - long2)) * half;
        let along3 = (squared3 + (long1 - long3)) * half;
        let other = times(cross(normal, edge2), along3, [N::default(); 3]);
        let within = times(cross(edge3, normal), along2, other);
        let height_squared = long1 - dot(within, within);
        let height = (height_squared * inverse).root();
        // From the first elbow, downwards.
        let below = -height.signed_by(dot(normal, self.up));
        let forearm = times(normal, below, within);
        let clear = N::of(N::CLEAR * N::CLEAR);
        Pose {
            x: times(forearm, N::of(1.0), b1),
            forearms: [forearm, less(forearm, edge2), less(forearm, edge3)],
            // Without branches.
            clear: (normal_squared > squared2 * squared3 * clear)
                & (height_squared > long1 * clear)
                & self.within(less(q, [self.range[0]; 3])),
        }
    }
}

/// What one call needs beside its rows, where the processor loads it fastest.
#[repr(align(64))]
pub(crate) struct Room<N> {
    columns: [[N; LANES]; 3],
    turns: [[[N; LANES]; 2]; 3],
    found: [[N; LANES]; 9],
}

impl<N: Lane> Room<N> {
    pub(crate) fn new() -> Self {
        Self {
            columns: [[N::default(); LANES]; 3],
            turns: [[[N::default(); LANES]; 2]; 3],
            found: [[N::default(); LANES]; 9],
        }
    }
}

/// A function of the three numbers of a pose, in two steps: of shorter ones the processor overlaps more.
pub(crate) trait Kernel<const WIDTH: usize>: Sync {
    /// The joint of an arm.
    #[inline(always)]
    fn turn<N: Lane, const LINEAR: bool>(own: &Lanes<N>, arm: usize, q: Vector<N>) -> Turn<N> {
        let joint = q[arm] - own.range[0];
        if LINEAR {
            return [joint, N::default()];
        }
        joint.sine_cosine()
    }

    /// The function, and whether it holds of the pose.
    #[inline(always)]
    fn of<N: Lane, const LINEAR: bool>(
        _: &Lanes<N>,
        _: Vector<N>,
        _: [Turn<N>; 3],
    ) -> ([N; WIDTH], bool) {
        ([N::nan(); WIDTH], false)
    }
}

/// The function of `LANES` rows; whether all of them are clear. Those that are not begin with NaN.
pub(crate) fn fill<K: Kernel<WIDTH>, N: Lane, const WIDTH: usize>(
    own: &Lanes<N>,
    from: &[[N; 3]],
    into: &mut [[N; WIDTH]],
    room: &mut Room<N>,
) -> bool {
    Arch::new().dispatch(Fill(own, from, into, room, PhantomData::<K>))
}

/// A closure would not be inlined.
struct Fill<'a, K, N, const WIDTH: usize>(
    &'a Lanes<N>,
    &'a [[N; 3]],
    &'a mut [[N; WIDTH]],
    &'a mut Room<N>,
    PhantomData<K>,
);

impl<K: Kernel<WIDTH>, N: Lane, const WIDTH: usize> WithSimd for Fill<'_, K, N, WIDTH> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let Self(own, from, into, room, _) = self;
        if S::IS_SCALAR {
            // Without vectors the core is as fast.
            into.fill([N::nan(); WIDTH]);
            return false;
        }
        if own.linear {
            rows::<K, N, WIDTH, true>(own, from, into, room)
        } else {
            rows::<K, N, WIDTH, false>(own, from, into, room)
        }
    }
}

#[inline(always)]
fn rows<K: Kernel<WIDTH>, N: Lane, const WIDTH: usize, const LINEAR: bool>(
    own: &Lanes<N>,
    from: &[[N; 3]],
    into: &mut [[N; WIDTH]],
    room: &mut Room<N>,
) -> bool {
    let (from, into) = (&from[..LANES], &mut into[..LANES]);
    let Room {
        columns,
        turns: [turns1, turns2, turns3],
        found,
    } = room;
    for lane in 0..LANES {
        let from = from[lane];
        [columns[0][lane], columns[1][lane], columns[2][lane]] = from;
        [turns1[0][lane], turns1[1][lane]] = K::turn::<N, LINEAR>(own, 0, from);
        [turns2[0][lane], turns2[1][lane]] = K::turn::<N, LINEAR>(own, 1, from);
        [turns3[0][lane], turns3[1][lane]] = K::turn::<N, LINEAR>(own, 2, from);
    }
    let mut all = true;
    for lane in 0..LANES {
        let from = [columns[0][lane], columns[1][lane], columns[2][lane]];
        let turns = [
            [turns1[0][lane], turns1[1][lane]],
            [turns2[0][lane], turns2[1][lane]],
            [turns3[0][lane], turns3[1][lane]],
        ];
        let (mut values, clear) = K::of::<N, LINEAR>(own, from, turns);
        all &= clear;
        values[0] = if clear { values[0] } else { N::nan() };
        for place in 0..WIDTH {
            if WIDTH > 3 {
                found[place][lane] = values[place];
            } else {
                into[lane][place] = values[place];
            }
        }
    }
    if WIDTH > 3 {
        // Copied as a whole: memory takes long stores faster.
        let mut rows = [[N::default(); WIDTH]; LANES];
        for lane in 0..LANES {
            for place in 0..WIDTH {
                rows[lane][place] = found[place][lane];
            }
        }
        into.copy_from_slice(&rows);
    }
    all
}

/// No pose is clear.
pub(crate) enum Exact {}

impl<const WIDTH: usize> Kernel<WIDTH> for Exact {}

/// Joints to positions.
pub(crate) enum Forward {}

impl Kernel<3> for Forward {
    #[inline(always)]
    fn of<N: Lane, const LINEAR: bool>(
        own: &Lanes<N>,
        q: Vector<N>,
        turns: [Turn<N>; 3],
    ) -> (Vector<N>, bool) {
        let Pose { x, clear, .. } = own.pose(q, turns);
        (x, clear)
    }
}

/// Positions to joints.
pub(crate) enum Inverse {}

impl Kernel<3> for Inverse {
    #[inline(always)]
    fn turn<N: Lane, const LINEAR: bool>(own: &Lanes<N>, arm: usize, x: Vector<N>) -> Turn<N> {
        own.arms[arm].reach::<LINEAR>(x)
    }

    #[inline(always)]
    fn of<N: Lane, const LINEAR: bool>(
        own: &Lanes<N>,
        x: Vector<N>,
        turns: [Turn<N>; 3],
    ) -> (Vector<N>, bool) {
        let [arm1, arm2, arm3] = &own.arms;
        let b1 = arm1.elbow(turns[0]);
        let (edge2, edge3) = (
            less(arm2.elbow(turns[1]), b1),
            less(arm3.elbow(turns[2]), b1),
        );
        // The platform hangs below the plane of the elbows.
        let normal = cross(edge2, edge3);
        let depth = dot(less(b1, x), normal).signed_by(dot(normal, own.up));
        let mut off = x;
        for arm in 0..3 {
            let [sine, cosine] = turns[arm];
            off[arm] = if LINEAR { sine } else { sine.angle_of(cosine) };
        }
        let least = arm1.lb * arm1.lb * arm1.lb * N::of(N::CLEAR);
        let clear = (depth > least) & own.within(off);
        (less(off, [-own.range[0]; 3]), clear)
    }
}

/// Joints to the nine derivatives of positions, row by row.
pub(crate) enum Derivatives {}

impl Kernel<9> for Derivatives {
    #[inline(always)]
    fn of<N: Lane, const LINEAR: bool>(
        own: &Lanes<N>,
        q: Vector<N>,
        turns: [Turn<N>; 3],
    ) -> ([N; 9], bool) {
        let [arm1, arm2, arm3] = &own.arms;
        let Pose {
            forearms: [w1, w2, w3],
            clear,
            ..
        } = own.pose(q, turns);
        let (normal1, normal2, normal3) = (cross(w2, w3), cross(w3, w1), cross(w1, w2));
        let volume = dot(w1, normal1);
        let by1 = dot(w1, arm1.motion::<LINEAR>(turns[0]));
        let by2 = dot(w2, arm2.motion::<LINEAR>(turns[1]));
        let by3 = dot(w3, arm3.motion::<LINEAR>(turns[2]));
        let most = arm1.lb * arm2.lb * arm3.lb;
        let clear = clear
            & (volume.size() > most * N::of(N::CLEAR))
            & arm1.moves(by1)
            & arm2.moves(by2)
            & arm3.moves(by3);
        let inverse = N::of(1.0) / volume;
        let (by1, by2, by3) = (by1 * inverse, by2 * inverse, by3 * inverse);
        let mut found = [volume; 9];
        for row in 0..3 {
            found[3 * row] = normal1[row] * by1;
            found[3 * row + 1] = normal2[row] * by2;
            found[3 * row + 2] = normal3[row] * by3;
        }
        (found, clear)
    }
}
