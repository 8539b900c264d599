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
use serde::Serialize;
use serde::de::DeserializeOwned;
use wasm_bindgen::prelude::wasm_bindgen;

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

    /// What a file is, a table with the robot of a request.
    pub fn recognise(&self, name: &str, request: &str) -> String {
        answer(&parse(request).map(|own| recognise::one(&self.files, name, &own)))
    }

    /// `delta-cal calibrate`.
    pub fn calibrate(&self, request: &str) -> String {
        answer(&parse(request).and_then(|own| calibrate::run(&self.files, &own)))
    }

    /// `delta-cal export`.
    pub fn export(&self, request: &str) -> String {
        answer(&parse(request).and_then(|own| export::run(&self.files, &own)))
    }

    /// The export targets of a robot.
    pub fn targets(&self, request: &str) -> String {
        answer(&parse(request).and_then(|own| export::targets(&self.files, &own)))
    }

    /// `delta-cal plan`.
    pub fn plan(&self, request: &str) -> String {
        answer(&both(request).and_then(|(of, own)| plan::run(&self.files, &of, &own)))
    }

    /// `delta-cal validate`.
    pub fn validate(&self, request: &str) -> String {
        answer(&parse(request).and_then(|own| validate::run(&self.files, &own)))
    }

    /// `delta-cal simulate`: the next robots of a campaign.
    pub fn simulate(&mut self, request: &str) -> String {
        let done = parse(request).and_then(|own| campaign::run(&self.files, &own, &mut self.rows));
        answer(&done)
    }

    /// Shoulders, elbows and platform of a robot and of its calibration.
    pub fn skeleton(&self, request: &str) -> String {
        answer(&both(request).and_then(|(of, own)| picture::skeleton(&self.files, &of, &own)))
    }
}

fn parse<T: DeserializeOwned>(request: &str) -> Result<T, Fault> {
    serde_json::from_str(request).map_err(|error| Fault::of_request(error.to_string()))
}

/// What a request is about, and the rest of it.
fn both<T: DeserializeOwned>(request: &str) -> Result<(inputs::Request, T), Fault> {
    Ok((parse(request)?, parse(request)?))
}

/// `{"Ok": …}`, or `{"Err": …}` with a fault.
fn answer<T: Serialize>(done: &Result<T, Fault>) -> String {
    serde_json::to_string(done).unwrap_or_default()
}
