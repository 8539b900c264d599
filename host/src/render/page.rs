//! What every HTML report has: one file that opens from disk, with everything it needs in it.

use crate::render::plot::{Figure, PlotError};
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page/style.css");

/// A view that its own script draws from data within the page.
pub(crate) struct View<'a> {
    pub style: &'a str,
    pub script: &'a str,
    /// JSON that the script finds in the element of the id `data`.
    pub data: &'a str,
}

/// The page around a report.
pub(crate) fn render(title: &str, body: &Markup) -> String {
    around(title, body, None)
}

/// The page around a report with a view that can be turned.
pub(crate) fn render_with_view(title: &str, body: &Markup, view: &View) -> String {
    around(title, body, Some(view))
}

fn around(title: &str, body: &Markup, view: Option<&View>) -> String {
    let scripts = if view.is_some() {
        "; script-src 'unsafe-inline'"
    } else {
        ""
    };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content={ "delta-cal " (env!("CARGO_PKG_VERSION")) };
                meta http-equiv="Content-Security-Policy"
                    content={ "default-src 'none'; style-src 'unsafe-inline'" (scripts) };
                title { (title) }
                style { (PreEscaped(STYLE)) @if let Some(view) = view { (PreEscaped(view.style)) } }
            }
            body {
                main {
                    (body)
                    footer { "delta-cal " (env!("CARGO_PKG_VERSION")) }
                }
                @if let Some(view) = view {
                    script #data type="application/json" { (PreEscaped(view.data)) }
                    script { (PreEscaped(view.script)) }
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
