//! Memory as C provides it, and pointers into it.

use delta_cal_c::error::Error;
use delta_cal_c::kind::Kind;
use delta_cal_c::{Held, HeldMut, In, New, Out};
use std::marker::PhantomData;
use std::ptr::null_mut;

/// Memory for an object of a kind, as large as in C.
pub(crate) struct Place<K>(Box<[u64]>, PhantomData<K>);

impl<K: Kind> Place<K> {
    pub(crate) fn new() -> Self {
        Self(vec![0; K::SIZE / 8].into_boxed_slice(), PhantomData)
    }

    pub(crate) fn size(&self) -> usize {
        size_of_val(&*self.0)
    }

    pub(crate) fn new_object(&mut self) -> New<K> {
        unsafe { New::from_c(self.0.as_mut_ptr().cast()) }
    }

    pub(crate) fn held(&mut self) -> Held<K> {
        unsafe { Held::from_c(self.0.as_mut_ptr().cast()) }
    }

    pub(crate) fn held_mut(&mut self) -> HeldMut<K> {
        unsafe { HeldMut::from_c(self.0.as_mut_ptr().cast()) }
    }
}

pub(crate) fn input<T>(value: &T) -> In<T> {
    unsafe { In::from_c((&raw const *value).cast()) }
}

pub(crate) fn output<T>(value: &mut T) -> Out<T> {
    unsafe { Out::from_c((&raw mut *value).cast()) }
}

pub(crate) fn no_error() -> Out<Error> {
    unsafe { Out::from_c(null_mut()) }
}
