//! A robot whose place in the measuring frame is estimated together with its parameters.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

use delta_cal::calibration::{FreeFrame, JointCalibrator, Prior, Problem};
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Arm, Drive};
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Noise, Parameter, Robot, Sample, Settings, Tolerance};
use delta_cal_host::Frame;
use delta_cal_host::fit::joint;
use delta_cal_tests::geometries::{geometries, linear_geometries, position_jacobian};
use delta_cal_tests::{Spread, generator, measurements, perturbed, size, uniform};
use nalgebra::{DMatrix, Matrix3, Rotation3, SMatrix, SVector, Vector3};

fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.002f64.to_radians()).unwrap()
}

fn tolerance() -> Tolerance<f64> {
    Tolerance::new(0.5, 0.2f64.to_radians()).unwrap()
}

type Measured = (&'static str, Robot<f64>, Vec<Sample<f64>>);

/// Every geometry, with exact measurements of it.
fn robots() -> Vec<Measured> {
    let rotary = geometries().into_iter().enumerate();
    let rotary = rotary.map(|(index, (name, nominal))| {
        let mut rng = generator(1501, index as u64);
        let samples = measurements(&nominal, 60, None, &mut rng);
        (name, nominal, samples)
    });
    let linear = linear_geometries().into_iter().enumerate();
    let linear = linear.map(|(index, (name, nominal, [low, high]))| {
        let mut rng = generator(1502, index as u64);
        let limits = JointLimits::travel(low, high).unwrap();
        let sample = |_| {
            let pose = random_pose(&nominal, &limits, &mut rng).unwrap();
            simulate_sample(&nominal, &pose.joints, None, &mut rng).unwrap()
        };
        let samples = (0..60).map(sample).collect();
        (name, nominal, samples)
    });
    rotary.chain(linear).collect()
}

/// One σ of each of the 24 places, in the problem's units.
fn sigmas(nominal: &Robot<f64>, units: &[f64; 24]) -> [f64; 24] {
    let of_places = tolerance().of_places(&nominal.arms()[0]);
    std::array::from_fn(|place| of_places[place % 8] / units[place])
}

/// Which of the 24 places hold a parameter.
fn parameters(nominal: &Robot<f64>) -> Vec<usize> {
    let places = nominal.drive().places();
    (0..24)
        .filter(|place| places[place % 8].is_some())
        .collect()
}

/// A robot that is nominal and stands elsewhere costs nothing, and the prior says where it stands: the
/// moved robot is found by calibrating it from exact positions.
#[test]
fn a_moved_robot_is_as_near_to_nominal_as_before() {
    for (index, (name, nominal, mut samples)) in robots().into_iter().enumerate() {
        let mut rng = generator(1500, index as u64);
        let mut draw = |by: f64| Vector3::from_fn(|_, _| by * uniform(&mut rng));
        let (translation, rotation) = (draw(0.1), draw(2e-4));
        let turn = Rotation3::new(rotation);

        let settings = Settings::default().with_tolerance(tolerance());
        let plain = Settings::default();
        let empty = *JointCalibrator::new(&nominal, &plain).factor();
        let units = std::array::from_fn(|parameter| empty.unit_of(parameter));
        let free = FreeFrame::new(&nominal, &units, settings.tolerance.as_ref());
        let centre = free.motion(&[0.0; 24]).centre;
        for sample in &mut samples {
            sample.position = turn * (sample.position - centre) + centre + translation;
        }
        let mut calibrator = JointCalibrator::new(&nominal, &plain);
        calibrator.add_many(&samples).unwrap();
        let correction = calibrator.solve().unwrap().estimate.correction;

        let motion = free.motion(&correction);
        // Second order: 2e-4² of some hundred millimetres, and of a rad.
        assert!((motion.translation - translation).norm() < 1e-4, "{name}");
        assert!((motion.rotation - rotation).norm() < 3e-7, "{name}");
        let sigmas = sigmas(&nominal, &units);
        let square = |place: usize| (correction[place] / sigmas[place]).powi(2);
        let cost: f64 = parameters(&nominal).into_iter().map(square).sum();
        assert!(free.cost(&correction) < 1e-5 * cost, "{name}");
    }
}

/// The prior is a projection: of the parameters' directions it leaves the six motions free, whatever the robot, and
/// its three figures (cost, distances, shares) are of the same matrix.
#[test]
fn the_prior_holds_all_directions_but_the_six_motions() {
    for (name, nominal, _) in robots() {
        let empty = *JointCalibrator::new(&nominal, &Settings::default()).factor();
        let units = std::array::from_fn(|parameter| empty.unit_of(parameter));
        let (sigmas, parameters) = (sigmas(&nominal, &units), parameters(&nominal));
        let free = FreeFrame::new(&nominal, &units, Some(&tolerance()));
        assert_eq!(free.unheld(), 6, "{name}");
        let mut covariance = vec![0.0; 24 * 24];
        for parameter in &parameters {
            covariance[25 * parameter] = sigmas[*parameter].powi(2);
        }
        let mut correction = [0.0; 24];
        let (mut held, mut shares) = (0.0, 0.0);
        for (index, parameter) in parameters.iter().copied().enumerate() {
            let mut one = [0.0; 24];
            one[parameter] = sigmas[parameter];
            let cost = free.cost(&one);
            held += cost;
            shares += free.share(&covariance, parameter);
            // Of a projection P: |P e|² = eᵀP e. All are at most 1, and rounded a few dozen times.
            assert!((free.distance(&one, parameter) - cost).abs() < 1e-12);
            correction[parameter] = sigmas[parameter] * ((index % 7) as f64 - 2.0);
        }
        // Its trace is its rank.
        let rank = parameters.len() as f64 - 6.0;
        assert!((held - rank).abs() < 1e-11, "{name}: {held}");
        assert!((shares - rank).abs() < 1e-11, "{name}: {shares}");

        let distances = parameters
            .iter()
            .map(|parameter| free.distance(&correction, *parameter).powi(2));
        let (sum, cost) = (distances.sum::<f64>(), free.cost(&correction));
        assert!((sum / cost - 1.0).abs() < 1e-12, "{name}");

        let nothing = FreeFrame::new(&nominal, &units, None);
        assert_eq!(nothing.unheld(), parameters.len(), "{name}");
        assert!(nothing.cost(&correction) == 0.0 && nothing.distance(&correction, 3) == 0.0);
    }
}

/// The parameters of an arm that is turned about a point, from its directions.
fn turned(arm: &Arm<f64>, turn: &Rotation3<f64>, centre: &Vector3<f64>) -> [f64; 8] {
    let basis = arm.basis();
    let d = turn * (arm.d() - centre) + centre;
    let [.., fifth, sixth, lb] = arm.parameters();
    if arm.drive() == Drive::Linear {
        let tower = turn * basis.ez;
        let (lean_x, lean_y) = (tower.x.asin(), tower.y.asin());
        return [d.x, d.y, d.z, lean_x, lean_y, fifth, sixth, lb];
    }
    let axis = turn * basis.ey;
    let alpha = axis.z.asin();
    // Within half a turn of the azimuth before.
    let before = arm.get(Parameter::Theta);
    let (sine, cosine) = before.sin_cos();
    let by = (-axis.x * cosine - axis.y * sine).atan2(axis.y * cosine - axis.x * sine);
    let theta = before + by;
    let upper_arm = turn * basis.u;
    let ex = Vector3::new(theta.cos(), theta.sin(), 0.0);
    let (la_x, la_y) = (upper_arm.dot(&ex), upper_arm.dot(&ex.cross(&axis)));
    [d.x, d.y, d.z, theta, alpha, la_x, la_y, lb]
}

/// Two robots whose arms or towers lean much.
fn leaning_robots() -> [Robot<f64>; 2] {
    let arms = [
        [180.0, 20.0, -5.0, 0.2, 0.4, 240.0, 60.0, 480.0],
        [-80.0, 150.0, 10.0, 2.2, -0.3, 250.0, -80.0, 490.0],
        [-90.0, -160.0, 0.0, 4.1, 0.5, 260.0, 100.0, 470.0],
    ];
    let towers = [
        [140.0, 20.0, -5.0, 0.5, 0.3, 1.1, 330.0],
        [-80.0, 120.0, 10.0, -0.4, 0.5, 0.9, 340.0],
        [-90.0, -120.0, 0.0, -0.3, -0.6, 1.0, 320.0],
    ];
    [
        Robot::new(arms.map(|parameters| Arm::new(parameters).unwrap())).unwrap(),
        Robot::new(towers.map(|parameters| Arm::linear(parameters).unwrap())).unwrap(),
    ]
}

/// ∂P by the six motions of the robot, about a point: by differences of the moved robot's parameters.
fn by_motions(robot: &Robot<f64>, centre: &Vector3<f64>) -> SMatrix<f64, 24, 6> {
    let mut motions = SMatrix::<f64, 24, 6>::zeros();
    for (index, arm) in robot.arms().iter().enumerate() {
        for axis in 0..3 {
            motions[(8 * index + axis, axis)] = 1.0;
            let [above, below] = [1e-5, -1e-5].map(|angle| {
                let mut rotation = Vector3::zeros();
                rotation[axis] = angle;
                turned(arm, &Rotation3::new(rotation), centre)
            });
            for place in 0..8 {
                motions[(8 * index + place, 3 + axis)] = (above[place] - below[place]) / 2e-5;
            }
        }
    }
    motions
}

/// Of arms and towers that lean much, and of towers with a common radius: cost, gradient and shares are those of the
/// least over all motions τ of (δ − G τ)ᵀ Λ (δ − G τ), Λ⁻¹ the covariance that the tolerance states.
#[test]
fn the_prior_is_the_least_cost_over_all_motions() {
    for robot in leaning_robots() {
        for radius in [0.0, 2.0] {
            let tolerance = tolerance().with_radius(radius).unwrap();
            let empty = *JointCalibrator::new(&robot, &Settings::default()).factor();
            let units: [f64; 24] = std::array::from_fn(|parameter| empty.unit_of(parameter));
            let free = FreeFrame::new(&robot, &units, Some(&tolerance));
            let places = robot.drive().places();
            let mut covariance = SMatrix::<f64, 24, 24>::identity();
            let mut common = SVector::<f64, 24>::zeros();
            for (index, arm) in robot.arms().iter().enumerate() {
                let [x, y] = tolerance.outwards(arm);
                (common[8 * index], common[8 * index + 1]) = (x, y);
                for (place, parameter) in places.iter().enumerate() {
                    if let Some(parameter) = parameter {
                        let index = 8 * index + place;
                        covariance[(index, index)] = tolerance.of(*parameter).powi(2);
                    }
                }
            }
            covariance += common * common.transpose();
            let information = covariance.try_inverse().unwrap();
            let motions = by_motions(&robot, &free.motion(&[0.0; 24]).centre);
            let along = information * motions;
            let held = (motions.transpose() * along).try_inverse().unwrap();
            let expected = information - along * held * along.transpose();

            let parameters = parameters(&robot);
            let mut deviation = SVector::<f64, 24>::zeros();
            for (index, parameter) in parameters.iter().enumerate() {
                let sigma = covariance[(*parameter, *parameter)].sqrt();
                deviation[*parameter] = sigma * ((index * index % 7) as f64 - 2.6);
            }
            let scaled = |values: &SVector<f64, 24>| -> [f64; 24] {
                std::array::from_fn(|index| {
                    let unit = units[index];
                    if unit > 0.0 {
                        values[index] / unit
                    } else {
                        0.0
                    }
                })
            };
            let correction = scaled(&deviation);
            // Differences over 1e-5 rad leave 1e-10 of the second derivative.
            let cost = (deviation.transpose() * expected * deviation)[0];
            assert!((free.cost(&correction) / cost - 1.0).abs() < 1e-6);
            let gradient = expected * deviation;
            let found = free.gradient(&correction);
            let columns: Vec<f64> = covariance
                .column_iter()
                .zip(units)
                .flat_map(|(column, unit)| {
                    scaled(&column.into()).map(|entry| if unit > 0.0 { entry / unit } else { 0.0 })
                })
                .collect();
            for parameter in parameters {
                let sigma = covariance[(parameter, parameter)].sqrt();
                let found = found[parameter] / units[parameter];
                assert!((found - gradient[parameter]).abs() * sigma < 1e-6 * cost.sqrt());
                let share = (expected * covariance)[(parameter, parameter)];
                assert!((free.share(&columns, parameter) - share).abs() < 1e-6);
            }
        }
    }
}

/// A robot that is turned as a whole: the prior says by how much, whatever its arms lean.
#[test]
fn the_rotation_of_a_robot_whose_arms_lean_much_is_found() {
    for robot in leaning_robots() {
        let empty = *JointCalibrator::new(&robot, &Settings::default()).factor();
        let units: [f64; 24] = std::array::from_fn(|parameter| empty.unit_of(parameter));
        let free = FreeFrame::new(&robot, &units, Some(&tolerance()));
        let centre = free.motion(&[0.0; 24]).centre;
        let rotation = Vector3::new(1e-5, -2e-5, 1.5e-5);
        let mut correction = [0.0; 24];
        for (own, arm) in correction.chunks_exact_mut(8).zip(robot.arms()) {
            let after = turned(arm, &Rotation3::new(rotation), &centre);
            for ((entry, after), before) in own.iter_mut().zip(after).zip(arm.parameters()) {
                *entry = after - before;
            }
        }
        for (entry, unit) in correction.iter_mut().zip(units) {
            *entry = if unit > 0.0 { *entry / unit } else { 0.0 };
        }
        let motion = free.motion(&correction);
        // Second order: 3e-5² of a few rad and of some hundred millimetres.
        let off = (motion.rotation - rotation).norm();
        assert!(off < 1e-8, "{off:e}");
        let off = motion.translation.norm();
        assert!(off < 2e-6, "{off:e}");
    }
}

/// 24 parameters and the six numbers of the frame, the prior of the parameters alone: covariance of the
/// 24, then of the six.
fn bound(truth: &Robot<f64>, samples: &[Sample<f64>]) -> Option<DMatrix<f64>> {
    let mut information = DMatrix::<f64>::zeros(30, 30);
    for sample in samples {
        let mut by_joints = Matrix3::zeros();
        for joint in 0..3 {
            let at = |by: f64| {
                let mut joints = sample.joints;
                joints[joint] += by;
                truth.forward(&joints).ok()
            };
            by_joints.set_column(joint, &((at(1e-6)? - at(-1e-6)?) / 2e-6));
        }
        let covariance = Matrix3::identity() * noise().position().powi(2)
            + by_joints * by_joints.transpose() * noise().joint().powi(2);
        let jacobian = with_frame(truth, &sample.joints)?;
        information += jacobian.transpose() * covariance.try_inverse()? * jacobian;
    }
    for index in 0..24 {
        let parameter = delta_cal::Parameter::ROTARY[index % 8];
        information[(index, index)] += tolerance().of(parameter).powi(-2);
    }
    let scale = DMatrix::from_diagonal(&information.diagonal().map(|entry| entry.sqrt().recip()));
    let inverse = (&scale * &information * &scale).try_inverse()?;
    Some(&scale * inverse * &scale)
}

fn with_frame(robot: &Robot<f64>, joints: &[f64; 3]) -> Option<SMatrix<f64, 3, 30>> {
    let mut jacobian = SMatrix::<f64, 3, 30>::zeros();
    let parameters = position_jacobian(robot, joints)?;
    jacobian.fixed_columns_mut::<24>(0).copy_from(&parameters);
    let x = robot.forward(joints).ok()?;
    jacobian.fixed_columns_mut::<3>(24).fill_with_identity();
    // ω × x.
    jacobian
        .fixed_columns_mut::<3>(27)
        .copy_from(&-x.cross_matrix());
    Some(jacobian)
}

#[test]
fn the_error_in_the_sensors_frame_is_at_the_bound_of_thirty_parameters() {
    for (index, (name, nominal)) in geometries().into_iter().enumerate() {
        for poses in [5, 8, 20] {
            let (mut error, mut limit, mut reported) = (0.0, 0.0, 0.0);
            let mut refused = 0;
            let robots = size(60, 400);
            for robot in 0..robots {
                let mut rng = generator(1510 + index as u64, robot);
                let angle = tolerance().of(delta_cal::Parameter::Theta);
                let truth = perturbed(&nominal, 0.5, angle, Spread::Normal, &mut rng);
                let samples = measurements(&truth, poses, Some(&noise()), &mut rng);
                let test = measurements(&truth, 20, None, &mut rng);
                let settings = Settings::default()
                    .with_noise(noise())
                    .with_tolerance(tolerance());
                let Some(covariance) = bound(&truth, &samples) else {
                    continue;
                };
                // As if the frame were not known: from where the nominal robot would be.
                let Ok(frame) = RigidTransform::align(samples.iter().filter_map(|sample| {
                    Some((nominal.forward(&sample.joints).ok()?, sample.position))
                })) else {
                    continue;
                };
                let measured: Vec<_> = samples
                    .iter()
                    .map(|sample| Sample {
                        position: frame.inverse().apply(&sample.position),
                        ..*sample
                    })
                    .collect();
                let Ok(outcome) = joint::calibrate_weighted(
                    &nominal,
                    (&measured).into(),
                    None,
                    &settings,
                    Frame::Sensor,
                ) else {
                    refused += 1;
                    continue;
                };
                for pose in &test {
                    let clear = truth
                        .singularity_distance(&pose.position, &pose.joints)
                        .is_clear();
                    let (true, Some(jacobian), Ok(position)) = (
                        clear,
                        with_frame(&truth, &pose.joints),
                        outcome.fit.robot.forward(&pose.joints),
                    ) else {
                        continue;
                    };
                    error += (frame.apply(&position) - pose.position).norm_squared();
                    limit += (jacobian * &covariance * jacobian.transpose()).trace();
                    let own = position_jacobian(&outcome.fit.robot, &pose.joints).unwrap();
                    let covariance = outcome.covariance.unwrap();
                    reported += (own * covariance * own.transpose()).trace();
                }
            }
            let (over_bound, over_reported) =
                (f64::sqrt(error / limit), f64::sqrt(error / reported));
            println!(
                "{name}, {poses} poses: error/bound {over_bound:.3}, achieved/reported \
                 {over_reported:.3}, {refused} of {robots} refused"
            );
        }
    }
}
