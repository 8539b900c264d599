//! Which measurements are wanted.

use super::kind::Wishes;
use crate::files::robot_file::RobotFile;
use crate::fit::options::Frame;
use crate::planning::poses::Region;

/// Fewer measurements are not planned.
pub const LEAST_MEASUREMENTS: usize = 4;

/// One σ of each kind of reading, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseOf {
    /// Of a coordinate.
    pub position: f64,
    /// Of a height.
    pub height: f64,
    /// Of a distance.
    pub distance: f64,
}

impl Default for NoiseOf {
    /// A tracker or a camera, a dial gauge, a calliper or a wire sensor.
    fn default() -> Self {
        Self {
            position: 0.02,
            height: 0.02,
            distance: 0.05,
        }
    }
}

/// Which measurements are wanted, and with what. What is `None` is taken from the robot file, and what does
/// not stand there is assumed ([`Setup`](super::Setup)).
#[derive(Debug, Clone, PartialEq)]
pub struct MeasurementRequest<'a> {
    /// The robot as it is known.
    pub robot: &'a RobotFile,
    /// Of which kinds.
    pub kinds: Wishes,
    /// How many.
    pub count: usize,
    /// Gauge blocks that heights are measured on, mm; 0 is the bare plane.
    pub blocks: Vec<f64>,
    /// Where the plane crosses the robot's z axis, mm.
    pub plane: Option<f64>,
    /// How many fixed points there are.
    pub points: usize,
    /// The shortest and the longest distance that can be measured, mm; the same twice for a bar.
    pub lengths: Option<(f64, f64)>,
    /// σ of the readings, whatever the robot file states.
    pub noise: Option<NoiseOf>,
    /// The frame of coordinates.
    pub frame: Frame,
    /// Where the platform may be; anywhere if `None`.
    pub region: Option<Region>,
    /// The same seed gives the same plan.
    pub seed: u64,
}

impl<'a> MeasurementRequest<'a> {
    /// As many of these kinds, with blocks of 0, 60 and 120 mm, three points and distances of any length.
    pub fn new(robot: &'a RobotFile, kinds: Wishes, count: usize) -> Self {
        Self {
            robot,
            kinds,
            count,
            blocks: vec![0.0, 60.0, 120.0],
            plane: None,
            points: 3,
            lengths: None,
            noise: None,
            frame: Frame::Base,
            region: None,
            seed: 1,
        }
    }
}

/// How measurements are checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckRequest {
    /// The frame of the coordinates.
    pub frame: Frame,
    /// How many measurements to propose.
    pub add: usize,
    /// Where the platform may be then; anywhere if `None`.
    pub region: Option<Region>,
}
