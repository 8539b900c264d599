//! Exit codes that several commands share.

pub(crate) const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  refused: the measurements cannot calibrate this robot
  2  the command line is wrong
  3  an input file is wrong
  4  a file could not be written
  5  the controller or the link to it failed
  6  the --limit is not met; the output files are written

With exit codes 1, 2 and 3 no output file is written or changed.";
