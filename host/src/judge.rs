//! Judges a solution: whether it is credible, reproduced by the robot, and expected to improve it.

pub mod credibility;
pub mod known;

use crate::accuracy::expanded::Spread;
use crate::accuracy::improvement::{Moved, WorkspaceComparison};
use crate::accuracy::information::prior;
use crate::accuracy::position_error::{BeforeAfter, PositionError, sigma_by_tolerance};
use crate::accuracy::uncertainty::{
    ExpectedError, Throughout, Weights, WorkspacePoses, jacobian, weights,
};
use crate::effects::{EffectKind, Places};
use crate::explain::{Causes, Found};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Kind;
use crate::fit::solution::{COMPUTED, OF_ROBOT, PARAMETERS};
use crate::fit::{Case, Solution, Unsolved, solve};
use credibility::{NoiseTest, NoiseVerdict, PriorTest, SMALL, ToleranceTest};
use delta_cal::robot::Drive;
use delta_cal::{Refusal, Robot, Sample, Tolerance};
use known::Known;
use nalgebra::{DMatrix, DVector, SMatrix, Vector3};

/// A noise below this fraction of the stated one indicates another unit.
const FAR_OFF: f64 = 0.05;
/// Heights and distances of towers find the bed, and leave all else to the tolerance: they are refused only if harm is
/// this likely.
const MORE_LIKELY: f64 = 0.5;

/// Nobody states the tolerance of a printer, so that a printer as far outside of it is one.
const OF_PRINTER: f64 = 3.0;

/// A solution judged good.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    /// The robot file, with a wider tolerance if that was needed.
    pub(crate) robot: RobotFile,
    /// The solution, its readings' noise widened by the lack of fit.
    pub(crate) solution: Solution,
    /// Of the calibrated robot.
    pub(crate) poses: WorkspacePoses,
    /// Over the poses inside; `None` if they do not determine a rigid motion.
    pub(crate) weights: Option<Weights>,
    pub(crate) widening: f64,
    pub(crate) noise: Vec<NoiseTest>,
    pub(crate) causes: Causes,
    pub(crate) tolerance: Option<ToleranceTest>,
    pub(crate) workspace: Option<WorkspaceComparison>,
    /// What explains readings that contradict the tolerance or the noise.
    pub(crate) explained: Option<String>,
    /// Over the rows with x, y and z; `None` if there are none.
    pub(crate) errors: Option<BeforeAfter>,
}

impl Judged {
    /// The expected error of the calibrated robot and its spread, `None` if no pose is clear of singularities, and what is
    /// known of it.
    pub(crate) fn expected(&self) -> (Option<(ExpectedError, Spread)>, Known) {
        let (robot, solution) = (&self.robot, &self.solution);
        let covariance = solution.of_robot();
        let found = if solution.is_of_parameters() {
            self.over::<PARAMETERS>(&solution.of_parameters())
        } else {
            self.over::<OF_ROBOT>(&covariance)
        };
        let before =
            prior(robot).and_then(|prior| ExpectedError::of_robot(robot, &robot.robot, &prior));
        let tolerance = robot.tolerance.as_ref();
        let known = Known::of(
            match tolerance.and_then(Tolerance::joint_zero) {
                Some(_) => &solution.robot,
                None => &robot.robot,
            },
            tolerance,
            &solution.of_parameters(),
            before.as_ref(),
            found.as_ref().map(|(expected, _)| expected),
        );
        (found, known)
    }

    fn over<const P: usize>(
        &self,
        covariance: &SMatrix<f64, P, P>,
    ) -> Option<(ExpectedError, Spread)> {
        let (solution, reach, tool) = (&self.solution, self.robot.reach(), self.robot.tool());
        let tooled = (&solution.robot, &tool);
        let there = Throughout::of(tooled, &self.poses.inside)?;
        let edge = (&reach, &self.poses.edge[..]);
        let expected = ExpectedError::over(&there, tooled, covariance, edge, |_| true)?;
        let of = if solution.is_absolute() {
            &there.absolute
        } else {
            &there.relative
        };
        Some((
            expected,
            Spread::of(of, covariance, solution.estimated_freedom()),
        ))
    }
}

/// The reason to reject a solution.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Objection {
    /// There is no solution.
    Unsolved(Unsolved),
    /// Without a tolerance, a change too large for an error of manufacture, in words.
    Implausible(String),
    /// The calibrated robot does not reproduce the measured points; the median error, mm.
    NotReproduced(f64),
    /// The calibration would make the robot worse, with this probability.
    Worse(f64, Moved),
    /// The error of the result cannot be estimated.
    UnknownError,
    /// Without a stated noise, residuals that the tolerance does not explain; both in mm.
    NoiseBeyondTolerance(f64, f64),
    /// The stated noise of a kind of reading, which is far larger than the noise that the readings show; both in mm.
    NoiseFarOff(Kind, f64, f64),
    /// Parameters further from nominal than the tolerance allows.
    BeyondTolerance(PriorTest, String),
}

impl Objection {
    /// Whether wrong rows may be the reason, so that they are worth looking for.
    pub(crate) fn may_be_wrong_rows(&self) -> bool {
        match self {
            Self::Unsolved(Unsolved::Refused(refusal)) => matches!(
                refusal,
                Refusal::ResidualContradictsNoise { .. }
                    | Refusal::FarFromNominal { .. }
                    | Refusal::NotConverged { .. }
                    | Refusal::Undetermined { .. }
                    | Refusal::UndeterminedInstrument(_)
                    | Refusal::ImpossibleGeometry { .. }
                    | Refusal::ImpossibleRobot(_)
                    | Refusal::NonFinite { .. }
                    | Refusal::WrongSide
            ),
            Self::Unsolved(Unsolved::TooManySuspected(..)) => true,
            Self::Unsolved(_) | Self::UnknownError | Self::Worse(..) | Self::NoiseFarOff(..) => {
                false
            }
            _ => true,
        }
    }
}

/// Solves and judges. A stated tolerance that the robot contradicts is widened if the samples determine all parameters.
///
/// `found`: what explains the readings beside the robot.
pub(crate) fn attempt(case: &Case<'_>, found: Option<&Found>) -> Result<Judged, Objection> {
    match judge(case, found) {
        Err(
            objection @ (Objection::BeyondTolerance(..)
            | Objection::Unsolved(Unsolved::Refused(Refusal::FarFromNominal { .. }))),
        ) => with_wider_tolerance(case, found).ok_or(objection),
        result => result,
    }
}

/// `None` if the samples alone do not determine a robot that could be this one, or if it does not contradict the
/// tolerance.
fn with_wider_tolerance(case: &Case<'_>, found: Option<&Found>) -> Option<Judged> {
    let tolerance = case.robot.tolerance.as_ref()?;
    let free_file = case.robot.with_tolerance(None);
    let free = solve(&free_file, case.readings, &case.options).ok()?;
    // Larger differences mean wrong samples, not another robot.
    if credibility::is_another_robot(&case.robot.robot, &free.robot) {
        return None;
    }
    let test = PriorTest::of(&case.robot.robot, tolerance, &free)?;
    if !(test.contradicts() && test.combinations >= test.of) {
        return None;
    }
    let wide_file = case.robot.with_tolerance(test.widened(tolerance));
    let wide = Case {
        robot: &wide_file,
        ..*case
    };
    let mut judged = judge(&wide, found).ok()?;
    judged.tolerance = Some(ToleranceTest {
        test,
        widened: true,
    });
    Some(judged)
}

fn judge(case: &Case<'_>, found: Option<&Found>) -> Result<Judged, Objection> {
    let robot = case.robot;
    let solution = solve(robot, case.readings, &case.options).map_err(Objection::Unsolved)?;
    let mut noise: Vec<_> = solution.noise.iter().filter_map(NoiseTest::of).collect();
    for test in &mut noise {
        with_shown(case, test)?;
    }
    let reach = robot.reach();
    let poses = WorkspacePoses::of(&solution.robot, &reach);
    let tooled = (&solution.robot, &robot.tool());
    let weights = weights(tooled, &poses.inside, !solution.is_of_parameters());
    let causes = found.map_or_else(Causes::default, |found| {
        Causes::of(case, found, &solution, &poses.inside)
    });
    let by_noise = noise
        .iter()
        .map(|test| test.widening(!causes.found.is_empty()))
        .fold(1.0, f64::max);
    let widening = by_noise.hypot(by_causes(&solution, &causes, weights.as_ref()));
    // Another size than the tolerance allows is none because it is in doubt.
    let mut all = causes.found.iter();
    let is_sized = all.any(|own| own.kind == EffectKind::Size);
    let narrow = is_sized.then(|| solution.clone().widened(by_noise));
    let solution = solution.widened(widening);
    let solution = displaced(robot, solution, &causes);
    let errors = errors(case, &solution);
    let tolerance = robot.tolerance.as_ref();
    let tested = narrow.as_ref().unwrap_or(&solution);
    let prior_test = tolerance.and_then(|own| PriorTest::of(&robot.robot, own, tested));
    let error = errors.map(|own| own.after);
    contradiction(case, &solution, error, prior_test, &noise)?;
    let before = &case.before.robot;
    let positions = case.readings.holds(Kind::Position);
    let mut workspace = weights.as_ref().and_then(|weights| {
        WorkspaceComparison::of(before, &solution, tolerance, &poses.inside, weights)
    });
    if let Some(own) = &mut workspace {
        if case.options.of_printer {
            own.chance_of_harm = None;
        } else if own.is_harmful(tolerance.is_some())
            && let chance = own.chance_of_harm.unwrap_or(1.0)
            && !(before.drive() == Drive::Linear && !positions && chance < MORE_LIKELY)
        {
            return Err(Objection::Worse(chance, own.judged));
        } else if own.chance_of_harm.is_none() && !own.unchanged() {
            return Err(Objection::UnknownError);
        }
    }
    Ok(Judged {
        robot: robot.clone(),
        solution,
        poses,
        weights,
        widening,
        noise,
        causes,
        tolerance: prior_test.map(|test| ToleranceTest {
            test,
            widened: false,
        }),
        workspace,
        explained: None,
        errors,
    })
}

/// The error of relative positions due to the causes, in the readings' part of σ of these.
fn by_causes(solution: &Solution, causes: &Causes, weights: Option<&Weights>) -> f64 {
    if causes.found.is_empty() {
        return 0.0;
    }
    weights.map_or(0.0, |[_, relative]| {
        let covariance = solution.robots(&solution.of_readings);
        causes.relative_error / relative.component_mul(&covariance).sum().sqrt()
    })
}

/// Part of a parameter's weight that keeps those apart which move positions alike.
const RIDGE: f64 = 1e-9;

/// With the error that the causes make of the robot's place: of the parameters e that make it, Σ|J e − error|² → min.
fn displaced(robot: &RobotFile, mut solution: Solution, causes: &Causes) -> Solution {
    if causes.of_base.is_empty() {
        return solution;
    }
    let tool = robot.tool();
    let mut normal = DMatrix::zeros(OF_ROBOT, OF_ROBOT);
    let mut right = DVector::zeros(OF_ROBOT);
    for (pose, error) in &causes.of_base {
        let own = jacobian::<OF_ROBOT>(&solution.robot, &tool, &pose.position, &pose.joints);
        if let Some(own) = own {
            let own = DMatrix::from_column_slice(3, OF_ROBOT, own.as_slice());
            normal += own.tr_mul(&own);
            right += own.tr_mul(&DVector::from_column_slice(error.as_slice()));
        }
    }
    for place in 0..OF_ROBOT {
        normal[(place, place)] += RIDGE * normal[(place, place)] + f64::MIN_POSITIVE;
    }
    let Some(normal) = normal.cholesky() else {
        return solution;
    };
    let moved = normal.solve(&right);
    let mut error = DVector::zeros(solution.covariance.nrows());
    for (place, moved) in solution.robot_places().into_iter().zip(&moved) {
        if let Some(place) = place {
            error[place] = *moved;
        }
    }
    let of_causes = &error * error.transpose();
    solution.covariance += &of_causes;
    solution.of_causes = Some(of_causes);
    solution
}

/// Whether the residuals contradict a stated noise.
pub(crate) fn is_understated(solution: &Solution) -> bool {
    let mut tests = solution.noise.iter().filter_map(NoiseTest::of);
    tests.any(|test| test.verdict == NoiseVerdict::Understated)
}

/// An overstated noise keeps the robot near its start and so enlarges the residuals: replaces the σ that these show by
/// the one estimated without it.
///
/// # Errors
/// The stated noise is far larger than that.
fn with_shown(case: &Case<'_>, test: &mut NoiseTest) -> Result<(), Objection> {
    let overstated = test.verdict == NoiseVerdict::Overstated;
    let Some(stated) = test.stated_mm.filter(|_| overstated) else {
        return Ok(());
    };
    let mut free = case.robot.clone();
    match test.kind {
        Kind::Position => (free.noise, free.instruments.joint_noise) = (None, None),
        Kind::Height => free.instruments.height_noise = None,
        Kind::Distance => free.instruments.distance_noise = None,
    }
    let mut even = case.readings.clone();
    even.rows.iter_mut().for_each(|row| row.value.sigma = None);
    let solution = solve(&free, &even, &case.options);
    let Ok(solution) = solution else {
        return Ok(());
    };
    let mut noise = solution.noise.iter().filter_map(NoiseTest::of);
    let Some(own) = noise.find(|own| own.kind == test.kind) else {
        return Ok(());
    };
    let shown = own.sigma_mm;
    let [arm, ..] = case.robot.robot.arms();
    // Computed rows show no noise at all.
    if shown > COMPUTED * arm.lb() && shown < FAR_OFF * stated {
        return Err(Objection::NoiseFarOff(test.kind, stated, shown));
    }
    (test.sigma_mm, test.limits_mm) = (shown, own.limits_mm);
    let joints = case.robot.noise.is_some_and(|own| own.joint() > 0.0);
    if test.kind == Kind::Position && joints && shown > SMALL * stated {
        test.joint_shown = Some(solution.levels.position.joint());
    }
    Ok(())
}

/// Contradictions between readings, robot and result.
fn contradiction(
    case: &Case<'_>,
    solution: &Solution,
    error: Option<PositionError>,
    prior_test: Option<PriorTest>,
    noise: &[NoiseTest],
) -> Result<(), Objection> {
    let robot = case.robot;
    // A stated tolerance already keeps undetermined parameters near their start.
    if robot.tolerance.is_none() {
        if let Some(change) = credibility::implausible(robot, &solution.robot) {
            return Err(Objection::Implausible(change));
        }
        if solution.degrees_of_freedom() < 1.0 {
            return Err(Objection::UnknownError);
        }
    }
    if let Some(error) = error
        && error.lies_elsewhere(&solution.robot)
    {
        return Err(Objection::NotReproduced(error.median));
    }
    if let (Some(test), Some(tolerance)) = (prior_test, &robot.tolerance)
        && test.contradicts()
        && !(case.options.of_printer && test.ratio < OF_PRINTER)
    {
        let statement = test.statement(robot.robot.drive(), tolerance);
        return Err(Objection::BeyondTolerance(test, statement));
    }
    // Without a stated noise: residuals, taken for noise, that exceed the robot's error within the tolerance. They would
    // keep any robot near its start, whatever the samples are.
    let joints = case.readings.rows.iter().map(|row| row.value.joints);
    let mut noise = noise.iter();
    if let Some(test) = noise.find(|own| own.kind == Kind::Position && own.stated_mm.is_none())
        && let Some(tolerated) = sigma_by_tolerance(case.before, joints)
        && test.limits_mm[0] > tolerated
    {
        return Err(Objection::NoiseBeyondTolerance(test.sigma_mm, tolerated));
    }
    Ok(())
}

/// Distance of a sample with x, y and z from the robot's position.
pub(crate) fn distance(robot: &Robot<f64>, places: &Places, sample: &Sample<f64>) -> Option<f64> {
    let position = robot.forward(&sample.joints).ok()?;
    let seen: Vector3<f64> = places
        .frame
        .map_or(position, |frame| frame.apply(&position));
    Some((sample.position - seen).norm())
}

/// Over the rows with x, y and z; `None` if there are none.
fn errors(case: &Case<'_>, solution: &Solution) -> Option<BeforeAfter> {
    let of = |robot: &Robot<f64>, places: &Places| {
        let rows = solution.readings.rows.iter().zip(&solution.rows);
        let kept = rows.filter(|(_, fit)| !fit.suspected);
        let samples: Vec<_> = kept
            .filter_map(|(row, _)| Some((distance(robot, places, &row.value.sample()?), row.line)))
            .collect();
        (!samples.is_empty()).then(|| PositionError::of(samples))
    };
    Some(BeforeAfter {
        before: of(&case.before.robot, &solution.places_before)?,
        after: of(&solution.robot, &solution.places)?,
    })
}
