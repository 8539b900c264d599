//! Whether what a validation states with 95 % confidence is so: robots of eight proportions, made with errors, and
//! files of measurements with noise.

mod expanded;
mod robots;

use delta_cal::Robot;
use delta_cal::simulate::simulate_sample;
use delta_cal_host::Frame;
use delta_cal_host::validation::{self, Request, Validation, Verdict};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{generator, uniform};
use robots::{Made, intrinsic, largest, made, noise, position_error, robot_file, samples_file};

/// Robots are made with these parts of the tolerance: errors far below the noise, like it, and far above.
const FACTORS: [f64; 3] = [0.02, 0.1, 1.0];
const ROWS: [usize; 4] = [10, 20, 40, 100];

#[derive(Debug, Default, Clone, Copy)]
struct Counts {
    files: u32,
    /// The true rms error is within the interval, below it, above it.
    within: u32,
    below: u32,
    above: u32,
    /// The true largest error is within its interval.
    largest: u32,
    /// Of robots whose error is the limit: passed although it is not below, failed although it is not above.
    passed: u32,
    failed: u32,
}

impl Counts {
    fn add(&mut self, robot: &Made, frame: Frame, limit: f64, found: &Validation) {
        let upper = found.rms.upper.unwrap();
        self.files += 1;
        self.below += u32::from(limit < found.rms.lower);
        self.above += u32::from(limit > upper);
        self.within += u32::from((found.rms.lower..=upper).contains(&limit));
        self.passed += u32::from(found.verdict == Verdict::Pass);
        self.failed += u32::from(found.verdict == Verdict::Fail);
        // Without an upper limit where the noise was taken to be stated too large.
        let worst = largest(robot, frame);
        let holds =
            found.largest.lower <= worst && found.largest.upper.is_none_or(|upper| worst <= upper);
        self.largest += u32::from(holds);
    }

    fn plus(self, other: Self) -> Self {
        Self {
            files: self.files + other.files,
            within: self.within + other.within,
            below: self.below + other.below,
            above: self.above + other.above,
            largest: self.largest + other.largest,
            passed: self.passed + other.passed,
            failed: self.failed + other.failed,
        }
    }

    fn percent(&self, of: u32) -> f64 {
        100.0 * f64::from(of) / f64::from(self.files)
    }
}

/// Files of `rows` poses of robots of all proportions in turn.
fn campaign(frame: Frame, rows: usize, factor: f64, files: u64) -> Counts {
    let geometries = geometries();
    let mut counts = Counts::default();
    for number in 0..files {
        let index = usize::try_from(number).unwrap() % geometries.len();
        let (_, nominal): &(_, Robot<f64>) = &geometries[index];
        let mut rng = generator(173, number);
        let robot = made(nominal, factor, rows, &mut rng);
        let truth = match frame {
            Frame::Base => position_error(&robot, &mut rng),
            Frame::Sensor => intrinsic(&robot, &mut rng),
        };
        let request = Request {
            limit: truth,
            frame,
        };
        let found = validate(&robot_file(nominal), &samples_file(&robot, frame), request);
        counts.add(&robot, frame, truth, &found.unwrap());
    }
    counts
}

/// Near a singularity the joints' noise moves the platform far: such a row is no more wrong than others. A robot as its
/// file says, measured anywhere: one file in a hundred may doubt a row, and four standard deviations of so few. And
/// whichever row deviates most, the largest error is not below the rms.
#[test]
fn a_row_that_is_noise_is_not_called_wrong_nor_the_largest_error() {
    // A platform larger than the base: many poses are near a singularity.
    let nominal = &geometries()[3].1;
    let files = 400_u32;
    let mut doubted = 0;
    for number in 0..files {
        let mut rng = generator(175, u64::from(number));
        let mut samples = Vec::new();
        while samples.len() < 25 {
            // However near to a singularity.
            let joints = [(); 3].map(|()| (15.0 + 75.0 * uniform(&mut rng)).to_radians());
            samples.extend(simulate_sample(nominal, &joints, Some(&noise()), &mut rng).ok());
        }
        let robot = Made {
            truth: *nominal,
            nominal: *nominal,
            samples,
        };
        let request = Request {
            limit: 1.0,
            frame: Frame::Base,
        };
        let file = samples_file(&robot, Frame::Base);
        let found = validate(&robot_file(nominal), &file, request).unwrap();
        let doubts = |warning: &String| warning.contains("may be a wrong row");
        doubted += u32::from(found.warnings.iter().any(doubts));
        // Rounding of a sum.
        let rms = found.rms.value * (1.0 - 1e-9);
        assert!(
            found.largest.value >= rms,
            "{number}: {:?} {rms}",
            found.largest
        );
        assert!(
            found.largest.value >= found.largest.lower,
            "{number}: {:?}",
            found.largest
        );
    }
    let expected = f64::from(files) * 0.01;
    assert!(
        f64::from(doubted) <= expected + 4.0 * expected.sqrt(),
        "{doubted}"
    );
}

/// The interval of the rms error holds the true one in 93 to 97 % of the files, whatever is measured; a robot
/// exactly at the limit passes in 2.5 %, well below 5 %. Four standard deviations of the number of files are allowed
/// for.
#[test]
fn intervals_hold_the_true_error_as_often_as_they_say() {
    for (frame, name) in [(Frame::Base, "base"), (Frame::Sensor, "sensor")] {
        for rows in ROWS {
            let mut all = Counts::default();
            for factor in FACTORS {
                all = all.plus(campaign(frame, rows, factor, 96));
            }
            println!("{name}, {rows} rows: {all:?}");
            let sigma = 100.0 * (0.05 * 0.95 / f64::from(all.files)).sqrt();
            let within = all.percent(all.within);
            assert!(
                (93.0 - 4.0 * sigma..97.0 + 4.0 * sigma).contains(&within),
                "{all:?}"
            );
            // What either tail has nominally, and four standard deviations.
            let tail = 2.5 + 400.0 * (0.025 * 0.975 / f64::from(all.files)).sqrt();
            assert!(all.percent(all.passed) <= tail, "{all:?}");
            assert!(all.percent(all.failed) <= tail, "{all:?}");
            assert!(all.percent(all.largest) >= 95.0 - 4.0 * sigma, "{all:?}");
        }
    }
}
