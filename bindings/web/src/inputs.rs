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
use serde::Deserialize;
use tsify::Tsify;

/// What the page asks for. Names are of its files.
#[derive(Debug, Default, Deserialize, Tsify)]
#[serde(default)]
#[expect(clippy::struct_excessive_bools, reason = "boxes of a form")]
pub(crate) struct Request {
    /// A robot file or a printer's configuration.
    pub(crate) robot: String,
    /// One file, or joints and then positions; any number of a printer.
    pub(crate) samples: Vec<String>,
    columns: Option<String>,
    /// Whose configuration it is, where its text does not say.
    firmware: Option<String>,
    /// Of a printer, as the options of the command, in mm without a unit; empty if not stated.
    rods: Vec<String>,
    radius: Vec<String>,
    printed: Vec<String>,
    shrinkage: Vec<String>,
    #[tsify(type = "string | null")]
    method: Option<Method>,
    robust: bool,
    /// Whether coordinates are in the sensor's frame.
    pub(crate) sensor: bool,
    /// Whether that is the frame in the robot file.
    pub(crate) stored: bool,
    /// As `--guard`.
    pub(crate) guard: bool,
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

/// A robot without its readings.
#[derive(Debug)]
pub(crate) enum Machine {
    Robot(Box<RobotFile>),
    Printer(Box<Imported>),
}

impl Machine {
    pub(crate) fn robot(&self) -> &RobotFile {
        match self {
            Self::Robot(own) => own,
            Self::Printer(own) => &own.robot,
        }
    }
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

    /// The files with samples, each for itself.
    fn tables(&self, files: &Folder) -> Result<Vec<InputText>, Fault> {
        let columns = self.columns.as_deref().filter(|own| !own.trim().is_empty());
        let columns = columns.map(str::parse::<ColumnMapping>).transpose();
        let columns = columns.map_err(Fault::of_request)?;
        let read = |name: &String| {
            let text = files.table(name)?;
            Ok(match &columns {
                Some(columns) => text.with_columns(columns.clone()),
                None => text,
            })
        };
        self.samples.iter().map(read).collect()
    }

    /// The samples in one file, or joints and positions in two.
    pub(crate) fn samples(&self, files: &Folder) -> Result<Option<InputText>, Fault> {
        let mut tables = self.tables(files)?.into_iter();
        Ok(tables.next().map(|first| first.joined(tables.next())))
    }

    pub(crate) fn inputs(&self, files: &Folder) -> Result<Inputs, Fault> {
        let name = &self.robot;
        let text = files.settings(name)?;
        if text.is_robot() {
            let robot = RobotFile::read(&text)?;
            let samples = self.samples(files)?.ok_or_else(|| {
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
        let samples = self.tables(files)?;
        let printer = printer::read(
            self.firmware(&text)?,
            &text,
            &samples,
            &self.stated()?,
            &|from, wanted| files.included(from, wanted),
            &self.options(),
        )?;
        let of_samples = samples.first().unwrap_or(&text);
        Ok(Inputs {
            robot: printer.robot.clone(),
            readings: printer.readings.clone(),
            document: Document::new(&printer.robot, &text, of_samples, self.now),
            printer: Some(printer),
        })
    }

    fn firmware(&self, text: &InputText) -> Result<Firmware, InputError> {
        let named = self.firmware.as_deref();
        named
            .and_then(Firmware::named)
            .map_or_else(|| Firmware::of(text), Ok)
    }

    fn stated(&self) -> Result<Stated, Fault> {
        let lengths = |name: &str, all: &[String]| {
            let all = all.iter().map(|own| {
                if own.ends_with(|c: char| c.is_ascii_digit()) {
                    measured(&format!("{own}mm"))
                } else {
                    measured(own)
                }
            });
            all.collect::<Result<Vec<_>, _>>()
                .map_err(|cause| Fault::of_request(format!("{name}: {cause}")))
        };
        let printed = self.printed.iter().map(|own| printed(own));
        let printed = printed.collect::<Result<Vec<_>, _>>();
        let shrinkage = self.shrinkage.first().map(|own| shrinkage(own)).transpose();
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
                    "write for example 345, or 345.1; 344.9; 345.0",
                )
            })?;
        Ok(stated.with_radius(lengths("radius", &self.radius)?.first().copied()))
    }

    /// The robot alone, of a robot file or of a printer's configuration.
    pub(crate) fn machine(&self, files: &Folder) -> Result<Machine, Fault> {
        let text = files.settings(&self.robot)?;
        if text.is_robot() {
            return Ok(Machine::Robot(Box::new(RobotFile::read(&text)?)));
        }
        let includes = |from: &str, wanted: &str| files.included(from, wanted);
        let imported = self.firmware(&text)?;
        let imported = imported.import(&text, &self.stated()?, &includes)?;
        Ok(Machine::Printer(Box::new(imported)))
    }
}
