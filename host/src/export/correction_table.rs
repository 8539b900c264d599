//! A grid of position corrections for a controller whose kinematics is the nominal robot's.

use super::error::ExportError;
use super::exported::{Content, Export};
use super::loss::{Loss, reached};
use super::target::Written;
use super::wanted::Wanted;
use crate::geometry::range::range;
use delta_cal::Robot;
use nalgebra::Vector3;
use std::fmt::Write;

/// More nodes than this are refused.
const MOST_NODES: usize = 2_000_000;

/// To be at x the controller is told to go to x + correction.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionTable {
    origin: Vector3<f64>,
    spacing: f64,
    counts: [usize; 3],
    /// z runs fastest, then y. `None` where a robot has no pose.
    corrections: Vec<Option<Vector3<f64>>>,
    /// With corrections interpolated between the nodes.
    loss: Loss,
}

impl CorrectionTable {
    /// Over the box around wanted positions.
    ///
    /// # Errors
    /// So narrow a spacing that the table would be too large, or no position in a cell of it.
    pub fn of(
        calibrated: &Robot<f64>,
        nominal: &Robot<f64>,
        wanted: &Wanted,
        spacing: f64,
    ) -> Result<Self, ExportError> {
        let mut origin = Vector3::zeros();
        let mut counts = [0; 3];
        for axis in 0..3 {
            let (low, high) = range(wanted.evaluated.iter().map(|at| at[axis]));
            origin[axis] = (low / spacing).floor() * spacing;
            let cells = ((high - origin[axis]) / spacing).floor() + 1.0;
            if !(cells < 1e4) {
                return Err(ExportError::TooManyNodes);
            }
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 1 to 10,000
            let cells = cells as usize;
            counts[axis] = cells + 1;
        }
        let nodes: usize = counts.iter().product();
        if nodes > MOST_NODES {
            return Err(ExportError::TooManyNodes);
        }
        let mut table = Self {
            origin,
            spacing,
            counts,
            corrections: Vec::with_capacity(nodes),
            loss: Loss::of(std::iter::empty()),
        };
        for node in 0..nodes {
            let at = table.node(node);
            table
                .corrections
                .push(reached(nominal, calibrated, &at).map(|command| command - at));
        }
        table.loss = Loss::of(wanted.evaluated.iter().map(|at| {
            let is = table
                .interpolated(at)
                .and_then(|correction| reached(calibrated, nominal, &(at + correction)));
            (*at, is.map(|is| (is - at).norm()))
        }));
        if table.loss.positions == 0 {
            return Err(ExportError::Unreached);
        }
        Ok(table)
    }

    #[allow(clippy::cast_precision_loss)] // up to 10,000
    fn node(&self, node: usize) -> Vector3<f64> {
        let [_, y, z] = self.counts;
        let at = [node / z / y, node / z % y, node % z];
        self.origin + Vector3::from(at.map(|index| index as f64)) * self.spacing
    }

    /// The correction at a position, linear between the eight nodes around it, mm; `None` outside the cells that
    /// have all eight.
    pub fn interpolated(&self, at: &Vector3<f64>) -> Option<Vector3<f64>> {
        let place = (at - self.origin) / self.spacing;
        let cell = place.map(f64::floor);
        let part = place - cell;
        let [_, y, z] = self.counts;
        let mut base = 0;
        for (axis, stride) in [y * z, z, 1].into_iter().enumerate() {
            if !(cell[axis] >= 0.0) {
                return None;
            }
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // not negative
            let index = cell[axis] as usize;
            if index + 1 >= self.counts[axis] {
                return None;
            }
            base += index * stride;
        }
        let mut sum = Vector3::zeros();
        for corner in 0..8 {
            let bits = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let node = base + bits[0] * y * z + bits[1] * z + bits[2];
            let weight = (0..3).fold(1.0, |weight, axis| {
                weight
                    * if bits[axis] == 1 {
                        part[axis]
                    } else {
                        1.0 - part[axis]
                    }
            });
            sum += weight * self.corrections.get(node).copied().flatten()?;
        }
        Some(sum)
    }

    pub(super) fn export(self) -> Export {
        let mut lines = String::from("x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n");
        for (node, correction) in self.corrections.iter().enumerate() {
            if let Some(by) = correction {
                let at = self.node(node);
                let [dx, dy, dz] =
                    [by.x, by.y, by.z].map(|value| (value * 1e5).round() / 1e5 + 0.0);
                let _ = writeln!(lines, "{},{},{},{dx:.5},{dy:.5},{dz:.5}", at.x, at.y, at.z);
            }
        }
        Export {
            name: "correction-table",
            title: "correction table",
            comment: "#",
            content: Content::Corrections,
            written: Written {
                entries: Vec::new(),
                lines,
                warnings: Vec::new(),
            },
            frame: None,
            loss: self.loss,
            uncalibrated: self.loss,
            uncalibrated_moved: self.loss,
            within: None,
            controller: None,
            conventions: vec![
                "positions in the robot's frame, mm; nodes that the robot cannot reach are left out",
                "to be at (x, y, z), command (x + dx, y + dy, z + dz) to a controller whose kinematics is that of the \
                 robot before calibration; between nodes interpolate linearly along x, y and z",
            ],
            source: "computed",
            alternative: "a smaller --spacing",
        }
    }
}
