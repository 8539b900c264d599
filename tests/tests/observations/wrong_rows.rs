//! Robust fits of observations of which some are wrong, beside the plain fit to the right ones.

use crate::observations::robots::{
    ANGLE, KINDS, Kind, LENGTH, N, calibrated, difference, measured, relative, with_instruments,
};
use delta_cal::observations::{ObservationRow, robust_fit_observations};
use delta_cal::robust::{Loss, WeighedSample};
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
