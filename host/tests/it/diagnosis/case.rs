//! One run of every way to calibrate: a robot file, measurements, and what is said of them.

use delta_cal::kinematics::JointLimits;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Noise, Robot, Sample};
use delta_cal_host::{Frame, InputText, Options, RobotFile, calibrate, read_samples};
use delta_cal_tests::{Spread, paper_robot, uniform};
use nalgebra::{Rotation3, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use std::fmt::Write;

/// Every length off by up to `length` mm and every angle by up to `degrees`.
pub(super) fn perturbed(
    robot: &Robot<f64>,
    length: f64,
    degrees: f64,
    rng: &mut Pcg32,
) -> Robot<f64> {
    delta_cal_tests::perturbed(robot, length, degrees.to_radians(), Spread::Uniform, rng)
}

/// One run: a robot file, measurements in mm and degrees as they are written, and the header.
pub(super) struct Case {
    pub(super) file: Robot<f64>,
    pub(super) rows: Vec<([f64; 3], Vector3<f64>)>,
    pub(super) angles: &'static str,
    pub(super) lengths: &'static str,
    pub(super) options: Options,
    tolerance: bool,
    /// The stated σ of the positions.
    noise: Option<f64>,
}

impl Case {
    fn robot_file(&self) -> RobotFile {
        let mut text = String::new();
        for arm in self.file.arms() {
            text.push_str("[[arm]]\n");
            for (index, key) in crate::support::KEYS.iter().enumerate() {
                let value = arm.parameters()[index];
                let value = if index == 3 || index == 4 {
                    value.to_degrees()
                } else {
                    value
                };
                writeln!(text, "{key} = {value:?}").unwrap();
            }
        }
        text.push_str("[joints]\nmin_deg = -60\nmax_deg = 90\n");
        if self.tolerance {
            text.push_str("[tolerance]\nlength_mm = 0.6\nangle_deg = 0.2\n");
        }
        if let Some(sigma) = self.noise {
            writeln!(text, "[noise]\nposition_mm = {sigma}\njoint_deg = 0.002").unwrap();
        }
        RobotFile::read(&InputText::new("robot.toml", &text)).unwrap()
    }

    /// All that is said of the file as a whole; none if nothing is.
    pub(super) fn diagnosis(&self) -> Option<String> {
        let (q, l) = (self.angles, self.lengths);
        let mut text = format!("q1_{q},q2_{q},q3_{q},x_{l},y_{l},z_{l}\n");
        for ([q1, q2, q3], x) in &self.rows {
            writeln!(text, "{q1},{q2},{q3},{},{},{}", x.x, x.y, x.z).unwrap();
        }
        let robot = self.robot_file();
        let input = InputText::new("samples.csv", &text);
        let readings = match read_samples(&input, &robot, &self.options) {
            Ok(readings) => readings,
            Err(error) => return error.remedy(),
        };
        let diagnosis = match calibrate(&robot, &readings, &self.options) {
            Ok(report) => report.diagnosis,
            Err(error) => error.diagnosis().cloned(),
        };
        diagnosis.map(|diagnosis| diagnosis.to_string())
    }
}

/// Every way to calibrate, one after the other.
pub(super) fn case(robot: u64, frame: Option<Frame>) -> (Case, Pcg32) {
    let mut rng = Pcg32::seed_from_u64(0xd1a6 ^ (robot << 20));
    let file = paper_robot();
    let truth = perturbed(&file, 1.0, 0.3, &mut rng);
    let noise = Noise::new(0.02, 0.002_f64.to_radians()).unwrap();
    let limits = JointLimits::new((-60_f64).to_radians(), 90_f64.to_radians()).unwrap();
    let count = [8, 12, 20, 60][usize::try_from(robot % 4).unwrap()];
    let mut samples: Vec<Sample<f64>> = (0..count)
        .map(|_| {
            let pose = random_pose(&truth, &limits, &mut rng).unwrap();
            simulate_sample(&truth, &pose.joints, Some(&noise), &mut rng).unwrap()
        })
        .collect();
    let way = robot / 4;
    let frame = frame.unwrap_or(if way % 3 == 2 {
        Frame::Sensor
    } else {
        Frame::Base
    });
    if frame == Frame::Sensor {
        let rotation = Rotation3::from_euler_angles(
            3.0 * uniform(&mut rng),
            uniform(&mut rng),
            3.0 * uniform(&mut rng),
        );
        for sample in &mut samples {
            sample.position = rotation * sample.position + Vector3::new(900.0, -400.0, 300.0);
        }
    }
    let case = Case {
        file,
        rows: samples
            .iter()
            .map(|sample| (sample.joints.map(f64::to_degrees), sample.position))
            .collect(),
        angles: "deg",
        lengths: "mm",
        options: Options {
            frame,
            ..Options::default()
        },
        tolerance: (way / 2).is_multiple_of(2),
        noise: (way / 3).is_multiple_of(2).then_some(0.02),
    };
    (case, rng)
}
