//! The boundary of the paper's robot's workspace, and what errors of the parameters do to it: the
//! paper's abstract announces both and shows neither.

use super::NamedFigure;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use crate::report::workspace::contents;
use crate::report::workspace::figures::{Figures, INFLUENCE};
use crate::workspace::Analysis;
use crate::workspace::{BandOptions, Options};

const ROBOT: &str = include_str!("../../examples/paper/workspace.toml");

/// Computes both.
///
/// # Errors
/// None, as long as the built-in robot is in order, which a test assures.
pub(super) fn compute() -> Result<Analysis, InputError> {
    let robot = RobotFile::read(&InputText::new("built-in workspace.toml", ROBOT))?;
    let (options, band) = (Options::default(), BandOptions::default());
    Analysis::compute(&robot, None, None, &options, &band, &mut |_| ())
        .map_err(|(error, name)| InputError::new(name, error.to_string()))
}

pub(super) fn figures(analysis: &Analysis) -> Vec<NamedFigure> {
    let Figures {
        vertical_xz,
        horizontal,
        influence,
        view,
        ..
    } = contents::figures(analysis);
    vec![
        NamedFigure::new(
            "boundary",
            view,
            "The boundary in space, coloured by what limits it: blue a joint at its largest angle, light \
             blue at its smallest, vermilion a singularity of type 1.",
        ),
        NamedFigure::new("boundary-vertical", vertical_xz, "Its section y = 0."),
        NamedFigure::new(
            "boundary-horizontal",
            horizontal,
            "Outlines at five heights, from above.",
        ),
        NamedFigure::new("boundary-influence", influence, INFLUENCE),
    ]
}
