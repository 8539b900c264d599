//! The functions that several calibrators have, generated for each under its name: `init` is `dcal_ikm_init_f32`,
//! `dcal_joint_init_f32` and so on.

/// What every calibrator has.
macro_rules! calibrator {
    ($family:ident) => {
        /// Writes the number of samples.
        #[unsafe(export_name = family!($family, "samples"))]
        pub extern "C" fn samples(calibrator: Held<Own>, mut samples: Out<u64>) -> Status {
            status_alone(calibrator.get().and_then(|own| samples.put(own.samples())))
        }

        /// Starts solving. Until the last `step`, or until `stop`, every call that would change the samples returns
        /// `DCAL_BUSY`.
        ///
        /// Errors: those of `finish` that are already known, such as `DCAL_TOO_FEW_SAMPLES` with the arm, the number of
        /// samples and the number needed. Behind a gate also `DCAL_ROBOT_HAS_CHANGED`, `DCAL_EARLY_SAMPLES` and
        /// `DCAL_TOO_MANY_REJECTED`; an earlier result is then gone.
        #[unsafe(export_name = family!($family, "solve"))]
        pub extern "C" fn solve(mut calibrator: HeldMut<Own>, error: Out<Error>) -> Status {
            report(error, || Ok(calibrator.get()?.solve()?))
        }

        /// Runs one short step, to be called between the turns of a control loop. Returns `DCAL_WORKING` while there is
        /// more to do, then `DCAL_OK`: `finish` has the result, or says why there is none.
        #[unsafe(export_name = family!($family, "step"))]
        pub extern "C" fn step(mut calibrator: HeldMut<Own>) -> Status {
            match calibrator.get().map(|own| own.step()) {
                Ok(Progress::Working) => status::WORKING,
                Ok(Progress::Finished) => status::OK,
                Err(status) => status,
            }
        }

        /// `DCAL_WORKING` while `step` has work to do, of a gate possibly its own estimate; `DCAL_OK` otherwise.
        #[unsafe(export_name = family!($family, "solving"))]
        pub extern "C" fn solving(calibrator: Held<Own>) -> Status {
            match calibrator.get().map(Own::solving) {
                Ok(true) => status::WORKING,
                Ok(false) => status::OK,
                Err(status) => status,
            }
        }

        /// `DCAL_OK` if a solve has finished and no sample was added since: `finish` then has the result or the refusal.
        /// `DCAL_UNFINISHED` otherwise.
        #[unsafe(export_name = family!($family, "finished"))]
        pub extern "C" fn finished(calibrator: Held<Own>) -> Status {
            match calibrator.get().map(Own::finished) {
                Ok(true) => status::OK,
                Ok(false) => status::UNFINISHED,
                Err(status) => status,
            }
        }

        /// Abandons what `solve` started. The samples stay.
        #[unsafe(export_name = family!($family, "stop"))]
        pub extern "C" fn stop(mut calibrator: HeldMut<Own>) -> Status {
            status_alone(calibrator.get().map(Own::stop))
        }

        /// Discards all samples and what was solved from them: as after `init`.
        #[unsafe(export_name = family!($family, "reset"))]
        pub extern "C" fn reset(mut calibrator: HeldMut<Own>) -> Status {
            status_alone(calibrator.get().map(Own::reset))
        }

        /// Makes the calibrated robot, in `size` bytes of memory: write `sizeof *robot`. `robot` may be the robot in use,
        /// which is then replaced. The result stays in the calibrator until its samples change.
        ///
        /// Errors: `DCAL_UNFINISHED` before the last step, and every refusal (`DCAL_TOO_FEW_SAMPLES` to `DCAL_OVERFLOW`)
        /// with its arm and cause; the robot keeps its parameters.
        #[unsafe(export_name = family!($family, "finish"))]
        pub extern "C" fn finish(
            calibrator: Held<Own>,
            mut robot: New<Robot<Real>>,
            size: usize,
            error: Out<Error>,
        ) -> Status {
            report(error, || {
                robot.usable(size)?;
                let found = calibrator.get()?.outcome()?.robot.clone();
                Ok(robot.put(size, &found)?)
            })
        }

        /// Writes how well an arm is known; `arm` is 0, 1 or 2. If the arms were solved together, residual and noise are
        /// those of the whole robot.
        ///
        /// Errors: `DCAL_NO_SUCH_ARM`, and those of `finish`.
        #[unsafe(export_name = family!($family, "arm"))]
        pub extern "C" fn arm(
            calibrator: Held<Own>,
            arm: i32,
            mut summary: Out<ArmSummary>,
        ) -> Status {
            status_of(|| {
                let outcome = calibrator.get()?.outcome()?;
                let found = ArmSummary::from(&Found::arm(outcome, index_of(arm)?));
                Ok(summary.put(found)?)
            })
        }

        /// Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
        ///
        /// Errors: `DCAL_NO_COVARIANCE`, and those of `finish`.
        #[unsafe(export_name = family!($family, "deviations"))]
        pub extern "C" fn deviations(
            calibrator: Held<Own>,
            mut sigma: Out<[[Real; 8]; 3]>,
        ) -> Status {
            status_of(|| {
                let found = deviations_of(calibrator.get()?.outcome()?)?;
                Ok(sigma.put(found)?)
            })
        }

        /// Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian, radian^2. Arms
        /// that were solved separately have none between them: 0.
        ///
        /// Errors: `DCAL_NO_COVARIANCE`, and those of `finish`.
        #[unsafe(export_name = family!($family, "covariance"))]
        pub extern "C" fn covariance(
            calibrator: Held<Own>,
            mut covariance: Out<[[Real; 24]; 24]>,
        ) -> Status {
            status_of(|| {
                let found = Found::covariance(calibrator.get()?.outcome()?);
                Ok(covariance.put_entries(found.ok_or(status::NO_COVARIANCE)?)?)
            })
        }

        /// Writes the samples into `bytes`, of which there are `capacity`: write the constant
        /// `DCAL_..._SNAPSHOT_..._SIZE`. `length` receives the number written. They are the same on every target. Store
        /// them where they survive a power cut, and give them to `restore`.
        ///
        /// Errors: `DCAL_SNAPSHOT_BUFFER`; nothing is written. Of a gate also `DCAL_BUSY`.
        #[unsafe(export_name = family!($family, "snapshot"))]
        pub extern "C" fn snapshot(
            calibrator: Held<Own>,
            mut bytes: Out<u8>,
            capacity: usize,
            mut length: Out<usize>,
        ) -> Status {
            status_of(|| {
                length.usable()?;
                let needed = Own::SNAPSHOT_BYTES;
                let (own, bytes) = calibrator.beside_bytes(&mut bytes, capacity, needed)?;
                let written = own.snapshot(bytes)?.len();
                Ok(length.put(written)?)
            })
        }

        /// Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and instruments. It then
        /// computes the same bits as the calibrator that the snapshot is of.
        ///
        /// Errors: `DCAL_BUSY`, `DCAL_SNAPSHOT_...`; the calibrator is unchanged.
        #[unsafe(export_name = family!($family, "restore"))]
        pub extern "C" fn restore(
            mut calibrator: HeldMut<Own>,
            bytes: In<u8>,
            length: usize,
        ) -> Status {
            status_of(|| {
                let (calibrator, bytes) = calibrator.beside_bytes(&bytes, length)?;
                Ok(calibrator.restore(bytes)?)
            })
        }
    };
}

/// What the calibrators from complete positions have.
macro_rules! of_positions {
    ($family:ident) => {
        /// Makes a calibrator without samples, in `size` bytes of memory: write `sizeof *calibrator`. `robot` is the
        /// uncalibrated robot, the nominal of the tolerance and the start of the iteration; it is copied.
        ///
        /// Errors: `DCAL_NOISE_...`, `DCAL_TOLERANCE_...`, `DCAL_NO_SUCH_CHOICE`.
        #[unsafe(export_name = family!($family, "init"))]
        pub extern "C" fn init(
            mut calibrator: New<Own>,
            size: usize,
            robot: Held<Robot<Real>>,
            settings: In<Settings>,
            error: Out<Error>,
        ) -> Status {
            report(error, || {
                calibrator.usable(size)?;
                let (robot, settings) = (robot.get()?.clone(), settings.get()?.checked()?);
                calibrator.make(size, |place| Ok(place.write(Own::new(&robot, &settings))))
            })
        }

        /// Adds one sample; memory and time are the same for any number of samples. The result of the last `solve` is
        /// discarded.
        ///
        /// Errors: `DCAL_BUSY`, and `DCAL_SAMPLE_...` with the arm; nothing is added.
        #[unsafe(export_name = family!($family, "add"))]
        pub extern "C" fn add(
            mut calibrator: HeldMut<Own>,
            sample: In<Sample>,
            error: Out<Error>,
        ) -> Status {
            report(error, || {
                let sample = sample.get()?;
                Ok(calibrator.get()?.add(&sample.into())?)
            })
        }

        /// Processes waiting samples: the calibrator takes in several at once. `solve` does the same; call this one turn
        /// of the control loop earlier if `solve` takes too long. The result has the same bits.
        #[unsafe(export_name = family!($family, "flush"))]
        pub extern "C" fn flush(mut calibrator: HeldMut<Own>) -> Status {
            status_alone(calibrator.get().map(Own::flush))
        }

        /// Adds all samples of another calibrator of the same robot and noise.
        ///
        /// Errors: `DCAL_BUSY`, `DCAL_DIFFERENT_NOMINAL`; nothing is added.
        #[unsafe(export_name = family!($family, "merge"))]
        pub extern "C" fn merge(mut calibrator: HeldMut<Own>, other: Held<Own>) -> Status {
            status_of(|| {
                let (calibrator, other) = calibrator.beside(&other)?;
                Ok(calibrator.merge(other)?)
            })
        }

        /// Multiplies the weight of all samples so far by `lambda`, 0 to 1.
        ///
        /// Errors: `DCAL_BUSY`, `DCAL_FORGETTING`.
        #[unsafe(export_name = family!($family, "forget"))]
        pub extern "C" fn forget(mut calibrator: HeldMut<Own>, lambda: Real) -> Status {
            status_of(|| {
                if !(0.0..=1.0).contains(&lambda) {
                    return Err(status::FORGETTING.into());
                }
                Ok(calibrator.get()?.forget(lambda)?)
            })
        }
    };
}

/// What the calibrators have that test each sample before they take it in.
macro_rules! gated {
    ($family:ident) => {
        use super::sample::stated;
        use super::verdict::{GateCounts, Verdict};
        use delta_cal::SettingError;
        use delta_cal::stream::{Forgetting, Selection};

        /// Makes a calibrator with a gate and without samples, in `size` bytes of memory: write `sizeof *calibrator`. `sigmas` is
        /// the width of the gate; 0 selects the width that rejects three good samples in a million for each arm. `age` is the mean
        /// age of the samples that count, for a robot that changes slowly; 0 if all count equally. If noise and tolerance are
        /// stated, the gate tests from the first sample, otherwise from its first estimate.
        ///
        /// Errors: `DCAL_NOISE_...`, `DCAL_TOLERANCE_...`, `DCAL_NO_SUCH_CHOICE`, `DCAL_WIDTH_OF_GATE`, `DCAL_FORGETTING`.
        #[unsafe(export_name = family!($family, "init"))]
        pub extern "C" fn init(
            mut calibrator: New<Own>,
            size: usize,
            robot: Held<Robot<Real>>,
            settings: In<Settings>,
            sigmas: Real,
            age: Real,
            error: Out<Error>,
        ) -> Status {
            report(error, || {
                calibrator.usable(size)?;
                let forgetting = stated(age).map(Forgetting::new).transpose()?;
                let selection = Selection {
                    gated: true,
                    forgetting,
                };
                let (robot, settings) = (robot.get()?.clone(), settings.get()?.checked()?);
                let width = stated(sigmas);
                if width.is_some_and(|sigmas| !(sigmas > 0.0 && sigmas.is_finite())) {
                    return Err(SettingError::GateWidth.into());
                }
                calibrator.make(size, |place| {
                    let made = Own::new_in(place, &robot, &settings, &selection);
                    if let Some(sigmas) = width {
                        made.set_sigmas(sigmas)?;
                    }
                    Ok(made)
                })
            })
        }

        /// Tests one sample, and adds it unless it is rejected. A rejected sample is not an error: `verdict` reports it. If the
        /// gate then needs an estimate of its own, call `step` until it returns `DCAL_OK`, before the next sample.
        ///
        /// Errors: `DCAL_BUSY`, and `DCAL_SAMPLE_...` with the arm; nothing has changed.
        #[unsafe(export_name = family!($family, "add"))]
        pub extern "C" fn add(
            mut calibrator: HeldMut<Own>,
            sample: In<Sample>,
            mut verdict: Out<Verdict>,
            error: Out<Error>,
        ) -> Status {
            report(error, || {
                verdict.usable()?;
                let sample = sample.get()?;
                let found = calibrator.get()?.add(&sample.into())?;
                Ok(verdict.put(found.into())?)
            })
        }

        /// Writes the sample counts and the alarm, if any.
        #[unsafe(export_name = family!($family, "state"))]
        pub extern "C" fn state(calibrator: Held<Own>, mut state: Out<GateCounts>) -> Status {
            status_alone(calibrator.get().and_then(|own| state.put(own.into())))
        }

        /// Answers the alarm and excuses all rejections so far: solving is possible again. Without forgetting the rejected samples
        /// were wrong, and the samples before them stay; if the robot itself has changed, call `reset`. With forgetting an alarm's
        /// answer discards the earlier samples, and the gate begins again, as when new; its counts go on.
        #[unsafe(export_name = family!($family, "acknowledge"))]
        pub extern "C" fn acknowledge(mut calibrator: HeldMut<Own>) -> Status {
            status_alone(calibrator.get().map(Own::acknowledge))
        }
    };
}

/// Calibrators: the module and prefix of each, its kind, and what it has.
macro_rules! families {
    ($($(#[$about:meta])* $family:ident $own:ident: $($part:ident)+;)+) => {$(
        $(#[$about])*
        pub mod $family {
            use super::Real;
            use super::outcome::{ArmSummary, Found, deviations_of, index_of};
            use super::sample::{Sample, Settings};
            use crate::error::{Error, report, status_alone, status_of};
            use crate::memory::{Held, HeldMut, In, New, Out};
            use crate::status::{self, Status};
            use delta_cal::{Progress, Robot};

            /// The calibrator.
            pub type Own = crate::kind::$own<Real>;

            $($part!($family);)+
        }
    )+};
}
