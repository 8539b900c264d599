//! M665 and M666 of RepRapFirmware and Marlin.

use crate::export::klipper::Delta;
use crate::import::run_next;
use crate::support::{Folder, Point, assert_refused, cases, distance};
use delta_cal_host::InputText;
use delta_cal_host::files::robot_file::RobotFile;

const REPRAPFIRMWARE: &str = "\
; my config
M550 P\"hunter2\"
M665 R100 L200 ; older
M665 R141.2 L330.1:330.4:329.8 B120 H412.5 X0.3 Y-0.2 Z0.1 ; delta
M666 X0.4 Y-0.7 Z0.3 A0 B0
";

const MARLIN: &str = "\
echo:; Linear units:
echo:  M206 X0.00
echo:  M665 L330.1000 R141.2000 H411.8000 S160.0000 X0.3000 Y-0.2000 Z0.1000 A0.0000 B0.3000 C-0.3000
echo:  M666 X-1.1000 Y0.0000 Z-1.0000
";

/// What both say.
fn printer() -> Delta {
    Delta {
        radius: 141.2,
        angles: [210.3, 329.8, 90.1],
        arms: [330.1, 330.4, 329.8],
        endstops: [412.9, 411.8, 412.8],
        step_lengths: [0.0125; 3],
    }
}

#[test]
fn the_lines_of_both_firmwares_are_the_printer_that_they_describe() {
    for (controller, text) in [("reprapfirmware", REPRAPFIRMWARE), ("marlin", MARLIN)] {
        let folder = Folder::new();
        folder.write("config.g", text);
        let run = folder
            .run(&format!("import {controller} config.g --output mine"))
            .ok();
        assert_eq!(folder.names(), ["config.g", "mine"]);
        assert!(!folder.path("mine/samples.csv").exists());
        assert!(!run.stdout.contains("hunter2"));
        let file = InputText::from_file(&folder.path("mine/robot.toml")).unwrap();
        let robot = RobotFile::read(&file).unwrap();
        let own = printer();
        for at in [[0.0, 0.0, 0.0], [80.0, -20.0, 10.0], [-60.0, 90.0, 200.0]] {
            let carriages: Point = robot.robot.inverse(&at.into()).unwrap();
            assert!(
                distance(carriages, own.carriages(at)) < 1e-6,
                "{controller}"
            );
        }
        let [a, b, c] = own.absolute_endstops();
        let home = format!("--home {a:.6},{b:.6},{c:.6}");
        assert!(run.stdout.contains(&home), "{}", run.stdout);
        run_next(&folder, &run.stdout);
    }
}

#[test]
fn lines_that_cannot_be_read_are_refused() {
    // RepRapFirmware's bed of 120 mm would make the second rod 450 mm long.
    let table = "
        reprapfirmware M665 ⇒ M550 ⇒ no line is an M665
        marlin R141.2000 ⇒ ⇒ M665 R: the word is missing
        marlin H411.8000 ⇒ ⇒ M665 H: the word is missing
        marlin L330.1000 ⇒ L100 ⇒ config.g:3: M665 L: a rod is not longer
        marlin R141.2000 ⇒ R-1 ⇒ config.g:3: M665 R: the value is not above 0
        reprapfirmware L330.1: ⇒ Lhunter2: ⇒ config.g:4: M665: a word is no letter
        marlin B0.3000 ⇒ B120 ⇒ config.g:3: M665 B: 120 mm is too much for the correction of a rod
        ";
    for [from, to, cause] in cases(table) {
        let (controller, from) = from.split_once(' ').unwrap();
        let text = match controller {
            "marlin" => MARLIN,
            _ => REPRAPFIRMWARE,
        };
        let folder = Folder::new();
        folder.write("config.g", text.replace(from, &to));
        let case = format!("{controller} config.g --output mine ⇒ 3 ⇒ {cause}");
        assert_refused(&folder, "import", &case);
        let said = folder.run(&format!("import {controller} config.g --output mine"));
        assert!(!said.stderr.contains("hunter2"), "{}", said.stderr);
    }
}
