//! An effector that tilts because the two rods of a tower differ, and what that makes of a probe beside the nozzle.

use super::area::{Map, bed, grid, without_place};
use crate::calibration::NAMED;
use crate::files::robot_file::RobotFile;
use crate::fit::Solution;
use crate::geometry::{NUMBERS, OF_ARM, Parallelograms};
use crate::import::{Firmware, Imported, OF_PROBE};
use crate::text::significant;
use nalgebra::{RowSVector, Vector2, Vector3};
use serde::Serialize;

/// Places around the rim.
const AROUND: u32 = 24;

/// How the effector tilts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effector {
    /// Rods of a tower that differ by more than their uncertainty explains.
    pub rods: Vec<Differing>,
    /// The height of the probe's touches against the nozzle's over the bed, about its mean, rms, mm.
    pub probe_bias_rms_mm: f64,
    /// One σ of it over the bed, rms, mm.
    pub probe_bias_sigma_mm: f64,
    /// Whether the nozzle touched the bed too.
    pub separated: bool,
    /// The bias at places all over the bed, mm.
    #[serde(skip)]
    pub map: Map,
}

/// Rods of a tower that differ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Differing {
    /// The tower, as its controller calls it.
    pub tower: &'static str,
    /// The tower towards which the effector is lower.
    pub towards: &'static str,
    /// By how much they differ, and one σ of it, mm.
    pub difference_mm: f64,
    /// One σ of that.
    pub sigma_mm: f64,
    /// The tilt, at most around the rim of the bed, milliradians.
    pub tilt_mrad: f64,
}

impl Effector {
    /// `None` if the probe is below the nozzle or touched nothing.
    pub(super) fn of(
        imported: &Imported,
        calibrated: &RobotFile,
        solution: &Solution,
        radius: f64,
    ) -> Option<Self> {
        let (rods, found) = (calibrated.parallelograms?, solution.tilt()?);
        let probe = imported.robot.instruments.targets.get(OF_PROBE)?.place;
        let robot = &calibrated.robot;
        let pose = |rods: &Parallelograms, [x, y]: [f64; 2]| {
            let joints = robot.inverse(&Vector3::new(x, y, 0.0)).ok()?;
            rods.pose(robot, &joints).ok()
        };
        let bias = |at: [f64; 2]| {
            let own = pose(&rods, at)?;
            Some((at, Vector3::z() * (own.of(&probe) - own.position).z))
        };
        let map = without_place(grid(radius).filter_map(bias).collect(), |at| *at);
        let squares = map.iter().map(|(_, own)| own.z * own.z).sum::<f64>();
        // To first order, the bias by each of the numbers.
        let columns = bed(radius, 4, AROUND / 2).into_iter().filter_map(|[x, y]| {
            let position = Vector3::new(x, y, 0.0);
            let joints = robot.inverse(&position).ok()?;
            let at = |point: &Vector3<f64>| rods.columns(robot, (&position, &joints), point);
            Some((at(&probe)? - at(&Vector3::zeros())?).row(2).into_owned())
        });
        let columns: Vec<_> = columns.collect();
        let count = columns.len().max(1) as f64;
        let mean = columns.iter().sum::<RowSVector<f64, NUMBERS>>() / count;
        let numbers = found.places();
        let covariance = solution.covariance.view(
            (numbers.start, numbers.start),
            (numbers.len(), numbers.len()),
        );
        let variance = columns.iter().map(|own| {
            let own = own - mean;
            (own * covariance * own.transpose())[(0, 0)]
        });
        let towers = match imported.firmware {
            Firmware::Klipper => ["A", "B", "C"],
            _ => ["X", "Y", "Z"],
        };
        let named = |arm: usize| {
            let (difference, place) = (rods.numbers[arm][0], numbers.start + OF_ARM * arm);
            let sigma = solution.covariance[(place, place)].sqrt();
            if !(difference.abs() > NAMED * sigma) {
                return None;
            }
            let mut alone = rods.with_numbers(&[0.0; NUMBERS]);
            alone.numbers[arm][0] = difference;
            let rim = bed(radius, 1, AROUND).into_iter();
            let tilts = rim.filter_map(|at| Some(pose(&alone, at)?.tilt.xy()));
            let most = tilts.max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
            let lower = Vector2::new(most.y, -most.x);
            let towards = |arm: &usize| robot.arms()[*arm].d().xy().normalize().dot(&lower);
            let lowest = (0..3).max_by(|a, b| towards(a).total_cmp(&towards(b)))?;
            Some(Differing {
                tower: towers[arm],
                towards: towers[lowest],
                difference_mm: difference.abs(),
                sigma_mm: sigma,
                tilt_mrad: 1e3 * most.norm(),
            })
        };
        let touched = imported.readings.rows.iter();
        let mut touched = touched.filter(|row| row.value.height.is_some());
        Some(Self {
            rods: (0..3).filter_map(named).collect(),
            probe_bias_rms_mm: (squares / map.len().max(1) as f64).sqrt(),
            probe_bias_sigma_mm: (variance.sum::<f64>() / count).sqrt(),
            separated: touched.any(|row| row.value.target != OF_PROBE),
            map,
        })
    }

    /// In sentences.
    pub(super) fn notes(&self, spacing: f64) -> Vec<String> {
        let differing = self.rods.iter().map(|own| {
            format!(
                "The effector tilts towards tower {} by {} mrad at the rim: the two rods of tower {} differ by {} ± {} mm \
                 (with rods {spacing:.0} mm apart). Exchange or match them.",
                own.towards,
                significant(own.tilt_mrad, 2),
                own.tower,
                significant(own.difference_mm, 2),
                significant(own.sigma_mm, 1),
            )
        });
        let shown = self.probe_bias_rms_mm > NAMED * self.probe_bias_sigma_mm;
        let bias = if self.separated && !shown {
            format!(
                "No tilt of the effector shows: a tilt biases the probe by at most some {:.3} mm rms over the bed. The \
                 lines count it.",
                NAMED * self.probe_bias_sigma_mm
            )
        } else if self.separated {
            format!(
                "The probe's bias over the bed is {:.3} ± {:.3} mm rms, because the effector tilts. The lines count it.",
                self.probe_bias_rms_mm, self.probe_bias_sigma_mm
            )
        } else {
            format!(
                "The probe is beside the nozzle: rods of a tower that differ by 0.1 mm, as is usual, bias it by {:.2} mm rms \
                 over the bed. The stated errors count that. Touch seven places with the nozzle on paper too.",
                self.probe_bias_sigma_mm
            )
        };
        differing.chain([bias]).collect()
    }
}
