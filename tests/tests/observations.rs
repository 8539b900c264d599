//! The calibration from heights, distances and single coordinates: against SciPy's optimum, and over many
//! robots against what it says of itself.

mod goldens;
mod robots;
mod transmissions;
