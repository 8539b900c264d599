//! Alignment of two sets of points: exact motions, noise, planes, lines and reflections.

use delta_cal::frame::{AlignmentError, RigidTransform};
use delta_cal_tests::{generator, uniform};
use nalgebra::{Matrix3, Rotation3, Vector3};

fn random_motion(seed: u64) -> (RigidTransform<f64>, Vec<Vector3<f64>>) {
    let mut rng = generator(101, seed);
    let mut vector = || Vector3::from([(); 3].map(|()| uniform(&mut rng)));
    let axis = vector();
    let angle = vector().x * std::f64::consts::PI;
    let motion = RigidTransform {
        rotation: Rotation3::new(axis.normalize() * angle).into_inner(),
        translation: vector() * 3000.0,
    };
    let points = (0..12).map(|_| vector() * 300.0).collect();
    (motion, points)
}

fn aligned(
    motion: &RigidTransform<f64>,
    points: &[Vector3<f64>],
) -> Result<RigidTransform<f64>, AlignmentError> {
    RigidTransform::align(points.iter().map(|p| (*p, motion.apply(p))))
}

/// The least-squares rotation against the singular value decomposition's (Kabsch 1976), which this
/// project does not use: noise of a tenth of the points' spread, and mirrored points.
#[test]
fn noisy_and_mirrored_points_get_kabschs_rotation() {
    for seed in 0..500 {
        let (motion, points) = random_motion(seed);
        let mut rng = generator(102, seed);
        let mirrored = seed % 3 == 0;
        let pairs: Vec<_> = points
            .iter()
            .map(|p| {
                let from = if mirrored {
                    Vector3::new(-p.x, p.y, p.z)
                } else {
                    *p
                };
                let noise = Vector3::from([(); 3].map(|()| 30.0 * uniform(&mut rng)));
                (from, motion.apply(p) + noise)
            })
            .collect();
        let count = 12.0;
        let from_mean = pairs.iter().map(|p| p.0).sum::<Vector3<f64>>() / count;
        let to_mean = pairs.iter().map(|p| p.1).sum::<Vector3<f64>>() / count;
        let covariance = pairs.iter().fold(Matrix3::zeros(), |sum, (from, to)| {
            sum + (to - to_mean) * (from - from_mean).transpose()
        });
        let svd = covariance.svd(true, true);
        let (u, v_t) = (svd.u.unwrap(), svd.v_t.unwrap());
        let mut reflection = Matrix3::identity();
        reflection.m33 = (u * v_t).determinant().signum();
        let expected = u * reflection * v_t;
        let found = RigidTransform::align(pairs.iter().copied()).unwrap();
        assert!((found.rotation.determinant() - 1.0).abs() < 1e-13);
        // The gap of the eigenvalues of mirrored points can be small.
        assert!((found.rotation - expected).norm() < 1e-9, "seed {seed}");
    }
}

#[test]
fn too_few_points_and_bad_numbers_are_refused() {
    let (motion, points) = random_motion(0);
    assert_eq!(
        aligned(&motion, &points[..2]),
        Err(AlignmentError::TooFewPoints)
    );
    assert_eq!(
        aligned(&motion, &[points[0]; 5]),
        Err(AlignmentError::Collinear)
    );
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let mut spoilt = points.clone();
        spoilt[3].y = bad;
        assert_eq!(
            aligned(&motion, &spoilt),
            Err(AlignmentError::NonFinite),
            "{bad}"
        );
    }
}
