//! What another controller can hold of a calibrated robot: its parameters, fitted, and what is lost.
//!
//! ```text
//! RobotFile ─→ ArmShape ─→ Geometry of the target ─┐
//! positions of the workspace ──────────────────────┴→ fit ─→ Geometry, Frame, Loss ─→ lines to paste
//! ```
//!
//! A controller's kinematics is that of a robot some of whose 24 parameters are zero or equal. So the
//! core's inverse kinematics of that robot is the controller's own.

pub mod case;
pub mod choose;
pub mod correction_table;
pub mod corrections;
pub mod error;
pub mod exported;
pub mod fit;
pub mod frame;
pub mod geometry;
pub mod linear;
pub mod linuxcnc_component;
pub mod loss;
pub mod nominal;
pub mod sdf;
pub mod settings;
pub mod shape;
pub mod target;
pub mod targets;
pub mod wanted;
