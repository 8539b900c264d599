//! Samples that spoil the fit are named when the calibration is refused.

use crate::support::{Folder, NOMINAL, TOLERANCE, csv, exact, noisy, true_arms};

const NOISE: &str = "\n[noise]\nposition_mm = 0.02\njoint_deg = 0.002\n";

#[test]
fn one_outlier_of_5_mm_in_20_samples_is_named_wherever_it_is() {
    let folder = Folder::new();
    for tolerance in ["", TOLERANCE] {
        folder.write("robot.toml", format!("{NOMINAL}{NOISE}{tolerance}"));
        for position in 0..20 {
            for axis in 0..3 {
                let mut samples = noisy(&true_arms(), 20, 0.03);
                samples[position].1[axis] += 5.0;
                folder.write("samples.csv", csv(&samples));
                let run = folder.run("calibrate robot.toml samples.csv");
                assert_eq!(run.code, 1, "{}", run.stdout);
                // The header is line 1. Others are not named: they were only drawn away by it.
                let only = format!("the sample in line {} (", position + 2);
                assert!(run.stderr.contains(&only), "{only}: {}", run.stderr);
                assert!(run.stderr.contains("again or leave"), "{}", run.stderr);
                assert!(!run.stderr.contains("larger [noise]"), "{}", run.stderr);
            }
        }
    }
}

#[test]
fn two_outliers_are_both_named_with_their_distances() {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{NOISE}"));
    let mut samples = noisy(&true_arms(), 60, 0.03);
    samples[9].1[2] += 5.0;
    samples[39].1[0] -= 4.0;
    folder.write("samples.csv", csv(&samples));
    let run = folder.run("calibrate robot.toml samples.csv");
    assert_eq!(run.code, 1, "{}", run.stdout);
    for (line, moved) in [(11, 5.0), (41, 4.0)] {
        let (_, rest) = run.stderr.split_once(&format!(" {line} (")).unwrap();
        let distance: f64 = rest.split_once(" mm)").unwrap().0.parse().unwrap();
        // The noise is up to 0.05 mm, and the rest of the samples decide where the point is.
        assert!((distance - moved).abs() < 0.2, "{distance}");
    }
    assert!(run.stderr.contains("leave them out"), "{}", run.stderr);
}

#[test]
fn without_an_outlier_none_is_named() {
    let folder = Folder::new();
    let understated = NOISE.replace("0.02", "0.001");
    folder.write("robot.toml", format!("{NOMINAL}{understated}"));
    for samples in [20, 30, 100] {
        folder.write("samples.csv", csv(&noisy(&true_arms(), samples, 0.3)));
        let run = folder.run("calibrate robot.toml samples.csv");
        assert_eq!(run.code, 1, "{}", run.stdout);
        assert!(!run.stderr.contains("worst"), "{}", run.stderr);
        assert!(
            run.stderr
                .contains("state the [noise] that repeated measurements")
        );
    }
    // Rounding errors are not outliers, either.
    let mut far = true_arms();
    far[1][7] += 12.0;
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder.write("samples.csv", csv(&exact(&far, 30)));
    let run = folder.run("calibrate robot.toml samples.csv");
    assert_eq!(run.code, 1, "{}", run.stdout);
    assert!(!run.stderr.contains("worst"), "{}", run.stderr);
}
