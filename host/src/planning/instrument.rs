//! What people have, or may buy or borrow, and what each would bring.

use super::PlanError;
use super::judge::Precision;
use super::plan::{Bench, PlanRequest};
use super::request::{Kind, Wishes};
use super::search::Effort;
use super::setup::{JOINT_DEGREES, PLANE, broadest};
use crate::accuracy::uncertainty::inside;
use crate::files::robot_file::{InstrumentFacts, KnownPlane, NamedPoint, RobotFile};
use crate::fit::Frame;
use delta_cal::Noise;
use serde::Serialize;

/// One σ of the height of a plane of which nothing is known, mm.
const ANYWHERE: f64 = 1e3;
/// How many measurements are compared.
pub const COUNTS: [usize; 3] = [12, 20, 40];

/// An instrument, and how good it typically is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instrument {
    /// As it is written in campaigns.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// What it measures.
    pub kind: Kind,
    /// One σ of a reading, mm.
    pub sigma: f64,
    /// Whether there are gauge blocks.
    blocks: bool,
    points: &'static [&'static str],
    lengths: Option<(f64, f64)>,
    /// The frame of its coordinates.
    pub frame: Frame,
}

impl Instrument {
    /// From the cheapest to the dearest.
    pub const ALL: [Self; 8] = [
        Self::of("plate", "flat plate and dial gauge", Kind::Plane, 0.02),
        Self {
            blocks: true,
            ..Self::of(
                "blocks",
                "the same with gauge blocks of 60, 120 mm",
                Kind::Plane,
                0.02,
            )
        },
        Self {
            points: &["A", "B"],
            ..Self::of("wire", "wire sensor at two places", Kind::Point, 0.05)
        },
        Self {
            lengths: Some((200.0, 200.0)),
            ..Self::of(
                "bar200",
                "ball bar of 200 mm on three sockets",
                Kind::Point,
                0.005,
            )
        },
        Self {
            lengths: Some((300.0, 300.0)),
            ..Self::of(
                "bar300",
                "ball bar of 300 mm on three sockets",
                Kind::Point,
                0.005,
            )
        },
        Self::of(
            "distances",
            "calliper or scale between two poses",
            Kind::Distance,
            0.05,
        ),
        Self {
            frame: Frame::Sensor,
            ..Self::of(
                "camera",
                "x and y of a mark, in its own frame",
                Kind::Position([true, true, false]),
                0.02,
            )
        },
        Self {
            frame: Frame::Sensor,
            ..Self::of(
                "tracker",
                "laser tracker, x, y and z in its own frame",
                Kind::XYZ,
                0.02,
            )
        },
    ];

    const fn of(name: &'static str, title: &'static str, kind: Kind, sigma: f64) -> Self {
        Self {
            name,
            title,
            kind,
            sigma,
            blocks: false,
            points: &["A", "B", "C"],
            lengths: None,
            frame: Frame::Base,
        }
    }

    /// A robot that is measured with it and nothing else, with one σ of its readings, mm.
    pub fn equips(&self, robot: &RobotFile, sigma: f64) -> RobotFile {
        let facts = &robot.instruments;
        let joint = facts.joint_noise.or(robot.noise.map(|noise| noise.joint()));
        let point = |name: &&str| NamedPoint {
            name: (*name).to_owned(),
            line: 0,
            place: None,
            offset_unknown: false,
            lengths: self.lengths,
        };
        RobotFile {
            noise: Noise::new(sigma, joint.unwrap_or(JOINT_DEGREES.to_radians())).ok(),
            instruments: InstrumentFacts {
                height_noise: Some(sigma),
                distance_noise: Some(sigma),
                joint_noise: joint,
                planes: vec![self.plane(robot)],
                points: self.points.iter().map(point).collect(),
                lengths: None,
                datum: facts.datum.clone(),
                target: facts.target,
            },
            ..robot.clone()
        }
    }

    /// The first of the robot file, or one of which nothing is known, with its blocks or bare.
    fn plane(&self, robot: &RobotFile) -> KnownPlane {
        let anywhere = || KnownPlane {
            name: PLANE.to_owned(),
            line: 0,
            height: broadest(&inside(&robot.robot, &robot.reach())),
            sigma: ANYWHERE,
            tilt: None,
            blocks: Vec::new(),
        };
        let stated = robot.instruments.planes.first().cloned();
        KnownPlane {
            blocks: if self.blocks { Vec::new() } else { vec![0.0] },
            ..stated.unwrap_or_else(anywhere)
        }
    }
}

/// What an instrument would bring.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The instrument.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// One σ of a reading, mm.
    pub sigma_mm: f64,
    /// Before any measurement; `None` without a tolerance.
    pub before: Option<Precision>,
    /// After so many planned measurements ([`COUNTS`]); `None` where there is no plan.
    pub after: Vec<Option<Precision>>,
}

/// Plans measurements with each instrument. Kinds, number and instruments of the request do not matter. `progress`
/// is told of each plan that is made.
///
/// # Errors
/// Limits or a region that leave no pose.
pub fn compare(
    request: &PlanRequest<'_>,
    mut progress: impl FnMut(&Instrument, usize),
) -> Result<Vec<Comparison>, PlanError> {
    let bench = Bench::new(request)?;
    let mut comparisons = Vec::with_capacity(Instrument::ALL.len());
    for instrument in Instrument::ALL {
        let robot = instrument.equips(request.robot, instrument.sigma);
        let mut comparison = Comparison {
            name: instrument.name,
            title: instrument.title,
            sigma_mm: instrument.sigma,
            before: None,
            after: Vec::with_capacity(COUNTS.len()),
        };
        for count in COUNTS {
            progress(&instrument, count);
            let request = PlanRequest {
                robot: &robot,
                kinds: Wishes::only(instrument.kind),
                count,
                frame: instrument.frame,
                ..request.clone()
            };
            let plan = bench.plan(&request, &Effort::quick(count)).ok();
            comparison.before = comparison
                .before
                .or(plan.as_ref().and_then(|plan| plan.before));
            comparison.after.push(plan.map(|plan| plan.after));
        }
        comparisons.push(comparison);
    }
    Ok(comparisons)
}
