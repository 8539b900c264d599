//! Effectors that tilt, because the two rods of a tower differ, with a probe beside the nozzle.

use crate::export::klipper::Delta;
use crate::import::beds::Told;
use crate::import::campaign::{
    HEIGHT, Made, OF_PRINTER, RADIUS, STEPS, drawn, normal, prints, set, spread,
};
use crate::import::fixtures::Printer;
use delta_cal_host::geometry::Parallelograms;
use delta_cal_host::import::{Firmware, Stated};
use delta_cal_host::report::printer::PrinterReport;
use delta_cal_host::{InputText, calibrate, printer};
use delta_cal_tests::{generator, size};
use std::fmt::Write;

/// Rods 50 mm apart that differ, and are further apart at one end, by 0.1 mm.
fn rods(rng: &mut rand_pcg::Pcg32) -> Parallelograms {
    Parallelograms {
        spacing: 50.0,
        platform_radius: 33.0,
        numbers: [0; 3].map(|_| [0.1 * normal(rng), 0.1 * normal(rng), 0.0, 0.0]),
        tolerance: [0.1, 0.0],
    }
}

fn told() -> Told {
    Told {
        own: drawn(),
        tilt: [0.0; 2],
    }
}

/// `printer.cfg` with a probe this far beside the nozzle in x.
fn configuration(beside: f64) -> String {
    let own = Printer {
        number: String::new(),
        klipper: told().own,
        rows: Vec::new(),
    };
    format!(
        "[probe]\nx_offset: {beside}\ny_offset: 0\n{}",
        own.configuration()
    )
}

/// The report of a configuration with what was touched.
fn report(configuration: &str, samples: &[(&str, &str)]) -> PrinterReport {
    let text = |(name, own): &(&str, &str)| InputText::new(*name, *own);
    let samples: Vec<_> = samples.iter().map(text).collect();
    let config = text(&("printer.cfg", configuration));
    let none = |_: &str, _: &str| Ok(Vec::new());
    let stated = Stated::default();
    let read = printer::read(Firmware::Klipper, &config, &samples, &stated, &none, &OF_PRINTER);
    let own = read.unwrap();
    let calibrated = calibrate(&own.robot, &own.readings, &OF_PRINTER).unwrap();
    PrinterReport::of(&own, calibrated).unwrap()
}

/// How flat a printer prints with the lines, or with the configuration without any, and what is stated of it.
fn flat(report: &PrinterReport, made: &Made) -> [f64; 2] {
    let own = &report.printer;
    let (pasted, stated) = match &own.lines {
        Some(lines) => (Delta::pasted(lines, STEPS), &own.after),
        None => (drawn(), &own.before),
    };
    [prints(made, &pasted)[HEIGHT], stated.as_ref().unwrap().height]
}

const BESIDE: f64 = 25.0;

/// 16 touches 25 mm beside the nozzle and 7 papers, of printers that tilt.
#[test]
fn touches_and_papers_separate_the_tilt() {
    let set = set("A1");
    let printers = size(8_u32, 100);
    let mut squares = [[0.0; 2]; 4];
    let mut bias=[0.0;2];
    for index in 0..printers {
        let mut rng = generator(5500, u64::from(index));
        let mut made = Made::new(&set, &mut rng);
        if std::env::var("FLAT").is_ok() { made.bed = [0.0; 6]; }
        let level = made.clone();
        made.rods = Some(rods(&mut rng));
        let noise: Vec<_> = (0..23).map(|_| 0.01 * normal(&mut rng)).collect();
        let places = spread(16);
        let touched = |made: &Made, beside: f64| {
            let mut text = String::new();
            for ([x, y], noise) in places.iter().zip(&noise) {
                let at = [0.85 * x - 0.15 * beside, 0.85 * y];
                let z = told().touch(made, at, [beside, 0.0]) + noise;
                writeln!(text, "// probe at {:.3},{:.3} is z={z:.6}", at[0], at[1]).unwrap();
            }
            text
        };
        let papers = |made: &Made| {
            let mut text = "x_mm,y_mm,paper_mm\n".to_owned();
            for ([x, y], noise) in spread(7).into_iter().zip(&noise[16..]) {
                let at = [0.85 * x, 0.85 * y];
                let z = told().touch(made, at, [0.0; 2]) + 0.1 + noise;
                writeln!(text, "{:.3},{:.3},{z:.4}", at[0], at[1]).unwrap();
            }
            text
        };
        let [beside, below] = [BESIDE, 0.0].map(configuration);
        let console = touched(&made, BESIDE);
        let cases = [
            (&made, report(&beside, &[("console.txt", &console), ("papers.csv", &papers(&made))])),
            (&made, report(&beside, &[("console.txt", &console)])),
            (&made, report(&below, &[("console.txt", &console)])),
            (&level, report(&below, &[("console.txt", &touched(&level, 0.0)), ("papers.csv", &papers(&level))])),
        ];
        let all: Vec<f64> = spread(100).into_iter().map(|[x,y]| { let s = drawn().steps([x,y,0.0]); made.at(s,[BESIDE,0.0]).z - made.at(s,[0.0;2]).z}).collect();
        let mean = all.iter().sum::<f64>()/100.0;
        bias[0] += all.iter().map(|o| o*o/100.0).sum::<f64>();
        bias[1] += all.iter().map(|o| (o-mean).powi(2)/100.0).sum::<f64>();
        for ((made, report), sums) in cases.iter().zip(&mut squares) {
            for (sum, own) in sums.iter_mut().zip(flat(report, made)) {
                *sum += own * own;
            }
        }
        if index == 0 { println!("{}", cases[0].1.to_text()); println!("{}", cases[1].1.to_text()); }
    }
    let count = f64::from(printers);
    let rms = squares.map(|own| own.map(|own| f64::sqrt(own / count)));
    println!("bias {:.4?}, {rms:.4?} {RADIUS}", bias.map(|b| f64::sqrt(b / count)));
}
