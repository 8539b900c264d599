//! What an import gives is what Klipper computes.

use crate::import::fixtures::{Printer, Row, block, folder, measured, printer, printers, rotary};
use crate::support::{Folder, Point, distance};
use delta_cal_host::files::robot_file::RobotFile;
use delta_cal_host::{InputText, Reading, ReadingFrom, Readings};

/// What the numbers of a samples file may be off, which has nine decimals, and of positions computed from it: mm.
const EXACT: f64 = 1e-6;

fn robot(folder: &Folder) -> RobotFile {
    RobotFile::read(&InputText::from_file(&folder.path("mine/robot.toml")).unwrap()).unwrap()
}

/// The rows of the samples file.
fn readings(folder: &Folder, robot: &RobotFile) -> Vec<Reading> {
    let samples = InputText::from_file(&folder.path("mine/samples.csv")).unwrap();
    let rows = Readings::read(&samples, robot).unwrap().rows;
    rows.iter().map(|row| row.value).collect()
}

fn close(found: Point, expected: Point) {
    let off = distance(found, expected);
    assert!(off < EXACT, "{found:?} {expected:?}");
}

fn import(configuration: &str) -> Folder {
    let folder = folder(configuration);
    folder.run("import klipper printer.cfg --output mine").ok();
    assert_eq!(folder.read("printer.cfg"), configuration);
    folder
}

#[test]
fn ten_printers_have_the_carriages_and_positions_that_klipper_computes() {
    for own in printers() {
        let klipper = own.klipper;
        let folder = import(&own.configuration());
        let robot = robot(&folder);
        let found = readings(&folder, &robot);
        assert_eq!(found.len(), own.rows.len());
        for (found, expected) in found.iter().zip(&own.rows) {
            let at: Point = robot.robot.forward(&found.joints).unwrap().into();
            close(at, klipper.position(klipper.steps_of(found.joints)));
            let back = robot.robot.inverse(&at.into()).unwrap();
            close(back, klipper.carriages(at));
            match (expected, found.height, found.distance) {
                (Row::Height(from, height), Some((_, read)), None) => {
                    close(found.joints, klipper.stepped(*from));
                    assert!((read - height).abs() < EXACT);
                }
                (Row::Distance(from, to, length), None, Some((ReadingFrom::Pose(end), read))) => {
                    close(found.joints, klipper.stepped(*from));
                    close(end, klipper.stepped(*to));
                    assert!((read - length).abs() < EXACT);
                }
                _ => panic!("{found:?}"),
            }
        }
    }
}

#[test]
fn a_robot_whose_motors_turn_its_arms_has_klippers_positions() {
    let (klipper, text) = rotary();
    let expected = [
        [0.0, 0.0, 5.0],
        [60.0, 0.0, 5.0],
        [-40.0, 70.0, 80.0],
        [10.0, -80.0, 40.0],
    ];
    let rows = expected.map(|at| {
        let steps = klipper.steps(at);
        close(klipper.position(steps), at);
        Row::Height(steps, 1.5)
    });
    let folder = import(&format!("{text}\n{}", block(&measured(&rows))));
    let robot = robot(&folder);
    for (found, at) in readings(&folder, &robot).iter().zip(expected) {
        close(robot.robot.forward(&found.joints).unwrap().into(), at);
        let back = robot.robot.inverse(&at.into()).unwrap();
        // 1e-9 radians are 3e-7 mm at the end of the rods.
        assert!(distance(back, found.joints) < 1e-9, "{back:?} {found:?}");
    }
}

/// What an owner writes wins over the saved block, later lines over earlier ones, in included files too.
#[test]
fn options_are_looked_up_as_klipper_does() {
    let own = printer("01");
    let plain = import(&own.configuration()).read("mine/samples.csv");
    let by_hand = own.configuration().replace(
        "kinematics: delta #",
        "delta_radius: 100\ndelta_radius = 160.5 ; measured\nkinematics: delta #",
    );
    let folder = import(&by_hand);
    let arms = robot(&folder).robot;
    assert!((arms.arms()[0].d().xy().norm() - 160.5).abs() < EXACT);
    // In an included file the same option wins as well, and keeps SAVE_CONFIG from saving another.
    folder.write(
        "printer.cfg",
        format!("[include r.cfg]\n{}", own.configuration()),
    );
    folder.write("r.cfg", "[printer]\ndelta_radius = 160.5\n");
    let run = folder.run("import klipper printer.cfg --output mine --force");
    let said = run.ok().stdout;
    assert!(said.contains("r.cfg:2 sets delta_radius"), "{said}");
    let arms = robot(&folder).robot;
    assert!((arms.arms()[0].d().xy().norm() - 160.5).abs() < EXACT);
    // In included files, by a pattern.
    let (first, rest) = plain_parts(&own);
    let folder = Folder::new();
    std::fs::create_dir(folder.path("parts")).unwrap();
    folder.write("parts/steppers.cfg", rest);
    folder.write("parts/.hidden.cfg", "[printer]\ndelta_radius: 7\n");
    folder.write("printer.cfg", format!("[include parts/*.cfg]\n{first}"));
    folder.run("import klipper printer.cfg --output mine").ok();
    assert_eq!(folder.read("mine/samples.csv"), plain);
}

/// The configuration with its steppers apart.
fn plain_parts(own: &Printer) -> (String, String) {
    let text = own.configuration();
    let start = text.find("[stepper_a]").unwrap();
    let end = text.find("#*#").unwrap();
    let first = format!("{}{}", &text[..start], &text[end..]);
    (first, text[start..end].to_owned())
}

#[test]
fn steps_may_be_of_any_length() {
    let own = printer("07");
    let expected = import(&own.configuration()).read("mine/samples.csv");
    let length = own.klipper.step_lengths[0];
    let line = format!("rotation_distance: {:?}", length * 3200.0);
    let cases = [
        format!("step_distance: {length:?}"),
        format!(
            "rotation_distance: {:?}\nfull_steps_per_rotation: 400",
            length * 6400.0
        ),
        format!(
            "rotation_distance: {:?}\ngear_ratio: 4:2, 3:1",
            length * 19200.0
        ),
    ];
    for other in cases {
        let folder = import(&own.configuration().replace(&line, &other));
        assert_eq!(folder.read("mine/samples.csv"), expected, "{other}");
    }
}

/// The end stop's height above z = 0 is that of rods of the stated length.
#[test]
fn stated_rods_take_the_place_of_those_of_an_earlier_calibration() {
    let own = printer("05");
    let folder = import(&own.configuration());
    let text = folder.read("mine/robot.toml");
    assert!(text.contains("lb_mm = 341.224128\n"), "{text}");
    folder
        .run("import klipper printer.cfg --rods 34cm --output mine --force")
        .ok();
    let high = own.klipper.endstops[2] + (340f64.powi(2) - own.klipper.radius.powi(2)).sqrt();
    assert!((robot(&folder).limits.maximum() - high).abs() < EXACT);
    let round = import(&printer("01").configuration()).read("mine/robot.toml");
    assert!(!round.contains("earlier calibration"), "{round}");
}
