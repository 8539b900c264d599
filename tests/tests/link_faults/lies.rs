//! Frames that are whole and hold what no controller finds.

use delta_cal::ArmIndex;
use delta_cal::calibration::{StartUsed, Termination};
use delta_cal_host::device::{DeviceError, Solution, outcome};
use delta_cal_protocol::ArmReport;
use delta_cal_tests::paper_robot;

fn report(arm: ArmIndex) -> ArmReport<f32> {
    let mut covariance = [[0.0; 8]; 8];
    for (index, column) in covariance.iter_mut().enumerate() {
        column[index] = 1e-4;
    }
    ArmReport {
        arm,
        parameters: paper_robot::<f32>().arm(arm).parameters(),
        transmission: None,
        covariance: Some(covariance),
        residual_rms: 0.02,
        estimated_noise: Some(0.02),
        degrees_of_freedom: 12.0,
        samples: 20,
        iterations: 5,
        termination: Termination::GradientVanished,
        start: StartUsed::Nominal,
        condition: 9.0,
        prior_share: [0.1; 8],
        held_out: None,
    }
}

/// The fuzz target `driver` asserts it too.
#[test]
fn figures_that_no_result_has_are_no_result() {
    let honest = Solution {
        arms: ArmIndex::ALL.map(report),
        across: None,
        places: None,
    };
    assert!(outcome(&honest).is_ok());
    let wrong: [fn(&mut ArmReport<f32>); 9] = [
        |report| report.residual_rms = f32::NAN,
        |report| report.residual_rms = -0.1,
        |report| report.condition = f32::INFINITY,
        |report| report.degrees_of_freedom = f32::NAN,
        |report| report.estimated_noise = Some(f32::NAN),
        |report| report.prior_share[7] = f32::NEG_INFINITY,
        |report| report.covariance = Some([[f32::NAN; 8]; 8]),
        |report| report.covariance.as_mut().unwrap()[3][3] = -1e-4,
        |report| report.covariance.as_mut().unwrap()[2][5] = f32::INFINITY,
    ];
    for (number, change) in wrong.iter().enumerate() {
        for arm in 0..3 {
            let mut lie = honest;
            change(&mut lie.arms[arm]);
            let made = outcome(&lie);
            assert!(
                matches!(made, Err(DeviceError::ImpossibleOutcome)),
                "{number}, arm {arm}: {made:?}"
            );
        }
    }
}
