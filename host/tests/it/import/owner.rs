//! What an owner states beside the configuration, plans for it, the pictures of the bed, and which files are written.

use crate::import::fixtures::{Row, folder, printer};
use crate::support::Folder;

/// A printer as configured, with heights of 0 and twelve distances that all are longer by this part.
fn scaled(part: f64) -> Folder {
    let mut own = printer("01");
    let klipper = own.klipper;
    let steps = |turn: u8, out: f64| {
        let (sine, cosine) = (f64::from(turn) * 30.0).to_radians().sin_cos();
        klipper.steps([out * cosine, out * sine, 0.0])
    };
    own.rows = (0..6)
        .map(|turn| Row::Height(steps(2 * turn, 90.0), 0.0))
        .collect();
    own.rows.push(Row::Height(steps(0, 0.0), 0.0));
    let length = (65.0 * (1.0 + part) * 1000.0).round() / 1000.0;
    own.rows
        .extend((0..12).map(|turn| Row::Distance(steps(turn, 10.0), steps(turn, 75.0), length)));
    folder(&own.configuration())
}

/// Twelve distances, 1.5 % short: said as one scale, with what could do it; as shrinkage it is none.
#[test]
fn a_common_scale_is_named_with_its_causes() {
    let folder = scaled(-0.015);
    let said = folder.run("calibrate printer.cfg").words();
    for words in [
        "All 12 distances are 1.5 %",
        "too short: a common scale",
        "--rods",
        "shrink by 1.5 %",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let run = folder.run("calibrate printer.cfg --shrinkage 1.5%").ok();
    assert!(!run.stdout.contains("common scale"), "{}", run.stdout);
}

/// Touches of the bed in the firmware's commands, no place twice; nozzle and probe within the bed's radius, and clear of
/// the bed by 5 mm or what is stated, from above the first touch on. Marlin is told the probe's place.
#[test]
fn touches_of_the_bed_are_planned_in_machine_coordinates() {
    let klipper = printer("01").configuration();
    let high = klipper.replace("horizontal_move_z: 10", "horizontal_move_z: 27");
    let beside = format!("[bltouch]\nx_offset: -24\ny_offset: 7\nz_offset: 2\n{klipper}");
    let duet = "M665 R141.2 L330.1 B120 H412.5\nM666 X0 Y0 Z0\nG31 X0 Y-30 Z13.5\nM558 P1 H4 C\"hunter2\"\n";
    let marlin = "echo:  M665 L330 R141 H411 B100\necho:  M666 X0 Y0 Z0\necho:  M851 X20 Y10 Z-2\n";
    // The saved heights of this printer are 18.224 mm.
    for (name, text, [radius, clear], beside, command) in [
        (
            "printer.cfg",
            klipper.as_str(),
            [120.0, 23.2],
            [0.0; 2],
            "PROBE",
        ),
        ("high.cfg", &high, [120.0, 27.0], [0.0; 2], "PROBE"),
        ("beside.cfg", &beside, [120.0, 23.2], [-24.0, 7.0], "PROBE"),
        ("config.g", duet, [120.0, 18.5], [0.0, -30.0], "G30 S-1"),
        ("m503.txt", marlin, [100.0, 10.0], [20.0, 10.0], "G30 X"),
    ] {
        let folder = Folder::new();
        folder.write(name, text);
        let plan = format!("plan {name} --count 9 --output touches.gcode");
        folder.run(&plan).ok();
        let commands = folder.read("touches.gcode");
        assert_eq!(commands.matches(command).count(), 9, "{commands}");
        assert!(!commands.contains("-0.0"), "{commands}");
        assert!(
            commands.starts_with("; To stop at once: M112"),
            "{commands}"
        );
        let word = |line: &str, letter: char| -> Option<f64> {
            let mut words = line.split_whitespace();
            let own = words.find_map(|own| own.strip_prefix(letter))?;
            own.parse().ok()
        };
        let lines: Vec<_> = commands.lines().collect();
        let first = lines.iter().find(|line| line.starts_with("G1"));
        assert!(first.unwrap().contains("F600"), "{commands}");
        for height in lines.iter().filter_map(|line| word(line, 'Z')) {
            assert!((height - clear).abs() < 0.06, "{name}: {commands}");
        }
        let places = lines
            .iter()
            .filter_map(|line| Some([word(line, 'X')?, word(line, 'Y')?]));
        let mut places: Vec<_> = places.collect();
        for [x, y] in &places {
            let sign = if command == "G30 X" { -1.0 } else { 1.0 };
            for [x, y] in [[*x, *y], [x + sign * beside[0], y + sign * beside[1]]] {
                assert!(x.hypot(y) <= radius + 0.1, "{name}: {commands}");
            }
        }
        places.sort_unstable_by(|one, other| one.partial_cmp(other).unwrap());
        places.dedup();
        assert_eq!(places.len(), 9, "{commands}");
    }
}

/// Both maps of a bed that the lines improve, with the touches.
#[test]
fn the_page_shows_the_bed_before_and_after() {
    let printed = "--printed 20=20.2 --printed 60=60.2 --printed 120=120.2";
    for (number, lengths, distances) in [("13", "", false), ("01", printed, true)] {
        let folder = folder(&printer(number).configuration());
        let command = format!("calibrate printer.cfg --report r.html {lengths}");
        folder.run(&command).ok();
        let page = folder.read("r.html");
        for (words, shown) in [
            ("The nozzle above a flat bed, as configured.", true),
            ("The nozzle above a flat bed, with the lines pasted.", true),
            ("nozzle 0.000 to 0.0", true),
            ("touches", true),
            ("x and y, ", distances),
            ("as found and as left", false),
            ("[workspace]", false),
        ] {
            assert_eq!(page.contains(words), shown, "{words}");
        }
    }
}

/// One reading of a calliper is not three: each has √3 times its σ in the samples file.
#[test]
fn a_printed_length_is_one_measurement() {
    let folder = folder(&printer("01").configuration());
    let import = "import klipper printer.cfg --output mine --printed 100=99.5 --shrinkage 0%";
    folder.run(import).ok();
    let samples = folder.read("mine/samples.csv");
    let stated = samples.contains(",sigma_mm\n") && samples.contains(",0.173205081\n");
    assert!(stated, "{samples}");
}
