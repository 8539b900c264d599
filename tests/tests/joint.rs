//! The joint calibration: the error of noisy data is at the Cramér–Rao bound of all 24 parameters, for robots of eight
//! geometries.

use delta_cal::calibration::{JointCalibrator, JointOutcome};
use delta_cal::{Noise, Real, Refusal, Robot, Sample, Settings, Tolerance};
use delta_cal_tests::geometries::{bound, geometries, position_jacobian};
use delta_cal_tests::{Spread, generator, measurements, perturbed, to_single};
use nalgebra::{SMatrix, Vector3};

pub(crate) fn joint<T: Real>(
    nominal: &Robot<T>,
    samples: &[Sample<T>],
    settings: &Settings<T>,
) -> Result<JointOutcome<T>, Refusal> {
    let mut calibrator = JointCalibrator::new(nominal, settings);
    calibrator.add_many(samples).unwrap();
    calibrator.calibrate()
}

/// Where the position is compared.
pub(crate) const PLACES: usize = 10;

fn isotropic() -> Noise<f64> {
    Noise::new(0.02, 0.002f64.to_radians()).unwrap()
}

fn tolerance() -> Tolerance<f64> {
    Tolerance::new(0.5, 0.2f64.to_radians()).unwrap()
}

/// Means over robots of squared position errors over their expectation: of the bound, and of the
/// calibration's own covariance. Each robot counts alike, however well its poses determine it.
#[derive(Debug, Default)]
pub(crate) struct Ratios {
    squares: [f64; 2],
    /// Of the first, for the error of its mean.
    fourth: f64,
    pub(crate) robots: f64,
    pub(crate) refused: u32,
}

impl Ratios {
    pub(crate) fn add(&mut self, [of_bound, of_reported]: [f64; 2]) {
        self.squares[0] += of_bound;
        self.squares[1] += of_reported;
        self.fourth += of_bound * of_bound;
        self.robots += 1.0;
    }

    fn merge(&mut self, other: &Self) {
        for (sum, value) in self.squares.iter_mut().zip(other.squares) {
            *sum += value;
        }
        self.fourth += other.fourth;
        self.robots += other.robots;
        self.refused += other.refused;
    }

    /// Error over bound, achieved over reported.
    pub(crate) fn roots(&self) -> [f64; 2] {
        self.squares.map(|sum| (sum / self.robots).sqrt())
    }

    /// One σ of the first root, by chance of the robots drawn.
    fn uncertainty(&self) -> f64 {
        let mean = self.squares[0] / self.robots;
        let variance = self.fourth / self.robots - mean * mean;
        (variance / self.robots).sqrt() / (2.0 * mean.sqrt())
    }
}

/// One robot's squared position error over the two expectations; `None` if it was refused or nothing is
/// known of it.
pub(crate) fn ratios(
    truth: &Robot<f64>,
    found: &Robot<f64>,
    covariances: [&SMatrix<f64, 24, 24>; 2],
    places: &[Sample<f64>],
) -> Option<[f64; 2]> {
    let mut error = 0.0;
    let mut expected = [0.0; 2];
    for place in places {
        let position: Vector3<f64> = found.forward(&place.joints).ok()?;
        let jacobian = position_jacobian(truth, &place.joints)?;
        error += (position - place.position).norm_squared();
        for (sum, covariance) in expected.iter_mut().zip(covariances) {
            *sum += (jacobian * covariance * jacobian.transpose()).trace();
        }
    }
    Some(expected.map(|expected| error / expected))
}

/// Poses of a robot clear of singularities, where the position is a linear function of small errors.
fn places(truth: &Robot<f64>, rng: &mut rand_pcg::Pcg32) -> Vec<Sample<f64>> {
    let mut places = Vec::new();
    while places.len() < PLACES {
        let [sample] = measurements(truth, 1, None, rng).try_into().unwrap();
        let distance = truth.singularity_distance(&sample.position, &sample.joints);
        if distance.is_clear() {
            places.push(sample);
        }
    }
    places
}

fn campaign(
    index: u64,
    nominal: &Robot<f64>,
    poses: usize,
    stated: Option<Tolerance<f64>>,
    noise: &Noise<f64>,
    robots: u64,
) -> Ratios {
    let settings = Settings::default()
        .with_noise(*noise)
        .with_tolerance(stated);
    let mut all = Ratios::default();
    for robot in 0..robots {
        let mut rng = generator(1400 + index, robot);
        let truth = perturbed(nominal, 0.5, 0.2f64.to_radians(), Spread::Normal, &mut rng);
        let samples = measurements(&truth, poses, Some(noise), &mut rng);
        let limit = bound(&truth, &samples, noise, stated.as_ref()).expect("enough samples");
        let Ok(outcome) = joint(nominal, &samples, &settings) else {
            all.refused += 1;
            continue;
        };
        let reported = outcome.estimate.covariance.expect("the noise is stated");
        let places = places(&truth, &mut rng);
        if let Some(found) = ratios(&truth, &outcome.robot, [&limit, &reported], &places) {
            all.add(found);
        }
    }
    all
}

/// Every geometry at one number of poses; what is asserted holds for all together, and for each by its
/// uncertainty.
fn at_the_bound(poses: &[usize], stated: Option<Tolerance<f64>>, noise: &Noise<f64>, limit: f64) {
    for poses in poses {
        let mut together = Ratios::default();
        for (index, (name, nominal)) in (0..).zip(geometries()) {
            let found = campaign(index, &nominal, *poses, stated, noise, 25);
            let [error, _] = found.roots();
            let chance = found.uncertainty();
            assert!(error < limit + 3.0 * chance, "{name}, {poses}: {error}");
            together.merge(&found);
        }
        let ([error, reported], chance) = (together.roots(), together.uncertainty());
        println!(
            "all together                   tolerance {:5} {poses:3} poses: error/bound {error:.3} ± \
             {chance:.3}, achieved/reported {reported:.3}, refused {}",
            stated.is_some(),
            together.refused
        );
        assert!(error < limit, "{poses}: {error}");
        assert!((0.9..1.1).contains(&reported), "{poses}: {reported}");
        // No unbiased estimate is below the bound, but by chance of the robots.
        assert!(error > 1.0 - 4.0 * chance, "{poses}: {error}");
        // Of good measurements next to none is refused.
        assert!(f64::from(together.refused) <= 0.05 * together.robots);
    }
}

#[test]
fn twenty_poses_and_more_are_at_the_bound_and_fewer_near_it() {
    at_the_bound(&[20, 60], Some(tolerance()), &isotropic(), 1.05);
    at_the_bound(&[20, 60], None, &isotropic(), 1.05);
    at_the_bound(&[5, 8, 12], Some(tolerance()), &isotropic(), 1.10);
    at_the_bound(&[12], None, &isotropic(), 1.10);
}

/// Distances that are better than heights, as of a camera above the robot.
#[test]
fn a_noise_that_differs_by_axis_is_at_its_own_bound() {
    let noise = Noise::by_axis([0.02, 0.02, 0.1], 0.002f64.to_radians()).unwrap();
    at_the_bound(&[20], Some(tolerance()), &noise, 1.05);
    at_the_bound(&[20], None, &noise, 1.05);
}

/// In single precision the same samples give the same robot, as far as its uncertainty lets one tell.
#[test]
fn single_precision_agrees_with_double() {
    let noise = isotropic();
    let (mut largest, mut worst, mut squares, mut number) = (0.0_f64, 0.0_f64, 0.0, 0.0);
    for (index, (name, nominal)) in (0..).zip(geometries()) {
        for stated in [Some(tolerance()), None] {
            for poses in [20, 60] {
                for robot in 0..10 {
                    let mut rng = generator(1450 + index, robot);
                    let spread = 0.2f64.to_radians();
                    let truth = perturbed(&nominal, 0.5, spread, Spread::Normal, &mut rng);
                    let samples = measurements(&truth, poses, Some(&noise), &mut rng);
                    let single = to_single(&samples);
                    let rounded: Vec<_> = single
                        .iter()
                        .map(|sample| Sample {
                            joints: sample.joints.map(f64::from),
                            position: sample.position.map(f64::from),
                        })
                        .collect();
                    let settings = Settings::default().with_noise(noise).with_tolerance(stated);
                    let narrow = Settings::<f32>::default()
                        .with_noise(Noise::new(0.02, 0.002f32.to_radians()).unwrap())
                        .with_tolerance(
                            stated.map(|_| Tolerance::new(0.5, 0.2f32.to_radians()).unwrap()),
                        );
                    let double = joint(&nominal, &rounded, &settings);
                    let single = joint(&nominal.cast::<f32>().unwrap(), &single, &narrow);
                    let (double, single) = match (double, single) {
                        (Ok(double), Ok(single)) => (double, single),
                        (double, single) => {
                            assert_eq!(double.is_ok(), single.is_ok(), "{name} {robot}");
                            continue;
                        }
                    };
                    let single = single.robot.cast::<f64>().unwrap();
                    for place in places(&truth, &mut rng) {
                        let [one, two] = [&double.robot, &single]
                            .map(|robot| robot.forward(&place.joints).unwrap());
                        let apart = (one - two).norm();
                        let jacobian = position_jacobian(&truth, &place.joints).unwrap();
                        let covariance = double.estimate.covariance.unwrap();
                        let variance = (jacobian * covariance * jacobian.transpose()).trace();
                        largest = largest.max(apart);
                        worst = worst.max(apart / variance.sqrt());
                        squares += apart * apart / variance;
                        number += 1.0;
                    }
                }
            }
        }
    }
    let rms = (squares / number).sqrt();
    println!(
        "single against double precision: at most {:.3} µm, in σ of the position rms {rms:.4}, at most {worst:.3}",
        1e3 * largest
    );
    // A tenth of σ makes an error larger by half a percent, a fiftieth by nothing.
    assert!(worst < 0.1 && rms < 0.02, "{worst} {rms}");
}
