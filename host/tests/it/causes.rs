//! Errors that the model does not hold: how often they are found and named, and how often where there
//! are none.

mod command;
mod linear;
mod simulated;
use delta_cal::simulate::random_pose;
use delta_cal::{ArmIndex, Noise};
use delta_cal_host::accuracy::position_uncertainty::PositionUncertainty;
use delta_cal_host::{
    CalibrationMethod, CalibrationReport, Cause, CauseKind, Frame, NoiseVerdict, Options, calibrate,
};
use delta_cal_tests::documents::print_campaign;
use delta_cal_tests::{is_long, size};
use simulated::{Fault, GEOMETRIES, NOISE, Setting, Simulated, simulate};

const PAGE: &str = "docs/diagnosis.md";

const PAPER: Setting = Setting {
    geometry: GEOMETRIES[0],
    rows: 40,
    noise_stated: true,
    tolerance_stated: true,
    in_sensor_frame: false,
};

fn calibrated(
    simulated: &Simulated,
    setting: &Setting,
    method: CalibrationMethod,
) -> Result<CalibrationReport, String> {
    let frame = if setting.in_sensor_frame {
        Frame::Sensor
    } else {
        Frame::Base
    };
    let options = Options {
        method,
        frame,
        ..Options::default()
    };
    calibrate(&simulated.robot, &simulated.samples, options).map_err(|error| error.to_string())
}

/// The kind that a fault is to be named, and whether it is a joint's.
fn kind_of(fault: Fault) -> Option<(CauseKind, bool)> {
    match fault {
        Fault::Nothing => None,
        Fault::Eccentricity(_) => Some((CauseKind::Eccentricity, true)),
        Fault::Gear(_) => Some((CauseKind::GearRatio, true)),
        Fault::TwiceATurn(_) => Some((CauseKind::SecondHarmonic, true)),
        Fault::Backlash(_) => Some((CauseKind::Backlash, true)),
        Fault::Sag(_) => Some((CauseKind::Sag, false)),
        Fault::Drift(_) => Some((CauseKind::Drift, false)),
    }
}

/// Whether a cause or, if that is said to be about as likely, another one is the fault.
fn names(cause: &Cause, simulated: &Simulated) -> bool {
    kind_of(simulated.faulty.fault).is_some_and(|(kind, of_joint)| {
        let joint = of_joint.then_some(simulated.faulty.joint);
        let is = |found: CauseKind, arm: Option<ArmIndex>| {
            found == kind && arm.map(ArmIndex::index) == joint
        };
        let others = &cause.alternatives;
        is(cause.kind, cause.arm) || others.iter().any(|other| is(other.kind, other.arm))
    })
}

/// Whether a refusal names the fault.
fn refused_for(refusal: &str, simulated: &Simulated) -> bool {
    let joint = simulated.faulty.joint + 1;
    let (own, other) = match simulated.faulty.fault {
        Fault::Nothing => return false,
        Fault::Eccentricity(_) => ("repeats once a turn", "an eccentricity"),
        Fault::Gear(_) => ("turns", "a wrong gear ratio"),
        Fault::TwiceATurn(_) => ("repeats twice a turn", "an error twice a turn"),
        Fault::Backlash(_) => ("changes with the direction", "a backlash"),
        Fault::Sag(_) => return refusal.contains("the platform is lower"),
        Fault::Drift(_) => return refusal.contains("the measured positions drift"),
    };
    let own_arm = format!("arm {joint}: the joint");
    let named = refusal.split(&own_arm).skip(1).any(|said| {
        let said = said.split("arm ").next().unwrap_or_default();
        said.contains(own)
    });
    named || refusal.contains(&format!("{other} of arm {joint}"))
}

/// A file without any cause has one found with a probability of at most 0.3 %, whatever is stated, in
/// either frame and by either method.
#[test]
fn files_without_a_cause_have_none_found() {
    // Every thirteenth of the seeds, from another one in each cell, still gives all numbers of rows.
    let step = size(13, 1);
    let (mut files, mut tested, mut alarms, mut first) = (0, 0, 0, Vec::new());
    for geometry in GEOMETRIES {
        for cell in 0..16_u32 {
            for seed in (u64::from(cell) % step..40).step_by(usize::try_from(step).unwrap()) {
                let bit = |place: u32| cell >> place & 1 == 1;
                let setting = Setting {
                    geometry,
                    rows: 14 + u32::try_from(7 * seed % 47).unwrap(),
                    noise_stated: bit(0),
                    tolerance_stated: bit(1),
                    in_sensor_frame: bit(2),
                };
                let method = if bit(3) {
                    CalibrationMethod::Fkm
                } else {
                    CalibrationMethod::Ikm
                };
                let simulated = simulate(&setting, Fault::Nothing, 300 + u64::from(cell), seed);
                files += 1;
                // Too few or too noisy samples for a robot without a tolerance.
                let Ok(report) = calibrated(&simulated, &setting, method) else {
                    continue;
                };
                tested += usize::from(report.causes.not_tested.is_none());
                if !report.causes.found.is_empty() {
                    alarms += 1;
                    first.push(format!(
                        "{setting:?} {method:?}: {}",
                        report.causes.found[0]
                    ));
                }
            }
        }
    }
    println!("{}", first.join("\n"));
    print_campaign(
        PAGE,
        &format!("{alarms} of {tested} files without any such error"),
    );
    assert!(10 * tested > 8 * files, "{tested} of {files}");
    let expected = 0.003 * f64::from(u32::try_from(tested).unwrap());
    let most = expected + 3.0 * expected.sqrt() + 1.0;
    assert!(f64::from(alarms) <= most, "{alarms} of {tested}");
}

/// The noise is 1.5 times what is stated, and there is no cause. The limit is the same: the noise that
/// is left counts.
#[test]
fn an_understated_noise_is_no_cause() {
    let per_geometry = size(40, 200);
    let (mut tested, mut alarms) = (0.0, 0.0);
    for geometry in GEOMETRIES {
        for seed in 0..per_geometry {
            let setting = Setting { geometry, ..PAPER };
            let mut simulated = simulate(&setting, Fault::Nothing, 350, seed);
            simulated.robot.noise = Noise::new(NOISE.0 / 1.5, (NOISE.1 / 1.5).to_radians()).ok();
            if let Ok(report) = calibrated(&simulated, &setting, CalibrationMethod::Fkm) {
                tested += 1.0;
                alarms += f64::from(u8::from(!report.causes.found.is_empty()));
            }
        }
    }
    println!("{alarms} of {tested}");
    // The variance of 120 residuals is known to 13 %, which triples so small a probability.
    let expected = 3.0 * 0.003 * tested;
    assert!(
        alarms <= expected + 3.0 * f64::sqrt(expected),
        "{alarms} of {tested}"
    );
}

/// All rows, so that they can be pasted, and then each beside the document's.
fn print_table(rows: &[String]) {
    println!("{}", rows.join("\n"));
    for row in rows {
        print_campaign(PAGE, row);
    }
}

/// What came of files with one fault, in percent of them.
#[derive(Default)]
struct Detected {
    files: u32,
    /// The first cause is the fault.
    named: u32,
    /// Any cause.
    found: u32,
    /// χ² of all residuals contradicts the noise, or the fit is refused.
    by_noise: u32,
}

impl Detected {
    fn of(fault: Fault, setting: &Setting, geometries: &[[f64; 4]], files: u64) -> Self {
        let mut detected = Self::default();
        let each = files / u64::try_from(geometries.len()).unwrap();
        for geometry in geometries {
            for seed in 0..each {
                let setting = Setting {
                    geometry: *geometry,
                    ..*setting
                };
                detected.count(&simulate(&setting, fault, 400, seed), &setting);
            }
        }
        detected
    }

    fn count(&mut self, simulated: &Simulated, setting: &Setting) {
        self.files += 1;
        match calibrated(simulated, setting, CalibrationMethod::Fkm) {
            Ok(report) => {
                let found = &report.causes.found;
                let named = found.first().is_some_and(|cause| names(cause, simulated));
                let stated = report.noise_test.and_then(|test| test.stated);
                let verdict = stated.map(|stated| stated.verdict);
                self.named += u32::from(named);
                self.found += u32::from(!found.is_empty());
                self.by_noise += u32::from(verdict == Some(NoiseVerdict::Understated));
            }
            Err(refused) => {
                self.found += u32::from(refused.contains("a cause that the model"));
                self.named += u32::from(refused_for(&refused, simulated));
                self.by_noise += 1;
            }
        }
    }

    fn percent(&self, number: u32) -> u32 {
        (200 * number + self.files) / (2 * self.files)
    }

    fn cell(&self) -> String {
        let [found, named, by_noise] =
            [self.found, self.named, self.by_noise].map(|number| self.percent(number));
        format!("{found} / {named} / {by_noise}")
    }
}

#[test]
fn faults_are_found_and_named() {
    let files = size(24, 120);
    let mut table = Vec::new();
    // Of 40 files of 40 rows of the paper's robot an independent program's tests found 40, 40, 40 and
    // 40 with an eccentricity of 0.05° and 0.1°, a gear ratio of 1e-3 and a sag of 0.3 mm at p < 0.001,
    // where these need 0.0002, and the phase of the eccentricity is random here.
    for (fault, words, least) in [
        (Fault::Nothing, "none", 0),
        (Fault::Eccentricity(0.02), "eccentricity 0.02°", 0),
        (Fault::Eccentricity(0.05), "eccentricity 0.05°", 75),
        (Fault::Eccentricity(0.1), "eccentricity 0.1°", 95),
        (Fault::Gear(1e-3), "gear ratio 1e-3", 90),
        (Fault::TwiceATurn(0.02), "twice a turn 0.02°", 0),
        (Fault::Backlash(0.01), "backlash ±0.01°", 95),
        (Fault::Sag(0.1), "sag 0.1 mm", 0),
        (Fault::Sag(0.3), "sag 0.3 mm", 95),
        (Fault::Drift(0.1), "drift 0.1 mm", 90),
    ] {
        let rows = |rows| Setting { rows, ..PAPER };
        let unstated = Setting {
            noise_stated: false,
            ..PAPER
        };
        let paper = &GEOMETRIES[..1];
        let forty = Detected::of(fault, &PAPER, paper, files);
        if is_long() {
            table.push(format!(
                "| {words} | {} | {} | {} | {} |",
                Detected::of(fault, &rows(25), paper, files).cell(),
                forty.cell(),
                Detected::of(fault, &PAPER, &GEOMETRIES, files).cell(),
                Detected::of(fault, &unstated, &GEOMETRIES, files).cell(),
            ));
        } else {
            println!("{words}: {}", forty.cell());
        }
        let found = forty.percent(forty.found);
        assert!(found >= least, "{words}: {found}");
    }
    print_table(&table);
}

/// The error of the positions of a robot with an error that the model does not hold, over σ of the
/// noise alone and over the reported σ.
#[test]
fn the_stated_uncertainty_holds_what_the_model_does_not() {
    let robots = size(2, 20);
    let mut table = Vec::new();
    for (fault, words) in [
        (Fault::Nothing, "none"),
        (Fault::Eccentricity(0.05), "eccentricity 0.05°"),
        (Fault::Eccentricity(0.1), "eccentricity 0.1°"),
        (Fault::Gear(1e-3), "gear ratio 1e-3"),
        (Fault::Backlash(0.01), "backlash ±0.01°"),
        (Fault::Sag(0.3), "sag 0.3 mm"),
    ] {
        let mut cells = Vec::new();
        for noise_stated in [true, false] {
            let (mut by_noise, mut reported, mut count) = (0.0, 0.0, 0.0);
            for geometry in GEOMETRIES {
                for seed in 0..robots {
                    let setting = Setting {
                        geometry,
                        noise_stated,
                        ..PAPER
                    };
                    let mut simulated = simulate(&setting, fault, 500, seed);
                    let Ok(report) = calibrated(&simulated, &setting, CalibrationMethod::Fkm)
                    else {
                        continue;
                    };
                    let ratio = achieved_over_reported(&mut simulated, &report);
                    by_noise += (ratio * report.widening).powi(2);
                    reported += ratio.powi(2);
                    count += 1.0;
                }
            }
            let rms = |sum: f64| f64::sqrt(sum / count);
            cells.push(format!("{:.1} / {:.1}", rms(by_noise), rms(reported)));
            // Without the causes 0.05° of eccentricity make the error more than twice σ.
            assert!(rms(reported) < 1.6, "{words}: {}", rms(reported));
        }
        table.push(format!("| {words} | {} |", cells.join(" | ")));
    }
    print_table(&table);
}

/// rms over random poses of the distance between where the robot is and where the calibrated one says,
/// over that of the reported σ.
fn achieved_over_reported(simulated: &mut Simulated, report: &CalibrationReport) -> f64 {
    let (mut squares, mut variances) = (0.0, 0.0);
    let uncertainty = PositionUncertainty {
        robot: &report.after.robot,
        covariance: report.outcome.covariance.as_ref().unwrap(),
    };
    let limits = simulated.robot.limits;
    for _ in 0..200 {
        let truth = &simulated.faulty.truth;
        let joints = random_pose(truth, &limits, &mut simulated.rng)
            .unwrap()
            .joints;
        let is = simulated.faulty.position(&joints, &[1.0; 3]);
        if let (Some(is), Ok(said)) = (is, report.after.robot.forward(&joints)) {
            squares += (is - said).norm_squared();
            variances += uncertainty.sigma(&said, &joints).unwrap().powi(2);
        }
    }
    f64::sqrt(squares / variances)
}
