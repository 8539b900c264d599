//! The table of faults of a samples file as a whole: what undoes each, and its words.

use crate::accuracy::quantiles::median;
use crate::files::columns::Unit;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Reading, Readings};
use crate::fit::Frame;
use crate::text::list;
use delta_cal::kinematics::JointLimits;
use delta_cal::{Parameter, Robot, Sample};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// No robot has shorter forearms, mm: the file's lengths are then in a larger unit.
const LEAST_FOREARM: f64 = 10.0;

/// A fault of a whole file, or two together, and what undoes it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fault {
    /// From the file's columns to the joint angles.
    joints: Matrix3<f64>,
    /// From the file's positions to those of the robot's frame.
    positions: Matrix3<f64>,
    /// Factors of heights and of distances.
    others: [f64; 2],
    /// Rows by which each position stands below the joints that it belongs to.
    pub(super) rows_below: isize,
    /// Two arms whose upper arms and forearms are exchanged in the robot file.
    arms: Option<[usize; 2]>,
    /// Whether the joint limits have the wrong sign.
    limits: bool,
    /// The frame in which the positions are then.
    pub(super) frame: Frame,
    /// Millimetres per unit of the robot file's lengths, if these are not in millimetres.
    pub(super) unit: f64,
    /// The fault in words.
    pub(super) cause: String,
    /// The remedy.
    pub(super) remedy: String,
}

/// Exchanges of two arms; clockwise numbering first.
const EXCHANGED: [[usize; 3]; 3] = [[0, 2, 1], [1, 0, 2], [2, 1, 0]];
const CYCLIC: [[usize; 3]; 2] = [[1, 2, 0], [2, 0, 1]];
const UNCHANGED: [usize; 3] = [0, 1, 2];
pub(super) const COORDINATES: [&str; 3] = ["x", "y", "z"];

/// Units of length and their millimetres, the likeliest first.
const LENGTHS: [(Unit, &str, f64); 5] = [
    (Unit::Metre, "metres", 1e3),
    (Unit::Millimetre, "millimetres", 1.0),
    (Unit::Inch, "inches", 25.4),
    (Unit::Centimetre, "centimetres", 10.0),
    (Unit::Micrometre, "micrometres", 1e-3),
];

/// All non-empty subsets of the three.
fn subsets() -> impl Iterator<Item = [bool; 3]> {
    (1_usize..8).map(|bits| [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0])
}

/// Multiplies the chosen columns by a factor.
fn scaled(columns: [bool; 3], factor: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&columns.map(|own| if own { factor } else { 1.0 }).into())
}

/// Takes each number from the column in this order, times its sign.
fn reordered(order: [usize; 3], signs: [f64; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| {
        if order[row] == column {
            signs[row]
        } else {
            0.0
        }
    })
}

impl Fault {
    /// No fault.
    pub(super) fn none(frame: Frame) -> Self {
        Self {
            joints: Matrix3::identity(),
            positions: Matrix3::identity(),
            others: [1.0; 2],
            rows_below: 0,
            arms: None,
            limits: false,
            frame,
            unit: 1.0,
            cause: String::new(),
            remedy: String::new(),
        }
    }

    /// Of which only its words are known yet.
    fn of(frame: Frame, [cause, remedy]: [String; 2]) -> Self {
        Self {
            cause,
            remedy,
            ..Self::none(frame)
        }
    }

    /// Signs and units of `other` refer to the file's columns, before these are reordered by this fault.
    pub(super) fn and(&self, other: &Self) -> Self {
        Self {
            joints: self.joints * other.joints,
            positions: self.positions * other.positions,
            others: [0, 1].map(|kind| self.others[kind] * other.others[kind]),
            rows_below: self.rows_below + other.rows_below,
            arms: self.arms.or(other.arms),
            limits: self.limits || other.limits,
            frame: other.frame,
            unit: self.unit * other.unit,
            cause: format!("{} and {}", self.cause, other.cause),
            remedy: format!("{}, and {}", self.remedy, other.remedy),
        }
    }

    /// The samples without the fault.
    pub(super) fn undone(&self, samples: &[Sample<f64>]) -> impl Iterator<Item = Sample<f64>> {
        let from = |rows: isize| {
            let first = usize::try_from(rows).unwrap_or(0);
            samples.get(first..).unwrap_or_default().iter()
        };
        let rows = from(-self.rows_below).zip(from(self.rows_below));
        rows.map(|(joints, position)| Sample {
            joints: (self.joints * Vector3::from(joints.joints)).into(),
            position: self.positions * position.position,
        })
    }

    /// The readings without the fault.
    pub(super) fn undone_in(&self, readings: &Readings) -> Readings {
        let samples: Vec<_> = readings.samples().map(|row| row.value).collect();
        let mut values = self.undone(&samples);
        let mut found = readings.clone();
        if self.rows_below != 0 {
            found.rows.pop();
        }
        for row in &mut found.rows {
            let own = &mut row.value;
            let sample = own.sample().and_then(|_| values.next());
            let [heights, distances] = self.others;
            own.height = own.height.map(|(plane, by)| (plane, heights * by));
            own.distance = own.distance.map(|(from, by)| (from, distances * by));
            own.each_pose(|joints| (self.joints * Vector3::from(joints)).into());
            if let Some(sample) = sample {
                own.joints = sample.joints;
                own.position = sample.position.data.0[0].map(Some);
            }
        }
        found
    }

    /// The robot without the fault: La_x, La_y and Lb (scale and Lb of linear drives) of two arms are exchanged; D, θ
    /// and α belong to the base and stay.
    pub(super) fn robot(&self, robot: &Robot<f64>) -> Option<Robot<f64>> {
        let mut parameters = robot.parameters();
        if let Some(arms) = self.arms {
            let [one, other] = parameters.get_disjoint_mut(arms).ok()?;
            one[5..].swap_with_slice(&mut other[5..]);
        }
        robot.with_parameters(parameters).ok()
    }

    /// The joint limits without the fault.
    pub(super) fn limits(&self, limits: &JointLimits<f64>) -> Option<JointLimits<f64>> {
        if self.limits {
            JointLimits::new(-limits.maximum(), -limits.minimum()).ok()
        } else {
            Some(*limits)
        }
    }
}

/// The files that the words name.
pub(super) struct Files<'a> {
    pub(super) robot: &'a RobotFile,
    pub(super) readings: &'a Readings,
}

impl Files<'_> {
    /// Every fault tested, kind by kind. In the sensor's frame, which is found anyway, rotations are no faults, nor are
    /// cyclic exchanges, which are rotations by a Delta's threefold symmetry; all mirrored axes are equivalent.
    pub(super) fn faults(&self, frame: Frame) -> Vec<Vec<Fault>> {
        let fault = |words| Fault::of(frame, words);
        let mut orders = EXCHANGED.to_vec();
        let mut axes = vec![(UNCHANGED, [1.0, -1.0, 1.0])];
        if frame == Frame::Base {
            orders.extend(CYCLIC);
            axes = every_axes();
        }
        let orders = orders.into_iter().map(|order| Fault {
            joints: reordered(order, [1.0; 3]),
            ..fault(self.order(order, frame))
        });
        let reversed = subsets().map(|columns| Fault {
            joints: scaled(columns, -1.0),
            ..fault(self.reversed(columns))
        });
        let radians = [(true, 180.0 / PI), (false, PI / 180.0)].into_iter();
        let angles = radians.flat_map(|(radians, factor)| {
            subsets().map(move |columns| Fault {
                joints: scaled(columns, factor),
                ..fault(self.angles(columns, radians))
            })
        });
        let axes = axes.into_iter().map(|(order, signs)| Fault {
            positions: reordered(order, signs),
            ..fault(self.axes(order, signs, frame))
        });
        let arms = [[0, 1], [0, 2], [1, 2]].map(|arms| Fault {
            arms: Some(arms),
            ..fault(self.arms(arms))
        });
        let shifted = [(1, "below", "higher"), (-1, "above", "lower")];
        let shifted = shifted.map(|(rows_below, stands, write)| Fault {
            rows_below,
            ..fault([
                format!("each position is one row {stands} its joints"),
                format!(
                    "write each position of {} one row {write}, and delete the incomplete rows",
                    self.readings.name
                ),
            ])
        });
        let limits = Fault {
            limits: true,
            ..fault(self.limits())
        };
        vec![
            orders.collect(),
            reversed.collect(),
            angles.collect(),
            axes.collect(),
            self.lengths(frame),
            arms.to_vec(),
            shifted.to_vec(),
            vec![limits],
        ]
    }

    /// Those that heights and distances show, which say little of the robot's place.
    pub(super) fn of_other_readings(&self) -> impl Iterator<Item = Fault> {
        let inch = LENGTHS[2].2;
        let name = |column| format!("name the column {column}");
        let of_readings = [
            (
                [-1.0, 1.0],
                "heights have the wrong sign",
                "change it".to_owned(),
            ),
            ([inch, 1.0], "heights are in inches", name("height_in")),
            ([1.0, inch], "distances are in inches", name("distance_in")),
        ];
        let of_readings = of_readings.map(|(others, cause, remedy)| Fault {
            others,
            ..Fault::of(Frame::Base, [format!("the {cause}"), remedy])
        });
        let exchanged = EXCHANGED.map(|order| Fault {
            joints: reordered(order, [1.0; 3]),
            ..Fault::of(Frame::Base, self.order(order, Frame::Base))
        });
        let reversed = Fault {
            joints: -Matrix3::identity(),
            ..Fault::of(Frame::Base, self.reversed([true; 3]))
        };
        let of_joints = exchanged.into_iter().chain([reversed]);
        of_readings.into_iter().chain(of_joints)
    }

    /// Heights above planes that the robot file states: without the gauge block that brings each nearest to the robot of the
    /// file, and above a plane at another z. Each with its cause and remedy.
    pub(super) fn of_planes(&self) -> impl Iterator<Item = (Readings, String, String)> {
        let instruments = &self.robot.instruments;
        let (mut on_blocks, mut lifted) = (self.readings.clone(), self.readings.clone());
        let (mut blocks, mut elsewhere) = (Vec::new(), Vec::new());
        for plane in &instruments.planes {
            let mut planes = self.readings.planes.iter();
            let index = planes.position(|own| *own == plane.name);
            let off = |own: &Reading| {
                let (_, height) = own.height.filter(|(plane, _)| Some(*plane) == index)?;
                let target = self.readings.targets.get(own.target);
                let target = target.and_then(|name| instruments.target(name));
                let tip = target.map_or(instruments.target_place(), |own| own.place);
                let point = self.robot.robot.forward(&own.joints).ok()?;
                Some(point.z + tip.z - plane.height - height)
            };
            let rows = self.readings.rows.iter();
            let off: Vec<_> = rows.map(|row| off(&row.value)).collect();
            let Some(by) = median(off.iter().flatten().copied()) else {
                continue;
            };
            let axis = self.robot.convention.axes()[2];
            let [stated, other] = [plane.height, plane.height + by].map(|z| axis * z);
            elsewhere.push(format!(
                "the heights above {} fit z = {other:.0} mm, not {stated:.0} mm",
                plane.name
            ));
            for (row, off) in off.iter().enumerate() {
                let Some(off) = off else { continue };
                let nearest = |a: &&f64, b: &&f64| (off - **a).abs().total_cmp(&(off - **b).abs());
                let block = *plane.blocks.iter().min_by(nearest).unwrap_or(&0.0);
                blocks.push(block);
                for (changed, by) in [(&mut on_blocks, block), (&mut lifted, by)] {
                    let own = &mut changed.rows[row].value;
                    own.height = own.height.map(|(plane, height)| (plane, height + by));
                }
            }
        }
        let missing = (
            on_blocks,
            "the gauge blocks are missing from the heights".to_owned(),
            format!(
                "write block plus reading as height_mm in {}",
                self.readings.name
            ),
        );
        let lifted = (
            lifted,
            list(&elsewhere),
            format!(
                "correct z_mm of the plane, or of [target], in {}",
                self.robot.name
            ),
        );
        // The same block in all rows is another height of the plane.
        let differ = blocks.iter().any(|own| own.total_cmp(&blocks[0]).is_ne());
        let stated = !elsewhere.is_empty();
        let all = [differ.then_some(missing), stated.then_some(lifted)];
        all.into_iter().flatten()
    }

    /// Two faults of different kinds.
    pub(super) fn both(&self, first: &Fault, second: &Fault) -> Fault {
        let both = first.and(second);
        if !(both.limits && both.joints == -Matrix3::identity()) {
            return both;
        }
        let (robot, samples) = (&self.robot.name, &self.readings.name);
        let (other, _) = self.directions();
        Fault {
            cause: format!("all joints count {other}wards in {samples} and in [joints] of {robot}"),
            remedy: format!("state joint_positive = \"{other}\" in [convention] of {robot}"),
            ..both
        }
    }

    /// The positions are in a frame at an unknown place.
    pub(super) fn elsewhere() -> Fault {
        let cause = "the positions are in another frame than the robot's";
        Fault::of(
            Frame::Sensor,
            [cause, "use --frame sensor"].map(str::to_owned),
        )
    }

    /// Joint k's angle is in column `order[k]`, or the arms are in another order.
    fn order(&self, order: [usize; 3], frame: Frame) -> [String; 2] {
        let (robot, samples) = (&self.robot.name, self.joints_file());
        let column = |joint| self.column(joint);
        let clockwise = frame == Frame::Sensor && order == EXCHANGED[0];
        let arms = self.robot.robot.arms();
        let azimuths = arms.each_ref().map(|arm| arm.get(Parameter::Theta));
        let moved: Vec<_> = (0..3).filter(|joint| order[*joint] != *joint).collect();
        let cause = if let [first, second] = moved[..] {
            format!(
                "{}, or arm {} and arm {}, are exchanged{}",
                list(&[column(first), column(second)]),
                first + 1,
                second + 1,
                match (clockwise, (azimuths[1] - azimuths[0]).sin() > 0.0) {
                    (false, _) => "",
                    (true, true) => ", as if the arms were numbered clockwise seen from above",
                    (true, false) =>
                        ", as if the arms were numbered counter-clockwise seen from above",
                }
            )
        } else {
            format!(
                "the joint columns are permuted (joints 1, 2, 3 are in {}), or the frame is rotated by 120° \
                 about z",
                list(&order.map(column))
            )
        };
        if clockwise {
            let [first, second, third] = azimuths.map(|azimuth| {
                let stated = self.robot.convention.angle(azimuth).to_degrees();
                stated.rem_euclid(360.0).round()
            });
            let remedy = format!(
                "state azimuth_deg = [{first}, {third}, {second}] in [nominal] of {robot}, or exchange the names of q2 and q3 in \
                 {samples}"
            );
            return [cause, remedy];
        }
        let mut joints = [0; 3];
        for (joint, column) in order.iter().enumerate() {
            joints[*column] = joint;
        }
        let remedy = format!(
            "change {} in the header of {samples} to {}, or number the arms of {robot} as the columns are",
            UNCHANGED.map(column).join(","),
            joints.map(column).join(",")
        );
        [cause, remedy]
    }

    /// Columns of joint angles with the wrong sign.
    fn reversed(&self, columns: [bool; 3]) -> [String; 2] {
        let joints = self.joints(columns);
        let (other, positive) = self.directions();
        let (cause, or) = if columns == [true; 3] {
            (
                "all joint angles have the wrong sign".to_owned(),
                format!(
                    ", or state [convention] joint_positive = \"{other}\" and the limits in the same sense"
                ),
            )
        } else {
            (
                format!("the sign of the joint angles in {joints} is wrong"),
                String::new(),
            )
        };
        let remedy = format!(
            "change the sign of {joints} in {} (a positive angle swings the arm {positive} the platform){or}",
            self.joints_file()
        );
        [cause, remedy]
    }

    /// The direction in which joints do not count, and where a positive joint angle swings the arm.
    fn directions(&self) -> (&'static str, &'static str) {
        if self.robot.convention.sense() < 0.0 {
            ("down", "away from")
        } else {
            ("up", "towards")
        }
    }

    /// The file that holds the joints.
    fn joints_file(&self) -> &str {
        let joined = self.readings.joined.as_ref();
        joined.map_or(&self.readings.name, |own| &own.joints_file)
    }

    /// Columns of joint angles in radians, or in degrees, and not in the unit of the header.
    fn angles(&self, columns: [bool; 3], radians: bool) -> [String; 2] {
        let samples = self.joints_file();
        let (are, says, named) = if radians {
            ("radians", "degrees", "q1_rad,q2_rad,q3_rad")
        } else {
            ("degrees", "radians", "q1_deg,q2_deg,q3_deg")
        };
        let header = if self.readings.in_degrees == radians {
            format!(", but the header says {says}")
        } else {
            String::new()
        };
        let remedy = if columns == [true; 3] {
            format!("name the columns of {samples} {named}")
        } else {
            format!("correct the unit (_deg or _rad) in the header of {samples}")
        };
        let joints = self.joints(columns);
        [
            format!("the joint angles in {joints} are in {are}{header}"),
            remedy,
        ]
    }

    /// Coordinate k of the robot's frame is `signs[k]` times the file's coordinate `order[k]`.
    fn axes(&self, order: [usize; 3], signs: [f64; 3], frame: Frame) -> [String; 2] {
        let samples = &self.readings.name;
        let stated = self.robot.convention.axes();
        let signs = [0, 1, 2].map(|axis| stated[axis] * signs[axis] * stated[order[axis]]);
        if frame == Frame::Sensor {
            return [
                "the sensor frame is mirrored (left-handed), as if a coordinate had the wrong sign or two were \
                 exchanged, if the arms are numbered counter-clockwise"
                    .to_owned(),
                format!("export {samples} in a right-handed frame"),
            ];
        }
        let mirrored = reordered(order, signs).determinant() < 0.0;
        let hand = if mirrored {
            "the frame is mirrored (left-handed)"
        } else {
            "the frame is rotated"
        };
        let of_sign = |wrong: bool| -> Vec<String> {
            let named = COORDINATES.iter().zip(signs);
            let named = named.filter(|(_, sign)| (*sign < 0.0) == wrong);
            named.map(|(name, _)| (*name).to_owned()).collect()
        };
        let (wrong, right) = (list(&of_sign(true)), of_sign(false));
        let signed = order.iter().zip(signs).map(|(axis, sign)| {
            let minus = if sign < 0.0 { "−" } else { "" };
            format!("{minus}{}", COORDINATES[*axis])
        });
        let signed = signed.collect::<Vec<_>>().join(", ");
        let cause = if order != UNCHANGED {
            format!("the robot's x, y, z are the file's {signed}, so {hand}")
        } else if mirrored {
            let has = if right.len() == 2 { "has" } else { "have" };
            format!("{wrong} {has} the wrong sign, so {hand}")
        } else {
            let about = list(&right);
            let how = if about == "z" { "" } else { ", upside down" };
            format!(
                "{wrong} have the wrong sign, so the frame is rotated by 180° about {about}{how}"
            )
        };
        let remedy = format!(
            "state the positions of {samples} in the robot's frame: x, y, z are its {signed}"
        );
        [cause, remedy]
    }

    /// Positions in another unit than that of their header, or lengths of the robot in another than millimetres; what is
    /// likelier first.
    fn lengths(&self, frame: Frame) -> Vec<Fault> {
        let header = |own: &&(Unit, &str, f64)| Some(own.0) == self.readings.positions_in;
        let Some((unit, says, written)) = LENGTHS.iter().find(header) else {
            return Vec::new();
        };
        let (robot, samples) = (&self.robot.name, &self.readings.name);
        let others = LENGTHS.iter().filter(|own| own.0 != *unit);
        let positions = others.map(|(_, name, read)| Fault {
            positions: Matrix3::from_diagonal_element(read / written),
            cause: format!("the positions are in {name}, but the header says {says}"),
            remedy: match *name {
                "metres" => format!("name the columns of {samples} x_m,y_m,z_m"),
                "millimetres" => format!("name the columns of {samples} x_mm,y_mm,z_mm"),
                _ => format!("convert the positions of {samples} to millimetres"),
            },
            ..Fault::none(frame)
        });
        let [arm, ..] = self.robot.robot.arms();
        let is_small = arm.lb() < LEAST_FOREARM;
        let lengths = [LENGTHS[0], LENGTHS[2]].map(|(_, name, by)| Fault {
            positions: Matrix3::from_diagonal_element(1.0 / by),
            unit: if is_small { by } else { 1.0 },
            cause: format!("the lengths in {robot} are in {name}, not millimetres"),
            remedy: format!("convert the lengths in {robot} to millimetres"),
            ..Fault::none(frame)
        });
        if is_small {
            lengths.into_iter().chain(positions).collect()
        } else {
            positions.chain(lengths).collect()
        }
    }

    fn arms(&self, [first, second]: [usize; 2]) -> [String; 2] {
        let robot = &self.robot.name;
        [
            format!(
                "in {robot} the upper arms and forearms of arm {} and arm {} are exchanged",
                first + 1,
                second + 1
            ),
            format!("exchange la_x_mm, la_y_mm and lb_mm of the two in {robot}"),
        ]
    }

    fn limits(&self) -> [String; 2] {
        let robot = &self.robot.name;
        let (_, positive) = self.directions();
        [
            format!("the limits in [joints] of {robot} have the wrong sign"),
            format!(
                "change the signs of min_deg and max_deg in {robot} (0 is level, a positive angle swings the arm \
                 {positive} the platform)"
            ),
        ]
    }

    /// The column of a joint, counted from 0: "q2_deg".
    fn column(&self, joint: usize) -> String {
        let unit = if self.readings.in_degrees { "_deg" } else { "" };
        format!("q{}{unit}", joint + 1)
    }

    /// Names of the columns: "q2_deg and q3_deg".
    fn joints(&self, columns: [bool; 3]) -> String {
        let named = (0..3).filter(|joint| columns[*joint]);
        list(&named.map(|joint| self.column(joint)).collect::<Vec<_>>())
    }
}

/// Every order and all signs of the axes but the right ones.
fn every_axes() -> Vec<([usize; 3], [f64; 3])> {
    let orders = [UNCHANGED].into_iter().chain(EXCHANGED).chain(CYCLIC);
    let all = orders.flat_map(|order| {
        let signs = [[false; 3]].into_iter().chain(subsets());
        let signs = signs.map(|reversed| reversed.map(|own| if own { -1.0 } else { 1.0 }));
        signs.map(move |signs| (order, signs))
    });
    all.skip(1).collect()
}
