//! Joints in one file and readings in another, as a controller and an instrument write them.

use super::table::Table;
use super::{Readings, Row, index_of};
use crate::files::columns::{Quantity, Unit};
use crate::files::input::{InputError, InputText};
use crate::files::robot_file::{ONLY_TARGET, RobotFile};
use crate::files::time;
use crate::order;
use crate::text::count;
use delta_cal::robot::Drive;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Times match if they differ by at most this fraction of the median interval of the denser file.
const NEAR: f64 = 0.5;

/// How two files were joined.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Joined {
    /// The file with the joints.
    pub joints_file: String,
    /// The common column; `None` if rows were joined by order.
    pub by: Option<String>,
    /// Number of rows of joints without a measurement.
    pub unused: usize,
    /// Columns that neither file needs.
    pub ignored: Vec<String>,
}

/// A column of each file that may say which rows belong together.
struct Key {
    /// In the file of readings.
    name: String,
    /// In that of joints.
    other: String,
    joints: Vec<String>,
    measured: Vec<String>,
}

impl Readings {
    /// Reads joints from one file and readings from another, given in either order. Rows are matched by a common column
    /// (equal names or numbers, nearest times) or, without one, by order.
    ///
    /// # Errors
    /// Same as [`read`](Self::read); also a measured row without joints, a name shared by two rows of joints, or,
    /// without a common column, different numbers of rows.
    pub fn read_pair(
        one: &InputText,
        other: &InputText,
        robot: &RobotFile,
    ) -> Result<Self, InputError> {
        let joints_of = Quantity::joints(robot.limits.drive());
        let first = Table::parse(one, &robot.convention, true)?;
        let second = Table::parse(other, &robot.convention, true)?;
        let mut mapped = one.columns().0.iter().map(|own| &own.column);
        if let Some(column) = mapped.find(|own| !(first.has_name(own) || second.has_name(own))) {
            let cause = "neither file has this column, which --columns names";
            return Err(InputError::new(other.name(), cause).at_column(column));
        }
        let (joints, measured) = if first.has_any(&joints_of) || !second.has_any(&joints_of) {
            (first, second)
        } else {
            (second, first)
        };
        joints.require(&joints_of)?;
        measured.require_readings()?;
        let poses = joints.rows(|row| row.joints(robot))?;
        let mut file = Self::of_name(measured.input.name());
        let mut rows = measured.rows(|row| file.reading(row, [0.0; 3], robot))?;
        let cells = measured.unread_cells()?;
        let datum = |index: usize| {
            let cells = cells.iter().filter_map(|(_, cells)| cells.get(index));
            let mut cells = cells.map(|own| own.trim());
            let own = cells.find(|own| robot.instruments.is_datum(own));
            own.map(str::to_owned)
        };
        let keys = keys(&joints, &measured, |index| datum(index).is_none())?;
        rows = file.without_datum(rows, |index, _| datum(index));
        let by = chosen(&keys);
        let pairs = match by {
            Some(key) if key.is_time() => by_time(key, 0.0),
            Some(key) => by_name(key, &poses, &joints)?,
            None => by_order(&poses, &rows, &joints, &measured)?,
        };
        if let (Some(key), Some(first)) = (by, pairs.iter().position(Option::is_none)) {
            let cells = key.measured.iter().zip(&pairs);
            let cells = cells.filter(|(_, pair)| pair.is_none());
            let cells: Vec<_> = cells.map(|(cell, _)| cell.as_str()).collect();
            let (cause, remedy) = key.unmatched(&cells, joints.input.name());
            return Err(InputError::new(measured.input.name(), cause)
                .at_line(rows.get(first).map_or(0, |row| row.line))
                .with_remedy(remedy));
        }
        let mut used = vec![false; poses.len()];
        let (labels, _) = joints.labels()?;
        // A plan says which target to measure, and stands beside the joints.
        let planned_targets = if measured.has_any(&[Quantity::Target]) {
            Vec::new()
        } else {
            joints.rows(|row| Ok(row.text(Quantity::Target).map(Cow::into_owned)))?
        };
        let mut targets = Vec::new();
        let mut planned = BTreeMap::new();
        for (row, pair) in rows.iter_mut().zip(pairs.into_iter().flatten()) {
            if let (Some(pose), Some(used)) = (poses.get(pair), used.get_mut(pair)) {
                *used = true;
                row.value.joints = pose.value;
                let target = planned_targets
                    .get(pair)
                    .and_then(|own| own.value.as_deref());
                let name = target.or_else(|| Some(file.targets.get(row.value.target)?.as_str()));
                row.value.target = index_of(&mut targets, name.unwrap_or(ONLY_TARGET));
                planned.extend(labels.get(&pose.line).map(|own| (row.line, own.clone())));
            }
        }
        file.targets = targets;
        rows.retain(|row| row.value.readings() > 0);
        let unread = measured
            .unread()
            .filter(|(_, own)| by.is_none_or(|by| by.name != **own));
        let others = joints
            .unread()
            .filter(|(_, own)| by.is_none_or(|by| by.other != **own));
        let joined = Joined {
            joints_file: joints.input.name().to_owned(),
            by: by.map(|key| key.name.clone()),
            unused: used.iter().filter(|used| !**used).count(),
            ignored: unread.chain(others).map(|(_, own)| own.clone()).collect(),
        };
        let mut file = Self {
            in_degrees: joints.unit_of(&Quantity::joints(Drive::Rotary)) == Some(Unit::Degree),
            joined: Some(joined),
            ..file.with_rows(&measured, rows)?
        };
        for (line, own) in planned {
            let measured = file.labels.remove(&line).unwrap_or_default();
            file.labels.insert(line, measured.or(own));
        }
        Ok(file)
    }
}

/// Columns of the same name in both files, other than those read as joints or readings; then columns of names that hold
/// the same ones, whatever their headers.
fn keys(
    joints: &Table<'_>,
    measured: &Table<'_>,
    is_pose: impl Fn(usize) -> bool,
) -> Result<Vec<Key>, InputError> {
    let (mut of_joints, mut of_measured) = (joints.unread_cells()?, measured.unread_cells()?);
    for (_, cells) in &mut of_measured {
        let mut index = 0..;
        cells.retain(|_| index.next().is_none_or(&is_pose));
    }
    for own in [&mut of_joints, &mut of_measured] {
        own.retain(|(name, _)| !["repeat", "approach", "use"].contains(&name.as_str()));
    }
    let same = |one: &str, other: &str| one.trim().eq_ignore_ascii_case(other.trim());
    let mut keys = Vec::new();
    for named in [true, false] {
        for (other, joints) in &of_joints {
            for (name, measured) in &of_measured {
                let key = || Key {
                    name: name.clone(),
                    other: other.clone(),
                    joints: joints.clone(),
                    measured: measured.clone(),
                };
                let alike = same(name, other);
                let by_content = !(named || alike) && are_the_same_names(joints, measured);
                if alike && named || by_content {
                    keys.push(key());
                }
            }
        }
    }
    Ok(keys)
}

/// Whether each of these cells is a name of its own, and most occur among the others.
fn are_the_same_names(joints: &[String], measured: &[String]) -> bool {
    let is_name =
        |cell: &String| !cell.trim().is_empty() && comparable(cell).parse::<f64>().is_err();
    let known: HashSet<_> = joints.iter().map(|own| comparable(own)).collect();
    let both = measured
        .iter()
        .filter(|own| known.contains(&comparable(own)));
    known.len() == joints.len() && measured.iter().all(is_name) && 2 * both.count() > measured.len()
}

/// The name or number column that matches all rows, else a time column, else the name column with most matches or of the
/// same header.
fn chosen(keys: &[Key]) -> Option<&Key> {
    let found = |key: &Key| {
        let known: HashSet<String> = key.joints.iter().map(|own| comparable(own)).collect();
        let own = key.measured.iter();
        own.filter(|own| known.contains(&comparable(own))).count()
    };
    let complete = |key: &&Key| !key.is_time() && found(key) == key.measured.len();
    let all = keys.iter().find(complete);
    let time = || keys.iter().find(|key| key.is_time());
    let most = || {
        let some = keys.iter().filter(|key| found(key) > 0 || key.is_names());
        some.max_by_key(|key| found(key))
    };
    all.or_else(time).or_else(most)
}

/// Normalises numbers; names stay as they are.
fn comparable(cell: &str) -> String {
    let cell = cell.trim();
    cell.replace(',', ".")
        .parse::<f64>()
        .map_or_else(|_| cell.to_owned(), |number| number.to_string())
}

impl Key {
    /// Whether no cell is a number.
    fn is_names(&self) -> bool {
        let mut cells = self.joints.iter().chain(&self.measured);
        cells.all(|cell| comparable(cell).parse::<f64>().is_err())
    }

    /// Whether its name suggests a time and every cell is one.
    fn is_time(&self) -> bool {
        let name = self.name.to_ascii_lowercase();
        let named = name.contains("time")
            || name == "t"
            || name.starts_with("t ")
            || name.starts_with("t_");
        let mut cells = self.joints.iter().chain(&self.measured);
        named && cells.all(|cell| seconds(cell).is_some())
    }
}

/// Parses seconds, a time of day, or a date with time, in UTC or not.
fn seconds(cell: &str) -> Option<f64> {
    let cell = cell.trim();
    let number = cell.replace(',', ".").parse().ok();
    number.or_else(|| time::seconds(cell))
}

/// For each measured row, the row of joints with the same name.
fn by_name(
    key: &Key,
    poses: &[Row<[f64; 3]>],
    joints: &Table<'_>,
) -> Result<Vec<Option<usize>>, InputError> {
    let mut places: HashMap<String, usize> = HashMap::new();
    for (index, (cell, row)) in key.joints.iter().zip(poses).enumerate() {
        let before = places.insert(comparable(cell), index);
        if let Some(other) = before.and_then(|other| poses.get(other))
            && other.value.iter().ne(&row.value)
        {
            let line = other.line;
            let cause = format!("{cell} is also in line {line}, with other joints");
            return Err(InputError::new(joints.input.name(), cause)
                .at_line(row.line)
                .at_column(&key.name)
                .with_remedy("give each pose a name of its own"));
        }
    }
    let find = |cell: &String| places.get(&comparable(cell)).copied();
    Ok(key.measured.iter().map(find).collect())
}

/// Most names in a message, and most rows whose clocks are compared.
const MOST_NAMED: usize = 8;
const MOST_COMPARED: usize = 2000;

impl Key {
    /// Cause and remedy for cells that no row of joints has: what would make all of them match.
    fn unmatched(&self, cells: &[&str], joints_file: &str) -> (String, String) {
        let more = match cells.len().saturating_sub(MOST_NAMED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let named = &cells[..cells.len().min(MOST_NAMED)];
        let cause = format!(
            "{joints_file} has no {} {}{more}",
            self.name,
            named.join(", ")
        );
        let remedy = if self.is_time() {
            self.other_clock()
        } else {
            self.other_spelling()
        };
        let usual = "add the joints of these poses, or delete the rows; a datum point is named by point in [datum.NAME]";
        (cause, remedy.unwrap_or_else(|| usual.to_owned()))
    }

    /// A prefix or capital letters without which all names match.
    fn other_spelling(&self) -> Option<String> {
        let known = |change: &dyn Fn(&str) -> String| {
            let known: HashSet<_> = self.joints.iter().map(|own| change(own)).collect();
            self.measured.iter().all(|own| known.contains(&change(own)))
        };
        if known(&|own| own.trim().to_ascii_lowercase()) {
            return Some("write the names with the same capital letters in both files".to_owned());
        }
        // What stands before the last separator, and the rest.
        let parts = |own: &str| {
            let at = own.rfind([':', '/', '\\', '.']).map_or(0, |at| at + 1);
            let (before, name) = own.split_at(at);
            (before.trim().to_owned(), name.trim().to_ascii_lowercase())
        };
        known(&|own| parts(own).1).then(|| {
            let mut all = self.measured.iter().chain(&self.joints);
            let prefix = all.find_map(|own| Some(parts(own).0).filter(|own| !own.is_empty()));
            let prefix = prefix.unwrap_or_default();
            format!("all names match without what is before them: delete {prefix}")
        })
    }

    /// A constant difference of the clocks with which all times match.
    fn other_clock(&self) -> Option<String> {
        let first = seconds(self.measured.first()?)?;
        if self.joints.len().max(self.measured.len()) > MOST_COMPARED {
            return None;
        }
        let apart = self
            .joints
            .iter()
            .filter_map(|own| Some(seconds(own)? - first));
        let mut fitting = apart.filter(|apart| by_time(self, *apart).iter().all(Option::is_some));
        let apart = fitting.next()?;
        fitting.next().is_none().then(|| {
            format!(
                "all times match if {apart:.3} s are added to {} of the measurements: the clocks differ",
                self.name
            )
        })
    }
}

/// For each measured row, the row of joints nearest in time, if it is near enough once `later` (seconds) is added.
fn by_time(key: &Key, later: f64) -> Vec<Option<usize>> {
    let of =
        |cells: &[String]| -> Vec<f64> { cells.iter().filter_map(|own| seconds(own)).collect() };
    let (joints, measured) = (of(&key.joints), of(&key.measured));
    let between = |times: &[f64]| {
        let mut sorted = times.to_vec();
        order::sort(&mut sorted);
        let mut steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.retain(|step| *step > 0.0);
        order::sort(&mut steps);
        steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY)
    };
    let near = NEAR * between(&joints).min(between(&measured));
    let nearest = |time: &f64| {
        let apart = |other: &f64| (other - time - later).abs();
        let places = joints.iter().enumerate();
        let (index, other) = places.min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)))?;
        (apart(other) <= near).then_some(index)
    };
    measured.iter().map(nearest).collect()
}

/// Matches rows one to one; their numbers must be equal.
fn by_order<T>(
    poses: &[Row<[f64; 3]>],
    rows: &[Row<T>],
    joints: &Table<'_>,
    measured: &Table<'_>,
) -> Result<Vec<Option<usize>>, InputError> {
    if poses.len() == rows.len() {
        return Ok((0..rows.len()).map(Some).collect());
    }
    let cause = format!(
        "{} and {} of {} cannot be joined by their order, and the files have no column in common",
        count(rows.len(), "row"),
        count(poses.len(), "row"),
        joints.input.name()
    );
    Err(InputError::new(measured.input.name(), cause).with_remedy(
        "give both a column of the same name that says which rows belong together: a point's name, a number or a time",
    ))
}
