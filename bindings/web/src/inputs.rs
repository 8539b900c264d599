//! What a request is about: a robot, its readings, and the printer if it is one.

use crate::fault::Fault;
use crate::folder::Folder;
use delta_cal_host::files::document::Document;
use delta_cal_host::files::length::measured;
use delta_cal_host::import::{Firmware, Imported, Stated, printed, shrinkage};
use delta_cal_host::{
    ColumnMapping, Frame, InputError, InputText, Method, Options, Readings, RobotFile, printer,
    read_samples,
};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What the page asks for. Names are of its files.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Request {
    /// A robot file or a printer's configuration.
    pub(crate) robot: String,
    /// One file, or joints and then positions.
    pub(crate) samples: Vec<String>,
    columns: Option<String>,
    /// Whose configuration it is, where its text does not say.
    firmware: Option<String>,
    /// Of a printer, as the options of the command, in mm without a unit; empty if not stated.
    rods: String,
    radius: String,
    printed: String,
    shrinkage: String,
    method: Option<Method>,
    robust: bool,
    /// Whether coordinates are in the sensor's frame.
    pub(crate) sensor: bool,
    /// Whether that is the frame in the robot file.
    pub(crate) stored: bool,
    /// mm.
    pub(crate) limit: Option<f64>,
    /// Seconds since the beginning of 1970.
    pub(crate) now: u64,
}

/// What is calibrated, from what, and the files that say so.
#[derive(Debug)]
pub(crate) struct Inputs {
    pub(crate) robot: RobotFile,
    pub(crate) readings: Readings,
    pub(crate) document: Document,
    pub(crate) printer: Option<Imported>,
}

impl Request {
    pub(crate) fn options(&self) -> Options {
        Options {
            method: self.method,
            robust: self.robust,
            frame: self.frame(),
            of_printer: false,
        }
    }

    pub(crate) fn frame(&self) -> Frame {
        if self.sensor {
            Frame::Sensor
        } else {
            Frame::Base
        }
    }

    /// The samples in one file, or joints and positions in two.
    pub(crate) fn samples(&self, files: &Folder) -> Result<Option<InputText>, Fault> {
        let columns = self.columns.as_deref().filter(|own| !own.trim().is_empty());
        let columns = columns.map(str::parse::<ColumnMapping>).transpose();
        let columns = columns.map_err(Fault::of_request)?;
        let read = |name: &String| {
            let text = files.table(name)?;
            Ok::<_, Fault>(match &columns {
                Some(columns) => text.with_columns(columns.clone()),
                None => text,
            })
        };
        match self.samples.as_slice() {
            [] => Ok(None),
            [only] => read(only).map(Some),
            [first, second, ..] => Ok(Some(read(second)?.with_beside(read(first)?))),
        }
    }

    pub(crate) fn inputs(&self, files: &Folder) -> Result<Inputs, Fault> {
        let name = &self.robot;
        let text = files.settings(name)?;
        let samples = self.samples(files)?;
        if is_robot_file(&text) {
            let robot = RobotFile::read(&text)?;
            let samples = samples.ok_or_else(|| {
                Fault::new(
                    format!("{name} is given without its samples"),
                    "add a samples file, or plan measurements",
                )
            })?;
            return Ok(Inputs {
                readings: read_samples(&samples, &robot, &self.options())?,
                document: Document::new(&robot, &text, &samples, self.now),
                robot,
                printer: None,
            });
        }
        let printer = printer::read(
            self.firmware(&text)?,
            &text,
            samples.as_slice(),
            &self.stated()?,
            &|from, wanted| files.included(from, wanted),
            &self.options(),
        )?;
        let of_samples = samples.as_ref().unwrap_or(&text);
        Ok(Inputs {
            robot: printer.robot.clone(),
            readings: printer.readings.clone(),
            document: Document::new(&printer.robot, &text, of_samples, self.now),
            printer: Some(printer),
        })
    }

    fn firmware(&self, text: &InputText) -> Result<Firmware, InputError> {
        let named = self.firmware.as_deref();
        let mut all = Firmware::ALL.into_iter();
        all.find(|own| Some(own.name()) == named)
            .map_or_else(|| Firmware::of(text), Ok)
    }

    fn stated(&self) -> Result<Stated, Fault> {
        let lengths = |name: &str, text: &str| {
            let all = text.split([',', ';']).filter_map(given);
            let all = all.map(|own| {
                if own.ends_with(|c: char| c.is_ascii_digit()) {
                    measured(&format!("{own}mm"))
                } else {
                    measured(own)
                }
            });
            all.collect::<Result<Vec<_>, _>>()
                .map_err(|cause| Fault::of_request(format!("{name}: {cause}")))
        };
        let all = self.printed.split([',', ';']).filter_map(given);
        let printed = all.map(printed).collect::<Result<Vec<_>, _>>();
        let shrinkage = given(&self.shrinkage).map(shrinkage).transpose();
        let stated = Stated {
            printed: printed.map_err(Fault::of_request)?,
            shrinkage: shrinkage.map_err(Fault::of_request)?,
            ..Stated::default()
        };
        let stated = stated
            .with_rods(&lengths("rods", &self.rods)?)
            .map_err(|cause| {
                Fault::new(
                    format!("rods: {cause}"),
                    "write for example 345, or 345.1, 344.9, 345.0",
                )
            })?;
        Ok(stated.with_radius(lengths("radius", &self.radius)?.first().copied()))
    }

    fn printer(&self, files: &Folder, text: &InputText) -> Result<Imported, Fault> {
        let includes = |from: &str, wanted: &str| files.included(from, wanted);
        let stated = self.stated()?;
        let imported = self.firmware(text)?.import(text, &stated, &includes)?;
        Ok(imported.with_prints(&stated)?)
    }

    /// The robot alone, of a robot file or a configuration.
    pub(crate) fn robot(&self, files: &Folder) -> Result<RobotFile, Fault> {
        let text = files.settings(&self.robot)?;
        if is_robot_file(&text) {
            return Ok(RobotFile::read(&text)?);
        }
        Ok(self.printer(files, &text)?.robot)
    }
}

/// What a field of the page holds, if anything.
fn given(text: &str) -> Option<&str> {
    Some(text.trim()).filter(|own| !own.is_empty())
}

/// Whether a text is that of a robot, and not of a controller.
pub(crate) fn is_robot_file(text: &InputText) -> bool {
    let named = Path::new(text.name()).extension();
    named.is_some_and(|own| own == "toml") || text.text().contains("[joints]")
}

/// The files that an import writes.
#[derive(Debug, Serialize)]
pub(crate) struct ImportedFiles {
    robot: String,
    samples: Option<String>,
    notes: Vec<String>,
}

/// Robot file and samples of a printer's configuration.
pub(crate) fn import(files: &Folder, request: &Request) -> Result<ImportedFiles, Fault> {
    let imported = request.printer(files, &files.settings(&request.robot)?)?;
    Ok(ImportedFiles {
        robot: imported.robot_text(),
        samples: imported.samples_text(),
        notes: imported.notes,
    })
}
