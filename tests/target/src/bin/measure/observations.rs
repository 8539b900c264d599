//! The calibration from any readings, in steps: forty heights, distances and single coordinates.

use crate::report::{Report, measured};
use core::fmt;
use core::hint::black_box;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationRow,
    ObservationSolver, Plane, Point, PositionFrame,
};
use delta_cal::{Sample, Settings};
use delta_cal_target_tests::{noise, nominal, stack_of, tolerance};

const ROWS: usize = 40;

type Solver = ObservationSolver<f32, 36, 37, 703>;

/// By turns a height, two coordinates, and a distance.
fn observation(index: usize, sample: &Sample<f32>) -> Observation<f32> {
    let position = sample.position;
    let mut observation = Observation::at(sample.joints);
    match index % 3 {
        0 => {
            let height = position.z + 560.0;
            observation.height = Some(Height { plane: 0, height });
        }
        1 => observation.position = [Some(position.x), None, Some(position.z)],
        _ => {
            let from = DistanceFrom::Point(0);
            let distance = position.norm();
            observation.distance = Some(Distance { from, distance });
        }
    }
    observation
}

/// Apart from the caller, whose frame lies above all others.
#[inline(never)]
pub(crate) fn measure(report: &mut Report<'_>) -> fmt::Result {
    let robot = nominal::<f32>();
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[Plane::default()],
        points: &[Point::default()],
        noise: ObservationNoise::new(noise(), 0.02, 0.02).map_err(|_| fmt::Error)?,
        transmission: None,
    };
    let settings = Settings::default().with_tolerance(tolerance());
    let mut rows = [ObservationRow::new(Observation::at([0.0; 3])); ROWS];
    let mut taken_in = 0;
    for (index, (sample, place)) in measured::<ROWS>(3).iter().zip(&mut rows).enumerate() {
        let observation = observation(index, sample);
        let mut row = None;
        taken_in += report.count(|| {
            row = ObservationRow::checked(black_box(observation), &robot, &instruments).ok();
        })?;
        *place = row.ok_or(fmt::Error)?;
    }
    report.instructions(format_args!("observations-row"), taken_in / 40)?;

    let mut solver = Solver::new();
    let (mut steps, mut total, mut longest) = (0, 0, 0);
    let mut first = None;
    let again = rows;
    let last = loop {
        let mut result = None;
        let step = report.count(|| {
            result = solver.step(&robot, &instruments, &mut rows, black_box(&settings));
        })?;
        total += step;
        steps += 1;
        match result {
            Some(Ok(_)) => break step,
            Some(Err(_)) => return Err(fmt::Error),
            None if first.is_none() => first = Some(step),
            None => longest = longest.max(step),
        }
    };
    report.instructions(format_args!("observations"), total)?;
    report.instructions(format_args!("observations-steps"), steps)?;
    report.instructions(format_args!("observations-begin"), first.unwrap_or(0))?;
    report.instructions(format_args!("observations-step"), longest)?;
    report.instructions(format_args!("observations-end"), last)?;
    report.figure(format_args!("observations-solver"), size_of::<Solver>())?;

    let mut rows = again;
    let mut solver = Solver::new();
    let (mut stack, mut done) = (0, false);
    while !done {
        let used = stack_of(&mut || {
            let result = solver.step(&robot, &instruments, &mut rows, &settings);
            done = black_box(&result).is_some();
        });
        stack = stack.max(used);
    }
    report.figure(format_args!("observations-stack"), stack)
}
