use super::boundary::forward_reaches;
use super::robots::{Case, cases, paper, perturbed, reach, symmetric, uniform, workspace};
use delta_cal_tests::size;
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// ∫ |det ∂X/∂q| dq over the joints' range, and one σ of it: the volume of what the forward model
/// sweeps, where no position is reached twice. Nothing of it knows the inverse or the boundary.
fn swept(case: &Case, draws: u32, rng: &mut Pcg32) -> (f64, f64) {
    let range = case.reach.limits.maximum() - case.reach.limits.minimum();
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..draws {
        let q = [(); 3].map(|()| {
            let fraction = f64::from(rng.next_u32()) / 2f64.powi(32);
            case.reach.limits.at(fraction)
        });
        let value = case.reach.position(&case.robot, &q).map_or(0.0, |x| {
            let jacobian = case.robot.platform_jacobian(&x, &q).unwrap();
            jacobian.by_joints.determinant().abs()
        });
        sum += value;
        squares += value * value;
    }
    let n = f64::from(draws);
    let (mean, cube) = (sum / n, range.powi(3));
    (cube * mean, cube * ((squares / n - mean * mean) / n).sqrt())
}

/// Four σ: a chance of 6e-5 for each robot.
const SIGMAS: f64 = 4.0;

#[test]
fn the_volume_is_that_of_the_forward_sweep() {
    let mut rng = Pcg32::seed_from_u64(11);
    let mut robots = vec![
        (paper(), None),
        (paper(), Some(30.0)),
        (symmetric(100.0, 200.0, 520.0), None),
    ];
    for number in 0..size(1, 9) {
        let forearm = (number % 3 == 0).then_some(45.0);
        robots.push((perturbed(&paper(), &mut rng, 20.0, 5.0), forearm));
    }
    for (number, (robot, forearm)) in robots.into_iter().enumerate() {
        let case = Case {
            name: format!("robot {number}"),
            robot,
            reach: reach(-50.0, 80.0, forearm),
        };
        let volume = workspace(&case, 60.0).volume();
        let (expected, sigma) = swept(&case, size(150_000, 400_000), &mut rng);
        let off = (volume.volume - expected).abs();
        println!(
            "{}: {:.3} ± {:.3}, swept {:.3} ± {:.3} l",
            case.name,
            volume.volume * 1e-6,
            volume.uncertainty * 1e-6,
            expected * 1e-6,
            sigma * 1e-6
        );
        assert!(off <= SIGMAS * sigma + volume.uncertainty, "{off}");
        // The count is worth something.
        assert!(sigma < 0.003 * expected);
    }
}

#[test]
fn the_volume_is_that_of_a_count_whatever_the_limits() {
    let mut rng = Pcg32::seed_from_u64(12);
    for case in cases().iter().take(8) {
        let workspace = workspace(case, 60.0);
        let volume = workspace.volume();
        let grid = &workspace.grid;
        let last = grid.counts.map(|count| count - 1);
        let (low, high) = (grid.node([0; 3]), grid.node(last));
        let draws = 6000_u32;
        let mut hits = 0;
        for _ in 0..draws {
            let at = Vector3::from_fn(|_, _| 0.5 + 0.5 * uniform(&mut rng));
            let x = low + (high - low).component_mul(&at);
            hits += u32::from(forward_reaches(case, &x));
        }
        let share = f64::from(hits) / f64::from(draws);
        let sigma = (share * (1.0 - share) / f64::from(draws)).sqrt();
        let expected = volume.volume / (high - low).product();
        println!(
            "{}: {expected:.4}, counted {share:.4} ± {sigma:.4}",
            case.name
        );
        assert!((share - expected).abs() <= SIGMAS * sigma, "{}", case.name);
    }
}

#[test]
fn the_stated_uncertainty_is_what_a_finer_grid_changes() {
    for case in cases() {
        let (coarse, fine) = (
            workspace(&case, 40.0).volume(),
            workspace(&case, 80.0).volume(),
        );
        let off = (coarse.volume - fine.volume).abs();
        println!(
            "{}: {:.4} ± {:.4}, finer {:.4}",
            case.name,
            coarse.volume * 1e-6,
            coarse.uncertainty * 1e-6,
            fine.volume * 1e-6
        );
        assert!(
            off <= 2.0 * coarse.uncertainty + fine.uncertainty,
            "{}",
            case.name
        );
    }
}
