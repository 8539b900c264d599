//! What the paper simulated, how its sentences are read, and what it found.

use crate::campaign::{CaseColumns, Plan};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::fit::options::CalibrationMethod;
use std::path::Path;

/// A simulation of the paper, as a campaign.
#[derive(Debug)]
pub struct Experiment {
    /// Its folder, and its name in `results.csv`.
    pub name: &'static str,
    /// What the paper varies.
    pub title: &'static str,
    /// How a sentence of the paper was read that can be read in several ways.
    pub reading: &'static str,
    /// What the paper found.
    pub paper: &'static [PaperValue],
    campaign: &'static str,
}

/// A row of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperValue {
    /// With which method.
    pub method: CalibrationMethod,
    /// Only for this start error; any if not stated.
    pub start_error_mm: Option<f64>,
    /// Only for this number of poses; any if not stated.
    pub poses: Option<usize>,
    /// Gain (4.1).
    pub gain_percent: Option<f64>,
    /// Of one calibration.
    pub seconds: Option<f64>,
    /// What it says in words.
    pub remark: &'static str,
}

impl Experiment {
    /// The campaign.
    ///
    /// # Errors
    /// None, as long as the built-in campaigns are in order, which a test assures.
    pub fn plan(&self) -> Result<Plan, InputError> {
        let name = format!("built-in {}.toml", self.name);
        Plan::read(&InputText::new(&name, self.campaign), Path::new("."))
    }

    /// What the paper found in a case, however that was solved here.
    pub fn paper_value(&self, case: &CaseColumns) -> Option<&'static PaperValue> {
        let method = match case.method {
            "ikm" => CalibrationMethod::Ikm,
            "fkm" => CalibrationMethod::Fkm,
            _ => return None,
        };
        self.paper.iter().find(|value| {
            value.method == method
                && value.poses.is_none_or(|poses| poses == case.poses)
                && value
                    .start_error_mm
                    .is_none_or(|error| error.total_cmp(&case.start_error_mm).is_eq())
        })
    }
}

const fn value(
    method: CalibrationMethod,
    poses: Option<usize>,
    gain_percent: Option<f64>,
    seconds: Option<f64>,
    remark: &'static str,
) -> PaperValue {
    PaperValue {
        method,
        start_error_mm: None,
        poses,
        gain_percent,
        seconds,
        remark,
    }
}

const fn started(start_error_mm: f64, value: PaperValue) -> PaperValue {
    PaperValue {
        start_error_mm: Some(start_error_mm),
        ..value
    }
}

use CalibrationMethod::{Fkm, Ikm};

/// What the paper found for "1 mm and 0.01°", whichever way that is read.
const IKM_ROW: &[PaperValue] = &[
    value(Ikm, Some(8), Some(-6.17), Some(2.578), ""),
    value(Ikm, Some(20), Some(62.54), Some(5.781), ""),
    value(Ikm, Some(40), Some(87.58), Some(8.877), ""),
    value(Ikm, Some(60), Some(86.5), Some(11.907), ""),
];

/// In the order of the paper.
pub static EXPERIMENTS: [Experiment; 9] = [
    Experiment {
        name: "exact",
        title: "Exact measurements, start errors of 1 mm and 1 cm",
        reading: "The paper names the length of the start error only; the angles are off by up to 1° \
                  in both cases. Every parameter of the true robot is drawn evenly within ± the start \
                  error. Poses are drawn in the workspace, for the paper does not list its own. \
                  9 and 20 poses show what eight equations in eight unknowns are worth.",
        paper: &[
            started(1.0, value(Fkm, Some(8), Some(100.0), Some(0.911), "")),
            started(1.0, value(Ikm, Some(8), Some(100.0), Some(2.906), "")),
            started(10.0, value(Fkm, Some(8), None, None, "diverges")),
            started(
                10.0,
                value(Ikm, Some(8), Some(100.0), Some(3.385), "converges"),
            ),
        ],
        campaign: include_str!("../../examples/paper/exact.toml"),
    },
    Experiment {
        name: "fkm-noise",
        title: "FKM method with noise, start error 0.1 mm",
        reading: "Noise of 1 µm on every coordinate and of 0.01° on every joint angle, normal; start \
                  error 0.1 mm and 0.1°.",
        paper: &[
            value(Fkm, Some(8), Some(-38.54), None, ""),
            value(Fkm, Some(20), Some(20.0), Some(4.256), ""),
            value(Fkm, Some(40), Some(38.0), Some(5.247), ""),
            value(Fkm, Some(60), Some(45.38), Some(10.945), ""),
        ],
        campaign: include_str!("../../examples/paper/fkm-noise.toml"),
    },
    Experiment {
        name: "fkm-start-error",
        title: "FKM method with noise, larger start errors",
        reading: "\"Above 0.1 mm\" is read as 0.2 mm/0.2° and 1 mm/1°. The paper does not say with how \
                  many poses; its −260 % is set beside each of them.",
        paper: &[value(Fkm, None, Some(-260.0), Some(30.877), "")],
        campaign: include_str!("../../examples/paper/fkm-start-error.toml"),
    },
    Experiment {
        name: "ikm-small-noise",
        title: "IKM method with little noise, start error 1 cm",
        reading: "σ of 0.001 mm and 0.001°; start error 1 cm and 1°. The paper does not say with how \
                  many poses; its 99.9 % is set beside 60, its largest number.",
        paper: &[value(Ikm, Some(60), Some(99.9), None, "")],
        campaign: include_str!("../../examples/paper/ikm-small-noise.toml"),
    },
    Experiment {
        name: "ikm-start-error",
        title: "IKM method, \"1 mm and 0.01°\" as start error and joint noise",
        reading: "The sentence can be read as the noise or as the start error. Here: a start error of 1 \
                  mm and 1°, and the noise of the FKM case, 1 µm and 0.01°. Plain least squares then \
                  come nearer to the paper's row than in the other reading, so this is taken as its meaning.",
        paper: IKM_ROW,
        campaign: include_str!("../../examples/paper/ikm-start-error.toml"),
    },
    Experiment {
        name: "ikm-noise",
        title: "IKM method, \"1 mm and 0.01°\" as noise",
        reading: "The other reading: 1 mm and 0.01° are the noise of the measurements, and the start \
                  error is 1 cm and 1°, as in the sentence before.",
        paper: IKM_ROW,
        campaign: include_str!("../../examples/paper/ikm-noise.toml"),
    },
    Experiment {
        name: "number-of-poses",
        title: "Gain of the IKM method against the number of poses (Fig. 4)",
        reading: "Start error 0.1 mm and 0.1°. \"σ = 1 µm\" leaves the joints open: they are exact in \
                  one curve and have 0.01°, as in the FKM case, in the other.",
        paper: &[],
        campaign: include_str!("../../examples/paper/number-of-poses.toml"),
    },
    Experiment {
        name: "basins",
        title: "From how far the methods converge",
        reading: "Not in the paper. Exact measurements; the angles of a start error move the elbow as far \
                  as its length does: angle = length/La. A robot counts as returned if its true \
                  parameters are found to 1e-6 mm, not if the iteration merely ends.",
        paper: &[],
        campaign: include_str!("../../examples/paper/basins.toml"),
    },
    Experiment {
        name: "comparison",
        title: "Which method is more accurate",
        reading: "Not in the paper, whose methods saw different noise and start errors. The same robots \
                  and the same measurements for both, with the noise stated and no prior.",
        paper: &[],
        campaign: include_str!("../../examples/paper/comparison.toml"),
    },
];
