//! `delta-cal validate`.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs::Request;
use delta_cal_host::files::document::Document;
use delta_cal_host::report::validation as report;
use delta_cal_host::validation::{self, Comparison, check_independent, validate};
use delta_cal_host::{RobotFile, read_samples};
use serde::Serialize;
use tsify::Tsify;

#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Validated {
    verdict: &'static str,
    /// The certificate.
    html: String,
    json: String,
}

/// Two files of one robot.
#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Compared {
    text: String,
    json: String,
}

/// The robot of a request against the newer file in place of its samples.
pub(crate) fn compare(files: &Folder, request: &Request) -> Result<Compared, Fault> {
    let newer = request.samples.first().map_or("", String::as_str);
    let found = Comparison::of(&files.robot(&request.robot)?, &files.robot(newer)?)?;
    Ok(Compared {
        text: report::changes(&found),
        json: report::changes_json(&found),
    })
}

pub(crate) fn run(files: &Folder, request: &Request) -> Result<Validated, Fault> {
    let missing = |what: &str| Fault::new(format!("{what} is missing"), "choose one");
    let text = files.settings(&request.robot)?;
    let robot = RobotFile::read(&text)?;
    let samples = request.samples(files)?;
    let samples = samples.ok_or_else(|| missing("a file of check measurements"))?;
    let limit = request.limit.ok_or_else(|| missing("the limit"))?;
    let document = Document::new(&robot, &text, &samples, request.now);
    check_independent(&text, &samples)?;
    let readings = read_samples(&samples, &robot, &request.options())?;
    let asked = validation::Request {
        limit,
        frame: request.frame(),
        stored: request.stored,
    };
    let mut found = validate(&robot, &readings, asked)?;
    if request.guard {
        found = found.guarded(&robot);
    }
    Ok(Validated {
        verdict: found.verdict.name(),
        html: report::certificate(&found, &document),
        json: report::json(&found, &document),
    })
}
