#![allow(clippy::cast_precision_loss, clippy::unwrap_used)]

use super::Observed;
use crate::calibration::{Settings, Tolerance};
use crate::observations::{
    Height, Instruments, Observation, ObservationNoise, ObservationProblem, ObservationRow, Plane,
    PositionFrame,
};
use crate::robot::SymmetricRobot;
use crate::robust::Fits;
use crate::samples::Noise;

/// Rows that have as many readings as there are unknowns. Without a tolerance those of the robot are among them, and a
/// row more makes a subset; with one it is as documented: eight rows beside those of the instruments lead near the
/// robot, and measurements decide fourteen of its parameters.
#[test]
fn subsets_have_as_many_readings_as_there_are_unknowns() {
    let robot = SymmetricRobot::PAPER.robot().unwrap();
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[Plane {
            known: None,
            level: None,
        }; 2],
        points: &[],
        noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.02).unwrap(),
        transmission: None,
    };
    for places in [1, 2, 3] {
        let mut rows: [ObservationRow<f64>; 30] = core::array::from_fn(|index| {
            let t = index as f64;
            let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
            let x = robot.forward(&joints).unwrap();
            let height = Height {
                plane: u8::from(index % 2 == 0),
                height: x.z + 560.0,
            };
            ObservationRow::new(Observation {
                position: [
                    Some(x.x),
                    (places > 1).then_some(x.y),
                    (places > 2).then_some(x.z),
                ],
                height: Some(height),
                ..Observation::at(joints)
            })
        });
        let problem = ObservationProblem::<f64, 30>::prepare(&robot, &instruments, &mut rows);
        let problem = problem.unwrap();
        let stated = Settings::new().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
        let (start, prior) = (*problem.start(), problem.prior(&stated));
        let counts = |settings: &Settings<f64>| {
            let mut rows = rows;
            let fits = Observed::<f64, 30, 31, 496> {
                robot: &robot,
                instruments: &instruments,
                settings,
                start,
                prior,
                rows: &mut rows,
                counted: 30,
                readings: 30 * (places + 1),
            };
            (fits.subset(), fits.parameters())
        };
        // Of three unknowns each plane, at so many readings a row.
        let rows_for = |unknowns: usize| unknowns.div_ceil(places + 1);
        assert_eq!(counts(&stated), (8 + rows_for(6), rows_for(14 + 6)));
        assert_eq!(
            counts(&Settings::new()),
            (rows_for(24 + 6) + 1, rows_for(24 + 6))
        );
    }
}
