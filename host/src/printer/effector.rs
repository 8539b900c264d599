//! An effector that tilts because the two rods of a tower differ, and what that makes of a probe beside the nozzle.

use super::area::{Map, bed, grid, without_place};
use crate::calibration::NAMED;
use crate::files::robot_file::RobotFile;
use crate::fit::Solution;
use crate::geometry::{NUMBERS, OF_ARM, Parallelograms};
use crate::import::{Firmware, Imported, OF_PROBE};
use crate::text::significant;
use nalgebra::{Matrix2, RowSVector, Vector2, Vector3};
use serde::Serialize;

/// Without papers, rods of a tower that differ by more than this many σ are named: with 2, those of every fourth level effector are.
const SHOWN: f64 = 3.0;
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
    /// Towers whose rods explain the touches as well.
    pub or_towers: Vec<&'static str>,
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
        let of_numbers = solution.covariance.view(
            (numbers.start, numbers.start),
            (numbers.len(), numbers.len()),
        );
        let variance = columns.iter().map(|own| {
            let own = own - mean;
            (own * of_numbers * own.transpose())[(0, 0)]
        });
        let towers = match imported.firmware {
            Firmware::Klipper => ["A", "B", "C"],
            _ => ["X", "Y", "Z"],
        };
        let touched = imported.readings.rows.iter();
        let mut touched = touched.filter(|row| row.value.height.is_some());
        let separated = touched.any(|row| row.value.target != OF_PROBE);
        let least = if separated { NAMED } else { SHOWN };
        // The difference of an arm's rods and its σ if of them, and of another arm's, nothing is known but the readings.
        let shown = |arm: usize, other: usize| {
            let places = [arm, other].map(|own| numbers.start + OF_ARM * own);
            let own = Matrix2::from_fn(|row, column| match (row == column, arm == other) {
                (false, true) => 0.0,
                _ => solution.covariance[(places[row], places[column])],
            });
            let found = Vector2::new(rods.numbers[arm][0], rods.numbers[other][0]);
            let open = Matrix2::from_diagonal_element(rods.tolerance[0].powi(-2));
            let own = own.try_inverse()?;
            let left = (own - open).try_inverse()?;
            let difference = (left * own * found).x;
            let sigma = left.m11.sqrt();
            Some((difference, sigma)).filter(|_| difference.abs() > least * sigma)
        };
        let size = |arm: usize| shown(arm, arm).map_or(0.0, |(own, sigma)| own.abs() / sigma);
        let others = |arm: usize| (0..3).filter(move |other| *other != arm);
        // Without what is left of an arm beside another one, that one explains it.
        let instead = |arm: usize| {
            others(arm).filter(move |other| shown(arm, *other).is_none() && size(*other) > 0.0)
        };
        let named = |arm: usize| {
            let (difference, sigma) = shown(arm, arm)?;
            if instead(arm).any(|other| size(other) > size(arm)) {
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
                or_towers: instead(arm).map(|other| towers[other]).collect(),
                towards: towers[lowest],
                difference_mm: difference.abs(),
                sigma_mm: sigma,
                tilt_mrad: 1e3 * most.norm(),
            })
        };
        Some(Self {
            rods: (0..3).filter_map(named).collect(),
            probe_bias_rms_mm: (squares / map.len().max(1) as f64).sqrt(),
            probe_bias_sigma_mm: (variance.sum::<f64>() / count).sqrt(),
            separated,
            map,
        })
    }

    /// In sentences.
    pub(super) fn notes(&self, spacing: f64) -> Vec<String> {
        let differing = self.rods.iter().map(|own| {
            let [size, sigma] = [significant(own.difference_mm, 2), significant(own.sigma_mm, 1)];
            if !own.or_towers.is_empty() {
                return format!(
                    "The effector tilts: the two rods of tower {} or {} differ, by {size} ± {sigma} mm if they are those of {} \
                     (with rods {spacing:.0} mm apart). Measure these pairs of rods, and match them.",
                    own.tower,
                    own.or_towers.join(" or "),
                    own.tower
                );
            }
            format!(
                "The effector tilts towards tower {} by {} mrad at the rim: the two rods of tower {} differ by {size} ± {sigma} mm \
                 (with rods {spacing:.0} mm apart). Exchange or match them.",
                own.towards,
                significant(own.tilt_mrad, 2),
                own.tower,
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
