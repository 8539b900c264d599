//! What the page of `page/` asks: the commands of `delta-cal` over files in memory. Requests and answers are JSON, so that
//! they cross from the worker to the page as they are.
//!
//! ```text
//! folder      the files that were dropped, and the built-in example
//! fault       what is wrong, with line and remedy
//! recognise   what each file is
//! inputs      robot, readings and printer of a request
//! calibrate, campaign, export, plan, validate
//!             the commands; the texts are those that the command writes
//! picture     arms and bed, before and after
//! ```

mod calibrate;
mod campaign;
mod export;
mod fault;
mod folder;
mod inputs;
mod picture;
mod plan;
mod recognise;
mod validate;

use delta_cal_host::campaign::Row;
use fault::Fault;
use folder::Folder;
use serde::de::DeserializeOwned;
use wasm_bindgen::prelude::wasm_bindgen;

/// What `JSON.parse` makes of requests and answers.
#[wasm_bindgen(typescript_custom_section)]
const TEXTS: &str = "
export type Json<T> = string & { of?: T };
export type Answer<T> = Json<{ Ok: T; Err?: undefined } | { Ok?: undefined; Err: Fault }>;
";

/// The files of a page, and the robots of its campaign so far.
#[wasm_bindgen]
#[derive(Debug, Default)]
pub struct Session {
    files: Folder,
    rows: Vec<Row>,
}

#[wasm_bindgen]
impl Session {
    /// Without files.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file, or replaces the one of its name.
    pub fn put(&mut self, name: &str, bytes: &[u8]) {
        self.files.put(name, bytes);
    }

    /// Forgets a file.
    pub fn remove(&mut self, name: &str) {
        self.files.remove(name);
    }

    /// A file as text, if it is text.
    pub fn text(&self, name: &str) -> Option<String> {
        let text = self.files.table(name).ok()?;
        Some(text.text().to_owned())
    }
}

/// Questions with the types that JavaScript sees: `name(request) -> answer`.
macro_rules! questions {
    ($($(#[$about:meta])+ $name:ident($request:tt) -> $answer:tt = $run:expr;)+) => {
        #[wasm_bindgen]
        impl Session {$(
            $(#[$about])+
            #[wasm_bindgen(unchecked_return_type = $answer)]
            pub fn $name(&mut self, #[wasm_bindgen(unchecked_param_type = $request)] request: &str) -> String {
                let run: fn(&mut Self, &str) -> Result<_, Fault> = $run;
                // `{"Ok": …}`, or `{"Err": …}` with a fault.
                serde_json::to_string(&run(self, request)).unwrap_or_default()
            }
        )+}
    };
}

questions! {
    /// What a file is, a table with the robot of a request.
    recognise("Json<Request & RecogniseRequest>") -> "Answer<Recognised>" =
        |own, text| Ok(recognise::one(&own.files, &parse(text)?, &parse(text)?));
    /// `delta-cal calibrate`.
    calibrate("Json<Request>") -> "Answer<Calibrated>" =
        |own, text| calibrate::run(&own.files, &parse(text)?);
    /// `delta-cal export`.
    export("Json<ExportRequest>") -> "Answer<Exported>" =
        |own, text| export::run(&own.files, &parse(text)?);
    /// The export targets of a robot.
    targets("Json<ExportRequest>") -> "Answer<Named[]>" =
        |own, text| export::targets(&own.files, &parse(text)?);
    /// `delta-cal plan`.
    plan("Json<Request & PlanRequest>") -> "Answer<Planned>" =
        |own, text| plan::run(&own.files, &parse(text)?, &parse(text)?);
    /// `delta-cal validate`.
    validate("Json<Request>") -> "Answer<Validated>" =
        |own, text| validate::run(&own.files, &parse(text)?);
    /// The same of two files of one robot.
    compare("Json<Request>") -> "Answer<Compared>" =
        |own, text| validate::compare(&own.files, &parse(text)?);
    /// `delta-cal simulate`: the next robots of a campaign.
    simulate("Json<SimulateRequest>") -> "Answer<Simulated>" =
        |own, text| campaign::run(&own.files, &parse(text)?, &mut own.rows);
    /// Shoulders, elbows and platform of a robot and of its calibration.
    skeleton("Json<Request & SkeletonRequest>") -> "Answer<Skeleton>" =
        |own, text| picture::skeleton(&own.files, &parse(text)?, &parse(text)?);
}

fn parse<T: DeserializeOwned>(request: &str) -> Result<T, Fault> {
    serde_json::from_str(request).map_err(|error| Fault::of_request(error.to_string()))
}
