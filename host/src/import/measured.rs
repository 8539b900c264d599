//! The measurements that Klipper saves in `[delta_calibrate]`.

use super::configuration::Configuration;
use crate::files::input_error::InputError;

const SECTION: &str = "delta_calibrate";
/// Klipper looks for no more.
const MOST: usize = 999;

/// Steps of the three motors from their end stops.
pub type Steps = [f64; 3];

/// What was measured, in the order of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Saved {
    /// Heights of the nozzle above the bed, mm: by the probe, then entered by hand.
    pub heights: Vec<(f64, Steps)>,
    /// Distances between two positions, mm.
    pub distances: Vec<(f64, Steps, Steps)>,
    /// What the configuration calls them: the heights, then the distances.
    pub names: Vec<String>,
}

impl Saved {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.heights.is_empty() && self.distances.is_empty()
    }

    /// Of a configuration.
    ///
    /// # Errors
    /// A number that is damaged, or a measurement without its place.
    pub fn read(configuration: &Configuration) -> Result<Self, InputError> {
        let mut saved = Self::default();
        for prefix in ["height", "manual_height"] {
            for index in 0..MOST {
                let name = format!("{prefix}{index}");
                let Some(height) = configuration.number(SECTION, &name)? else {
                    break;
                };
                let steps = steps(configuration, &format!("{name}_pos"))?;
                saved.heights.push((height, steps));
                saved.names.push(name);
            }
        }
        for index in 0..MOST {
            let name = format!("distance{index}");
            let Some(distance) = configuration.above_zero(SECTION, &name)? else {
                break;
            };
            let from = steps(configuration, &format!("{name}_pos1"))?;
            let to = steps(configuration, &format!("{name}_pos2"))?;
            saved.distances.push((distance, from, to));
            saved.names.push(name);
        }
        Ok(saved)
    }
}

fn steps(configuration: &Configuration, option: &str) -> Result<Steps, InputError> {
    let entry = configuration.require(SECTION, option)?;
    let damaged = || {
        configuration.damaged(
            SECTION,
            option,
            "three numbers of steps, separated by commas",
        )
    };
    let mut steps = [0.0; 3];
    let mut parts = entry.value.split(',');
    for own in &mut steps {
        let part = parts
            .next()
            .and_then(|part| part.trim().parse::<f64>().ok());
        *own = part.filter(|value| value.is_finite()).ok_or_else(damaged)?;
    }
    if parts.next().is_some() {
        return Err(damaged());
    }
    Ok(steps)
}
