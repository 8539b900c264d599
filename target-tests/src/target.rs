//! The board's side: start, console, faults.

use crate::count::{self, Counter};
use core::fmt::{self, Write};
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};
use delta_cal::{ArmIndex, Calibrator, Parameter, ParameterKind, Refusal, RobotOutcome, Settings};
use delta_cal_target_tests::{Scalar, fixture, noise, nominal, samples};

#[entry]
fn main() -> ! {
    let status = match Console::open().map(|mut console| report(&mut console)) {
        Ok(Ok(())) => EXIT_SUCCESS,
        _ => EXIT_FAILURE,
    };
    exit(status)
}

fn report(console: &mut Console) -> fmt::Result {
    let counter = cortex_m::Peripherals::take().and_then(|board| Counter::start(board.SYST));
    calibrate::<f32>(console)?;
    calibrate::<f64>(console)?;
    match &counter {
        None => writeln!(
            console,
            "\nNo instruction counts: they need -icount shift=0,sleep=off."
        )?,
        Some(counter) => {
            writeln!(
                console,
                "\nInstructions, not cycles: division, square root and flash wait states cost more on silicon."
            )?;
            count::report::<f32>(console, counter)?;
            count::report::<f64>(console, counter)?;
        }
    }
    writeln!(console)?;
    fixture::run::<f32>(console)?;
    fixture::run::<f64>(console)?;
    console.flush()
}

/// Everything that a controller has to do.
fn calibrated<T: Scalar>() -> Result<RobotOutcome<T>, Refusal> {
    let settings = Settings {
        noise: Some(noise()),
        ..Settings::default()
    };
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
        for parameter in Parameter::ALL {
            let (factor, unit) = match parameter.kind() {
                ParameterKind::Length => (1.0, "mm"),
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

/// Collects what is written: each semihosting call stops the processor.
struct Console {
    stream: HostStream,
    buffer: [u8; 1024],
    length: usize,
}

impl Console {
    fn open() -> Result<Self, ()> {
        Ok(Self {
            stream: hio::hstdout()?,
            buffer: [0; 1024],
            length: 0,
        })
    }

    fn flush(&mut self) -> fmt::Result {
        let (full, _) = self.buffer.split_at(self.length);
        self.stream.write_all(full).map_err(|()| fmt::Error)?;
        self.length = 0;
        Ok(())
    }
}

impl Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut rest = text.as_bytes();
        while !rest.is_empty() {
            if self.length == self.buffer.len() {
                self.flush()?;
            }
            let (_, free) = self.buffer.split_at_mut(self.length);
            let (now, later) = rest.split_at(rest.len().min(free.len()));
            free[..now.len()].copy_from_slice(now);
            self.length += now.len();
            rest = later;
        }
        Ok(())
    }
}

#[panic_handler]
fn panicked(info: &PanicInfo<'_>) -> ! {
    fail(format_args!("{info}"))
}

// `cortex-m-rt` requires these two to be `unsafe fn`; neither does anything unsafe.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    fail(format_args!("hard fault: {frame:?}"))
}

#[allow(unsafe_code)]
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    fail(format_args!("exception {number} has no handler"))
}

/// Says why, as far as that still works, and ends with a failure: a fault must not hang the run.
fn fail(why: fmt::Arguments<'_>) -> ! {
    if let Ok(mut stream) = hio::hstdout() {
        let _ = writeln!(stream, "\nFAILED {why}");
    }
    exit(EXIT_FAILURE)
}

fn exit(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}
