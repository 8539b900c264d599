//! A robot exported for a target.

use super::corrections::choice::Finished;
use super::frame::Frame;
use super::loss::Loss;
use super::target::Written;
use delta_cal::Robot;

/// What a target receives of a robot.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// So many numbers of its own, which the fit determined, without the frame.
    Fitted(usize),
    /// All parameters of the robot.
    Everything,
    /// Corrections of a nominal robot.
    Corrections(Box<Finished>),
}

/// What a target is told, and what is lost.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// The target's name on the command line.
    pub name: &'static str,
    /// The target in reports.
    pub title: &'static str,
    /// What begins a comment in the lines; empty for XML.
    pub comment: &'static str,
    /// What the target receives of the robot.
    pub content: Content,
    /// The parameters and the lines.
    pub written: Written,
    /// The rigid motion from the robot's frame to the controller's, if it was fitted.
    pub frame: Option<Frame>,
    /// The robot whose inverse kinematics is the target's, if it has one.
    pub controller: Option<Robot<f64>>,
    /// What is lost with the target's parameters.
    pub loss: Loss,
    /// What a controller with the nominal robot is off.
    pub uncalibrated: Loss,
    /// The same after the rigid motion that explains most of it.
    pub uncalibrated_moved: Loss,
    /// The positions are within so far of the z axis, if that is not the whole workspace, mm.
    pub within: Option<f64>,
    /// Signs, zero angles and order of arms.
    pub conventions: Vec<&'static str>,
    /// Where they come from.
    pub source: &'static str,
    /// What to use where too little is kept.
    pub alternative: &'static str,
}

impl Export {
    /// The part of what a calibration gains, after the best rigid motion, that the target keeps: 1 is
    /// everything, 0 or less is nothing.
    pub fn kept(&self) -> Option<f64> {
        let before = self.uncalibrated_moved.rms;
        // Below this a robot is as its nominal one, and nothing was gained.
        (before > 1e-3).then(|| 1.0 - self.loss.rms / before)
    }
}
