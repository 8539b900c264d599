//! The calibration from observations in steps, in single precision: forty heights, distances and single coordinates.

use crate::report::Report;
use core::fmt;
use core::hint::black_box;
use delta_cal::Settings;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationRow,
    ObservationSolver, Plane, Point, PositionFrame,
};
use delta_cal_target_tests::{Counter, noise, nominal, robot_near, stack_of, tolerance};
use delta_cal_target_tests::{Overflow, measurements_of};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

const ROWS: usize = 40;

type Solver = ObservationSolver<f32, 36, 37, 703>;

fn overflow(_: Overflow) -> fmt::Error {
    fmt::Error
}

pub(crate) fn report(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    let mut rng = Pcg32::seed_from_u64(3);
    let robot = nominal::<f32>();
    let truth = robot_near::<f32>(&robot, 0.5, &mut rng);
    let samples = measurements_of::<f32, ROWS>(&truth, Some(&noise()), &mut rng);
    let sigma = 0.02;
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[Plane::default()],
        points: &[Point::default()],
        noise: ObservationNoise::new(noise(), sigma, sigma).map_err(|_| fmt::Error)?,
        transmission: None,
    };
    let settings = Settings::default().with_tolerance(tolerance());
    let mut rows = [None; ROWS];
    let (mut all, mut longest) = (0, 0);
    for (index, (sample, place)) in samples.iter().zip(&mut rows).enumerate() {
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
        let row = counter.count(|| {
            *place = ObservationRow::checked(black_box(observation), &robot, &instruments).ok();
        });
        let row = row.map_err(overflow)?;
        all += row;
        longest = longest.max(row);
    }
    let item = "f32/observations-row";
    let words = "one observation taken in, mean";
    out.instructions(format_args!("{item}"), all / 40, words)?;
    let words = "one observation taken in, longest";
    out.instructions(format_args!("{item}-longest"), longest, words)?;

    let mut rows = rows.map(|row| row.unwrap_or(ObservationRow::new(Observation::at([0.0; 3]))));
    let stack_rows = rows;
    let mut solver = Solver::new();
    let (mut first, mut total, mut longest) = (0, 0, 0);
    let mut steps = 0_u32;
    let (solved, last) = loop {
        let mut result = None;
        let step = counter.count(|| {
            result = solver.step(&robot, &instruments, &mut rows, black_box(&settings));
        });
        let step = step.map_err(overflow)?;
        if steps == 0 {
            first = step;
        } else if result.is_none() {
            longest = longest.max(step);
        }
        steps += 1;
        total += step;
        if let Some(result) = result {
            break (result.is_ok(), step);
        }
    };
    let refused = if solved { "" } else { ", which is refused" };
    writeln!(out.console, "f32/observations: {steps} steps{refused}")?;
    let item = "f32/observations";
    let words = "from 40 observations to parameters and covariance";
    out.instructions(format_args!("{item}"), total, words)?;
    let words = "its first step, which looks where the instruments are";
    out.instructions(format_args!("{item}-begin"), first, words)?;
    let words = "the longest of its steps between";
    out.instructions(format_args!("{item}-step"), longest, words)?;
    let words = "its last step, with the outcome";
    out.instructions(format_args!("{item}-end"), last, words)?;

    let mut rows = stack_rows;
    let mut solver = Solver::new();
    let mut stack = 0;
    let mut done = false;
    while !done {
        let used = stack_of(&mut || {
            let result = solver.step(&robot, &instruments, &mut rows, &settings);
            done = black_box(&result).is_some();
        });
        stack = stack.max(used);
    }
    let words = "stack of a step, rows and solver in statics";
    out.line(format_args!("{item}-stack"), stack, "bytes", words)?;
    let words = "state of a solver of observations with 12 unknowns";
    out.line(
        format_args!("{item}-solver"),
        size_of::<Solver>(),
        "bytes",
        words,
    )?;
    let words = "an observation that is kept";
    let size = size_of::<ObservationRow<f32>>();
    out.line(format_args!("{item}-kept"), size, "bytes", words)
}
