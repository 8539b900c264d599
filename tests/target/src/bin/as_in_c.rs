//! What the calls of the C library's fixture cost in Rust: the same robot, the same measurements, one line each,
//! `COUNT f32 <what>: <instructions>`.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("Only its costs count: build it with --target thumbv7em-none-eabihf.");
}

#[cfg(target_os = "none")]
mod firmware {
    use core::fmt::{self, Write};
    use core::hint::black_box;
    use delta_cal::calibration::{JointCalibrator, JointSolver};
    use delta_cal::observations::{
        Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise,
        ObservationProblem, ObservationRow, Plane, Point, PositionFrame,
    };
    use delta_cal::{Calibrator, Progress, Robot, RobotSolver, Sample, Settings};
    use delta_cal_target_tests::console::{self, Console};
    use delta_cal_target_tests::{Counter, SAMPLES, noise, nominal, samples, tolerance};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        console::run(|console| {
            let mut counter = Counter::start().ok_or(fmt::Error)?;
            let robot = nominal::<f32>();
            let settings = Settings::new().with_noise(noise());
            let both = settings.with_tolerance(tolerance());
            kinematics(console, &mut counter, &robot)?;
            arms(console, &mut counter, &robot, &settings)?;
            joint(console, &mut counter, &robot, &settings)?;
            observe(console, &mut counter, &robot, &both)
        })
    }

    /// Counts of several calls.
    #[derive(Default)]
    struct Calls {
        all: u32,
        longest: u32,
    }

    impl Calls {
        fn count(&mut self, counter: &mut Counter, work: impl FnOnce()) -> fmt::Result {
            let instructions = counter.count(work).map_err(|_| fmt::Error)?;
            self.all += instructions;
            self.longest = self.longest.max(instructions);
            Ok(())
        }
    }

    fn one(
        console: &mut Console,
        counter: &mut Counter,
        what: &str,
        work: impl FnOnce(),
    ) -> fmt::Result {
        let mut calls = Calls::default();
        calls.count(counter, work)?;
        writeln!(console, "COUNT f32 {what}: {}", calls.all)
    }

    fn kinematics(console: &mut Console, counter: &mut Counter, robot: &Robot<f32>) -> fmt::Result {
        let joints = black_box([0.25, -0.125, 0.5]);
        let position = robot.forward(&joints).map_err(|_| fmt::Error)?;
        one(console, counter, "forward", || {
            let _ = black_box(black_box(robot).forward(black_box(&joints)));
        })?;
        one(console, counter, "inverse", || {
            let _ = black_box(black_box(robot).inverse(black_box(&position)));
        })
    }

    #[inline(never)]
    fn arms(
        console: &mut Console,
        counter: &mut Counter,
        robot: &Robot<f32>,
        settings: &Settings<f32>,
    ) -> fmt::Result {
        let mut calibrator = Calibrator::new(robot, settings);
        let (mut adding, mut steps) = (Calls::default(), Calls::default());
        for sample in &samples() {
            adding.count(counter, || {
                let _ = calibrator.add(sample);
            })?;
        }
        let mut solver = RobotSolver::new(&mut calibrator).map_err(|_| fmt::Error)?;
        let mut progress = Ok(Progress::Working);
        while progress == Ok(Progress::Working) {
            steps.count(counter, || progress = solver.step(&calibrator))?;
        }
        let mean = adding.all / u32::try_from(SAMPLES).map_err(|_| fmt::Error)?;
        writeln!(console, "COUNT f32 add, mean: {mean}")?;
        writeln!(console, "COUNT f32 all steps: {}", steps.all)?;
        writeln!(console, "COUNT f32 longest step: {}", steps.longest)
    }

    #[inline(never)]
    fn joint(
        console: &mut Console,
        counter: &mut Counter,
        robot: &Robot<f32>,
        settings: &Settings<f32>,
    ) -> fmt::Result {
        let mut calibrator = JointCalibrator::new(robot, settings);
        let (mut adding, mut steps) = (Calls::default(), Calls::default());
        for sample in &samples() {
            adding.count(counter, || {
                let _ = calibrator.add(sample);
            })?;
        }
        one(console, counter, "joint, flush", || calibrator.flush())?;
        let mut solver = JointSolver::new(&mut calibrator).map_err(|_| fmt::Error)?;
        let mut progress = Progress::Working;
        while progress == Progress::Working {
            steps.count(counter, || progress = solver.step(&calibrator))?;
        }
        let mut outcome = None;
        one(console, counter, "joint, end", || {
            outcome = solver.outcome(&calibrator).ok();
        })?;
        black_box(&outcome);
        let mean = adding.all / u32::try_from(SAMPLES).map_err(|_| fmt::Error)?;
        writeln!(console, "COUNT f32 joint, add, mean: {mean}")?;
        writeln!(console, "COUNT f32 joint, all steps: {}", steps.all)?;
        writeln!(console, "COUNT f32 joint, longest step: {}", steps.longest)
    }

    fn observation(index: usize, sample: &Sample<f32>) -> Observation<f32> {
        let mut observation = Observation::at(sample.joints);
        let position = &sample.position;
        match index % 3 {
            0 => {
                observation.height = Some(Height {
                    plane: 0,
                    height: position.z + 560.0,
                });
            }
            1 => observation.position = [Some(position.x), None, Some(position.z)],
            _ => {
                observation.distance = Some(Distance {
                    from: DistanceFrom::Point(0),
                    distance: position.norm(),
                });
            }
        }
        observation
    }

    #[inline(never)]
    fn observe(
        console: &mut Console,
        counter: &mut Counter,
        robot: &Robot<f32>,
        settings: &Settings<f32>,
    ) -> fmt::Result {
        let sigma = noise::<f32>().position();
        let noise = ObservationNoise::new(noise(), sigma, sigma).map_err(|_| fmt::Error)?;
        let instruments = Instruments {
            frame: PositionFrame::Base,
            planes: &[Plane::default()],
            points: &[Point::default()],
            noise,
            transmission: None,
        };
        let samples = samples::<f32>();
        let mut index = 0;
        let mut rows = samples.map(|sample| {
            index += 1;
            ObservationRow::new(observation(index - 1, &sample))
        });
        one(console, counter, "observations", || {
            let problem = ObservationProblem::<f32, 36>::prepare(robot, &instruments, &mut rows);
            if let Ok(problem) = problem {
                let _ = black_box(problem.solve::<37, 703>(settings).is_ok());
            }
        })
    }
}
