//! Where a printer prints, and how far off it is there.

use crate::accuracy::uncertainty::Sensitivities;
use crate::export::geometry::Frame;
use crate::export::positions::reached;
use crate::files::robot_file::RobotFile;
use crate::fit::solution::{OF_ROBOT, RobotCovariance};
use crate::import::Imported;
use delta_cal::{Real, Robot, Sample};
use nalgebra::{SMatrix, SVector, Vector2, Vector3};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};
use std::f64::consts::TAU;

/// Circles of positions around the centre, and positions on each.
const CIRCLES: u32 = 4;
const ON_A_CIRCLE: u32 = 12;
/// Layers, from the bed up to this part of the height that the carriages allow.
const LAYERS: u32 = 4;
const UP_TO: f64 = 0.6;
/// Lower than this above the bed a position is on it, mm.
pub(super) const ON_THE_BED: f64 = 0.5;
/// Less than this part of an error is clearly better.
const BETTER: f64 = 0.95;
/// The part of what a configuration seems to be off that is its own error, if it is as good as the calibration.
const AS_GOOD: f64 = 0.5;

/// The printed area of a robot that states none, as a part of the towers' or the arms' radius.
const USUAL_AREA: f64 = 0.7;

/// Of the printed area, mm: if none is stated, as far out as the bed was touched at least.
pub(super) fn radius_of(imported: &Imported) -> f64 {
    let robot = &imported.robot.robot;
    let least = robot.arms().iter().map(|arm| arm.d().xy().norm());
    let usual = USUAL_AREA * least.fold(f64::INFINITY, f64::min);
    imported.bed_radius.unwrap_or_else(|| {
        let touches = touches(imported, robot);
        let out = touches.iter().map(|[x, y]| (x * x + y * y).sqrt());
        out.fold(usual, f64::max)
    })
}

/// Where the bed was touched, mm.
pub(super) fn touches(imported: &Imported, robot: &Robot<f64>) -> Vec<[f64; 2]> {
    let measured = imported.readings.rows.len() - imported.held;
    let rows = imported.readings.rows.iter().take(measured);
    let touched = rows.filter(|row| row.value.height.is_some());
    let at = touched.filter_map(|row| robot.forward(&row.value.joints).ok());
    at.map(|at| [at.x, at.y]).collect()
}

/// Touches of a calibrated printer agree with its configuration to this, mm rms.
const AGREE: f64 = 0.045;
/// Fewer touches show as many errors as a calibration has unknowns: with lines from six, 3 of 21 simulated calibrated printers
/// became flatter.
const IMPROVING: usize = 7;

/// A touch of the bed: its row, its place, and how far the configuration is off there, mm.
pub(super) type Touched = (usize, Vector2<f64>, f64);

/// The touches of the bed.
pub(super) fn off(imported: &Imported) -> Vec<Touched> {
    let measured = imported.readings.rows.len() - imported.held;
    let rows = imported.readings.rows.iter().take(measured).enumerate();
    let off = rows.filter_map(|(index, row)| {
        let (_, height) = row.value.height.filter(|(plane, _)| *plane == 0)?;
        let at = imported.configured.forward(&row.value.joints).ok()?;
        Some((index, at.xy().map(|own| own.round() + 0.0), at.z - height))
    });
    off.collect()
}

/// The touches that agree with the configuration and are too few to improve it: their number, and how well, mm rms.
pub(super) fn too_few(imported: &Imported) -> Option<(usize, f64)> {
    let off = off(imported);
    let count = off.len() as f64;
    let mean = off.iter().map(|own| own.2).sum::<f64>() / count;
    let squares = off.iter().map(|own| (own.2 - mean) * (own.2 - mean));
    let left = (squares.sum::<f64>() / count).sqrt();
    (off.len() < IMPROVING && left < AGREE).then_some((off.len(), left))
}

/// A grid of poses that a robot reaches over the printed area, on the bed and above it.
pub(super) fn poses(file: &RobotFile, radius: f64) -> Vec<Sample<f64>> {
    let robot = &file.robot;
    let highest = robot.forward(&[file.limits.maximum(); 3]);
    let top = highest.map_or(0.0, |at| at.z.max(0.0));
    let travel = file.limits.minimum()..=file.limits.maximum();
    let mut poses = Vec::new();
    for layer in 0..LAYERS {
        let z = UP_TO * top * f64::from(layer) / f64::from(LAYERS);
        for at in bed(radius, CIRCLES, ON_A_CIRCLE) {
            let position = Vector3::new(at[0], at[1], z);
            if let Ok(joints) = robot.inverse(&position)
                && joints.iter().all(|joint| travel.contains(joint))
            {
                poses.push(Sample { joints, position });
            }
        }
    }
    poses
}

/// W of mean squares tr(W C), C being the covariance of the parameters.
pub(super) struct Uncertain {
    /// J about its mean at positions on the bed.
    on_bed: Vec<(Vector3<f64>, SMatrix<f64, 3, OF_ROBOT>)>,
    /// Of positions after the best rigid motion, over the printed volume.
    pub(super) relative: RobotCovariance,
    /// Of heights over the bed about their mean.
    pub(super) height: RobotCovariance,
    /// Of x and y on the bed about their mean.
    pub(super) across: RobotCovariance,
}

impl Uncertain {
    /// Over poses of the printed area.
    pub(super) fn of(file: &RobotFile, poses: &[Sample<f64>]) -> Option<Self> {
        let all = Sensitivities::of(&file.robot, &file.tool(), poses.iter().copied());
        let on_bed = all.0.iter();
        let on_bed = on_bed.filter(|(pose, _)| pose.position.z.abs() < ON_THE_BED);
        let on_bed = on_bed.map(|(pose, jacobian)| (pose.position, *jacobian));
        let on_bed: Vec<_> = on_bed.collect();
        let count = on_bed.len() as f64;
        let mut found = Self {
            on_bed: without_place(on_bed, |at| [at.x, at.y]),
            relative: all.relative()?.mean_square(),
            height: RobotCovariance::zeros(),
            across: RobotCovariance::zeros(),
        };
        for (_, left) in &found.on_bed {
            let (across, height) = (left.fixed_rows::<2>(0), left.fixed_rows::<1>(2));
            found.height += height.tr_mul(&height) / count;
            found.across += across.tr_mul(&across) / count;
        }
        Some(found)
    }

    /// The probabilities that a controller's errors on the bed are smaller than another one's, which is a calibration with
    /// this covariance C. With known errors m and the same unknown J δ of both, the mean squares differ by
    ///
    /// ```text
    /// ⟨|m₁|² − |m₂|²⟩ + 2 ⟨(m₁ − m₂)ᵀ J⟩ δ,   δ ~ N(0, C)
    /// ```
    ///
    /// A controller that was itself calibrated, from `other` touches, may be known no worse than C: of its m₁ the part
    /// w = 1 − ⟨J C Jᵀ⟩/⟨|m₁|²⟩ is expected to be its own error (James and Stein), the rest that of the calibration. So C is w C
    /// and the difference less by 2 (1 − w) ⟨|m₁ − m₂|²⟩. `None` where both know the same.
    pub(super) fn better(
        &self,
        before: &Off,
        after: &Off,
        covariance: &RobotCovariance,
        other: bool,
    ) -> Better {
        let of = |axes: Vector3<f64>, own: f64| {
            let (mut mean, mut by_parameters) = (0.0, SVector::zeros());
            for (position, jacobian) in &self.on_bed {
                let known = |off: &Off| {
                    let mut places = off.places.iter();
                    let own = places.find(|([x, y], _)| position.xy() == Vector2::new(*x, *y));
                    own.map(|(_, off)| axes.component_mul(off))
                };
                if let (Some(before), Some(after)) = (known(before), known(after)) {
                    let apart = before - after;
                    mean += before.norm_squared()
                        - after.norm_squared()
                        - 2.0 * (1.0 - own) * apart.norm_squared();
                    by_parameters += jacobian.tr_mul(&apart) * 2.0;
                }
            }
            let variance = own * by_parameters.dot(&(covariance * by_parameters));
            Some(Normal::new(mean, variance.sqrt()).ok()?.sf(0.0))
        };
        let unknown = before.height_sigma * before.height_sigma;
        let all = before.height * before.height;
        let own = if other {
            1.0 - unknown / (all - unknown)
        } else {
            1.0
        };
        Better {
            height: of(Vector3::new(0.0, 0.0, 1.0), own.max(AS_GOOD)),
            across: of(Vector3::new(1.0, 1.0, 0.0), 1.0),
        }
    }
}

/// Displacements about their mean, after the turn about z that leaves least of x and y: nobody sees where a part stands.
pub(super) fn without_place<P, const N: usize>(
    mut all: Vec<(P, SMatrix<f64, 3, N>)>,
    at: impl Fn(&P) -> [f64; 2],
) -> Vec<(P, SMatrix<f64, 3, N>)> {
    let count = all.len().max(1) as f64;
    let mean = all.iter().map(|(_, own)| own).sum::<SMatrix<f64, 3, N>>() / count;
    let mut squares = 0.0;
    let mut turn = SMatrix::<f64, 1, N>::zeros();
    for (place, own) in &mut all {
        *own -= mean;
        let [x, y] = at(place);
        turn += own.row(1) * x - own.row(0) * y;
        squares += x * x + y * y;
    }
    turn /= f64::max(squares, f64::MIN_POSITIVE);
    for (place, own) in &mut all {
        let [x, y] = at(place);
        let [by_x, by_y] = [own.row(0) + turn * y, own.row(1) - turn * x];
        own.set_row(0, &by_x);
        own.set_row(1, &by_y);
    }
    all
}

/// The probabilities that the lines print better than the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Better {
    /// A flatter bed; `None` if it was not touched.
    pub height: Option<f64>,
    /// More accurate x and y on the bed; `None` without distances.
    #[serde(rename = "xy")]
    pub across: Option<f64>,
}

/// Lines from heights alone that are less likely to level the bed are not written: of seven simulated printers between 0.6
/// and this, one got better.
const LIKELY: f64 = 0.7;

impl Better {
    /// Whether the bed gets flatter in all probability, where nothing else was measured.
    pub(super) fn is_likely(self) -> bool {
        match (self.height, self.across) {
            (Some(height), None) => height > LIKELY,
            _ => true,
        }
    }

    /// Of the bed, and of x and y, if the readings say something of them.
    pub(super) fn of(self, [height, across]: [bool; 2]) -> Self {
        Self {
            height: self.height.filter(|_| height),
            across: self.across.filter(|_| across),
        }
    }
}

/// The centre and circles around it, the largest of this radius.
pub(super) fn bed(radius: f64, circles: u32, on_a_circle: u32) -> Vec<[f64; 2]> {
    let mut places = vec![[0.0; 2]];
    for circle in 1..=circles {
        let out = radius * f64::from(circle) / f64::from(circles);
        for index in 0..on_a_circle {
            let (sine, cosine) = (TAU * f64::from(index) / f64::from(on_a_circle)).sine_cosine();
            places.push([out * cosine, out * sine]);
        }
    }
    places
}

/// Places along the diameter of a map.
pub const ACROSS: i32 = 40;

/// Places all over a bed.
pub(super) fn grid(radius: f64) -> impl Iterator<Item = [f64; 2]> {
    let step = 2.0 * radius / f64::from(ACROSS);
    let along = move |index: i32| step * (f64::from(index) + 0.5) - radius;
    let all = (0..ACROSS).flat_map(move |x| (0..ACROSS).map(move |y| [along(x), along(y)]));
    all.filter(move |[x, y]| x.hypot(*y) <= radius)
}

/// Places on the bed, each with how far the nozzle is from there in the controller's frame, about the mean, mm.
pub type Map = Vec<([f64; 2], Vector3<f64>)>;

/// How far a nozzle is expected to be from where its controller believes, over the bed: what is known to be off, and
/// what is not known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Off {
    /// Of its height about the mean, rms, mm.
    #[serde(rename = "height_rms_mm")]
    pub height: f64,
    /// The part of it that is not known, one σ.
    #[serde(rename = "height_sigma_mm")]
    pub height_sigma: f64,
    /// The largest that is known.
    #[serde(rename = "height_worst_mm")]
    pub worst_height: f64,
    /// Of x and y about their mean, rms, mm.
    #[serde(rename = "xy_rms_mm")]
    pub across: f64,
    /// What 100 mm on the bed become, mm.
    #[serde(rename = "hundred_mm_become_mm")]
    pub hundred: f64,
    /// What is known, at the places over which the means are taken.
    #[serde(skip)]
    pub(super) places: Map,
    /// What is known, at places [`ACROSS`] the bed.
    #[serde(skip)]
    pub map: Map,
}

impl Off {
    /// Of a controller with these kinematics, whose frame is this one of the calibrated robot's. `sigmas`: of heights and
    /// of x and y.
    pub(super) fn of(
        calibrated: &RobotFile,
        (controller, frame): (&Robot<f64>, Frame),
        radius: f64,
        sigmas: [f64; 2],
    ) -> Option<Self> {
        let (frame, tool) = (frame.transform(), calibrated.tool());
        let calibrated = (&calibrated.robot, &tool);
        let off = |[x, y]: [f64; 2]| {
            let wanted = Vector3::new(x, y, 0.0);
            let is = reached(calibrated, controller, &wanted)?;
            Some(([x, y], frame.apply(&is) - wanted))
        };
        let about_mean = |places: Vec<[f64; 2]>| -> Map {
            without_place(places.into_iter().filter_map(off).collect(), |at| *at)
        };
        let all = about_mean(bed(radius, CIRCLES, ON_A_CIRCLE));
        if all.len() < 3 {
            return None;
        }
        let sum = |of: fn(&([f64; 2], Vector3<f64>)) -> f64| all.iter().map(of).sum::<f64>();
        let rms = |squares: f64| (squares / all.len() as f64).sqrt();
        let along = sum(|([x, y], off)| x * off.x + y * off.y);
        let [height_sigma, across_sigma] = sigmas;
        Some(Self {
            height: rms(sum(|(_, off)| off.z * off.z)).hypot(height_sigma),
            height_sigma,
            worst_height: all
                .iter()
                .fold(0.0, |worst, (_, off)| off.z.abs().max(worst)),
            across: rms(sum(|(_, off)| off.xy().norm_squared())).hypot(across_sigma),
            hundred: 100.0 * (1.0 + along / sum(|([x, y], _)| x * x + y * y)),
            map: about_mean(grid(radius).collect()),
            places: all,
        })
    }

    /// Without what the readings say nothing of.
    pub(super) fn of_readings(mut self, [height, across]: [bool; 2]) -> Self {
        if !height {
            [self.height, self.height_sigma, self.worst_height] = [f64::NAN; 3];
            self.map.clear();
        }
        if !across {
            self.across = f64::NAN;
            for (_, off) in &mut self.map {
                (off.x, off.y) = (0.0, 0.0);
            }
        }
        self
    }

    /// Whether it prints clearly better than another one in what is judged, and nowhere worse.
    pub(super) fn is_better_than(&self, other: &Self, [height, across]: [bool; 2]) -> bool {
        let height = height.then(|| self.height / other.height);
        let across = across.then(|| self.across / other.across);
        let parts = || height.into_iter().chain(across);
        parts().any(|own| own < BETTER) && parts().all(|own| own < 1.0 / BETTER)
    }
}
