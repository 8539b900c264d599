//! The result of an import.

use super::probe::Probe;
use super::settings::Settings;
use super::{Firmware, Length, Stated};
use crate::files::{
    InputError, Kind, KnownPlane, Quantity, Reading, ReadingFrom, Readings, RobotFile, Row, Target,
};
use crate::geometry::{Parallelograms, Region, Shape, range, reaches_anywhere};
use crate::text::rounded;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Arm, Drive};
use delta_cal::{Parameter, Real, Robot, Tolerance};
use nalgebra::{Rotation3, Vector3};

/// Where the towers of a printer usually stand, degrees.
pub(crate) const USUAL_TOWERS: [f64; 3] = [210.0, 330.0, 90.0];
/// The assumed upper joint limit of rotary arms, degrees: Klipper states none.
const LOWEST_ARM: f64 = 90.0;
/// What beds are uneven by beyond what a printer's parameters make of it, mm rms. Four maps of real beds have 0.02 to
/// 0.03 mm in all, and many touches find more where there is more.
const UNEVEN: f64 = 0.015;
/// So many touches tell the shape of a bed from the printer's. Of fewer, the shape is noise: with the seven of simulated
/// printers as many beds are as flat, but R1 of the campaign has 8 of 20 that are worse by 5 %, not 4.
const TELLING: usize = 12;
/// σ of the bed, which is level at z = 0: mm and degrees.
const BED: f64 = 0.001;
/// σ of an uncalibrated printer: tower position and rod in mm, lean in degrees, end stop in mm, scale.
const TOWERS: (f64, f64, f64, f64) = (0.4, 0.1, 5.0, 0.0003);
/// σ of the radius and of the rod length common to all towers, mm: owners seldom measure them.
const COMMON_RADIUS: f64 = 0.6;
const COMMON_ROD: f64 = 0.8;
/// σ of the shrinkage of prints, a fraction of the length: PLA shrinks by 0.2 to 0.3 %, ABS by more.
pub(crate) const SHRINKAGE: f64 = 0.0025;
/// σ of rotary arms, mm and degrees.
const ARMS: (f64, f64) = (0.5, 0.2);
/// σ of the joint zeros of rotary arms, degrees, and of the shoulders' height above the bed, mm: as measured by tape.
const ARM_ZERO: f64 = 6.0;
const SHOULDERS: f64 = 20.0;
/// The plane of the probe's heights if others were measured by hand, and σ of the height at which the probe triggers, mm.
pub(super) const PROBE: &str = "probe";
const TRIGGER: f64 = 0.3;
const NOZZLE: &str = "nozzle";
/// The nozzle and the probe as targets: by index, and σ of the place of the probe, mm.
pub(crate) const OF_PROBE: usize = 1;
const PROBE_PLACE: [f64; 3] = [0.5, 0.5, BED];
/// Radius of an effector as a part of the rods' length.
const EFFECTOR: f64 = 0.1;
/// σ of the oversize of prints, mm: outer lengths grow with the extruded width.
const OVERSIZE: f64 = 0.15;
/// σ of a calliper on a printed part, mm, and the directions in which the part is taken to lie, degrees.
const CALLIPER: f64 = 0.1;
const DIRECTIONS: [f64; 3] = [0.0, 60.0, 120.0];
/// The bed radius as a fraction of the delta radius, if it is not stated.
const USUAL_BED: f64 = 0.6;
/// Shorter rods or forearms are in inches, mm.
const SHORTEST: f64 = 40.0;
/// As-made rods have lengths that are multiples of this, mm.
const ROUND: f64 = 0.1;

/// How a comment begins that states how far apart the two rods of a tower are.
const APART: &str = "delta-cal: rods";
/// How a comment of pasted lines begins that says what was configured before.
const KEPT: &str = "delta-cal keeps:";
/// Pasted lengths are the same as those that a comment states within this, mm: Marlin answers L and A with two decimals.
const PASTED: f64 = 0.011;

/// How far apart the two rods of a tower are, as a comment states it, mm.
pub(super) fn apart(text: &str) -> Option<f64> {
    let own = text.lines().find_map(|own| own.split_once(APART))?.1;
    let number = own.split_whitespace().next()?.trim_end_matches("mm");
    number.parse().ok().filter(|own: &f64| *own > 0.0)
}

/// The radius and the rods' lengths as first configured, and those that were pasted in their place.
pub(crate) fn kept(text: &str) -> Option<[[f64; 4]; 2]> {
    let line = text.lines().rev().find_map(|own| own.split_once(KEPT))?.1;
    let numbers = line.split(|own: char| !(own.is_ascii_digit() || own == '.'));
    let numbers: Vec<f64> = numbers.filter_map(|own| own.parse().ok()).collect();
    let [first, pasted] = [0, 4].map(|from| numbers.get(from..from + 4)?.try_into().ok());
    Some([first?, pasted?])
}

/// The geometry of a controller with towers: lengths in mm, azimuths in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Towers {
    pub(super) radius: f64,
    /// How much further out than that each tower is.
    pub(super) offsets: [f64; 3],
    pub(super) azimuths: [f64; 3],
    pub(super) rods: [f64; 3],
    /// The height of the nozzle at x = y = 0 with each carriage at its end stop.
    pub(super) endstops: [f64; 3],
}

impl Towers {
    /// With the owner's values in place of the configuration's, or with those that were first configured if the present
    /// ones were pasted.
    pub(super) fn as_stated(self, stated: &Stated) -> Self {
        let [radius, rods @ ..] = self.first(stated);
        Self {
            radius: stated.radius.unwrap_or(radius),
            rods: stated.rods.unwrap_or(rods),
            ..self
        }
    }

    /// The radius and the rods as first configured: no reading of the bed determines them, so that a calibration from each
    /// paste would let them drift. A firmware's own calibration between two pastes moves the radius, but not the rods.
    fn first(&self, stated: &Stated) -> [f64; 4] {
        let [a, b, c] = self.rods;
        let own = [self.radius, a, b, c];
        let kept = stated.kept.filter(|[_, pasted]| {
            let mut pairs = pasted.iter().zip(&own).skip(1);
            pairs.all(|(pasted, own)| (pasted - own).abs() < PASTED)
        });
        kept.map_or(own, |[first, _]| first)
    }

    /// Upright towers with these carriage heights at a travel of 0.
    fn robot(&self, name: &str, zeros: [f64; 3]) -> Result<Robot<f64>, InputError> {
        let mut towers = Shape::three(self.azimuths, self.radius, [zeros, [0.0; 3], self.rods]);
        for (tower, by) in towers.iter_mut().zip(self.offsets) {
            tower.radius += by;
        }
        let robot = Shape::robot(&towers, Drive::Linear);
        robot.map_err(|error| impossible(name, error))
    }

    /// The travel of each carriage at its end stop.
    fn home(&self) -> [f64; 3] {
        [0, 1, 2].map(|tower| {
            let (rod, out) = (self.rods[tower], self.radius + self.offsets[tower]);
            self.endstops[tower] + (rod * rod - out * out).sqrt()
        })
    }
}

/// A robot with the geometry that its controller uses, and the readings in the configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The firmware.
    pub firmware: Firmware,
    /// The robot, with the owner's values, under the configuration's name.
    pub robot: RobotFile,
    /// The controller's robot as configured, with the same joints.
    pub configured: Robot<f64>,
    /// The same without the tilt of the bed that the controller adds.
    pub towers: Robot<f64>,
    /// The readings; the line of each is that of the configuration.
    pub readings: Readings,
    /// The name of each reading in the configuration.
    pub names: Vec<String>,
    /// The number of readings at their end that hold the bed as configured, because none measures it.
    pub(crate) held: usize,
    /// The joints at their end stops: radians, or mm of travel.
    pub home: [f64; 3],
    /// The radius of the printable area, mm.
    pub bed_radius: Option<f64>,
    /// The radius of the circle that Marlin's `G33` probes, mm.
    pub(super) probed_radius: Option<f64>,
    /// Whether the firmware is Marlin 1.1, which holds one length for all rods.
    pub(super) one_rod: bool,
    /// The steps of a mm, if its end stops are in steps.
    pub(crate) steps: Option<f64>,
    /// The probe.
    pub probe: Probe,
    /// The radius and the rods of towers as first configured or stated, mm.
    first: [f64; 4],
    /// Whether the owner states the rods, and the radius.
    pub(crate) stated: (bool, bool),
    /// Whether Klipper ignores the block that `SAVE_CONFIG` wrote.
    pub saved_ignored: bool,
    /// Notes on the import, in sentences.
    pub notes: Vec<String>,
}

/// The robot of a controller.
pub(super) struct Machine {
    robot: Robot<f64>,
    /// As configured, without the owner's values.
    configured: Robot<f64>,
    /// The tilt of the bed that the controller adds: height per x and y.
    pub(super) tilt: [f64; 2],
    /// As [`Imported::first`] and [`Imported::stated`].
    first: [f64; 4],
    stated: (bool, bool),
    /// The height of the nozzle at x = y = 0 with each joint at its end stop, mm.
    endstops: [f64; 3],
    /// The radius of the printed area if it is stated, the assumed one, and its lowest height, mm.
    bed_radius: Option<f64>,
    area: (f64, f64),
    tolerance: Option<Tolerance<f64>>,
    notes: Vec<String>,
}

fn impossible(name: &str, cause: impl std::fmt::Display) -> InputError {
    InputError::new(name, format!("the geometry is impossible: {cause}"))
        .with_remedy("check the lengths of the configuration, in mm, not in inches")
}

impl Machine {
    /// Upright towers, with the radius of the printed area if it is stated, and its lowest height.
    pub(super) fn towers(
        name: &str,
        configured: &Towers,
        stated: &Stated,
        (bed_radius, lowest): (Option<f64>, f64),
    ) -> Result<Self, InputError> {
        let own = configured.as_stated(stated);
        let [now, then] = [configured.home(), own.home()];
        let robot = own.robot(name, [0.0; 3])?;
        let shift = [0, 1, 2].map(|tower| now[tower] - then[tower]);
        let tolerance = Tolerance::new(TOWERS.0, TOWERS.1.to_radians())
            .and_then(|own| {
                own.with(Parameter::Zero, TOWERS.2)?
                    .with(Parameter::Scale, TOWERS.3)
            })
            .and_then(|own| own.with_radius(stated.radius_sigma.unwrap_or(COMMON_RADIUS)))
            .and_then(|own| own.with_forearm(stated.rods_sigma.unwrap_or(COMMON_ROD)));
        let usual = USUAL_BED * configured.radius;
        Ok(Self {
            // The owner may state rods because those of the configuration are impossible.
            configured: configured.robot(name, shift).unwrap_or(robot.clone()),
            area: (bed_radius.unwrap_or(usual), lowest),
            tolerance: tolerance.ok(),
            notes: rods_note(stated, configured).into_iter().collect(),
            first: [own.radius, own.rods[0], own.rods[1], own.rods[2]],
            stated: (stated.rods.is_some(), stated.radius.is_some()),
            ..Self::of(robot, own.endstops, bed_radius)
        })
    }

    /// Rotary arms.
    pub(super) fn rotary(
        name: &str,
        arms: &[Shape; 3],
        endstops: [f64; 3],
        bed_radius: Option<f64>,
    ) -> Result<Self, InputError> {
        let robot = Shape::robot(arms, Drive::Rotary);
        let robot = robot.map_err(|error| impossible(name, error))?;
        let tolerance = Tolerance::new(ARMS.0, ARMS.1.to_radians())
            .and_then(|own| own.with_joint_zero(ARM_ZERO.to_radians()));
        Ok(Self {
            tolerance: tolerance.ok(),
            ..Self::of(robot, endstops, bed_radius)
        })
    }

    /// Nothing but a robot that is as configured.
    fn of(robot: Robot<f64>, endstops: [f64; 3], bed_radius: Option<f64>) -> Self {
        Self {
            robot: robot.clone(),
            configured: robot,
            tilt: [0.0; 2],
            first: [0.0; 4],
            stated: (false, false),
            endstops,
            bed_radius,
            area: (0.0, 0.0),
            tolerance: None,
            notes: Vec::new(),
        }
    }

    /// The joints at their end stops; `None` for an end stop that no joint angle reaches.
    pub(super) fn home(&self) -> [Option<f64>; 3] {
        [0, 1, 2].map(|index| {
            let robot = Robot::new([self.robot.arms()[index]; 3]).ok()?;
            let at = Vector3::new(0.0, 0.0, self.endstops[index]);
            robot.inverse(&at).ok().map(|[joint, ..]| joint)
        })
    }

    /// With the joints at their end stops and the readings.
    pub(super) fn imported(
        self,
        settings: &Settings,
        home: [f64; 3],
        readings: Readings,
        mut notes: Vec<String>,
    ) -> Result<Imported, InputError> {
        let name = &settings.name;
        let measured = readings.rows.iter().flat_map(|row| {
            let from = match row.value.distance {
                Some((ReadingFrom::Pose(from), _)) => from,
                _ => row.value.joints,
            };
            [row.value.joints, from]
        });
        let (low, high) = range(measured.chain([home]).flatten());
        let limits = match self.robot.drive() {
            Drive::Rotary => JointLimits::new(low, high.max(LOWEST_ARM.to_radians())),
            Drive::Linear => {
                let lowest = lowest_travel(&self.robot, self.area);
                JointLimits::travel(low.min(lowest).floor(), high)
            }
        };
        let limits = limits.map_err(|error| impossible(name, error))?;
        let mut lengths = self.robot.arms().iter().map(Arm::lb);
        if let Some(short) = lengths.find(|own| *own < SHORTEST) {
            let cause = format!("a rod of {} mm is too short", rounded(short));
            return Err(impossible(name, cause));
        }
        if !reaches_anywhere(&self.robot, &limits) {
            return Err(impossible(name, "the forearms do not meet anywhere"));
        }
        let planes = level_planes(&readings.planes, self.robot.drive());
        let [own, configured] = [&self.robot, &self.configured].map(|own| tilted(own, self.tilt));
        let mut robot = RobotFile::of(name, own, limits);
        robot.tolerance = self.tolerance;
        robot.instruments.joint_noise = Some(0.0);
        robot.instruments.bed = unevenness(&readings);
        robot.instruments.planes = planes;
        notes.extend(self.notes);
        Ok(Imported {
            firmware: settings.firmware,
            robot,
            configured,
            towers: self.configured,
            readings,
            names: Vec::new(),
            held: 0,
            home,
            bed_radius: self.bed_radius,
            probed_radius: None,
            one_rod: false,
            steps: None,
            probe: Probe::default(),
            first: self.first,
            stated: self.stated,
            saved_ignored: false,
            notes,
        })
    }
}

/// Towers as seen by a controller that adds to each height a part of x and of y.
fn tilted(robot: &Robot<f64>, [by_x, by_y]: [f64; 2]) -> Robot<f64> {
    if by_x == 0.0 && by_y == 0.0 {
        return robot.clone();
    }
    let normal = Vector3::new(-by_x, -by_y, 1.0);
    let turn = Rotation3::rotation_between(&normal, &Vector3::z()).unwrap_or_default();
    let arm = |index: usize| {
        let arm = &robot.arms()[index];
        let (at, up) = (turn * arm.d(), turn * Vector3::z());
        Arm::linear([at.x, at.y, at.z, up.x.asin(), up.y.asin(), 1.0, arm.lb()])
    };
    let arms = || Robot::new([arm(0)?, arm(1)?, arm(2)?]);
    arms().unwrap_or_else(|_| robot.clone())
}

/// With all arms lower.
pub(crate) fn lowered(robot: &Robot<f64>, by: f64) -> Robot<f64> {
    let mut parameters = robot.parameters();
    for [_, _, height, ..] in &mut parameters {
        *height -= by;
    }
    robot
        .with_parameters(parameters)
        .unwrap_or_else(|_| robot.clone())
}

/// The bed is level at z = 0, and so is the plane that a probe measures.
fn level_planes(names: &[String], drive: Drive) -> Vec<KnownPlane> {
    let plane = |name: &String| KnownPlane {
        name: name.clone(),
        line: 0,
        height: 0.0,
        sigma: match drive {
            Drive::Linear if name == PROBE => TRIGGER,
            Drive::Linear => BED,
            Drive::Rotary => SHOULDERS,
        },
        tilt: Some(BED.to_radians()),
        blocks: Vec::new(),
    };
    names.iter().map(plane).collect()
}

/// The lowest carriage that the printed area needs, mm: opposite each tower, as far out as its rod reaches.
fn lowest_travel(robot: &Robot<f64>, (radius, lowest): (f64, f64)) -> f64 {
    let mut low = f64::INFINITY;
    for arm in robot.arms() {
        let towards = arm.d().xy().normalize();
        let parts = (0..=20).map(|step| radius * (1.0 - 0.05 * f64::from(step)));
        let mut reached = parts.filter_map(|out| {
            let at = Vector3::new(-out * towards.x, -out * towards.y, lowest);
            robot.inverse(&at).ok()
        });
        low = reached.next().into_iter().flatten().fold(low, f64::min);
    }
    low
}

/// A bed of this radius up to the end stops is where the robot works, with carriages that go as low as that needs.
pub(crate) fn print_within(file: &mut RobotFile, home: &[f64; 3], out: f64) {
    let RobotFile { robot, limits, .. } = file;
    let top = robot.forward(home).map_or(0.0, |at| at.z.floor());
    if robot.drive() == Drive::Linear {
        let low = lowest_travel(robot, (out, 0.0)).floor();
        let low = low.min(limits.minimum());
        *limits = JointLimits::travel(low, limits.maximum()).unwrap_or(*limits);
    }
    file.within = (top > 0.0).then_some(Region {
        ranges: [(-out, out), (-out, out), (0.0, top)],
        radius: Some(out),
    });
}

/// A note if `--rods` replaces other rods, or if the configured rods may come from an earlier calibration.
fn rods_note(stated: &Stated, own: &Towers) -> Option<String> {
    let of = |rods: [f64; 3]| rods.map(rounded).join(", ");
    let configured = own.rods;
    if let Some(rods) = stated.rods {
        let (own, rods) = (of(configured), of(rods));
        let note = format!("--rods sets the rods to {rods} mm; the configuration has {own}.");
        return (rods != own).then_some(note);
    }
    let [_, configured @ ..] = own.first(stated);
    let round = |rod: &f64| (rod / ROUND - (rod / ROUND).round()).abs() < 1e-6;
    (!configured.iter().all(round)).then(|| {
        format!(
            "The rods of {} mm may come from an earlier calibration. State their length as made with --rods if you know it.",
            of(configured)
        )
    })
}

/// What a bed with these touches is taken to be uneven by.
fn unevenness(readings: &Readings) -> Option<f64> {
    let rows = readings.rows.iter();
    let touches = rows.filter(|row| row.value.height.is_some()).count();
    (touches >= TELLING).then_some(UNEVEN)
}

impl Imported {
    /// Whether towers have other rods or another radius than at first: an earlier calibration's lines.
    pub(crate) fn is_pasted(&self) -> bool {
        let [radius, rods @ ..] = self.first;
        let mut arms = self.configured.arms().iter().zip(rods);
        let differ = |one: f64, other: f64| (one - other).abs() > 1e-3;
        self.configured.drive() == Drive::Linear
            && arms.any(|(arm, rod)| differ(arm.lb(), rod) || differ(arm.d().xy().norm(), radius))
    }

    /// With these readings in place of those of the configuration; their only plane is the bed.
    #[must_use]
    pub fn with_readings(mut self, readings: Readings) -> Self {
        let line = |line| format!("line {line} of {}", readings.name);
        self.names = readings.rows.iter().map(|row| line(row.line)).collect();
        if !readings.targets.iter().any(|name| name == PROBE) {
            self.robot.parallelograms = None;
            self.robot.instruments.targets.clear();
        }
        self.readings = readings;
        self.with_planes()
    }

    /// With the planes of its readings, level, the bed as uneven as its touches can tell.
    fn with_planes(mut self) -> Self {
        let instruments = &mut self.robot.instruments;
        instruments.planes = level_planes(&self.readings.planes, self.robot.robot.drive());
        instruments.bed = unevenness(&self.readings);
        self
    }

    /// With touches of the bed by the nozzle on paper, or by the probe, in place of earlier ones.
    pub(super) fn with_touches_of(self, mut touches: Readings, paper: bool) -> Self {
        let is_paper = |own: &Row<Reading>| own.value.height.is_some() && own.value.target == 0;
        let kept = self.readings.rows.iter().zip(&self.names);
        let kept = kept.filter(|(row, _)| is_paper(row) != paper);
        let (rows, kept): (Vec<_>, Vec<_>) = kept.map(|(row, name)| (*row, name.clone())).unzip();
        let both = rows.iter().any(|own| own.value.height.is_some());
        let targets = self.robot.instruments.targets.iter();
        touches.targets = targets.map(|own| own.name.clone()).collect();
        let mut own = self.with_readings(touches);
        own.names.extend(kept);
        own.readings.rows.extend(rows);
        if both {
            own.readings.planes.push(PROBE.to_owned());
            for row in &mut own.readings.rows {
                if let Some((plane, _)) = &mut row.value.height {
                    *plane = row.value.target;
                }
            }
            own = own.with_planes();
        }
        own
    }

    /// Whether z = 0 of the controller is in the plane of its arms, high above the bed.
    pub(crate) fn below_the_arms(&self) -> bool {
        matches!(self.firmware, Firmware::FluidNc | Firmware::GrblHal)
    }

    /// With z = 0 on a bed at this height of the controller.
    pub(super) fn on_a_bed_at(mut self, height: f64) -> Self {
        self.robot.robot = lowered(&self.robot.robot, height);
        self.configured = lowered(&self.configured, height);
        self.towers = lowered(&self.towers, height);
        for row in &mut self.readings.rows {
            row.value.height = row.value.height.map(|(plane, own)| (plane, own - height));
        }
        self
    }

    /// With a probe, if it is beside the nozzle: where it touches, an effector tilts whose rods differ.
    pub(super) fn with_probe(mut self, probe: Probe, apart: Option<f64>) -> Self {
        self.probe = probe;
        let Some([x, y]) = probe.offset.filter(|_| probe.distance() > 0.0) else {
            return self;
        };
        let [arm, ..] = self.robot.robot.arms();
        let usual = Parallelograms::USUAL;
        self.robot.platform_radius = Some(EFFECTOR * arm.lb());
        self.robot.parallelograms = Some(Parallelograms {
            spacing: apart.unwrap_or(usual.spacing),
            platform_radius: EFFECTOR * arm.lb(),
            ..usual
        });
        let target = |(name, place, sigma): (&str, _, [f64; 3])| Target {
            name: name.to_owned(),
            place,
            sigma: sigma.into(),
        };
        let nozzle = (NOZZLE, Vector3::zeros(), [BED; 3]);
        let probe = (PROBE, Vector3::new(x, y, 0.0), PROBE_PLACE);
        self.robot.instruments.targets = [nozzle, probe].map(target).to_vec();
        if !self.readings.rows.is_empty() {
            self.readings.targets = [NOZZLE, PROBE].map(str::to_owned).to_vec();
        }
        self
    }

    /// With the bed at these places as the configuration has it.
    #[must_use]
    pub(crate) fn holding(mut self, places: &[[f64; 2]]) -> Self {
        let at = |[x, y]: &[f64; 2]| self.configured.inverse(&Vector3::new(*x, *y, 0.0)).ok();
        let held: Vec<_> = places.iter().filter_map(at).collect();
        self.held = held.len();
        self.names
            .extend(vec!["the bed as configured".to_owned(); held.len()]);
        self.readings
            .rows
            .extend(held.into_iter().map(|joints| Row {
                line: 0,
                value: Reading {
                    height: Some((0, 0.0)),
                    sigma: Some(BED),
                    ..Reading::at(joints)
                },
            }));
        self.readings.planes = vec!["plane".to_owned()];
        self.readings.targets.clear();
        self.robot.parallelograms = None;
        self = self.with_planes();
        let instruments = &mut self.robot.instruments;
        instruments.height_noise = Some(BED);
        instruments.bed = None;
        instruments.targets.clear();
        self
    }

    /// With lengths of prints, and those and the shrinkage that the owner states, beside the other readings. Without the
    /// latter it is unknown, and so is an oversize of prints if their lengths differ and no other distances are known.
    ///
    /// # Errors
    /// A place that the printer does not reach.
    pub fn with_prints(mut self, stated: &Stated, lengths: &[Length]) -> Result<Self, InputError> {
        let printed = stated.printed.iter().flat_map(|[wanted, came_out]| {
            DIRECTIONS.map(|direction| {
                let (sine, cosine) = f64::to_radians(direction).sine_cosine();
                let [x, y] = [0.5 * wanted * cosine, 0.5 * wanted * sine];
                Length {
                    name: format!("--printed {}", rounded(*wanted)),
                    between: [[-x, -y], [x, y]],
                    length: *came_out,
                }
            })
        });
        // One measurement is used for all directions.
        let in_all = CALLIPER * (DIRECTIONS.len() as f64).sqrt();
        let lengths = lengths.iter().map(|own| (own.clone(), CALLIPER));
        let lengths: Vec<_> = lengths.chain(printed.map(|own| (own, in_all))).collect();
        let designed = |own: &(Length, f64)| own.0.designed();
        // One designed length does not tell an oversize from a scale.
        let mut pairs = lengths.windows(2);
        let differ = pairs.any(|own| (designed(&own[0]) - designed(&own[1])).abs() > 1.0);
        if differ && !self.readings.holds(Kind::Distance) {
            self.robot.instruments.oversize = Some(OVERSIZE);
        }
        for (own, sigma) in lengths {
            let at = |[x, y]: [f64; 2]| self.configured.inverse(&Vector3::new(x, y, 0.0));
            let [Ok(from), Ok(to)] = own.between.map(at) else {
                let cause = format!("{}: the printer does not reach both places", own.name);
                return Err(InputError::new(&self.robot.name, cause).with_remedy(
                    "state lengths between places of the bed, in mm from its centre",
                ));
            };
            self.readings.rows.push(Row {
                line: 0,
                value: Reading {
                    distance: Some((ReadingFrom::Pose(from), own.length)),
                    sigma: Some(sigma),
                    ..Reading::at(to)
                },
            });
            self.names.push(own.name);
        }
        let shrinkage = stated.shrinkage.unwrap_or_default();
        for row in &mut self.readings.rows {
            if let Some((ReadingFrom::Pose(_), distance)) = &mut row.value.distance {
                *distance /= 1.0 - shrinkage;
            }
        }
        if stated.shrinkage.is_none() && self.readings.holds(Kind::Distance) {
            self.robot.instruments.distance_scale = Some(SHRINKAGE);
        }
        Ok(self)
    }

    /// The error of a configuration without readings, and how to get some.
    pub fn without_readings(&self) -> InputError {
        let (cause, remedy) = match self.firmware {
            Firmware::Klipper if self.saved_ignored => (
                "Klipper ignores the SAVE_CONFIG block with the saved measurements: a line in or below it does not \
                 begin with #*#",
                "move such lines above the block (empty ones too), then run DELTA_CALIBRATE and SAVE_CONFIG again",
            ),
            Firmware::Klipper => (
                "the configuration holds no saved measurements (height0, … in [delta_calibrate])",
                "run DELTA_CALIBRATE in Klipper, then SAVE_CONFIG, and give the file that it wrote; docs/printers.md has \
                 the steps",
            ),
            Firmware::FluidNc | Firmware::GrblHal => (
                "this firmware saves no measurements",
                "touch the bed at ten places (G38.2), and give what the console answers as well",
            ),
            _ => (
                "this firmware saves no measurements",
                "touch the bed by the commands of delta-cal plan, and give what the console answers as well",
            ),
        };
        InputError::new(&self.robot.name, cause).with_remedy(remedy)
    }

    /// The comment of lines that says what was configured before any was pasted.
    pub(crate) fn kept(&self, controller: &Robot<f64>) -> Option<String> {
        if controller.drive() == Drive::Rotary {
            return None;
        }
        let [first, ..] = controller.arms();
        let rods = controller.arms().each_ref().map(|arm| rounded(arm.lb()));
        let [radius, own @ ..] = self.first.map(rounded);
        let beside = match self.firmware {
            Firmware::Klipper | Firmware::RepRapFirmware => "",
            _ => ". Give this file to the next calibrate too: the controller keeps no comments",
        };
        Some(format!(
            "{KEPT} radius {radius} and rods {} as first configured, for {} and {} here{beside}",
            own.join(", "),
            rounded(first.d().xy().norm()),
            rods.join(", ")
        ))
    }

    /// Whether the owner measured the rods: their length is stated with its σ.
    pub fn rods_measured(&self) -> bool {
        let tolerance = self.robot.tolerance;
        let stated = tolerance.is_some_and(|own| own.forearm() < COMMON_ROD);
        stated && self.robot.robot.drive() == Drive::Linear
    }

    /// The kinematics, as Klipper names it.
    pub fn kinematics(&self) -> &'static str {
        match self.robot.robot.drive() {
            Drive::Linear => "delta",
            Drive::Rotary => "rotary_delta",
        }
    }

    /// The export target whose lines its controller reads.
    pub fn target(&self) -> &'static str {
        if self.one_rod {
            "marlin-1.1"
        } else {
            self.firmware.name()
        }
    }

    /// The number of heights and of distances.
    pub fn counts(&self) -> [usize; 2] {
        let measured = self.readings.rows.len() - self.held;
        let rows = || self.readings.rows.iter().take(measured);
        [
            rows().filter(|row| row.value.height.is_some()).count(),
            rows().filter(|row| row.value.distance.is_some()).count(),
        ]
    }

    /// The robot file's text.
    pub fn robot_text(&self) -> String {
        let mut comment = vec![
            format!(
                "Imported by delta-cal {} from {}: the geometry that {} uses.\n\
                 delta-cal calibrate finds the true one.",
                env!("CARGO_PKG_VERSION"),
                self.robot.name,
                self.firmware.title()
            ),
            match self.robot.robot.drive() {
                Drive::Linear => {
                    "The travel of a carriage is the height of its rod's upper end above z = 0.\n\
                     Tolerance, one sigma: tower position and rod, lean of a tower, end stops, belts, and \
                     what all towers or rods have in common."
                }
                Drive::Rotary => {
                    "The joint angle is 0 with the upper arm level and positive downwards: Klipper's with the other \
                     sign."
                }
            }
            .to_owned(),
            "The noise of heights and distances is estimated. If you know it, state height_mm and distance_mm."
                .to_owned(),
        ];
        if !self.readings.planes.is_empty() {
            comment.push("The bed is level at z = 0.".to_owned());
        }
        comment.extend_from_slice(&self.notes);
        let mut robot = self.robot.clone();
        if let Some(out) = self.bed_radius {
            print_within(&mut robot, &self.home, out);
        }
        robot.to_toml(&comment.join("\n"))
    }

    /// The samples file's text, if there are readings.
    pub fn samples_text(&self) -> Option<String> {
        let [heights, distances] = self.counts().map(|count| count > 0);
        let (convention, planes) = (&self.robot.convention, &self.readings.planes);
        let joints = Quantity::joints(convention.drive).map(Some);
        let height = heights.then_some(Quantity::Height);
        let plane = (planes.len() > 1).then_some(Quantity::Plane);
        let distance = distances.then_some(Quantity::Distance);
        let to = Quantity::to_joints(convention.drive).map(|own| distances.then_some(own));
        let mut rows = self.readings.rows.iter();
        let weighted = rows.any(|row| row.value.sigma.is_some());
        let sigma = weighted.then_some(Quantity::Sigma);
        let target = (heights && self.robot.parallelograms.is_some()).then_some(Quantity::Target);
        let columns = joints
            .into_iter()
            .chain([height, plane, target, distance])
            .chain(to)
            .chain([sigma]);
        let columns: Vec<_> = columns.flatten().collect();
        let header = columns.iter().map(|own| convention.column(*own));
        let mut lines = vec![header.collect::<Vec<_>>().join(",")];
        for Row { value: own, .. } in &self.readings.rows {
            let from = match own.distance {
                Some((ReadingFrom::Pose(from), _)) => Some(convention.joints(&from)),
                _ => None,
            };
            let joints = convention.joints(&own.joints);
            let cell = |column: &Quantity| match column {
                Quantity::Joint(_, joint) => Some(rounded(joints[*joint])),
                Quantity::ToJoint(_, joint) => from.map(|from| rounded(from[*joint])),
                Quantity::Height => own.height.map(|(_, height)| rounded(height)),
                Quantity::Plane => own.height.and_then(|(plane, _)| planes.get(plane).cloned()),
                Quantity::Sigma => own.sigma.map(rounded),
                Quantity::Target => self.readings.targets.get(own.target).cloned(),
                _ => from
                    .and(own.distance)
                    .map(|(_, distance)| rounded(distance)),
            };
            let cells = columns.iter().map(|own| cell(own).unwrap_or_default());
            lines.push(cells.collect::<Vec<_>>().join(","));
        }
        (heights || distances).then(|| lines.join("\n") + "\n")
    }
}
