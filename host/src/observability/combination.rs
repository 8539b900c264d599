//! A combination of parameters, in words.

use super::parameter_at;
use crate::words::list;
use delta_cal::{ArmIndex, Parameter};
use nalgebra::DVector;

/// A parameter belongs to a combination if its part is at least this part of the largest.
const BELONGS: f64 = 0.4;
/// Parameters that are named.
const NAMED: usize = 8;

/// Parameters that change together.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// Arm, parameter and part, the largest first and 1; parts below 0.4 are left out.
    pub parts: Vec<(ArmIndex, Parameter, f64)>,
    /// One σ of it, in the unit of its parts; infinite if it is not known at all.
    pub sigma: f64,
}

impl Combination {
    /// Of a direction in which the parameters from the one numbered `first` of 24 change.
    pub(crate) fn new(first: usize, direction: &DVector<f64>, sigma: f64) -> Self {
        let largest = if direction.is_empty() {
            1.0
        } else {
            direction[direction.iamax()]
        };
        let mut parts: Vec<_> = direction
            .iter()
            .enumerate()
            .map(|(index, part)| {
                let (arm, parameter) = parameter_at(first + index);
                (arm, parameter, part / largest)
            })
            .filter(|(.., part)| part.abs() >= BELONGS)
            .collect();
        parts.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        Self { parts, sigma }
    }

    /// "+Dz, −La_y and −Lb"; of several arms "+Dz of arm 1 and −Dz of arm 2". A single parameter has
    /// no sign.
    pub fn in_words(&self) -> String {
        let one_arm = self.parts.windows(2).all(|pair| pair[0].0 == pair[1].0);
        if let [(_, alone, _)] = self.parts.as_slice() {
            return alone.to_string();
        }
        let mut words: Vec<_> = self
            .parts
            .iter()
            .take(NAMED)
            .map(|(arm, parameter, part)| {
                let sign = if *part < 0.0 { "\u{2212}" } else { "+" };
                if one_arm {
                    format!("{sign}{parameter}")
                } else {
                    format!("{sign}{parameter} of {arm}")
                }
            })
            .collect();
        if self.parts.len() > NAMED {
            words.push(format!("{} others", self.parts.len() - NAMED));
        }
        list(&words)
    }

    /// Whether it is more than one parameter.
    pub fn is_several(&self) -> bool {
        self.parts.len() > 1
    }
}
