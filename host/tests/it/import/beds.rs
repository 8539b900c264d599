//! Beds and probes as they are: uneven, beside the nozzle, tilted by the firmware, touched wrongly once.

use crate::export::controllers::{LINEAR, towers};
use crate::export::klipper::Delta;
use crate::import::campaign::{
    HEIGHT, Made, OF_PRINTER, RADIUS, STEPS, Set, drawn, normal, prints, set, set_up, spread,
};
use crate::import::fixtures::{Printer, Row, folder};
use crate::support::{Folder, Point};
use delta_cal_host::import::{Firmware, Stated};
use delta_cal_host::report::printer::PrinterReport;
use delta_cal_host::{InputText, calibrate, printer as printers};
use delta_cal_tests::{generator, size};
use std::fmt::Write;

/// A controller that adds a part of x and of y to every height.
#[derive(Clone, Copy)]
pub(super) struct Told {
    pub(super) own: Delta,
    pub(super) tilt: [f64; 2],
}

impl Told {
    /// That adds nothing.
    pub(super) fn level(own: Delta) -> Self {
        Self {
            own,
            tilt: [0.0; 2],
        }
    }

    fn steps(&self, [x, y, z]: Point) -> Point {
        let [by_x, by_y] = self.tilt;
        self.own.steps([x, y, z + x * by_x + y * by_y])
    }

    /// The commanded height at which the probe, beside the nozzle, touches a bed.
    pub(super) fn touch(&self, made: &Made, [x, y]: [f64; 2], beside: [f64; 2]) -> f64 {
        let mut z = 0.0;
        for _ in 0..20 {
            let at = made.at(self.steps([x, y, z]), beside);
            z -= at.z - made.bed(at.x, at.y);
        }
        z
    }
}

/// The printer that a controller takes its lines for.
fn read(target: &str, lines: &str) -> Delta {
    Delta {
        step_lengths: STEPS,
        ..towers(target, lines)
    }
}

/// How flat a printer prints with the lines for a configuration and its readings, or with the configuration if there are none,
/// and what is stated of it.
pub(super) fn flat(
    (firmware, text): (Firmware, &str),
    samples: &[(&str, String)],
    (made, told): (&Made, &Told),
) -> [f64; 2] {
    let samples = samples
        .iter()
        .map(|(name, own)| InputText::new(*name, own.as_str()));
    let samples: Vec<_> = samples.collect();
    let none = |_: &str, _: &str| Ok(Vec::new());
    let (text, stated) = (InputText::new("config", text), Stated::default());
    let own = printers::read(firmware, &text, &samples, &stated, &none, &OF_PRINTER).unwrap();
    let report = calibrate(&own.robot, &own.readings, &OF_PRINTER).unwrap();
    let report = PrinterReport::of(&own, report).unwrap().printer;
    let (pasted, stated) = match (&report.lines, firmware) {
        (Some(lines), Firmware::Klipper) => (Delta::pasted(lines, STEPS), report.after),
        (Some(lines), own) => (read(own.name(), lines), report.after),
        (None, _) => (told.own, report.before),
    };
    [prints(made, &pasted)[HEIGHT], stated.unwrap().height]
}

/// Beds uneven by 0.03 mm, touched at 24 places, never calibrated: none is refused, and a probe 24.5 mm beside the nozzle is
/// as good as one below it. The tilt that RepRapFirmware adds costs nothing.
#[test]
fn uneven_beds_offset_probes_and_tilts_are_calibrated_as_well() {
    let set = set("A1");
    let mut squares = [[0.0; 2]; 4];
    for index in 0..size(4_u32, 40) {
        let mut rng = generator(970, u64::from(index));
        let mut made = Made::new(&set, &mut rng);
        made.bed = [0; 6].map(|_| 0.03 * normal(&mut rng));
        let level = Told::level(drawn());
        let tilted = Told {
            tilt: [0.004, -0.003],
            ..level
        };
        let noise: Vec<_> = (0..24).map(|_| 0.01 * normal(&mut rng)).collect();
        let [x, y, z] = level.own.endstops;
        let klipper = Printer::unmeasured(level.own).configuration();
        let duet = format!(
            "M665 L330 R140 H{x} B{RADIUS}\nM666 X0 Y{} Z{} A0.4 B-0.3\nG31 X24.5 Y0\n",
            y - x,
            z - x
        );
        let marlin = format!(
            "echo: M665 L330 R140 H{x} A0 B0 C0\necho: M666 X0 Y0 Z0\necho: M851 X24.5 Y0 Z-1\n#define PRINTABLE_RADIUS {RADIUS}\n"
        );
        let beside = format!("[probe]\nx_offset: 24.5\ny_offset: 0\n{klipper}");
        let cases = [
            (Firmware::Klipper, &klipper, level, [0.0; 2]),
            (Firmware::Klipper, &beside, level, [24.5, 0.0]),
            (Firmware::RepRapFirmware, &duet, tilted, [24.5, 0.0]),
            (Firmware::Marlin, &marlin, level, [24.5, 0.0]),
        ];
        for ((firmware, text, told, beside), sums) in cases.into_iter().zip(&mut squares) {
            let mut answers = String::new();
            for ([x, y], noise) in spread(24).into_iter().zip(&noise) {
                let [x, y] = [0.8 * x, 0.8 * y];
                let z = told.touch(&made, [x, y], beside) + noise;
                let [there, here] = [x + beside[0], y + beside[1]];
                match firmware {
                    Firmware::Klipper if beside[0] > 0.0 => writeln!(
                        answers,
                        "// probe: at {there:.3},{here:.3} bed will contact at z={z:.6}"
                    ),
                    Firmware::Klipper => {
                        writeln!(answers, "// probe at {x:.3},{y:.3} is z={z:.6}")
                    }
                    Firmware::RepRapFirmware => {
                        writeln!(answers, "G1 X{x:.3} Y{y:.3}\nStopped at height {z:.4} mm")
                    }
                    _ => {
                        writeln!(answers, "Bed X: {there:.3} Y: {here:.3} Z: {z:.4}")
                    }
                }
                .unwrap();
            }
            let answers = [("console.txt", answers)];
            let found = flat((firmware, text), &answers, (&made, &told));
            for (sum, own) in sums.iter_mut().zip(found) {
                *sum += own * own;
            }
        }
    }
    let rms = squares.map(|own| own.map(|own| f64::sqrt(own / f64::from(size(4_u32, 40)))));
    eprintln!("is, stated: below, beside, tilted, Marlin: {rms:.4?}");
    let [[below, _], others @ ..] = rms;
    // The tilt that the lines do not keep is left to the end stops.
    for ([own, _], most) in others.into_iter().zip([1.15, 1.2, 1.15]) {
        assert!(own < most * below, "{rms:?}");
    }
    // What is stated covers what is.
    for [is, stated] in rms {
        assert!((0.4..1.25).contains(&(stated / is)), "{rms:?}");
    }
}

fn made(set: &Set, seed: u64, index: u32) -> Printer {
    let (_, klipper, rows) = set_up(set, &mut generator(seed, u64::from(index)));
    Printer { klipper, rows }
}

/// The same printer, of which one touch is off.
fn with_touch_off(printer: &Printer, bad: usize, off: f64) -> Printer {
    let mut wrong = printer.clone();
    if let Row::Height(steps, height) = wrong.rows[bad] {
        let [x, y, z] = printer.klipper.position(steps);
        wrong.rows[bad] = Row::Height(printer.klipper.steps([x, y, z + off]), height);
    }
    wrong
}

/// One of seven touches of a calibrated printer off by 0.3 to 1 mm: named, and no lines. The right ones are calibrated.
#[test]
fn one_bad_touch_of_seven_is_named() {
    let set = set("A2");
    let (mut named, mut tried) = (0, 0);
    for index in 0..size(6_u32, 20) {
        let right = made(&set, 971, index);
        let run = folder(&right.configuration()).run("calibrate printer.cfg");
        assert_eq!(run.code, 0, "{}", run.stderr);
        for (bad, off) in [(0, 0.6), (1, 0.3), (4, -0.5), (6, 1.0)] {
            let wrong = with_touch_off(&right, bad, off);
            let own = folder(&wrong.configuration());
            let run = own.run("calibrate printer.cfg --paste paste.cfg");
            tried += 1;
            let cause = format!("One touch decides: height{bad}, ");
            if run.stderr.contains(&cause) {
                named += 1;
                assert_eq!(run.code, 1);
                assert_eq!(own.names(), ["printer.cfg"]);
            }
        }
    }
    eprintln!("{named} of {tried} bad touches named");
    assert!(10 * named >= 9 * tried, "{named} of {tried}");
}

/// Seven touches of an uncalibrated printer: how far one may be off unnoticed is stated. Any that is further off is named, and
/// not each that is half as far.
#[test]
fn how_far_off_a_touch_may_be_unnoticed_is_stated() {
    let (mut stated, mut unnoticed) = (0, 0);
    for index in 0..size(4, 20) {
        let mut right = made(&set("A1"), 974, index);
        right.rows.truncate(7);
        let run = folder(&right.configuration()).run("calibrate printer.cfg");
        let said = run.stdout.split_once("one that is off by up to ");
        let Some((most, _)) =
            said.and_then(|own| own.1.split_once(" mm may go unnoticed: touch 16"))
        else {
            continue;
        };
        let most: f64 = most.parse().unwrap();
        stated += 1;
        let is_named = |bad, off| {
            let wrong = with_touch_off(&right, bad, off);
            let run = folder(&wrong.configuration()).run("calibrate printer.cfg");
            run.stderr.contains("One touch decides")
        };
        for bad in 0..7 {
            for sign in [1.0, -1.0] {
                assert!(is_named(bad, 1.3 * sign * most), "{index} {bad} {most}");
                unnoticed += usize::from(!is_named(bad, 0.5 * sign * most));
            }
        }
    }
    eprintln!("{stated} stated, {unnoticed} of half that size unnoticed");
    assert!(stated > 2 && unnoticed > 2 * stated);
}

/// Six touches show as many errors as a calibration has unknowns: those of a calibrated printer say that it is one, and those
/// of one whose end stop moved write lines.
#[test]
fn six_touches_of_a_calibrated_printer_write_no_lines() {
    for index in 0..4 {
        let mut own = made(&set("A2"), 973, index);
        own.rows.truncate(6);
        let agreeing = folder(&own.configuration()).run("calibrate printer.cfg");
        assert!(
            agreeing.stdout.contains("to change: 6 heights agree"),
            "{}",
            agreeing.stdout
        );
        own.klipper.endstops[0] += 0.5;
        let moved = folder(&own.configuration()).run("calibrate printer.cfg");
        assert!(moved.stdout.contains("Paste the lines"), "{}", moved.stdout);
    }
}

/// Calibrate, paste, touch, ten times: rods that nobody measured stay within what they were configured as, the bed gets no
/// worse, and lines from new touches of a calibrated printer are the exception: the one calibration is as good as the other.
#[test]
fn ten_rounds_settle() {
    let set = set("A1");
    let printers = size(2_u32, 20);
    for (target, configuration) in LINEAR
        .into_iter()
        .zip(["printer.cfg", "config.g", "m503.txt"])
    {
        let (mut sums, mut again, mut refused) = ([0.0; 4], 0, 0);
        for index in 0..printers {
            let mut rng = generator(972, u64::from(index));
            let (made, mut controller, _) = set_up(&set, &mut rng);
            let mut lines = match target {
                "klipper" => String::new(),
                "marlin" => "M665 L330 R140 H300 A0 B0 C0\nM666 X0 Y0 Z0\n".to_owned(),
                _ => format!("M665 L330 R140 H300 B{RADIUS}\nM666 X0 Y0 Z0 A0 B0\n"),
            };
            for round in 0..10 {
                let folder = Folder::new();
                let klipper = Printer::unmeasured(controller);
                let comments = lines.lines().filter(|own| own.starts_with('#'));
                let comments = comments.collect::<Vec<_>>().join("\n");
                let text = match target {
                    "klipper" => format!("{comments}\n{}", klipper.configuration()),
                    // As M503 answers, without comments, which the pasted file holds.
                    "marlin" => lines
                        .replace("delta-cal keeps", "")
                        .replace("M66", "echo: M66"),
                    _ => lines.clone(),
                };
                folder.write(configuration, text);
                let mut touches = "x_mm,y_mm,height_mm\n".to_owned();
                for [x, y] in spread(16) {
                    let z = Told::level(controller).touch(&made, [x, y], [0.0; 2]);
                    writeln!(touches, "{x},{y},{:.4}", z + 0.01 * normal(&mut rng)).unwrap();
                }
                folder.write("touches.csv", touches);
                folder.write("pasted.g", &lines);
                let also = if target == "marlin" && lines.contains("keeps") {
                    "pasted.g"
                } else {
                    ""
                };
                refused += folder
                    .run(&format!(
                        "calibrate {configuration} touches.csv {also} --paste paste.cfg"
                    ))
                    .code;
                if folder.path("paste.cfg").exists() {
                    lines = folder.read("paste.cfg");
                    controller = match target {
                        "klipper" => Delta::pasted(&lines, STEPS),
                        _ => read(target, &lines),
                    };
                    again += u32::from(round > 0);
                }
                let [height, size, _] = prints(&made, &controller);
                let place = if round == 0 { 0 } else { 2 };
                if round == 0 || round == 9 {
                    sums[place] += size * size;
                    sums[place + 1] += height * height;
                }
            }
        }
        let [first_size, first, last_size, last] = sums.map(f64::sqrt);
        eprintln!(
            "{target}: size {first_size:.5} then {last_size:.5}, height {first:.4} then {last:.4}, {again} times again, {refused} refused"
        );
        assert!(last_size < 1.3 * first_size && last < 1.2 * first);
        assert!(again < printers && refused < printers.cast_signed());
    }
}

/// Rods stated 4 mm too long against twelve good distances: refused with both numbers; the right ones are not.
#[test]
fn stated_rods_that_distances_contradict_are_refused() {
    let set = set("A4");
    for index in 0..size(4_u32, 20) {
        let own = made(&set, 973, index);
        let folder = folder(&own.configuration());
        for (rods, code) in [("330mm", 0), ("334mm", 1)] {
            let run = folder.run(&format!(
                "calibrate printer.cfg --rods {rods} --shrinkage 0%"
            ));
            assert_eq!(run.code, code, "{rods}: {}{}", run.stdout, run.stderr);
            let named = run
                .stderr
                .contains("--rods states rods of 334 mm; the distances say 3");
            assert_eq!(named, code == 1, "{}", run.stderr);
        }
    }
}
