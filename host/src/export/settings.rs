//! What the user states beside the robot.

use super::corrections::choice::Nodes;
use super::corrections::kind::Kind;
use super::frame::Frame;

/// Of lengths and angles that the 24 parameters do not contain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The height of the robot's origin above z = 0 of the controller, mm; `None` for the least whole number of
    /// millimetres with which no wanted position is below 0. Used where the controller holds a height.
    pub height: Option<f64>,
    /// The joint angle of each arm at its end stop, in the robot file's convention, radians; `None` for
    /// the smallest whole degrees at which all three can be. With towers the travel, mm; `None` for the largest.
    pub home: Option<[f64; 3]>,
    /// The radius of the platform, mm. Controllers that hold it beside the base's use only the difference.
    pub platform_radius: f64,
    /// What a correction table corrects.
    pub corrections: Kind,
    /// How far the nodes of a correction table are from each other.
    pub nodes: Nodes,
    /// With towers: the motion after which z is the height above the bed; `None` if the robot's own z is. Otherwise
    /// any: the robot's z is the controller's, and the fit turns it no more.
    pub level: Option<Frame>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            height: None,
            home: None,
            platform_radius: 25.0,
            corrections: Kind::Position,
            nodes: Nodes::Spacing(25.0),
            level: None,
        }
    }
}
