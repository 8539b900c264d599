//! A combination of parameters, in words.

use crate::text::words::list;
use delta_cal::{ArmIndex, Parameter};
use nalgebra::DVector;

/// A parameter belongs to a combination if its part is at least this part of the largest.
const BELONGS: f64 = 0.4;
/// Changes that are named.
const NAMED: usize = 5;

/// What a parameter does, of which arms.
struct Change {
    sign: &'static str,
    parameter: Parameter,
    arms: Vec<ArmIndex>,
}

/// "arm 1", "arms 1 and 3", "all arms".
fn arms_in_words(arms: &[ArmIndex]) -> String {
    match arms {
        [one] => one.to_string(),
        arms if arms.len() == ArmIndex::ALL.len() => "all arms".to_owned(),
        arms => {
            let mut numbers: Vec<_> = arms.iter().map(|arm| arm.index() + 1).collect();
            numbers.sort_unstable();
            let numbers: Vec<_> = numbers.iter().map(ToString::to_string).collect();
            format!("arms {}", list(&numbers))
        }
    }
}

/// Parameters that change together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Combination {
    /// Arm, parameter and part, the largest first and 1; parts below 0.4 are left out.
    pub(super) parts: Vec<(ArmIndex, Parameter, f64)>,
    /// One σ of it, in the unit of its parts; infinite if it is not known at all.
    pub(super) sigma: f64,
}

impl Combination {
    /// Of a direction in which these parameters change; `None` stands for none.
    pub(super) fn new(
        parameters: &[Option<(ArmIndex, Parameter)>],
        direction: &DVector<f64>,
        sigma: f64,
    ) -> Self {
        let largest = if direction.is_empty() {
            1.0
        } else {
            direction[direction.iamax()]
        };
        let mut parts: Vec<_> = direction
            .iter()
            .zip(parameters)
            .filter_map(|(part, parameter)| {
                let (arm, parameter) = (*parameter)?;
                Some((arm, parameter, part / largest))
            })
            .filter(|(.., part)| part.abs() >= BELONGS)
            .collect();
        parts.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        Self { parts, sigma }
    }

    /// "+Dz, −La_y and −Lb"; of several arms "+Dz of arm 1 and −Dz of arms 2 and 3". A single parameter
    /// has no sign.
    pub(super) fn in_words(&self) -> String {
        if let [(_, alone, _)] = self.parts.as_slice() {
            return alone.to_string();
        }
        let one_arm = self.parts.windows(2).all(|pair| pair[0].0 == pair[1].0);
        let changes = self.changes();
        let mut words: Vec<_> = changes
            .iter()
            .take(NAMED)
            .map(|change| {
                let (sign, parameter) = (change.sign, change.parameter);
                if one_arm {
                    format!("{sign}{parameter}")
                } else {
                    format!("{sign}{parameter} of {}", arms_in_words(&change.arms))
                }
            })
            .collect();
        match changes.len().saturating_sub(NAMED) {
            0 => {}
            1 => words.push("another".to_owned()),
            others => words.push(format!("{others} others")),
        }
        list(&words)
    }

    /// The same parameter of several arms, in the same direction, is one change.
    fn changes(&self) -> Vec<Change> {
        let mut changes: Vec<Change> = Vec::new();
        for (arm, parameter, part) in &self.parts {
            let sign = if *part < 0.0 { "\u{2212}" } else { "+" };
            let same = |change: &&mut Change| (change.sign, change.parameter) == (sign, *parameter);
            match changes.iter_mut().find(same) {
                Some(change) => change.arms.push(*arm),
                None => changes.push(Change {
                    sign,
                    parameter: *parameter,
                    arms: vec![*arm],
                }),
            }
        }
        changes
    }

    /// Whether it is more than one parameter.
    pub(super) fn is_several(&self) -> bool {
        self.parts.len() > 1
    }
}
