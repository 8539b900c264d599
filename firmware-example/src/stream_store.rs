//! A session's samples in flash, so that it can resume after a power cut.

use crate::Number;
use crate::halves::{Halves, StoreError};
use crate::session::Session;
use crate::store::mark;
use crate::stream::Stream;
use delta_cal::Robot;
use delta_cal_protocol::{Begin, Reader, Wire, Writer};
use embedded_storage::nor_flash::NorFlash;

/// Version of the stored record.
const VERSION: u8 = 0x83;

/// How often a session is stored.
///
/// Each record replaces the previous one, and each half of the flash is erased for every other record. With the default
/// and flash rated for 10,000 erasures, samples may arrive without pause for 13 days before the flash is worn out: one
/// record per minute. A calibration without forgetting stays far below that, because the next record waits for a
/// sixteenth more samples: a million samples take about 200 records.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamPace {
    /// Minimum number of control-loop turns between two records.
    pub turns: u32,
    /// A record waits until the number of new samples is the number of stored ones divided by this; with forgetting, of
    /// their mean age if that is smaller.
    pub part: u32,
}

impl Default for StreamPace {
    fn default() -> Self {
        Self {
            turns: 60 * crate::TURNS_A_SECOND,
            part: 16,
        }
    }
}

/// The store of one session.
#[derive(Debug)]
pub(crate) struct StreamStore<T: Number, F> {
    halves: Halves<F>,
    /// Buffer for the record being read or written.
    bytes: T::StreamBytes,
    pace: StreamPace,
    /// The stored session and its number of samples.
    stored: Option<(Begin<T>, u32)>,
    /// The control-loop turn of the last record.
    turn: u32,
}

impl<T: Number, F: NorFlash> StreamStore<T, F> {
    pub(crate) fn new(flash: F, nominal: u32) -> Self {
        let bytes = T::NO_STREAM_BYTES;
        let largest = bytes.as_ref().len();
        Self {
            halves: Halves::new(flash, mark::<T>(VERSION, nominal), largest),
            bytes,
            pace: StreamPace::default(),
            stored: None,
            turn: 0,
        }
    }

    pub(crate) const fn set_pace(&mut self, pace: StreamPace) {
        self.pace = pace;
    }

    pub(crate) fn into_flash(self) -> F {
        self.halves.into_flash()
    }

    /// Resumes the stored session, if there is one and this robot can use it.
    #[inline(never)]
    pub(crate) fn resume(&mut self, nominal: &Robot<T>, session: &mut Session<T>) {
        let content = match self.halves.load(self.bytes.as_mut()) {
            Ok(Some(content)) => content,
            Ok(None) => return,
            Err(error) => {
                warning!("stored samples are damaged: {}", error);
                return;
            }
        };
        let mut reader = Reader::new(content);
        let Some(begin) = Begin::get(&mut reader) else {
            return;
        };
        if let Err(error) = session.resume(nominal, &begin, reader.rest()) {
            warning!("stored samples are no use: {}", error);
            return;
        }
        self.stored = Some((begin, session.samples()));
        info!(
            "session {=u32:08x} goes on after {} samples",
            begin.session,
            session.samples()
        );
    }

    /// Whether the session should be stored now, at this turn of the control loop.
    pub(crate) fn due(&self, begin: &Begin<T>, stream: &Stream<T>, turn: u32) -> bool {
        let stored = match &self.stored {
            Some((session, stored)) if session == begin => *stored,
            _ => 0,
        };
        let new = samples(stream).saturating_sub(stored);
        let remembered = begin
            .forgetting
            .map_or(f64::INFINITY, delta_cal::Real::to_f64)
            .min(f64::from(stored));
        let enough = f64::from(new) * f64::from(self.pace.part) >= remembered;
        let never = self.pace.turns == u32::MAX;
        !never && new > 0 && enough && turn.wrapping_sub(self.turn) >= self.pace.turns
    }

    /// Keeps the stored session from being resumed: its result is in use.
    pub(crate) fn forget(&mut self) {
        if self.stored.is_some() {
            match self.halves.save(&[0]) {
                Ok(()) => self.stored = None,
                Err(error) => warning!("stored samples not deleted: {}", error),
            }
        }
    }

    /// Stores a session that is not being solved, at this turn of the control loop.
    #[inline(never)]
    pub(crate) fn save(
        &mut self,
        begin: &Begin<T>,
        stream: &Stream<T>,
        turn: u32,
    ) -> Result<(), StoreError> {
        // Also before a failure, so that failing flash is not retried at every turn.
        self.turn = turn;
        let bytes = self.bytes.as_mut();
        let mut writer = Writer::new(bytes);
        begin.put(&mut writer);
        let used = writer.finish().ok_or(StoreError::Record)?;
        let rest = bytes.get_mut(used..).ok_or(StoreError::Record)?;
        let length = stream.snapshot(rest).map_err(|_| StoreError::Record)?.len();
        let content = bytes.get(..used + length).ok_or(StoreError::Record)?;
        self.halves.save(content)?;
        self.stored = Some((*begin, samples(stream)));
        Ok(())
    }
}

fn samples<T: Number>(stream: &Stream<T>) -> u32 {
    u32::try_from(stream.samples()).unwrap_or(u32::MAX)
}
