//! Files written by users.

use crate::numbers::{Source, finite_robot};
use delta_cal::Parameter;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Drive;
use delta_cal_host::campaign::Plan;
use delta_cal_host::files::example;
use delta_cal_host::{InputError, InputText, Readings, RobotFile, read_joints, read_positions};
use std::fmt::Write;

pub(crate) fn text(name: &str, data: &[u8]) -> Option<InputText> {
    match InputText::from_reader(name, data) {
        Ok(text) => Some(text),
        Err(error) => {
            refused(name, data, &error);
            None
        }
    }
}

/// A refusal names the file, an existing line, and a cause, all in one line.
pub(crate) fn refused(name: &str, data: &[u8], error: &InputError) {
    let message = error.to_string();
    let cause = message
        .strip_prefix(name)
        .and_then(|rest| rest.strip_prefix(':'));
    assert!(
        cause.is_some_and(|cause| !cause.trim().is_empty()),
        "{message:?}"
    );
    assert!(!message.contains(['\n', '\r']), "{message:?}");
    if let Some(line) = error.line {
        let ends = data
            .iter()
            .filter(|byte| matches!(byte, b'\n' | b'\r'))
            .count();
        assert!(line >= 1 && line <= ends as u64 + 1, "{message:?}");
    }
}

/// A robot file is refused with a location, or yields a robot that survives writing and reading.
pub fn robot_file(data: &[u8]) {
    const NAME: &str = "robot.toml";
    let Some(input) = text(NAME, data) else {
        return;
    };
    let file = match RobotFile::read(&input) {
        Err(error) => return refused(NAME, data, &error),
        Ok(file) => file,
    };
    finite_robot(&file.robot);
    let mut numbers = vec![file.limits.minimum(), file.limits.maximum()];
    numbers.extend(file.forearm_limit);
    if let Some(tolerance) = &file.tolerance {
        numbers.extend(Parameter::ROTARY.map(|parameter| tolerance.of(parameter)));
    }
    if let Some(noise) = &file.noise {
        numbers.extend([noise.position(), noise.joint()]);
    }
    if let Some(frame) = &file.sensor_frame {
        numbers.extend(frame.rotation.iter().chain(&frame.translation));
    }
    assert!(numbers.iter().all(|number| number.is_finite()), "{file:?}");

    let written = file.to_toml("written");
    match RobotFile::read(&InputText::new(NAME, &written)) {
        Ok(again) => assert!(alike(&again, &file), "{written}"),
        Err(error) => panic!("{error}:\n{written}"),
    }
}

/// Whether the numbers are equal up to the rounding of angles in degrees.
pub(crate) fn alike(a: &RobotFile, b: &RobotFile) -> bool {
    let numbers = |file: &RobotFile| {
        let arms = file.robot.arms().map(|arm| arm.parameters());
        let mut numbers = arms.as_flattened().to_vec();
        numbers.extend([file.limits.minimum(), file.limits.maximum()]);
        numbers.extend(file.forearm_limit);
        numbers.extend(file.tolerance.map(|tolerance| tolerance.of(Parameter::Lb)));
        numbers.extend(
            file.tolerance
                .map(|tolerance| tolerance.of(Parameter::Theta)),
        );
        numbers.extend(file.noise.map(|noise| noise.position()));
        numbers.extend(file.noise.map(|noise| noise.joint()));
        numbers
    };
    let (first, second) = (numbers(a), numbers(b));
    let close = |(a, b): (&f64, &f64)| (a - b).abs() <= 4.0 * f64::EPSILON * b.abs().max(1e-300);
    first.len() == second.len()
        && first.iter().zip(&second).all(close)
        && a.sensor_frame == b.sensor_frame
}

/// A samples file, for a robot with either set of joint limits, and read as joint angles or positions alone.
pub fn samples_file(data: &[u8]) {
    const NAME: &str = "samples.csv";
    let (head, rest) = data.split_at(data.len().min(4));
    let mut source = Source::new(head);
    let (least, most) = (source.number(-1.0, 3.0), source.number(1.6, 3.0));
    let Ok(limits) = JointLimits::new(least, most) else {
        return;
    };
    let Some(input) = text(NAME, rest) else {
        return;
    };
    let Ok((example, _)) = example::load() else {
        return;
    };
    let robot = RobotFile { limits, ..example };
    if let Err(error) = read_joints(&input, &robot) {
        refused(NAME, rest, &error);
    }
    match read_positions(&input, &robot.convention) {
        Ok(rows) => assert!(
            rows.iter()
                .all(|row| row.value.iter().all(|x| x.is_finite()))
        ),
        Err(error) => refused(NAME, rest, &error),
    }
    let file = match Readings::read(&input, &robot) {
        Err(error) => return refused(NAME, rest, &error),
        Ok(file) => file,
    };
    assert!(!file.rows.is_empty());
    if !file.is_complete() {
        return;
    }
    let mut written = "q1_rad,q2_rad,q3_rad,x_mm,y_mm,z_mm\n".to_owned();
    let mut last = 0;
    for row in file.samples() {
        assert!(row.line > last, "line {} after line {last}", row.line);
        last = row.line;
        assert_eq!(row.value.check(Drive::Rotary), Ok(()));
        let [q1, q2, q3] = row.value.joints;
        let [x, y, z] = row.value.position.into();
        let _ = writeln!(written, "{q1:?},{q2:?},{q3:?},{x:?},{y:?},{z:?}");
    }
    match Readings::read(&InputText::new(NAME, &written), &robot) {
        Ok(again) => assert!(
            again
                .samples()
                .map(|row| row.value)
                .eq(file.samples().map(|row| row.value)),
            "{written}"
        ),
        Err(error) => panic!("{error}:\n{written}"),
    }
}

/// A campaign file is refused with a location, or yields a plan. One that names a robot file is refused: there is none.
pub fn campaign_file(data: &[u8]) {
    const NAME: &str = "campaign.toml";
    let Some(input) = text(NAME, data) else {
        return;
    };
    match Plan::read(&input, &|name| {
        Err(InputError::new(name, "there is no such file"))
    }) {
        Ok(plan) => assert!(plan.robots > 0, "{plan:?}"),
        Err(error) => refused(NAME, data, &error),
    }
}
