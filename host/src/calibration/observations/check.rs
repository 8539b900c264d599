//! What must be right of files and options before observations are used.

use crate::files::input_error::InputError;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, Reading};
use crate::fit::options::{CalibrationMethod, Frame, Options, Streaming};

/// All of it, before anything is computed.
///
/// # Errors
/// Options that exclude each other, a frame that the rows do not need, a noise that is missing, a name without a row.
pub fn check(
    robot: &RobotFile,
    samples: &ObservationsFile,
    options: Options,
) -> Result<(), InputError> {
    check_options(robot, samples, options)?;
    check_frame(robot, samples, options.frame)?;
    check_noise(robot, samples)?;
    check_names(robot, samples)
}

/// What the core's judgement of such measurements does not provide.
fn check_options(
    robot: &RobotFile,
    samples: &ObservationsFile,
    options: Options,
) -> Result<(), InputError> {
    let option = if options.method != CalibrationMethod::Joint {
        "--method"
    } else if options.streaming != Streaming::default() {
        "--gate, --held-out and --forget"
    } else if options.no_guess {
        "--no-guess"
    } else {
        return Ok(());
    };
    if robot.transmission.is_some() {
        let cause = format!("{option} cannot be used where transmissions are to be found");
        return Err(InputError::new(&robot.name, cause)
            .at_key("[tolerance] transmission_deg")
            .with_remedy("leave out the option, or delete the line transmission_deg"));
    }
    let cause = format!(
        "{option} can only be used with files that hold x, y and z in every row and nothing else"
    );
    Err(InputError::new(&samples.name, cause).with_remedy("leave out the option"))
}

/// Single coordinates cannot be brought from an earlier sensor's frame into the robot's.
pub(crate) fn check_frame(
    robot: &RobotFile,
    samples: &ObservationsFile,
    frame: Frame,
) -> Result<(), InputError> {
    let coordinates = samples.coordinates();
    if frame == Frame::Base && coordinates && robot.sensor_frame.is_some() {
        let cause = "coordinates that are estimated with other unknowns cannot be converted from this frame";
        return Err(InputError::new(&robot.name, cause)
            .at_key("[sensor_frame]")
            .with_remedy(
                "use --frame sensor, or delete the section if they are in the robot's frame",
            ));
    }
    if frame == Frame::Sensor && !coordinates {
        let cause = "no row holds x, y or z, so that there is no frame to find";
        return Err(InputError::new(&samples.name, cause).with_remedy("leave out --frame sensor"));
    }
    Ok(())
}

fn check_noise(robot: &RobotFile, samples: &ObservationsFile) -> Result<(), InputError> {
    let rows = || samples.rows.iter().map(|row| &row.value);
    let facts = &robot.instruments;
    let coordinates = samples.coordinates();
    let kinds = [
        (
            coordinates,
            robot.noise.is_some(),
            "position_mm",
            "coordinates",
            "a coordinate",
        ),
        (
            rows().any(|row| row.height.is_some()),
            facts.height_noise.is_some(),
            "height_mm",
            "heights",
            "a height",
        ),
        (
            rows().any(|row| row.distance.is_some()),
            facts.distance_noise.is_some(),
            "distance_mm",
            "distances",
            "a distance",
        ),
    ];
    for (measured, stated, key, kinds, one) in kinds {
        if measured && !stated {
            let partial = |row: &Reading| row.position.iter().any(Option::is_none);
            let gaps = if key == "position_mm" && rows().any(partial) {
                " does not have x, y and z in every row, and"
            } else {
                ""
            };
            let cause = format!(
                "{}{gaps} holds {kinds}, whose noise is not stated",
                samples.name
            );
            let remedy = format!(
                "state one standard deviation of {one} as {key} in the section [noise]: what repeated \
                 readings of one pose show, some 0.02 for a dial gauge"
            );
            return Err(InputError::new(&robot.name, cause)
                .at_key(format!("[noise] {key}"))
                .with_remedy(remedy));
        }
    }
    Ok(())
}

/// Every plane and point of the robot file must occur.
pub(crate) fn check_names(robot: &RobotFile, samples: &ObservationsFile) -> Result<(), InputError> {
    let planes = robot.instruments.planes.iter();
    let planes = planes.map(|plane| ("planes", &plane.name, plane.line, &samples.planes));
    let points = robot.instruments.points.iter();
    let points = points.map(|point| ("points", &point.name, point.line, &samples.points));
    for (section, name, line, names) in planes.chain(points) {
        if let Some(others) = ObservationsFile::unused(names, name) {
            let cause = format!("no row of {} uses this name; {others}", samples.name);
            return Err(InputError::new(&robot.name, cause)
                .at_line(line)
                .at_key(format!("[{section}.{name}]"))
                .with_remedy("give both files the same names, or delete the section"));
        }
    }
    Ok(())
}
