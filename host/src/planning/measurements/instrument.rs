//! What people have, or may buy or borrow.

use super::kind::{Kind, Wishes};
use super::request::{MeasurementRequest, NoiseOf};
use crate::fit::options::Frame;

/// An instrument, and how good it typically is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instrument {
    /// As it is written in options.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// What it measures.
    pub kind: Kind,
    /// One σ of a reading, mm.
    pub sigma: f64,
    blocks: &'static [f64],
    points: usize,
    lengths: Option<(f64, f64)>,
    frame: Frame,
}

impl Instrument {
    /// From the cheapest to the dearest.
    pub const ALL: [Self; 8] = [
        Self {
            blocks: &[0.0],
            ..Self::of("plate", "flat plate and dial gauge", Kind::Plane, 0.02)
        },
        Self::of(
            "blocks",
            "the same with gauge blocks of 60, 120 mm",
            Kind::Plane,
            0.02,
        ),
        Self {
            points: 2,
            ..Self::of("wire", "wire sensor at two places", Kind::Point, 0.05)
        },
        Self {
            lengths: Some((200.0, 200.0)),
            ..Self::of(
                "bar200",
                "ball bar of 200 mm on three sockets",
                Kind::Point,
                0.005,
            )
        },
        Self {
            lengths: Some((300.0, 300.0)),
            ..Self::of(
                "bar300",
                "ball bar of 300 mm on three sockets",
                Kind::Point,
                0.005,
            )
        },
        Self::of(
            "distances",
            "calliper or scale between two poses",
            Kind::Distance,
            0.05,
        ),
        Self {
            frame: Frame::Sensor,
            ..Self::of(
                "camera",
                "x and y of a mark, in its own frame",
                Kind::Xy,
                0.02,
            )
        },
        Self {
            frame: Frame::Sensor,
            ..Self::of(
                "tracker",
                "laser tracker, x, y and z in its own frame",
                Kind::Xyz,
                0.02,
            )
        },
    ];

    const fn of(name: &'static str, title: &'static str, kind: Kind, sigma: f64) -> Self {
        Self {
            name,
            title,
            kind,
            sigma,
            blocks: &[0.0, 60.0, 120.0],
            points: 3,
            lengths: None,
            frame: Frame::Base,
        }
    }

    /// So many measurements with it, everything else as in another request.
    pub fn request<'a>(
        &self,
        like: &MeasurementRequest<'a>,
        count: usize,
    ) -> MeasurementRequest<'a> {
        MeasurementRequest {
            kinds: Wishes::only(self.kind),
            count,
            blocks: self.blocks.to_vec(),
            points: self.points,
            lengths: self.lengths,
            noise: Some(NoiseOf {
                position: self.sigma,
                height: self.sigma,
                distance: self.sigma,
            }),
            frame: self.frame,
            ..like.clone()
        }
    }
}
