//! Effectors that tilt, because the two rods of a tower differ, with a probe beside the nozzle.

use crate::import::beds::{self, Told};
use crate::import::campaign::{Made, drawn, normal, set, spread};
use crate::import::fixtures::{Printer, folder};
use crate::support::Folder;
use delta_cal_host::geometry::Parallelograms;
use delta_cal_host::import::Firmware;
use delta_cal_tests::{generator, size};
use delta_cal_verify::check_figures;
use rand_pcg::Pcg32;
use std::fmt::Write;

/// The probe beside the nozzle, mm.
const BESIDE: [f64; 2] = [25.0, 0.0];
/// Between the two rods of a tower, mm: then a probe is biased by 0.07 mm rms over the bed.
const SPACING: f64 = 36.0;
/// σ of a touch and of a paper, mm.
const TOUCH: f64 = 0.01;

/// Rods that differ by this, and are further apart at one end by that, mm.
fn rods(differences: [[f64; 2]; 3]) -> Parallelograms {
    Parallelograms {
        spacing: SPACING,
        platform_radius: 33.0,
        numbers: differences.map(|[length, apart]| [length, apart, 0.0, 0.0]),
        tolerance: [0.1, 0.0],
    }
}

/// A printer with a flat bed, as its firmware has it, and what it answers.
struct Touched<'a> {
    made: &'a Made,
    noise: &'a [f64],
    /// The probe beside the nozzle.
    beside: [f64; 2],
}

impl Touched<'_> {
    fn touch(&self, at: [f64; 2], beside: [f64; 2]) -> f64 {
        Told::level(drawn()).touch(self.made, at, beside)
    }

    /// Of 16 places, nozzle and probe over the bed.
    fn console(&self) -> String {
        let mut text = String::new();
        for ([x, y], noise) in spread(16).into_iter().zip(self.noise) {
            let [x, y] = [
                0.85 * x - 0.15 * self.beside[0],
                0.85 * y - 0.15 * self.beside[1],
            ];
            let z = self.touch([x, y], self.beside) + noise;
            writeln!(text, "// probe at {x:.3},{y:.3} is z={z:.6}").unwrap();
        }
        text
    }

    /// Of 7 places, with paper 0.1 mm thick.
    fn papers(&self) -> String {
        let mut text = "x_mm,y_mm,paper_mm\n".to_owned();
        for ([x, y], noise) in spread(7).into_iter().zip(&self.noise[16..]) {
            let [x, y] = [0.85 * x, 0.85 * y];
            let z = self.touch([x, y], [0.0; 2]) + 0.1 + noise;
            writeln!(text, "{x:.3},{y:.3},{z:.4}").unwrap();
        }
        text
    }
}

/// `printer.cfg` with the probe this far beside the nozzle.
fn configuration([x, y]: [f64; 2]) -> String {
    let own = Printer::unmeasured(drawn());
    format!(
        "# delta-cal: rods {SPACING} mm apart\n[probe]\nx_offset: {x}\ny_offset: {y}\n{}",
        own.configuration()
    )
}

/// How flat a printer prints, and what is stated of it, with its probe this far beside the nozzle.
fn flat(made: &Made, beside: [f64; 2], samples: &[(&str, String)]) -> [f64; 2] {
    let configuration = configuration(beside);
    beds::flat(
        (Firmware::Klipper, &configuration),
        samples,
        (made, &Told::level(drawn())),
    )
}

/// Pairs of rods that differ by 0.1 mm. With 16 touches and 7 papers the bed is nearly as flat as that of a printer that does
/// not tilt, and what is stated is true, of 16 touches alone as well.
#[test]
fn touches_and_papers_separate_the_tilt() {
    let printers = size(8_u32, 100);
    let mut squares = [[0.0; 2]; 4];
    let mut bias = 0.0;
    for index in 0..printers {
        let mut rng = generator(5500, u64::from(index));
        let mut level = Made::new(&set("A1"), &mut rng);
        level.bed = [0.0; 6];
        let mut made = level.clone();
        made.rods = Some(rods([0; 3].map(|_| [0; 2].map(|_| 0.1 * normal(&mut rng)))));
        let noise: Vec<_> = (0..23).map(|_| TOUCH * normal(&mut rng)).collect();
        let [tilts, level_touched] =
            [(&made, BESIDE), (&level, [0.0; 2])].map(|(made, beside)| Touched {
                made,
                noise: &noise,
                beside,
            });
        let console = |own: &Touched<'_>| ("console.txt", own.console());
        let papers = |own: &Touched<'_>| ("papers.csv", own.papers());
        let found = [
            flat(
                &level,
                [0.0; 2],
                &[console(&level_touched), papers(&level_touched)],
            ),
            flat(&made, BESIDE, &[console(&tilts), papers(&tilts)]),
            flat(&made, BESIDE, &[console(&tilts)]),
            // As if the probe were below the nozzle.
            flat(&made, [0.0; 2], &[console(&tilts)]),
        ];
        for (sums, own) in squares.iter_mut().zip(found) {
            for (sum, own) in sums.iter_mut().zip(own) {
                *sum += own * own / f64::from(printers);
            }
        }
        bias += spread(100)
            .into_iter()
            .map(|[x, y]| {
                let steps = drawn().steps([x, y, 0.0]);
                let [probe, nozzle] = [BESIDE, [0.0; 2]].map(|own| made.at(steps, own));
                (probe.z - nozzle.z).powi(2) / (100.0 * f64::from(printers))
            })
            .sum::<f64>();
    }
    let rms = squares.map(|own| own.map(f64::sqrt));
    println!(
        "bias {:.3}, level, papers, touches, ignored: {rms:.4?}",
        bias.sqrt()
    );
    let [level, papers, touches, _] = rms;
    assert!(papers[0] < 1.3 * level[0], "{rms:?}");
    for [is, stated] in [papers, touches] {
        assert!((0.8..1.25).contains(&(is / stated)), "{rms:?}");
    }
    // The rms over eight printers is uncertain by a tenth, over a hundred by a thirtieth.
    let part = size(0.3, 0.1);
    let figures = [
        ("tilt/bias", bias.sqrt()),
        ("tilt/papers", papers[0] / level[0]),
        ("tilt/touches", touches[0] / level[0]),
    ];
    let figures = figures.map(|(name, own)| (name, own, part * own));
    check_figures("docs/printers.md", &figures);
}

/// The configuration of a printer with the probe beside the nozzle, its touches and papers.
fn touched(made: &Made, rng: &mut Pcg32) -> Folder {
    let noise: Vec<_> = (0..23).map(|_| TOUCH * normal(rng)).collect();
    let (noise, beside) = (noise.as_slice(), BESIDE);
    let own = Touched {
        made,
        noise,
        beside,
    };
    let folder = folder(&configuration(beside));
    folder.write("console.txt", own.console());
    folder.write("papers.csv", own.papers());
    folder
}

/// A pair that differs by much is named, alone or among those that explain the touches as well, with the side to which the
/// effector is lower; of a level effector none is. The probe's bias is mapped.
#[test]
fn the_pair_of_rods_that_tilts_the_effector_is_named() {
    for (pair, difference, seed) in [
        (0, 0.6, 1),
        (1, 0.6, 1),
        (2, 0.6, 1),
        (2, 0.6, 3),
        (0, 0.0, 1),
    ] {
        let mut rng = generator(5501, seed);
        let mut made = Made::new(&set("A1"), &mut rng);
        made.bed = [0.0; 6];
        let mut differences = [[0.0; 2]; 3];
        differences[pair][0] = difference;
        made.rods = Some(rods(differences));
        let folder = touched(&made, &mut rng);
        let run = "calibrate printer.cfg console.txt papers.csv --json r.json --report r.html";
        let text = folder.run(run).ok().stdout.replace('\n', " ");
        assert!(folder.read("r.html").contains("The bias of the probe"));
        let json: serde_json::Value = serde_json::from_str(&folder.read("r.json")).unwrap();
        let effector = &json["printer"]["effector"];
        let named: Vec<_> = effector["rods"].as_array().unwrap().iter().collect();
        if difference == 0.0 {
            assert!(named.is_empty(), "{effector}");
            let [bias, sigma] = ["probe_bias_rms_mm", "probe_bias_sigma_mm"]
                .map(|own| effector[own].as_f64().unwrap());
            assert!(bias < 2.0 * sigma, "{effector}");
            continue;
        }
        let towers = [("A", 210.0), ("B", 330.0), ("C", 90.0)];
        let first = named[0]["tower"].as_str().unwrap();
        let others = named[0]["or_towers"].as_array().unwrap().iter();
        let all: Vec<_> = std::iter::once(first)
            .chain(others.map(|own| own.as_str().unwrap()))
            .collect();
        let (tower, _) = towers[pair];
        assert!(named.len() == 1 && all.contains(&tower), "{effector}");
        let differ = format!("the two rods of tower {} differ", all.join(" or "));
        assert!(text.contains(&differ), "{differ}\n{text}");
        let [is, sigma] = ["difference_mm", "sigma_mm"].map(|own| named[0][own].as_f64().unwrap());
        if all.len() > 1 {
            continue;
        }
        assert!((is - difference).abs() < 3.0 * sigma, "{effector}");
        // The point of the effector that is lowest at the centre.
        let steps = drawn().steps([0.0; 3]);
        let height = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            made.at(steps, [10.0 * cosine, 10.0 * sine]).z
        };
        let heights = towers.map(|(name, degrees)| (name, height(degrees)));
        let (lower, _) = heights
            .into_iter()
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap();
        let lower = format!("The effector tilts towards tower {lower} by");
        assert!(text.contains(&lower), "{lower}\n{text}");
    }
}

/// Level effectors above uneven beds, touched with the probe alone.
#[test]
fn no_rods_of_a_level_effector_are_named() {
    let printers = size(20, 200);
    let named = (0..printers).filter(|index| {
        let mut rng = generator(5502, *index);
        let made = Made::new(&set("A1"), &mut rng);
        let run = touched(&made, &mut rng).run("calibrate printer.cfg console.txt");
        let said = run.ok().stdout;
        said.contains("The effector tilts") || said.contains("parallelogram_mm")
    });
    let named = named.count() as u64;
    eprintln!("{named} of {printers} level effectors named");
    assert!(20 * named <= printers, "{named} of {printers}");
}
