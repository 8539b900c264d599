//! Where the sensor stands: the frame in which the measured points are where the robot of the file
//! would be.

use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::joint;
use crate::fit::options::Options;
use crate::fit::outlier::OUTLIER;
use crate::fit::samples::{Samples, in_frame};
use crate::fit::weights::Weights;
use crate::text::words::count;
use delta_cal::frame::{AlignmentError, RigidTransform};
use delta_cal::robust::{Loss, WeighedSample, robust_fit};
use delta_cal::{Robot, Settings};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Points whose second extent is below this part of the first lie on a line.
const LINE: f64 = 0.05;
/// Points that scatter by less than this part of the forearm lie in one spot.
const SPOT: f64 = 0.02;

/// Each leaves the square of the angle that the one before it left: of 0.01 rad nothing.
const REFINEMENTS: usize = 2;

/// Concentration steps towards the half of the points that agree best.
const CONCENTRATIONS: usize = 20;

/// A point where the robot of the file would be, and where it was measured.
type Pair = (Vector3<f64>, Vector3<f64>);

/// From the robot's frame to the sensor's: aligns where the nominal robot should have been with
/// where it was measured, with a robust fit only the points that agree. Or why the points do not fix
/// the frame, in words.
pub(crate) fn find(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Result<RigidTransform<f64>, String> {
    let pairs: Vec<_> = samples
        .rows
        .iter()
        .filter_map(|row| {
            let expected = robot.robot.forward(&row.value.joints).ok()?;
            Some((expected, row.value.position))
        })
        .collect();
    let [arm, ..] = robot.robot.arms();
    if let Some(how) = degenerate(pairs.iter().map(|(_, measured)| *measured), arm.lb()) {
        return Err(format!(
            "the measured points lie {how}, so they do not determine the sensor's frame"
        ));
    }
    let frame = match options.loss {
        None => RigidTransform::align(pairs.iter().copied()),
        Some(_) => align_most(pairs.clone()),
    };
    frame.map_err(|error| match error {
        AlignmentError::TooFewPoints => {
            let be = if pairs.len() == 1 { "is" } else { "are" };
            format!(
                "the sensor's frame needs at least 3 samples whose joint angles the robot of the \
                 file can reach, and there {be} {}",
                count(pairs.len(), "such sample")
            )
        }
        error => format!("the sensor's frame cannot be found: {error}"),
    })
}

/// The same frame as the calibration has it: the nominal robot does not stand quite where it fits the points
/// best, since its parameters are off. A frame that the calibration cannot improve stays as it is.
pub(crate) fn refined(
    mut frame: RigidTransform<f64>,
    robot: &Robot<f64>,
    measured: &SamplesFile,
    settings: &Settings<f64>,
    loss: Option<Loss>,
) -> RigidTransform<f64> {
    for _ in 0..REFINEMENTS {
        let inverse = frame.inverse();
        let rows = measured.rows.iter();
        let samples: Vec<_> = rows
            .map(|row| in_frame(&row.value, Some(&inverse)))
            .collect();
        let weights = match loss {
            None => None,
            Some(loss) => {
                let mut work = vec![WeighedSample::vacant(); samples.len()];
                let Ok(found) = robust_fit(robot, settings, &samples, loss, &mut work) else {
                    return frame;
                };
                Some(Weights {
                    factors: work.iter().map(WeighedSample::factor).collect(),
                    effective_samples: found.effective_samples,
                })
            }
        };
        let all = match &measured.all {
            // A robust fit knows the weights of those in memory.
            Some(all) if weights.is_none() => Samples::on_disk(all, &samples, Some(&frame)),
            _ => Samples::InMemory(&samples),
        };
        let Ok(motion) = joint::frame_motion(robot, all, weights.as_ref(), settings) else {
            return frame;
        };
        let rotation = *Rotation3::new(motion.rotation).matrix();
        let moved = RigidTransform {
            rotation,
            translation: motion.translation + motion.centre - rotation * motion.centre,
        };
        frame = RigidTransform {
            rotation: frame.rotation * moved.rotation,
            translation: frame.apply(&moved.translation),
        };
    }
    frame
}

/// The alignment that wrong points do not spoil: least trimmed squares by concentration steps (see the
/// core's robust fit), and then of all points that are no outliers.
fn align_most(mut pairs: Vec<Pair>) -> Result<RigidTransform<f64>, AlignmentError> {
    let align = |pairs: &[Pair]| RigidTransform::align(pairs.iter().copied());
    let mut frame = align(&pairs)?;
    let half = pairs.len().div_ceil(2);
    let off = |frame: &RigidTransform<f64>, (expected, measured): &Pair| {
        (frame.apply(expected) - measured).norm()
    };
    for _ in 0..CONCENTRATIONS {
        pairs.sort_by(|a, b| off(&frame, a).total_cmp(&off(&frame, b)));
        let Some(Ok(next)) = pairs.get(..half).map(align) else {
            return Ok(frame);
        };
        frame = next;
    }
    let bound = half
        .checked_sub(1)
        .and_then(|middle| pairs.get(middle))
        .map_or(f64::INFINITY, |pair| OUTLIER * off(&frame, pair));
    pairs.retain(|pair| off(&frame, pair) <= bound);
    align(&pairs)
}

/// Three points or more that leave a rotation of the frame free, or nearly so.
pub(crate) fn degenerate(
    points: impl ExactSizeIterator<Item = Vector3<f64>> + Clone,
    forearm: f64,
) -> Option<&'static str> {
    if points.len() < 3 {
        return None;
    }
    let number = points.clone().fold(0.0, |count, _| count + 1.0);
    let mean = points.clone().sum::<Vector3<f64>>() / number;
    let scatter = points.fold(Matrix3::zeros(), |sum, point| {
        sum + (point - mean) * (point - mean).transpose()
    });
    let mut extents = scatter.symmetric_eigenvalues().data.0[0];
    extents.sort_by(|a, b| b.total_cmp(a));
    let [first, second, _] = extents.map(|value| value.max(0.0).sqrt());
    if first < SPOT * forearm * number.sqrt() {
        Some("in one spot")
    } else if second < LINE * first {
        Some("(nearly) on a line")
    } else {
        None
    }
}
