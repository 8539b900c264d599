use core::fmt;

/// One of the robot's three arms, counted from 1 as the joints `q1`, `q2`, `q3` are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ArmIndex {
    /// Arm 1, driven by `q1`.
    First,
    /// Arm 2, driven by `q2`.
    Second,
    /// Arm 3, driven by `q3`.
    Third,
}

impl ArmIndex {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::First, Self::Second, Self::Third];

    /// Position in an array of three: 0, 1 or 2.
    pub const fn index(self) -> usize {
        match self {
            Self::First => 0,
            Self::Second => 1,
            Self::Third => 2,
        }
    }
}

impl fmt::Display for ArmIndex {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "arm {}", self.index() + 1)
    }
}
