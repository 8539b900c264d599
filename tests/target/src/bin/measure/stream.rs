//! What it costs to test each sample before it is taken in, to hold samples out, and to forget.

use crate::instructions::Counts;
use crate::report::Report;
use core::fmt;
use core::hint::black_box;
use delta_cal::stream::{Forgetting, Gate, HeldOut};
use delta_cal::{Calibrator, Sample, Settings};
use delta_cal_target_tests::{Counter, Overflow};
use delta_cal_target_tests::{Scalar, measurements_of, noise, nominal, robot_near, tolerance};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

const SAMPLES: usize = 400;
const ROBOTS: u64 = 5;

#[derive(Default)]
struct Figures {
    add: Counts,
    worst_mean: u32,
    forgetting: Counts,
    validation: Counts,
}

/// Gate, held-out samples and forgetting, over several random robots.
#[inline(never)]
pub(crate) fn report<T: Scalar>(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    let mut figures = Figures::default();
    for seed in 0..ROBOTS {
        let mut rng = Pcg32::seed_from_u64(seed);
        let truth = robot_near(&nominal::<T>(), 1.0, &mut rng);
        let samples: [Sample<T>; SAMPLES] = measurements_of(&truth, Some(&noise()), &mut rng);
        measure(counter, &mut figures, &samples).map_err(|Overflow| fmt::Error)?;
    }
    let name = T::NAME;
    let mut line = |item: &str, count: u32, words: &str| {
        out.instructions(format_args!("{name}/{item}"), count, words)
    };
    line(
        "gate-mean",
        figures.worst_mean,
        "one sample tested and taken in, three arms, mean",
    )?;
    line(
        "gate-longest",
        figures.add.worst(),
        "one sample tested and taken in, three arms, longest",
    )?;
    line(
        "add-forgetting",
        figures.forgetting.worst(),
        "one sample taken in with forgetting, three arms, longest",
    )?;
    line(
        "validation",
        figures.validation.worst(),
        "a fit against its held-out samples, three arms, longest",
    )?;
    let mut size = |item: &str, bytes: usize, words: &str| {
        out.line(format_args!("{name}/{item}"), bytes, "bytes", words)
    };
    size("gate", size_of::<Gate<T>>(), "state of a gate")?;
    size(
        "held-out",
        size_of::<HeldOut<T>>(),
        "state of the held-out samples: the second factors",
    )
}

fn measure<T: Scalar>(
    counter: &mut Counter,
    figures: &mut Figures,
    samples: &[Sample<T>],
) -> Result<(), Overflow> {
    let settings = Settings::default()
        .with_noise(noise())
        .with_tolerance(tolerance());
    let empty = Calibrator::new(&nominal::<T>(), &settings);
    let mut calibrator = empty;
    let mut gate = Gate::new(&mut calibrator);
    let mut add = Counts::default();
    for sample in samples {
        let count = counter.count(|| {
            let _ = black_box(gate.add(black_box(&mut calibrator), black_box(sample)));
        })?;
        add.note(count);
        figures.add.note(count);
    }
    figures.worst_mean = figures.worst_mean.max(add.mean());

    let Ok(memory) = Forgetting::new(T::from_f64(50.0)) else {
        return Ok(());
    };
    calibrator = empty;
    for sample in samples {
        figures.forgetting.note(counter.count(|| {
            let _ = black_box(calibrator.add_forgetting(black_box(sample), &memory));
        })?);
    }

    calibrator = empty;
    let Ok(mut held_out) = HeldOut::new(&calibrator, 4) else {
        return Ok(());
    };
    for sample in samples {
        let _ = held_out.add(&mut calibrator, sample);
    }
    if let Ok(fitted) = calibrator.solve() {
        figures.validation.note(counter.count(|| {
            let _ = black_box(held_out.validate(&mut calibrator, black_box(&fitted)));
        })?);
    }
    Ok(())
}
