use super::robots::{ANGLE, Kind, LENGTH, difference, measured, with_instruments};
use delta_cal::Robot;
use delta_cal::calibration::Settings;
use delta_cal::observations::{
    Instruments, ObservationOutcome, ObservationProblem, ObservationRow,
};
use delta_cal::robot::{Transmission, TransmissionTolerance};
use delta_cal::simulate::{random_pose, standard_normal};
use delta_cal_tests::documents::print_campaign;
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{Spread, generator, paper_limits, perturbed, size};
use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};
use rand_pcg::Pcg32;

/// Unknowns of the robot with its transmissions, and with the instruments of a kind.
const OF_ROBOT: usize = 39;
const N: usize = 55;
/// One σ of the numbers of a transmission, degrees.
const TRANSMISSION: f64 = 0.05;
const KINDS: [Kind; 5] = [
    Kind::Tracker,
    Kind::BetweenPoses,
    Kind::GaugeBlocks,
    Kind::TiltedPlanes,
    Kind::Mixture,
];
/// Poses that the accuracy is judged over.
const JUDGED: usize = 60;

fn calibrated(
    nominal: &Robot<f64>,
    instruments: &Instruments<'_, f64>,
    settings: &Settings<f64>,
    rows: &mut [ObservationRow<f64>],
) -> Option<ObservationOutcome<f64, N>> {
    let problem = ObservationProblem::<f64, N>::prepare(nominal, instruments, rows).ok()?;
    problem.solve::<56, 1596>(settings).ok()
}

fn with_numbers(robot: &Robot<f64>, numbers: [[f64; 5]; 3]) -> Robot<f64> {
    let transmissions = numbers.map(|numbers| Transmission::new(numbers).unwrap());
    robot.with_transmissions(transmissions).unwrap()
}

fn numbers(robot: &Robot<f64>) -> [[f64; 5]; 3] {
    robot.transmissions().map(|own| own.numbers())
}

/// Positions less the rigid motion that explains most of them; errors of many positions in columns.
fn relative(at: &[Vector3<f64>], errors: &DMatrix<f64>) -> DMatrix<f64> {
    let mut motions = DMatrix::zeros(3 * at.len(), 6);
    for (index, position) in at.iter().enumerate() {
        motions
            .view_mut((3 * index, 0), (3, 3))
            .fill_with_identity();
        let turn = -position.cross_matrix();
        motions.view_mut((3 * index, 3), (3, 3)).copy_from(&turn);
    }
    let normal = motions.transpose() * &motions;
    errors - &motions * (normal.try_inverse().unwrap() * motions.transpose() * errors)
}

/// Where a robot is, pose by pose.
fn positions(robot: &Robot<f64>, joints: &[[f64; 3]]) -> Option<DVector<f64>> {
    let there: Option<Vec<_>> = joints.iter().map(|own| robot.forward(own).ok()).collect();
    let there = Matrix3xX::from_columns(&there?);
    Some(DVector::from_column_slice(there.as_slice()))
}

/// The squared error of the relative positions of a robot against the true one.
fn squared_error(robot: &Robot<f64>, truth: &Robot<f64>, joints: &[[f64; 3]]) -> Option<f64> {
    let error = positions(robot, joints)? - positions(truth, joints)?;
    let at: Vec<_> = joints
        .iter()
        .map(|own| truth.forward(own).unwrap())
        .collect();
    let error = DMatrix::from_column_slice(error.len(), 1, error.as_slice());
    Some(relative(&at, &error).norm_squared())
}

/// tr(J C Jᵀ) over the relative positions, J by central differences of the forward kinematics.
fn reported(
    truth: &Robot<f64>,
    joints: &[[f64; 3]],
    outcome: &ObservationOutcome<f64, N>,
) -> Option<f64> {
    let mut jacobian = DMatrix::zeros(3 * joints.len(), OF_ROBOT);
    for index in 0..OF_ROBOT {
        let step = 1e-5;
        let moved = |by: f64| {
            let (mut parameters, mut own) = (truth.parameters(), numbers(truth));
            match own.as_flattened_mut().get_mut(index.wrapping_sub(24)) {
                Some(number) => *number += by,
                None => parameters.as_flattened_mut()[index] += by,
            }
            let robot = Robot::from_parameters(parameters).ok()?;
            positions(&with_numbers(&robot, own), joints)
        };
        jacobian.set_column(index, &((moved(step)? - moved(-step)?) / (2.0 * step)));
    }
    let at: Vec<_> = joints
        .iter()
        .map(|own| truth.forward(own).unwrap())
        .collect();
    let jacobian = relative(&at, &jacobian);
    let covariance = outcome.estimate.covariance?;
    let covariance = DMatrix::from_fn(OF_ROBOT, OF_ROBOT, |a, b| covariance[(a, b)]);
    Some((&jacobian * covariance * jacobian.transpose()).trace())
}

#[derive(Debug, Default)]
struct Sums {
    before: f64,
    exact: f64,
    achieved: f64,
    reported: f64,
    refused: [usize; 2],
    accepted: [f64; 2],
}

fn campaign(kind: Kind, nominal: &Robot<f64>, seed: u64, robots: u64, count: usize) -> Sums {
    let mut sums = Sums::default();
    let sigma = TRANSMISSION.to_radians();
    for robot in 0..robots {
        let mut rng = generator(seed, robot);
        let truth = made(nominal, &mut rng);
        let mut rows = measured(kind, &truth, count, &mut rng);
        let mut joints = Vec::new();
        while joints.len() < JUDGED {
            let pose = random_pose(&truth, &paper_limits(), &mut rng)
                .unwrap()
                .joints;
            if nominal.forward(&pose).is_ok() {
                joints.push(pose);
            }
        }
        with_instruments(kind, |instruments, settings| {
            let exact = calibrated(nominal, instruments, settings, &mut rows);
            let exact = exact.and_then(|own| squared_error(&own.robot, &truth, &joints));
            let unknown = Instruments {
                transmission: Some(TransmissionTolerance::new(sigma).unwrap()),
                ..*instruments
            };
            let found = calibrated(nominal, &unknown, settings, &mut rows);
            let found = found.and_then(|own| {
                let achieved = squared_error(&own.robot, &truth, &joints)?;
                Some((achieved, reported(&truth, &joints, &own)?))
            });
            sums.refused[0] += usize::from(exact.is_none());
            sums.refused[1] += usize::from(found.is_none());
            if let Some(exact) = exact {
                sums.exact += exact;
                sums.accepted[0] += 1.0;
            }
            if let Some((achieved, reported)) = found {
                sums.before += squared_error(nominal, &truth, &joints).unwrap();
                sums.achieved += achieved;
                sums.reported += reported;
                sums.accepted[1] += 1.0;
            }
        });
    }
    sums
}

/// A robot made to the tolerance, with gears and encoders made to theirs.
fn made(nominal: &Robot<f64>, rng: &mut Pcg32) -> Robot<f64> {
    let angle = ANGLE.to_radians();
    let truth = perturbed(nominal, LENGTH, angle, Spread::Normal, rng);
    let sigma = TRANSMISSION.to_radians();
    let numbers = [(); 3].map(|()| [(); 5].map(|()| sigma * standard_normal::<f64, _>(rng)));
    with_numbers(&truth, numbers)
}

/// The error of the relative positions is what the covariance says, where gears and encoders are not exact and are
/// estimated; the reported variance of an efficient estimate is the Bayesian Cramér–Rao bound.
#[test]
fn transmissions_are_found_as_well_as_reported() {
    let robots = size(6, 200);
    let (mut all, mut cells, mut refused) = (0.0, 0.0, 0);
    for (offset, kind) in (0..).zip(KINDS) {
        for (seed, (name, nominal)) in (500..).zip(&geometries()) {
            let sums = campaign(kind, nominal, 10 * seed + offset, robots, 60);
            let ratio = (sums.achieved / sums.reported).sqrt();
            let rms = |sum: f64, count: f64| (sum / (count * JUDGED as f64)).sqrt();
            let [without, with] = sums.accepted;
            print_campaign(
                "docs/instruments.md",
                &format!(
                    "{name} {kind:?}: {:.3} | {:.3} | {:.3} | {ratio:.2} | refused {:?}",
                    rms(sums.before, with),
                    rms(sums.exact, without),
                    rms(sums.achieved, with),
                    sums.refused
                ),
            );
            all += ratio * ratio;
            cells += 1.0;
            refused += sums.refused[1];
        }
    }
    let ratio = f64::sqrt(all / cells);
    print_campaign(
        "docs/instruments.md",
        &format!("over all {ratio:.3}, {refused} refused"),
    );
    assert!((ratio - 1.0).abs() < 0.06, "{ratio}");
    assert!(refused == 0, "{refused}");
}
