//! What the estimators cannot take of files that are right by themselves.

use super::datum::Datum;
use super::{Frame, Method, Options};
use crate::files::{InputError, Kind, ONLY_TARGET, Reading, Readings, RobotFile};

/// Checks that the method takes these readings, and that both files use the same names.
pub(crate) fn checked(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Result<(), InputError> {
    let faults = [
        (
            options.frame == Frame::Sensor && robot.instruments.datum.is_empty(),
            &readings.name,
            "--method joint and ikm need positions in the robot's frame",
            "use --method fkm",
        ),
        (
            options.robust,
            &readings.name,
            "--robust is a loss function of the FKM method",
            "use --method fkm",
        ),
        (
            readings.rows.iter().any(|row| row.value.sigma.is_some()),
            &readings.name,
            "only the FKM method weighs each row by its own uncertainty",
            "use --method fkm, or write _ before the name of the column",
        ),
        (
            robot.transmission.is_some(),
            &robot.name,
            "only the FKM method finds transmissions",
            "use --method fkm, or delete transmission_deg",
        ),
        (
            !readings.is_complete(),
            &readings.name,
            "--method joint and ikm need x, y and z in every row",
            "use --method fkm",
        ),
    ];
    let of_positions = matches!(options.method, Some(Method::Joint | Method::Ikm));
    let mut faults = faults.into_iter().filter(|_| of_positions);
    if let Some((_, file, cause, remedy)) = faults.find(|(faulty, ..)| *faulty) {
        return Err(InputError::new(file, cause).with_remedy(remedy));
    }
    check_names(robot, readings)
}

/// Checks that the points of `[datum]` give the frame of complete positions.
pub(crate) fn check_datum(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
) -> Result<(), InputError> {
    if frame == Frame::Sensor
        && let Some(missing) = readings.missing_datum(robot)
    {
        return Err(missing);
    }
    if Datum::of(robot, frame)?.is_none() {
        return Ok(());
    }
    let single = |row: &Reading| row.sample().is_none() && row.kind() == Some(Kind::Position);
    if let Some(index) = readings.rows.iter().position(|row| single(&row.value)) {
        return Err(readings.fault(index, "with [datum] a row needs all of x, y and z"));
    }
    Ok(())
}

/// Checks that the samples use every plane and point of the robot file.
fn check_names(robot: &RobotFile, readings: &Readings) -> Result<(), InputError> {
    let planes = robot.instruments.planes.iter();
    let planes = planes.map(|plane| ("planes", &plane.name, plane.line, &readings.planes));
    let points = robot.instruments.points.iter();
    let points = points.map(|point| ("points", &point.name, point.line, &readings.points));
    for (section, name, line, names) in planes.chain(points) {
        if let Some(others) = Readings::unused(names, name) {
            let cause = format!("no row of {} uses this name; {others}", readings.name);
            return Err(InputError::new(&robot.name, cause)
                .at_line(line)
                .at_key(format!("[{section}.{name}]"))
                .with_remedy("give both files the same names, or delete the section"));
        }
    }
    let stated = &robot.instruments.targets;
    let missing = readings.targets.iter().find(|name| {
        let alone = *name == ONLY_TARGET && stated.is_empty();
        !(alone || robot.instruments.target(name).is_some())
    });
    let Some(name) = missing else {
        return Ok(());
    };
    let (cause, remedy) = if name == ONLY_TARGET {
        (
            format!(
                "rows of {} name no target, and there are several",
                readings.name
            ),
            "name the target of each row in a column target, or state [target]".to_owned(),
        )
    } else {
        (
            format!(
                "rows of {} name the target {name}, which is not stated",
                readings.name
            ),
            format!("add a section [targets.{name}]"),
        )
    };
    Err(InputError::new(&robot.name, cause).with_remedy(remedy))
}
