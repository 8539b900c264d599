//! A measurement to take, and what it reads if a robot is measured exactly.

use super::kind::Kind;
use super::setup::{PLANE, Setup};
use crate::files::samples_file::{ObservationsFile, Reading, ReadingFrom, Row};
use delta_cal::{Robot, Sample};

/// A measurement to take.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// What is read.
    pub kind: Kind,
    /// Where: joint angles in whole thousandths of a degree, and the nominal robot's position there.
    pub pose: Sample<f64>,
    /// Where a distance between poses begins.
    pub other: Option<Sample<f64>>,
    /// On which of the gauge blocks ([`Setup::blocks`]).
    pub block: Option<usize>,
    /// From which of the points ([`Setup::points`]).
    pub point: Option<usize>,
}

impl Planned {
    /// Which of x, y, z, height and distance are read.
    pub(super) fn readings(&self) -> Vec<usize> {
        match self.kind {
            Kind::Plane => vec![3],
            Kind::Distance | Kind::Point => vec![4],
            kind => (0..3).filter(|axis| kind.coordinates()[*axis]).collect(),
        }
    }
}

/// The samples file that these measurements become if a robot is measured exactly. `None` if it does not reach
/// one of them.
pub(super) fn measurements_file(
    planned: &[Planned],
    robot: &Robot<f64>,
    setup: &Setup,
) -> Option<ObservationsFile> {
    let used: Vec<_> = (0..setup.points.len())
        .filter(|index| planned.iter().any(|own| own.point == Some(*index)))
        .collect();
    let mut rows = Vec::with_capacity(planned.len());
    for (line, own) in (2..).zip(planned) {
        let position = robot.forward(&own.pose.joints).ok()?;
        let read = own.kind.coordinates();
        let distance = match (own.kind, &own.other, own.point) {
            (Kind::Distance, Some(other), _) => {
                let there = robot.forward(&other.joints).ok()?;
                let from = ReadingFrom::Pose(other.joints);
                Some((from, (position - there).norm()))
            }
            (Kind::Point, _, Some(point)) => {
                let (_, place) = setup.points.get(point)?;
                let index = used.iter().position(|used| *used == point)?;
                Some((ReadingFrom::Point(index), (position - place).norm()))
            }
            _ => None,
        };
        let value = Reading {
            joints: own.pose.joints,
            position: [0, 1, 2].map(|axis| read[axis].then(|| position[axis])),
            height: (own.kind == Kind::Plane).then(|| (0, position.z - setup.plane)),
            distance,
        };
        rows.push(Row { line, value });
    }
    let planes = planned.iter().any(|own| own.kind == Kind::Plane);
    let names = used.into_iter().filter_map(|index| setup.points.get(index));
    Some(ObservationsFile {
        name: String::from("plan"),
        rows,
        planes: planes.then(|| PLANE.to_owned()).into_iter().collect(),
        points: names.map(|(name, _)| name.clone()).collect(),
    })
}
