use super::{Loss, SUSPECTED, WeightNormalization};

const BOTH: [Loss; 2] = [Loss::Huber, Loss::Tukey];

/// ρ, written anew from the literature: Huber (1964), Beaton and Tukey (1974).
fn rho(loss: Loss, r: f64) -> f64 {
    let size = r.abs();
    match loss {
        Loss::Huber if size <= 1.345 => size * size / 2.0,
        Loss::Huber => 1.345 * (size - 1.345 / 2.0),
        Loss::Tukey => {
            let c = 4.685;
            let inside = 1.0 - (size / c).min(1.0).powi(2);
            c * c / 6.0 * (1.0 - inside.powi(3))
        }
    }
}

/// Residuals on both sides, none at a corner.
fn residuals() -> impl Iterator<Item = f64> {
    (-930..=930).map(|k| f64::from(k) / 100.0 + 0.0017)
}

#[test]
fn the_weight_is_the_slope_of_rho_over_the_residual() {
    let step = 1e-5;
    for loss in BOTH {
        for r in residuals() {
            let psi = (rho(loss, r + step) - rho(loss, r - step)) / (2.0 * step);
            // Beyond this nothing counts, whatever the loss.
            let psi = if r.abs() < SUSPECTED { psi } else { 0.0 };
            assert!((loss.weight(r) * r - psi).abs() < 1e-8, "{loss:?} {r}");
        }
    }
}

#[test]
fn the_slope_is_that_of_the_influence() {
    let step = 1e-6;
    for loss in BOTH {
        for r in residuals() {
            let psi = |r: f64| loss.weight(r) * r;
            let slope = (psi(r + step) - psi(r - step)) / (2.0 * step);
            assert!((loss.slope(r) - slope).abs() < 1e-7, "{loss:?} {r}");
        }
    }
}

#[test]
fn what_is_suspected_or_not_a_number_counts_nothing() {
    for loss in BOTH {
        assert!((loss.weight(0.0_f64) - 1.0).abs() < 1e-15);
        assert!((loss.slope(0.0_f64) - 1.0).abs() < 1e-15);
        for r in [SUSPECTED, -SUSPECTED, f64::INFINITY, f64::NAN] {
            assert!(loss.weight(r).abs() < 1e-30 && loss.slope(r).abs() < 1e-30);
        }
    }
    assert!((Loss::Huber.weight(1.345_f64) - 1.0).abs() < 1e-15);
    assert!((Loss::Huber.slope(1.345_f64) - 1.0).abs() < 1e-15);
    assert!(Loss::Huber.weight(4.684) > 0.28);
}

/// The standard normal's quantiles: as many residuals, each as likely as the others.
fn normal_residuals() -> impl Iterator<Item = f64> {
    // The cumulative distribution by integration, inverted on the way.
    let count = 4000;
    let step = 1e-4;
    let mut z = -6.0;
    let mut below = 9.87e-10;
    (0..count).map(move |k| {
        let wanted = (f64::from(k) + 0.5) / f64::from(count);
        while below < wanted {
            let middle = z + step / 2.0;
            below += step * libm::exp(-middle * middle / 2.0) * 0.398_942_280_401_432_7;
            z += step;
        }
        z
    })
}

/// Residuals of these sizes, of so many dimensions, with a loss so many times as wide.
fn of<const K: usize>(
    sizes: [f64; K],
    dimensions: f64,
    stretch: f64,
) -> impl Iterator<Item = (f64, f64, f64)> {
    sizes
        .into_iter()
        .map(move |size| (size, dimensions, stretch))
}

/// As documented: of normal residuals κ is 0.96 for Tukey's loss and 1.01 for Huber's; either is
/// worth 95 % of the squared loss (Holland and Welsch 1977).
#[test]
fn of_normal_residuals_either_loss_is_worth_what_it_is_known_for() {
    for (loss, kappa) in [(Loss::Tukey, 0.96), (Loss::Huber, 1.01)] {
        let normalization = loss.normalization(normal_residuals().map(|r| (r.abs(), 1.0, 1.0)));
        assert!(
            (normalization.divisor - kappa).abs() < 0.005,
            "{loss:?} {normalization:?}"
        );
        // The variance of the M-estimate's location over the mean's: mean ψ²/(mean ψ′)².
        let mean = |f: &dyn Fn(f64) -> f64| normal_residuals().map(f).sum::<f64>() / 4000.0;
        let slope = mean(&|r| loss.slope(r));
        let efficiency = slope * slope / mean(&|r| (loss.weight(r) * r).powi(2));
        assert!((efficiency - 0.95).abs() < 0.005, "{loss:?} {efficiency}");
        assert!(
            (normalization.effective_samples - 4000.0 * slope / normalization.divisor).abs() < 1e-6
        );
    }
}

/// Three residuals of which one has no weight, by hand.
///
/// Huber: w = 1, ½, ψ = 1, 1.345, ψ′ = 1, 0 and κ = Σψ² Σw / (Σψr Σψ′).
#[test]
fn worth_by_hand() {
    let normalization = Loss::Huber.normalization(of([1.0, 2.69, 7.0], 1.0, 1.0));
    let divisor = (1.0 + 1.345 * 1.345) * 1.5 / (1.0 + 1.345 * 2.69);
    assert!((normalization.divisor - divisor).abs() < 1e-14);
    assert!(
        (normalization.effective_samples - 1.0 / divisor).abs() < 1e-14,
        "{normalization:?}"
    );

    // WeightNormalization less than one sample: their number is stated in its place.
    let normalization = Loss::Huber.normalization(of([1.4, 0.5, 7.0], 1.0, 1.0));
    assert!(
        (normalization.effective_samples - 2.0).abs() < 1e-14,
        "{normalization:?}"
    );

    // Vectors of three, twice as far for the same weight: of each size r the mean of ψ′ over the
    // directions is (2 w + ψ′)/3, of ψ² and ψ r a third of the whole.
    let normalization = Loss::Huber.normalization(of([2.0, 5.38, 0.5, 0.5], 3.0, 2.0));
    let influences = (4.0 + 2.69 * 2.69 + 0.5) / 3.0;
    let residuals = (4.0 + 2.69 * 5.38 + 0.5) / 3.0;
    let slopes = (3.0 + 1.0 + 3.0 + 3.0) / 3.0;
    let divisor = influences * 3.5 / (residuals * slopes);
    assert!(
        (normalization.divisor - divisor).abs() < 1e-14,
        "{normalization:?}"
    );
    assert!((normalization.effective_samples - slopes / divisor).abs() < 1e-14);
}

#[test]
fn samples_that_fit_exactly_are_worth_their_number() {
    for loss in BOTH {
        let exact = loss.normalization(of([0.0; 20], 1.0, 1.0));
        assert_eq!(
            exact,
            WeightNormalization {
                divisor: 1.0,
                effective_samples: 20.0
            }
        );
        // None is left, or nothing is known of their slope.
        let none = loss.normalization(of([9.0, 10.0], 1.0, 1.0));
        assert_eq!(
            none,
            WeightNormalization {
                divisor: 1.0,
                effective_samples: 0.0
            }
        );
    }
}
