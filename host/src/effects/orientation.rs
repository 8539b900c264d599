//! Rotations of the platform, read by an instrument with six degrees of freedom.
//!
//! ```text
//! measured rotation = F R M
//! ```
//!
//! F turns the robot's axes into those of the coordinates, R is the platform's rotation, and M how the target is mounted, which
//! nobody knows: a row says by how much R differs from its mean over the rows of that target.

use crate::files::samples_file::Readings;
use crate::geometry::{NUMBERS, Parallelograms, rotation};
use crate::halt;
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use nalgebra::{DVector, SMatrix, UnitQuaternion, Vector3};

/// σ of a rotation, radians, if none is stated: 0.01°, and the degrees of freedom that this is worth.
pub(crate) const USUAL: f64 = 1.75e-4;
const WORTH: f64 = 2.0;
/// Residuals contradict a stated noise beyond so many σ of their mean square.
const CONTRADICTED: f64 = 3.0;

/// The rotation in a row, times √ of the row's weight.
#[derive(Debug, Clone)]
pub(crate) struct Orientation {
    /// The measured rotation vector less the computed one, without the mean of both, radians.
    pub(crate) off: Vector3<f64>,
    /// Derivative of the computed one by each of the rods' numbers.
    pub(crate) by_numbers: SMatrix<f64, 3, NUMBERS>,
}

/// Of all rows with a rotation, in a frame; rows that the robot does not reach have none. `weight`: of a row.
pub(crate) fn orientations(
    (robot, rods): (&Robot<f64>, &Parallelograms),
    frame: Option<&RigidTransform<f64>>,
    readings: &Readings,
    weight: impl Fn(usize) -> f64,
) -> Vec<Orientation> {
    let axes = frame
        .map_or_else(UnitQuaternion::identity, rotation)
        .inverse();
    let mut found = Vec::new();
    for target in 0..readings.targets.len().max(1) {
        let rows = readings.rows.iter().enumerate();
        let rows = rows.filter(|(_, row)| row.value.target == target);
        let own = rows.filter_map(|(index, row)| {
            halt::check();
            let (turn, joints) = (row.value.turn?, &row.value.joints);
            let computed = UnitQuaternion::new(rods.pose(robot, joints).ok()?.tilt);
            let by_numbers = rods.turns(robot, (&robot.forward(joints).ok()?, joints))?;
            let mounted = computed.inverse() * axes * UnitQuaternion::new(turn);
            Some((weight(index), mounted, by_numbers))
        });
        let own: Vec<_> = own.collect();
        let Some((_, first, _)) = own.first() else {
            continue;
        };
        let own = own.iter().map(|(weight, mounted, by_numbers)| {
            let off = (mounted * first.inverse()).scaled_axis();
            (*weight, off, *by_numbers)
        });
        let own: Vec<_> = own.collect();
        let all = own.iter().map(|(weight, ..)| weight).sum::<f64>();
        let off = own.iter().map(|(weight, off, _)| off * *weight / all);
        let off = off.sum::<Vector3<f64>>();
        let by = own.iter().map(|(weight, _, by)| by * *weight / all);
        let by = by.sum::<SMatrix<f64, 3, NUMBERS>>();
        found.extend(own.iter().filter(|own| own.0 > 0.0).map(|own| Orientation {
            off: (own.1 - off) * own.0.sqrt(),
            by_numbers: (own.2 - by) * own.0.sqrt(),
        }));
    }
    found
}

/// What the residuals say of the noise of rotations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientationNoise {
    /// Number of rows with a rotation.
    pub rows: usize,
    /// σ in the fit, radians.
    pub sigma: f64,
    /// The stated one, if any.
    pub stated: Option<f64>,
    /// The one that the residuals show; `None` without redundant readings.
    pub shown: Option<f64>,
}

impl OrientationNoise {
    /// Of residuals in units of σ, with these degrees of freedom.
    pub(crate) fn of(
        rows: usize,
        (sigma, stated): (f64, Option<f64>),
        residuals: &DVector<f64>,
        freedom: f64,
    ) -> Self {
        let square = residuals.norm_squared() * sigma * sigma;
        Self {
            rows,
            sigma: match stated {
                Some(own) => {
                    let most = 1.0 + CONTRADICTED * (2.0 / freedom.max(1.0)).sqrt();
                    let shown = square / freedom.max(1.0);
                    if shown > most * own * own {
                        shown.sqrt()
                    } else {
                        own
                    }
                }
                None => ((square + WORTH * USUAL * USUAL) / (freedom.max(0.0) + WORTH)).sqrt(),
            },
            stated,
            shown: (freedom > 1.0).then(|| (square / freedom).sqrt()),
        }
    }

    /// Whether the residuals contradict what is stated.
    pub fn contradicts(&self) -> bool {
        self.stated.is_some_and(|own| self.sigma > own)
    }
}
