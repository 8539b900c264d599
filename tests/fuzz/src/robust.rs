//! The robust fit, of samples some of which are wrong.

use crate::numbers::{Bits, Source};
use crate::promises::finite_outcome;
use delta_cal::RobotOutcome;
use delta_cal::robust::{Loss, RobustRefusal, WeighedSample, robust_fit};

/// A fit takes hundreds of times as long as a plain one: few samples.
const MOST_SAMPLES: usize = 20;

/// As in `f32`, so in `f64`, whichever the first byte says.
pub fn robust(data: &[u8]) {
    let mut source = Source::new(data);
    if source.byte() & 1 == 0 {
        fit::<f32>(&mut source);
    } else {
        fit::<f64>(&mut source);
    }
}

fn fit<T: Bits>(source: &mut Source<'_>) {
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
            finite_outcome(&RobotOutcome::from(&outcome.fit));
            let weighed = &work[..samples.len()];
            assert_eq!(
                weighed.iter().filter(|sample| sample.suspected()).count(),
                outcome.suspected
            );
            for sample in weighed {
                let (weight, residual) = (sample.weight(), sample.residual());
                assert!(
                    weight >= T::ZERO && weight <= T::ONE,
                    "{outcome:?} {sample:?}"
                );
                assert!(residual.finite(), "{outcome:?} {sample:?}");
            }
        }
    }
}
