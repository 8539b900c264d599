//! Which of a file's columns hold what, where their names do not say it: `q1_deg=A1,x_mm=Pos X`.

use super::quantity::{ColumnName, Quantity, Unit};
use std::str::FromStr;

/// What the option `--columns` says.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ColumnMapping(Vec<Mapped>);

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mapped {
    /// As the file names the column.
    pub(crate) column: String,
    /// What it holds, in the stated unit or that with which its own name ends.
    pub(crate) name: ColumnName,
}

const EXAMPLE: &str = "as q1_deg=A1,x_mm=X: before = what the column holds and its unit, after it the \
                       column's name in the file";

impl ColumnMapping {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn all(&self) -> &[Mapped] {
        &self.0
    }

    /// The quantity that a column of this name holds.
    pub(crate) fn of_column(&self, column: &str) -> Option<ColumnName> {
        let mut all = self.0.iter();
        let mapped = all.find(|mapped| mapped.column == column)?;
        Some(mapped.name)
    }

    /// Whether some column is said to hold this.
    pub(crate) fn has(&self, quantity: Quantity) -> bool {
        self.0.iter().any(|mapped| mapped.name.quantity == quantity)
    }
}

impl FromStr for ColumnMapping {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut mapping = Self::default();
        for part in text.split(',') {
            let mapped = mapped(part.trim())?;
            let quantity = mapped.name.quantity;
            if mapping.has(quantity) {
                let name = quantity.column(quantity.usual_unit());
                return Err(format!("{name} is given two columns"));
            }
            if mapping.of_column(&mapped.column).is_some() {
                return Err(format!("the column {} is given twice", mapped.column));
            }
            mapping.0.push(mapped);
        }
        Ok(mapping)
    }
}

fn mapped(part: &str) -> Result<Mapped, String> {
    let Some((name, column)) = part.split_once('=') else {
        return Err(format!("\"{part}\" has no =; write it {EXAMPLE}"));
    };
    let (written, column) = (name.trim(), column.trim());
    if column.is_empty() {
        return Err(format!(
            "no column is named after {written}=; write it {EXAMPLE}"
        ));
    }
    let Some(mut name) = ColumnName::recognise(written) else {
        return Err(format!(
            "\"{written}\" is not what a column can hold: that is q1_deg, q2_deg, q3_deg, x_mm, y_mm, z_mm, \
             height_mm, plane, distance_mm, point, to_q1_deg, to_q2_deg, to_q3_deg, of a linear drive s1_mm, \
             s2_mm, s3_mm, to_s1_mm, to_s2_mm, to_s3_mm, or the same in _rad, _cm, _m, _um or _in"
        ));
    };
    let own = Unit::at_end_of(column, name.quantity);
    if let (Some(stated), Some(own)) = (name.unit, own)
        && stated != own
    {
        return Err(format!(
            "{part}: the column's name ends with another unit than {written}; give the column's own unit, \
             {}={column}",
            name.quantity.column(own)
        ));
    }
    name.unit = name.unit.or(own);
    Ok(Mapped {
        column: column.to_owned(),
        name,
    })
}

#[cfg(test)]
mod tests {
    use super::{ColumnMapping, ColumnName, Quantity, Unit};

    #[test]
    fn a_mapping_takes_the_unit_from_either_name() {
        let mapping: ColumnMapping = "q1_rad=A1, q2 = Axis 2 [deg],q3=A3,x=X_in,plane=where"
            .parse()
            .unwrap_or_default();
        let expected = [
            ("A1", Quantity::Joint1, Some(Unit::Radian)),
            ("Axis 2 [deg]", Quantity::Joint2, Some(Unit::Degree)),
            ("A3", Quantity::Joint3, None),
            ("X_in", Quantity::X, Some(Unit::Inch)),
            ("where", Quantity::Plane, Some(Unit::Name)),
        ];
        assert_eq!(mapping.all().len(), expected.len());
        for (column, quantity, unit) in expected {
            let name = ColumnName { quantity, unit };
            assert_eq!(mapping.of_column(column), Some(name), "{column}");
        }
        assert_eq!(mapping.of_column("a1"), None);
    }

    #[test]
    fn a_mapping_that_is_ambiguous_is_refused() {
        for (written, cause) in [
            ("", "no ="),
            ("A1", "no ="),
            ("q1_deg=", "no column"),
            ("A1=q1_deg", "not what a column can hold"),
            ("q1_deg=A1,q1_rad=A2", "two columns"),
            ("q1_deg=A1,q2_deg=A1", "given twice"),
            ("x_mm=X [m]", "another unit"),
        ] {
            let refused = written.parse::<ColumnMapping>().err().unwrap_or_default();
            assert!(refused.contains(cause), "{written}: {refused}");
        }
    }
}
