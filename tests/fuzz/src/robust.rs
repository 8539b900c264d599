//! The robust fit, of samples some of which are wrong.

use crate::numbers::{Bits, Source};
use crate::promises::finite_outcome;
use delta_cal::classical::StoredCalibrator;
use delta_cal::robust::{Loss, RobustRefusal, WeighedSample, robust_fit};

/// A fit takes hundreds of times as long as a plain one: few samples.
const MOST_SAMPLES: usize = 20;

/// As in `f32`, so in `f64`, whichever the first byte says.
pub fn robust(data: &[u8]) {
    let mut source = Source::new(data);
    let kind = source.byte();
    if kind & 1 == 0 {
        fit::<f32>(&mut source, kind);
    } else {
        fit::<f64>(&mut source, kind);
    }
}

fn fit<T: Bits>(source: &mut Source<'_>, kind: u8) {
    let Ok(robot) = source.robot::<T>() else {
        return;
    };
    let settings = source.settings();
    let loss = [Loss::Huber, Loss::Tukey][source.below(2)];
    let room = source.below(2 * MOST_SAMPLES);
    let samples = source.samples::<T>(MOST_SAMPLES);
    let mut work = vec![WeighedSample::vacant(); MOST_SAMPLES.min(room + MOST_SAMPLES / 2)];
    let fitted = robust_fit(&robot, &settings, &samples, loss, &mut work);
    match &fitted {
        Err(refusal) => {
            assert!(!refusal.to_string().is_empty());
            if let RobustRefusal::Sample(index, _) = refusal {
                assert!(*index < samples.len());
            }
        }
        Ok(outcome) => {
            finite_outcome(&outcome.fit);
            let weighed = &work[..samples.len()];
            assert_eq!(
                weighed.iter().filter(|sample| sample.suspected()).count(),
                outcome.suspected
            );
            for sample in weighed {
                let (weight, (_, residual)) = (sample.weight(), sample.residual());
                assert!(
                    weight >= T::ZERO && weight <= T::ONE,
                    "{outcome:?} {sample:?}"
                );
                assert!(residual.finite(), "{outcome:?} {sample:?}");
            }
        }
    }

    if kind & 0x0e != 0 {
        return;
    }
    let mut stored = StoredCalibrator::<T, MOST_SAMPLES>::new(&robot, &settings);
    if samples.iter().all(|sample| stored.add(sample).is_ok()) {
        let again = stored.solve_robust(loss, &mut work);
        assert_eq!(again.is_ok(), fitted.is_ok());
    }
}
