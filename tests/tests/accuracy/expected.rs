//! The expected position error against the same over many more poses.

use crate::accuracy::robots::{geometries, noise, robot_file, spread_pose};
use delta_cal::Sample;
use delta_cal_host::CalibrationMethod;
use delta_cal_host::ExpectedError;
use delta_cal_host::accuracy::evaluation::CramerRaoBound;
use delta_cal_host::accuracy::position_uncertainty::PositionUncertainty;
use delta_cal_host::accuracy::workspace_poses::WorkspacePoses;
use delta_cal_tests::generator;

/// Drawn evenly in joint space.
const POSES: u32 = 60_000;

#[test]
fn the_expected_error_is_that_of_many_random_poses_and_its_worst_place_is_none_of_them() {
    let mut ratios = Vec::new();
    for (number, (name, robot)) in (0..).zip(geometries()) {
        let mut rng = generator(134, number);
        let joints: Vec<_> = (0..20).map(|_| spread_pose(&robot, &mut rng)).collect();
        let bound =
            CramerRaoBound::new(CalibrationMethod::Fkm, &robot, &joints, &noise(), None).unwrap();
        let covariance = bound.of_parameters(&robot);
        let uncertainty = PositionUncertainty {
            robot: &robot,
            covariance: &covariance,
        };
        let file = robot_file(&robot, (false, true));
        let found =
            ExpectedError::of(&uncertainty, &file.reach(), &WorkspacePoses::of(&file)).unwrap();
        let drawn: Vec<_> = (0..POSES)
            .map(|_| {
                let joints = spread_pose(&robot, &mut rng);
                let position = robot.forward(&joints).unwrap();
                Sample { joints, position }
            })
            .collect();
        let many = uncertainty.over(&drawn).unwrap();
        // Near the edges σ² is many times that inside: how its mean over 2000 random poses scatters.
        let squares = drawn.iter().filter_map(|pose| {
            let sigma = uncertainty.sigma(&pose.position, &pose.joints)?;
            Some((sigma * sigma / (many.rms * many.rms) - 1.0).powi(2))
        });
        let scatter = 0.5 * (squares.sum::<f64>() / f64::from(many.poses) / 2000.0).sqrt();
        let (rms, worst) = (found.absolute.rms / many.rms, found.absolute.max / many.max);
        println!("{name}: rms {rms:.3} ± {scatter:.3}, worst {worst:.3}");
        assert!(found.intrinsic.rms < found.absolute.rms);
        ratios.push((rms, scatter, worst));
    }
    for (rms, scatter, worst) in ratios {
        assert!(
            (rms - 1.0).abs() < 0.01 + 2.5 * scatter,
            "{rms} ± {scatter}"
        );
        // 60,000 poses come near to the worst one, and not beyond it.
        assert!((0.99..1.35).contains(&worst), "{worst}");
    }
}
