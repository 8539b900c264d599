//! Figures with their names and captions.

use super::page;
use super::plot::{Figure, PlotError};
use maud::{Markup, html};

/// A figure, the name of its files, and what is to be seen in it.
#[derive(Debug, Clone)]
pub struct NamedFigure {
    /// Such as `fig2a`.
    pub name: &'static str,
    /// What is drawn.
    pub figure: Figure,
    /// One or two sentences.
    pub caption: String,
}

impl NamedFigure {
    pub(crate) fn new(name: &'static str, figure: Figure, caption: impl Into<String>) -> Self {
        Self {
            name,
            figure,
            caption: caption.into(),
        }
    }
}

/// Those of these names, in their order, in a page.
pub(crate) fn shown(figures: &[NamedFigure], names: &[&str]) -> Result<Markup, PlotError> {
    Ok(html! {
        @for name in names {
            @for named in figures.iter().filter(|named| named.name == *name) {
                (page::figure(&named.figure, &named.caption)?)
            }
        }
    })
}
