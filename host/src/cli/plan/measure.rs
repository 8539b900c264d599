//! `delta-cal plan --measure` and `--compare`: instruments other than a tracker.

use super::arguments::PlanArguments;
use super::deliver::{deliver, failure};
use super::instruments::{InstrumentSigma, Lengths};
use crate::cli::failure::Failure;
use crate::cli::outputs;
use crate::cli::progress::Waiting;
use crate::planning::measurements::{
    Instrument, Kind, MeasurementRequest, Wishes, compare, plan_measurements,
};
use crate::render::json;
use crate::report::plan::{comparison, measurements};
use crate::{Frame, RobotFile};

fn request<'a>(
    arguments: &PlanArguments,
    robot: &'a RobotFile,
    kinds: Wishes,
) -> MeasurementRequest<'a> {
    let own = &arguments.instruments;
    MeasurementRequest {
        blocks: own.blocks.clone(),
        plane: own.plane,
        points: usize::from(own.points),
        lengths: own.length.map(|Lengths(low, high)| (low, high)),
        frame: own.frame.frame(),
        region: arguments.within,
        seed: arguments.seed,
        ..MeasurementRequest::new(robot, kinds, arguments.count.unwrap_or_default())
    }
}

/// Plans measurements of these kinds.
pub(super) fn measure(
    arguments: &PlanArguments,
    robot: &RobotFile,
    kinds: Wishes,
) -> Result<(), Failure> {
    check(arguments, &kinds)?;
    let request = request(arguments, robot, kinds);
    let waiting = Waiting::new(format!("planning {} measurements", request.count));
    let plan = plan_measurements(&request).map_err(|error| failure(robot, error))?;
    drop(waiting);
    let csv = measurements::csv(&plan.measurements, &plan.setup);
    let json = json::text(&measurements::json(&request, &plan));
    deliver(arguments, &csv, &json, &measurements::text(&request, &plan))
}

/// What makes no sense together.
fn check(arguments: &PlanArguments, kinds: &Wishes) -> Result<(), Failure> {
    let own = &arguments.instruments;
    let positions = kinds.0.iter().any(|wish| wish.kind.is_position());
    if own.frame.frame() == Frame::Sensor && !positions {
        return Err(Failure::Usage {
            cause: "--frame sensor is for coordinates, and --measure asks for none".to_owned(),
            remedy: "leave out --frame, or measure xy, z or xyz too".to_owned(),
        });
    }
    Ok(())
}

/// Compares instruments.
pub(super) fn compare_instruments(
    arguments: &PlanArguments,
    robot: &RobotFile,
) -> Result<(), Failure> {
    let own = &arguments.instruments;
    let mut instruments = Instrument::ALL;
    for InstrumentSigma(name, sigma) in &own.sigma {
        for instrument in instruments.iter_mut().filter(|own| own.name == name) {
            instrument.sigma = *sigma;
        }
    }
    let request = request(arguments, robot, Wishes::only(Kind::Plane));
    let mut waiting = None;
    let comparisons = compare(&request, &instruments, |instrument, count| {
        // One line at a time.
        drop(waiting.take());
        waiting = Some(Waiting::new(format!(
            "planning {count} measurements: {}",
            instrument.title
        )));
    });
    drop(waiting);
    let comparisons = comparisons.map_err(|error| failure(robot, error))?;
    let region = arguments.within.as_ref();
    let json = json::text(&comparison::json(&robot.name, region, &comparisons));
    let page = match &own.report {
        Some(_) => comparison::html(&robot.name, region, &comparisons)?,
        None => String::new(),
    };
    outputs::deliver(
        &[
            (arguments.json.as_deref(), &json),
            (own.report.as_deref(), &page),
        ],
        comparison::text(&robot.name, region, &comparisons),
    )
}
