//! One arm beside the `levenberg-marquardt` crate: exact samples, start error 1 cm and 1°.

use crate::instructions::Counts;
use crate::peer_problem::{Parameters, PeerProblem, Row, Solve};
use crate::report::Report;
use crate::solve::solve;
use core::fmt;
use core::hint::black_box;
use delta_cal::robot::{Arm, ParameterKind};
use delta_cal::{Calibrator, Parameter, Robot, Sample, Settings};
use delta_cal_target_tests::{Counter, Overflow};
use delta_cal_target_tests::{measurements_of, nominal};
use nalgebra_of_peer::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

const ROBOTS: u64 = 8;

#[inline(never)]
pub(crate) fn report(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    sized::<20>(out, counter)?;
    sized::<60>(out, counter)?;
    sized::<1000>(out, counter)?;
    peer::<20>(out, counter)?;
    peer::<60>(out, counter)
}

fn overflow(_: Overflow) -> fmt::Error {
    fmt::Error
}

/// Every parameter evenly within 10 mm and 1°.
fn start_error(nominal: &Robot<f32>, rng: &mut Pcg32) -> Result<Robot<f32>, fmt::Error> {
    let arms = nominal.arms().map(|arm| {
        let mut parameters = Parameter::ROTARY.map(|parameter| arm.get(parameter));
        for (value, parameter) in parameters.iter_mut().zip(Parameter::ROTARY) {
            let bound = match parameter.kind() {
                ParameterKind::Length => 10.0,
                ParameterKind::Angle | ParameterKind::Ratio => 1_f32.to_radians(),
            };
            let fraction = f32::from(rng.next_u32().to_le_bytes()[3]) / 127.5 - 1.0;
            *value += bound * fraction;
        }
        Arm::new(parameters)
    });
    let [Ok(first), Ok(second), Ok(third)] = arms else {
        return Err(fmt::Error);
    };
    Robot::new([first, second, third]).map_err(|_| fmt::Error)
}

fn problem<const N: usize>(seed: u64) -> Result<(Robot<f32>, [Sample<f32>; N]), fmt::Error> {
    let mut rng = Pcg32::seed_from_u64(seed);
    let truth = start_error(&nominal(), &mut rng)?;
    let samples = measurements_of(&truth, None, &mut rng);
    Ok((truth, samples))
}

/// This solver: a third of what the robot's three arms cost.
#[inline(never)]
fn sized<const N: usize>(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    let (mut last, mut total) = (Counts::default(), Counts::default());
    for seed in 0..ROBOTS {
        let (truth, samples) = problem::<N>(seed)?;
        let mut calibrator = Calibrator::new(&nominal(), &Settings::default());
        let mut taking_in = 0;
        // Piece by piece: where the compiler saves space, all of them are more than the counter holds.
        for piece in samples.chunks(100) {
            taking_in += counter
                .count(|| {
                    for sample in piece {
                        let _ = black_box(calibrator.add(black_box(sample)));
                    }
                })
                .map_err(overflow)?;
        }
        let (cost, outcome) = solve(counter, &mut calibrator).map_err(overflow)?;
        let robot = outcome.map_err(|_| fmt::Error)?.robot;
        for (found, arm) in robot.arms().iter().zip(truth.arms()) {
            close(found.parameters().as_slice(), arm.parameters().as_slice())?;
        }
        last.note(cost.total / 3);
        total.note((taking_in + cost.total) / 3);
    }
    out.instructions(
        format_args!("peer/delta-cal-last-{N}"),
        last.worst(),
        "one arm, exact data, last sample to result, worst",
    )?;
    out.instructions(
        format_args!("peer/delta-cal-total-{N}"),
        total.worst(),
        "one arm, exact data, samples taken in included, worst",
    )
}

/// The crate: the whole solve follows the last sample.
#[inline(never)]
fn peer<const N: usize>(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result
where
    PeerProblem<N>: Solve,
{
    let mut counts = Counts::default();
    let mut least = u32::MAX;
    for seed in 0..ROBOTS {
        let (truth, samples) = problem::<N>(seed)?;
        for (index, (before, arm)) in nominal::<f32>().arms().iter().zip(truth.arms()).enumerate() {
            let rows = samples.map(|sample| {
                let q = sample.joints.get(index).copied().unwrap_or(0.0);
                let (sine, cosine) = delta_cal::Real::sine_cosine(q);
                Row {
                    x: Vector3::from(sample.position.data.0[0]),
                    sine,
                    cosine,
                }
            });
            let problem = PeerProblem {
                rows,
                parameters: Parameters::from(before.parameters()),
            };
            let mut solved = None;
            let count = counter
                .count(|| solved = black_box(black_box(problem).solve()))
                .map_err(overflow)?;
            let found = solved.ok_or(fmt::Error)?;
            close(found.as_slice(), arm.parameters().as_slice())?;
            counts.note(count);
            least = least.min(count);
        }
    }
    let mut line = |item: &str, count: u32, words: &str| {
        out.instructions(
            format_args!("peer/levenberg-marquardt{item}-{N}"),
            count,
            words,
        )
    };
    line(
        "",
        counts.mean(),
        "the crate, one arm, the same data, sines precomputed, mean",
    )?;
    line("-least", least, "the same, least")?;
    line("-worst", counts.worst(), "the same, worst")
}

/// Both must have solved the problem, or the counts mean nothing: to 0.1 mm and 0.1 mrad.
fn close(found: &[f32], expected: &[f32]) -> fmt::Result {
    for ((found, expected), parameter) in found.iter().zip(expected).zip(Parameter::ROTARY) {
        let bound = match parameter.kind() {
            ParameterKind::Length | ParameterKind::Ratio => 0.1,
            ParameterKind::Angle => 1e-4,
        };
        if !((found - expected).abs() < bound) {
            return Err(fmt::Error);
        }
    }
    Ok(())
}
