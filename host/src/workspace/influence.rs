//! How the boundary moves with the 24 parameters, to first order.

use super::Workspace;
use super::surface::{Surface, Varied};
use crate::accuracy::information::{parameters, prior_covariance};
use crate::cores;
use crate::files::Convention;
use delta_cal::robot::ParameterKind;
use delta_cal::{ArmIndex, Parameter, Tolerance};
use nalgebra::SVector;
use serde::Serialize;

/// Influence of one parameter on the boundary, per mm for a length and per degree for an angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ParameterInfluence {
    /// The arm, from 1.
    pub arm: usize,
    /// The parameter.
    pub parameter: &'static str,
    /// Unit of the parameter to which the displacements refer.
    pub per: &'static str,
    /// rms displacement of the boundary along its normal, weighted by area.
    pub rms_mm: f64,
    /// Largest outward displacement.
    pub outwards_mm: f64,
    /// Largest inward displacement (negative).
    pub inwards_mm: f64,
    /// Change of the volume: the integral of the displacement over the boundary.
    pub volume_litres: f64,
}

/// Standard uncertainty of the boundary for the stated tolerance of the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ToleranceBand {
    /// σ of the displacement along the normal, rms weighted by area.
    pub sigma_mm: f64,
    /// σ at the worst point.
    pub largest_sigma_mm: f64,
    /// σ of the volume.
    pub volume_sigma_litres: f64,
}

/// How the boundary moves with each parameter: the displacement of each boundary point along its outward normal, ordered by
/// arm, mm per mm or mm per radian. `None` where the surface has no normal.
#[derive(Debug, Clone, PartialEq)]
pub struct Influence(pub Vec<Option<[f64; 24]>>);

impl Influence {
    /// Computes the influence of the robot's parameters on its workspace's boundary.
    pub fn of(workspace: &Workspace) -> Self {
        let Workspace { robot, reach, .. } = workspace;
        let varied = Varied::of(robot);
        Self(cores::map(&workspace.points, |point| {
            let surface = Surface::new(robot, reach, point.limit, point.q);
            surface.displacement(&varied, &point.position)
        }))
    }

    /// Areas (mm²) and displacements of the points.
    fn by_area<'a>(
        &'a self,
        workspace: &'a Workspace,
    ) -> impl Iterator<Item = (f64, &'a [f64; 24])> {
        let points = workspace.points.iter().zip(&self.0);
        points.filter_map(|(point, moved)| Some((point.area, moved.as_ref()?)))
    }

    /// The influence of each parameter in a convention, arm by arm.
    pub fn of_parameters(
        &self,
        workspace: &Workspace,
        convention: &Convention,
    ) -> Vec<ParameterInfluence> {
        let of = |(arm, parameter): (ArmIndex, Parameter)| {
            let index = 8 * arm.index() + parameter.index();
            let (mut square, mut volume, mut sum) = (0.0, 0.0, 0.0);
            let (mut outwards_mm, mut inwards_mm) = (0.0_f64, 0.0_f64);
            for (area, moved) in self.by_area(workspace) {
                let moved = convention.sign(parameter) * moved[index] * unit(parameter);
                sum += area;
                square += moved * moved * area;
                volume += moved * area;
                outwards_mm = outwards_mm.max(moved);
                inwards_mm = inwards_mm.min(moved);
            }
            ParameterInfluence {
                arm: arm.index() + 1,
                parameter: parameter.symbol(),
                per: match parameter.kind() {
                    ParameterKind::Length => "mm",
                    ParameterKind::Ratio => "1",
                    ParameterKind::Angle => "degree",
                },
                rms_mm: (square / sum).sqrt(),
                outwards_mm,
                inwards_mm,
                volume_litres: volume * 1e-6,
            }
        };
        parameters(&workspace.robot).map(of).collect()
    }

    /// The uncertainty of the boundary when the parameters are known to this tolerance.
    pub fn within(&self, workspace: &Workspace, tolerance: &Tolerance<f64>) -> ToleranceBand {
        let covariance = prior_covariance(&workspace.robot, tolerance);
        let sigma_of = |moved: &[f64; 24]| {
            let moved = SVector::from(*moved);
            moved.dot(&(covariance * moved)).sqrt()
        };
        let (mut square, mut sum, mut largest, mut volume) = (0.0, 0.0, 0.0_f64, [0.0; 24]);
        for (area, moved) in self.by_area(workspace) {
            let sigma = sigma_of(moved);
            square += sigma * sigma * area;
            sum += area;
            largest = largest.max(sigma);
            for (volume, moved) in volume.iter_mut().zip(moved) {
                *volume += moved * area * 1e-6;
            }
        }
        ToleranceBand {
            sigma_mm: (square / sum).sqrt(),
            largest_sigma_mm: largest,
            volume_sigma_litres: sigma_of(&volume),
        }
    }
}

/// The unit of a parameter in results: a millimetre, or a degree in radians.
pub fn unit(parameter: Parameter) -> f64 {
    match parameter.kind() {
        ParameterKind::Length | ParameterKind::Ratio => 1.0,
        ParameterKind::Angle => 1f64.to_radians(),
    }
}
