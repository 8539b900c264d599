//! The boundary of the paper's robot's workspace, and what errors of the parameters do to it: the
//! paper's abstract announces both and shows neither.

use super::NamedFigure;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use crate::report::workspace;
use crate::workspace::{Analysis, Options};

const ROBOT: &str = include_str!("../../examples/paper/workspace.toml");

/// Computes both.
///
/// # Errors
/// None, as long as the built-in robot is in order, which a test assures.
pub(super) fn compute() -> Result<Analysis, InputError> {
    let robot = RobotFile::read(&InputText::new("built-in workspace.toml", ROBOT))?;
    Analysis::compute(&robot, &Options::default(), &mut |_| ())
        .map_err(|error| InputError::new(robot.name.clone(), error.to_string()))
}

/// Those of its figures that are of interest here.
pub(super) fn figures(analysis: &Analysis) -> Vec<NamedFigure> {
    let names = [
        ("view", "boundary"),
        ("vertical_xz", "boundary-vertical"),
        ("influence", "boundary-influence"),
    ];
    let figures = workspace::figures(analysis).into_iter();
    let renamed = figures.filter_map(|figure| {
        let (_, name) = names.into_iter().find(|(name, _)| *name == figure.name)?;
        Some(NamedFigure { name, ..figure })
    });
    renamed.collect()
}
