//! What a robot file says of instruments other than a tracker.

use nalgebra::Vector3;

/// How good a reading is that is no position, and what is known of where instruments stand.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InstrumentFacts {
    /// One σ of a height, mm.
    pub height_noise: Option<f64>,
    /// One σ of a distance, mm.
    pub distance_noise: Option<f64>,
    /// One σ of a joint angle, radians, where the file states the noise of no position.
    pub joint_noise: Option<f64>,
    /// Planes of known height.
    pub planes: Vec<KnownPlane>,
    /// Points of which something is known.
    pub points: Vec<NamedPoint>,
    /// The shortest and the longest distance between two poses that can be measured, mm.
    pub lengths: Option<(f64, f64)>,
    /// From the platform point to what is measured: a reflector, a tip. mm, in the robot's frame.
    pub target: Option<Vector3<f64>>,
}

/// A plane of known height.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownPlane {
    /// As the samples file names it.
    pub name: String,
    /// The line of its section.
    pub line: u64,
    /// Where it crosses the z axis, mm.
    pub height: f64,
    /// One σ of that, mm.
    pub sigma: f64,
    /// One σ of its tilt about x and about y, radians, if it is known to be nearly level.
    pub tilt: Option<f64>,
    /// The gauge blocks that heights are measured on, mm, 0 being the bare plane; empty if not stated.
    pub blocks: Vec<f64>,
}

/// A point that distances begin at.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedPoint {
    /// As the samples file names it.
    pub name: String,
    /// The line of its section.
    pub line: u64,
    /// Where it is and one σ of each coordinate, if that is known: mm.
    pub place: Option<(Vector3<f64>, f64)>,
    /// Whether its sensor reads a constant too much that is not known.
    pub offset_unknown: bool,
    /// The shortest and the longest distance that can be measured from it, mm.
    pub lengths: Option<(f64, f64)>,
}
