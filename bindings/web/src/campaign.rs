//! `delta-cal simulate` of one case: robots within the tolerance of a robot file, range by range.

use crate::fault::Fault;
use crate::folder::Folder;
use delta_cal_host::Method;
use delta_cal_host::campaign::{self, OneCase, Row, Spread};
use delta_cal_host::report;
use serde::{Deserialize, Serialize};
use tsify::Tsify;

#[derive(Debug, Default, Deserialize, Tsify)]
#[serde(default)]
#[tsify(rename = "SimulateRequest")]
pub(crate) struct Request {
    robot: String,
    /// Of the whole campaign.
    robots: u64,
    /// The first robot of this range; 0 begins a campaign.
    first: u64,
    /// Robots of this range.
    count: u64,
    poses: u64,
}

#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Simulated {
    /// The campaign file.
    toml: String,
    /// Robots so far.
    done: u64,
    /// Of all robots so far, once there are all.
    summary: Option<Summary>,
}

#[derive(Debug, Serialize, Tsify)]
struct Summary {
    text: String,
    csv: String,
    json: String,
    /// Position errors of each accepted robot before and after, mm.
    errors: Vec<[f64; 2]>,
}

/// The next range, to be added to those before it.
pub(crate) fn run(
    files: &Folder,
    request: &Request,
    rows: &mut Vec<Row>,
) -> Result<Simulated, Fault> {
    let robot = files.robot(&request.robot)?;
    let case = OneCase {
        robot: &request.robot,
        robots: request.robots,
        seed: 1,
        spread: Spread::Normal,
        poses: request.poses,
        method: Method::Joint,
        planned: false,
    };
    let plan = case.plan(&robot)?;
    let toml = case.to_toml(&robot).unwrap_or_default();
    if request.first == 0 {
        rows.clear();
    }
    let end = request.robots.min(request.first + request.count);
    rows.extend(campaign::run(&plan, &(request.first..end), &mut |_, _| {})?);
    let summary = (end == request.robots).then(|| summary(rows)).transpose()?;
    Ok(Simulated {
        toml,
        done: end,
        summary,
    })
}

fn summary(rows: &[Row]) -> Result<Summary, Fault> {
    let summaries = campaign::summarize(rows);
    let errors = rows
        .iter()
        .filter_map(|(_, row)| Some([row.error_before_mm?, row.error_after_mm?]));
    Ok(Summary {
        text: report::campaign::render(&summaries),
        csv: campaign::rows_csv(rows).map_err(|error| Fault::of_request(error.to_string()))?,
        json: report::json(&summaries),
        errors: errors.collect(),
    })
}
