//! Robots, samples and instruments that the unit tests share.

#![allow(clippy::unwrap_used)]

use crate::observations::{Instruments, ObservationNoise, Plane, Point};
use crate::robot::{Arm, Robot, SymmetricRobot};
use crate::samples::{JointFactor, Noise, Sample, Triangle, Unknowns};
use nalgebra::{SMatrix, SVector, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Three different arms, one with a tilted axis.
pub(crate) fn robot() -> Robot<f64> {
    Robot::new([
        Arm::new([164.0, 3.0, -5.0, 0.02, 0.0, 260.0, 4.0, 480.0]).unwrap(),
        Arm::new([-80.0, 140.0, 2.0, 2.1, 0.2, 240.0, -6.0, 500.0]).unwrap(),
        Arm::new([-85.0, -142.0, 0.0, 4.2, -0.1, 275.0, 0.0, 470.0]).unwrap(),
    ])
    .unwrap()
}

/// The robot with every parameter changed by up to half a millimetre or two thousandths of a radian.
pub(crate) fn changed(seed: u64) -> Robot<f64> {
    let mut uniform = uniform(seed);
    let parameters = robot().parameters().map(|mut arm| {
        for (index, value) in arm.iter_mut().enumerate() {
            let spread = if matches!(index, 3 | 4) { 0.002 } else { 0.5 };
            *value += spread * uniform();
        }
        arm
    });
    Robot::from_parameters(parameters).unwrap()
}

/// Measurements of a robot with errors of up to 0.05 mm.
pub(crate) fn samples<const N: usize>(of: &Robot<f64>, seed: u64) -> [Sample<f64>; N] {
    let mut uniform = uniform(seed);
    [(); N].map(|()| {
        let joints = [(); 3].map(|()| 0.25 + 0.7 * uniform());
        let error = Vector3::new(uniform(), uniform(), uniform()) * 0.05;
        let position = of.forward(&joints).unwrap() + error;
        Sample { joints, position }
    })
}

/// Uniform in (−1, 1).
pub(crate) fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut rng = Pcg32::seed_from_u64(seed);
    move || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0
}

/// None, isotropic and by axis, without and with joint noise.
pub(crate) fn noises() -> [Option<Noise<f64>>; 4] {
    [
        None,
        Noise::new(0.02, 0.0).ok(),
        Noise::new(0.02, 4e-5).ok(),
        Noise::by_axis([0.02, 0.02, 0.1], 4e-5).ok(),
    ]
}

/// The paper's robot, mm.
pub(crate) fn paper() -> Robot<f64> {
    SymmetricRobot::PAPER.robot().unwrap()
}

/// The same with other forearms.
pub(crate) fn with_forearms(forearm: f64) -> Robot<f64> {
    let robot = SymmetricRobot {
        forearm,
        ..SymmetricRobot::PAPER
    };
    robot.robot().unwrap()
}

/// Joint angles in the workspace, different for every index.
pub(crate) fn joints(index: usize) -> [f64; 3] {
    #[allow(clippy::cast_precision_loss)]
    let t = index as f64;
    [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()]
}

/// An exact measurement at those joint angles.
pub(crate) fn sample(of: &Robot<f64>, index: usize) -> Sample<f64> {
    let joints = joints(index);
    let position = of.forward(&joints).unwrap();
    Sample { joints, position }
}

pub(crate) fn instruments<'a>(
    planes: &'a [Plane<f64>],
    points: &'a [Point<f64>],
) -> Instruments<'a, f64> {
    let noise = ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.05);
    Instruments {
        planes,
        points,
        ..Instruments::new(noise.unwrap())
    }
}

pub(crate) fn empty(noise: Option<Noise<f64>>) -> JointFactor<f64> {
    JointFactor::new(&robot(), &Vector3::new(0.0, 0.0, -450.0), noise)
}

pub(crate) fn filled(noise: Option<Noise<f64>>, samples: &[Sample<f64>]) -> JointFactor<f64> {
    let mut factor = empty(noise);
    for sample in samples {
        factor.absorb_one(&factor.prepare(sample));
    }
    factor
}

/// A random linearised problem J δ + r of twenty rows whose columns differ in length, and its triangle.
pub(crate) fn linearized(seed: u64) -> (SMatrix<f64, 20, 8>, SVector<f64, 20>, Triangle<f64, 8>) {
    let mut uniform = uniform(seed);
    let lengths = [1.0, 3.0, 0.1, 2.0, 0.5, 7.0, 1.5, 0.2];
    let jacobian = SMatrix::<f64, 20, 8>::from_fn(|_, column| uniform() * lengths[column]);
    let residual = SVector::<f64, 20>::from([(); 20].map(|()| 0.01 * uniform()));
    let mut normal = Triangle::<f64, 8>::zero();
    for (row, right) in jacobian.row_iter().zip(&residual) {
        let mut block = [[0.0]; 9];
        for (column, value) in block.iter_mut().zip(row.iter().chain([right])) {
            *column = [*value];
        }
        normal.absorb(&mut block);
    }
    (jacobian, residual, normal)
}

/// RᵀR, M = N + 1 rows.
pub(crate) fn gram<const N: usize, const M: usize>(r: &Triangle<f64, N>) -> SMatrix<f64, M, M>
where
    f64: Unknowns<N>,
{
    let mut gram = SMatrix::zeros();
    for (index, row) in r.rows().enumerate() {
        for (i, a) in row.iter().enumerate() {
            for (j, b) in row.iter().enumerate() {
                gram[(index + i, index + j)] += a * b;
            }
        }
    }
    gram
}

/// Checks that sums of products agree to a fraction `close` of the product of their columns' lengths.
pub(crate) fn assert_close<const N: usize>(
    a: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, N>,
    close: f64,
) {
    for row in 0..N {
        for column in 0..N {
            let unit = (b[(row, row)] * b[(column, column)]).max(f64::MIN_POSITIVE);
            let off = (a[(row, column)] - b[(row, column)]).abs();
            assert!(off < close * libm::sqrt(unit), "{row} {column} {off:e}");
        }
    }
}
