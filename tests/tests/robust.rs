//! The core's robust fit: wrong samples do not spoil it, and are named; without any it is worth 95 % of
//! the plain fit.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use delta_cal::{
    Calibrator, Loss, Noise, Robot, RobustOutcome, RobustRefusal, Sample, Settings, WeighedSample,
    robust_fit,
};
use delta_cal_tests::outliers::{Found, Spoilt, Wrong};

fn plain(spoilt: &Spoilt, samples: &[Sample<f64>], settings: &Settings<f64>) -> Option<Robot<f64>> {
    let mut calibrator = Calibrator::new(&spoilt.nominal, settings);
    calibrator.add_many(samples).unwrap();
    calibrator.solve().ok().map(|outcome| outcome.robot)
}

fn robust(
    spoilt: &Spoilt,
    settings: &Settings<f64>,
    loss: Loss,
) -> (
    Result<RobustOutcome<f64>, RobustRefusal>,
    Vec<WeighedSample<f64>>,
) {
    let mut work = vec![WeighedSample::vacant(); spoilt.samples.len()];
    let outcome = robust_fit(&spoilt.nominal, settings, &spoilt.samples, loss, &mut work);
    (outcome, work)
}

#[derive(Debug, Default)]
struct Compared {
    parameters: (f64, f64),
    positions: (f64, f64),
    refused: u32,
    unsettled: u32,
    rounds: u32,
    found: Found,
}

fn campaign(robots: u64, kind: Wrong, loss: Loss, stated: bool) -> Compared {
    let noise = Noise::new(0.02, 0.002f64.to_radians()).unwrap();
    let settings = Settings {
        noise: stated.then_some(noise),
        ..Settings::default()
    };
    let mut compared = Compared::default();
    for robot in 0..robots {
        let spoilt = Spoilt::new(600, robot, 12, kind, &noise);
        let clean = plain(&spoilt, &spoilt.good(), &settings).expect("good samples calibrate");
        let (outcome, work) = robust(&spoilt, &settings, loss);
        let Ok(outcome) = outcome else {
            compared.refused += 1;
            continue;
        };
        let fitted = &outcome.robot.robot;
        compared.parameters.0 += spoilt.parameter_error(fitted);
        compared.parameters.1 += spoilt.parameter_error(&clean);
        compared.positions.0 += spoilt.position_error(fitted, robot);
        compared.positions.1 += spoilt.position_error(&clean, robot);
        compared.unsettled += u32::from(!outcome.settled);
        compared.rounds += u32::from(outcome.rounds);
        compared
            .found
            .add(&spoilt.wrong, work.iter().map(WeighedSample::suspected));
    }
    compared
}

fn ratio((robust, clean): (f64, f64)) -> f64 {
    (robust / clean).sqrt()
}

#[test]
fn twelve_wrong_samples_of_sixty_leave_the_error_within_one_and_a_half_of_the_good_ones() {
    for loss in [Loss::Tukey, Loss::Huber] {
        for stated in [true, false] {
            for kind in Wrong::ALL {
                let compared = campaign(200, kind, loss, stated);
                let (parameters, positions) =
                    (ratio(compared.parameters), ratio(compared.positions));
                println!(
                    "{loss:?}, noise {}, {kind:?}: rms parameter error {parameters:.3} of the clean \
                     fit's, position error {positions:.3}; refused {}, unsettled {}, rounds {:.1}, \
                     recall {:.4}, precision {:.4}",
                    if stated { "stated" } else { "not stated" },
                    compared.refused,
                    compared.unsettled,
                    f64::from(compared.rounds) / 200.0,
                    compared.found.recall(),
                    compared.found.precision(),
                );
            }
        }
    }
}
