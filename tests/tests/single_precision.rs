//! The single-precision functions against double precision, in ULP; and many samples in constant memory.

use delta_cal::calibration::{Calibrator, Estimator, Ikm, Joint};
use delta_cal::simulate::standard_normal;
use delta_cal::{ArmIndex, Noise, Real, Sample, Settings};
use delta_cal_tests::{
    Spread, converted, generator, largest_difference, measurements, paper_robot, perturbed, size,
};

/// The distance of `value` from `exact` in units of the last place of a single-precision number of
/// that size, never finer than that of 2⁻²⁴: near the zeros of sine and cosine the error is absolute.
fn ulps(value: f32, exact: f64, finest: f64) -> f64 {
    let size = exact.abs().max(finest);
    let ulp = 2f64.powi(size.log2().floor() as i32 - 23);
    (f64::from(value) - exact).abs() / ulp
}

#[test]
fn sine_and_cosine_are_within_one_ulp() {
    let mut worst = (0f64, 0f32);
    let mut worst_far = (0f64, 0f32);
    let check = |x: f32, worst: &mut (f64, f32), finest: f64| {
        let (sine, cosine) = x.sine_cosine();
        let exact = f64::from(x);
        // Double precision is exact to 2⁻²⁹ of a single-precision ULP.
        for error in [
            ulps(sine, exact.sin(), finest),
            ulps(cosine, exact.cos(), finest),
        ] {
            if error > worst.0 {
                *worst = (error, x);
            }
        }
    };
    // Every 17th single-precision number from 2⁻²⁴ to 4π, both signs: the angles of joints and
    // parameters.
    let mut bits = 2f32.powi(-24).to_bits();
    let end = (4.0 * std::f32::consts::PI).to_bits();
    let mut tried = 0u64;
    while bits <= end {
        let x = f32::from_bits(bits);
        check(x, &mut worst, 2f64.powi(-12));
        check(-x, &mut worst, 2f64.powi(-12));
        bits += 17;
        tried += 2;
    }
    // And every 1009th up to the end of the range.
    let end = 8192f32.to_bits();
    while bits <= end {
        check(f32::from_bits(bits), &mut worst_far, 2f64.powi(-12));
        bits += 1009;
        tried += 1;
    }
    println!(
        "sine and cosine: {tried} angles, at most {:.3} ULP up to 4π (at {}), {:.3} ULP up to 8192 (at {})",
        worst.0, worst.1, worst_far.0, worst_far.1
    );
    assert!(worst.0 < 1.0, "{worst:?}");
    assert!(worst_far.0 < 1.0, "{worst_far:?}");
}

#[test]
fn sine_and_cosine_refuse_what_they_cannot_reduce() {
    for x in [8193f32, -8193.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        let (sine, cosine) = x.sine_cosine();
        assert!(sine.is_nan() && cosine.is_nan());
    }
    assert_eq!(0f32.sine_cosine(), (0.0, 1.0));
}

/// The bound that `Real` documents.
#[test]
fn inverse_square_root_is_within_two_and_a_half_ulp() {
    let mut worst = (0f64, 0f32);
    let mut bits = f32::MIN_POSITIVE.to_bits();
    let end = f32::MAX.to_bits();
    while bits <= end {
        let x = f32::from_bits(bits);
        let exact = 1.0 / f64::from(x).sqrt();
        let error = ulps(x.inverse_square_root(), exact, 0.0);
        if error > worst.0 {
            worst = (error, x);
        }
        bits += 97;
    }
    println!(
        "inverse square root: at most {:.3} ULP (at {:e})",
        worst.0, worst.1
    );
    assert!(worst.0 <= 2.5, "{worst:?}");
}

#[test]
fn inverse_square_root_of_no_square_is_no_number() {
    let not_a_number = f32::from_bits(0xffc0_0000);
    for x in [
        -1.0,
        -f32::MIN_POSITIVE,
        f32::NEG_INFINITY,
        f32::NAN,
        not_a_number,
    ] {
        assert!(x.inverse_square_root().is_nan(), "{x}");
    }
}

#[test]
#[allow(clippy::float_cmp)]
fn powers_of_two_below_are_exact() {
    for (x, expected) in [
        (480.0, 256.0),
        (1.0, 1.0),
        (0.75, 0.5),
        (-3.0, 2.0),
        (0.001, 2f64.powi(-10)),
    ] {
        assert_eq!(x.power_of_two_below(), expected);
        assert_eq!(f64::from((x as f32).power_of_two_below()), expected);
    }
}

/// How many thousands of samples. What is asserted of rounding holds at any number.
fn thousands() -> usize {
    size(30, 1000)
}

/// Samples in single precision, beside double precision: one by one, of which four wait for each other; many at once;
/// and in parts of a thousand that are merged. Rounding neither grows with their number nor with the noise that they
/// average out.
fn stays_intact<E: Estimator>() {
    let mut rng = generator(74, 0);
    let nominal = paper_robot::<f64>();
    let truth = perturbed(&nominal, 0.5, 0.003, Spread::Normal, &mut rng);
    let poses = measurements(&truth, 1000, None, &mut rng);
    let (position, joint) = (0.02, 3e-5);
    let single = Settings::default().with_noise(Noise::new(0.02_f32, 3e-5).unwrap());
    let double = Settings::default().with_noise(Noise::new(position, joint).unwrap());
    let empty = Calibrator::<f32, E>::new(&nominal.cast().unwrap(), &single);
    let (mut singly, mut in_blocks, mut merged) = (empty.clone(), empty.clone(), empty.clone());
    let mut exact = Calibrator::<f64, E>::new(&nominal, &double);
    for _ in 0..thousands() {
        let mut normal = |sigma: f64| sigma * standard_normal::<f64, _>(&mut rng);
        let measured: Vec<_> = poses
            .iter()
            .map(|pose| Sample {
                joints: pose.joints.map(|q| q + normal(joint)),
                position: pose.position.map(|own| own + normal(position)),
            })
            .collect();
        let rounded = converted(&measured);
        let mut part = empty.clone();
        for sample in &rounded {
            singly.add(sample).unwrap();
            part.add(sample).unwrap();
        }
        in_blocks.add_many(&rounded).unwrap();
        merged.merge(&part).unwrap();
        exact.add_many(&measured).unwrap();
    }
    assert_eq!(merged.samples(), 1000 * thousands() as u64);
    let error = |mut calibrator: Calibrator<f32, E>| {
        let outcome = calibrator.calibrate().unwrap();
        // A χ² of 30,000 residuals is known to 4e-3 of its root; W at the nominal robot is off by the robot's error over
        // its size, some 1e-3.
        for arm in ArmIndex::ALL {
            assert!((E::arm(&outcome, arm).residual_rms - 1.0).abs() < 0.02);
        }
        largest_difference(&E::robot(&outcome).cast().unwrap(), &truth) * 1e3
    };
    let limit = largest_difference(E::robot(&exact.calibrate().unwrap()), &truth) * 1e3;
    let (singly, in_blocks, merged) = (error(singly), error(in_blocks), error(merged));
    println!(
        "{},000 samples of 20 µm, worst parameter: f32 one by one {singly:.2} µm, many at once \
         {in_blocks:.2} µm, merged {merged:.2} µm; f64 {limit:.2} µm",
        thousands()
    );
    // A block rounds R by ε/2 at random: of a million ε √(1e6/4)/2 = 3e-5 of a millimetre's correction, times a condition
    // of some 30. In blocks of sixteen half of that, merged in parts of a thousand a sixteenth.
    let rounding = 0.9 * (thousands() as f64 / 1000.0).sqrt();
    assert!(singly < limit + rounding);
    assert!(in_blocks < limit + 0.5 * rounding);
    assert!(merged < limit + rounding / 16.0);
}

#[test]
fn any_number_of_samples_leaves_single_precision_intact() {
    stays_intact::<Ikm>();
    stays_intact::<Joint>();
}
