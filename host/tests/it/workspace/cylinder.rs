use super::robots::{cases, workspace};
use delta_cal_host::workspace::cylinders;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Points of a solid cylinder, its surface included.
fn solid(diameter: f64, bottom: f64, top: f64) -> impl Iterator<Item = Vector3<f64>> {
    (0..540).flat_map(move |line| {
        let (sin, cos) = (TAU * f64::from(line) / 540.0).sin_cos();
        (0..=6).flat_map(move |ring| {
            let r = 0.5 * diameter * f64::from(ring) / 6.0;
            (0..=20).map(move |level| {
                let z = bottom + (top - bottom) * f64::from(level) / 20.0;
                Vector3::new(r * cos, r * sin, z)
            })
        })
    })
}

#[test]
fn every_point_of_a_cylinder_is_inside_and_a_larger_one_is_not() {
    for case in cases() {
        let workspace = workspace(&case, 60.0);
        let cylinders = cylinders(&workspace);
        let size = workspace.grid.spacing * 60.0;
        assert!(!cylinders.is_empty(), "{}", case.name);
        for (index, cylinder) in cylinders.iter().enumerate() {
            if index > 0 && index % 9 != 0 {
                continue;
            }
            let (d, low, high) = (cylinder.diameter, cylinder.bottom, cylinder.top);
            let outside = solid(d, low, high)
                .filter(|x| !workspace.contains(x))
                .count();
            assert_eq!(outside, 0, "{}: {cylinder:?}", case.name);
            // A thousandth of the workspace's size, at both ends, and the tolerance.
            let more = 1e-3 * size + 3.0 * workspace.tolerance;
            let higher = solid(d, low - more, high + more);
            assert!(
                higher.into_iter().any(|x| !workspace.contains(&x)),
                "{}: {cylinder:?}",
                case.name
            );
        }
        let largest = cylinders[0].volume();
        assert!(
            cylinders
                .iter()
                .all(|cylinder| cylinder.volume() <= largest)
        );
        let narrower = cylinders[1..].windows(2);
        assert!(
            narrower
                .into_iter()
                .all(|pair| pair[0].height() >= pair[1].height() - 1e-6 * size
                    && pair[0].diameter < pair[1].diameter),
            "{}",
            case.name
        );
    }
}
