//! How uncertain the platform's position is where the parameters are: J C Jᵀ, anywhere.

use crate::files::robot_file::RobotFile;
use delta_cal::kinematics::JointLimits;
use delta_cal::{Robot, Sample};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Parts of the joints' range, of the grid that the workspace is judged over.
const PARTS: u32 = 8;
/// Horizontal slices of a map.
const SLICES: u32 = 3;
/// Cells of a slice, along its longer side.
const CELLS: u32 = 40;

/// A robot and the covariance of its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionUncertainty<'a> {
    /// The robot.
    pub robot: &'a Robot<f64>,
    /// Of all 24 parameters, arm by arm: mm, radians and their products.
    pub covariance: &'a SMatrix<f64, 24, 24>,
}

impl PositionUncertainty<'_> {
    /// Covariance of the position, mm², at a pose (`x`, `q`) of the robot: J C Jᵀ with J = ∂X/∂P
    /// (3.18). `None` at a singular pose.
    pub fn covariance(&self, x: &Vector3<f64>, q: &[f64; 3]) -> Option<Matrix3<f64>> {
        let blocks = self.robot.platform_jacobian(x, q).ok()?.by_parameters;
        let mut jacobian = SMatrix::<f64, 3, 24>::zeros();
        for (arm, block) in blocks.iter().enumerate() {
            jacobian.fixed_columns_mut::<8>(8 * arm).copy_from(block);
        }
        Some(jacobian * self.covariance * jacobian.transpose())
    }

    /// σ of the position, mm: √tr(J C Jᵀ), the rms length of its error.
    pub fn sigma(&self, x: &Vector3<f64>, q: &[f64; 3]) -> Option<f64> {
        let variance = self.covariance(x, q)?.trace();
        (variance >= 0.0).then(|| variance.sqrt())
    }

    /// Over many poses at once; poses where it is not known are left out.
    pub fn over<'p>(
        &self,
        poses: impl IntoIterator<Item = &'p Sample<f64>>,
    ) -> Option<PositionSigma> {
        let (mut squares, mut count) = (0.0, 0_u32);
        let mut worst: Option<(f64, Vector3<f64>)> = None;
        for pose in poses {
            let Some(sigma) = self.sigma(&pose.position, &pose.joints) else {
                continue;
            };
            squares += sigma * sigma;
            count += 1;
            if worst.is_none_or(|(largest, _)| sigma > largest) {
                worst = Some((sigma, pose.position));
            }
        }
        worst.map(|(max, max_at)| PositionSigma {
            rms: (squares / f64::from(count)).sqrt(),
            max,
            max_at,
            poses: count,
        })
    }
}

impl PositionUncertainty<'_> {
    /// Over the workspace: the rms inside, the largest also at the joints' limits.
    pub fn over_workspace(&self, poses: &WorkspacePoses) -> Option<PositionSigma> {
        let inside = self.over(&poses.inside)?;
        Some(match self.over(&poses.outermost) {
            Some(outermost) if outermost.max > inside.max => PositionSigma {
                max: outermost.max,
                max_at: outermost.max_at,
                ..inside
            },
            _ => inside,
        })
    }
}

/// σ of the position over many poses, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionSigma {
    /// √ of the mean square.
    pub rms: f64,
    /// The largest.
    pub max: f64,
    /// Where that is.
    pub max_at: Vector3<f64>,
    /// How many poses.
    pub poses: u32,
}

/// Joint angles in the middle of `parts` equal parts of the joints' range, in all combinations.
pub(crate) fn joint_grid(
    limits: &JointLimits<f64>,
    parts: u32,
) -> impl Iterator<Item = [f64; 3]> + '_ {
    let angle = move |part: u32| limits.at((f64::from(part) + 0.5) / f64::from(parts));
    (0..parts.pow(3)).map(move |cell| {
        [
            angle(cell / parts / parts),
            angle(cell / parts % parts),
            angle(cell % parts),
        ]
    })
}

/// Poses all over the workspace, clear of singularities.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspacePoses {
    /// Joint angles in the middle of eight equal parts of the joints' range.
    pub inside: Vec<Sample<f64>>,
    /// Joint angles at the ends of these parts, of which the outermost are the limits.
    pub outermost: Vec<Sample<f64>>,
}

impl WorkspacePoses {
    /// Of the robot of a file.
    pub fn of(file: &RobotFile) -> Self {
        let reach = file.reach();
        let pose = |joints: [f64; 3]| {
            let position = reach.clear_position(&file.robot, &joints).ok()?;
            Some(Sample { joints, position })
        };
        let ends = PARTS + 1;
        let end = |part: u32| file.limits.at(f64::from(part) / f64::from(PARTS));
        Self {
            inside: joint_grid(&file.limits, PARTS).filter_map(pose).collect(),
            outermost: (0..ends.pow(3))
                .map(|node| [node / ends / ends, node / ends % ends, node % ends].map(end))
                .filter_map(pose)
                .collect(),
        }
    }

    fn all(&self) -> impl Iterator<Item = &Sample<f64>> {
        self.inside.iter().chain(&self.outermost)
    }
}

/// A plane through the workspace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Plane {
    /// Of this z, mm.
    Horizontal(f64),
    /// y = 0.
    Vertical,
}

/// σ of the position in a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Slice {
    /// Which plane.
    pub plane: Plane,
    /// Width and height of a cell, mm.
    pub step: f64,
    /// Middles of the cells that the robot reaches clear of singularities, and σ there, mm.
    pub cells: Vec<(Vector3<f64>, f64)>,
}

impl Slice {
    /// √ of the mean of σ², and the largest σ.
    pub fn rms_and_max(&self) -> Option<(f64, f64)> {
        let squares: f64 = self.cells.iter().map(|(_, sigma)| sigma * sigma).sum();
        let max = self
            .cells
            .iter()
            .map(|(_, sigma)| *sigma)
            .fold(0.0, f64::max);
        #[allow(clippy::cast_precision_loss)] // a few thousand
        let count = self.cells.len() as f64;
        (!self.cells.is_empty()).then(|| ((squares / count).sqrt(), max))
    }
}

/// σ of the position over the workspace, its worst place, and a map of it.
#[derive(Debug, Clone, PartialEq)]
pub struct UncertaintyMap {
    /// Over [`WorkspacePoses`]; the largest of them and of the slices.
    pub sigma: PositionSigma,
    /// Horizontal slices from below to above, and a vertical one. A slice without a cell is left out.
    pub slices: Vec<Slice>,
}

impl UncertaintyMap {
    /// Of the robot of a file; `covariance` as in [`PositionUncertainty`]. `None` if no pose is clear
    /// of singularities.
    pub fn new(file: &RobotFile, covariance: &SMatrix<f64, 24, 24>) -> Option<Self> {
        let uncertainty = PositionUncertainty {
            robot: &file.robot,
            covariance,
        };
        let poses = WorkspacePoses::of(file);
        let mut sigma = uncertainty.over_workspace(&poses)?;
        let range = |of: fn(&Vector3<f64>) -> f64| {
            let values = poses.all().map(|pose| of(&pose.position));
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            })
        };
        let (x, y, z) = (range(|x| x.x), range(|x| x.y), range(|x| x.z));
        let heights = (1..=SLICES).map(|slice| {
            let part = f64::from(slice) / f64::from(SLICES + 1);
            Plane::Horizontal((z.0 + (z.1 - z.0) * part).round())
        });
        let slices = heights.chain([Plane::Vertical]).map(|plane| {
            let across = if plane == Plane::Vertical { z } else { y };
            let step = (x.1 - x.0).max(across.1 - across.0) / f64::from(CELLS);
            let cells = cells(x, across, step).filter_map(|(u, v)| {
                let position = match plane {
                    Plane::Horizontal(z) => Vector3::new(u, v, z),
                    Plane::Vertical => Vector3::new(u, 0.0, v),
                };
                let reach = file.reach();
                let joints = reach.joints(&file.robot, &position).ok()?;
                reach.clear_position(&file.robot, &joints).ok()?;
                Some((position, uncertainty.sigma(&position, &joints)?))
            });
            Slice {
                plane,
                step,
                cells: cells.collect(),
            }
        });
        let slices: Vec<_> = slices.filter(|slice| !slice.cells.is_empty()).collect();
        for (position, found) in slices.iter().flat_map(|slice| &slice.cells) {
            if *found > sigma.max {
                (sigma.max, sigma.max_at) = (*found, *position);
            }
        }
        Some(Self { sigma, slices })
    }
}

/// Middles of square cells over a rectangle and a little beyond.
fn cells(u: (f64, f64), v: (f64, f64), step: f64) -> impl Iterator<Item = (f64, f64)> {
    let beyond = CELLS / 4;
    let middle = move |(low, high): (f64, f64), cell: u32| {
        let centre = f64::midpoint(low, high);
        centre + step * (f64::from(cell) + 0.5 - f64::from(CELLS / 2 + beyond))
    };
    let count = CELLS + 2 * beyond;
    (0..count * count).map(move |cell| (middle(u, cell % count), middle(v, cell / count)))
}
