use super::PlotError;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use std::ops::Range;

/// Decades of a logarithmic axis with a label each.
const LABELLED_DECADES: i32 = 9;

/// Place and text of a label.
pub(super) type Tick = (f64, String);

#[derive(Debug, Clone, PartialEq)]
enum Scale {
    Linear,
    Logarithmic,
    Named(Vec<String>),
}

/// What an axis shows: its label with the unit, its range, its scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    label: String,
    low: f64,
    high: f64,
    scale: Scale,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self {
            label: label.into(),
            low,
            high,
            scale: Scale::Linear,
        }
    }

    /// A logarithmic axis; both ends are positive.
    pub fn logarithmic(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self {
            scale: Scale::Logarithmic,
            ..Self::linear(label, low, high)
        }
    }

    /// A linear axis with names at 0, 1, 2…, the first one at the far end.
    pub fn named(label: impl Into<String>, names: Vec<String>) -> Self {
        let count = u32::try_from(names.len()).map_or(f64::INFINITY, f64::from);
        Self {
            scale: Scale::Named(names),
            ..Self::linear(label, count - 0.5, -0.5)
        }
    }

    pub(super) fn label(&self) -> &str {
        &self.label
    }

    /// Where a value is on the paper, before it is scaled; `None` for what has no place.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Logarithmic => value.log10(),
            Scale::Linear | Scale::Named(_) => value,
        };
        place.is_finite().then_some(place)
    }

    /// The ends of the axis on the paper.
    pub(super) fn ends(&self) -> Result<(f64, f64), PlotError> {
        match (self.place(self.low), self.place(self.high)) {
            (Some(low), Some(high)) if (high - low).abs() > 0.0 => Ok((low, high)),
            _ => Err(PlotError::Range(self.label.clone())),
        }
    }

    /// Places and texts of the labels between two places, at most about `most` of them.
    pub(super) fn ticks(&self, (low, high): (f64, f64), most: usize) -> Vec<Tick> {
        match &self.scale {
            Scale::Named(names) => (0..)
                .map(f64::from)
                .zip(names)
                .map(|(place, name)| (place, name.clone()))
                .collect(),
            Scale::Linear => {
                let places = round_places(low, high, most);
                let step = places.windows(2).map(|pair| pair[1] - pair[0]).next();
                let decimals = decimals(step.unwrap_or(1.0));
                places
                    .into_iter()
                    .map(|place| (place, number(place, decimals)))
                    .collect()
            }
            Scale::Logarithmic => decades(low, high),
        }
    }

    /// Places between the labels of a logarithmic axis: 2, 3… 9 times a power of ten.
    pub(super) fn minor(&self, (low, high): (f64, f64)) -> Vec<f64> {
        if self.scale != Scale::Logarithmic || high - low > f64::from(LABELLED_DECADES) {
            return Vec::new();
        }
        let multiples = (2..10).map(f64::from).map(f64::log10);
        whole(low - 1.0, high)
            .flat_map(|decade| multiples.clone().map(move |part| f64::from(decade) + part))
            .filter(|place| (low..=high).contains(place))
            .collect()
    }
}

/// The whole numbers between two places.
#[allow(clippy::cast_possible_truncation)] // exponents of f64
fn whole(low: f64, high: f64) -> std::ops::RangeInclusive<i32> {
    low.ceil() as i32..=high.floor() as i32
}

fn round_places(low: f64, high: f64, most: usize) -> Vec<f64> {
    let coordinate: RangedCoordf64 = (low.min(high)..low.max(high)).into();
    coordinate
        .key_points(most)
        .into_iter()
        // −0 is written with its sign.
        .map(|place| if place.abs() < 1e-12 { 0.0 } else { place })
        .collect()
}

fn decades(low: f64, high: f64) -> Vec<Tick> {
    let every = (whole(low, high).count() / 10).max(1);
    let decades: Vec<_> = whole(low, high)
        .step_by(every)
        .map(|decade| (f64::from(decade), power_of_ten(decade)))
        .collect();
    if decades.len() > 1 {
        return decades;
    }
    // Less than two decades: 1, 2 and 5.
    whole(low - 1.0, high)
        .flat_map(|decade| [1.0, 2.0, 5.0].map(|part: f64| (decade, part)))
        .map(|(decade, part)| (f64::from(decade) + part.log10(), decade, part))
        .filter(|(place, ..)| (low..=high).contains(place))
        .map(|(place, decade, part)| {
            let decimals = usize::try_from(-decade).unwrap_or(0);
            (place, number(part * 10f64.powi(decade), decimals))
        })
        .collect()
}

/// 0.01, 1000, or 1e-7 where that is shorter.
fn power_of_ten(decade: i32) -> String {
    match decade {
        -4..=5 => number(10f64.powi(decade), usize::try_from(-decade).unwrap_or(0)),
        _ => format!("1e{decade}").replace('-', "\u{2212}"),
    }
}

/// Decimals that tell numbers apart that differ by `step`.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 12
fn decimals(step: f64) -> usize {
    (0..12)
        .find(|decimals| {
            let scaled = step * 10f64.powi(*decimals);
            (scaled - scaled.round()).abs() < 1e-6 * scaled
        })
        .map_or(12, |decimals| decimals as usize)
}

fn number(value: f64, decimals: usize) -> String {
    format!("{value:.decimals$}").replace('-', "\u{2212}")
}

/// An axis as the drawing library takes it: linear in places, with the lines that it is told.
pub(super) struct Coordinate {
    places: RangedCoordf64,
    labelled: Vec<f64>,
    minor: Vec<f64>,
}

impl Coordinate {
    pub(super) fn new(axis: &Axis, (from, to): (f64, f64), ticks: &[Tick]) -> Self {
        Self {
            places: (from..to).into(),
            labelled: ticks.iter().map(|tick| tick.0).collect(),
            minor: axis.minor((from, to)),
        }
    }
}

impl Ranged for Coordinate {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.places.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            self.minor.clone()
        } else {
            self.labelled.clone()
        }
    }

    fn range(&self) -> Range<f64> {
        self.places.range()
    }
}
