//! Long streams: a robot that changes while it is measured, and a million samples.

use delta_cal::{Calibrator, Noise, Sample, Settings};
use delta_cal_tests::{
    Spread, generator, largest_difference, measurements, paper_robot, perturbed, to_single, uniform,
};
use nalgebra::Vector3;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A million samples in single precision, beside double precision: one by one, of which four wait
/// for each other; many at once; and in parts of a thousand that are merged.
#[test]
fn a_million_samples_leave_single_precision_intact() {
    let mut rng = generator(74, 0);
    let nominal = paper_robot::<f64>();
    let single_nominal = nominal.cast().unwrap();
    let truth = perturbed(&nominal, 1.0, 0.3 * DEGREE, Spread::Uniform, &mut rng);
    let poses = measurements(&truth, 1000, None, &mut rng);
    let single = Settings::default().with_noise(Noise::<f32>::new(0.02, 0.0).unwrap());
    let double = Settings::default().with_noise(Noise::new(0.02, 0.0).unwrap());
    let empty = Calibrator::<f32>::new(&single_nominal, &single);
    let (mut singly, mut in_blocks, mut merged) = (empty, empty, empty);
    let mut exact = Calibrator::<f64>::new(&nominal, &double);
    for _ in 0..1000 {
        let measured: Vec<_> = poses
            .iter()
            .map(|pose| {
                let jitter = [(); 3].map(|()| 0.02 * 3f64.sqrt() * uniform(&mut rng));
                Sample {
                    position: pose.position + Vector3::from(jitter),
                    ..*pose
                }
            })
            .collect();
        let rounded = to_single(&measured);
        let mut part = empty;
        for sample in &rounded {
            singly.add(sample).unwrap();
            part.add(sample).unwrap();
        }
        in_blocks.add_many(&rounded).unwrap();
        merged.merge(&part).unwrap();
        exact.add_many(&measured).unwrap();
    }
    assert_eq!(merged.samples(), 1_000_000);
    let error = |calibrator: &Calibrator<f32>| {
        let mut calibrator = *calibrator;
        let robot = calibrator.solve().unwrap().robot.cast().unwrap();
        largest_difference(&robot, &truth) * 1e3
    };
    let limit = largest_difference(&exact.solve().unwrap().robot, &truth) * 1e3;
    let (singly, in_blocks, merged) = (error(&singly), error(&in_blocks), error(&merged));
    println!(
        "a million samples of 20 µm, worst parameter: f32 one by one {singly:.2} µm, many at once \
         {in_blocks:.2} µm, merged {merged:.2} µm; f64 {limit:.2} µm"
    );
    // A block rounds R by ε/2 at random: ε √(1e6/4)/2 = 3e-5 of a millimetre's correction, times a
    // condition of some 30. In blocks of sixteen half of that, merged in parts of a thousand a
    // sixteenth.
    assert!(singly < limit + 0.9);
    assert!(in_blocks < limit + 0.45);
    assert!(merged < limit + 0.06);
}
