//! Instructions of one call: kinematics, and taking in samples.

use crate::report::Report;
use core::fmt;
use core::hint::black_box;
use delta_cal::{Calibrator, Robot, Sample, Settings};
use delta_cal_target_tests::{Counter, Overflow};
use delta_cal_target_tests::{Scalar, measurements_of, noise, nominal, robot_near};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// Poses of each robot, and samples taken in.
const SAMPLES: usize = 400;
const ROBOTS: u64 = 5;

/// Mean and worst of many counts.
#[derive(Default)]
pub(crate) struct Counts {
    sum: u64,
    number: u32,
    worst: u32,
}

impl Counts {
    pub(crate) fn note(&mut self, count: u32) {
        self.sum += u64::from(count);
        self.number += 1;
        self.worst = self.worst.max(count);
    }

    pub(crate) fn mean(&self) -> u32 {
        let mean = self.sum / u64::from(self.number.max(1));
        u32::try_from(mean).unwrap_or(u32::MAX)
    }

    pub(crate) fn worst(&self) -> u32 {
        self.worst
    }
}

#[derive(Default)]
struct Figures {
    forward: Counts,
    inverse: Counts,
    add: Counts,
    worst_mean_add: u32,
    at_once: Counts,
    sine_cosine: Counts,
}

/// Kinematics and samples, over several random robots.
#[inline(never)]
pub(crate) fn report<T: Scalar>(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    let mut figures = Figures::default();
    for seed in 0..ROBOTS {
        let mut rng = Pcg32::seed_from_u64(seed);
        let truth = robot_near(&nominal::<T>(), 1.0, &mut rng);
        let samples: [Sample<T>; SAMPLES] = measurements_of(&truth, Some(&noise()), &mut rng);
        measure(counter, &mut figures, &truth, &samples).map_err(|Overflow| fmt::Error)?;
    }

    let name = T::NAME;
    let mut line = |item: &str, count: u32, words: &str| {
        out.instructions(format_args!("{name}/{item}"), count, words)
    };
    line(
        "add-mean",
        figures.worst_mean_add,
        "one sample taken in, three arms, mean",
    )?;
    line(
        "add-longest",
        figures.add.worst(),
        "one sample taken in, three arms, longest",
    )?;
    line(
        "add-many",
        figures.at_once.worst(),
        "one sample of many taken in at once, three arms",
    )?;
    line(
        "forward",
        figures.forward.worst(),
        "forward kinematics, worst",
    )?;
    line(
        "forward-mean",
        figures.forward.mean(),
        "forward kinematics, mean",
    )?;
    line(
        "inverse",
        figures.inverse.worst(),
        "inverse kinematics, worst",
    )?;
    line(
        "inverse-mean",
        figures.inverse.mean(),
        "inverse kinematics, mean",
    )?;
    line(
        "sine-cosine",
        figures.sine_cosine.worst(),
        "sine and cosine, worst",
    )
}

fn measure<T: Scalar>(
    counter: &mut Counter,
    figures: &mut Figures,
    truth: &Robot<T>,
    samples: &[Sample<T>],
) -> Result<(), Overflow> {
    let settings = Settings::default().with_noise(noise());
    let mut calibrator = Calibrator::new(&nominal::<T>(), &settings);
    let mut add = Counts::default();
    for sample in samples {
        figures.forward.note(counter.count(|| {
            let _ = black_box(truth.forward(black_box(&sample.joints)));
        })?);
        figures.inverse.note(counter.count(|| {
            let _ = black_box(truth.inverse(black_box(&sample.position)));
        })?);
        let [q, ..] = sample.joints;
        figures.sine_cosine.note(counter.count(|| {
            black_box(black_box(q).sine_cosine());
        })?);
        let count = counter.count(|| {
            let _ = black_box(calibrator.add(black_box(sample)));
        })?;
        add.note(count);
        figures.add.note(count);
    }
    figures.worst_mean_add = figures.worst_mean_add.max(add.mean());

    let (some, _) = samples.split_at(40);
    let many = u32::try_from(some.len()).unwrap_or(u32::MAX);
    let at_once = counter.count(|| {
        let _ = black_box(calibrator.add_many(black_box(some)));
    })?;
    figures.at_once.note(at_once / many);
    Ok(())
}
