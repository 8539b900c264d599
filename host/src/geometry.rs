//! Where a robot may be: limits of the joints and of the ball joints.

pub mod reach;
