//! In which direction each joint moved last.

/// −1 or 1 for each joint: the direction of its last move; 0 before its first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Directions {
    before: Option<[f64; 3]>,
    directions: [f64; 3],
}

impl Directions {
    /// After a move to these joint angles or travels.
    pub(crate) fn next(&mut self, joints: &[f64; 3]) -> [f64; 3] {
        let before = self.before.replace(*joints).unwrap_or(*joints);
        for ((direction, to), from) in self.directions.iter_mut().zip(joints).zip(before) {
            if (to - from).abs() > 0.0 {
                *direction = (to - from).signum();
            }
        }
        self.directions
    }
}
