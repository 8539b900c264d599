//! Configurations that cannot be imported: place, cause and remedy, no file written, no secret told.

use crate::import::fixtures::{SECRETS, block, folder, printer, rotary};
use crate::import::run_next;
use crate::support::{Run, assert_refused, cases};

fn silent(run: &Run) {
    for secret in SECRETS {
        assert!(
            !run.stderr.contains(secret) && !run.stdout.contains(secret),
            "{secret}"
        );
    }
}

#[test]
fn wrong_configurations_are_refused_with_place_and_cause() {
    let good = printer("20").configuration();
    let table = "
        kinematics: delta ⇒ kinematics: corexy ⇒ printer.cfg:3: [printer] kinematics: the value is not delta or rotary_delta
        kinematics: delta ⇒ speed: 1 ⇒ printer.cfg: [printer] kinematics: the option is missing
        #*# delta_radius = 162.76928 ⇒ #*# ⇒ [printer] delta_radius: the option is missing
        #*# position_endstop = 418.72172\\n ⇒ ⇒ [stepper_a] position_endstop: the option is missing
        #*# position_endstop = 418.72172 ⇒ #*# position_endstop = four ⇒ position_endstop: the value is not a finite number
        #*# delta_radius = 162.76928 ⇒ #*# delta_radius = -3 ⇒ [printer] delta_radius: the value is not a number above 0
        #*# delta_radius = 162.76928 ⇒ #*# delta_radius = 600 ⇒ [stepper_a] arm_length: the value is not above 600
        Microsteps: 16 ⇒ pins: 16 ⇒ [stepper_a] microsteps: the option is missing
        rotation_distance: ⇒ gears: ⇒ [stepper_a] rotation_distance: the option is missing
        #*# height3_pos = ⇒ #*# height3_pos = 1; ⇒ [delta_calibrate] height3_pos: the value is not three numbers of steps
        #*# height3_pos = ⇒ #*# height3_place = ⇒ [delta_calibrate] height3_pos: the option is missing
        #*# height3 = ⇒ #*# height3 = nan # ⇒ [delta_calibrate] height3: the value is not a finite number
        max_velocity: 300 ⇒ max_velocity 300 ⇒ printer.cfg:4: this line of [printer] is not an option
        # my printer ⇒ [include printer.cfg] ⇒ printer.cfg:1: this line includes a file that includes this one again
        ";
    assert_wrong(
        &good,
        &[
            "import klipper printer.cfg --output mine",
            "calibrate printer.cfg --output c.toml",
        ],
        table,
    );
}

/// What is replaced in a configuration, by what, and what the error of these commands holds.
pub(super) fn assert_wrong(good: &str, commands: &[&str], table: &str) {
    for [from, to, cause] in cases(table) {
        assert!(good.contains(&from), "{from}");
        let folder = folder(&good.replace(&from, &to));
        for command in commands {
            let run = folder.run(command).ends(3, &format!("{cause} | help:"));
            assert_eq!(run.stdout, "");
            assert_eq!(folder.names(), ["printer.cfg"]);
            silent(&run);
        }
    }
}

/// There is a robot to plan measurements for, and nothing to calibrate from.
#[test]
fn a_configuration_without_measurements_gives_a_robot_file_only() {
    let good = printer("20").configuration();
    let saved = good.find("#*# [delta_calibrate]").unwrap();
    let folder = folder(&good[..saved]);
    let cause = "printer.cfg: the configuration holds no saved measurements";
    folder
        .run("calibrate printer.cfg --output c.toml")
        .ends(3, cause);
    assert_eq!(folder.names(), ["printer.cfg"]);
    let run = folder.run("import klipper printer.cfg --output mine");
    let run = run.ends(0, "DELTA_CALIBRATE");
    assert!(!folder.path("mine/samples.csv").exists());
    run_next(&folder, &run.stdout);
    silent(&run);
}

#[test]
fn files_that_exist_are_only_replaced_with_force() {
    let folder = folder(&printer("01").configuration());
    std::fs::create_dir(folder.path("mine")).unwrap();
    folder.write("mine/samples.csv", "of yesterday");
    folder
        .run("import klipper printer.cfg --output mine")
        .ends(4, "samples.csv: the file exists");
    assert_eq!(folder.read("mine/samples.csv"), "of yesterday");
    assert!(!folder.path("mine/robot.toml").exists());
    folder
        .run("import klipper printer.cfg --output mine --force")
        .ok();
    assert!(folder.read("mine/samples.csv").starts_with("s1_mm"));
}

#[test]
fn a_robot_whose_motors_turn_its_arms_has_faults_of_its_own() {
    let (_, text) = rotary();
    let saved = block("[delta_calibrate]\nheight0 = 1\nheight0_pos = 1,2,3\n");
    let good = format!("{text}\n{saved}");
    let table = "
        gear_ratio: 107.000:16 ⇒ gears: 1 ⇒ [stepper_a] gear_ratio: the option is missing
        gear_ratio: 107.000:16 ⇒ gear_ratio: 107 ⇒ [stepper_a] gear_ratio: the value is not ratios
        position_endstop: 252 ⇒ position_endstop: -2000 ⇒ position_endstop: the value is not a height that the arm reaches
        shoulder_height ⇒ height ⇒ [printer] shoulder_height: the option is missing
        ";
    assert_wrong(&good, &["import klipper printer.cfg --output mine"], table);
}

#[test]
fn the_command_line_is_checked() {
    let folder = folder(&printer("01").configuration());
    let table = "
        import klipper printer.cfg ⇒ 2 ⇒ --output <FOLDER>
        import ultimaker printer.cfg --output mine ⇒ 2 ⇒ write the file alone, or after one of klipper, reprapfirmware, marlin, smoothieware, repetier, fluidnc, grblhal
        import klipper printer.cfg --rods 1mm,2mm --output mine ⇒ 2 ⇒ --rods needs one length, or three
        import klipper printer.cfg --rods=-1mm --output mine ⇒ 2 ⇒ a length greater than 0 is needed
        import klipper printer.cfg --rods 0.1km --output mine ⇒ 2 ⇒ a length in um, mm, cm, m or in is needed
        calibrate printer.cfg --printed 100=50 ⇒ 2 ⇒ within 10 % of each other
        calibrate printer.cfg --output printer.cfg --force ⇒ 2 ⇒ --output printer.cfg is the same file as the robot file
        calibrate . --paste printer.cfg ⇒ 2 ⇒ --paste printer.cfg is the same file as the robot file
        calibrate printer.cfg --json printer.cfg ⇒ 2 ⇒ --json printer.cfg is the same file as the robot file
        ";
    assert_refused(&folder, "", table);
}
