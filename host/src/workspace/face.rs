//! The smooth pieces of which the boundary consists, one a limit.
//!
//! | limit of arm i | the surface | its outward normal |
//! | --- | --- | --- |
//! | a joint at its end q̄ | sphere of radius Lb about B(q̄) | ± w/\|w\|, w = X − B, the sign of ∇q = w/(w·B′) |
//! | serial singularity | envelope of these spheres over q: w·B′ = 0, about a tower a cylinder | w/\|w\| stretched, −w/\|w\| folded |
//! | forearm at its largest angle β | plane \|(X − D)·ey\| = Lb sin β | ± ey |
//! | parallel singularity | det(w₁, w₂, w₃) = 0, qᵢ(X) on their branches | towards falling \|det\| |
//! | elbows' plane upright | ((B₂ − B₁) × (B₃ − B₁))·up = 0, the same | towards falling \|·\| |

use crate::geometry::reach::{Limit, Reach, other_elbow};
use delta_cal::robot::{Arm, Drive};
use delta_cal::{ArmIndex, Parameter, Robot};
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
                if arm.drive() == Drive::Linear {
                    let axis = arm.basis().v;
                    return Some((axis.dot(&w) / axis.norm_squared(), 1.0));
                }
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
            Limit::Parallel(_) | Limit::Assembly(_) => {
                let (value, gradient) = self.spanned(x)?.gradient(self.robot, x);
                let outwards = self.outwards();
                let steep = gradient.norm();
                let (distance, normal) = (outwards * value / steep, gradient * (outwards / steep));
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
            Limit::Parallel(_) | Limit::Assembly(_) => return self.spanned_displacement(x),
            _ => {
                // g = ± f, with q fixed at its end, or stationary: ∂f/∂q = 0.
                let (q, sign) = self.sphere(x)?;
                *own = arm.constraint_by_parameters(x, q) * (-sign / (2.0 * arm.lb()));
            }
        }
        Some(by_parameters)
    }

    /// What must not vanish.
    fn spanned(&self, x: &Vector3<f64>) -> Option<Spanned> {
        let q = branch(self.robot, x, &self.q)?;
        Some(match self.limit {
            Limit::Assembly(_) => Spanned::by_elbows(self.robot, q),
            _ => Spanned::by_forearms(self.robot, x, q),
        })
    }

    /// The sign of what must not vanish, beyond the surface. The joint angles nearby are those of a
    /// pose inside, or on the surface: there the elbows' plane still has the right side, and with
    /// det(w₁, w₂, w₃) = ((B₂ − B₁) × (B₃ − B₁))·(X − B₁) the platform is below it.
    fn outwards(&self) -> f64 {
        let side = Spanned::by_elbows(self.robot, self.q).value.signum();
        match self.limit {
            Limit::Assembly(_) => -side,
            _ => side,
        }
    }

    /// At fixed X: dg = Σ ∂g/∂Bᵢ·(∂Bᵢ/∂p + Bᵢ′ dqᵢ), dqᵢ = −∂fᵢ/∂p / ∂fᵢ/∂q.
    fn spanned_displacement(&self, x: &Vector3<f64>) -> Option<ByParameters> {
        let spanned = self.spanned(x)?;
        let (_, gradient) = spanned.gradient(self.robot, x);
        let scale = -self.outwards() / gradient.norm();
        let mut by_parameters: ByParameters = [SVector::zeros(); 3];
        let arms = self
            .robot
            .arms()
            .iter()
            .zip(spanned.q)
            .zip(spanned.by_elbow);
        for (((arm, q), by_elbow), own) in arms.zip(&mut by_parameters) {
            // ∂f/∂P = −2 w·∂B/∂P is linear in the forearm w; with another vector in its place it is
            // that vector's product with ∂B/∂P, but for the forearm's own length.
            let mut moved = arm.constraint_by_parameters(&(arm.elbow(q) + by_elbow), q) * -0.5;
            moved[Parameter::Lb.index()] = 0.0;
            let turn = by_elbow.dot(&arm.elbow_derivative(q)) / arm.constraint_by_joint(x, q);
            *own = moved - arm.constraint_by_parameters(x, q) * turn;
            // up = Σ ezᵢ; ∂ez/∂θ = sin α ex, ∂ez/∂α = −ey, and of a tower's direction by its leans ex and ey.
            let basis = arm.basis();
            match arm.drive() {
                Drive::Rotary => {
                    own[Parameter::Theta.index()] += spanned.by_up.dot(&basis.ex) * basis.ey.z;
                    own[Parameter::Alpha.index()] -= spanned.by_up.dot(&basis.ey);
                }
                Drive::Linear => {
                    own[Parameter::LeanX.index()] += spanned.by_up.dot(&basis.ex);
                    own[Parameter::LeanY.index()] += spanned.by_up.dot(&basis.ey);
                }
            }
            *own *= scale;
        }
        let mut values = by_parameters.iter().flat_map(|own| own.iter());
        values
            .all(|value| value.is_finite())
            .then_some(by_parameters)
    }
}

/// A volume spanned by three vectors, g, that must not vanish, and its derivatives.
struct Spanned {
    q: [f64; 3],
    value: f64,
    /// ∂g/∂Bᵢ.
    by_elbow: [Vector3<f64>; 3],
    /// ∂g/∂X with the elbows held.
    by_position: Vector3<f64>,
    /// ∂g/∂up.
    by_up: Vector3<f64>,
}

impl Spanned {
    /// det(w₁, w₂, w₃).
    fn by_forearms(robot: &Robot<f64>, x: &Vector3<f64>, q: [f64; 3]) -> Self {
        let [w1, w2, w3] = forearms(robot, x, &q);
        let [c1, c2, c3] = [w2.cross(&w3), w3.cross(&w1), w1.cross(&w2)];
        Self {
            q,
            value: w1.dot(&c1),
            by_elbow: [-c1, -c2, -c3],
            by_position: c1 + c2 + c3,
            by_up: Vector3::zeros(),
        }
    }

    /// ((B₂ − B₁) × (B₃ − B₁))·up.
    fn by_elbows(robot: &Robot<f64>, q: [f64; 3]) -> Self {
        let [b1, b2, b3] = elbows(robot, &q);
        let (edge2, edge3, up) = (b2 - b1, b3 - b1, robot.up());
        let normal = edge2.cross(&edge3);
        let (by_b2, by_b3) = (edge3.cross(&up), up.cross(&edge2));
        Self {
            q,
            value: normal.dot(&up),
            by_elbow: [-by_b2 - by_b3, by_b2, by_b3],
            by_position: Vector3::zeros(),
            by_up: normal,
        }
    }

    /// g, and ∂g/∂X with the elbows moving along: dBᵢ = Bᵢ′ (wᵢ·dX)/(wᵢ·Bᵢ′).
    fn gradient(&self, robot: &Robot<f64>, x: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let mut gradient = self.by_position;
        for ((arm, q), by_elbow) in robot.arms().iter().zip(self.q).zip(&self.by_elbow) {
            let (w, tangent) = (x - arm.elbow(q), arm.elbow_derivative(q));
            gradient += w * (by_elbow.dot(&tangent) / w.dot(&tangent));
        }
        (self.value, gradient)
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

fn elbows(robot: &Robot<f64>, q: &[f64; 3]) -> [Vector3<f64>; 3] {
    let [arm1, arm2, arm3] = robot.arms();
    let [q1, q2, q3] = *q;
    [arm1.elbow(q1), arm2.elbow(q2), arm3.elbow(q3)]
}

fn forearms(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> [Vector3<f64>; 3] {
    elbows(robot, q).map(|elbow| x - elbow)
}

/// det(w₁, w₂, w₃) at `x`, mm³, and its gradient, mm², on the branches of the joint angles `near`.
pub(super) fn determinant(
    robot: &Robot<f64>,
    x: &Vector3<f64>,
    near: &[f64; 3],
) -> Option<(f64, Vector3<f64>)> {
    let q = branch(robot, x, near)?;
    Some(Spanned::by_forearms(robot, x, q).gradient(robot, x))
}

/// Whether the elbows' plane has another side up at the first joint angles than at the second.
pub(super) fn elbows_turned_over(robot: &Robot<f64>, q: &[f64; 3], other: &[f64; 3]) -> bool {
    let side = |q: &[f64; 3]| Spanned::by_elbows(robot, *q).value > 0.0;
    side(q) != side(other)
}

/// The arm whose forearm lies nearest to the plane of the other two.
pub(super) fn flattest(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> ArmIndex {
    let cofactors = Spanned::by_forearms(robot, x, *q).by_elbow;
    let flatness = |arm: &ArmIndex| cofactors[arm.index()].norm() * robot.arm(*arm).lb();
    ArmIndex::ALL
        .into_iter()
        .max_by(|a, b| flatness(a).total_cmp(&flatness(b)))
        .unwrap_or(ArmIndex::First)
}
