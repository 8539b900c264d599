//! `--frame sensor`: what the measured points must do, and what is said about the frame.

use crate::support::{Folder, NOMINAL, Point, TOLERANCE, csv, exact, platform, poses, true_arms};

const CALIBRATE: &str = "calibrate robot.toml samples.csv --frame sensor";

fn folder(samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder.write("samples.csv", csv(samples));
    folder
}

fn posed(pose: impl Fn(Point) -> Point) -> Vec<(Point, Point)> {
    let arms = true_arms();
    let poses = poses(20).into_iter().map(pose);
    poses.map(|q| (q, platform(&arms, q))).collect()
}

#[test]
fn points_on_a_line_or_in_one_spot_do_not_fix_the_frame() {
    for (samples, how) in [
        (posed(|q| [q[0]; 3]), "lie (nearly) on a line"),
        (
            posed(|q| q.map(|q| 20.0 + 0.02 * (q - 15.0))),
            "lie in one spot",
        ),
    ] {
        let folder = folder(&samples);
        let run = folder.run(CALIBRATE);
        assert_eq!(run.code, 1, "{}", run.stdout);
        let expected = format!("points {how}, so they do not determine the sensor's frame");
        assert!(run.stderr.contains(&expected), "{}", run.stderr);
    }
}

#[test]
fn points_in_a_plane_do() {
    let folder = folder(&exact(&true_arms(), 3));
    let run = folder.run(CALIBRATE);
    assert!(
        !run.stderr.contains("do not determine the sensor's frame"),
        "{}",
        run.stderr
    );
}

#[test]
fn with_few_samples_the_sigmas_are_doubtful() {
    for (samples, method, doubtful) in [
        (11, "ikm", true),
        (12, "ikm", false),
        // It estimates the frame with the parameters.
        (11, "joint", false),
    ] {
        let run = folder(&exact(&true_arms(), samples))
            .run(&format!("{CALIBRATE} --method {method}"))
            .ok();
        let text: Vec<_> = run.stdout.split_whitespace().collect();
        let told = text.join(" ").contains("which has six more unknowns");
        assert_eq!(told, doubtful, "{}", run.stdout);
        assert!(text.join(" ").contains("in the frame of [sensor_frame]"));
        assert!(run.stdout.lines().all(|line| line.chars().count() <= 100));
    }
}

#[test]
fn far_from_nominal_in_the_base_frame_points_to_the_sensor_frame() {
    // 12 tolerances: a robot could be like that. 24: wrong samples rather than a robot.
    let mut samples = exact(&true_arms(), 30);
    for code in [0, 1] {
        for (_, x) in &mut samples {
            x[0] += 6.0;
        }
        let folder = folder(&samples);
        let run = folder.run("calibrate robot.toml samples.csv");
        assert_eq!(run.code, code, "{}", run.stdout);
        let said = format!("{}{}", run.stdout, run.stderr);
        let said: Vec<_> = said.split_whitespace().collect();
        let expected = "if the samples' frame is not exactly the robot's, use --frame sensor";
        assert!(said.join(" ").contains(expected), "{said:?}");
        folder.run(CALIBRATE).ok();
    }
}
