//! Readings and statements of a printer that contradict each other.

use super::area::{AGREE, off, scatter};
use super::assess::Printer;
use crate::calibration::Refused;
use crate::fit::solution::PARAMETERS;
use crate::fit::{Options, Solution, solve};
use crate::import::Imported;
use crate::text::rounded;
use delta_cal::Robot;
use delta_cal::robot::{Arm, Drive};
use nalgebra::SVector;

/// Noise so many times the usual is doubtful.
pub(crate) const DOUBTFUL: f64 = 3.0;
/// One reading of so many may contradict the others.
const READINGS_FOR_ONE: usize = 8;
/// The readings without which the noise is at most this part of itself explain it, with few degrees of freedom for each of
/// these: simulated printers with rough beds are then never refused (of 560), and 0.4 mm are found in 16 touches (266 of 280).
const EXPLAINED: f64 = 1.0 / 3.0;
const EXPLAINED_FOR_EACH: f64 = 0.1;

/// The names of readings that alone make the noise doubtful, and the noise of the others, in usual ones.
pub(crate) fn contradicting(
    imported: &Imported,
    solution: &Solution,
) -> Option<(Vec<String>, f64)> {
    let first = Printer::noise(solution);
    let (mut others, mut solution) = (imported.clone(), solution.clone());
    let (mut names, mut kinds) = (Vec::new(), Vec::new());
    let measured = imported.readings.rows.len() - imported.held;
    for _ in 0..=measured / READINGS_FOR_ONE {
        let index = Printer::furthest(&solution).filter(|own| *own < measured - names.len())?;
        kinds.push(others.readings.rows.remove(index).value.kind()?);
        names.push(others.names.remove(index));
        solution = solve(&others.robot, &others.readings, &Options::default()).ok()?;
        let own = solution
            .noise
            .iter()
            .filter(|own| kinds.contains(&own.kind));
        let freedom = own.map(|own| own.freedom).fold(f64::INFINITY, f64::min);
        let left = Printer::noise(&solution);
        let explained = first * EXPLAINED.min(EXPLAINED_FOR_EACH * freedom);
        if left < DOUBTFUL.min(explained) {
            return Some((names, left));
        }
    }
    None
}

/// One touch of so many may be bad.
const LEAST_TOUCHES: usize = 6;
/// A bad one is off by so many times what the others are, and never by less than that many times the usual noise.
const BAD: f64 = 6.0;
const TOUCH: f64 = 0.02;

/// The refusal of touches of which one decides, so that it has to be touched again before any line is pasted.
pub(crate) fn bad_touch(imported: &Imported) -> Option<Refused> {
    let off = off(imported);
    // The end stops of arms that motors turn make a bowl.
    if off.len() < LEAST_TOUCHES || imported.configured.drive() == Drive::Rotary {
        return None;
    }
    let without = |(index, at, own): &(usize, _, f64)| {
        let others = off.iter().filter(|other| other.0 != *index);
        let (mean, left) = scatter(others.map(|other| other.2));
        (left, *index, *at, own - mean)
    };
    let tried = off.iter().map(without);
    let (left, index, at, by) = tried.min_by(|one, other| one.0.total_cmp(&other.0))?;
    if left > AGREE || by.abs() < BAD * left.max(TOUCH) {
        return None;
    }
    let name = imported.names.get(index)?;
    let cause = format!(
        "One touch decides: {name}, at x {:.0}, y {:.0} mm, is {by:+.2} mm off, and the others agree with the \
         configuration to {left:.2} mm rms.",
        at.x, at.y
    );
    Some(Refused::new(
        cause,
        "Clean bed and nozzle, and touch that place again. If it is the same again, touch four more places around it.",
    ))
}

/// A common length with this σ is unknown, mm, and what is stated is contradicted by so many σ.
const UNKNOWN: f64 = 20.0;
const CONTRADICTED: f64 = 3.0;
/// Index of the rod among an arm's parameters.
const LB: usize = 7;

/// The refusal of a stated length of the rods, or radius, that the distances contradict.
pub(crate) fn contradicted_length(imported: &Imported) -> Option<Refused> {
    let [_, distances] = imported.counts();
    if distances == 0 || imported.robot.robot.drive() == Drive::Rotary {
        return None;
    }
    let (rods, radius) = imported.stated;
    let of_rods = rods.then(|| contradicted(imported, true)).flatten();
    let cause = of_rods.or_else(|| radius.then(|| contradicted(imported, false)).flatten())?;
    Some(Refused::new(
        cause,
        "Measure it again, between the joints of a rod or from the towers' axis to that of the platform's joints. If it is \
         right, the distances share an error: state --shrinkage.",
    ))
}

/// The stated mean length of the rods, or radius, and what the readings say of it if its σ is open, in words, if these
/// contradict each other.
fn contradicted(imported: &Imported, rods: bool) -> Option<String> {
    let robot = &imported.robot;
    let tolerance = robot.tolerance?;
    let (opened, sigma, words) = if rods {
        let words = "--rods states rods of";
        (tolerance.with_forearm(UNKNOWN), tolerance.forearm(), words)
    } else {
        let words = "--radius states a radius of";
        (tolerance.with_radius(UNKNOWN), tolerance.radius(), words)
    };
    let mut open = robot.clone();
    open.tolerance = Some(opened.ok()?);
    let found = solve(&open, &imported.readings, &Options::default()).ok()?;
    let length = |arm: &Arm<f64>| if rods { arm.lb() } else { arm.d().xy().norm() };
    let mean = |robot: &Robot<f64>| robot.arms().iter().map(length).sum::<f64>() / 3.0;
    let [own, is] = [mean(&robot.robot), mean(&found.robot)];
    let mut by_parameters = SVector::<f64, PARAMETERS>::zeros();
    for (index, arm) in robot.robot.arms().iter().enumerate() {
        if rods {
            by_parameters[8 * index + LB] = 1.0 / 3.0;
        } else {
            let out = arm.d().xy().normalize() / 3.0;
            by_parameters.fixed_rows_mut::<2>(8 * index).copy_from(&out);
        }
    }
    let variance = by_parameters.dot(&(found.of_parameters() * by_parameters));
    let spread = (variance + sigma.powi(2)).sqrt();
    ((is - own).abs() > CONTRADICTED * spread).then(|| {
        let (own, sigma) = (rounded(own), variance.max(0.0).sqrt());
        format!("{words} {own} mm; the distances say {is:.1} ± {sigma:.1} mm.")
    })
}
