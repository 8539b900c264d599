//! Microseconds to calibrate a robot by each method, and one arm: this solver (sines, factor, solve, covariance) beside the
//! `levenberg-marquardt` crate (sines precomputed, no covariance), on the same exact samples from a
//! start error of 1 cm and 1°.
//!
//! `solve` alone is the time from the last sample to the outcome.

#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use delta_cal::calibration::{ArmSolver, JointCalibrator};
use delta_cal::samples::{ArmFactor, NominalArm};
use delta_cal::{ArmIndex, Calibrator, Noise, Progress, Robot, Sample, Settings};
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

/// Its sines are computed beforehand.
fn peer(nominal: &Robot<f64>, arm: ArmIndex, samples: &[Sample<f64>]) -> PeerProblem {
    let start = Parameters::from(nominal.arm(arm).parameters());
    let row = |sample: &Sample<f64>| {
        let (sine, cosine) = sample.joints[arm.index()].sin_cos();
        Row {
            x: Vector3::from(sample.position.data.0[0]),
            sine,
            cosine,
            weight: 1.0,
        }
    };
    PeerProblem {
        rows: samples.iter().map(row).collect(),
        prior: Parameters::zeros(),
        nominal: start,
        parameters: start,
    }
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

        let problem = peer(&nominal, ARM, &samples);
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

/// The whole robot by every method, with noise, weights and covariance, from 1 cm and 1°. The peer solves
/// its three arms one after the other, without weights or covariance.
fn methods(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("robot");
    let degree = 1f64.to_radians();
    let noise = Noise::new(0.01, 0.001 * degree).unwrap();
    let settings = Settings::default().with_noise(noise);
    for count in [20, 60, 1000] {
        let mut rng = generator(8, count as u64);
        let nominal = paper_robot();
        let truth = perturbed(&nominal, 10.0, degree, Spread::Uniform, &mut rng);
        let samples = measurements(&truth, count, Some(&noise), &mut rng);
        let joint = |samples: &[Sample<f64>]| {
            let mut calibrator = JointCalibrator::new(&nominal, &settings);
            calibrator.add_many(samples).unwrap();
            calibrator.solve().unwrap().robot
        };
        let ikm = |samples: &[Sample<f64>]| {
            let mut calibrator = Calibrator::new(&nominal, &settings);
            calibrator.add_many(samples).unwrap();
            calibrator.solve().unwrap().robot
        };
        let peers = ArmIndex::ALL.map(|arm| peer(&nominal, arm, &samples));
        // All must have found the robot, or the times mean nothing; no parameter's σ is above 1 mm.
        for found in [joint(&samples), ikm(&samples)] {
            assert!(largest_difference(&found, &truth) < 5.0);
        }
        for (problem, arm) in peers.iter().zip(truth.arms()) {
            assert!((problem.clone().solve().unwrap()[7] - arm.lb()).abs() < 5.0);
        }
        let mut of_robot = |name: &str, method: &dyn Fn(&[Sample<f64>]) -> Robot<f64>| {
            group.bench_with_input(BenchmarkId::new(name, count), &samples, |bench, samples| {
                bench.iter(|| method(black_box(samples)));
            });
        };
        of_robot("joint", &joint);
        of_robot("each arm", &ikm);
        let mut taken_in = JointCalibrator::new(&nominal, &settings);
        taken_in.add_many(&samples).unwrap();
        group.bench_with_input(
            BenchmarkId::new("joint solve", count),
            &taken_in,
            |bench, calibrator| {
                bench.iter(|| black_box(*calibrator).solve().unwrap().robot);
            },
        );
        group.bench_with_input(
            BenchmarkId::new("levenberg-marquardt", count),
            &peers,
            |bench, peers| {
                bench.iter(|| {
                    black_box(peers)
                        .each_ref()
                        .map(|problem| problem.clone().solve().unwrap())
                });
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
