//! The calibration from any readings, in steps: forty heights, distances and single coordinates.

use crate::report::{Counts, Report, measured, stated};
use core::fmt;
use core::hint::black_box;
use delta_cal::observations::{
    Distance, DistanceFrom, FkmCalibrator, Height, Instruments, Observation, ObservationNoise,
    Plane, Point,
};
use delta_cal::{Progress, Sample, Settings};
use delta_cal_target_tests::{noise, nominal, stack_of, tolerance};

const ROWS: usize = 40;

type Calibrator = FkmCalibrator<f32, ROWS, 36>;

/// By turns a height, two or all coordinates, and a distance.
fn observation(index: usize, sample: &Sample<f32>, whole: bool) -> Observation<f32> {
    let position = sample.position;
    let mut observation = Observation::at(sample.joints);
    match index % 3 {
        0 => {
            let height = position.z + 560.0;
            observation.height = Some(Height { plane: 0, height });
        }
        1 => {
            let y = whole.then_some(position.y);
            observation.position = [Some(position.x), y, Some(position.z)];
        }
        _ => {
            let from = DistanceFrom::Point(0);
            let distance = position.norm();
            observation.distance = Some(Distance { from, distance });
        }
    }
    observation
}

fn instruments(sensor_frame: bool) -> Result<Instruments<'static, f32>, fmt::Error> {
    let noise = ObservationNoise::new(noise(), 0.02, 0.02).map_err(|_| fmt::Error)?;
    Ok(Instruments {
        sensor_frame,
        planes: &[Plane {
            known: None,
            level: None,
        }],
        points: &[Point {
            known: None,
            offset: false,
        }],
        ..Instruments::new(noise)
    })
}

/// In the robot's frame, and in a sensor's, with all coordinates and with two.
pub(crate) fn measure(report: &mut Report<'_>) -> fmt::Result {
    measure_in(report, "", false, false)?;
    measure_in(report, "-sensor", true, true)?;
    measure_in(report, "-sensor-two", true, false)?;
    any(report)
}

/// The longest step with few readings and with many, with a tolerance and without, refused solves included.
#[inline(never)]
fn any(report: &mut Report<'_>) -> fmt::Result {
    let mut steps = Counts::default();
    for rows in [3, 12, 25, ROWS] {
        for (seed, settings) in (0..).zip(stated()) {
            let settings = settings.with_free_start(rows % 2 == 1);
            let calibrator = Calibrator::new(&nominal(), &instruments(false)?, &settings);
            let mut calibrator = calibrator.map_err(|_| fmt::Error)?;
            for (index, sample) in measured::<ROWS>(seed).iter().enumerate().take(rows) {
                let observation = observation(index, sample, true);
                calibrator.add(&observation).map_err(|_| fmt::Error)?;
            }
            let mut progress = match calibrator.solve() {
                Ok(()) => Progress::Working,
                Err(_) => Progress::Finished,
            };
            while progress == Progress::Working {
                steps.note(report.count(|| progress = black_box(&mut calibrator).step())?);
            }
        }
    }
    report.instructions(format_args!("observations-any-step"), steps.worst)
}

/// Apart from the caller, whose frame lies above all others.
#[inline(never)]
fn measure_in(report: &mut Report<'_>, name: &str, sensor_frame: bool, whole: bool) -> fmt::Result {
    let robot = nominal::<f32>();
    let settings = Settings::default().with_tolerance(tolerance());
    let calibrator = Calibrator::new(&robot, &instruments(sensor_frame)?, &settings);
    let mut calibrator = calibrator.map_err(|_| fmt::Error)?;
    let mut taken_in = 0;
    for (index, sample) in measured::<ROWS>(3).iter().enumerate() {
        let observation = observation(index, sample, whole);
        let mut taken = Ok(());
        taken_in += report.count(|| taken = calibrator.add(black_box(&observation)))?;
        taken.map_err(|_| fmt::Error)?;
    }
    report.instructions(format_args!("observations{name}-row"), taken_in / 40)?;

    let (mut steps, mut longest) = (1, 0);
    let mut first = report.count(|| {
        let _ = black_box(calibrator.solve());
    })?;
    let mut total = first;
    let mut progress = Progress::Working;
    while progress == Progress::Working {
        let step = report.count(|| progress = black_box(&mut calibrator).step())?;
        total += step;
        if steps == 1 {
            first += step;
        } else {
            longest = longest.max(step);
        }
        steps += 1;
    }
    calibrator.outcome().map_err(|_| fmt::Error)?;
    report.instructions(format_args!("observations{name}"), total)?;
    report.instructions(format_args!("observations{name}-steps"), steps)?;
    report.instructions(format_args!("observations{name}-begin"), first)?;
    report.instructions(format_args!("observations{name}-step"), longest)?;
    report.figure(
        format_args!("observations{name}-calibrator"),
        size_of::<Calibrator>(),
    )?;

    calibrator.stop();
    let stack = stack_of(&mut || {
        let _ = black_box(calibrator.solve());
        while calibrator.step() == Progress::Working {}
        let _ = black_box(calibrator.outcome());
    });
    report.figure(format_args!("observations{name}-stack"), stack)
}
