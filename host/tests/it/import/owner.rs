//! What an owner states beside the configuration, plans for it, and the pictures of the bed.

use crate::import::fixtures::{Row, folder, printer};
use crate::support::{Folder, NOMINAL, assert_refused, number};

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

/// The length of one part decides the size of all, if it is known how much prints shrink.
#[test]
fn a_printed_length_is_a_measurement() {
    let own = printer("01");
    let folder = folder(&own.configuration());
    let run = folder.run("calibrate printer.cfg --printed 100=99.5 --shrinkage 0% --json -");
    let report = run.ok().json();
    let hundred = number(&report, "printer/before/hundred_mm_become_mm");
    assert!((99.4..99.7).contains(&hundred), "{hundred}");
    assert_eq!(report["printer"]["distances"], 3);
    // One reading of a calliper is not three: each has √3 times its σ in the samples file too.
    let import = "import klipper printer.cfg --output mine --printed 100=99.5 --shrinkage 0%";
    folder.run(import).ok();
    let samples = folder.read("mine/samples.csv");
    assert!(
        samples.contains(",sigma_mm\n") && samples.contains(",0.173205081\n"),
        "{samples}"
    );
    for (limit, code, verdict) in [("50mm", 0, "Pass: "), ("0.001mm", 6, "Fail: ")] {
        let run = folder.run(&format!("calibrate printer.cfg --limit {limit}"));
        assert_eq!(run.code, code, "{}", run.stderr);
        assert!(
            run.stdout.contains(verdict) && run.stdout.contains("limit"),
            "{}",
            run.stdout
        );
    }
    let table = "--columns q1_deg=A ⇒ 2 ⇒ --columns needs a samples file";
    assert_refused(&folder, "calibrate printer.cfg", table);
}

/// Prints that all are 0.2 mm too thick are no larger robot: three lengths and a table of lengths between places tell the
/// oversize from the size.
#[test]
fn prints_that_are_too_thick_are_an_oversize() {
    let own = printer("01");
    let folder = folder(&own.configuration());
    folder.write(
        "lengths.csv",
        "from,x_mm,y_mm,to,to_x_mm,to_y_mm,length_mm\nA,-60,0,B,60,0,120.2\nB,,,C,0,80,100.2\nC,,,A,,,100.2\n\
         D,-10,0,E,10,0,20.2\nF,0,-10,G,0,10,20.2\n",
    );
    for (readings, distances) in [
        ("--printed 20=20.2 --printed 60=60.2 --printed 120=120.2", 9),
        ("lengths.csv", 5),
    ] {
        let command = format!("calibrate printer.cfg {readings} --shrinkage 0% --json -");
        let report = folder.run(&command).ok().json();
        assert_eq!(report["printer"]["distances"], distances);
        let hundred = number(&report, "printer/before/hundred_mm_become_mm");
        assert!((99.85..100.15).contains(&hundred), "{readings}: {hundred}");
    }
    let table = "
        broken.csv ⇒ 3 ⇒ broken.csv:2: a place has neither x and y nor a name
        far.csv ⇒ 3 ⇒ far.csv:2: the length is not within 10 % of the designed one
        ";
    folder.write("broken.csv", "from,to,length_mm\nA,B,100\n");
    folder.write(
        "far.csv",
        "x_mm,y_mm,to_x_mm,to_y_mm,length_mm\n0,0,100,0,50\n",
    );
    assert_refused(&folder, "calibrate printer.cfg", table);
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

/// Measurements, other options' files and their meaning are never lost; commands may be planned again.
#[test]
fn touches_replace_no_measurements_and_ignore_no_option() {
    let folder = folder(&printer("01").configuration());
    let samples = "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm\n10,20,30,5,6,-400\n";
    folder.write("mysamples.csv", samples);
    let table = "
        --output mysamples.csv ⇒ 2 ⇒ holds measurements | --force
        --output missing/t.gcode ⇒ 4 ⇒ no folder
        --samples mysamples.csv ⇒ 2 ⇒ --samples does not apply
        --measure xyz ⇒ 2 ⇒ --measure does not apply
        --order random ⇒ 2 ⇒ --order does not apply
        --seed 7 ⇒ 2 ⇒ --seed does not apply
        --json plan.json ⇒ 2 ⇒ --json does not apply
        ";
    assert_refused(&folder, "plan printer.cfg --count 9", table);
    assert_eq!(folder.read("mysamples.csv"), samples);
    folder.write("robot.toml", NOMINAL);
    let table = "--columns q1_deg=A ⇒ 2 ⇒ --columns needs a samples file";
    assert_refused(&folder, "plan robot.toml --count 9", table);
    for _ in 0..2 {
        let plan = "plan printer.cfg --count 9 --output touches.gcode";
        folder.run(plan).ok();
    }
    folder
        .run("plan printer.cfg --count 9 --output mysamples.csv --force")
        .ok();
}

/// A comment decides neither the firmware, whose end stops have other signs, nor whether this is a robot file.
#[test]
fn comments_do_not_change_what_a_file_is() {
    let duet = "M665 R141.2 L330.1 B120 H412.5\nM666 X0.3 Y0 Z0\n";
    let folder = folder(&printer("01").configuration());
    folder.write("plain.g", duet);
    folder.write("commented.g", format!("; echo: M665 is below\n{duet}"));
    folder.write("reset.g", format!("M550 P\"echo:\" ; name\n{duet}"));
    let commented = format!("# not [joints]\n{}", folder.read("printer.cfg"));
    folder.write("printer.cfg", commented);
    let plan = |name: &str| {
        let plan = format!("plan {name} --count 9 --output -");
        folder.run(&plan).ok().stdout
    };
    let plain = plan("plain.g");
    assert!(plain.contains("G30 S-1"), "{plain}");
    assert_eq!(
        [plan("commented.g"), plan("reset.g")],
        [plain.clone(), plain]
    );
    folder.run("calibrate printer.cfg").ok();
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
