//! A calibration through the interface as C makes it, with exact data: short enough for Miri, which sees every access
//! to memory. The expectations are the robot that was measured.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(unsafe_code)] // in the place of C

mod support;

use delta_cal_c::error::Error;
use delta_cal_c::plain::{READ_HEIGHT, READ_X, READ_Y, READ_Z, REJECTED, TAKEN};
use delta_cal_c::single::sample::Settings;
use delta_cal_c::single::{
    calibrator::*, gate::*, joint::*, observations::*, outcome::*, robot::*,
};
use delta_cal_c::status::{self, Status};
use delta_cal_c::{Held, HeldMut, In, Many, New, Out, Workspace};
use support::{Memory, SETTINGS, measured, no_error};

/// Lb of the three arms is what was built, to a tenth of the tolerance.
fn assert_built(robot: &mut Memory<512>) {
    let mut parameters = [[0.0_f32; 8]; 3];
    let found = unsafe {
        robot_parameters(
            Held::from_c(robot.place()),
            Out::from_c((&raw mut parameters).cast()),
        )
    };
    assert_eq!(found, status::OK);
    for arm in parameters {
        assert!((arm[7] - 479.1).abs() < 0.05, "{arm:?}");
    }
}

fn ok(status: Status) {
    assert_eq!(status, status::OK);
}

#[test]
fn the_per_arm_calibrator_finds_the_robot_that_was_built() {
    unsafe {
        let mut nominal = Memory::<512>::robot();
        let mut calibrator = Memory::<2048>::calibrator(&mut nominal, &Settings::default());
        for sample in measured() {
            ok(calibrator_add(
                HeldMut::from_c(calibrator.place()),
                In::from_c((&raw const sample).cast()),
                no_error(),
            ));
        }
        let mut solver = Memory::<4096>::filled_with(0xa5);
        let mut error = Error::from(status::OK);
        ok(solver_init(
            New::from_c(solver.place()),
            4096,
            HeldMut::from_c(calibrator.place()),
            Out::from_c((&raw mut error).cast()),
        ));
        let mut steps = 0;
        while solver_step(
            HeldMut::from_c(solver.place()),
            Held::from_c(calibrator.place()),
            Out::from_c((&raw mut error).cast()),
        ) == status::WORKING
        {
            steps += 1;
        }
        assert!(steps > 3);
        let mut outcome = Memory::<2048>::filled_with(0xa5);
        ok(solver_outcome(
            Held::from_c(solver.place()),
            New::from_c(outcome.place()),
            2048,
            Out::from_c((&raw mut error).cast()),
        ));
        let mut robot = Memory::<512>::zeroed();
        ok(outcome_robot(
            Held::from_c(outcome.place()),
            New::from_c(robot.place()),
            512,
        ));
        assert_built(&mut robot);

        let mut sigma = [[0.0_f32; 8]; 3];
        let mut covariance = [[0.0_f32; 8]; 8];
        ok(outcome_deviations(
            Held::from_c(outcome.place()),
            Out::from_c((&raw mut sigma).cast()),
        ));
        ok(outcome_covariance(
            Held::from_c(outcome.place()),
            1,
            Out::from_c((&raw mut covariance).cast()),
        ));
        for (index, sigma) in sigma[1].iter().enumerate() {
            assert!((covariance[index][index].sqrt() - sigma).abs() <= 1e-6 * sigma);
        }
        assert_eq!(
            outcome_covariance(
                Held::from_c(outcome.place()),
                3,
                Out::from_c((&raw mut covariance).cast()),
            ),
            status::NO_SUCH_ARM
        );
    }
}

#[test]
fn the_joint_calibrator_finds_the_robot_that_was_built() {
    unsafe {
        let mut nominal = Memory::<512>::robot();
        let mut calibrator = Memory::<8192>::zeroed();
        ok(joint_calibrator_init(
            New::from_c(calibrator.place()),
            8192,
            Held::from_c(nominal.place()),
            In::from_c((&raw const SETTINGS).cast()),
            no_error(),
        ));
        for sample in measured() {
            ok(joint_calibrator_add(
                HeldMut::from_c(calibrator.place()),
                In::from_c((&raw const sample).cast()),
                no_error(),
            ));
        }
        let mut solver = Memory::<8192>::zeroed();
        ok(joint_solver_init(
            New::from_c(solver.place()),
            8192,
            HeldMut::from_c(calibrator.place()),
            no_error(),
        ));
        while joint_solver_step(
            HeldMut::from_c(solver.place()),
            Held::from_c(calibrator.place()),
            no_error(),
        ) == status::WORKING
        {}
        let mut outcome = Memory::<4096>::zeroed();
        ok(joint_solver_outcome(
            Held::from_c(solver.place()),
            Held::from_c(calibrator.place()),
            New::from_c(outcome.place()),
            4096,
            no_error(),
        ));
        let mut covariance = [[0.0_f32; 24]; 24];
        ok(joint_outcome_covariance(
            Held::from_c(outcome.place()),
            Out::from_c((&raw mut covariance).cast()),
        ));
        // The tolerance bounds every sigma.
        for (index, row) in covariance.iter().enumerate() {
            assert!((0.0..=0.25).contains(&row[index]));
        }
        let mut arms = Memory::<2048>::zeroed();
        ok(joint_outcome_arms(
            Held::from_c(outcome.place()),
            New::from_c(arms.place()),
            2048,
        ));
        let mut summary = std::mem::MaybeUninit::<ArmSummary>::uninit();
        ok(outcome_arm(
            Held::from_c(arms.place()),
            2,
            Out::from_c(summary.as_mut_ptr().cast()),
        ));
        let summary = summary.assume_init();
        assert_eq!((summary.samples, summary.has_covariance), (14, 1));
    }
}

#[test]
fn the_gate_rejects_a_wrong_sample_and_adopts_an_outcome() {
    unsafe {
        let mut nominal = Memory::<512>::robot();
        let mut calibrator = Memory::<2048>::calibrator(&mut nominal, &SETTINGS);
        let mut gate = Memory::<2048>::zeroed();
        ok(gate_init(
            New::from_c(gate.place()),
            2048,
            HeldMut::from_c(calibrator.place()),
            0.0,
        ));
        let mut verdicts = Vec::new();
        for (index, mut sample) in measured().into_iter().enumerate() {
            if index == 12 {
                sample.position[0] += 5.0;
            }
            let mut verdict = std::mem::MaybeUninit::<Verdict>::uninit();
            ok(gate_add(
                HeldMut::from_c(gate.place()),
                HeldMut::from_c(calibrator.place()),
                In::from_c((&raw const sample).cast()),
                Out::from_c(verdict.as_mut_ptr().cast()),
                no_error(),
            ));
            verdicts.push(verdict.assume_init().verdict);
        }
        let mut expected = [TAKEN; 14];
        expected[12] = REJECTED;
        assert_eq!(verdicts, expected);

        // Without a place for the verdict nothing is taken in.
        let mut counts = [0_u64; 10];
        let mut state = |gate: &mut Memory<2048>| {
            ok(gate_state(
                Held::from_c(gate.place()),
                Out::from_c((&raw mut counts).cast()),
            ));
            counts
        };
        let before = state(&mut gate);
        let again = measured()[0];
        assert_eq!(
            gate_add(
                HeldMut::from_c(gate.place()),
                HeldMut::from_c(calibrator.place()),
                In::from_c((&raw const again).cast()),
                Out::from_c(std::ptr::null_mut()),
                no_error(),
            ),
            status::NULL_POINTER
        );
        assert_eq!(state(&mut gate), before);
        // 13 taken, none untested, 1 rejected.
        assert_eq!(before[..3], [13, 0, 1]);

        assert_eq!(
            gate_adopt(
                HeldMut::from_c(gate.place()),
                HeldMut::from_c(calibrator.place()),
                Held::from_c(nominal.place()),
            ),
            status::WRONG_KIND
        );
    }
}

#[test]
fn observations_are_solved_in_the_callers_workspace() {
    unsafe {
        let mut nominal = Memory::<512>::robot();
        let observations: Vec<Observation> = measured()
            .iter()
            .enumerate()
            .map(|(index, sample)| Observation {
                joints: sample.joints,
                position: sample.position,
                height: sample.position[2] + 560.0,
                distance: 0.0,
                other_joints: [0.0; 3],
                plane: 0,
                point: 0,
                readings: if index % 2 == 0 {
                    READ_HEIGHT
                } else {
                    READ_X | READ_Y | READ_Z
                },
                reserved: 0,
            })
            .collect();
        let mut instruments: Instruments = std::mem::zeroed();
        instruments.plane_count = 1;
        let mut workspace = Memory::<4096>::filled_with(0xa5);
        let mut outcome = Memory::<8192>::zeroed();
        let mut error = Error::from(status::OK);
        let mut solve = |instruments: &Instruments| {
            observations_solve(
                Held::from_c(nominal.place()),
                Many::from_c(observations.as_ptr().cast()),
                observations.len(),
                In::from_c((&raw const *instruments).cast()),
                In::from_c((&raw const SETTINGS).cast()),
                Workspace::from_c(workspace.place()),
                4096,
                New::from_c(outcome.place()),
                8192,
                Out::from_c((&raw mut error).cast()),
            )
        };
        assert_eq!(solve(&instruments), status::NOISE_OF_HEIGHT);
        instruments.height_noise = 0.02;
        ok(solve(&instruments));
        let mut plane = [0.0_f32; 3];
        let mut find = |index| {
            observation_outcome_plane(
                Held::from_c(outcome.place()),
                index,
                Out::from_c((&raw mut plane).cast()),
            )
        };
        assert_eq!(find(1), status::NO_SUCH_PLANE);
        ok(find(0));
        // The plate lies 560 mm below the origin, to the noise of the touches.
        assert!((plane[0] + 560.0).abs() < 0.5, "{plane:?}");
        let mut joint = Memory::<4096>::zeroed();
        ok(observation_outcome_joint(
            Held::from_c(outcome.place()),
            New::from_c(joint.place()),
            4096,
        ));
    }
}
