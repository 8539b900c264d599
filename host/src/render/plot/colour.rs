use plotters::style::RGBColor;

/// The colours of Okabe and Ito that differ for the colour-blind and stand out from white and from
/// black (their yellow does not), and two that are part of no comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// #0072B2.
    Blue,
    /// #D55E00.
    Vermilion,
    /// #009E73.
    Green,
    /// #CC79A7.
    Purple,
    /// #E69F00.
    Orange,
    /// #56B4E9.
    SkyBlue,
    /// Text and axes: black on white, and what the page makes of it on black.
    Ink,
    /// What is there for comparison only.
    Grey,
}

impl Colour {
    /// Red, green and blue.
    pub const fn channels(self) -> [u8; 3] {
        let RGBColor(red, green, blue) = self.rgb();
        [red, green, blue]
    }

    pub(super) const fn rgb(self) -> RGBColor {
        match self {
            Self::Blue => RGBColor(0x00, 0x72, 0xb2),
            Self::Vermilion => RGBColor(0xd5, 0x5e, 0x00),
            Self::Green => RGBColor(0x00, 0x9e, 0x73),
            Self::Purple => RGBColor(0xcc, 0x79, 0xa7),
            Self::Orange => RGBColor(0xe6, 0x9f, 0x00),
            Self::SkyBlue => RGBColor(0x56, 0xb4, 0xe9),
            Self::Ink => RGBColor(0x1a, 0x1a, 0x1a),
            Self::Grey => RGBColor(0x80, 0x80, 0x80),
        }
    }
}

/// Six steps from dark to light of the map viridis, whose steps differ for the colour-blind: for
/// what is graded.
pub const STEPS: [[u8; 3]; 6] = [
    [0x44, 0x01, 0x54],
    [0x41, 0x44, 0x87],
    [0x2a, 0x78, 0x8e],
    [0x22, 0xa8, 0x84],
    [0x7a, 0xd1, 0x51],
    [0xfd, 0xe7, 0x25],
];

/// Lines behind the data.
pub(super) const GRID: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);
