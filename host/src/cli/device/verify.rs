use super::args::{LinkArguments, VerifyArguments};
use super::connect::{Device, Task, with_device};
use super::files::{inputs, publish, rows};
use super::progress::Bar;
use crate::cli::failure::Failure;
use crate::cli::paths::refuse_same;
use crate::device::report::{json, text};
use crate::device::{Number, verify};
use crate::{Measurements, RobotFile};

pub(super) fn run(link: &LinkArguments, arguments: &VerifyArguments) -> Result<(), Failure> {
    let remedy = "give the output another name";
    let json = arguments.json.as_deref();
    let robot = ("the robot file", arguments.files.robot.as_deref());
    let samples = ("the samples file", arguments.files.samples.as_deref());
    refuse_same("--json", json, robot, remedy)?;
    refuse_same("--json", json, samples, remedy)?;
    let (robot, measurements) = inputs(&arguments.files)?;
    with_device(
        link,
        Verify {
            arguments,
            robot,
            measurements,
        },
    )
}

struct Verify<'a> {
    arguments: &'a VerifyArguments,
    robot: RobotFile,
    measurements: Measurements,
}

impl Task for Verify<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let count = rows(&self.measurements);
        let bar = Bar::new(count);
        let options = self.arguments.files.options();
        let result = verify::<T, _>(
            &mut device.client,
            &self.robot,
            &self.measurements,
            options,
            &mut |step| bar.show(step),
        );
        bar.finish();
        let verified = result?;
        let comparison = &verified.comparison;
        let port = device.port.to_string();
        let mut shown = text::identity(&port, &device.identity);
        shown.push_str(&text::comparison(verified.calibrated, count, comparison));
        let json = json::comparison(verified.calibrated, count, comparison);
        let json = json::of_device(&port, &device.identity, json);
        publish(&[], self.arguments.json.as_deref(), &json, shown)?;
        match comparison.differences.len() {
            0 => Ok(()),
            different => Err(Failure::Differs(format!(
                "controller and host differ in {different} of {} figures",
                comparison.figures
            ))),
        }
    }
}
