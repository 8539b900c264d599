//! The calibration that `speed.py` asks of the package, called directly: the shortest of some runs, in seconds.
//!
//! ```sh
//! cargo run --release --package delta-cal-python --example direct -- robot.toml samples.csv
//! ```

use delta_cal_host::{InputText, Options, RobotFile, calibrate, read_samples};
use std::error::Error;
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<_> = std::env::args().skip(1).collect();
    let [robot, samples] = paths.as_slice() else {
        return Err("a robot file and a samples file are needed".into());
    };
    let text = |path: &String| -> Result<InputText, Box<dyn Error>> {
        Ok(InputText::from_bytes(path, &std::fs::read(path)?)?)
    };
    let robot = RobotFile::read(&text(robot)?)?;
    let options = Options::default();
    let readings = read_samples(&text(samples)?, &robot, &options)?;
    let mut shortest = Duration::MAX;
    for _ in 0..20 {
        let begin = Instant::now();
        calibrate(&robot, &readings, &options)?;
        shortest = shortest.min(begin.elapsed());
    }
    println!("{}", shortest.as_secs_f64());
    Ok(())
}
