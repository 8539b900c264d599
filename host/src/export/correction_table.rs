//! Corrections of the commanded position at the nodes of a grid, for any controller.

use super::error::ExportError;
use super::geometry::coordinates;
use super::positions::{Loss, Place, Wanted, controller_reaches, reached};
use crate::files::{RobotFile, Tool, Tooled};
use crate::geometry::hangs_below;
use crate::halt;
use delta_cal::Robot;
use delta_cal::kinematics::SingularityDistance;
use nalgebra::{Matrix4, RowVector3, SMatrix, Vector3, Vector4};
use serde::Serialize;
use std::fmt::Write;

/// Distance of the nodes, mm, if no limit is stated.
const SPACING: f64 = 25.0;
/// Distances that are tried for a limit, mm.
const SPACINGS: [f64; 22] = [
    200.0, 150.0, 100.0, 80.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 15.0, 12.0, 10.0, 8.0, 6.0, 5.0,
    4.0, 3.0, 2.5, 2.0, 1.5, 1.0,
];
/// The largest number of nodes.
const MOST_NODES: f64 = 2e5;
/// The number of nodes along each axis that are used to extrapolate.
const AROUND: usize = 2;

/// Corrections on a grid of cubes. To reach x, the controller adds the interpolated correction at x.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// Of all lengths.
    pub unit: &'static str,
    /// The node with the smallest coordinates, mm. All coordinates are multiples of the spacing.
    #[serde(rename = "origin_mm", serialize_with = "coordinates")]
    pub origin: Vector3<f64>,
    /// The distance of the nodes, mm.
    #[serde(rename = "spacing_mm")]
    pub spacing: f64,
    /// The number of nodes along x, y and z, at least two.
    #[serde(rename = "nodes_along_xyz")]
    pub counts: [usize; 3],
    /// The axis along which nodes follow each other; then come y and x.
    pub fastest: &'static str,
    /// The correction at each node, mm. `None` if the robot reaches neither the node nor a neighbour.
    pub corrections: Vec<Option<[f64; 3]>>,
    /// The nodes, in order, whose corrections are extrapolated from the nodes around them: the robot does not reach them, or
    /// only near a parallel singularity. A position near the edge thus has all eight nodes of its cell.
    pub extrapolated: Vec<usize>,
    /// Errors of the interpolation at the cells' centres, farthest from the nodes.
    #[serde(rename = "at_cell_centres")]
    pub centres: Loss,
}

impl Table {
    /// The table of a calibrated robot for a controller that uses the nominal one, and the loss at the wanted positions.
    /// The nodes are as far apart as the limit allows.
    pub(super) fn of(
        robot: &RobotFile,
        nominal: &Robot<f64>,
        wanted: &Wanted,
        limit: Option<f64>,
    ) -> Result<(Self, Loss), ExportError> {
        let Some(limit) = limit else {
            return Self::spaced(robot, nominal, wanted, SPACING).ok_or(ExportError::Unreached);
        };
        let mut worst = f64::INFINITY;
        for spacing in SPACINGS {
            halt::check();
            let Some((table, loss)) = Self::spaced(robot, nominal, wanted, spacing) else {
                break;
            };
            if loss.unreached == 0 {
                worst = f64::max(loss.worst, table.centres.worst);
                if worst <= limit {
                    return Ok((table, loss));
                }
            }
        }
        Err(ExportError::LimitNotMet { limit, worst })
    }

    /// The table with this spacing; `None` if it has too many nodes.
    fn spaced(
        robot: &RobotFile,
        nominal: &Robot<f64>,
        wanted: &Wanted,
        spacing: f64,
    ) -> Option<(Self, Loss)> {
        let infinite = Vector3::repeat(f64::INFINITY);
        // The grid is in the axes of the robot file.
        let turned = |at: &Vector3<f64>| robot.convention.vector(at);
        let each = wanted.evaluated.iter().map(turned);
        let (low, high) = each.fold((infinite, -infinite), |(low, high), at| {
            (low.inf(&at), high.sup(&at))
        });
        let origin = low.map(|value| (value / spacing).floor() * spacing);
        let counts = (high - origin).map(|size| (size / spacing).floor() + 2.0);
        if !(counts.product() <= MOST_NODES) {
            return None;
        }
        let mut table = Self {
            unit: "mm",
            origin,
            spacing,
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 2 to 2e5
            counts: counts.map(|count| count as usize).into(),
            fastest: "z",
            corrections: Vec::new(),
            extrapolated: Vec::new(),
            centres: Loss::default(),
        };
        let tool = robot.tool();
        let calibrated = (&robot.robot, &tool);
        let count = table.counts.iter().product();
        let computed: Vec<_> = (0..count)
            .map(|node| {
                let at = turned(&table.position(node));
                correction(calibrated, nominal, &at).map(|by| turned(&by))
            })
            .collect();
        for (node, own) in computed.iter().enumerate() {
            let extrapolated = own.is_none().then(|| table.extrapolate(&computed, node));
            let extrapolated = extrapolated.flatten();
            if extrapolated.is_some() {
                table.extrapolated.push(node);
            }
            table.corrections.push(own.or(extrapolated).map(Into::into));
        }
        let is = |at: &Vector3<f64>| table.reached((robot, &tool), nominal, at);
        let inside = |at: &Vector3<f64>| {
            let in_box = (0..3).all(|axis| (low[axis]..=high[axis]).contains(&at[axis]));
            let out = matches!(wanted.place, Place::Within(within) if at.xy().norm() > within);
            in_box && !out && controller_reaches(robot, &turned(at))
        };
        let half = Vector3::repeat(spacing / 2.0);
        let centres: Vec<_> = (0..count)
            .map(|node| table.position(node) + half)
            .filter(inside)
            .collect();
        let loss = Loss::of(wanted.evaluated.iter().map(|at| (at, is(at))));
        let at_centres = centres
            .iter()
            .map(|at| (at, is(&turned(at)).map(|own| turned(&own))));
        table.centres = Loss::of(at_centres);
        Some((table, loss))
    }

    /// The position, less the tool, that the tool reaches with the corrections where a position is wanted.
    pub(super) fn reached(
        &self,
        (robot, tool): (&RobotFile, &Tool),
        nominal: &Robot<f64>,
        at: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let turned = |at: &Vector3<f64>| robot.convention.vector(at);
        let commanded = at + turned(&self.interpolated(&turned(at))?);
        reached((&robot.robot, tool), nominal, &commanded)
    }

    const fn indices(&self, node: usize) -> [usize; 3] {
        let [_, y, z] = self.counts;
        [node / z / y, node / z % y, node % z]
    }

    const fn node(&self, [x, y, z]: [usize; 3]) -> usize {
        let [_, along_y, along_z] = self.counts;
        (x * along_y + y) * along_z + z
    }

    /// The position of a node, mm.
    fn position(&self, node: usize) -> Vector3<f64> {
        self.origin + Vector3::from(self.indices(node).map(|index| index as f64)) * self.spacing
    }

    /// The correction at a position; `None` outside the grid, or if a node of the cell has none.
    fn interpolated(&self, at: &Vector3<f64>) -> Option<Vector3<f64>> {
        let place = (at - self.origin) / self.spacing;
        if !(place.min() >= 0.0) {
            return None;
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // not negative
        let low = <[f64; 3]>::from(place).map(|own| own as usize);
        if low
            .iter()
            .zip(self.counts)
            .any(|(low, count)| low + 1 >= count)
        {
            return None;
        }
        let part = place.map(f64::fract);
        let mut sum = Vector3::zeros();
        for corner in 0..8_usize {
            let up = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let weights = [0, 1, 2].map(|axis| match up[axis] {
                1 => part[axis],
                _ => 1.0 - part[axis],
            });
            let node = self.node([0, 1, 2].map(|axis| low[axis] + up[axis]));
            sum += weights.iter().product::<f64>() * Vector3::from((*self.corrections.get(node)?)?);
        }
        Some(sum)
    }

    /// The correction at a node, extrapolated from the nodes around it by a least-squares plane with weights of the inverse
    /// squared distance. `None` if no direct neighbour has a correction.
    fn extrapolate(&self, computed: &[Option<Vector3<f64>>], node: usize) -> Option<Vector3<f64>> {
        let at = self.indices(node);
        let mut normal = Matrix4::zeros();
        let mut right = SMatrix::<f64, 4, 3>::zeros();
        let (mut beside, mut weights) = (false, 0.0);
        let range = |axis: usize| {
            at[axis].saturating_sub(AROUND)..=(at[axis] + AROUND).min(self.counts[axis] - 1)
        };
        let columns = range(0).flat_map(|x| range(1).map(move |y| (x, y)));
        for (x, y) in columns {
            for z in range(2) {
                let other = self.node([x, y, z]);
                let Some(correction) = computed.get(other).copied().flatten() else {
                    continue;
                };
                let off = (self.position(other) - self.position(node)) / self.spacing;
                beside |= off.amax() < 1.5;
                let weight = 1.0 / off.norm_squared();
                let row = Vector4::new(1.0, off.x, off.y, off.z);
                normal += weight * row * row.transpose();
                right += weight * row * RowVector3::from(correction.transpose());
                weights += weight;
            }
        }
        if !beside {
            return None;
        }
        // Slopes that the nodes do not determine become 0.
        for axis in 1..4 {
            normal[(axis, axis)] += 1e-6 * weights;
        }
        let solution = normal.cholesky()?.solve(&right);
        Some(solution.row(0).transpose())
    }

    /// The table as CSV, a row for each node.
    pub(super) fn lines(&self) -> String {
        let mut lines = String::from("x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm,node\n");
        for (index, by) in self.corrections.iter().enumerate() {
            let at = self.position(index).map(|value| value + 0.0);
            let _ = write!(lines, "{},{},{},", at.x, at.y, at.z);
            let _ = match by {
                None => writeln!(lines, ",,,empty"),
                Some(by) => {
                    // Avoids −0.
                    let [x, y, z] = by.map(|own| (own * 1e5).round() / 1e5 + 0.0);
                    let extrapolated = self.extrapolated.binary_search(&index).is_ok();
                    let kind = if extrapolated {
                        "extrapolated"
                    } else {
                        "computed"
                    };
                    writeln!(lines, "{x:.5},{y:.5},{z:.5},{kind}")
                }
            };
        }
        lines
    }
}

/// The correction at a position; `None` where there is no such pose, or so close to a parallel singularity that the
/// correction is not representative of its neighbourhood.
fn correction(
    (calibrated, tool): Tooled<'_>,
    nominal: &Robot<f64>,
    at: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let (joints, platform) = tool.joints(calibrated, &(at + tool.place)).ok()?;
    let distance = calibrated.singularity_distance(&platform, &joints);
    if !hangs_below(calibrated, &platform, &joints)
        || distance.parallel < SingularityDistance::<f64>::LEAST_PARALLEL
    {
        return None;
    }
    Some(nominal.forward(&joints).ok()? - at)
}
