//! `delta-cal device … apply`: a robot that was calibrated on this computer.

use super::args::{ApplyArguments, LinkArguments};
use super::connect::{Device, Task, with_device};
use super::files::{publish, refuse_linear};
use crate::cli::failure::Failure;
use crate::cli::outputs;
use crate::device::report::{json, text};
use crate::device::{Number, adopt, check_calibrated};
use crate::{InputText, RobotFile};
use delta_cal_protocol::ParameterSet;

pub(super) fn run(link: &LinkArguments, arguments: &ApplyArguments) -> Result<(), Failure> {
    let file = ("the robot file", Some(arguments.robot.as_path()));
    outputs::check(&[file], &[("--json", arguments.json.as_deref())])?;
    let robot = RobotFile::read(&InputText::from_file(&arguments.robot)?)?;
    refuse_linear(&robot)?;
    with_device(link, Apply { arguments, robot })
}

struct Apply<'a> {
    arguments: &'a ApplyArguments,
    robot: RobotFile,
}

impl Task for Apply<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let client = &mut device.client;
        let nominal = client.parameters::<T>(ParameterSet::Nominal)?;
        let moved = check_calibrated(&self.robot, &nominal.geometry)?;
        let before = client.parameters::<T>(ParameterSet::Current)?;
        let after = adopt::<T, _>(client, &self.robot.robot, before.generation)?;
        let port = device.port.to_string();
        let mut shown = text::identity(&port, &device.identity);
        shown.push_str(&text::adopted(&before, &after, &self.robot.name, moved));
        let json = json::geometry("current", &after);
        let json = json::of_device(&port, &device.identity, json);
        publish(&[], self.arguments.json.as_deref(), &json, shown)
    }
}
