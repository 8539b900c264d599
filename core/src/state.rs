//! Serialisation of object state to bytes.

use crate::Real;
use nalgebra::Vector3;

/// The part of an object that depends on its samples, without anything derived from robot and settings.
pub trait State<T: Real> {
    /// Size in bytes.
    const BYTES: usize;

    /// Writes it.
    fn save(&self, to: &mut Writer<'_>);

    /// Reads it. Everything that depends on samples is overwritten: from no bytes, a new object's state, which is zeros.
    fn load(&mut self, from: &mut Reader<'_>);

    /// Whether bytes can be a state of this object: their number, and every count in them.
    fn accepts(&self, bytes: &[u8]) -> bool {
        bytes.len() == Self::BYTES
    }
}

/// Destination of a state; anything beyond its end is dropped.
#[derive(Debug)]
pub struct Writer<'a> {
    rest: &'a mut [u8],
    written: usize,
}

impl<'a> Writer<'a> {
    pub(crate) const fn new(bytes: &'a mut [u8]) -> Self {
        Self {
            rest: bytes,
            written: 0,
        }
    }

    pub(crate) const fn written(&self) -> usize {
        self.written
    }

    pub(crate) fn put(&mut self, bytes: &[u8]) {
        if let Some((place, rest)) =
            core::mem::take(&mut self.rest).split_at_mut_checked(bytes.len())
        {
            // Not `copy_from_slice`: its length check can panic.
            for (place, byte) in place.iter_mut().zip(bytes) {
                *place = *byte;
            }
            self.rest = rest;
            self.written += bytes.len();
        }
    }
}

/// Source of a state; missing bytes read as zero.
#[derive(Debug)]
pub struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    pub(crate) fn take<const N: usize>(&mut self) -> [u8; N] {
        match self.rest.split_first_chunk::<N>() {
            Some((bytes, rest)) => {
                self.rest = rest;
                *bytes
            }
            None => [0; N],
        }
    }
}

impl<T: Real> State<T> for T {
    const BYTES: usize = T::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        let bytes = self.bit_pattern().to_le_bytes();
        to.put(bytes.get(..T::BYTES).unwrap_or_default());
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        let pattern = if T::BYTES == 4 {
            u64::from(u32::from_le_bytes(from.take()))
        } else {
            u64::from_le_bytes(from.take())
        };
        *self = T::from_bit_pattern(pattern);
    }
}

impl<T: Real> State<T> for u64 {
    const BYTES: usize = 8;

    fn save(&self, to: &mut Writer<'_>) {
        to.put(&self.to_le_bytes());
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        *self = Self::from_le_bytes(from.take());
    }
}

impl<T: Real> State<T> for () {
    const BYTES: usize = 0;

    fn save(&self, _: &mut Writer<'_>) {}

    fn load(&mut self, _: &mut Reader<'_>) {}
}

impl<T: Real> State<T> for bool {
    const BYTES: usize = 1;

    fn save(&self, to: &mut Writer<'_>) {
        to.put(&[u8::from(*self)]);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        let [byte] = from.take();
        *self = byte != 0;
    }

    fn accepts(&self, bytes: &[u8]) -> bool {
        matches!(bytes, [0 | 1])
    }
}

/// A count or index below 256.
impl<T: Real> State<T> for usize {
    const BYTES: usize = 1;

    #[allow(clippy::cast_possible_truncation)] // fewer than 256
    fn save(&self, to: &mut Writer<'_>) {
        to.put(&[*self as u8]);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        let [byte] = from.take();
        *self = Self::from(byte);
    }
}

impl<T: Real, S: State<T>, const N: usize> State<T> for [S; N] {
    const BYTES: usize = N * S::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        for item in self {
            item.save(to);
        }
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        for item in self {
            item.load(from);
        }
    }

    fn accepts(&self, bytes: &[u8]) -> bool {
        let states = bytes.chunks(S::BYTES);
        bytes.len() == N * S::BYTES && self.iter().zip(states).all(|(item, own)| item.accepts(own))
    }
}

impl<T: Real> State<T> for Vector3<T> {
    const BYTES: usize = 3 * T::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        State::<T>::save(&self.data.0, to);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        State::<T>::load(&mut self.data.0, from);
    }
}

/// Implements [`State`] for a type as the given fields in order, and a condition on its bytes.
macro_rules! state {
    ($type:ty: $($field:ident: $kind:ty),+ $(,)? $(; $condition:pat $(if $limit:expr)?)?) => {
        impl<T: $crate::Real> $crate::state::State<T> for $type {
            const BYTES: usize = 0 $(+ <$kind as $crate::state::State<T>>::BYTES)+;

            fn save(&self, to: &mut $crate::state::Writer<'_>) {
                $($crate::state::State::<T>::save(&self.$field, to);)+
            }

            fn load(&mut self, from: &mut $crate::state::Reader<'_>) {
                $($crate::state::State::<T>::load(&mut self.$field, from);)+
            }

            fn accepts(&self, bytes: &[u8]) -> bool {
                $(if !matches!(bytes, $condition $(if $limit)?) {
                    return false;
                })?
                let mut rest = bytes;
                $(match rest.split_at_checked(<$kind as $crate::state::State<T>>::BYTES) {
                    Some((own, after)) if $crate::state::State::<T>::accepts(&self.$field, own) => {
                        rest = after;
                    }
                    _ => return false,
                })+
                rest.is_empty()
            }
        }
    };
}
pub(crate) use state;
