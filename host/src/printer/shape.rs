//! The shape of the bed itself, which no parameter of a printer makes flat.

use super::area::{Map, grid};
use crate::effects::{Course, EffectKind, Platform, waves_of_bed};
use crate::files::robot_file::RobotFile;
use crate::fit::Solution;
use nalgebra::{DVector, Vector2, Vector3};
use serde::Serialize;

/// A shape that is so many times its σ is found.
const SHOWN: f64 = 3.0;

/// How uneven the touches show the bed to be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Uneven {
    /// rms, mm.
    pub rms_mm: f64,
    /// One σ of it, mm.
    pub sigma_mm: f64,
    /// Its height at places all over it, mm.
    #[serde(skip)]
    pub map: Map,
}

impl Uneven {
    /// `None` if the touches show none.
    pub(super) fn of(robot: &RobotFile, solution: &Solution, radius: f64) -> Option<Self> {
        let own = solution.effect(EffectKind::Bed)?;
        let size = own.by.len();
        let by = DVector::from_column_slice(&own.by);
        let rms = by.norm();
        let covariance = solution
            .covariance
            .view((own.first, own.first), (size, size));
        let sigma = by.dot(&(covariance * &by)).sqrt() / rms;
        if !(rms > SHOWN * sigma) {
            return None;
        }
        let readings = &solution.readings;
        let platform = Platform::of(robot, &readings.targets);
        let course = Course::of(&solution.robot, platform, &solution.places, readings);
        let out = course.disc.sqrt();
        let height = |[x, y]: [f64; 2]| {
            let waves = waves_of_bed(Vector2::new(x, y) / out);
            by.dot(&DVector::from_column_slice(&waves))
        };
        let touched = grid(radius).filter(|[x, y]| x.hypot(*y) <= out);
        Some(Self {
            rms_mm: rms,
            sigma_mm: sigma,
            map: touched
                .map(|at| (at, Vector3::new(0.0, 0.0, height(at))))
                .collect(),
        })
    }

    /// In a sentence.
    pub(super) fn note(&self) -> String {
        format!(
            "The bed itself is uneven by {:.3} ± {:.3} mm rms: the lines leave that, a bed mesh compensates for it.",
            self.rms_mm, self.sigma_mm
        )
    }
}
