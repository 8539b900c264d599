//! `delta-cal device`.

mod apply;
mod args;
mod calibrate;
mod connect;
mod files;
mod inspect;
mod progress;
mod verify;

pub(crate) use args::DeviceArguments;

use super::failure::Failure;
use args::DeviceCommand;

pub(crate) fn run(arguments: &DeviceArguments) -> Result<(), Failure> {
    let link = &arguments.link;
    match &arguments.command {
        DeviceCommand::Calibrate(arguments) => calibrate::run(link, arguments),
        DeviceCommand::Apply(arguments) => apply::run(link, arguments),
        DeviceCommand::Status(arguments) => inspect::status(link, arguments),
        DeviceCommand::Parameters(arguments) => inspect::parameters(link, arguments),
        DeviceCommand::Revert(arguments) => inspect::revert(link, arguments),
        DeviceCommand::Verify(arguments) => verify::run(link, arguments),
    }
}
