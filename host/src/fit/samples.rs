//! The samples of a fit, which takes them in one after the other, as often as it needs them.

use crate::files::samples_file::ManyRows;
use delta_cal::Sample;
use delta_cal::frame::RigidTransform;
use std::borrow::Cow;
use std::convert::Infallible;

/// Samples in the robot's frame.
#[derive(Debug, Clone, Copy)]
pub enum Samples<'a> {
    /// In memory.
    InMemory(&'a [Sample<f64>]),
    /// Too many for that.
    OnDisk(OnDisk<'a>),
}

/// The samples of a file with many rows, brought into the robot's frame.
#[derive(Debug, Clone, Copy)]
pub struct OnDisk<'a> {
    rows: &'a ManyRows,
    /// Those that are in memory as well.
    chosen: &'a [Sample<f64>],
    to_robot: Option<RigidTransform<f64>>,
}

impl<'a> Samples<'a> {
    /// `chosen`: those that are in memory as well, in the robot's frame; `sensor_frame`: from there to the frame of the
    /// rows.
    pub(crate) fn on_disk(
        rows: &'a ManyRows,
        chosen: &'a [Sample<f64>],
        sensor_frame: Option<&RigidTransform<f64>>,
    ) -> Self {
        Self::OnDisk(OnDisk {
            rows,
            chosen,
            to_robot: sensor_frame.map(RigidTransform::inverse),
        })
    }

    /// How many there are.
    pub(crate) const fn count(&self) -> usize {
        match self {
            Self::InMemory(samples) => samples.len(),
            Self::OnDisk(own) => own.rows.count(),
        }
    }

    /// Whether all of them are on disk.
    pub(crate) const fn is_on_disk(&self) -> bool {
        matches!(self, Self::OnDisk(_))
    }

    /// The places of those that are in memory among all.
    pub(crate) fn places_in_memory(&self) -> Box<dyn Iterator<Item = usize> + 'a> {
        match self {
            Self::InMemory(samples) => Box::new(0..samples.len()),
            Self::OnDisk(own) => Box::new(own.rows.chosen().iter().map(|chosen| chosen.index)),
        }
    }

    /// Every sample, some at a time, with the index of the first of them.
    ///
    /// # Errors
    /// The first error of `take`.
    pub(crate) fn each_part<E>(
        &self,
        mut take: impl FnMut(usize, &[Sample<f64>]) -> Result<(), E>,
    ) -> Result<(), E> {
        match self {
            Self::InMemory(samples) => take(0, samples),
            Self::OnDisk(own) => own.each_part(take),
        }
    }

    /// Every sample with its index.
    pub(crate) fn each(&self, mut take: impl FnMut(usize, &Sample<f64>)) {
        let Ok(()) = self.each_part(|first, samples| {
            for (index, sample) in samples.iter().enumerate() {
                take(first + index, sample);
            }
            Ok::<_, Infallible>(())
        });
    }

    /// All of them in memory, for what has to look at each again and again.
    pub(crate) fn in_memory(self) -> Cow<'a, [Sample<f64>]> {
        match self {
            Self::InMemory(samples) => Cow::Borrowed(samples),
            Self::OnDisk(_) => {
                let mut all = Vec::with_capacity(self.count());
                self.each(|_, sample| all.push(*sample));
                Cow::Owned(all)
            }
        }
    }
}

impl OnDisk<'_> {
    pub(super) const fn count(&self) -> usize {
        self.rows.count()
    }

    pub(super) fn each_part<E>(
        &self,
        mut take: impl FnMut(usize, &[Sample<f64>]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut samples = Vec::new();
        self.rows.each_part(|first, rows| {
            samples.clear();
            let to_robot = self.to_robot.as_ref();
            samples.extend(rows.iter().map(|row| in_frame(&row.value, to_robot)));
            take(first, &samples)
        })
    }

    /// Those that are in memory as well, with their places among all.
    pub(super) fn chosen(&self) -> impl Iterator<Item = (usize, &Sample<f64>)> {
        let places = self.rows.chosen().iter().map(|chosen| chosen.index);
        places.zip(self.chosen)
    }
}

/// A sample in another frame.
pub(crate) fn in_frame(sample: &Sample<f64>, frame: Option<&RigidTransform<f64>>) -> Sample<f64> {
    Sample {
        position: frame.map_or(sample.position, |frame| frame.apply(&sample.position)),
        ..*sample
    }
}

impl<'a> From<&'a [Sample<f64>]> for Samples<'a> {
    fn from(samples: &'a [Sample<f64>]) -> Self {
        Self::InMemory(samples)
    }
}

impl<'a> From<&'a Vec<Sample<f64>>> for Samples<'a> {
    fn from(samples: &'a Vec<Sample<f64>>) -> Self {
        Self::InMemory(samples)
    }
}
