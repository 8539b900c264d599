//! `delta-cal import`.

use super::failure::Failure;
use super::paths::is_stream;
use super::print::print;
use crate::InputText;
use crate::files::output;
use crate::import::gcode::{self, Firmware};
use crate::import::imported::Imported;
use crate::import::klipper;
use clap::Args;
use clap::builder::PossibleValuesParser;
use delta_cal::robot::Drive;
use std::fmt::Write;
use std::path::{Path, PathBuf};

pub(crate) const HELP: &str = "\
CONTROLLER is one of:
  klipper           printer.cfg: kinematics: delta or rotary_delta, and the
                    measurements that DELTA_CALIBRATE and DELTA_ANALYZE saved
  reprapfirmware    config.g or config-override.g: M665 and M666
  marlin            what M503 prints: M665 and M666

The program writes robot.toml and, if the configuration holds measurements, samples.csv, both or none. It never changes \
the configuration, keeps nothing of sections that the geometry does not need, and prints no line of it.

Examples:
  delta-cal import klipper printer.cfg --output mine
  delta-cal import klipper printer.cfg --rods 345 --output mine
  delta-cal import reprapfirmware config.g --output mine
  delta-cal calibrate mine/robot.toml mine/samples.csv \\
      --output mine/calibrated.toml

Exit codes:
  0  the files are written
  2  the command line is wrong
  3  the configuration is wrong, or it is not of a Delta robot
  4  a file exists, or could not be written

With exit codes 2 and 3 no file is written or changed.";

const CONTROLLERS: [&str; 3] = ["klipper", "reprapfirmware", "marlin"];

#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ImportArguments {
    /// Whose configuration it is; the controllers are listed below
    #[arg(value_name = "CONTROLLER", value_parser = PossibleValuesParser::new(CONTROLLERS), hide_possible_values = true)]
    controller: String,
    /// The configuration
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The folder to write to; the program makes it if it does not exist
    #[arg(long, value_name = "FOLDER")]
    output: PathBuf,
    /// Of a Klipper configuration with towers: how long the rods were made, one length or three, in place of its
    /// arm_length
    #[arg(long, value_name = "MM[,MM,MM]", value_delimiter = ',', value_parser = length)]
    rods: Option<Vec<f64>>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

pub(crate) fn length(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("it must be a length above 0, in mm".to_owned()),
    }
}

/// One length for all rods, or three.
pub(crate) fn rods(values: Option<&[f64]>) -> Result<Option<[f64; 3]>, Failure> {
    match values {
        None => Ok(None),
        Some([all]) => Ok(Some([*all; 3])),
        Some([a, b, c]) => Ok(Some([*a, *b, *c])),
        Some(_) => Err(Failure::Usage {
            cause: "--rods needs one length, or three".to_owned(),
            remedy: "write for example --rods 345 or --rods 345.1,344.9,345.0".to_owned(),
        }),
    }
}

pub(crate) fn run(arguments: &ImportArguments) -> Result<(), Failure> {
    if is_stream(&arguments.file) || is_stream(&arguments.output) {
        return Err(Failure::Usage {
            cause: "the configuration and the folder need names".to_owned(),
            remedy: "write for example delta-cal import klipper printer.cfg --output mine"
                .to_owned(),
        });
    }
    let rods = rods(arguments.rods.as_deref())?;
    let firmware = match arguments.controller.as_str() {
        "reprapfirmware" => Some(Firmware::RepRapFirmware),
        "marlin" => Some(Firmware::Marlin),
        _ => None,
    };
    let imported = match firmware {
        None => klipper::import(&arguments.file, rods)?,
        Some(_) if rods.is_some() => {
            return Err(Failure::Usage {
                cause: "--rods can only be used with klipper".to_owned(),
                remedy: "edit forearm_mm or lb_mm in the robot file".to_owned(),
            });
        }
        Some(firmware) => gcode::import(&InputText::from_file(&arguments.file)?, firmware)?,
    };
    let robot = ("robot.toml", Some(imported.robot_text.as_str()));
    let samples = ("samples.csv", imported.samples_text.as_deref());
    let written = write(&arguments.output, &[robot, samples], arguments.force)?;
    print(&text(
        &imported,
        &arguments.controller,
        &arguments.output,
        &written,
    ))
}

/// Writes those files that have a text into a folder, all or none.
pub(crate) fn write(
    folder: &Path,
    files: &[(&str, Option<&str>)],
    force: bool,
) -> Result<Vec<PathBuf>, Failure> {
    let files: Vec<(PathBuf, &str)> = files
        .iter()
        .filter_map(|(name, text)| Some((folder.join(name), (*text)?)))
        .collect();
    if let Some((path, _)) = files.iter().find(|(path, _)| !force && path.exists()) {
        return Err(Failure::Output(format!(
            "{}: the file exists, and is only replaced with --force",
            path.display()
        )));
    }
    output::make_folder(folder)?;
    let texts: Vec<(&Path, &str)> = files
        .iter()
        .map(|(path, text)| (path.as_path(), *text))
        .collect();
    output::write_all(&texts)?;
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

fn text(imported: &Imported, controller: &str, folder: &Path, written: &[PathBuf]) -> String {
    let mut text = String::new();
    for note in &imported.notes {
        let _ = writeln!(text, "{note}");
    }
    for path in written {
        let _ = writeln!(text, "Written: {}", path.display());
    }
    let folder = folder.display();
    let [a, b, c] = imported.home;
    if imported.samples_text.is_some() {
        let saved = &imported.saved;
        let _ = writeln!(
            text,
            "samples.csv holds {} heights and {} distances.\nNext: delta-cal calibrate {folder}/robot.toml \
             {folder}/samples.csv --output {folder}/calibrated.toml",
            saved.heights.len(),
            saved.distances.len()
        );
    } else {
        if controller == "klipper" {
            text.push_str(
                "The configuration holds no saved measurements. Run DELTA_CALIBRATE and SAVE_CONFIG in Klipper and import \
                 the file that it wrote, or plan measurements.\n",
            );
        }
        let _ = writeln!(
            text,
            "Next: delta-cal plan {folder}/robot.toml --measure plane --count 20 --output {folder}/samples.csv"
        );
    }
    let home = match imported.robot.robot.drive() {
        Drive::Linear => format!("--home-mm {a:.6},{b:.6},{c:.6}"),
        Drive::Rotary => {
            let [a, b, c] = imported.home.map(f64::to_degrees);
            format!("--home-deg {a:.6},{b:.6},{c:.6}")
        }
    };
    let _ = writeln!(text, "The end stops, for delta-cal export: {home}");
    text
}
