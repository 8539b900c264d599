//! The bed: the frame in which heights above it were measured.

use crate::export::frame::Frame;
use crate::files::samples_file::Readings;
use delta_cal::Robot;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Fewer heights determine no plane.
const LEAST: usize = 3;

/// The motion after which z is the height above the bed of these measurements: by least squares over the heights
/// that the robot has, z = a x + b y + c + height, and the least turn about x and y. `None` if they are too few or on
/// one line.
pub fn of_heights(robot: &Robot<f64>, samples: &Readings) -> Option<Frame> {
    let rows: Vec<_> = samples
        .rows
        .iter()
        .filter_map(|row| {
            let (_, height) = row.value.height?;
            let at = robot.forward(&row.value.joints).ok()?;
            Some((at, height))
        })
        .collect();
    if rows.len() < LEAST {
        return None;
    }
    let design = DMatrix::from_fn(rows.len(), 3, |row, column| {
        let (at, _) = rows.get(row).copied().unwrap_or_default();
        [at.x, at.y, 1.0][column]
    });
    let mut frame = Frame::default();
    // The turn is small: with it each height becomes exact after two or three rounds.
    for _ in 0..20 {
        let transform = frame.transform();
        let off = DVector::from_iterator(
            rows.len(),
            rows.iter()
                .map(|(at, height)| transform.apply(at).z - height),
        );
        let normal = design.tr_mul(&design);
        let solution = normal.cholesky()?.solve(&design.tr_mul(&off));
        let [a, b, c] = [0, 1, 2].map(|index| solution[index]);
        frame = tilted(&frame, a, b, c);
        if a.abs() + b.abs() < 1e-13 && c.abs() < 1e-10 {
            break;
        }
    }
    Some(frame)
}

/// After a further small turn that takes z = a x + b y + c to z = 0.
fn tilted(frame: &Frame, a: f64, b: f64, c: f64) -> Frame {
    let before = frame.transform();
    let normal = Vector3::new(-a, -b, 1.0).normalize();
    let (turn_x, turn_y) = (normal.y.asin(), -normal.x.asin());
    let small = Frame {
        shift: Vector3::zeros(),
        turns: Vector3::new(turn_x, turn_y, 0.0),
    }
    .transform();
    let rotation = small.rotation * before.rotation;
    let mut shift = before.translation;
    shift.z -= c;
    Frame {
        shift,
        turns: turns(&rotation),
    }
}

/// The turns about x, y and z of a rotation Rz Ry Rx.
fn turns(rotation: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(
        rotation[(2, 1)].atan2(rotation[(2, 2)]),
        -rotation[(2, 0)].clamp(-1.0, 1.0).asin(),
        rotation[(1, 0)].atan2(rotation[(0, 0)]),
    )
}
