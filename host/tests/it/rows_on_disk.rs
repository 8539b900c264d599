//! What is calibrated from rows on disk is what is calibrated from the same rows in memory.

use crate::support::{Folder, NOMINAL, Point, TOLERANCE, csv, noisy, true_arms};
use delta_cal::robust::Loss;
use delta_cal_host::{
    CalibrationMethod, CalibrationReport, Frame, InputText, Measurements, Options, RobotFile,
    SamplesFile, Streaming, calibrate, read_samples,
};
use std::num::NonZeroU32;
use std::path::Path;

const NOISE: &str = "\n[noise]\nposition_mm = 0.02\njoint_deg = 0\n";
/// More than are kept in memory.
const ROWS: u32 = 20_500;

fn positions(input: &InputText, robot: &RobotFile, options: Options) -> SamplesFile {
    match read_samples(input, robot, options).unwrap() {
        Measurements::Positions(samples) => samples,
        Measurements::Observations(_) => panic!("every row holds x, y and z"),
    }
}

/// The reports of the rows in memory, and on disk.
fn both(robot: &RobotFile, path: &Path, options: Options) -> [CalibrationReport; 2] {
    let in_memory = InputText::from_table(path).unwrap();
    let on_disk = InputText::from_long_table(path).unwrap();
    assert_eq!(in_memory.sha256(), on_disk.sha256());
    let in_memory = positions(&in_memory, robot, options);
    assert!(in_memory.all.is_none() && in_memory.rows.len() == ROWS as usize);
    let on_disk = positions(&on_disk, robot, options);
    assert_eq!(
        on_disk.all.as_ref().map(delta_cal_host::ManyRows::count),
        Some(ROWS as usize)
    );
    assert!((10_000..=20_000).contains(&on_disk.rows.len()));
    [in_memory, on_disk].map(|samples| calibrate(robot, &samples, options).unwrap())
}

/// The largest difference of a parameter, in its σ.
fn apart([first, second]: &[CalibrationReport; 2]) -> f64 {
    let parameters = |report: &CalibrationReport| report.outcome.fit.robot.parameters();
    let covariance = first.outcome.covariance.as_ref().unwrap();
    let (first, second) = (parameters(first), parameters(second));
    let both = first.as_flattened().iter().zip(second.as_flattened());
    both.enumerate()
        .map(|(index, (a, b))| (a - b).abs() / covariance[(index, index)].sqrt())
        .fold(0.0, f64::max)
}

fn robot() -> RobotFile {
    RobotFile::read(&InputText::new(
        "robot.toml",
        &format!("{NOMINAL}{TOLERANCE}{NOISE}"),
    ))
    .unwrap()
}

/// Uniform errors of up to 0.035 mm: one σ is 0.02 mm.
fn measured() -> Vec<(Point, Point)> {
    noisy(&true_arms(), ROWS, 0.0346)
}

#[test]
fn every_method_and_stream_option_gives_the_same_robot() {
    let folder = Folder::new();
    folder.write("samples.csv", csv(&measured()));
    let path = folder.path("samples.csv");
    let count = |count| NonZeroU32::new(count);
    let plain = Options::default();
    let with = |streaming| Options { streaming, ..plain };
    let method = |method| Options { method, ..plain };
    let nothing = Streaming::default();
    for options in [
        plain,
        method(CalibrationMethod::Ikm),
        method(CalibrationMethod::Fkm),
        with(Streaming {
            gate: true,
            ..nothing
        }),
        with(Streaming {
            forget: count(4000),
            ..nothing
        }),
        with(Streaming {
            held_out: count(7),
            ..nothing
        }),
    ] {
        let reports = both(&robot(), &path, options);
        // All rows are in both fits, in the same order: they differ by rounding.
        assert!(apart(&reports) < 1e-6, "{options:?}: {}", apart(&reports));
        let [in_memory, on_disk] = reports;
        for (one, other) in [
            (&in_memory.error_before, &on_disk.error_before),
            (&in_memory.error_after, &on_disk.error_after),
        ] {
            assert!((one.rms / other.rms - 1.0).abs() < 1e-9, "{options:?}");
            assert!((one.max / other.max - 1.0).abs() < 1e-9, "{options:?}");
            assert_eq!(one.max_at_line, other.max_at_line, "{options:?}");
            // Of some 10,000 uniform errors the median is known to about one percent.
            assert!(
                (one.median / other.median - 1.0).abs() < 0.05,
                "{options:?}"
            );
        }
        assert_eq!(in_memory.samples, on_disk.samples);
        assert_eq!(in_memory.distinct_poses, on_disk.distinct_poses);
        let rejected = |report: &CalibrationReport| {
            let gate = report
                .stream
                .as_ref()
                .and_then(|stream| stream.gate.clone());
            gate.map(|gate| (gate.counts, gate.tested_from))
        };
        assert_eq!(rejected(&in_memory), rejected(&on_disk), "{options:?}");
        let sampled = [&in_memory, &on_disk].map(|report| report.sampled.as_ref().unwrap());
        let counted = sampled.map(|all| all.after.counts.iter().sum::<u64>() + all.after.beyond);
        assert_eq!(counted, [u64::from(ROWS); 2]);
        assert_eq!(sampled[0].suspected, sampled[1].suspected, "{options:?}");
    }
}

#[test]
fn a_robust_fit_finds_the_same_wrong_rows_and_the_same_robot() {
    let folder = Folder::new();
    let mut samples = measured();
    // The tracker was moved at line 15,002, and every 50th row before is wrong by itself.
    for (_, point) in &mut samples[15_000..] {
        point[0] += 3.0;
    }
    for (_, point) in samples[..15_000].iter_mut().step_by(50) {
        point[2] -= 1.5;
    }
    folder.write("samples.csv", csv(&samples));
    let options = Options {
        loss: Some(Loss::Tukey),
        ..Options::default()
    };
    let reports = both(&robot(), &folder.path("samples.csv"), options);
    // The scale is that of 2,500 rows, known to some percent, by which no parameter moves noticeably.
    assert!(apart(&reports) < 0.1, "{}", apart(&reports));
    let wrong = 5_500 + 300;
    for report in &reports {
        assert_eq!(report.suspected_count(), wrong);
        let shift = report.shift.as_ref().expect("a shift");
        assert_eq!(
            (shift.line, shift.after, shift.samples),
            (15_002, true, 5_500)
        );
    }
    let shifts = reports
        .each_ref()
        .map(|report| report.shift.as_ref().unwrap().mean[0]);
    assert!((shifts[0] - shifts[1]).abs() < 1e-3, "{shifts:?}");
}

#[test]
fn the_sensors_frame_and_the_target_hold_for_rows_on_disk() {
    let folder = Folder::new();
    let mut samples = measured();
    // Turned by 90° about z, and moved; in the second file a reflector beside the platform point.
    for (_, point) in &mut samples {
        let [x, y, z] = *point;
        *point = [500.0 - y, x - 200.0, z + 1000.0];
    }
    folder.write("sensor.csv", csv(&samples));
    let options = Options {
        frame: Frame::Sensor,
        ..Options::default()
    };
    let reports = both(&robot(), &folder.path("sensor.csv"), options);
    // The frames that the fits begin in are those of all rows and of some.
    assert!(apart(&reports) < 1e-3, "{}", apart(&reports));

    let mut samples = measured();
    for (_, point) in &mut samples {
        point[2] -= 40.0;
    }
    folder.write("target.csv", csv(&samples));
    let target = format!("{NOMINAL}{TOLERANCE}{NOISE}\n[target]\nx_mm = 0\ny_mm = 0\nz_mm = -40\n");
    let robot = RobotFile::read(&InputText::new("robot.toml", &target)).unwrap();
    let reports = both(&robot, &folder.path("target.csv"), Options::default());
    assert!(apart(&reports) < 1e-6, "{}", apart(&reports));
}

#[test]
fn a_long_text_is_read_block_by_block_as_a_short_one_at_once() {
    let folder = Folder::new();
    let rows = csv(&measured());
    let (header, rows) = rows.split_once('\n').unwrap();
    // 17 MB with ends of lines as Windows has them, and letters of two bytes that blocks cut.
    let comment = format!("# {}\r\n", "°äö".repeat(120));
    let mut text = format!("\u{feff}# long\r\n{header}\r\n");
    for row in rows.lines() {
        text.push_str(row);
        text.push_str("\r\n");
        text.push_str(&comment);
    }
    assert!(text.len() > 1 << 24);
    // The same in an encoding of one byte a letter.
    let letters = text.chars().filter(|letter| *letter != '\u{feff}');
    let one_byte: Vec<u8> = letters
        .map(|letter| u8::try_from(u32::from(letter)).unwrap())
        .collect();
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (name, bytes) in [
        ("utf-8.csv", text.into_bytes()),
        (
            "one-byte.csv",
            [one_byte, b"# end without a newline".repeat(400_000)].concat(),
        ),
        ("utf-16.csv", wide),
    ] {
        folder.write(name, bytes);
        let read = |input: InputText| {
            let samples = positions(&input, &robot(), Options::default());
            let mut lines = Vec::new();
            let mut values = Vec::new();
            match &samples.all {
                None => {
                    lines.extend(samples.rows.iter().map(|row| row.line));
                    values.extend(samples.rows.iter().map(|row| row.value));
                }
                Some(all) => all.each(|row| {
                    lines.push(row.line);
                    values.push(row.value);
                }),
            }
            (input.sha256().to_owned(), lines, values)
        };
        let path = folder.path(name);
        let at_once = read(InputText::from_table(&path).unwrap());
        let in_blocks = read(InputText::from_long_table(&path).unwrap());
        assert!(at_once == in_blocks, "{name}");
        let stream = std::fs::File::open(&path).unwrap();
        assert!(
            at_once == read(InputText::from_long_reader(name, stream).unwrap()),
            "{name}"
        );
        assert_eq!(at_once.1.last(), Some(&(2 * u64::from(ROWS) + 1)), "{name}");
    }
}

#[test]
fn faults_of_rows_on_disk_have_their_lines() {
    let folder = Folder::new();
    let mut samples = measured();
    samples[20_300].0[1] = 170.0;
    folder.write("samples.csv", csv(&samples));
    let input = InputText::from_long_table(&folder.path("samples.csv")).unwrap();
    let error = read_samples(&input, &robot(), Options::default()).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("samples.csv:20302") && text.contains("q2_deg"),
        "{text}"
    );

    // As a plan fills them in: the position is that of the robot of the file, to the last digit.
    let mut samples = measured();
    let robot = robot();
    let (joints, point) = &mut samples[20_400];
    let nominal = robot.robot.forward(&joints.map(f64::to_radians)).unwrap();
    *point = nominal.data.0[0].map(|x| (x * 1e6).round() / 1e6);
    folder.write("samples.csv", csv(&samples));
    let input = InputText::from_long_table(&folder.path("samples.csv")).unwrap();
    let error = read_samples(&input, &robot, Options::default()).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("samples.csv:20402") && text.contains("as planned"),
        "{text}"
    );
}
