//! Rotations of the platform, read by an instrument with six degrees of freedom.
//!
//! ```text
//! measured rotation = F R M
//! ```
//!
//! F turns the robot's axes into those of the coordinates, R is the platform's rotation, and M how the target is mounted, which
//! nobody knows: a row says by how much R differs from its mean over the rows of that target.

use crate::files::Readings;
use crate::geometry::{NUMBERS, Parallelograms, rotation};
use crate::halt;
use crate::text::degrees;
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use nalgebra::{DVector, SMatrix, UnitQuaternion};
use serde::Serialize;

/// σ of a rotation, radians, if none is stated: 0.01°, and the degrees of freedom that this is worth.
pub(crate) const USUAL: f64 = 1.75e-4;
const WORTH: f64 = 2.0;
/// Residuals contradict a stated noise beyond so many σ of their mean square.
const CONTRADICTED: f64 = 3.0;

/// The derivatives of a row's rotation vector by the rods' numbers, and last the measured vector less the computed one, radians:
/// without the mean over the target's rows, times √ of the row's weight.
pub(crate) type Orientation = SMatrix<f64, 3, { NUMBERS + 1 }>;

/// Of all rows with a rotation, in a frame. `weight`: of a row.
pub(crate) fn orientations(
    (robot, rods): (&Robot<f64>, &Parallelograms),
    frame: Option<&RigidTransform<f64>>,
    readings: &Readings,
    weight: impl Fn(usize) -> f64,
) -> Vec<Orientation> {
    let axes = frame.map_or_else(UnitQuaternion::identity, rotation);
    let mut found = Vec::new();
    for target in 0..readings.targets.len().max(1) {
        let mut first = None;
        let rows = readings.rows.iter().enumerate();
        let own = rows.filter_map(|(index, row)| {
            halt::check();
            let (turn, joints) = (row.value.turn?, &row.value.joints);
            let weight = weight(index);
            if row.value.target != target || !(weight > 0.0) {
                return None;
            }
            let position = robot.forward(joints).ok()?;
            let by_numbers = rods.turns(robot, (&position, joints))?;
            let computed = UnitQuaternion::new(rods.pose(robot, joints).ok()?.tilt);
            let mounted = (axes * computed).inverse() * UnitQuaternion::new(turn);
            let off = mounted * first.get_or_insert(mounted).inverse();
            let mut own = Orientation::zeros();
            own.fixed_columns_mut::<NUMBERS>(0).copy_from(&by_numbers);
            own.set_column(NUMBERS, &off.scaled_axis());
            Some((weight, own))
        });
        let own: Vec<_> = own.collect();
        let all = own.iter().map(|(weight, _)| weight).sum::<f64>();
        let mean = own.iter().map(|(weight, own)| own * (*weight / all));
        let mean = mean.sum::<Orientation>();
        found.extend(own.iter().map(|(weight, own)| (own - mean) * weight.sqrt()));
    }
    found
}

/// What the residuals say of the noise of rotations, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OrientationNoise {
    /// Number of rows with a rotation.
    pub rows: usize,
    /// `orientation_deg`.
    pub stated_deg: Option<f64>,
    /// σ in the fit.
    pub used_deg: f64,
    /// What the residuals show; `None` without redundant readings.
    pub shown_deg: Option<f64>,
}

impl OrientationNoise {
    /// Of residuals in units of a σ, radians, with these degrees of freedom.
    pub(crate) fn of(
        residuals: &DVector<f64>,
        (sigma, stated): (f64, Option<f64>),
        freedom: f64,
    ) -> Self {
        let square = residuals.norm_squared() * sigma * sigma;
        let shown = (freedom > 1.0).then(|| (square / freedom).sqrt());
        let used = match stated {
            None => ((square + WORTH * USUAL * USUAL) / (freedom.max(0.0) + WORTH)).sqrt(),
            Some(stated) => {
                let most = stated * (1.0 + CONTRADICTED * (2.0 / freedom).sqrt()).sqrt();
                shown.filter(|own| *own > most).unwrap_or(stated)
            }
        };
        Self {
            rows: residuals.len() / 3,
            stated_deg: stated.map(degrees),
            used_deg: degrees(used),
            shown_deg: shown.map(degrees),
        }
    }

    /// Whether the residuals contradict what is stated.
    pub fn contradicts(&self) -> bool {
        self.stated_deg.is_some() && self.shown_deg == Some(self.used_deg)
    }
}
