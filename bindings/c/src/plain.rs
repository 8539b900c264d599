//! Constants of the interface other than status codes. A line `// enum` begins an enumeration of the header.

// enum arm
/// Not an arm, in places that hold an arm's index.
pub const NO_ARM: i32 = -1;

// enum parameter
/// Not a parameter, in places that hold a parameter's index.
pub const NO_PARAMETER: i32 = -1;
/// Index of Dx among the eight parameters of an arm: x of the point on the motor axis. Length.
pub const DX: i32 = 0;
/// Index of Dy: y of that point. Length.
pub const DY: i32 = 1;
/// Index of Dz: z of that point. Length.
pub const DZ: i32 = 2;
/// Index of theta: azimuth of the arm plane about base z. Radians.
pub const THETA: i32 = 3;
/// Index of alpha: tilt of the motor axis out of the base plane. Radians.
pub const ALPHA: i32 = 4;
/// Index of La_x: upper arm at joint angle 0, radial component. Length.
pub const LA_X: i32 = 5;
/// Index of La_y: upper arm at joint angle 0, upward component. Length.
pub const LA_Y: i32 = 6;
/// Index of Lb: forearm. Length.
pub const LB: i32 = 7;

// enum solver
/// Levenberg-Marquardt: each step damped until it reduces the sum of squares.
pub const LEVENBERG_MARQUARDT: i32 = 0;
/// Gauss-Newton: always the full step.
pub const GAUSS_NEWTON: i32 = 1;

// enum start
/// The iteration starts from the nominal robot.
pub const START_NOMINAL: i32 = 0;
/// The iteration starts without a guess; needs 12 samples. Calibrations from any readings start from the nominal robot
/// all the same. No number of a solver: exchanged, both are refused.
pub const START_FREE: i32 = 2;

// enum termination
/// The iteration stopped because no step could reduce the sum of squares any further.
pub const GRADIENT_VANISHED: i32 = 0;
/// The iteration stopped because the last step was of the size of rounding errors.
pub const ROUNDING_REACHED: i32 = 1;

// enum start_used
/// The result comes from the nominal robot.
pub const USED_NOMINAL: i32 = 0;
/// The result comes from the start without a guess.
pub const USED_FREE: i32 = 1;
/// The result comes from the search beside an earlier solution.
pub const USED_SEARCH: i32 = 2;

// enum verdict
/// The sample agrees with the prediction and was taken in.
pub const TAKEN: i32 = 0;
/// The sample could not be tested and was taken in.
pub const UNTESTED: i32 = 1;
/// The sample disagrees with the prediction and was not taken in.
pub const REJECTED: i32 = 2;

// enum alarm
/// No alarm.
pub const NO_ALARM: i32 = 0;
/// The robot or its measuring frame has changed.
pub const ROBOT_CHANGED: i32 = 1;
/// The samples before the run, or the stated robot and tolerance, are wrong, or the robot has changed.
pub const EARLY_SAMPLES_WRONG: i32 = 2;

// enum instrument
/// No instrument.
pub const NO_INSTRUMENT: i32 = 0;
/// The frame in which coordinates were measured.
pub const FRAME: i32 = 1;
/// A plane that heights were measured above.
pub const PLANE: i32 = 2;
/// A point that distances were measured from.
pub const POINT: i32 = 3;
/// The gear and encoder of a joint.
pub const TRANSMISSION: i32 = 4;

// enum frame
/// Coordinates are measured in the robot's own frame.
pub const FRAME_BASE: i32 = 0;
/// Coordinates are measured in a frame that stands anywhere: six unknowns.
pub const FRAME_SENSOR: i32 = 1;

// enum reading
/// Bit of an observation: x was measured.
pub const READ_X: u32 = 1;
/// Bit of an observation: y was measured.
pub const READ_Y: u32 = 2;
/// Bit of an observation: z was measured.
pub const READ_Z: u32 = 4;
/// Bit of an observation: a height above a plane was measured.
pub const READ_HEIGHT: u32 = 8;
/// Bit of an observation: a distance from a point was measured.
pub const READ_DISTANCE: u32 = 16;
/// Bit of an observation: a distance from the platform's position at other joint angles was measured.
pub const READ_DISTANCE_BETWEEN: u32 = 32;

// enum limit
/// Observations of a calibration from any readings at most.
pub const FKM_ROWS: usize = 64;
/// Planes of a calibration from any readings at most.
pub const PLANES: usize = 4;
/// Points of a calibration from any readings at most.
pub const POINTS: usize = 4;
/// Unknowns of the instruments at most: six of a frame, three of a plane, three of a point, one of its offset.
pub const UNKNOWNS: usize = 12;
