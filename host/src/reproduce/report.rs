//! `report.html` of a reproduction: the paper's numbers beside those found here, and what follows.

mod findings;
mod shares;
mod tables;

pub use tables::table;

use super::{NamedFigure, Reproduction, comparisons};
use crate::render::named_figure::shown;
use crate::render::page;
use crate::render::plot::PlotError;
use maud::{Markup, html};

/// The whole report, one file that opens from disk.
///
/// # Errors
/// A figure that cannot be drawn; none is known.
pub fn render(reproduction: &Reproduction, figures: &[NamedFigure]) -> Result<String, PlotError> {
    let title = "Calibration of Delta robots: the paper's simulations, run again";
    let shown = |names: &[&str]| shown(figures, names);
    let comparisons = comparisons(reproduction);
    let body = html! {
        h1 { (title) }
        (introduction(reproduction))
        section {
            h2 { "What was found" }
            ul { @for finding in findings::all(reproduction, &comparisons) { li { (finding) } } }
        }
        section {
            h2 { "The paper's rows and this program's" }
            (tables::rows(&comparisons))
            (shown(&["gain-fkm", "gain-ikm"])?)
        }
        section {
            h2 { "Figs. 2a and 2b: FKM method" }
            (shown(&["fig2a", "fig2b"])?)
        }
        section {
            h2 { "Figs. 3a and 3b: IKM method" }
            (shown(&["fig3a", "fig3b"])?)
            (of_figures())
        }
        section {
            h2 { "Fig. 4: how many poses" }
            (shown(&["fig4", "fig4-exact-joints"])?)
        }
        section {
            h2 { "From how far the methods converge" }
            (shown(&["basins-8", "basins-20", "basins-20-one-start"])?)
            (tables::basins(reproduction.cases("basins")))
        }
        section {
            h2 { "Which method is more accurate, and which is faster" }
            (tables::accuracy(reproduction.cases("comparison")))
            (tables::times(&comparisons))
        }
        section {
            h2 { "The boundary of the workspace" }
            (boundary(reproduction))
            (shown(&["boundary"])?)
            (shown(&["boundary-vertical"])?)
            (shown(&["boundary-influence"])?)
        }
        section {
            h2 { "How the paper was read" }
            @for results in &reproduction.experiments {
                h3 { (results.experiment.title) }
                p { (results.experiment.reading) }
                (tables::cases(results))
            }
        }
        (misprints())
        (repeat())
    };
    Ok(page::render(title, &body))
}

fn introduction(reproduction: &Reproduction) -> Markup {
    let robots = reproduction
        .experiments
        .iter()
        .flat_map(|results| &results.cases)
        .map(|case| case.robots)
        .max()
        .unwrap_or(0);
    html! {
        p {
            "T. Bentaleb and J. Iqbal, \"On the improvement of calibration accuracy of parallel robots – \
            modeling and optimization\", Journal of Theoretical and Applied Mechanics 58(1), 2020, doi "
            "10.15632/jtam-pl/115863. Everything in its section 4 is simulated here with " (robots)
            " random robots a case, where the paper shows one, and "
            (reproduction.calibrations()) " calibrations in all."
        }
        p.origin {
            "All data are simulated. No public data set of a rotary Delta robot with joint angles and \
            externally measured positions is known."
        }
        p {
            "The robot: Ra 194, Rb 30, La 260, Lb 480 mm; joints from −60° to 90°, which the paper does not \
            state. The gain is (4.1), with angles multiplied by the upper arm's length. \"Least squares\" \
            is what the paper describes. \"Noise and tolerance\" is what this program does when both are \
            stated: residuals are weighted by their noise, and the start error is known as the \
            parameters' tolerance."
        }
    }
}

fn boundary(reproduction: &Reproduction) -> Markup {
    let analysis = &reproduction.boundary;
    html! {
        p {
            "The abstract announces the boundary from the forward model and the influence of parameter \
            errors on it; the paper shows neither. " (analysis.workspace.points.len()) " points, each within "
            (analysis.workspace.tolerance) " mm of the boundary: "
            (format!("{:.2} ± {:.2}", analysis.report.volume.litres, analysis.report.volume.uncertainty_litres))
            " litres. "
            @if let Some(band) = &analysis.report.tolerance_band {
                "With the paper's start error of 1 mm and 1° on every parameter the boundary is off by "
                (format!("{:.2}", band.sigma_mm)) " mm (one sigma along its normal, rms over the boundary; "
                (format!("{:.2}", band.largest_sigma_mm)) " mm at the worst point) and the volume by "
                (format!("{:.2}", band.volume_sigma_litres)) " litres."
            }
        }
    }
}

fn of_figures() -> Markup {
    html! {
        p.note {
            "The paper's Figs. 2 and 3 show the gain of each parameter (a) and the position error before and \
            after (b) for one robot, which cannot be known; here they are over all robots."
        }
    }
}

fn misprints() -> Markup {
    html! {
        section {
            h2 { "Misprints, and what the paper leaves open" }
            ul {
                li { "(3.8) is printed with Lb where dimensions demand Lb²: |X − B(q)|² = Lb²." }
                li { "(3.16), (3.17) and (3.18) differ in sign. Differentiating (3.14) gives \
                    ∂X/∂P = −(∂f/∂X)⁻¹ ∂f/∂P, which is what is used here, checked against finite \
                    differences and dual numbers." }
                li { "α is not defined. Read as an encoder offset it repeats what La_x and La_y hold, and \
                    the Jacobian has rank 7; read as the tilt of the motor axis out of the base plane it \
                    has rank 8. It is the tilt." }
                li { "La_x and La_y are vectors in the plane perpendicular to the motor axis; with La_y along \
                    the axis the rank is 7 again." }
                li { "The norm of (4.1) mixes millimetres and radians. Here angles are multiplied by the \
                    upper arm's length." }
                li { "Joint limits, the poses, and the distribution of the errors are not given." }
            }
        }
    }
}

fn repeat() -> Markup {
    html! {
        section {
            h2 { "To repeat it" }
            pre { "delta-cal reproduce\n\
                delta-cal simulate campaigns/fkm-noise/plan.toml    # one of the campaigns by itself\n\
                delta-cal workspace robot.toml --output workspace   # the boundary, of any robot" }
            p {
                "results.csv has one row a case, campaigns/*/robots.csv one row a robot with the seed that \
                makes it. All but the times is the same to the bit on every machine."
            }
        }
    }
}
