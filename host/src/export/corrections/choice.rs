//! The spacing of the nodes: stated, or the widest of some with which the error of interpolation stays within a limit.

use super::between::{Between, Region};
use super::grid::Grid;
use super::kind::{Kind, Pair};
use super::table::Table;
use crate::export::error::ExportError;

/// How far the nodes are from each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Nodes {
    /// This distance, mm.
    Spacing(f64),
    /// As far as this limit of the error of interpolation allows, mm.
    Limit(f64),
}

/// What is tried for a limit, mm.
const SPACINGS: [f64; 22] = [
    200.0, 150.0, 100.0, 80.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 15.0, 12.0, 10.0, 8.0, 6.0, 5.0,
    4.0, 3.0, 2.5, 2.0, 1.5, 1.0,
];

/// A table and what interpolation leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Finished {
    /// The table.
    pub table: Table,
    /// What interpolation leaves.
    pub between: Between,
    /// The unit of the corrections.
    pub unit: &'static str,
    /// The limit that the spacing was chosen for, mm.
    pub limit: Option<f64>,
}

impl Finished {
    /// # Errors
    /// Too many nodes, for this spacing or for every spacing that keeps to the limit.
    pub(crate) fn of(
        pair: &Pair<'_>,
        kind: Kind,
        nodes: Nodes,
        region: &Region<'_>,
    ) -> Result<Self, ExportError> {
        let with = |spacing: f64, limit: Option<f64>| -> Result<Self, ExportError> {
            let table = Table::of(pair, kind, Grid::over(region.bounds(), spacing)?);
            let between = Between::of(&table, pair, region);
            Ok(Self {
                table,
                between,
                unit: kind.unit(pair.calibrated.drive()),
                limit,
            })
        };
        let limit = match nodes {
            Nodes::Spacing(spacing) => return with(spacing, None),
            Nodes::Limit(limit) => limit,
        };
        let mut nearest = None;
        for spacing in SPACINGS {
            let Ok(found) = with(spacing, Some(limit)) else {
                break;
            };
            let whole = found.between.wanted.unreached == 0;
            if whole && found.between.worst().worst <= limit {
                return Ok(found);
            }
            nearest = Some(found);
        }
        Err(nearest.map_or(ExportError::TooManyNodes, |found| {
            let worst = found.between.worst();
            ExportError::LimitNotMet {
                limit,
                spacing: found.table.grid.spacing,
                worst: worst.worst,
                at: worst.at,
                left_out: found.between.wanted.unreached,
            }
        }))
    }
}
