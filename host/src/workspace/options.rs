//! How finely a workspace is computed.

/// How finely a workspace is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Every boundary point is within this distance of the boundary, mm.
    pub tolerance: f64,
    /// Distance between neighbouring lines, mm; `None` for 1/80 of the longest side.
    pub spacing: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            spacing: None,
        }
    }
}
