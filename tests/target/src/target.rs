//! The example on the board, in words and in bits.

use core::fmt::{self, Write};
use cortex_m_rt::entry;
use delta_cal::robot::ParameterKind;
use delta_cal::{ArmIndex, Calibrator, Parameter, Refusal, RobotOutcome, Settings};
use delta_cal_target_tests::console::{self, Console};
use delta_cal_target_tests::{Scalar, fixture, noise, nominal, samples};

#[entry]
fn main() -> ! {
    console::run(report)
}

fn report(console: &mut Console) -> fmt::Result {
    calibrate::<f32>(console)?;
    calibrate::<f64>(console)?;
    writeln!(console)?;
    fixture::write(console)
}

/// Everything that a controller has to do.
fn calibrated<T: Scalar>() -> Result<RobotOutcome<T>, Refusal> {
    let settings = Settings::default().with_noise(noise());
    let mut calibrator = Calibrator::new(&nominal(), &settings);
    for sample in &samples() {
        // A faulty sample changes nothing; too few good ones are refused below.
        let _ = calibrator.add(sample);
    }
    calibrator.solve()
}

#[inline(never)]
fn calibrate<T: Scalar>(console: &mut Console) -> fmt::Result {
    writeln!(
        console,
        "\n{}: {} bytes a calibrator",
        T::NAME,
        size_of::<Calibrator<T>>()
    )?;
    let outcome = match calibrated::<T>() {
        Ok(outcome) => outcome,
        Err(refusal) => return writeln!(console, "refused: {refusal}"),
    };
    let before = nominal::<T>();
    for (arm, index) in outcome.arms.iter().zip(ArmIndex::ALL) {
        writeln!(
            console,
            "{index}: {} samples, {} iterations, residual {:.3} sigma, condition {:.0}",
            arm.samples, arm.iterations, arm.residual_rms, arm.condition
        )?;
        for parameter in Parameter::ROTARY {
            let (factor, unit) = match parameter.kind() {
                ParameterKind::Length | ParameterKind::Ratio => (1.0, "mm"),
                ParameterKind::Angle => (1_f64.to_degrees(), "deg"),
            };
            write!(
                console,
                "  {:<5} {:>9.4} -> {:>9.4}",
                parameter.symbol(),
                before.arm(index).get(parameter).to_f64() * factor,
                arm.arm.get(parameter).to_f64() * factor,
            )?;
            if let Some(sigma) = arm.standard_deviation(parameter) {
                write!(console, " +/- {:.4}", sigma.to_f64() * factor)?;
            }
            writeln!(console, " {unit}")?;
        }
    }
    Ok(())
}
