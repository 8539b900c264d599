//! What owners of ten printers measured, without one row at a time: how well the others predict it.

use delta_cal::calibration::Settings;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationProblem,
    ObservationRow, Plane, PositionFrame,
};
use delta_cal::robot::SymmetricLinearRobot;
use delta_cal::{Noise, Parameter, Refusal, Robot, Tolerance};
use nalgebra::{DMatrix, DVector};

const N: usize = 27;
/// One σ of a height and of a distance, mm: what a probe and a calliper on a printed object are good for.
const NOISE: [f64; 2] = [0.1, 0.2];

/// Each printer's number and the length of its rods as they are sold, mm.
const PRINTERS: [(&str, f64); 10] = [
    ("01", 345.0),
    ("03", 345.0),
    ("05", 340.0),
    ("06", 330.0),
    ("07", 217.0),
    ("09", 215.0),
    ("11", 345.0),
    ("13", 345.0),
    ("18", 385.0),
    ("20", 345.0),
];

/// A row of a file.
#[derive(Debug, Clone, Copy)]
struct Measured {
    travels: [f64; 3],
    to: Option<[f64; 3]>,
    value: f64,
}

struct Printer {
    name: &'static str,
    /// As it was sold, with the radius and the towers of its configuration.
    nominal: Robot<f64>,
    radius: f64,
    /// Azimuths of the towers, radians.
    towers: [f64; 3],
    rows: Vec<Measured>,
}

fn numbers(text: &str) -> Vec<f64> {
    let parts = text.split(|c: char| !(c.is_ascii_digit() || ".-".contains(c)));
    parts.filter_map(|part| part.parse().ok()).collect()
}

fn printer((name, rod): (&'static str, f64)) -> Printer {
    let path = format!(
        "{}/data/printers/printer_{name}.csv",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().skip(1);
    let facts = lines.next().unwrap();
    let fact = |key: &str| {
        let (_, rest) = facts.split_once(&format!("{key} = ")).unwrap();
        numbers(rest.split(';').next().unwrap())
    };
    let radius = fact("delta_radius_mm")[0];
    let towers: [f64; 3] = fact("tower_deg").try_into().unwrap();
    let towers = towers.map(f64::to_radians);
    let nominal = SymmetricLinearRobot {
        tower_radius: radius,
        forearm: rod,
    };
    let rows = lines.skip(1).filter(|line| !line.is_empty()).map(|line| {
        let cells: Vec<Option<f64>> = line.split(',').map(|cell| cell.parse().ok()).collect();
        let three = |from: usize| [0, 1, 2].map(|index| cells[from + index].unwrap());
        let height = cells[3];
        Measured {
            travels: three(0),
            to: height.is_none().then(|| three(4)),
            value: height.or(cells.get(7).copied().flatten()).unwrap(),
        }
    });
    Printer {
        name,
        nominal: nominal.robot_at(towers).unwrap(),
        radius,
        towers,
        rows: rows.collect(),
    }
}

/// Height above the plane z = c + a x + b y, or distance.
fn predicted(robot: &Robot<f64>, [c, a, b]: [f64; 3], row: &Measured) -> f64 {
    let x = robot.forward(&row.travels).unwrap();
    match row.to {
        Some(to) => (x - robot.forward(&to).unwrap()).norm(),
        None => (x.z - c - a * x.x - b * x.y) / (1.0 + a * a + b * b).sqrt(),
    }
}

/// Least squares of Klipper's own parameters: radius, two towers' azimuths, three end stops; heights are z. By Gauss
/// and Newton with differences.
fn least_squares(printer: &Printer, rows: &[Measured]) -> Robot<f64> {
    let count = 6;
    let robot = |p: &DVector<f64>| {
        let mut parameters = printer.nominal.parameters();
        for (arm, own) in parameters.iter_mut().enumerate() {
            let azimuth = printer.towers[arm] + if arm < 2 { p[1 + arm] } else { 0.0 };
            let radius = printer.radius + p[0];
            own[0] = radius * azimuth.cos();
            own[1] = radius * azimuth.sin();
            own[Parameter::Zero.index()] += p[3 + arm];
        }
        printer.nominal.with_parameters(parameters).unwrap()
    };
    let residuals = |p: &DVector<f64>| {
        let robot = robot(p);
        DVector::from_iterator(
            rows.len(),
            rows.iter().map(|row| {
                // As the reference weighs them.
                let sigma = if row.to.is_some() { 0.1 } else { 0.02 };
                (row.value - predicted(&robot, [0.0; 3], row)) / sigma
            }),
        )
    };
    let mut p = DVector::zeros(count);
    for _ in 0..100 {
        let here = residuals(&p);
        let mut jacobian = DMatrix::zeros(rows.len(), count);
        for index in 0..count {
            let step = if matches!(index, 1 | 2) { 1e-6 } else { 1e-4 };
            let mut moved = p.clone();
            moved[index] += step;
            jacobian.set_column(index, &((residuals(&moved) - &here) / step));
        }
        // The shortest of the steps that fit alike, angles counted times the radius.
        let scale = DVector::from_fn(count, |index, _| {
            if matches!(index, 1 | 2) {
                1.0 / printer.radius
            } else {
                1.0
            }
        });
        let scaled = &jacobian * DMatrix::from_diagonal(&scale);
        let step = scaled.svd(true, true).solve(&-here, 1e-9).unwrap();
        p += step.component_mul(&scale);
    }
    robot(&p)
}

fn tolerance() -> Tolerance<f64> {
    let own = Tolerance::new(1.0, 3e-3).unwrap();
    own.with_linear(5.0, 1e-3).unwrap()
}

/// The calibration, and the plane; refused measurements come from `printers` alone.
fn calibrated(
    printer: &Printer,
    measured: &[Measured],
    noise: [f64; 2],
    tolerance: &Tolerance<f64>,
) -> Result<(Robot<f64>, [f64; 3]), Refusal> {
    let [height, distance] = noise;
    let planes = [Plane::default()];
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &planes,
        points: &[],
        noise: ObservationNoise::new(Noise::new(1.0, 0.0).unwrap(), height, distance).unwrap(),
        transmission: None,
    };
    let rows = measured.iter().map(|row| {
        let mut own = Observation::at(row.travels);
        match row.to {
            Some(to) => {
                own.distance = Some(Distance {
                    from: DistanceFrom::Pose(to),
                    distance: row.value,
                });
            }
            None => {
                own.height = Some(Height {
                    plane: 0,
                    height: row.value,
                });
            }
        }
        ObservationRow::new(own)
    });
    let mut rows: Vec<_> = rows.collect();
    let problem = ObservationProblem::<f64, N>::prepare(&printer.nominal, &instruments, &mut rows);
    let settings = Settings::new().with_tolerance(*tolerance);
    let outcome = problem.unwrap().solve::<28, 406>(&settings)?;
    Ok((outcome.robot, outcome.plane(&instruments, 0)))
}

/// Sums of squares of the left-out heights' errors, of the basic fit and of the calibration, and how many there are.
fn left_out(printer: &Printer) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for (index, row) in printer.rows.iter().enumerate() {
        if row.to.is_some() {
            continue;
        }
        let mut others = printer.rows.clone();
        others.remove(index);
        let basic = least_squares(printer, &others);
        sums[0] += (predicted(&basic, [0.0; 3], row) - row.value).powi(2);
        let (robot, plane) = calibrated(printer, &others, NOISE, &tolerance()).unwrap();
        sums[1] += (predicted(&robot, plane, row) - row.value).powi(2);
        sums[2] += 1.0;
    }
    sums
}

#[test]
fn the_others_predict_what_was_left_out() {
    let (mut better, mut pooled) = (0, [0.0; 3]);
    for printer in PRINTERS.map(printer) {
        let (robot, _) = calibrated(&printer, &printer.rows, NOISE, &tolerance()).unwrap();
        let rods = |robot: &Robot<f64>| robot.arms().map(|arm| arm.lb());
        let [nominal, ..] = rods(&printer.nominal);
        for rod in rods(&robot) {
            assert!((rod - nominal).abs() < 2.0, "{}: {rod}", printer.name);
        }
        let sums = left_out(&printer);
        better += u32::from(sums[1] < sums[0]);
        for (pooled, own) in pooled.iter_mut().zip(sums) {
            *pooled += own;
        }
        let [basic, found] = [sums[0], sums[1]].map(|sum| (sum / sums[2]).sqrt());
        println!("| {} | {basic:.3} / {found:.3} mm |", printer.name);
    }
    assert!(better >= 8, "{better}");
    assert!(pooled[1] < pooled[0]);
}

/// The same measurements with the rods of another printer of the same maker.
#[test]
fn rods_that_are_not_the_printers_are_refused() {
    let printer = printer(("18", 345.0));
    let refused = calibrated(&printer, &printer.rows, NOISE, &tolerance());
    assert!(
        matches!(
            refused,
            Err(Refusal::FarFromNominal { .. } | Refusal::ResidualContradictsNoise { .. })
        ),
        "{refused:?}"
    );
}
