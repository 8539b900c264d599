//! What the search found, for a report: errors that the model cannot represent, and explanations in sentences.

use super::search::{Fitted, Found};
use crate::accuracy::uncertainty::Sensitivities;
use crate::effects::{At, Course, Effect, EffectKind, Estimated, Platform};
use crate::files::samples_file::Kind;
use crate::fit::solution::COMPUTED;
use crate::fit::{Case, Frame, Solution};
use crate::text::{capitalised, in_lines};
use delta_cal::frame::RigidTransform;
use delta_cal::{ArmIndex, Robot, Sample};
use nalgebra::{DVector, SVector, Vector3};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Residuals of an explanation, over the stated noise.
const EXPLAINED: f64 = 1.3;
/// An explanation of most leaves less than one in so many; of a surface, half of the variance.
const MOSTLY: f64 = 3.0;
const OF_SURFACES: f64 = 1.4;
/// What leaves more than this many times the noise explains nothing.
const FAR_OFF: f64 = 100.0;
/// A step that chance shows so often is none. A robot far beyond its tolerance leaves residuals of any shape.
const BY_CHANCE: f64 = 1e-3;

/// Errors outside the model that the residuals reveal.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Causes {
    /// The causes found, the one that explains most first.
    #[serde(rename = "causes")]
    pub found: Vec<Cause>,
    /// The reason why the residuals were not tested, if they were not.
    #[serde(rename = "causes_not_tested")]
    pub not_tested: Option<&'static str>,
    /// The largest drift of the positions, from the first row to the last, that the order of the rows hides, mm: three
    /// σ. `None` if the order separates drift from geometry.
    #[serde(skip)]
    pub hidden_drift: Option<f64>,
    /// Error of the calibrated robot's positions due to the causes, rms over the workspace, mm: their own effect and
    /// what the parameters have absorbed of them. 0 if none was found.
    #[serde(rename = "causes_position_error_mm")]
    pub position_error: f64,
    /// The same of relative positions.
    #[serde(skip)]
    pub relative_error: f64,
    /// The part of these errors that a rigid motion of the robot's base makes, at poses, mm.
    #[serde(skip)]
    pub of_base: Vec<(Sample<f64>, Vector3<f64>)>,
}

/// An error outside the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cause {
    /// Its kind.
    pub kind: EffectKind,
    /// 1, 2 or 3; `null` for a cause that does not belong to an arm.
    pub arm: Option<usize>,
    /// The line at which a step happened.
    pub line: Option<u64>,
    /// Its size: the amplitude of a periodic error, half of a backlash, the sag at the largest distance from the
    /// robot's axis, the drift from the first row to the last. Signed if there is only one coefficient.
    pub size: f64,
    /// `ratio`, `deg` or `mm`.
    pub unit: &'static str,
    /// One σ of the size.
    pub sigma: f64,
    /// The probability that chance shows as much in this test alone, given the other causes found.
    pub p: f64,
    /// Alternatives that explain the residuals about as well.
    pub alternatives: Vec<String>,
    /// The cause in one sentence.
    pub text: String,
    /// The remedy.
    pub remedy: String,
}

impl Causes {
    /// What the search found beside a solution; `poses` cover the workspace.
    pub(crate) fn of(
        case: &Case<'_>,
        found: &Found,
        solution: &Solution,
        poses: &[Sample<f64>],
    ) -> Self {
        let mut causes = Self {
            not_tested: found.not_tested,
            hidden_drift: found.hidden_drift,
            ..Self::default()
        };
        let best = found.best.as_ref();
        let best = best.filter(|own| own.is_in_residuals(&found.base));
        // The tolerance alone shows another size, unless it is the scale of the instrument that is wrong.
        let sized = [Effect::of(EffectKind::Size)];
        let of_size = found.all().find(|own| own.hypothesis.effects == sized);
        let facts = &case.robot.instruments;
        let is_known = facts.scale.is_some() || !facts.datum.is_empty();
        let may_be_scale = case.readings.holds(Kind::Position) && !is_known;
        let Some(best) = best.or(of_size.filter(|_| may_be_scale)) else {
            return causes;
        };
        let frame = best.solution.places.frame.as_ref();
        let effects = best.hypothesis.effects.iter();
        let outside = effects.filter(|own| !own.kind.is_number() || sized.contains(own));
        causes.found = outside
            .filter_map(|own| cause(case, found, best, own, frame))
            .collect();
        if causes.found.iter().any(|own| own.kind == EffectKind::Drift) {
            causes.hidden_drift = None;
        }
        if !causes.found.is_empty() {
            causes.discrepancy(best, solution, poses);
        }
        causes
    }

    /// How far positions of the calibrated robot are from those of the robot with its causes, in both directions of a backlash;
    /// in the robot's own frame, from where they were at the first row. A scale belongs to the instrument.
    fn discrepancy(&mut self, best: &Fitted, solution: &Solution, poses: &[Sample<f64>]) {
        let robot = &best.solution.robot;
        let course = Course::of(
            robot,
            Platform::default(),
            &best.solution.places,
            &best.solution.readings,
        );
        let drifts = solution.frame == Frame::Base;
        let own = best.hypothesis.effects.iter().filter(|own| {
            own.kind.is_of_joint()
                || own.kind == EffectKind::Sag
                || own.kind == EffectKind::Drift && drifts
        });
        let own: Vec<_> = own
            .filter_map(|own| Some((own.at(0), &best.estimate(own)?.by)))
            .collect();
        let error = |pose: &Sample<f64>, directions: [f64; 3]| {
            let at = At::new(robot, &pose.joints)?;
            let here = course.anywhere(&at, directions);
            let moved = own
                .iter()
                .map(|(effect, by)| effect.displacement(&at, &here, 0, by));
            let there = at.position + moved.sum::<SVector<f64, 3>>();
            let calibrated = solution.robot.forward(&pose.joints).ok()?;
            Some((*pose, there - calibrated))
        };
        let ways =
            [1.0, -1.0].map(|way| poses.iter().filter_map(move |pose| error(pose, [way; 3])));
        let errors = Sensitivities(ways.into_iter().flatten().collect());
        let rms = |errors: &Sensitivities<1>| errors.mean_square().trace().sqrt();
        self.position_error = rms(&errors);
        if let Some(relative) = errors.relative() {
            self.relative_error = rms(&relative);
            let pairs = errors.0.iter().zip(&relative.0);
            self.of_base = pairs
                .map(|((pose, error), (_, left))| (*pose, error - left))
                .collect();
        }
    }
}

/// An effect as it was fitted: its size, one σ of that, its words, and its square in σ.
fn described(
    case: &Case<'_>,
    fitted: &Fitted,
    effect: &Effect,
    frame: Option<&RigidTransform<f64>>,
) -> Option<(f64, f64, String, f64)> {
    let (estimate, solution) = (fitted.estimate(effect)?, &fitted.solution);
    // A joint's error before its first move is no part of its play.
    let size = match effect.kind {
        EffectKind::Backlash => 1,
        _ => estimate.by.len(),
    };
    let first = estimate.first;
    let variance = (solution.squares() / solution.degrees_of_freedom()).max(1.0);
    let covariance = solution.covariance.view((first, first), (size, size)) * variance;
    let by = DVector::from_column_slice(&estimate.by[..size]);
    let along = by.normalize();
    let sigma = (along.transpose() * &covariance * &along)[(0, 0)].sqrt();
    let squares = covariance.cholesky();
    let squares = squares.map_or(0.0, |own| own.solve(&by).dot(&by));
    let by = in_axes_of_the_file(estimate, frame);
    let (own, sigma, text) = effect.described(&by[..size], sigma, case.robot, case.readings);
    Some((own, sigma, text, squares))
}

fn cause(
    case: &Case<'_>,
    found: &Found,
    best: &Fitted,
    effect: &Effect,
    frame: Option<&RigidTransform<f64>>,
) -> Option<Cause> {
    let (own, sigma, text, squares) = described(case, best, effect, frame)?;
    let drive = case.robot.robot.drive();
    let others: Vec<_> = others(found, best, effect).collect();
    let mut alternatives: Vec<_> = others.iter().map(|own| own.named()).collect();
    alternatives.dedup();
    let text = match alternatives.len() {
        0 => text,
        _ => format!("{text}; about as likely: {}", alternatives.join(" or ")),
    };
    let kinds: Vec<_> = others.iter().map(|own| own.kind).collect();
    let line = case.readings.rows.get(effect.index).map(|row| row.line);
    let unknowns = ChiSquared::new(effect.unknowns() as f64);
    Some(Cause {
        kind: effect.kind,
        arm: effect.arm.map(|arm| arm.index() + 1),
        line: line.filter(|_| effect.kind.is_step()),
        size: own,
        unit: effect.kind.unit(drive),
        sigma,
        p: unknowns.map_or(1.0, |own| own.sf(squares)),
        alternatives,
        text,
        remedy: remedy(case, effect, &kinds),
    })
}

/// The unknowns of an effect; of a move, which happened to the sensor, in its frame, in which the file has its positions.
fn in_axes_of_the_file(estimate: &Estimated, frame: Option<&RigidTransform<f64>>) -> Vec<f64> {
    let mut by = estimate.by.clone();
    if let (EffectKind::Move, Some(frame)) = (estimate.effect.kind, frame) {
        for own in by.chunks_exact_mut(3) {
            own.copy_from_slice((frame.rotation * Vector3::from_column_slice(own)).as_slice());
        }
    }
    by
}

/// What to do, given the alternatives; with a step, the rows before it and those from it on.
fn remedy(case: &Case<'_>, effect: &Effect, alternatives: &[EffectKind]) -> String {
    let own = effect.kind.remedy(alternatives);
    let line = case.readings.rows.get(effect.index).map(|row| row.line);
    match line.filter(|_| effect.kind.is_step()) {
        Some(line) => format!("{own} (--rows ..{} and --rows {line}..)", line - 1),
        None => own.to_owned(),
    }
}

/// What the others have in place of an effect of one explanation.
fn others<'a>(
    found: &'a Found,
    one: &'a Fitted,
    effect: &'a Effect,
) -> impl Iterator<Item = &'a Effect> {
    let one = &one.hypothesis.effects;
    let all = found.all().map(|own| &own.hypothesis.effects);
    let without = all.filter(move |own| !own.contains(effect)).flatten();
    without
        .filter(move |own| !(one.contains(own) || own.kind == effect.kind && own.arm == effect.arm))
}

/// What explains readings that contradict noise or tolerance, in sentences with remedies.
#[derive(Debug, Clone)]
pub(crate) struct Explained {
    pub(crate) text: String,
    /// Whether it may be the scale of the instrument: then the robot's size is unknown.
    pub(crate) is_scale: bool,
}

impl Found {
    /// The best explanation and those about as good.
    fn all(&self) -> impl Iterator<Item = &Fitted> {
        self.best.iter().chain(&self.rivals)
    }

    /// By what an estimated noise exceeds the one that the best explanation leaves, if it does.
    pub(crate) fn excess(&self) -> Option<f64> {
        let best = self.best.as_ref()?;
        let excess = (0.5 * (self.base.spread - best.spread)).exp();
        (excess > EXPLAINED && best.is_in_residuals(&self.base)).then_some(excess)
    }

    /// The explanations, if they leave nothing else to explain.
    pub(crate) fn explained(&self, case: &Case<'_>) -> Option<Explained> {
        let best = self.best.as_ref()?;
        let (before, after) = (self.base.misfit(), best.misfit());
        // The faults of real robots do not have exactly the shapes of the columns.
        let mostly = if best.is_of_a_surface() {
            OF_SURFACES
        } else {
            MOSTLY
        };
        let explains = if after < EXPLAINED {
            "explains the readings".to_owned()
        } else if before > mostly * after && after < FAR_OFF {
            format!("explains most of the residuals ({before:.1} → {after:.1} × the stated noise)")
        } else {
            return None;
        };
        let what: Vec<_> = self.all().filter_map(|own| what(case, own)).collect();
        let remedy = match best.hypothesis.effects.first() {
            Some(own) => {
                let others: Vec<_> = others(self, best, own).map(|own| own.kind).collect();
                remedy(case, own, &others)
            }
            None if case.options.robust => "measure these rows again, or delete them".to_owned(),
            None => "measure these rows again, or delete them; --robust leaves them out".to_owned(),
        };
        let remedy = capitalised(&remedy);
        let text = match &what[..] {
            [] => return None,
            [one] => format!("This {explains}: {one}. {remedy}."),
            several => format!(
                "Each of these {explains} about equally well: {}. {remedy}.",
                several.join("; or ")
            ),
        };
        let mut effects = self.all().flat_map(|own| &own.hypothesis.effects);
        let is_scale = effects.any(|own| matches!(own.kind, EffectKind::Size | EffectKind::Scale));
        Some(Explained { text, is_scale })
    }
}

/// A row from which on the readings are of another robot or in another frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// Its index in the file.
    #[serde(skip)]
    pub(crate) row: usize,
    /// Its line.
    pub line: u64,
    /// What happened, in one sentence.
    pub text: String,
}

impl Found {
    /// The first step that the residuals show; `known`, the sensor's frame, if the readings are no longer in it.
    pub(crate) fn step(
        &self,
        case: &Case<'_>,
        known: Option<&RigidTransform<f64>>,
    ) -> Option<Step> {
        let best = self.best.as_ref()?;
        let effects = best.hypothesis.effects.iter();
        let steps = effects.filter(|own| own.kind.is_step());
        let first = steps.min_by_key(|own| own.index)?;
        let frame = known.or(best.solution.places.frame.as_ref());
        let own = cause(case, self, best, first, frame)?;
        let [arm, ..] = case.robot.robot.arms();
        let is_rounding = best.solution.levels.position.position() < COMPUTED * arm.lb();
        let is_shown = own.p < BY_CHANCE && best.is_plausible() && best.is_in_residuals(&self.base);
        (is_shown && !is_rounding).then_some(Step {
            row: first.index,
            line: own.line?,
            text: own.text,
        })
    }
}

/// The direction of an upper arm where its joint reads 0, radians.
fn zero(robot: &Robot<f64>, arm: ArmIndex) -> f64 {
    let (x, y) = robot.arm(arm).la();
    y.atan2(x)
}

fn what(case: &Case<'_>, fitted: &Fitted) -> Option<String> {
    let effects = fitted.hypothesis.effects.iter().filter_map(|own| {
        if own.kind == EffectKind::Zeros {
            let robots = [&fitted.solution.robot, &case.robot.robot];
            let off = ArmIndex::ALL.map(|arm| {
                let [found, stated] = robots.map(|robot| zero(robot, arm));
                found - stated
            });
            return Some(own.described(&off, 0.0, case.robot, case.readings).2);
        }
        let frame = fitted.solution.places.frame.as_ref();
        Some(described(case, fitted, own, frame)?.2)
    });
    let mut all: Vec<_> = effects.collect();
    let rows = fitted.hypothesis.rows.iter();
    let lines = rows.filter_map(|row| Some(case.readings.rows.get(*row)?.line));
    let lines: Vec<_> = lines.collect();
    if !lines.is_empty() {
        let verb = if lines.len() == 1 {
            "disagrees"
        } else {
            "disagree"
        };
        all.push(format!("{} {verb} with the others", in_lines(&lines)));
    }
    (!all.is_empty()).then(|| all.join(", and "))
}
