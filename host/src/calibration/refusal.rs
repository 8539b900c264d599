//! Why a calibration is refused: the finding and the remedy.

use crate::explain::Diagnosis;
use crate::files::{InputError, Kind, Readings, RobotFile};
use crate::fit::{Case, Frame, Unsolved};
use crate::judge::Objection;
use crate::text::{count, in_file_units, probability, significant};
use delta_cal::observations::Instrument;
use delta_cal::{ArmIndex, Parameter, Refusal};

/// A change below this many times the effect of noise alone shows nothing.
const NOISE_ALONE: f64 = 1.5;
const CHECK: &str = "Check the lengths in the robot file, units, joint order, signs (a positive angle swings the arm towards the platform) and the frame of the positions.";
const SPREAD: &str = "Spread the poses over the whole workspace.";
const STATE_TOLERANCE: &str =
    "State the [tolerance]: heights and distances never show where the base is.";

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// Something in an input file is unusable.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The readings cannot calibrate this robot; it keeps its parameters.
    #[error(transparent)]
    Refused(Box<Refused>),
}

/// A refused calibration. Displayed as one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{cause}")]
pub struct Refused {
    cause: String,
    remedy: String,
    /// An explanation of the readings as a whole, if there is one.
    pub diagnosis: Option<Diagnosis>,
}

impl Refused {
    pub(crate) fn new(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            cause: cause.into(),
            remedy: remedy.into(),
            diagnosis: None,
        }
    }

    /// Adds an explanation of the readings as a whole, if there is one.
    pub(crate) fn explained(self, diagnosis: Option<Diagnosis>) -> Self {
        Self { diagnosis, ..self }
    }

    /// What to do next. A diagnosis takes precedence over general advice.
    pub fn remedy(&self) -> String {
        let diagnosis = self.diagnosis.as_ref();
        diagnosis.map_or_else(|| self.remedy.clone(), Diagnosis::advice)
    }
}

impl CalibrateError {
    /// What to do next.
    pub fn remedy(&self) -> Option<String> {
        match self {
            Self::Input(error) => error.remedy.as_deref().map(str::to_owned),
            Self::Refused(refused) => Some(refused.remedy()),
        }
    }

    /// Whether the readings cannot calibrate this robot.
    pub const fn refused(&self) -> bool {
        matches!(self, Self::Refused(_))
    }

    /// An explanation of the readings as a whole, if there is one.
    pub fn diagnosis(&self) -> Option<&Diagnosis> {
        match self {
            Self::Input(_) => None,
            Self::Refused(refused) => refused.diagnosis.as_ref(),
        }
    }
}

impl From<Refused> for CalibrateError {
    fn from(refused: Refused) -> Self {
        Self::Refused(Box::new(refused))
    }
}

/// An objection in words; `hint`, an explanation that was found, precedes the general advice.
pub(crate) fn explained(
    case: &Case<'_>,
    objection: &Objection,
    hint: Option<String>,
    diagnosis: Option<Diagnosis>,
) -> CalibrateError {
    let (robot, readings) = (case.robot, case.readings);
    let (cause, remedy) = match objection {
        Objection::Unsolved(why) => match unsolved(case, why) {
            Ok(words) => words,
            Err(error) => return error.into(),
        },
        Objection::UnknownError => no_redundancy(),
        Objection::Implausible(change) => (
            change.clone(),
            format!("{CHECK} If the robot file is right, state its [tolerance]."),
        ),
        Objection::NotReproduced(median) => (
            format!("The calibrated robot does not reach the measured points: half are more than {median:.1} mm off."),
            CHECK.to_owned(),
        ),
        Objection::Worse(chance, moved)
            if robot.tolerance.is_some() && moved.change < NOISE_ALONE * moved.scatter =>
        (
            format!(
                "Nothing to improve: the readings agree with the robot file. Positions would move {} mm, no more than noise \
                 explains; {} chance of making the robot worse.",
                significant(moved.change, 2),
                probability(*chance)
            ),
            "Keep the robot file. Smaller errors show with more poses, or with less noise.".to_owned(),
        ),
        Objection::Worse(chance, moved) => (
            format!(
                "{} chance of making the robot worse: {}positions would move {} mm but are known only to {} mm.",
                probability(*chance),
                if case.options.frame == Frame::Sensor { "relative " } else { "" },
                significant(moved.change, 2),
                significant(moved.sigma, 2)
            ),
            "Measure more poses, or more exactly. If the robot was calibrated before, state in [tolerance] how far off it \
             can be now."
                .to_owned(),
        ),
        Objection::NoiseFarOff(kind, stated, shown) => (
            format!(
                "The stated noise, {} = {}, is {} × what the {} show ({} mm): another unit, or far too large. At that noise \
                 they carry no information.",
                kind.key(),
                significant(*stated, 3),
                significant(stated / shown, 2),
                kind.plural(),
                significant(*shown, 2)
            ),
            format!(
                "State it in mm: {} = {}, or leave it out.",
                kind.key(),
                significant(*shown, 2)
            ),
        ),
        Objection::NoiseBeyondTolerance(sigma, tolerated) => (
            format!(
                "Residuals ({} mm) exceed what the tolerance allows ({} mm): these samples cannot improve the robot.",
                significant(*sigma, 2),
                significant(*tolerated, 2)
            ),
            format!("{CHECK} If the robot is that far off, state a larger [tolerance]; if the sensor is that noisy, state the \
                     [noise]."),
        ),
        Objection::BeyondTolerance(test, statement) => (
            format!(
                "The robot is {:.1} × farther from nominal than the [tolerance] allows ({} of {} combinations).",
                test.ratio, test.combinations, test.of
            ),
            format!(
                "{CHECK}{} If the robot is that far off, set {statement}.",
                or_frame(case)
            ),
        ),
    };
    let mut remedy = match hint {
        None => remedy,
        Some(hint) => format!("{hint} Otherwise: {remedy}"),
    };
    let joined = readings.joined.iter().find(|own| own.by.is_none());
    if let Some(joined) = joined.filter(|_| objection.may_be_wrong_rows()) {
        remedy = format!(
            "The rows were matched with those of {} by order: check that both have the same. {remedy}",
            joined.joints_file
        );
    }
    let refused = Refused::new(format!("{}: {cause}", readings.name), remedy);
    refused.explained(diagnosis).into()
}

/// Advice for coordinates that may be in another frame.
fn or_frame(case: &Case<'_>) -> &'static str {
    if case.options.frame == Frame::Base && case.readings.holds(Kind::Position) {
        " If the coordinates are not in the robot's frame, use --frame sensor."
    } else {
        ""
    }
}

fn no_redundancy() -> (String, String) {
    (
        "No redundant readings: the error cannot be estimated.".to_owned(),
        "Add at least 5 samples, or state [noise] and [tolerance].".to_owned(),
    )
}

fn unsolved(case: &Case<'_>, why: &Unsolved) -> Result<(String, String), InputError> {
    let readings = case.readings;
    Ok(match why {
        Unsolved::Row(index, error) => return Err(readings.fault(*index, error.to_string())),
        Unsolved::TooManyInstruments => {
            let cause = "the rows name more planes and points than one calibration can hold";
            let error = InputError::new(&readings.name, cause);
            return Err(error.with_remedy("use at most 14 points or 16 planes"));
        }
        Unsolved::Refused(refusal) => undetermined(case, refusal),
        Unsolved::NoRedundancy => no_redundancy(),
        Unsolved::TooFewForRobust(samples, needed) => (
            format!("{samples} samples are too few for a robust fit, which needs {needed}."),
            "Measure more poses, or leave out --robust.".to_owned(),
        ),
        Unsolved::TooManySuspected(suspected, samples) => (
            format!(
                "{suspected} of {samples} samples disagree with the others: too many to tell which are wrong."
            ),
            format!("{CHECK} Did the sensor, the plate or the robot's base move?"),
        ),
    })
}

fn undetermined(case: &Case<'_>, refusal: &Refusal) -> (String, String) {
    let (robot, readings) = (case.robot, case.readings);
    let arm_of = |arm: Option<ArmIndex>| arm.map_or_else(String::new, |arm| format!("{arm}: "));
    let has_tolerance = robot.tolerance.is_some();
    let or_tolerance = if has_tolerance {
        ""
    } else {
        " Or state the [tolerance]."
    };
    let wrong_rows = if case.options.robust {
        ""
    } else {
        "wrong rows (--robust leaves them out and names them) and for "
    };
    match *refusal {
        Refusal::TooFewObservations { instrument, observations, needed } => (
            format!(
                "{} has {} and needs {needed}.",
                name(readings, instrument),
                count(usize::try_from(observations).unwrap_or(usize::MAX), "reading")
            ),
            "Measure it at more poses, or delete its rows.".to_owned(),
        ),
        Refusal::UndeterminedInstrument(instrument) => (
            format!("The poses do not determine where {} is.", name(readings, instrument)),
            match (instrument, has_tolerance) {
                (_, false) => STATE_TOLERANCE.to_owned(),
                _ => "Measure poses that are well apart and not on one line.".to_owned(),
            },
        ),
        Refusal::TooFewSamples { samples: 0, .. } => (
            format!("The robot of {} reaches none of the poses.", robot.name),
            "Check its lengths, and units and signs of the joints.".to_owned(),
        ),
        Refusal::TooFewSamples { samples, needed, .. } => (
            format!(
                "{} are too few: {needed} are needed without a [tolerance].",
                count(usize::try_from(samples).unwrap_or(usize::MAX), "sample")
            ),
            "Measure 20 poses, or state the [tolerance].".to_owned(),
        ),
        Refusal::Undetermined { arm, parameter, .. } => (
            format!("{arm}: the poses do not determine {parameter}."),
            if readings.is_complete() || has_tolerance {
                format!("{SPREAD}{or_tolerance}")
            } else {
                STATE_TOLERANCE.to_owned()
            },
        ),
        Refusal::Uncertain { arm, parameter, sigma } => (
            format!(
                "{arm}: the samples leave {parameter} unknown (σ {}).",
                in_file_units(parameter, f64::from(sigma))
            ),
            format!("Measure more poses, or more exactly. {SPREAD}{or_tolerance}"),
        ),
        Refusal::ResidualContradictsNoise { arm, ratio }
            if robot.noise.is_none() && readings.holds(Kind::Position) =>
        {
            (
                format!("{}residuals are {ratio:.1} × what the [tolerance] allows.", arm_of(arm)),
                format!("{CHECK} If the sensor is that noisy, state the [noise]."),
            )
        }
        Refusal::ResidualContradictsNoise { arm, ratio } => (
            format!("{}residuals are {ratio:.1} × the stated noise.", arm_of(arm)),
            format!(
                "Look for {wrong_rows}a sensor or plate that moved. State the [noise] that repeated readings of one pose show."
            ),
        ),
        Refusal::FarFromNominal { arm, parameter, tolerances } => {
            let (name, distance) = far(robot, arm, parameter, f64::from(tolerances));
            (
                format!(
                    "{arm}: fitted {name} is {distance} from nominal ({tolerances:.0} × tolerance). Robot file and samples \
                     do not belong together."
                ),
                format!(
                    "{CHECK}{}",
                    or_frame(case)
                ),
            )
        }
        Refusal::WrongSide => (
            "The samples put the platform above the elbows: their frame is upside down or left-handed.".to_owned(),
            "State the samples in the robot's frame, or use --frame sensor.".to_owned(),
        ),
        Refusal::NonFinite { arm } => (
            format!("{arm}: the numbers are too large to compute with."),
            "Check the units in the header (_mm or _m, _deg or _rad).".to_owned(),
        ),
        other => (format!("{other}."), CHECK.to_owned()),
    }
}

fn name(readings: &Readings, instrument: Instrument) -> String {
    match instrument {
        Instrument::Frame => "the sensor frame".to_owned(),
        Instrument::Plane(index) => match readings.planes.get(usize::from(index)) {
            Some(name) if readings.planes.len() > 1 => format!("plane {name}"),
            _ => "the plane".to_owned(),
        },
        Instrument::Point(index) => {
            let name = readings.points.get(usize::from(index));
            format!("point {}", name.map_or("", String::as_str))
        }
        Instrument::Transmission(arm) => format!("the transmission of {arm}"),
    }
}

/// The parameter that is this many tolerances from nominal, and its distance from nominal. If a tolerance of joint
/// zeros is stated, the upper arm's components stand for its length and direction.
fn far(
    robot: &RobotFile,
    arm: ArmIndex,
    parameter: Parameter,
    tolerances: f64,
) -> (&'static str, String) {
    let symbol = parameter.symbol();
    let Some(tolerance) = robot.tolerance else {
        return (symbol, String::new());
    };
    let length = |sigma: f64| in_file_units(parameter, sigma * tolerances);
    match (parameter, tolerance.joint_zero()) {
        (Parameter::LaY, Some(zero)) => {
            let off = significant((zero * tolerances).to_degrees(), 3);
            ("joint zero", format!("{off}°"))
        }
        (Parameter::LaX, Some(_)) => ("upper arm", length(tolerance.of(parameter))),
        _ => (
            symbol,
            length(tolerance.of_arm(robot.robot.arm(arm), parameter)),
        ),
    }
}
