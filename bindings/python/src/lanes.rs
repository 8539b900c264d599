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
pub(crate) struct Lanes {
    arms: [ArmNumbers; 3],
    up: [f64; 3],
    linear: bool,
    /// Joints that are within the limits: the middle, and how far from there.
    range: [f64; 2],
}

struct ArmNumbers {
    /// With the point that moves, from the platform point.
    d: [f64; 3],
    u: [f64; 3],
    v: [f64; 3],
    lb: f64,
    lb_squared: f64,
    /// Length of v, negative where joints count upwards: the upper arm, or the scale of a linear drive.
    speed: f64,
    /// Of w·w / 2 from there: the joint's u·w cos q + v·w sin q.
    offset: f64,
}

/// Sine and cosine of a joint; of a linear drive the travel and 0.
type Turn<S, N> = [Wide<S, N>; 2];

impl ArmNumbers {
    fn of(arm: &Arm<f64>, convention: &Convention, place: &Vector3<f64>) -> Self {
        let (basis, sense) = (arm.basis(), convention.sense());
        let (speed, lb) = (basis.v.norm(), arm.lb());
        Self {
            d: convention.vector(&(arm.d() + place)).into(),
            u: convention.vector(&basis.u).into(),
            v: convention.vector(&(basis.v * sense)).into(),
            lb,
            lb_squared: lb * lb,
            speed: speed * sense,
            offset: (speed * speed - lb * lb) / 2.0,
        }
    }

    #[inline(always)]
    fn elbow<S: Simd, N: Lane>(&self, [sine, cosine]: Turn<S, N>) -> Vectors<S, N> {
        Vectors::sum(self.d, (self.u, cosine), (self.v, sine))
    }

    /// How the elbow moves with the joint.
    #[inline(always)]
    fn motion<S: Simd, N: Lane>(&self, [sine, cosine]: Turn<S, N>, linear: bool) -> Vectors<S, N> {
        let all = |number| Wide::all(sine.0, number);
        if linear {
            let [x, y, z] = self.v;
            return Vectors([all(x), all(y), all(z)]);
        }
        Vectors::sum([0.0; 3], (self.u, -sine), (self.v, cosine))
    }

    /// What brings the forearm to a position; NaN at the edge of what it reaches.
    #[inline(always)]
    fn reach<S: Simd, N: Lane>(&self, x: Vectors<S, N>, linear: bool) -> Turn<S, N> {
        let all = |number| Wide::all(x.0[0].0, number);
        let clear = |root: Wide<S, N>| root.above(all(N::CLEAR * N::CLEAR * self.lb_squared));
        let w = x - self.d;
        let (a, b) = (w.along(self.u), w.along(self.v));
        if linear {
            let along = b * (1.0 / (self.speed * self.speed));
            let [v1, v2, v3] = self.v;
            let beside = w - Vectors([along * v1, along * v2, along * v3]);
            let root = all(self.lb_squared) - beside.dot(beside);
            let travel = root.sqrt().times(all(1.0 / self.speed), along);
            return [travel.where_it(clear(root), all(f64::NAN)), all(0.0)];
        }
        let c = w.dot(w).times(all(0.5), all(self.offset));
        // From the joint's axis in its plane.
        let squared = a.times(a, b * b);
        let root = squared - c * c;
        let (s, inverse) = (root.sqrt().signed_by(all(self.speed)), all(1.0) / squared);
        let inverse = inverse.where_it(clear(root), all(f64::NAN));
        [b.times(c, -(a * s)) * inverse, a.times(c, b * s) * inverse]
    }
}

/// The platform point, the forearms, and which poses are clear.
struct Poses<S: Simd, N: Lane> {
    x: Vectors<S, N>,
    forearms: [Vectors<S, N>; 3],
    clear: Which<S, N>,
}

impl Lanes {
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

    /// Which joints are within the limits.
    #[inline(always)]
    fn within<S: Simd, N: Lane>(&self, [q1, q2, q3]: [Wide<S, N>; 3]) -> Which<S, N> {
        let [middle, far] = self.range;
        let off = |q: Wide<S, N>| (q - middle).abs();
        Wide::all(q1.0, far).above(off(q1).max(off(q2)).max(off(q3)))
    }

    /// Of the joint of an arm.
    #[inline(always)]
    fn turn<S: Simd, N: Lane>(&self, q: Wide<S, N>) -> Turn<S, N> {
        match self.linear {
            true => [q, Wide::all(q.0, 0.0)],
            false => q.sine_cosine(),
        }
    }

    #[inline(always)]
    fn poses<S: Simd, N: Lane>(&self, q: [Wide<S, N>; 3], turns: [Turn<S, N>; 3]) -> Poses<S, N> {
        let [arm1, arm2, arm3] = &self.arms;
        let all = |number| Wide::all(q[0].0, number);
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
        let along2 = (squared2 + (arm1.lb_squared - arm2.lb_squared)) * half;
        let along3 = (squared3 + (arm1.lb_squared - arm3.lb_squared)) * half;
        let within = edge3
            .cross(normal)
            .times(along2, normal.cross(edge2) * along3);
        let height_squared = all(arm1.lb_squared) - within.dot(within);
        let height = (height_squared * inverse).sqrt();
        let below = -height.signed_by(normal.along(self.up));
        // From the first elbow.
        let forearm = normal.times(below, within);
        let clear = normal_squared.above(squared2 * squared3 * (N::CLEAR * N::CLEAR))
            & height_squared.above(all(N::CLEAR * N::CLEAR * arm1.lb_squared))
            & self.within(q);
        Poses {
            x: forearm + b1,
            forearms: [forearm, forearm - edge2, forearm - edge3],
            clear,
        }
    }
}

/// Four columns of the rows of one call: processors exchange rows and columns of four.
type Four<N> = [[N; 4]; LANES];

/// What one call needs beside its rows, where the processor loads it fastest.
#[repr(align(64))]
pub(crate) struct Room<N> {
    rows: Four<N>,
    columns: [[N; LANES]; 3],
    turns: [[[N; LANES]; 2]; 3],
    found: [Four<N>; 3],
}

impl<N: Lane> Room<N> {
    pub(crate) fn new() -> Self {
        let zero = N::of(0.0);
        Self {
            rows: [[zero; 4]; LANES],
            columns: [[zero; LANES]; 3],
            turns: [[[zero; LANES]; 2]; 3],
            found: [[[zero; 4]; LANES]; 3],
        }
    }
}

/// A function of the three numbers of a pose, in two steps: of shorter ones the processor overlaps more.
pub(crate) trait Kernel<const WIDTH: usize>: Sync + Sized {
    /// The joint of an arm.
    fn turn<S: Simd, N: Lane>(&self, arm: usize, from: [Wide<S, N>; 3]) -> Turn<S, N>;

    /// The function, and of which poses it holds.
    fn of<S: Simd, N: Lane>(
        &self,
        from: [Wide<S, N>; 3],
        turns: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; WIDTH], Which<S, N>);

    /// The function of `LANES` rows; whether all of them are clear.
    fn fill<N: Lane>(&self, from: &[N], into: &mut [N], room: &mut Room<N>) -> bool {
        Arch::new().dispatch(Fill(self, from, into, room))
    }
}

struct Fill<'a, K, N, const WIDTH: usize>(&'a K, &'a [N], &'a mut [N], &'a mut Room<N>);

impl<K: Kernel<WIDTH>, N: Lane, const WIDTH: usize> WithSimd for Fill<'_, K, N, WIDTH> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self(kernel, from, into, room) = self;
        let Room {
            rows,
            columns,
            turns,
            found,
        } = room;
        let (from, into) = (&from[..3 * LANES], &mut into[..WIDTH * LANES]);
        for lane in 0..LANES - 1 {
            rows[lane].copy_from_slice(&from[3 * lane..3 * lane + 4]);
        }
        rows[LANES - 1][..3].copy_from_slice(&from[3 * (LANES - 1)..]);
        let width = size_of::<N::Many<S>>() / size_of::<N>();
        let (zero, nan) = (Wide::<S, N>::all(simd, 0.0), Wide::all(simd, f64::NAN));
        for lane in (0..LANES).step_by(width) {
            let these = lane..lane + width;
            let own = Wide::columns(simd, &rows[these.clone()]);
            for place in 0..3 {
                own[place].store(&mut columns[place][these.clone()]);
            }
        }
        let at = |column: &[N; LANES], lane| Wide::load(simd, &column[lane..lane + width]);
        for arm in 0..3 {
            for lane in (0..LANES).step_by(width) {
                let [a, b, c] = &*columns;
                let [sine, cosine] = kernel.turn(arm, [at(a, lane), at(b, lane), at(c, lane)]);
                sine.store(&mut turns[arm][0][lane..lane + width]);
                cosine.store(&mut turns[arm][1][lane..lane + width]);
            }
        }
        let mut sum = zero;
        for lane in (0..LANES).step_by(width) {
            let these = lane..lane + width;
            let [a, b, c] = &*columns;
            let [[s1, c1], [s2, c2], [s3, c3]] = &*turns;
            let (mut columns, clear) = kernel.of(
                [at(a, lane), at(b, lane), at(c, lane)],
                [
                    [at(s1, lane), at(c1, lane)],
                    [at(s2, lane), at(c2, lane)],
                    [at(s3, lane), at(c3, lane)],
                ],
            );
            sum = sum.where_it(clear, nan);
            // Marks the row.
            columns[0] = columns[0].where_it(clear, nan);
            for group in 0..WIDTH.div_ceil(4) {
                let mut four = [zero; 4];
                for place in 0..(WIDTH - 4 * group).min(4) {
                    four[place] = columns[4 * group + place];
                }
                Wide::rows(four, &mut found[group][these.clone()]);
            }
        }
        // What is beyond a row's last column is overwritten by the next.
        for lane in 0..LANES {
            for (group, own) in found[..WIDTH.div_ceil(4)].iter().enumerate() {
                let (first, own) = (WIDTH * lane + 4 * group, &own[lane]);
                if lane < LANES - 1 {
                    into[first..first + 4].copy_from_slice(own);
                } else {
                    let last = (WIDTH - 4 * group).min(4);
                    into[first..first + last].copy_from_slice(&own[..last]);
                }
            }
        }
        !any_nan(sum)
    }
}

/// No kernel.
pub(crate) enum Exact {}

impl<const WIDTH: usize> Kernel<WIDTH> for Exact {
    fn turn<S: Simd, N: Lane>(&self, _: usize, _: [Wide<S, N>; 3]) -> Turn<S, N> {
        match *self {}
    }

    fn of<S: Simd, N: Lane>(
        &self,
        _: [Wide<S, N>; 3],
        _: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; WIDTH], Which<S, N>) {
        match *self {}
    }
}

/// Joints to positions.
pub(crate) struct Forward(pub(crate) Lanes);

impl Kernel<3> for Forward {
    #[inline(always)]
    fn turn<S: Simd, N: Lane>(&self, arm: usize, q: [Wide<S, N>; 3]) -> Turn<S, N> {
        self.0.turn(q[arm])
    }

    #[inline(always)]
    fn of<S: Simd, N: Lane>(
        &self,
        q: [Wide<S, N>; 3],
        turns: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; 3], Which<S, N>) {
        let Poses { x, clear, .. } = self.0.poses(q, turns);
        (x.0, clear)
    }
}

/// Positions to joints.
pub(crate) struct Inverse(pub(crate) Lanes);

impl Kernel<3> for Inverse {
    #[inline(always)]
    fn turn<S: Simd, N: Lane>(&self, arm: usize, x: [Wide<S, N>; 3]) -> Turn<S, N> {
        self.0.arms[arm].reach(Vectors(x), self.0.linear)
    }

    #[inline(always)]
    fn of<S: Simd, N: Lane>(
        &self,
        x: [Wide<S, N>; 3],
        turns: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; 3], Which<S, N>) {
        let (own, x) = (&self.0, Vectors(x));
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
        let least = N::CLEAR * arm1.lb_squared * arm1.lb;
        (q, depth.above(Wide::all(depth.0, least)) & own.within(q))
    }
}

/// Joints to the nine derivatives of positions, row by row.
pub(crate) struct Derivatives(pub(crate) Lanes);

impl Kernel<9> for Derivatives {
    #[inline(always)]
    fn turn<S: Simd, N: Lane>(&self, arm: usize, q: [Wide<S, N>; 3]) -> Turn<S, N> {
        self.0.turn(q[arm])
    }

    #[inline(always)]
    fn of<S: Simd, N: Lane>(
        &self,
        q: [Wide<S, N>; 3],
        turns: [Turn<S, N>; 3],
    ) -> ([Wide<S, N>; 9], Which<S, N>) {
        let own = &self.0;
        let [arm1, arm2, arm3] = &own.arms;
        let Poses {
            forearms: [w1, w2, w3],
            clear,
            ..
        } = own.poses(q, turns);
        let (normal1, normal2, normal3) = (w2.cross(w3), w3.cross(w1), w1.cross(w2));
        let volume = w1.dot(normal1);
        let by = |arm: &ArmNumbers, w: Vectors<S, N>, turn| w.dot(arm.motion(turn, own.linear));
        let (by1, by2, by3) = (
            by(arm1, w1, turns[0]),
            by(arm2, w2, turns[1]),
            by(arm3, w3, turns[2]),
        );
        let above = |found: Wide<S, N>, most: f64| {
            found.abs().above(Wide::all(found.0, N::CLEAR * most.abs()))
        };
        let clear = clear
            & above(volume, arm1.lb * arm2.lb * arm3.lb)
            & above(by1, arm1.lb * arm1.speed)
            & above(by2, arm2.lb * arm2.speed)
            & above(by3, arm3.lb * arm3.speed);
        let inverse = Wide::all(volume.0, 1.0) / volume;
        let (Vectors([x1, y1, z1]), Vectors([x2, y2, z2]), Vectors([x3, y3, z3])) = (
            normal1 * (by1 * inverse),
            normal2 * (by2 * inverse),
            normal3 * (by3 * inverse),
        );
        ([x1, x2, x3, y1, y2, y3, z1, z2, z3], clear)
    }
}
