//! Exact quantiles in bounded memory, by passes over values that are not kept.

use serde::Serialize;
use std::mem;

/// Of a case: 5, 25, 50, 75 and 95 %.
const PERCENTS: [u64; 5] = [5, 25, 50, 75, 95];

/// So many values are kept and sorted.
const KEPT: usize = 16_384;
/// Of more values, one pass settles this many bits of their ordered representation.
const DIGIT: u32 = 12;

/// Five quantiles, linear between the two nearest values (NumPy's default).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// At 5 %.
    pub p05: f64,
    /// At 25 %.
    pub p25: f64,
    /// At 50 %.
    pub median: f64,
    /// At 75 %.
    pub p75: f64,
    /// At 95 %.
    pub p95: f64,
}

impl Quantiles {
    /// From the lowest to the highest.
    pub const fn values(&self) -> [f64; 5] {
        [self.p05, self.p25, self.median, self.p75, self.p95]
    }
}

/// Finds the quantiles of values that are offered once in every pass, in any order.
///
/// Values are ordered as `f64::total_cmp` orders them. Every pass narrows the intervals in which the
/// wanted ranks lie, until what lies in them can be kept: 16,384 values need one pass, a thousand
/// times as many two or three.
#[derive(Debug)]
pub(super) struct QuantileFinder {
    intervals: Vec<Interval>,
    /// Of all values; known after the first pass.
    count: Option<u64>,
}

/// The values whose ordered representation begins with `bits` bits, `prefix`.
#[derive(Debug)]
struct Interval {
    prefix: u64,
    bits: u32,
    /// Values below the interval.
    below: u64,
    content: Content,
    /// Nothing more is to be learned about it.
    settled: bool,
}

#[derive(Debug)]
enum Content {
    /// All values.
    Kept(Vec<u64>),
    /// Too many to keep: how many have each next digit.
    Digits(Vec<u64>),
    /// So many times the prefix, which has all bits.
    Equal(u64),
}

impl Default for QuantileFinder {
    fn default() -> Self {
        Self {
            intervals: vec![Interval::new(0, 0, 0)],
            count: None,
        }
    }
}

impl QuantileFinder {
    pub(super) fn offer(&mut self, value: f64) {
        let key = ordered(value);
        for interval in &mut self.intervals {
            interval.offer(key);
        }
    }

    /// Ends a pass. Whether the values must be offered once more.
    pub(super) fn another_pass(&mut self) -> bool {
        let count = self.intervals.iter().map(Interval::count).sum();
        let ranks = ranks(*self.count.get_or_insert(count));
        self.intervals = mem::take(&mut self.intervals)
            .into_iter()
            .flat_map(|interval| interval.narrowed(&ranks))
            .collect();
        self.intervals.iter().any(|interval| !interval.settled)
    }

    /// `None` of no values, or before the last pass.
    pub(super) fn quantiles(&self) -> Option<Quantiles> {
        let ranks = ranks(self.count?);
        let mut values = [0.0; 5];
        for (value, rank) in values.iter_mut().zip(&ranks) {
            let (low, high) = (self.at(rank.index)?, self.at(rank.next())?);
            *value = if low.total_cmp(&high).is_eq() {
                low // infinite ones too
            } else {
                low + (high - low) * f64::from(rank.hundredths) / 100.0
            };
        }
        let [p05, p25, median, p75, p95] = values;
        (!ranks.is_empty()).then_some(Quantiles {
            p05,
            p25,
            median,
            p75,
            p95,
        })
    }

    fn at(&self, index: u64) -> Option<f64> {
        self.intervals
            .iter()
            .find_map(|interval| interval.at(index.checked_sub(interval.below)?))
            .map(value)
    }
}

impl Interval {
    const fn new(prefix: u64, bits: u32, below: u64) -> Self {
        Self {
            prefix,
            bits,
            below,
            content: Content::Kept(Vec::new()),
            settled: false,
        }
    }

    fn count(&self) -> u64 {
        match &self.content {
            Content::Kept(keys) => keys.len() as u64,
            Content::Digits(digits) => digits.iter().sum(),
            Content::Equal(count) => *count,
        }
    }

    fn digit_bits(&self) -> u32 {
        DIGIT.min(u64::BITS - self.bits)
    }

    fn offer(&mut self, key: u64) {
        let rest = u64::BITS - self.bits;
        if self.settled || key.checked_shr(rest).unwrap_or(0) != self.prefix {
            return;
        }
        let width = self.digit_bits();
        let digit = |key: u64| usize::try_from((key >> (rest - width)) & ((1 << width) - 1));
        let count = |digits: &mut [u64], key: u64| {
            if let Some(of_digit) = digit(key).ok().and_then(|digit| digits.get_mut(digit)) {
                *of_digit += 1;
            }
        };
        match &mut self.content {
            Content::Kept(keys) if keys.len() < KEPT => keys.push(key),
            Content::Kept(keys) => {
                let mut digits = vec![0; 1 << width];
                for kept in keys.iter() {
                    count(&mut digits, *kept);
                }
                count(&mut digits, key);
                self.content = Content::Digits(digits);
            }
            Content::Digits(digits) => count(digits, key),
            Content::Equal(_) => {}
        }
    }

    /// The parts in which wanted ranks lie.
    fn narrowed(mut self, ranks: &[Rank]) -> Vec<Self> {
        let width = self.digit_bits();
        let digits = match &mut self.content {
            Content::Kept(keys) => {
                keys.sort_unstable();
                self.settled = true;
                return vec![self];
            }
            Content::Equal(_) => return vec![self],
            Content::Digits(digits) => digits,
        };
        let mut below = self.below;
        let mut parts = Vec::new();
        for (digit, count) in digits.iter().enumerate() {
            let inside = below..below + count;
            if ranks
                .iter()
                .any(|rank| inside.contains(&rank.index) || inside.contains(&rank.next()))
            {
                let prefix = (self.prefix << width) | digit as u64;
                let mut part = Self::new(prefix, self.bits + width, below);
                if part.bits == u64::BITS {
                    part.content = Content::Equal(*count);
                    part.settled = true;
                }
                parts.push(part);
            }
            below += count;
        }
        parts
    }

    fn at(&self, index: u64) -> Option<u64> {
        match &self.content {
            Content::Kept(keys) => keys.get(usize::try_from(index).ok()?).copied(),
            Content::Equal(count) => (index < *count).then_some(self.prefix),
            Content::Digits(_) => None,
        }
    }
}

/// Where a quantile lies among the sorted values: at `index`, or so many hundredths of the way to
/// the next.
struct Rank {
    index: u64,
    hundredths: u32,
}

impl Rank {
    fn next(&self) -> u64 {
        self.index + u64::from(self.hundredths > 0)
    }
}

/// Of the five quantiles; none of no values.
fn ranks(count: u64) -> Vec<Rank> {
    let Some(last) = count.checked_sub(1) else {
        return Vec::new();
    };
    PERCENTS
        .map(|percent| Rank {
            index: last / 100 * percent + last % 100 * percent / 100,
            hundredths: u32::try_from(last % 100 * percent % 100).unwrap_or(0),
        })
        .into()
}

/// Whole numbers in the order of `f64::total_cmp`.
const fn ordered(value: f64) -> u64 {
    let bits = value.to_bits();
    if bits >> 63 == 0 {
        bits | 1 << 63
    } else {
        !bits
    }
}

const fn value(key: u64) -> f64 {
    f64::from_bits(if key >> 63 == 1 {
        key & !(1 << 63)
    } else {
        !key
    })
}

#[cfg(test)]
mod tests {
    use super::{KEPT, QuantileFinder};

    /// Passes, and the quantiles.
    fn find(values: &[f64]) -> (u32, Option<[f64; 5]>) {
        let mut finder = QuantileFinder::default();
        for passes in 1.. {
            for value in values {
                finder.offer(*value);
            }
            if !finder.another_pass() {
                return (passes, finder.quantiles().map(|found| found.values()));
            }
        }
        (0, None)
    }

    /// `numpy.quantile([7, -1, 3.5, 100, 2, 2], [.05, .25, .5, .75, .95])`, NumPy 2.
    #[test]
    fn a_few_values_have_numpys_quantiles() {
        let (passes, found) = find(&[7.0, -1.0, 3.5, 100.0, 2.0, 2.0]);
        assert_eq!(passes, 1);
        for (found, expected) in found
            .into_iter()
            .flatten()
            .zip([-0.25, 2.0, 2.75, 6.125, 76.75])
        {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        assert_eq!(find(&[]).1, None);
        assert_eq!(find(&[4.0]).1, Some([4.0; 5]));
    }

    /// The values 0 … n − 1 in a scattered order, of both signs: their quantiles are known.
    #[test]
    fn many_values_have_exact_quantiles_in_a_few_passes() {
        let n = 1_000_001_u32;
        let values: Vec<_> = (0..n)
            .map(|k| f64::from(k * 7 % 97 + k / 97 * 97) - 500_000.0)
            .map(|v| v * 1e-3)
            .collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let (passes, found) = find(&values);
        let expected = [0.05, 0.25, 0.5, 0.75, 0.95].map(|p| {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let index = (p * f64::from(n - 1)).round() as usize;
            sorted[index]
        });
        assert_eq!(found, Some(expected));
        assert!((2..=3).contains(&passes), "{passes}");
    }

    #[test]
    fn many_equal_and_infinite_values_are_no_obstacle() {
        let mut values = vec![-2.5; 3 * KEPT];
        values.extend(vec![f64::INFINITY; KEPT]);
        let found = find(&values).1;
        let infinity = f64::INFINITY;
        assert_eq!(found.map(|v| v[0]), Some(-2.5));
        assert_eq!(found.map(|v| v[2]), Some(-2.5));
        assert_eq!(found.map(|v| v[4]), Some(infinity));
    }
}
