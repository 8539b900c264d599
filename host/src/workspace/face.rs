//! The smooth pieces of which the boundary consists, one a limit.
//!
//! | limit of arm i | the surface | its outward normal |
//! | --- | --- | --- |
//! | a joint at its end q̄ | sphere of radius Lb about B(q̄) | ± w/\|w\|, w = X − B, the sign of ∇q = w/(w·B′) |
//! | serial singularity | envelope of these spheres over q: w·B′ = 0 | w/\|w\| stretched, −w/\|w\| folded |
//! | forearm at its largest angle β | plane \|(X − D)·ey\| = Lb sin β | ± ey |
//! | parallel singularity | det(w₁, w₂, w₃) = 0, qᵢ(X) on their branches | towards falling \|det\| |

use crate::reach::{Limit, Reach, other_elbow};
use delta_cal::{Arm, ArmIndex, Parameter, Robot};
use nalgebra::{SVector, Vector3};
use std::f64::consts::{PI, TAU};

/// The boundary's surface near a pose.
#[derive(Debug, Clone, Copy)]
pub struct Face<'a> {
    /// The robot.
    pub robot: &'a Robot<f64>,
    /// Its limits.
    pub reach: &'a Reach,
    /// Which limit.
    pub limit: Limit,
    /// Joint angles nearby (radians): they tell the branches of the inverse apart.
    pub q: [f64; 3],
}

/// One value for each of the eight parameters of the three arms: mm per mm, or mm per radian.
pub type ByParameters = [SVector<f64, 8>; 3];

impl Face<'_> {
    fn arm(&self) -> (&Arm<f64>, f64) {
        let index = self.limit.arm();
        (self.robot.arm(index), self.q[index.index()])
    }

    /// The joint angle at which this limit's sphere stands, and the sign of the outward normal
    /// against the forearm w = X − B.
    fn sphere(&self, x: &Vector3<f64>) -> Option<(f64, f64)> {
        let (arm, q) = self.arm();
        match self.limit {
            Limit::JointMinimum(_) | Limit::JointMaximum(_) => {
                let (q, sign) = match self.limit {
                    Limit::JointMinimum(_) => (self.reach.limits.minimum(), -1.0),
                    _ => (self.reach.limits.maximum(), 1.0),
                };
                let along = (x - arm.elbow(q)).dot(&arm.elbow_derivative(q));
                Some((q, sign * along.signum()))
            }
            Limit::Serial(_) | Limit::Unreachable(_) => {
                let w = x - arm.d();
                let stretched = arm.basis().v.dot(&w).atan2(arm.basis().u.dot(&w));
                let far = apart(stretched, q) > PI / 2.0;
                Some(if far {
                    (stretched + PI, -1.0)
                } else {
                    (stretched, 1.0)
                })
            }
            _ => None,
        }
    }

    /// Distance of a position outwards from the surface, mm, and the surface's outward normal
    /// there. To first order for the parallel singularity, exact for the others. `None` where the
    /// surface has no meaning.
    pub fn distance(&self, x: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        let (arm, _) = self.arm();
        match self.limit {
            Limit::Forearm(_) => {
                let out = (x - arm.d()).dot(&arm.basis().ey);
                let largest = arm.lb() * self.reach.forearm_limit?.sin();
                Some((out.abs() - largest, arm.basis().ey * out.signum()))
            }
            Limit::Parallel(_) => {
                let (determinant, gradient) = determinant(self.robot, x, &self.q)?;
                // The reference is on the inner side, or on the surface itself.
                let inner = inner_sign(self.robot, &self.q)?;
                let steep = gradient.norm();
                let distance = -inner * determinant / steep;
                let normal = gradient * (-inner / steep);
                (distance.is_finite() && normal.x.is_finite()).then_some((distance, normal))
            }
            _ => {
                let (q, sign) = self.sphere(x)?;
                let w = x - arm.elbow(q);
                let length = w.norm();
                (length > 0.0).then(|| (sign * (length - arm.lb()), w * (sign / length)))
            }
        }
    }

    /// How far the surface moves along its outward normal at `x` for each of the 24 parameters, mm
    /// per mm and mm per radian: −∂g/∂p / |∂g/∂X| of the surface g(X, P) = 0 that grows outwards.
    /// `x` must be on the surface.
    pub fn displacement(&self, x: &Vector3<f64>) -> Option<ByParameters> {
        let mut by_parameters: ByParameters = [SVector::zeros(); 3];
        let (arm, _) = self.arm();
        let own = &mut by_parameters[self.limit.arm().index()];
        match self.limit {
            Limit::Forearm(_) => {
                let basis = arm.basis();
                let w = x - arm.d();
                let sign = w.dot(&basis.ey).signum();
                // g = ± (X − D)·ey − Lb sin β; ∂ey/∂θ = −cos α ex, ∂ey/∂α = ez.
                let cos_alpha = arm.get(Parameter::Alpha).cos();
                own.fixed_rows_mut::<3>(0).copy_from(&(basis.ey * sign));
                own[Parameter::Theta.index()] = sign * cos_alpha * w.dot(&basis.ex);
                own[Parameter::Alpha.index()] = -sign * w.dot(&basis.ez);
                own[Parameter::Lb.index()] = self.reach.forearm_limit?.sin();
            }
            Limit::Parallel(_) => return self.parallel_displacement(x),
            _ => {
                // g = ± f, with q fixed at its end, or stationary: ∂f/∂q = 0.
                let (q, sign) = self.sphere(x)?;
                *own = arm.constraint_by_parameters(x, q) * (-sign / (2.0 * arm.lb()));
            }
        }
        Some(by_parameters)
    }

    /// g = det(w₁, w₂, w₃) at fixed X: dwᵢ = −∂Bᵢ/∂p − Bᵢ′ dqᵢ, dqᵢ = −∂fᵢ/∂p / ∂fᵢ/∂q.
    fn parallel_displacement(&self, x: &Vector3<f64>) -> Option<ByParameters> {
        let q = branch(self.robot, x, &self.q)?;
        let inner = inner_sign(self.robot, &self.q)?;
        let (_, gradient) = determinant(self.robot, x, &self.q)?;
        let cofactors = cofactors(self.robot, x, &q);
        let mut by_parameters: ByParameters = [SVector::zeros(); 3];
        let arms = self.robot.arms().iter().zip(q).zip(cofactors);
        for (((arm, q), cofactor), own) in arms.zip(&mut by_parameters) {
            // ∂f/∂P = −2 w·∂B/∂P is linear in the forearm w; with the cofactor in its place it is
            // −2 c·∂B/∂P, but for the forearm's own length.
            let mut moved = arm.constraint_by_parameters(&(arm.elbow(q) + cofactor), q) * 0.5;
            moved[Parameter::Lb.index()] = 0.0;
            let turn = cofactor.dot(&arm.elbow_derivative(q)) / arm.constraint_by_joint(x, q);
            *own = (moved + arm.constraint_by_parameters(x, q) * turn) * (inner / gradient.norm());
        }
        let finite = by_parameters
            .iter()
            .all(|own| own.iter().all(|v| v.is_finite()));
        finite.then_some(by_parameters)
    }
}

/// The distance between two angles, 0 to π.
fn apart(a: f64, b: f64) -> f64 {
    let turn = (a - b).rem_euclid(TAU);
    turn.min(TAU - turn)
}

/// The joint angles at `x` on the branches nearest to those of `near`.
pub(super) fn branch(robot: &Robot<f64>, x: &Vector3<f64>, near: &[f64; 3]) -> Option<[f64; 3]> {
    let mut q = robot.inverse(x).ok()?;
    for ((arm, q), near) in robot.arms().iter().zip(&mut q).zip(near) {
        let other = other_elbow(arm, x, *q);
        if apart(other, *near) < apart(*q, *near) {
            *q = other;
        }
    }
    Some(q)
}

fn forearms(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> [Vector3<f64>; 3] {
    let [arm1, arm2, arm3] = robot.arms();
    [
        x - arm1.elbow(q[0]),
        x - arm2.elbow(q[1]),
        x - arm3.elbow(q[2]),
    ]
}

/// ∂det/∂wᵢ.
fn cofactors(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> [Vector3<f64>; 3] {
    let [w1, w2, w3] = forearms(robot, x, q);
    [w2.cross(&w3), w3.cross(&w1), w1.cross(&w2)]
}

/// det(w₁, w₂, w₃) at `x`, mm³, and its gradient, mm²: dwᵢ = dX − Bᵢ′ (wᵢ·dX)/(wᵢ·Bᵢ′).
pub(super) fn determinant(
    robot: &Robot<f64>,
    x: &Vector3<f64>,
    near: &[f64; 3],
) -> Option<(f64, Vector3<f64>)> {
    let q = branch(robot, x, near)?;
    let [w1, ..] = forearms(robot, x, &q);
    let cofactors = cofactors(robot, x, &q);
    let mut gradient = Vector3::zeros();
    for ((arm, q), cofactor) in robot.arms().iter().zip(q).zip(&cofactors) {
        let (w, tangent) = (x - arm.elbow(q), arm.elbow_derivative(q));
        gradient += cofactor - w * (cofactor.dot(&tangent) / w.dot(&tangent));
    }
    Some((w1.dot(&cofactors[0]), gradient))
}

/// The sign of det(w₁, w₂, w₃) where the platform hangs below the elbows' plane.
fn inner_sign(robot: &Robot<f64>, q: &[f64; 3]) -> Option<f64> {
    let [arm1, arm2, arm3] = robot.arms();
    let elbow = arm1.elbow(q[0]);
    let normal = (arm2.elbow(q[1]) - elbow).cross(&(arm3.elbow(q[2]) - elbow));
    let up = normal.dot(&robot.up());
    // det(w₁, w₂, w₃) = normal · (X − B₁).
    (up.abs() > 0.0).then(|| -up.signum())
}

/// The arm whose forearm lies nearest to the plane of the other two.
pub(super) fn flattest(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> ArmIndex {
    let cofactors = cofactors(robot, x, q);
    let flatness = |arm: &ArmIndex| cofactors[arm.index()].norm() * robot.arm(*arm).lb();
    ArmIndex::ALL
        .into_iter()
        .max_by(|a, b| flatness(a).total_cmp(&flatness(b)))
        .unwrap_or(ArmIndex::First)
}
