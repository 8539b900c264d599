//! Kinematics of many poses at once, in the widest vector instructions of the processor.
//!
//! The formulas are those of the core (`core/src/kinematics.rs`) without its branches. Results agree with the core's to
//! about 1e-14 of the robot's size, those in 32 bits to about 1e-6: sine, cosine and arcsine are other polynomials, and sums
//! are rounded in another order. A pose of which that does not hold, near a singularity or outside the limits, is NaN
//! here; the caller leaves it to the core.

use crate::wide::{Lane, Vectors, Which, Wide, any_nan};
use delta_cal::robot::{Arm, Drive};
use delta_cal_host::RobotFile;
use delta_cal_host::files::convention::Convention;
use delta_cal_host::files::robot_file::Tool;
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::TAU;

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
/// the same formulas hold, as only signs differ.
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

/// Sine and cosine of a joint; of a linear drive the travel and 0.
type Turn<S, N> = [Wide<S, N>; 2];

impl ArmNumbers<f64> {
    fn of(arm: &Arm<f64>, convention: &Convention, place: &Vector3<f64>) -> Self {
        let (basis, sense) = (arm.basis(), convention.sense());
        let (speed, lb) = (basis.v.norm(), arm.lb());
        Self {
            d: convention.vector(&(arm.d() + place)).into(),
            u: convention.vector(&basis.u).into(),
            v: convention.vector(&(basis.v * sense)).into(),
            lb,
            speed: speed * sense,
            offset: (speed * speed - lb * lb) / 2.0,
        }
    }

    fn rounded<N: Lane>(&self) -> ArmNumbers<N> {
        ArmNumbers {
            d: self.d.map(N::of),
            u: self.u.map(N::of),
            v: self.v.map(N::of),
            lb: N::of(self.lb),
            speed: N::of(self.speed),
            offset: N::of(self.offset),
        }
    }
}

impl<N: Lane> ArmNumbers<N> {
    /// lb².
    #[inline(always)]
    fn long<S: Simd>(&self, simd: S) -> Wide<S, N> {
        Wide::one(simd, self.lb * self.lb)
    }

    #[inline(always)]
    fn elbow<S: Simd>(&self, [sine, cosine]: Turn<S, N>) -> Vectors<S, N> {
        Vectors::sum(self.d, (self.u, cosine), (self.v, sine))
    }

    /// How the elbow moves with the joint.
    #[inline(always)]
    fn motion<S: Simd>(&self, [sine, cosine]: Turn<S, N>, linear: bool) -> Vectors<S, N> {
        if linear {
            return Vectors::all(sine.0, self.v);
        }
        Vectors::sum([N::default(); 3], (self.u, -sine), (self.v, cosine))
    }

    /// Whether it is not stretched, given w·v: then the joint moves the platform at all.
    #[inline(always)]
    fn moves<S: Simd>(&self, by: Wide<S, N>) -> Which<S, N> {
        let most = Wide::one(by.0, self.lb * self.speed).abs();
        by.abs().above(most * (1e-3 * N::CLEAR))
    }

    /// What brings the forearm to a position; NaN at the edge of what it reaches.
    #[inline(always)]
    fn reach<S: Simd>(&self, x: Vectors<S, N>, linear: bool) -> Turn<S, N> {
        let simd = x.0[0].0;
        let (all, one) = (|own| Wide::all(simd, own), |own| Wide::one(simd, own));
        let (speed, long) = (one(self.speed), self.long(simd));
        let least = long * (N::CLEAR * N::CLEAR);
        let w = x - Vectors::all(simd, self.d);
        let (a, b) = (w.along(self.u), w.along(self.v));
        if linear {
            let along = b / (speed * speed);
            let beside = w - Vectors::all(simd, self.v) * along;
            let root = long - beside.dot(beside);
            let travel = along + root.sqrt() / speed;
            return [travel.where_it(root.above(least), all(f64::NAN)), all(0.0)];
        }
        let c = w.dot(w).times(all(0.5), one(self.offset));
        // From the joint's axis in its plane.
        let squared = a.times(a, b * b);
        let root = squared - c * c;
        let (s, inverse) = (root.sqrt().signed_by(speed), all(1.0) / squared);
        let sine = b.times(c, -(a * s)) * inverse;
        let cosine = a.times(c, b * s) * inverse;
        [sine.where_it(root.above(least), all(f64::NAN)), cosine]
    }
}

/// The platform point, the forearms, and which poses are clear.
struct Poses<S: Simd, N: Lane> {
    x: Vectors<S, N>,
    forearms: [Vectors<S, N>; 3],
    clear: Which<S, N>,
}

impl Lanes<f64> {
    /// `None` of transmissions and of a platform that tilts.
    pub(crate) fn of(file: &RobotFile, point: &Tool) -> Option<Self> {
        let arms = file.robot.arms();
        if point.parallelograms.is_some() || arms.iter().any(|own| own.transmission().is_some()) {
            return None;
        }
        let (low, high) = file
            .convention
            .limits(file.limits.minimum(), file.limits.maximum());
        // More than a turn is no angle in radians.
        let most = match file.robot.drive() {
            Drive::Rotary => TAU,
            Drive::Linear => f64::INFINITY,
        };
        let (low, high) = (
            (low - margin(file)).max(-most),
            (high + margin(file)).min(most),
        );
        Some(Self {
            arms: arms
                .each_ref()
                .map(|own| ArmNumbers::of(own, &file.convention, &point.place)),
            up: file.convention.vector(&file.robot.up()).into(),
            linear: file.robot.drive() == Drive::Linear,
            range: [f64::midpoint(low, high), (high - low) / 2.0],
        })
    }

    pub(crate) fn rounded<N: Lane>(&self) -> Lanes<N> {
        Lanes {
            arms: self.arms.each_ref().map(ArmNumbers::rounded),
            up: self.up.map(N::of),
            linear: self.linear,
            range: self.range.map(N::of),
        }
    }
}

impl<N: Lane> Lanes<N> {
    /// Which joints are within the limits.
    #[inline(always)]
    fn within<S: Simd>(&self, [q1, q2, q3]: [Wide<S, N>; 3]) -> Which<S, N> {
        let [middle, far] = self.range;
        let middle = Wide::one(q1.0, middle);
        let (off1, off2, off3) = (
            (q1 - middle).abs(),
            (q2 - middle).abs(),
            (q3 - middle).abs(),
        );
        Wide::one(q1.0, far).above(off1.max(off2).max(off3))
    }

    /// Of the joint of an arm.
    #[inline(always)]
    fn turn<S: Simd>(&self, q: Wide<S, N>) -> Turn<S, N> {
        match self.linear {
            true => [q, Wide::all(q.0, 0.0)],
            false => q.sine_cosine(),
        }
    }

    #[inline(always)]
    fn poses<S: Simd>(&self, q: [Wide<S, N>; 3], turns: [Turn<S, N>; 3]) -> Poses<S, N> {
        let [arm1, arm2, arm3] = &self.arms;
        let all = |number| Wide::all(q[0].0, number);
        let simd = q[0].0;
        let (long1, long2, long3) = (arm1.long(simd), arm2.long(simd), arm3.long(simd));
        let (b1, b2, b3) = (
            arm1.elbow(turns[0]),
            arm2.elbow(turns[1]),
            arm3.elbow(turns[2]),
        );
        let (edge2, edge3) = (b2 - b1, b3 - b1);
        let normal = edge2.cross(edge3);
        let normal_squared = normal.dot(normal);
        let (squared2, squared3) = (edge2.dot(edge2), edge3.dot(edge3));
        let inverse = all(1.0) / normal_squared;
        let half = inverse * 0.5;
        let along2 = (squared2 + (long1 - long2)) * half;
        let along3 = (squared3 + (long1 - long3)) * half;
        let within = edge3
            .cross(normal)
            .times(along2, normal.cross(edge2) * along3);
        let height_squared = long1 - within.dot(within);
        let height = (height_squared * inverse).sqrt();
        let below = -height.signed_by(normal.along(self.up));
        // From the first elbow.
        let forearm = normal.times(below, within);
        let clear = normal_squared.above(squared2 * squared3 * (N::CLEAR * N::CLEAR))
            & height_squared.above(long1 * (N::CLEAR * N::CLEAR))
            & self.within(q);
        Poses {
            x: forearm + b1,
            forearms: [forearm, forearm - edge2, forearm - edge3],
            clear,
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
        let zero = N::of(0.0);
        Self {
            columns: [[zero; LANES]; 3],
            turns: [[[zero; LANES]; 2]; 3],
            found: [[zero; LANES]; 9],
        }
    }
}

/// A function of the three numbers of a pose, in two steps: of shorter ones the processor overlaps more.
pub(crate) trait Kernel<const WIDTH: usize>: Sync + Sized {
    /// The joint of an arm.
    fn turn<S: Simd, N: Lane>(
        &self,
        own: &Lanes<N>,
        arm: usize,
        from: [Wide<S, N>; 3],
    ) -> Turn<S, N>;

    /// The function, and of which poses it holds.
    fn of<S: Simd, N: Lane>(
        &self,
        own: &Lanes<N>,
        from: [Wide<S, N>; 3],
        turns: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; WIDTH], Which<S, N>);

    /// The function of `LANES` rows; whether all of them are clear.
    fn fill<N: Lane>(
        &self,
        own: &Lanes<N>,
        from: &[[N; 3]],
        into: &mut [[N; WIDTH]],
        room: &mut Room<N>,
    ) -> bool {
        Arch::new().dispatch(Fill(self, own, from, into, room))
    }
}

struct Fill<'a, K, N, const WIDTH: usize>(
    &'a K,
    &'a Lanes<N>,
    &'a [[N; 3]],
    &'a mut [[N; WIDTH]],
    &'a mut Room<N>,
);

impl<K: Kernel<WIDTH>, N: Lane, const WIDTH: usize> WithSimd for Fill<'_, K, N, WIDTH> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self(kernel, own, from, into, room) = self;
        let Room {
            columns,
            turns,
            found,
        } = room;
        let (from, into) = (&from[..LANES], &mut into[..LANES]);
        for lane in 0..LANES {
            for place in 0..3 {
                columns[place][lane] = from[lane][place];
            }
        }
        let width = size_of::<N::Many<S>>() / size_of::<N>();
        let (zero, nan) = (Wide::<S, N>::all(simd, 0.0), Wide::all(simd, f64::NAN));
        for arm in 0..3 {
            for lane in (0..LANES).step_by(width) {
                let these = lane..lane + width;
                let from = Wide::load(simd, columns, these.clone());
                let [sine, cosine] = kernel.turn(own, arm, from);
                sine.store(&mut turns[arm][0][these.clone()]);
                cosine.store(&mut turns[arm][1][these]);
            }
        }
        let mut sum = zero;
        for lane in (0..LANES).step_by(width) {
            let these = lane..lane + width;
            let [first, second, third] = &*turns;
            let turns = [
                Wide::load(simd, first, these.clone()),
                Wide::load(simd, second, these.clone()),
                Wide::load(simd, third, these.clone()),
            ];
            let from = Wide::load(simd, columns, these.clone());
            let (mut columns, clear) = kernel.of(own, from, turns);
            sum = sum.where_it(clear, nan);
            // Marks the row.
            columns[0] = columns[0].where_it(clear, nan);
            for place in 0..WIDTH {
                columns[place].store(&mut found[place][these.clone()]);
            }
        }
        for lane in 0..LANES {
            for place in 0..WIDTH {
                into[lane][place] = found[place][lane];
            }
        }
        !any_nan(sum)
    }
}

/// No kernel.
pub(crate) enum Exact {}

impl<const WIDTH: usize> Kernel<WIDTH> for Exact {
    fn turn<S: Simd, N: Lane>(&self, _: &Lanes<N>, _: usize, _: [Wide<S, N>; 3]) -> Turn<S, N> {
        match *self {}
    }

    fn of<S: Simd, N: Lane>(
        &self,
        _: &Lanes<N>,
        _: [Wide<S, N>; 3],
        _: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; WIDTH], Which<S, N>) {
        match *self {}
    }
}

/// Joints to positions.
pub(crate) struct Forward;

impl Kernel<3> for Forward {
    #[inline(always)]
    fn turn<S: Simd, N: Lane>(&self, own: &Lanes<N>, arm: usize, q: [Wide<S, N>; 3]) -> Turn<S, N> {
        own.turn(q[arm])
    }

    #[inline(always)]
    fn of<S: Simd, N: Lane>(
        &self,
        own: &Lanes<N>,
        q: [Wide<S, N>; 3],
        turns: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; 3], Which<S, N>) {
        let Poses { x, clear, .. } = own.poses(q, turns);
        (x.0, clear)
    }
}

/// Positions to joints.
pub(crate) struct Inverse;

impl Kernel<3> for Inverse {
    #[inline(always)]
    fn turn<S: Simd, N: Lane>(&self, own: &Lanes<N>, arm: usize, x: [Wide<S, N>; 3]) -> Turn<S, N> {
        own.arms[arm].reach(Vectors(x), own.linear)
    }

    #[inline(always)]
    fn of<S: Simd, N: Lane>(
        &self,
        own: &Lanes<N>,
        x: [Wide<S, N>; 3],
        turns: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; 3], Which<S, N>) {
        let x = Vectors(x);
        let [arm1, arm2, arm3] = &own.arms;
        let (w1, w2, w3) = (
            x - arm1.elbow(turns[0]),
            x - arm2.elbow(turns[1]),
            x - arm3.elbow(turns[2]),
        );
        // The platform hangs below the plane of the elbows.
        let normal = (w1 - w2).cross(w1 - w3);
        let depth = -w1.dot(normal).signed_by(normal.along(own.up));
        let mut q = x.0;
        for arm in 0..3 {
            let [sine, cosine] = turns[arm];
            q[arm] = match own.linear {
                true => sine,
                false => sine.angle_of(cosine),
            };
        }
        let least = Wide::one(depth.0, arm1.lb * arm1.lb * arm1.lb) * N::CLEAR;
        (q, depth.above(least) & own.within(q))
    }
}

/// Joints to the nine derivatives of positions, row by row.
pub(crate) struct Derivatives;

impl Kernel<9> for Derivatives {
    #[inline(always)]
    fn turn<S: Simd, N: Lane>(&self, own: &Lanes<N>, arm: usize, q: [Wide<S, N>; 3]) -> Turn<S, N> {
        own.turn(q[arm])
    }

    #[inline(always)]
    fn of<S: Simd, N: Lane>(
        &self,
        own: &Lanes<N>,
        q: [Wide<S, N>; 3],
        turns: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; 9], Which<S, N>) {
        let [arm1, arm2, arm3] = &own.arms;
        let Poses {
            forearms: [w1, w2, w3],
            clear,
            ..
        } = own.poses(q, turns);
        let (normal1, normal2, normal3) = (w2.cross(w3), w3.cross(w1), w1.cross(w2));
        let volume = w1.dot(normal1);
        let by1 = w1.dot(arm1.motion(turns[0], own.linear));
        let by2 = w2.dot(arm2.motion(turns[1], own.linear));
        let by3 = w3.dot(arm3.motion(turns[2], own.linear));
        let most = Wide::one(volume.0, arm1.lb * arm2.lb * arm3.lb);
        let clear = clear
            & volume.abs().above(most * N::CLEAR)
            & arm1.moves(by1)
            & arm2.moves(by2)
            & arm3.moves(by3);
        let inverse = Wide::all(volume.0, 1.0) / volume;
        let (Vectors([x1, y1, z1]), Vectors([x2, y2, z2]), Vectors([x3, y3, z3])) = (
            normal1 * (by1 * inverse),
            normal2 * (by2 * inverse),
            normal3 * (by3 * inverse),
        );
        ([x1, x2, x3, y1, y2, y3, z1, z2, z3], clear)
    }
}
