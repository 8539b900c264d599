//! Values that a printer's owner states beside the configuration: `345±0.1mm`, `100=98.5`, `0.3%`.

use crate::files::{InputError, InputText, columns, length::Measured};
use serde::Deserialize;

/// Values that the owner states beside the configuration. Lengths in mm.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
pub struct Stated {
    /// The lengths of the rods between their joints, as made or measured.
    pub rods: Option<[f64; 3]>,
    /// The delta radius as measured: that of the towers minus that of the platform.
    pub radius: Option<f64>,
    /// σ of the length common to all rods.
    pub rods_sigma: Option<f64>,
    /// σ of the radius.
    pub radius_sigma: Option<f64>,
    /// The nominal and the measured lengths of printed parts.
    pub printed: Vec<[f64; 2]>,
    /// The fraction by which prints shrink.
    pub shrinkage: Option<f64>,
    /// The radius and the rods as first configured, and those pasted in their place, as a comment of the configuration
    /// states them.
    pub kept: Option<[[f64; 4]; 2]>,
    /// How far apart the two rods of a tower are, as a comment of the configuration states it.
    pub apart: Option<f64>,
}

impl Stated {
    /// With one length for all rods, or three; with none the rods are as configured.
    ///
    /// # Errors
    /// Another number of lengths.
    pub fn with_rods(mut self, rods: &[Measured]) -> Result<Self, &'static str> {
        self.rods = match rods {
            [] => None,
            [all] => Some([all.length; 3]),
            [a, b, c] => Some([a.length, b.length, c.length]),
            _ => return Err("needs one length, or three"),
        };
        self.rods_sigma = rods.iter().filter_map(|own| own.sigma).reduce(f64::max);
        Ok(self)
    }

    /// With a delta radius; without one it is as configured.
    #[must_use]
    pub fn with_radius(mut self, radius: Option<Measured>) -> Self {
        self.radius = radius.map(|own| own.length);
        self.radius_sigma = radius.and_then(|own| own.sigma);
        self
    }
}

/// A length that was measured on a print, between places of the bed, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Length {
    /// What it is between, as it is called.
    pub name: String,
    /// The places, as designed.
    pub between: [[f64; 2]; 2],
    /// As measured.
    pub length: f64,
}

impl Length {
    /// As designed.
    pub(super) fn designed(&self) -> f64 {
        let [[x, y], [to_x, to_y]] = self.between;
        (to_x - x).hypot(to_y - y)
    }
}

/// A table with a header, as a spreadsheet writes it: comments and empty lines left out, the header in lower case, the cells
/// separated by commas, or by semicolons or tabs, between which commas are decimal ones.
pub(super) struct Table {
    pub(super) header: Vec<String>,
    /// The line of each row, and its cells.
    pub(super) rows: Vec<(u64, Vec<String>)>,
}

impl Table {
    pub(super) fn of(text: &str) -> Self {
        let lines = (1..).zip(text.lines().map(str::trim));
        let mut lines = lines.filter(|(_, own)| !own.is_empty() && !own.starts_with('#'));
        let header = lines.next().map_or("", |(_, own)| own);
        let mut marks = [';', '\t'].into_iter();
        let mark = marks.find(|own| header.contains(*own)).unwrap_or(',');
        let cells = |line: &str| -> Vec<String> {
            let cells = line.split(mark).map(|own| own.trim().trim_matches('"'));
            cells.map(str::to_owned).collect()
        };
        let row = |(line, own): (u64, &str)| match mark {
            ',' => (line, cells(own)),
            _ => (line, cells(&own.replace(',', "."))),
        };
        Self {
            header: cells(&header.to_ascii_lowercase()),
            rows: lines.map(row).collect(),
        }
    }
}

/// A finite number.
pub(super) fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|own: &f64| own.is_finite())
}

/// The columns of a table of lengths.
const COLUMNS: [&str; 7] = [
    "from",
    "x_mm",
    "y_mm",
    "to",
    "to_x_mm",
    "to_y_mm",
    "length_mm",
];

/// Reads a table of lengths between places that have names: a place's x and y are needed where its name stands first, and
/// names are not needed where x and y stand. `None` if this is another file.
///
/// # Errors
/// A row without a place or a length, or a length that is far from the designed one.
pub fn lengths(input: &InputText) -> Result<Option<Vec<Length>>, InputError> {
    let Table { header, rows } = Table::of(input.text());
    let known = |own: &String| COLUMNS.contains(&own.as_str());
    if !header.iter().any(|own| own == "length_mm") || !header.iter().all(known) {
        return Ok(None);
    }
    let mut places: Vec<(String, [f64; 2])> = Vec::new();
    let mut found = Vec::new();
    for (line, row) in rows {
        let cell = |name: &str| {
            let at = header.iter().position(|own| own == name)?;
            row.get(at).filter(|own| !own.is_empty())
        };
        let number = |name: &str| finite(cell(name)?);
        let fault = |cause: &str| {
            InputError::new(input.name(), cause)
                .at_line(line)
                .with_remedy("write for example A,-60,0,B,60,0,119.7 below from,x_mm,y_mm,to,to_x_mm,to_y_mm,length_mm")
        };
        let mut place = |name: &str, x: &str, y: &str| {
            let name = cell(name).cloned();
            if let (Some(x), Some(y)) = (number(x), number(y)) {
                places.extend(name.clone().map(|own| (own, [x, y])));
                return Some((name, [x, y]));
            }
            let known = places.iter().find(|own| Some(&own.0) == name.as_ref())?;
            Some((name, known.1))
        };
        let ends = [
            place("from", "x_mm", "y_mm"),
            place("to", "to_x_mm", "to_y_mm"),
        ];
        let [Some((from, start)), Some((to, end))] = ends else {
            return Err(fault(
                "a place has neither x and y nor a name that a row above states",
            ));
        };
        let own = Length {
            name: match (from, to) {
                (Some(from), Some(to)) => format!("{from} to {to}"),
                _ => format!("line {line} of {}", input.name()),
            },
            between: [start, end],
            length: number("length_mm").ok_or_else(|| fault("the length is not a number"))?,
        };
        if !((own.length / own.designed() - 1.0).abs() < OFF) {
            return Err(fault("the length is not within 10 % of the designed one"));
        }
        found.push(own);
    }
    Ok(Some(found))
}

/// Printed lengths are off by less, as a part of the designed length.
const OFF: f64 = 0.1;

/// Parses the nominal and the measured length of a printed part, mm.
///
/// # Errors
/// Anything but two lengths that are nearly the same.
pub fn printed(text: &str) -> Result<[f64; 2], String> {
    let number = |text| Some(columns::length(text)?.0).filter(|own| *own > 0.0);
    let pair = text.split_once('=');
    pair.and_then(|(wanted, is)| Some([number(wanted)?, number(is)?]))
        .filter(|[wanted, is]| (is / wanted - 1.0).abs() < OFF)
        .ok_or_else(|| {
            "two lengths in mm within 10 % of each other are needed, as 100=98.5".to_owned()
        })
}

/// Parses a shrinkage as a fraction of the length.
///
/// # Errors
/// Anything but a percentage of up to 10.
pub fn shrinkage(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('%').map(|own| own.trim().parse());
    match number {
        Some(Ok(percent)) if (-10.0..=10.0).contains(&percent) => Ok(0.01 * percent),
        _ => Err("a percentage of up to 10 is needed, as 0.3%".to_owned()),
    }
}
