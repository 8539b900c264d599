//! The sensor's frame from points on the machine that the sensor measured too.

use super::Frame;
use crate::accuracy::rigid_motion::RigidMotions;
use crate::files::{DatumPoint, InputError, RobotFile};
use crate::geometry::centroid;
use crate::text::{count, significant};
use delta_cal::frame::RigidTransform;
use nalgebra::Vector3;

/// Fewest points that determine a frame.
const LEAST: usize = 3;
/// A datum with residuals of this many σ contains a wrong point.
const MOST_SIGMAS: f64 = 5.0;
/// Factor by which an explanation must lower the residuals.
const CLEARLY: f64 = 4.0;
/// A stated place is contradicted beyond this many σ.
pub(crate) const CONTRADICTED: f64 = 3.0;
/// σ of a point of the machine, at the least, before that is said, mm.
const UNSTATED: f64 = 0.1;

/// Transformation from the robot's base frame to the sensor's, from the points of `[datum]`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Datum {
    pub(crate) frame: RigidTransform<f64>,
    points: Vec<DatumPoint>,
    /// Residual of each point, mm.
    pub(crate) residuals: Vec<(String, f64)>,
}

impl Datum {
    /// `None` if the robot file has no `[datum]`.
    ///
    /// # Errors
    /// Positions that are not in the sensor's frame; points that determine no frame or disagree with the sensor.
    pub(crate) fn of(robot: &RobotFile, frame: Frame) -> Result<Option<Self>, InputError> {
        let fault = |cause: String| {
            InputError::new(&robot.name, cause)
                .at_key("[datum]")
                .with_remedy(
                    "measure three or more points of the machine, far apart, with the sensor where it stands",
                )
        };
        let points = &robot.instruments.datum;
        if points.is_empty() {
            return Ok(None);
        }
        if frame == Frame::Base {
            let cause = "the section says where the sensor stands, and the positions are taken as in the robot's frame";
            return Err(InputError::new(&robot.name, cause)
                .at_key("[datum]")
                .with_remedy("use --frame sensor, or delete the section"));
        }
        if points.len() < LEAST {
            let cause = format!(
                "{} do not fix a frame: at least {LEAST} are needed",
                count(points.len(), "datum point")
            );
            return Err(fault(cause));
        }
        let on_a_line = "the datum points lie on a line, so they do not fix a frame";
        let datum = Self::fitted(points).ok_or_else(|| fault(on_a_line.to_owned()))?;
        let rms = datum.rms();
        let stated = points.iter().filter_map(|point| point.sigma);
        let stated = stated.fold(UNSTATED, f64::max);
        // A scale moves the points against each other.
        let centre = centroid(points.iter().map(|point| point.place));
        let out = points.iter().map(|point| (point.place - centre).norm());
        let facts = &robot.instruments;
        let scale = facts.scale_sigma() + facts.expansion.abs();
        let stated = stated.hypot(scale * out.fold(0.0, f64::max));
        match &robot.noise {
            Some(noise) if rms > MOST_SIGMAS * noise.position().hypot(stated) => {
                Err(fault(format!(
                    "the datum points do not fit the sensor's measurements ({rms:.3} mm rms){}",
                    datum.explanation()
                ))
                .with_remedy(
                    "check x_mm, y_mm and z_mm of the points, their measurements and the instrument's scale; the sensor must \
                     not move",
                ))
            }
            _ => Ok(Some(datum)),
        }
    }

    /// The frame of the coordinates, if the file says which: the base's, or that of the datum points.
    ///
    /// # Errors
    /// As [`of`](Self::of), in a sensor's frame.
    pub(crate) fn known_frame(
        robot: &RobotFile,
        frame: Frame,
    ) -> Result<Option<RigidTransform<f64>>, InputError> {
        match frame {
            Frame::Base => Ok(Some(RigidTransform::identity())),
            Frame::Sensor => Ok(Self::of(robot, frame)?.map(|own| own.frame)),
        }
    }

    /// `None` if the points do not fix a frame.
    fn fitted(points: &[DatumPoint]) -> Option<Self> {
        let pairs = points.iter().map(|point| (point.place, point.seen));
        let frame = RigidTransform::align(pairs)?;
        let residuals = points.iter().map(|point| {
            let off = (point.seen - frame.apply(&point.place)).norm();
            (point.name.clone(), off)
        });
        Some(Self {
            frame,
            points: points.to_vec(),
            residuals: residuals.collect(),
        })
    }

    /// What would make the points fit: two that are exchanged, one that is wrong, or another scale of the instrument.
    fn explanation(&self) -> String {
        let clearly = |own: &Self| own.rms() < self.rms() / CLEARLY;
        let all = 0..self.points.len();
        let pairs = all
            .clone()
            .flat_map(|one| (one + 1..self.points.len()).map(move |other| (one, other)));
        let exchanged = pairs.filter_map(|(one, other)| {
            let mut points = self.points.clone();
            (points[one].seen, points[other].seen) = (points[other].seen, points[one].seen);
            let own = Self::fitted(&points).filter(clearly)?;
            let names = format!("{} and {}", self.points[one].name, self.points[other].name);
            Some((own.rms(), format!("; {names} look exchanged")))
        });
        let without = all
            .filter(|_| self.points.len() > LEAST)
            .filter_map(|wrong| {
                let mut points = self.points.clone();
                let point = points.remove(wrong);
                let own = Self::fitted(&points).filter(clearly)?;
                let off = (point.seen - own.frame.apply(&point.place)).norm();
                Some((
                    own.rms(),
                    format!("; {} is {off:.2} mm off the others", point.name),
                ))
            });
        let spread = |of: fn(&DatumPoint) -> Vector3<f64>| {
            let centre = centroid(self.points.iter().map(of));
            let out = self
                .points
                .iter()
                .map(|own| (of(own) - centre).norm_squared());
            out.sum::<f64>().sqrt()
        };
        let (places, seen) = (spread(|own| own.place), spread(|own| own.seen));
        let mut points = self.points.clone();
        for point in &mut points {
            point.place *= seen / places;
        }
        let scaled = Self::fitted(&points).filter(clearly).map(|own| {
            let more = if seen > places { "larger" } else { "smaller" };
            let by = significant(100.0 * (seen / places - 1.0).abs(), 2);
            (
                own.rms(),
                format!("; all measured lengths are {by} % {more} than the stated ones"),
            )
        });
        let best = exchanged.chain(without).chain(scaled);
        let best = best.min_by(|a, b| a.0.total_cmp(&b.0));
        let worst = self.residuals.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        match (best, worst) {
            (Some((_, text)), _) => text,
            (None, Some((point, off))) => format!(", {point} least of all ({off:.3} mm)"),
            (None, None) => String::new(),
        }
    }

    /// Points with a stated σ that the others contradict, in a frame of this noise and scale: residual, mm, and the same in its σ.
    pub(crate) fn contradicted(
        &self,
        frame: &RigidTransform<f64>,
        (noise, scale): (f64, f64),
    ) -> Vec<(&DatumPoint, f64, f64)> {
        let motions = RigidMotions::of(self.points.iter().map(|point| point.place));
        let points = self.points.iter().filter_map(|point| {
            let sigma = (point.sigma?.powi(2) + noise * noise).sqrt();
            let left = 1.0 - motions.as_ref()?.leverage(&point.place);
            let off = point.seen - frame.apply(&(point.place * (1.0 + scale)));
            let sigmas = off.amax() / (sigma * left.max(0.1).sqrt());
            Some((point, off.norm(), sigmas))
        });
        points
            .filter(|(_, _, sigmas)| *sigmas > CONTRADICTED)
            .collect()
    }

    /// Residual of the points, mm rms of a coordinate, over the remaining degrees of freedom.
    pub(crate) fn rms(&self) -> f64 {
        let squares: f64 = self.residuals.iter().map(|(_, off)| off * off).sum();
        (squares / (3.0 * self.residuals.len() as f64 - 6.0)).sqrt()
    }

    /// The points, each with σ of a coordinate for this noise of the sensor: as stated, or as wide as their misfit shows,
    /// of which few points show little (Student).
    pub(super) fn points(&self, noise: f64) -> impl Iterator<Item = (&DatumPoint, f64)> {
        let freedom = 3.0 * self.points.len() as f64 - 6.0;
        let excess = (self.rms().powi(2) - noise * noise).max(0.0) * freedom / (freedom - 2.0);
        let square = move |point: &DatumPoint| point.sigma.map_or(excess, |own| own * own);
        let points = self.points.iter();
        points.map(move |point| (point, (square(point) + noise * noise).sqrt()))
    }
}
