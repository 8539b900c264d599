//! What an axis shows, and where its labels stand.

use super::PlotError;

/// Decades of a logarithmic axis that have lines between them, at most.
const DIVIDED_DECADES: f64 = 9.0;
/// Decades of a logarithmic axis with a label each, at most.
const LABELLED_DECADES: usize = 10;

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
    pub(super) label: String,
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

    /// Places and texts of the labels between two places, at most about `most` of a linear axis.
    pub(super) fn ticks(&self, (low, high): (f64, f64), most: f64) -> Vec<Tick> {
        match &self.scale {
            Scale::Named(names) => (0..).map(f64::from).zip(names.iter().cloned()).collect(),
            Scale::Linear => steps(low.min(high), low.max(high), most),
            Scale::Logarithmic => decades(low, high),
        }
    }

    /// Places between the labels of a logarithmic axis: 2, 3… 9 times a power of ten.
    pub(super) fn minor(&self, (low, high): (f64, f64)) -> Vec<f64> {
        if self.scale != Scale::Logarithmic || high - low > DIVIDED_DECADES {
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
#[allow(clippy::cast_possible_truncation)] // exponents of f64, or some dozens of steps
fn whole(low: f64, high: f64) -> std::ops::RangeInclusive<i32> {
    low.ceil() as i32..=high.floor() as i32
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn steps(low: f64, high: f64, most: f64) -> Vec<Tick> {
    let least = (high - low) / most;
    let mut exponent = least.log10().floor();
    let factors = [1.0, 2.0, 5.0];
    let factor = factors
        .into_iter()
        .find(|factor| factor * 10f64.powf(exponent) >= least);
    let factor = factor.unwrap_or_else(|| {
        exponent += 1.0;
        1.0
    });
    let step = factor * 10f64.powf(exponent);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 308
    let decimals = (-exponent).max(0.0) as usize;
    let first = (low / step).ceil();
    let places = (0..=100).map(|index| (first + f64::from(index)) * step);
    places
        .take_while(|place| *place <= high)
        .map(|place| (place, number(place, decimals)))
        .collect()
}

fn decades(low: f64, high: f64) -> Vec<Tick> {
    let every = (whole(low, high).count() / LABELLED_DECADES).max(1);
    let decades: Vec<_> = whole(low, high)
        .step_by(every)
        .map(|decade| (f64::from(decade), power_of_ten(decade)))
        .collect();
    if decades.len() > 1 {
        return decades;
    }
    // Less than two decades: 1, 2 and 5.
    let parts = |decade: i32| [1.0, 2.0, 5.0].map(|part: f64| (decade, part));
    whole(low - 1.0, high)
        .flat_map(parts)
        .map(|(decade, part)| {
            let decimals = usize::try_from(-decade).unwrap_or(0);
            let text = number(part * 10f64.powi(decade), decimals);
            (f64::from(decade) + part.log10(), text)
        })
        .filter(|(place, _)| (low..=high).contains(place))
        .collect()
}

/// 0.01, 1000, or 1e-7 where that is shorter.
fn power_of_ten(decade: i32) -> String {
    match decade {
        -4..=5 => number(10f64.powi(decade), usize::try_from(-decade).unwrap_or(0)),
        _ => format!("1e{decade}").replace('-', "\u{2212}"),
    }
}

fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    // −0 has a sign, and so has what is rounded to it.
    let zero = text.parse::<f64>().is_ok_and(|value| value.abs() <= 0.0);
    let text = if zero {
        text.trim_start_matches('-')
    } else {
        &text
    };
    text.replace('-', "\u{2212}")
}
