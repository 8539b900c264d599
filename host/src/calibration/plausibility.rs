//! Whether the calibrated parameters are near enough to the robot file's to be errors of
//! manufacture and assembly, where no tolerance says how large those are.

use crate::text::words::{in_file_units, list};
use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::{ArmIndex, Parameter, Real, Robot};

/// Percent of the forearm, degrees, and percent of a scale, beyond which a change is a mistake and not an error.
const IMPLAUSIBLE: f64 = 10.0;
/// The same beyond which a change is doubtful.
const DOUBTFUL: f64 = 2.0;
/// How many changes a warning names.
const NAMED: usize = 3;

/// How the calibration changed a parameter; millimetres or radians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Change {
    arm: ArmIndex,
    parameter: Parameter,
    before: f64,
    after: f64,
    /// The joint's zero moved by as much, for a change of La_y.
    joint_zero: Option<f64>,
    /// In percent of the forearm, in degrees, or in percent.
    size: f64,
}

/// Every parameter's change, the largest first.
fn changes(before: &Robot<f64>, after: &Robot<f64>) -> Vec<Change> {
    let mut changes = Vec::with_capacity(24);
    for arm in ArmIndex::ALL {
        let (from, to) = (before.arm(arm), after.arm(arm));
        let zero = |arm: &delta_cal::robot::Arm<f64>| {
            arm.get(Parameter::LaY).angle_over(arm.get(Parameter::LaX))
        };
        for parameter in from.drive().parameters().iter().copied() {
            let (mut before, after) = (from.get(parameter), to.get(parameter));
            if parameter == Parameter::Theta {
                // 359° and −1° are the same azimuth.
                before +=
                    ((after - before) / std::f64::consts::TAU).round() * std::f64::consts::TAU;
            }
            let change = (after - before).abs();
            changes.push(Change {
                arm,
                parameter,
                before,
                after,
                joint_zero: (parameter == Parameter::LaY).then(|| zero(to) - zero(from)),
                size: match parameter.kind() {
                    ParameterKind::Length => 100.0 * change / from.lb(),
                    ParameterKind::Angle => change.to_degrees(),
                    ParameterKind::Ratio => 100.0 * change,
                },
            });
        }
    }
    changes.sort_by(|a, b| b.size.total_cmp(&a.size));
    changes
}

/// The largest change, if it is no error of manufacture: "theta of arm 1 is … in the robot file
/// and came out as …".
pub(crate) fn implausible(before: &Robot<f64>, after: &Robot<f64>) -> Option<String> {
    let largest = changes(before, after).into_iter().next()?;
    (largest.size > IMPLAUSIBLE).then(|| {
        let limit = match largest.parameter.kind() {
            ParameterKind::Length => format!("{IMPLAUSIBLE} % of the forearm"),
            ParameterKind::Angle => format!("{IMPLAUSIBLE}°"),
            ParameterKind::Ratio => format!("{IMPLAUSIBLE} %"),
        };
        format!(
            "{} of {} is {} in the robot file, and the fit makes it {}; a difference of more than \
             {limit} is not credible without a stated [tolerance]",
            largest.parameter,
            largest.arm,
            in_file_units(largest.parameter, largest.before),
            in_file_units(largest.parameter, largest.after),
        )
    })
}

/// Whether a change is too large for an error of manufacture. Where the end stops of towers stand is chosen, not made.
pub(crate) fn is_another_robot(before: &Robot<f64>, after: &Robot<f64>) -> bool {
    changes(before, after).iter().any(|change| {
        let chosen = before.drive() == Drive::Linear && change.parameter == Parameter::Zero;
        change.size > DOUBTFUL && !chosen
    })
}

/// The largest changes, if they are large: "La_y of arm 2 by +12.000 mm (…), … and …".
pub(crate) fn doubtful(before: &Robot<f64>, after: &Robot<f64>) -> Option<String> {
    let named: Vec<_> = changes(before, after)
        .into_iter()
        .filter(|change| change.size > DOUBTFUL)
        .take(NAMED)
        .map(|change| {
            let by = in_file_units(change.parameter, change.after - change.before);
            let zero = change.joint_zero.map_or(String::new(), |zero| {
                format!(" (the joint's zero by {:.3}°)", zero.to_degrees())
            });
            format!("{} of {} by {by}{zero}", change.parameter, change.arm)
        })
        .collect();
    (!named.is_empty()).then(|| list(&named))
}
