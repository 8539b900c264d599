//! Bytes of state, and of stack over the random calibrations of every kind.

use crate::report::Report;
use core::fmt;
use core::hint::black_box;
use core::mem::MaybeUninit;
use delta_cal::{Calibrator, Progress, Refusal, RobotOutcome, RobotSolver};
use delta_cal_target_tests::cases::Case;
use delta_cal_target_tests::stack_of;

const CASES: u64 = 300;

/// Where firmware keeps its calibration: not on the stack of whoever calls.
struct Statics {
    calibrator: MaybeUninit<Calibrator<f32>>,
    solver: MaybeUninit<Result<RobotSolver<f32>, Refusal>>,
    outcome: MaybeUninit<Result<RobotOutcome<f32>, Refusal>>,
}

#[inline(never)]
pub(crate) fn report(out: &mut Report<'_>) -> fmt::Result {
    let mut size = |item: &str, bytes: usize, words: &str| {
        out.line(format_args!("f32/{item}"), bytes, "bytes", words)
    };
    size(
        "calibrator",
        size_of::<Calibrator<f32>>(),
        "state of a calibrator",
    )?;
    size("solver", size_of::<RobotSolver<f32>>(), "state of a solver")?;
    size("outcome", size_of::<RobotOutcome<f32>>(), "an outcome")?;
    let double = size_of::<Calibrator<f64>>();
    out.line(
        format_args!("f64/calibrator"),
        double,
        "bytes",
        "state of a calibrator",
    )?;
    stack(out)
}

/// The largest of several uses, and the case in which it was.
#[derive(Clone, Copy, Default)]
struct Worst {
    bytes: usize,
    case: u64,
}

impl Worst {
    fn note(&mut self, bytes: usize, case: u64) {
        if bytes > self.bytes {
            *self = Self { bytes, case };
        }
    }
}

/// What is known to take 2 KiB and little more must be seen to.
fn stack_is_measured() -> bool {
    let known = stack_of(&mut || {
        let mut known = [0_u32; 512];
        known.fill(black_box(1));
        black_box(&mut known);
    });
    (2048..2300).contains(&known)
}

#[inline(never)]
fn stack(out: &mut Report<'_>) -> fmt::Result {
    if !stack_is_measured() {
        writeln!(out.console, "The stack is not measured right.")?;
        return Err(fmt::Error);
    }
    let mut statics = Statics {
        calibrator: MaybeUninit::uninit(),
        solver: MaybeUninit::uninit(),
        outcome: MaybeUninit::uninit(),
    };
    let [mut new, mut add, mut start, mut step, mut outcome] = [Worst::default(); 5];
    let mut on_stack = Worst::default();
    for seed in 0..CASES {
        let case = Case::<f32>::draw(seed);
        let mut parts = parts(&mut statics, &case);
        for (worst, bytes) in [&mut new, &mut add, &mut start, &mut step, &mut outcome]
            .into_iter()
            .zip(&mut parts)
        {
            worst.note(*bytes, seed);
        }
        let mut all = || calibrate_on_stack(&case);
        on_stack.note(stack_of(&mut all), seed);
    }
    let mut total = Worst::default();
    for (part, item, words) in [
        (new, "new", "of Calibrator::new"),
        (add, "add", "of Calibrator::add"),
        (start, "start", "of RobotSolver::new"),
        (step, "step", "of RobotSolver::step"),
        (outcome, "outcome", "of RobotSolver::outcome"),
    ] {
        total.note(part.bytes, part.case);
        out.line(format_args!("f32/stack-{item}"), part.bytes, "bytes", words)?;
    }
    out.line(
        format_args!("f32/stack"),
        total.bytes,
        "bytes",
        "stack of a calibration, calibrator, solver and outcome in statics",
    )?;
    out.line(
        format_args!("f32/stack-all"),
        on_stack.bytes,
        "bytes",
        "stack of a calibration, everything on the stack",
    )?;
    writeln!(
        out.console,
        "deepest stack in case {} (statics), {} (all on the stack)",
        total.case, on_stack.case
    )
}

/// Stack of each call, with what lasts in statics.
fn parts(statics: &mut Statics, case: &Case<f32>) -> [usize; 5] {
    let Statics {
        calibrator,
        solver,
        outcome,
    } = statics;
    let new = stack_of(&mut || create(calibrator, case));
    // Exists already; the same again, for a reference.
    let calibrator = calibrator.write(Calibrator::new(&case.nominal, &case.settings));
    let add = stack_of(&mut || add_all(calibrator, case));
    let start = stack_of(&mut || begin(solver, calibrator));
    let solver = solver.write(RobotSolver::new(calibrator));
    let Ok(solver) = solver else {
        return [new, add, start, 0, 0];
    };
    let step = stack_of(&mut || work(solver, calibrator));
    let outcome = stack_of(&mut || finish(outcome, solver));
    [new, add, start, step, outcome]
}

#[inline(never)]
fn create(place: &mut MaybeUninit<Calibrator<f32>>, case: &Case<f32>) {
    black_box(place.write(Calibrator::new(
        black_box(&case.nominal),
        black_box(&case.settings),
    )));
}

#[inline(never)]
fn add_all(calibrator: &mut Calibrator<f32>, case: &Case<f32>) {
    for sample in &case.samples {
        let _ = black_box(calibrator.add(black_box(sample)));
    }
}

#[inline(never)]
fn begin(
    place: &mut MaybeUninit<Result<RobotSolver<f32>, Refusal>>,
    calibrator: &mut Calibrator<f32>,
) {
    let _ = black_box(place.write(RobotSolver::new(black_box(calibrator))));
}

#[inline(never)]
fn work(solver: &mut RobotSolver<f32>, calibrator: &Calibrator<f32>) {
    while black_box(solver.step(black_box(calibrator))) == Ok(Progress::Working) {}
}

#[inline(never)]
fn finish(place: &mut MaybeUninit<Result<RobotOutcome<f32>, Refusal>>, solver: &RobotSolver<f32>) {
    let _ = black_box(place.write(black_box(solver).outcome()));
}

#[inline(never)]
fn calibrate_on_stack(case: &Case<f32>) {
    let mut calibrator = Calibrator::new(black_box(&case.nominal), black_box(&case.settings));
    for sample in &case.samples {
        let _ = black_box(calibrator.add(black_box(sample)));
    }
    let _ = black_box(calibrator.solve());
}
