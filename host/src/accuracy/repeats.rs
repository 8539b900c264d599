//! Pose accuracy and repeatability from repeated poses (ISO 9283:1998, 7.2).
//!
//! With the barycentre X̄ of the n positions attained for one command Xc, and lⱼ = |Xⱼ − X̄|:
//!
//! ```text
//! AP = |X̄ − Xc|,   RP = l̄ + 3 S,   S = √(Σ (lⱼ − l̄)² / (n − 1)),   vAP = max |X̄ₐ − X̄ᵦ| over directions of approach
//! ```

use crate::files::{Kind, READINGS, Reading, Readings, Row};
use crate::geometry::centroid;
use crate::halt;
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};

/// Fewer repetitions of a pose say nothing of its repeatability.
const LEAST: usize = 3;

/// What repeated poses show, mm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repeatability {
    /// Each pose, and each of its directions of approach.
    pub poses: Vec<RepeatedPose>,
    /// The largest pose accuracy AP.
    pub ap_mm: f64,
    /// The largest pose repeatability RP.
    pub rp_mm: f64,
    /// The multi-directional pose accuracy variation vAP, if a pose was approached from several directions.
    pub vap_mm: Option<f64>,
    /// Drift dAP: the largest change of AP from the first half of the repetitions to the last.
    pub drift_ap_mm: Option<f64>,
    /// Drift dRP, the same of RP.
    pub drift_rp_mm: Option<f64>,
}

/// One pose, mm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RepeatedPose {
    /// Its name, or the line of its first row.
    pub name: String,
    /// From where it was approached, if the file says so.
    pub approach: Option<String>,
    /// Repetitions.
    pub count: usize,
    /// Pose accuracy.
    pub ap_mm: f64,
    /// The same along x, y and z, in the axes of the robot file.
    pub ap_xyz_mm: [f64; 3],
    /// Pose repeatability.
    pub rp_mm: f64,
}

/// A position as commanded and as attained, mm.
pub(crate) type Attained = (Vector3<f64>, Vector3<f64>);

/// The poses of rows: of the same `name`, or the same place in each `repeat`, or the same joints to the last digit; of
/// several targets each has its own.
fn keys(readings: &Readings) -> impl Iterator<Item = String> {
    let mut counted: BTreeMap<String, usize> = BTreeMap::new();
    let mut firsts: BTreeMap<[u64; 3], u64> = BTreeMap::new();
    readings.rows.iter().map(move |row: &Row<Reading>| {
        halt::check();
        let label = readings.labels.get(&row.line).cloned().unwrap_or_default();
        let name = if let Some(repeat) = label.repeat {
            let place = counted.entry(repeat).or_default();
            *place += 1;
            label.name.unwrap_or_else(|| format!("pose {place}"))
        } else {
            let bits = row.value.joints.map(|own| (own + 0.0).to_bits());
            let line = firsts.entry(bits).or_insert(row.line);
            label.name.unwrap_or_else(|| format!("line {line}"))
        };
        match &readings.targets[..] {
            [] | [_] => name,
            targets => format!("{name}, {}", targets[row.value.target]),
        }
    })
}

/// AP and RP.
fn accuracy(rows: &[Attained]) -> (Vector3<f64>, f64) {
    let count = rows.len() as f64;
    let centre = centroid(rows.iter().map(|(_, attained)| *attained));
    let commanded = centroid(rows.iter().map(|(commanded, _)| *commanded));
    let lengths = rows.iter().map(|(_, attained)| (attained - centre).norm());
    let mean = lengths.clone().sum::<f64>() / count;
    let scatter = lengths.map(|own| (own - mean).powi(2)).sum::<f64>();
    (
        centre - commanded,
        mean + 3.0 * (scatter / (count - 1.0).max(1.0)).sqrt(),
    )
}

impl Repeatability {
    /// Of complete positions, row by row, in the axes of the robot file; `None` if no pose was measured three times.
    pub(crate) fn of(readings: &Readings, attained: &[Option<Attained>]) -> Option<Self> {
        let mut groups: BTreeMap<(usize, Option<String>), Vec<Attained>> = BTreeMap::new();
        let mut names: Vec<String> = Vec::new();
        let mut places: HashMap<String, usize> = HashMap::new();
        for ((row, key), own) in readings.rows.iter().zip(keys(readings)).zip(attained) {
            let Some(own) = own else { continue };
            let place = *places.entry(key).or_insert_with_key(|key| {
                names.push(key.clone());
                names.len() - 1
            });
            let approach = readings.labels.get(&row.line);
            let approach = approach.and_then(|label| label.approach.clone());
            groups.entry((place, approach)).or_default().push(*own);
        }
        groups.retain(|_, rows| rows.len() >= LEAST);
        let of_group = |((place, approach), rows): (&(usize, Option<String>), &Vec<Attained>)| {
            let (off, rp_mm) = accuracy(rows);
            RepeatedPose {
                name: names[*place].clone(),
                approach: approach.clone(),
                count: rows.len(),
                ap_mm: off.norm(),
                ap_xyz_mm: off.into(),
                rp_mm,
            }
        };
        let poses: Vec<_> = groups.iter().map(of_group).collect();
        let most = |of: fn(&RepeatedPose) -> f64| poses.iter().map(of).reduce(f64::max);
        let mut vap_mm: Option<f64> = None;
        let centres: Vec<_> = groups
            .iter()
            .map(|((place, _), rows)| (place, accuracy(rows).0))
            .collect();
        for (index, (place, centre)) in centres.iter().enumerate() {
            for (_, other) in centres[index + 1..].iter().filter(|own| own.0 == *place) {
                let apart = (centre - other).norm();
                vap_mm = Some(vap_mm.map_or(apart, |own| own.max(apart)));
            }
        }
        let halves = groups.values().filter(|rows| rows.len() >= 2 * LEAST);
        let drifts = halves.map(|rows| {
            let (first, last) = rows.split_at(rows.len() / 2);
            let [(before, rp_before), (after, rp_after)] = [first, last].map(accuracy);
            ((after - before).norm(), (rp_after - rp_before).abs())
        });
        let drift = drifts.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
        Some(Self {
            ap_mm: most(|own| own.ap_mm)?,
            rp_mm: most(|own| own.rp_mm)?,
            vap_mm,
            drift_ap_mm: drift.map(|own| own.0),
            drift_rp_mm: drift.map(|own| own.1),
            poses,
        })
    }
}

/// Repeatability of a kind of reading, σ in mm, from poses measured more than once, and its degrees of freedom.
pub(crate) fn of_kind(readings: &Readings, kind: Kind) -> Option<(f64, f64)> {
    let mut poses: BTreeMap<_, Vec<&Reading>> = BTreeMap::new();
    for row in &readings.rows {
        halt::check();
        let own = &row.value;
        let unread = Reading {
            height: own.height.map(|(plane, _)| (plane, 0.0)),
            distance: own.distance.map(|(from, _)| (from, 0.0)),
            target: own.target,
            ..Reading::at(own.joints)
        };
        poses.entry(unread.bits()).or_default().push(own);
    }
    let (mut squares, mut freedom) = (0.0, 0.0);
    for repeated in poses.values().filter(|own| own.len() > 1) {
        for place in (0..READINGS).filter(|place| Kind::of_place(*place) == kind) {
            let values = repeated.iter().filter_map(|own| own.read()[place]);
            let values: Vec<f64> = values.collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            squares += values.iter().map(|own| (own - mean).powi(2)).sum::<f64>();
            freedom += f64::max(count - 1.0, 0.0);
        }
    }
    (freedom > 0.0).then(|| (f64::sqrt(squares / freedom), freedom))
}
