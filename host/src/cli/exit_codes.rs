//! Exit codes that several commands share.

pub(crate) const EXIT_CODES: &str = "\
Exit codes:
  0  done: the robot is calibrated, or every row is computed
  1  the measurements cannot calibrate this robot (refused)
  2  the command line is wrong
  3  an input file is wrong
  4  a file could not be written
  5  delta-cal device only: the controller or the link to it failed
  6  the --limit is not met, or not known to be; the output files are written

With exit codes 1, 2 and 3 no output file is written or changed.";
