//! What every HTML report has: one file that opens from disk, with everything it needs in it.

use crate::plot::{Figure, PlotError};
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page/style.css");

/// The page around a report.
pub(crate) fn render(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content={ "delta-cal " (env!("CARGO_PKG_VERSION")) };
                meta http-equiv="Content-Security-Policy"
                    content="default-src 'none'; style-src 'unsafe-inline'";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    (body)
                    footer { "delta-cal " (env!("CARGO_PKG_VERSION")) }
                }
            }
        }
    };
    page.into_string() + "\n"
}

/// A figure with what is to be seen in it.
pub(crate) fn figure(figure: &Figure, caption: &str) -> Result<Markup, PlotError> {
    let svg = figure.to_svg()?;
    Ok(html! {
        figure {
            (PreEscaped(svg))
            figcaption { (caption) }
        }
    })
}
