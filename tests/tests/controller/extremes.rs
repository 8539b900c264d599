//! Numbers as no robot has them, in every field of `Begin` and `Sample`.

use crate::controller::driver::{Driver, Flash, message, samples};
use delta_cal::Sample;
use delta_cal::stream::Estimator;
use delta_cal_firmware_example::Number;
use delta_cal_protocol::{Begin, Fault, Geometry, Phase, Request, Response};
use delta_cal_tests::generator;
use nalgebra::Vector3;
use rand_core::Rng;

/// As a driver may send them: zeros, denormal, tiny, usual, huge, infinite and no numbers.
const VALUES: [f64; 20] = [
    0.0,
    -0.0,
    1e-45,
    1e-40,
    1e-38,
    1e-30,
    1e-20,
    1e-10,
    1e-5,
    0.02,
    0.5,
    3.0,
    1e3,
    1e6,
    1e10,
    1e20,
    3e38,
    1e308,
    f64::INFINITY,
    f64::NAN,
];

fn sessions_of_extreme_numbers<T: Number>(sessions: u32) {
    let mut rng = generator(0x0e47_e3e5, 1);
    let mut pick = move || VALUES[rng.next_u32() as usize % VALUES.len()];
    let mut rng = generator(0x0e47_e3e5, 2);
    let mut driver = Driver::<T, _>::start(Flash::new());
    let (mut solved, mut refused, mut faults) = (0, 0, 0);
    for session in 1..=sessions {
        driver.sequence = 0;
        let pair = |a: f64, b: f64| Some((T::from_f64(a), T::from_f64(b)));
        let kind = rng.next_u32();
        let begin = Begin {
            session,
            tolerance: kind
                .is_multiple_of(2)
                .then(|| pair(pick(), pick()))
                .flatten(),
            noise: (kind / 2)
                .is_multiple_of(4)
                .then(|| pair(pick(), pick()))
                .flatten()
                .map(|(position, joint)| ([position; 3], joint)),
            estimator: if (kind / 256).is_multiple_of(2) {
                Estimator::Arms
            } else {
                Estimator::Joint
            },
            gate: (kind / 512).is_multiple_of(4),
            forgetting: (kind / 2048).is_multiple_of(4).then(|| T::from_f64(pick())),
        };
        match driver.ask(&Request::Begin(begin)) {
            Response::Taken { next: 0, .. } => {}
            Response::Fault(Fault::Settings) => continue,
            other => panic!("{other:?}"),
        }
        let mut taken = 0;
        for sample in samples::<T>(u64::from(session), 30) {
            let mut sample: Sample<T> = sample;
            if (kind / 32).is_multiple_of(4) {
                let place = rng.next_u32() as usize % 6;
                let value = T::from_f64(pick());
                if place < 3 {
                    sample.joints[place] = value;
                } else {
                    sample.position[place - 3] = value;
                }
            } else if kind / 32 % 4 == 1 {
                sample.position = Vector3::repeat(T::from_f64(1e5));
            }
            match driver.ask(&message(session, taken, &sample)) {
                Response::Taken { next, .. } => taken = next,
                Response::Fault(Fault::Sample(_)) => faults += 1,
                // The gate's estimate is solved first; the sample is left out.
                Response::Fault(Fault::Busy) => driver.rest(),
                other => panic!("{other:?}"),
            }
        }
        driver.solve(session, taken);
        let mut steps = 0;
        while driver.controller.idle() {
            steps += 1;
            // 50 linearisations for each of 10 starts, 20 balances, an arm; of all arms together, in nine steps and
            // a few for trial and chord steps and their covariance.
            assert!(steps < 14 * 50 * 40, "{begin:?}: no end");
        }
        match driver.status().phase {
            Phase::CalibrationRefused { .. } => refused += 1,
            Phase::Solved { fingerprint, .. } => {
                solved += 1;
                let answer = driver.apply(session, fingerprint);
                let Response::Parameters(parameters) = answer else {
                    panic!("{begin:?}: {answer:?}")
                };
                for value in parameters.geometry.arms.as_flattened() {
                    assert!(value.finite(), "{begin:?}: {parameters:?}");
                }
                let current = driver.controller.current();
                assert_eq!(Geometry::of(&current.robot), parameters.geometry);
            }
            phase => panic!("{phase:?}"),
        }
    }
    println!("{solved} solved, {refused} refused, {faults} samples refused");
    assert!(solved > 10 && refused > 10 && faults > 10);
    // What was applied last is there after a restart.
    let current = driver.controller.current();
    let mut flash = driver.into_flash();
    let driver = Driver::<T, _>::start(&mut flash);
    assert_eq!(driver.controller.current(), current);
}

#[test]
fn extreme_numbers_end_in_a_result_or_a_refusal() {
    sessions_of_extreme_numbers::<f32>(3000);
    sessions_of_extreme_numbers::<f64>(1000);
}
