//! A region as files and arguments write it.

use super::columns::length;
use super::convention::Convention;
use crate::geometry::Region;
use std::fmt;
use std::str::FromStr;

impl Region {
    /// Converted to the axes of a convention, or back.
    pub(crate) fn turned(&self, convention: &Convention) -> Self {
        Self {
            ranges: convention.ranges(self.ranges),
            ..*self
        }
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
