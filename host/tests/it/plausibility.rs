//! Mistakes in the samples that a fit can absorb, told by the robot that comes out.

use crate::support::{
    Arm, Folder, NOMINAL, Point, TOLERANCE, arms_of, csv, exact, noisy, nominal_arms, true_arms,
};

const CALIBRATE: &str = "calibrate robot.toml samples.csv --output out.toml";

fn folder(robot: &str, samples: &[(Point, Point)]) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("samples.csv", csv(samples));
    folder
}

fn changed(change: impl Fn(&mut Point, &mut Point)) -> Vec<(Point, Point)> {
    let mut samples = noisy(&true_arms(), 30, 0.01);
    for (q, x) in &mut samples {
        change(q, x);
    }
    samples
}

fn turned(x: &mut Point, degrees: f64) {
    let (sin, cos) = degrees.to_radians().sin_cos();
    *x = [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1], x[2]];
}

#[test]
fn gross_mistakes_are_refused_without_a_tolerance() {
    let every_hint = &[
        "units",
        "order of the joints",
        "sign",
        "--frame sensor",
        "--no-guess",
    ][..];
    let cases = [
        (
            "metres",
            changed(|_, x| *x = x.map(|c| c / 1000.0)),
            &["the positions are metres", "x_m,y_m,z_m"][..],
        ),
        (
            "swapped",
            changed(|q, _| q.swap(0, 1)),
            &["q1_deg and q2_deg, or arm 1 and arm 2, are exchanged"],
        ),
        (
            "cyclic",
            changed(|q, _| q.rotate_left(1)),
            &[
                "the joint columns are exchanged in turn",
                "q2_deg,q3_deg,q1_deg",
            ],
        ),
        (
            "reversed",
            changed(|q, _| *q = q.map(|q| -q)),
            &["all joint angles have the wrong sign"],
        ),
        (
            "one reversed",
            changed(|q, _| q[2] = -q[2]),
            &["the sign of the joint angles in q3_deg is wrong"],
        ),
        (
            "turned",
            changed(|_, x| turned(x, 30.0)),
            &["another frame than the robot's", "--frame sensor"],
        ),
        (
            "other robot",
            {
                let mut arms = true_arms();
                arms[1][7] += 60.0;
                exact(&arms, 30)
            },
            every_hint,
        ),
    ];
    for (mistake, samples, hints) in cases {
        let folder = folder(&NOMINAL.replace("-60", "-90"), &samples);
        let run = folder.run(CALIBRATE);
        assert_eq!(run.code, 1, "{mistake}: {}", run.stdout);
        for part in [" of arm ", "is not credible without a stated [tolerance]"] {
            assert!(run.stderr.contains(part), "{mistake}: {}", run.stderr);
        }
        for part in hints {
            assert!(run.stderr.contains(part), "{mistake}: {}", run.stderr);
        }
        assert_eq!(folder.names(), ["robot.toml", "samples.csv"], "{mistake}");
    }
}

#[test]
fn the_refusal_names_arm_parameter_before_and_after() {
    let mut arms = true_arms();
    arms[1][7] = 560.0;
    let run = folder(NOMINAL, &exact(&arms, 30)).run(CALIBRATE);
    let named = "Lb of arm 2 is 480.000 mm in the robot file, and the fit makes it 560.000 mm";
    assert!(run.stderr.contains(named), "{}", run.stderr);
    let run = folder(NOMINAL, &changed(|_, x| turned(x, 30.0))).run(CALIBRATE);
    // Each arm is turned by 30° and its own error, at most 0.2°.
    let (_, after) = run.stderr.split_once("and the fit makes it ").unwrap();
    let after: f64 = after.split_once('°').unwrap().0.parse().unwrap();
    assert!(
        [30.0, 150.0, 270.0]
            .iter()
            .any(|theta| (theta - after).abs() < 0.3),
        "{after}"
    );
}

#[test]
fn samples_in_metres_or_radians_are_told_as_such() {
    let metres = changed(|_, x| *x = x.map(|c| c / 1000.0));
    let radians = changed(|q, _| *q = q.map(f64::to_radians));
    let (are_metres, are_radians) = ("the positions are metres", "are radians");
    for (robot, samples, hint) in [
        (NOMINAL.to_owned(), &metres, are_metres),
        (format!("{NOMINAL}{TOLERANCE}"), &metres, are_metres),
        (NOMINAL.to_owned(), &radians, are_radians),
        (format!("{NOMINAL}{TOLERANCE}"), &radians, are_radians),
    ] {
        for frame in ["base", "sensor"] {
            let folder = folder(&robot, samples);
            let run = folder.run(&format!("{CALIBRATE} --frame {frame}"));
            assert_eq!(run.code, 1, "{hint} {frame}: {}", run.stdout);
            assert!(run.stderr.contains(hint), "{frame}: {}", run.stderr);
        }
    }
    // Under the right header there is no such hint.
    let folder = folder(NOMINAL, &[]);
    let wrong = csv(&changed(|q, _| {
        *q = [-q[0], q[1], q[2]].map(f64::to_radians);
    }));
    folder.write("samples.csv", wrong.replace("_deg", "_rad"));
    let run = folder.run(CALIBRATE);
    assert_eq!(run.code, 1, "{}", run.stdout);
    assert!(!run.stderr.contains("look like"), "{}", run.stderr);
}

#[test]
fn without_a_guess_any_robot_is_found() {
    let robot = NOMINAL.replace("= 260", "= 200").replace("= 480", "= 600");
    let samples = exact(&true_arms(), 30);
    let folder = folder(&robot, &samples);
    assert_eq!(folder.run(CALIBRATE).code, 1);
    let run = folder.run(&format!("{CALIBRATE} --no-guess")).ok();
    assert!(run.stdout.contains("Nothing doubtful"), "{}", run.stdout);
    let text = folder.read("out.toml");
    assert!(text.contains("--no-guess"), "{text}");
    for (found, expected) in arms_of(&text).iter().zip(true_arms()) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }
}

#[test]
fn without_a_guess_twelve_samples_are_needed_and_no_tolerance_may_be_stated() {
    let few = folder(NOMINAL, &exact(&true_arms(), 11));
    let run = few.run(&format!("{CALIBRATE} --no-guess"));
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("11 samples") && run.stderr.contains("needs 12"));
    assert!(!run.stderr.contains("[tolerance]"), "{}", run.stderr);

    let stated = folder(&format!("{NOMINAL}{TOLERANCE}"), &exact(&true_arms(), 30));
    let run = stated.run(&format!("{CALIBRATE} --no-guess"));
    assert_eq!(run.code, 3);
    for part in [
        "robot.toml: [tolerance]: ",
        "--no-guess says not to use them",
    ] {
        assert!(run.stderr.contains(part), "{}", run.stderr);
    }
    assert_eq!(stated.names(), ["robot.toml", "samples.csv"]);
}

/// The nominal robot but for some parameters of arm 2.
fn but_for(changes: &[(usize, f64)]) -> [Arm; 3] {
    let mut arms = nominal_arms();
    for (parameter, value) in changes {
        arms[1][*parameter] = *value;
    }
    arms
}

#[test]
fn large_changes_are_doubtful_and_the_largest_three_are_named() {
    // A joint zero that is off by 5° turns La_x = 260 into La_y = 22.661.
    let (sin, cos) = 5f64.to_radians().sin_cos();
    let zero = but_for(&[(5, 260.0 * cos), (6, 260.0 * sin)]);
    let run = folder(NOMINAL, &exact(&zero, 30)).run(CALIBRATE).ok();
    // The report is wrapped.
    let text: Vec<_> = run.stdout.split_whitespace().collect();
    let expected = "La_y of arm 2 by 22.660 mm (the joint's zero by 5.000°)";
    assert!(text.join(" ").contains(expected), "{}", run.stdout);
    assert!(!text.join(" ").contains("La_x of arm 2"), "{}", run.stdout);

    let many = but_for(&[(3, 125.0), (4, 4.0), (7, 500.0), (2, 12.0)]);
    let run = folder(NOMINAL, &exact(&many, 30)).run(CALIBRATE).ok();
    let text: Vec<_> = run.stdout.split_whitespace().collect();
    let expected =
        "theta of arm 2 by 5.000°, Lb of arm 2 by 20.000 mm and alpha of arm 2 by 4.000°";
    assert!(text.join(" ").contains(expected), "{}", run.stdout);

    // 2 % of 480 mm are 9.6 mm.
    let small = but_for(&[(3, 121.9), (7, 489.5)]);
    let run = folder(NOMINAL, &exact(&small, 30)).run(CALIBRATE).ok();
    assert!(!run.stdout.contains("differs much from the robot file"));
}
