//! Microseconds to calibrate one arm: this solver (sines, factor, solve, covariance) beside the
//! `levenberg-marquardt` crate (sines precomputed, no covariance), on the same exact samples from a
//! start error of 1 cm and 1°.
//!
//! `solve` alone is the time from the last sample to the outcome.

#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use delta_cal::calibration::ArmSolver;
use delta_cal::samples::{ArmFactor, NominalArm};
use delta_cal::{ArmIndex, Calibrator, Noise, Progress, Sample, Settings};
use delta_cal_host::fit::fkm;
use delta_cal_tests::peer::{Parameters, PeerProblem, Row};
use delta_cal_tests::{
    Spread, generator, largest_difference, measurements, paper_robot, perturbed,
};
use nalgebra_of_peer::Vector3;
use std::hint::black_box;

const ARM: ArmIndex = ArmIndex::First;

fn solve(factor: &ArmFactor<f64>) -> f64 {
    let mut solver = ArmSolver::new(factor, ARM, &Settings::default()).unwrap();
    while solver.step(factor) == Progress::Working {}
    solver.outcome(factor).unwrap().arm.lb()
}

fn take_in(reference: &NominalArm<f64>, samples: &[Sample<f64>]) -> ArmFactor<f64> {
    let mut factor = ArmFactor::new(*reference);
    factor
        .add_many(
            samples
                .iter()
                .map(|sample| (&sample.position, sample.joints[0])),
            ARM,
        )
        .unwrap();
    factor
}

fn solvers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one arm");
    for count in [20, 60, 1000] {
        let mut rng = generator(7, count as u64);
        let nominal = paper_robot();
        let truth = perturbed(&nominal, 10.0, 1f64.to_radians(), Spread::Uniform, &mut rng);
        let samples = measurements(&truth, count, None, &mut rng);
        let centre = nominal.forward(&[0.3; 3]).unwrap();
        let reference = NominalArm::new(nominal.arm(ARM), &centre, None);

        group.bench_with_input(
            BenchmarkId::new("delta-cal", count),
            &samples,
            |bench, samples| {
                bench.iter(|| solve(&take_in(&reference, black_box(samples))));
            },
        );
        let factor = take_in(&reference, &samples);
        group.bench_with_input(
            BenchmarkId::new("delta-cal solve", count),
            &factor,
            |bench, factor| {
                bench.iter(|| solve(black_box(factor)));
            },
        );

        let start = Parameters::from(nominal.arm(ARM).parameters());
        let problem = PeerProblem {
            rows: samples
                .iter()
                .map(|sample| Row {
                    x: Vector3::from(sample.position.data.0[0]),
                    sine: sample.joints[0].sin(),
                    cosine: sample.joints[0].cos(),
                    weight: 1.0,
                })
                .collect(),
            prior: Parameters::zeros(),
            nominal: start,
            parameters: start,
        };
        // Both must have solved the same problem, or the times mean nothing.
        let expected = truth.arm(ARM).lb();
        assert!((solve(&factor) - expected).abs() < 1e-8);
        assert!((problem.clone().solve().unwrap()[7] - expected).abs() < 1e-8);

        group.bench_with_input(
            BenchmarkId::new("levenberg-marquardt", count),
            &problem,
            |bench, problem| {
                bench.iter(|| black_box(problem).clone().solve().unwrap());
            },
        );
    }
    group.finish();
}

/// The whole robot by both methods, with noise, weights and covariance, from 1 cm and 1°.
fn methods(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("robot");
    let degree = 1f64.to_radians();
    let noise = Noise::new(0.01, 0.001 * degree).unwrap();
    let settings = Settings::default().with_noise(noise);
    for count in [20, 60] {
        let mut rng = generator(8, count as u64);
        let nominal = paper_robot();
        let truth = perturbed(&nominal, 10.0, degree, Spread::Uniform, &mut rng);
        let samples = measurements(&truth, count, Some(&noise), &mut rng);
        let ikm = |samples: &[Sample<f64>]| {
            let mut calibrator = Calibrator::new(&nominal, &settings);
            calibrator.add_many(samples).unwrap();
            calibrator.solve().unwrap().robot
        };
        let fkm = |samples: &[Sample<f64>]| {
            let outcome = fkm::calibrate(&nominal, samples, &settings).unwrap();
            outcome.fit.robot
        };
        // Both must have found the robot, or the times mean nothing; no parameter's σ is above 1 mm.
        for found in [ikm(&samples), fkm(&samples)] {
            assert!(largest_difference(&found, &truth) < 5.0);
        }
        group.bench_with_input(
            BenchmarkId::new("IKM", count),
            &samples,
            |bench, samples| {
                bench.iter(|| ikm(black_box(samples)));
            },
        );
        group.bench_with_input(
            BenchmarkId::new("FKM", count),
            &samples,
            |bench, samples| {
                bench.iter(|| fkm(black_box(samples)));
            },
        );
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .warm_up_time(std::time::Duration::from_millis(500))
        .measurement_time(std::time::Duration::from_secs(2));
    targets = solvers, methods
}
criterion_main!(benches);
