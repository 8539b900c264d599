//! Memory of the caller: pointers as C hands them over, checked before they are used.
//!
//! All use of pointers is in this file. Only C makes the values of these types, by calling a function of the interface,
//! whose documentation states what it promises: a pointer is NULL or leads to memory of its type, which nobody else
//! uses during the call. What can be checked of that is checked.
#![allow(unsafe_code)] // each block says why it is right
#![allow(clippy::cast_ptr_alignment)] // checked at run time, that is what this file is for

use crate::kind::{ALIGNMENT, Kind, Stored, Tag};
use crate::status::{self, Status};
use core::fmt;
use core::marker::PhantomData;
use core::ptr;

/// Numbers without further rules.
///
/// # Safety
/// Any bits of that size are a value, and there is no padding.
pub unsafe trait Plain: Copy {}

macro_rules! plain {
    ($($number:ty)+) => {
        $(
            // SAFETY: a number.
            unsafe impl Plain for $number {}
        )+
    };
}

plain! { f32 f64 i32 u8 u64 usize }
// SAFETY: such numbers in a row.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {}

macro_rules! pointer {
    ($(#[doc = $text:literal])+ $name:ident, $raw:ty) => {
        $(#[doc = $text])+
        #[repr(transparent)]
        pub struct $name<T>($raw, PhantomData<T>);

        impl<T> $name<T> {
            /// As C would hand it over.
            ///
            /// # Safety
            /// NULL, or leads to memory of the type, which nobody else uses during the call.
            pub const unsafe fn from_c(pointer: $raw) -> Self {
                Self(pointer, PhantomData)
            }
        }

        impl<T> fmt::Debug for $name<T> {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(formatter)
            }
        }
    };
}

pointer!(
    /// An object that is only looked at.
    Held,
    *const u8
);
pointer!(
    /// An object that changes.
    HeldMut,
    *mut u8
);
pointer!(
    /// Memory that is to hold an object.
    New,
    *mut u8
);
pointer!(
    /// A value that is read.
    In,
    *const u8
);
pointer!(
    /// Values in a row that are read.
    Many,
    *const u8
);
pointer!(
    /// Where a value is written.
    Out,
    *mut u8
);

fn usable(pointer: *const u8, alignment: usize) -> Result<(), Status> {
    if pointer.is_null() {
        return Err(status::NULL_POINTER);
    }
    // On no platform of this library do pointers hold anything but the address.
    if !pointer.addr().is_multiple_of(alignment) {
        return Err(status::MISALIGNED);
    }
    Ok(())
}

/// The object behind a pointer, if its tag says that it is one.
fn object<K: Kind>(pointer: *const u8) -> Result<*const Stored<K>, Status> {
    usable(pointer, ALIGNMENT)?;
    // SAFETY: not NULL, aligned, and by the interface's promise memory of an object, which is larger than a tag.
    // Volatile: the memory may never have been written, and the compiler must not conclude anything from that.
    let tag = unsafe { pointer.cast::<Tag>().read_volatile() };
    if tag == Tag::of::<K>() {
        Ok(pointer.cast())
    } else if tag.is_known() {
        Err(status::WRONG_KIND)
    } else {
        Err(status::NOT_INITIALIZED)
    }
}

fn apart<K: Kind, L: Kind>(one: *const u8, other: *const u8) -> Result<(), Status> {
    no_overlap::<K>(one, other, size_of::<Stored<L>>())
}

/// That an object and so many bytes lie apart.
fn no_overlap<K: Kind>(object: *const u8, other: *const u8, size: usize) -> Result<(), Status> {
    let (object, other) = (object.addr(), other.addr());
    let before =
        |first: usize, size: usize, second: usize| second >= first && second - first >= size;
    if before(object, size_of::<Stored<K>>(), other) || before(other, size, object) {
        Ok(())
    } else {
        Err(status::OVERLAP)
    }
}

impl<K: Kind> Held<K> {
    /// The object.
    pub(crate) fn get(&self) -> Result<&K, Status> {
        let stored = object::<K>(self.0)?;
        // SAFETY: the tag says that `New::put` wrote such an object here; by the interface's promise nobody has changed
        // it since but this library, and nobody does while the reference lives, which is this call.
        Ok(unsafe { &(*stored).value })
    }
}

impl<K: Kind> Held<K> {
    /// The object, and the bytes that are needed of those that lie elsewhere; they are written only if there are enough.
    pub(crate) fn beside_bytes<'a>(
        &'a self,
        bytes: &'a mut Out<u8>,
        capacity: usize,
        needed: usize,
    ) -> Result<(&'a K, &'a mut [u8]), Status> {
        object::<K>(self.0)?;
        bytes.usable()?;
        no_overlap::<K>(self.0, bytes.0, capacity)?;
        if capacity < needed {
            return Err(status::SNAPSHOT_BUFFER);
        }
        Ok((self.get()?, bytes.row(needed)?))
    }
}

impl<K: Kind> HeldMut<K> {
    /// The object, and bytes that lie elsewhere.
    pub(crate) fn beside_bytes<'a>(
        &'a mut self,
        bytes: &'a Many<u8>,
        size: usize,
    ) -> Result<(&'a mut K, &'a [u8]), Status> {
        object::<K>(self.0)?;
        no_overlap::<K>(self.0, bytes.0, size)?;
        Ok((self.get()?, bytes.row(size)?))
    }

    /// The object.
    pub(crate) fn get(&mut self) -> Result<&mut K, Status> {
        object::<K>(self.0)?;
        // SAFETY: as in `Held::get`; and nobody else looks at the object during the call.
        Ok(unsafe { &mut (*self.0.cast::<Stored<K>>()).value })
    }

    /// The object, and another one that lies elsewhere.
    pub(crate) fn beside<'a, L: Kind>(
        &'a mut self,
        other: &'a Held<L>,
    ) -> Result<(&'a mut K, &'a L), Status> {
        object::<K>(self.0)?;
        object::<L>(other.0)?;
        apart::<K, L>(self.0, other.0)?;
        Ok((self.get()?, other.get()?))
    }
}

impl<K: Kind> New<K> {
    /// Whether the memory can hold the object. `size` is what C believes its size to be.
    pub(crate) fn usable(&self, size: usize) -> Result<(), Status> {
        usable(self.0, ALIGNMENT)?;
        if size < K::SIZE {
            return Err(status::WRONG_SIZE);
        }
        Ok(())
    }

    /// Makes the object, from a reference, so that a large one is not copied on the stack first.
    #[inline]
    pub(crate) fn put(&mut self, size: usize, value: &K) -> Result<(), Status> {
        self.usable(size)?;
        let stored = self.0.cast::<Stored<K>>();
        // SAFETY: not NULL, aligned, and by the interface's promise `size` bytes of memory; an assertion in `kind` holds
        // the object to `K::SIZE`. What was there is not read and needs no drop: that assertion says so of all kinds,
        // which hold numbers alone and can be copied by their bytes. `value` lies elsewhere: it is not C's.
        unsafe {
            ptr::copy_nonoverlapping(value, &raw mut (*stored).value, 1);
            (&raw mut (*stored).tag).write(Tag::of::<K>());
        }
        Ok(())
    }
}

impl<T: Plain> In<T> {
    pub(crate) fn get(&self) -> Result<T, Status> {
        usable(self.0, align_of::<T>())?;
        // SAFETY: not NULL, aligned, and by the interface's promise a value, of which any bits are one.
        Ok(unsafe { self.0.cast::<T>().read() })
    }
}

impl Many<u8> {
    /// The bytes as they lie there.
    fn row(&self, count: usize) -> Result<&[u8], Status> {
        usable(self.0, 1)?;
        if isize::try_from(count).is_err() {
            return Err(status::WRONG_SIZE);
        }
        // SAFETY: not NULL, and by the interface's promise so many bytes, which nobody changes during the call.
        Ok(unsafe { core::slice::from_raw_parts(self.0, count) })
    }
}

impl Out<u8> {
    /// Memory for so many bytes, all zero.
    fn row(&mut self, count: usize) -> Result<&mut [u8], Status> {
        self.usable()?;
        if isize::try_from(count).is_err() {
            return Err(status::WRONG_SIZE);
        }
        // SAFETY: not NULL, and by the interface's promise memory of so many bytes, which nobody else uses during the call.
        // It may never have been written: that is done first.
        Ok(unsafe {
            self.0.write_bytes(0, count);
            core::slice::from_raw_parts_mut(self.0, count)
        })
    }
}

impl<T: Plain> Out<T> {
    pub(crate) fn usable(&self) -> Result<(), Status> {
        usable(self.0, align_of::<T>())
    }

    /// The same, but NULL for a caller who does not want to know.
    pub(crate) fn usable_or_null(&self) -> Result<(), Status> {
        if self.0.is_null() {
            return Ok(());
        }
        self.usable()
    }

    pub(crate) fn put(&mut self, value: T) -> Result<(), Status> {
        self.usable()?;
        // SAFETY: not NULL, aligned, and by the interface's promise memory of such a value.
        unsafe { self.0.cast::<T>().write(value) };
        Ok(())
    }

    /// Writes where there is a place to write to.
    pub(crate) fn put_if_there(&mut self, value: T) {
        let _ = self.put(value);
    }
}
