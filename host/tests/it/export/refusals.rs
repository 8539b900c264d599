//! What is refused, and what is written then: nothing.

use crate::export::robots::{csv, example};
use crate::support::{Folder, NOMINAL, assert_refused, nominal_arms, robot_toml};

#[test]
fn what_cannot_be_exported_is_refused_with_place_and_cause() {
    let folder = Folder::new();
    let mut arms = nominal_arms();
    folder.write("calibrated.toml", robot_toml(&arms));
    arms[1][4] = 20.0;
    folder.write("tilted.toml", robot_toml(&arms));
    arms[1][4] = 0.0;
    arms[2][3] = 220.0;
    let (sin, cos) = f64::to_radians(220.0).sin_cos();
    (arms[2][0], arms[2][1]) = (164.0 * cos, 164.0 * sin);
    folder.write("turned.toml", robot_toml(&arms));
    folder.write("few.csv", "x_mm,y_mm,z_mm\n0,0,-400\n");
    let mut far = String::from("x_mm,y_mm,z_mm\n");
    for _ in 0..30 {
        far += "0,0,-4000\n";
    }
    folder.write("far.csv", far);
    folder.write("metres.csv", "x,y\n1,2\n");
    let wide = NOMINAL.replace("platform_radius_mm = 30", "platform_radius_mm = 230");
    assert_ne!(wide, NOMINAL);
    folder.write("wide.toml", wide);
    let cube = (0..27).map(|k| [k / 9, k / 3 % 3, k % 3 - 40].map(|c| 10.0 * f64::from(c)));
    folder.write("cube.csv", csv(&cube.collect::<Vec<_>>()));
    let table = "
        tilted.toml --for klipper ⇒ 3 ⇒ tilted.toml:15: alpha_deg: arm 2: its motor axis is tilted by 20.000°
        tilted.toml --for b-and-r ⇒ 3 ⇒ no controller holds a tilt
        turned.toml --for linuxcnc ⇒ 3 ⇒ theta_deg: arm
        calibrated.toml ⇒ 2 ⇒ --for <TARGET>
        calibrated.toml --for mach3 ⇒ 2 ⇒ [possible values: klipper,
        calibrated.toml --for klipper --output calibrated.toml ⇒ 2 ⇒ --output calibrated.toml is the same file as the robot file
        calibrated.toml --for klipper --json out --output out ⇒ 2 ⇒ --json out is the same file as --output
        calibrated.toml --for klipper --home -52.5deg ⇒ 2 ⇒ a number without its unit
        calibrated.toml --for klipper --home 1,2 ⇒ 2 ⇒ --home takes one joint angle in degrees, or three
        calibrated.toml --for reprapfirmware --home -400 ⇒ 3 ⇒ calibrated.toml: arm 1: the end stop at -400° is outside [joints], -60 to 90°
        calibrated.toml --for linuxcnc --home -40,180,-40 ⇒ 3 ⇒ arm 2: the end stop at 180° is outside
        calibrated.toml --for klipper --home -60 ⇒ 3 ⇒ arm 1: no position_endstop describes an end stop at -60.000°
        calibrated.toml --for correction-table --limit 0mm ⇒ 2 ⇒ a length greater than 0 is needed
        calibrated.toml --for klipper --limit 0.1mm ⇒ 2 ⇒ --limit cannot be used with --for klipper
        calibrated.toml --for klipper --positions few.csv ⇒ 3 ⇒ few.csv
        calibrated.toml --for klipper --positions far.csv ⇒ 3 ⇒ far.csv:2: unreachable for arm 1
        calibrated.toml --for klipper --positions metres.csv ⇒ 3 ⇒ metres.csv:1: column x: its unit is not stated
        calibrated.toml --for klipper --home -40 --output none/robot.cfg ⇒ 4 ⇒ there is no folder none
        missing.toml --for klipper ⇒ 3 ⇒ missing.toml
        wide.toml --for klipper --output wide.cfg ⇒ 3 ⇒ its base radius minus the platform radius is -36.000 mm
        tilted.toml --for correction-table --positions cube.csv --limit 1e-12mm --output table.csv ⇒ 3 ⇒ keeps the error below 0.000000000001 mm; the finest has
        ";
    assert_refused(&folder, "export", table);
    // The same robots can be exported for what holds everything.
    for target in ["linuxcnc-component", "correction-table"] {
        folder
            .run(&format!("export tilted.toml --for {target}"))
            .ok();
    }
    folder.run("export turned.toml --for klipper").ok();
}

#[test]
fn arms_that_are_numbered_clockwise_keep_their_motors() {
    let folder = Folder::new();
    let [first, second, third] = nominal_arms();
    folder.write("robot.toml", robot_toml(&[first, third, second]));
    // The arms of LinuxCNC's joints, which run clockwise.
    let arms = || {
        let run = folder.run("export robot.toml --for linuxcnc").ok();
        let lines = run.stdout.lines().map(str::to_owned);
        lines
            .filter(|line| line.starts_with("# arm "))
            .collect::<Vec<_>>()
    };
    assert_eq!(arms(), ["# arm 1", "# arm 2", "# arm 3"]);
    folder.write("robot.toml", robot_toml(&[first, second, third]));
    assert_eq!(arms(), ["# arm 1", "# arm 3", "# arm 2"]);
}

#[test]
fn what_is_for_towers_is_refused_for_rotary_arms() {
    let rotary = Folder::new();
    example(&rotary);
    let table = "
        --for marlin ⇒ 3 ⇒ this robot has rotary arms: | klipper, reprapfirmware, b-and-r, linuxcnc
        --for klipper --bed samples.csv ⇒ 2 ⇒ only be used with towers
        ";
    assert_refused(&rotary, "export calibrated.toml", table);
}
