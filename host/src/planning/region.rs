//! Where the platform may be.

use crate::files::columns::length;
use crate::files::convention::Convention;
use delta_cal::Real;
use nalgebra::Vector3;
use rand_core::Rng;
use std::fmt;
use std::str::FromStr;

/// A box along the robot's axes, or an upright cylinder about its z axis. Lengths in mm, in the
/// robot's frame. Written `x=-100..100,y=-100..100,z=-500..-400` and `r=200,z=-500..-400`.
///
/// ```
/// use delta_cal_host::planning::Region;
/// let region: Region = "r=200, z=-500..-400".parse().unwrap();
/// assert!(region.contains(&nalgebra::Vector3::new(0.0, 199.0, -450.0)));
/// assert!("r=200".parse::<Region>().is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Smallest and largest x, y and z.
    ranges: [(f64, f64); 3],
    /// Of a cylinder.
    radius: Option<f64>,
}

impl Region {
    /// Whether a position is inside or on the boundary.
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        let mut coordinates = x.iter().zip(&self.ranges);
        coordinates.all(|(x, (low, high))| x >= low && x <= high)
            && self.radius.is_none_or(|radius| x.xy().norm() <= radius)
    }

    /// Converted to the axes of a convention, or back.
    pub(super) fn turned(&self, convention: &Convention) -> Self {
        Self {
            ranges: convention.ranges(self.ranges),
            ..*self
        }
    }

    /// The part within a box; `None` if there is none.
    pub(super) fn clipped(&self, to: &[(f64, f64); 3]) -> Option<Self> {
        let mut ranges = self.ranges;
        for ((low, high), (least, most)) in ranges.iter_mut().zip(to) {
            (*low, *high) = (low.max(*least), high.min(*most));
            if *low > *high {
                return None;
            }
        }
        let furthest = |(low, high): (f64, f64)| low.abs().max(high.abs()).squared();
        let corner = (furthest(to[0]) + furthest(to[1])).square_root();
        let radius = self.radius.map(|radius| radius.min(corner));
        Some(Self { ranges, radius })
    }

    /// A uniformly distributed position in it.
    pub(super) fn random<R: Rng + ?Sized>(&self, rng: &mut R) -> Vector3<f64> {
        let mut between = |(low, high): (f64, f64)| low + (high - low) * uniform(rng);
        let Some(radius) = self.radius else {
            return Vector3::from(self.ranges.map(between));
        };
        let distance = radius * between((0.0, 1.0)).sqrt();
        let (sine, cosine) = between((0.0, std::f64::consts::TAU)).sine_cosine();
        Vector3::new(distance * cosine, distance * sine, between(self.ranges[2]))
    }
}

impl fmt::Display for Region {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.ranges;
        match self.radius {
            Some(radius) => write!(formatter, "r={radius}")?,
            None => write!(formatter, "x={}..{},y={}..{}", x.0, x.1, y.0, y.1)?,
        }
        write!(formatter, ",z={}..{}", z.0, z.1)
    }
}

impl FromStr for Region {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::parsed(text).map_err(|cause| {
            format!(
                "{cause}; a box is written x=-100..100,y=-100..100,z=-500..-400 and a cylinder \
                 r=200,z=-500..-400, both in mm"
            )
        })
    }
}

impl Region {
    fn parsed(text: &str) -> Result<Self, String> {
        let (mut coordinates, mut radius) = ([None; 3], None);
        for part in text.split(',') {
            let Some((name, value)) = part.split_once('=') else {
                return Err(format!("'{}' has no =", part.trim()));
            };
            let (name, value) = (name.trim(), value.trim());
            let taken = if name == "r" {
                let number = number(value)?;
                if !(number > 0.0) {
                    return Err(format!("the radius {value} must be greater than 0"));
                }
                radius.replace(number).is_some()
            } else {
                let index = ["x", "y", "z"].iter().position(|axis| *axis == name);
                let coordinate = index.and_then(|index| coordinates.get_mut(index));
                let Some(coordinate) = coordinate else {
                    return Err(format!("'{name}' is not one of x, y, z and r"));
                };
                coordinate.replace(range(name, value)?).is_some()
            };
            if taken {
                return Err(format!("{name} is given twice"));
            }
        }
        let ranges = match (coordinates, radius) {
            ([Some(x), Some(y), Some(z)], None) => [x, y, z],
            ([None, None, Some(z)], Some(radius)) => [(-radius, radius), (-radius, radius), z],
            (_, Some(_)) => return Err("a cylinder has r and z and nothing else".to_owned()),
            (coordinates, None) => {
                let missing = ["x", "y", "z"].into_iter().zip(coordinates);
                let missing = missing.filter_map(|(axis, range)| range.is_none().then_some(axis));
                let missing: Vec<_> = missing.collect();
                return Err(format!("{} missing", missing.join(" and ")));
            }
        };
        Ok(Self { ranges, radius })
    }
}

fn range(name: &str, text: &str) -> Result<(f64, f64), String> {
    let Some((low, high)) = text.split_once("..") else {
        return Err(format!("{name}={text} is not a range such as -100..100"));
    };
    let (low, high) = (number(low)?, number(high)?);
    if low < high {
        Ok((low, high))
    } else {
        let cause = "is empty: the smaller number comes first";
        Err(format!("{name}={text} {cause}"))
    }
}

/// A length, in mm where it has no unit.
fn number(text: &str) -> Result<f64, String> {
    let length = length(text).map(|(length, _)| length);
    length.ok_or_else(|| format!("'{}' is not a number", text.trim()))
}

/// A uniformly distributed number in [0, 1).
pub(super) fn uniform<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    // 53 bits, the precision of a double.
    let bits = rng.next_u64() >> 11;
    let number = bits as f64;
    number * f64::EPSILON / 2.0
}

/// A uniformly distributed whole number below `number`.
pub(super) fn below(number: usize, rng: &mut impl Rng) -> usize {
    usize::try_from(rng.next_u64() % number.max(1) as u64).unwrap_or(0)
}
