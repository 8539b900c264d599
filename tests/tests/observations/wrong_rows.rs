//! Robust fits of observations of which some are wrong, beside the plain fit to the right ones.

use crate::observations::robots::{
    ANGLE, KINDS, Kind, LENGTH, N, calibrated, difference, measured, relative, with_instruments,
};
use delta_cal::SymmetricRobot;
use delta_cal::calibration::Settings;
use delta_cal::observations::{
    ObservationProblem, ObservationRow, RobustObservationError, robust_fit_observations,
};
use delta_cal::robust::{Loss, RobustRefusal, WeighedSample};
use delta_cal_tests::documents::print_campaign;
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{Spread, generator, perturbed, size};
use rand_core::Rng;
use rand_pcg::Pcg32;

const ROWS: usize = 45;

/// What came of robust fits.
#[derive(Debug, Default)]
struct Found {
    robots: u32,
    refused: u32,
    /// Error of relative positions of the robust fit over that of the fit to the right rows.
    ratios: Vec<f64>,
    wrong: u32,
    wrong_named: u32,
    right: u32,
    right_named: u32,
}

/// A row of which every reading is off by 0.5 to 5 mm.
fn wrong(row: &ObservationRow<f64>, rng: &mut Pcg32) -> ObservationRow<f64> {
    let mut off = |value: f64| {
        let part = f64::from(rng.next_u32()) / f64::from(u32::MAX);
        let size = 0.5 * 10f64.powf(part);
        value
            + if rng.next_u32().is_multiple_of(2) {
                size
            } else {
                -size
            }
    };
    let mut observation = *row.observation();
    for coordinate in observation.position.iter_mut().flatten() {
        *coordinate = off(*coordinate);
    }
    if let Some(height) = &mut observation.height {
        height.height = off(height.height);
    }
    if let Some(distance) = &mut observation.distance {
        distance.distance = off(distance.distance);
    }
    ObservationRow::new(observation)
}

fn trial(kind: Kind, geometry: usize, seed: u64, wrong_rows: usize, loss: Loss, found: &mut Found) {
    let (_, nominal) = geometries()[geometry];
    let mut rng = generator(seed, geometry as u64);
    let truth = perturbed(
        &nominal,
        LENGTH,
        ANGLE.to_radians(),
        Spread::Normal,
        &mut rng,
    );
    let mut rows = measured(kind, &truth, ROWS, &mut rng);
    // Every fifth row or so: no instrument keeps only wrong ones.
    let is_wrong = |index: usize| index % 5 == 2 && index / 5 < wrong_rows;
    let mut right: Vec<_> = (0..ROWS)
        .filter(|index| !is_wrong(*index))
        .map(|index| rows[index])
        .collect();
    let Some(clean) = calibrated(kind, &nominal, &mut right) else {
        return;
    };
    for index in (0..ROWS).filter(|index| is_wrong(*index)) {
        rows[index] = wrong(&rows[index], &mut rng);
    }
    let mut work = [WeighedSample::vacant(); ROWS];
    let outcome = with_instruments(kind, |instruments, settings| {
        robust_fit_observations::<f64, N, 41, 861>(
            &nominal,
            instruments,
            &mut rows,
            settings,
            loss,
            &mut work,
        )
    });
    found.robots += 1;
    let Ok(outcome) = outcome else {
        found.refused += 1;
        return;
    };
    let jacobian = relative(&truth, &mut rng);
    let error = |robot| (&jacobian * difference(robot, &truth)).norm_squared();
    found
        .ratios
        .push((error(&outcome.fit.robot) / error(&clean.robot)).sqrt());
    for (index, own) in work.iter().enumerate() {
        let (all, named) = if is_wrong(index) {
            (&mut found.wrong, &mut found.wrong_named)
        } else {
            (&mut found.right, &mut found.right_named)
        };
        *all += 1;
        *named += u32::from(own.suspected());
    }
}

/// Some of 45 rows wrong, or none: 9 kinds, with all eight geometries in the long campaign.
#[test]
fn wrong_rows_are_left_out_and_right_ones_are_not() {
    let (robots, step) = (size(1, 4), size(2, 1));
    let mut rows = Vec::new();
    for (wrong_rows, loss) in [(4, Loss::Tukey), (8, Loss::Huber), (0, Loss::Tukey)] {
        let mut all = Found::default();
        for kind in KINDS {
            for geometry in (0..geometries().len()).step_by(step) {
                for robot in 0..robots {
                    trial(kind, geometry, 7 + robot, wrong_rows, loss, &mut all);
                }
            }
        }
        all.ratios.sort_by(f64::total_cmp);
        let part = |named: u32, of: u32| 100.0 * f64::from(named) / f64::from(of.max(1));
        let rank = |percent: usize| all.ratios[(all.ratios.len() - 1) * percent / 100];
        let refused = part(all.refused, all.robots);
        let (named, wrongly) = (
            part(all.wrong_named, all.wrong),
            part(all.right_named, all.right),
        );
        let row = format!(
            "| {wrong_rows} of {ROWS} | `{}` | {named:.1} % | {wrongly:.2} % | {:.2} | {:.1} | {refused:.1} % |",
            if loss == Loss::Tukey {
                "tukey"
            } else {
                "huber"
            },
            rank(50),
            rank(90),
        );
        rows.push(row);
        // Hardly more rows than parameters: some wrong rows look right. Few enough of the right ones look wrong.
        assert!(wrongly < 1.0, "{wrongly} %");
        assert!(rank(50) < 1.1, "{}", rank(50));
        if wrong_rows > 0 {
            assert!(named > 90.0, "{named} %");
        }
        let allowed = [1.0, 6.0, 20.0][wrong_rows / 4];
        assert!(refused < allowed, "{refused} %");
    }
    for row in rows {
        print_campaign("docs/instruments.md", &row);
    }
}

/// A few sets of rows of which every eighth is off by 0.5 to 5 mm, 25 σ or more: these are named and no others, and
/// what is reported is of the others.
#[test]
#[allow(clippy::cast_precision_loss)]
fn the_wrong_rows_of_a_set_are_named_and_do_not_count() {
    let (_, nominal) = geometries()[0];
    for (kind, with_tolerance, readings) in [
        (Kind::GaugeBlocks, true, 1.0),
        (Kind::Tracker, true, 3.0),
        (Kind::Tracker, false, 3.0),
    ] {
        for (seed, loss) in [(1, Loss::Tukey), (2, Loss::Tukey), (3, Loss::Huber)] {
            let mut rng = generator(1650 + seed, 0);
            let angle = ANGLE.to_radians();
            let truth = perturbed(&nominal, LENGTH, angle, Spread::Normal, &mut rng);
            let mut rows = measured(kind, &truth, ROWS, &mut rng);
            let is_wrong = |index: usize| index % 8 == 5;
            let mut right: Vec<_> = (0..ROWS)
                .filter(|index| !is_wrong(*index))
                .map(|index| rows[index])
                .collect();
            for index in (0..ROWS).filter(|index| is_wrong(*index)) {
                rows[index] = wrong(&rows[index], &mut rng);
            }
            let mut work = [WeighedSample::vacant(); ROWS];
            with_instruments(kind, |instruments, settings| {
                let settings = if with_tolerance {
                    *settings
                } else {
                    Settings::new()
                };
                let clean =
                    ObservationProblem::<f64, N>::prepare(&nominal, instruments, &mut right)
                        .unwrap()
                        .solve::<41, 861>(&settings)
                        .unwrap();
                let outcome = robust_fit_observations::<f64, N, 41, 861>(
                    &nominal,
                    instruments,
                    &mut rows,
                    &settings,
                    loss,
                    &mut work,
                )
                .unwrap();
                for (index, own) in work.iter().enumerate() {
                    assert_eq!(own.suspected(), is_wrong(index), "{kind:?} {index}");
                    assert_eq!(rows[index].weight() == 0.0, is_wrong(index));
                }
                assert_eq!(outcome.suspected, ROWS - right.len());
                // Of rows without gross errors a loss of 95 % efficiency keeps nearly all.
                let (effective, count) = (outcome.effective_samples, right.len() as f64);
                assert!((0.8 * count..=count).contains(&effective), "{effective}");
                let estimate = &outcome.fit.estimate;
                assert!((estimate.effective_samples / effective - 1.0).abs() < 1e-12);
                let held: f64 = estimate.prior_share.iter().sum();
                let freedom = readings * effective - (N as f64 - held);
                assert!((estimate.degrees_of_freedom - freedom).abs() < 1e-6);
                // The difference of the two fits has a variance of 1/0.95 − 1 of theirs.
                let covariance = clean.estimate.covariance.unwrap();
                for (index, apart) in difference(&outcome.fit.robot, &clean.robot)
                    .iter()
                    .enumerate()
                {
                    let sigma = covariance[(index, index)].sqrt();
                    assert!(
                        apart.abs() < 1.2 * sigma,
                        "{kind:?} {index}: {apart} of {sigma}"
                    );
                }
            });
        }
    }
}

/// Rows that the nominal robot does not reach do not count; of those that do there must be sixteen.
#[test]
fn too_few_rows_that_count_are_refused() {
    // Its forearms are too short for level upper arms.
    let nominal = SymmetricRobot {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 420.0,
    };
    let nominal = nominal.robot().unwrap();
    let mut rng = generator(1655, 0);
    let kind = Kind::GaugeBlocks;
    let rows = measured(kind, &nominal, 17, &mut rng);
    let mut beyond = *rows[0].observation();
    beyond.joints = [0.0; 3];
    let beyond = ObservationRow::new(beyond);
    let few = |samples| {
        let needed = 16;
        Err(RobustObservationError::Refused(
            RobustRefusal::TooFewSamples { samples, needed },
        ))
    };
    let no_room = Err(RobustObservationError::Refused(RobustRefusal::NoRoom {
        samples: 17,
    }));
    let all = rows.clone();
    let mut with_beyond = rows.clone();
    (with_beyond[3], with_beyond[4]) = (beyond, beyond);
    for (mut rows, room, expected) in [
        (rows.clone(), 17, Ok(())),
        (rows[..16].to_vec(), 16, Ok(())),
        (rows[..15].to_vec(), 15, few(15)),
        (with_beyond, 17, few(15)),
        (rows, 16, no_room),
    ] {
        let mut work = vec![WeighedSample::vacant(); room];
        let found = with_instruments(kind, |instruments, settings| {
            robust_fit_observations::<f64, N, 41, 861>(
                &nominal,
                instruments,
                &mut rows,
                settings,
                Loss::Tukey,
                &mut work,
            )
        });
        assert_eq!(found.map(|_| ()), expected);
    }
    // One that does not count changes nothing.
    let fitted = |rows: &[ObservationRow<f64>]| {
        let mut work = vec![WeighedSample::vacant(); rows.len()];
        let outcome = with_instruments(kind, |instruments, settings| {
            robust_fit_observations::<f64, N, 41, 861>(
                &nominal,
                instruments,
                &mut rows.to_vec(),
                settings,
                Loss::Tukey,
                &mut work,
            )
        });
        outcome.unwrap()
    };
    let (without, with) = (fitted(&all), fitted(&[all.as_slice(), &[beyond]].concat()));
    let difference = with.effective_samples - without.effective_samples;
    assert!(difference.abs() < 1e-9, "{difference}");
    assert!(with.fit.robot == without.fit.robot);
}
