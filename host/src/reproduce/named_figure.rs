//! A figure with its name and caption.

use crate::render::plot::Figure;

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
    pub(super) fn new(name: &'static str, figure: Figure, caption: impl Into<String>) -> Self {
        Self {
            name,
            figure,
            caption: caption.into(),
        }
    }
}
