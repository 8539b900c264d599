//! The caller's memory: pointers from C, checked before use.
//!
//! All use of pointers is in this file. Only C creates values of these types, by calling a function of the interface,
//! whose documentation states the caller's obligations: a pointer is NULL or points to memory of its type that nothing
//! else uses during the call. Everything that can be checked is checked.
#![allow(unsafe_code)] // each block states its justification
#![allow(clippy::cast_ptr_alignment)] // checked at run time, which is the purpose of this file

use crate::kind::{ALIGNMENT, Kind, Stored, Tag};
use crate::status::{self, Status};
use core::fmt;
use core::marker::PhantomData;
use core::mem::MaybeUninit;
use core::ptr;

/// Plain numbers, without invariants.
///
/// # Safety
/// Every bit pattern of that size is valid, and there is no padding.
pub unsafe trait Plain: Copy {}

macro_rules! numbers {
    ($($number:ty)+) => {
        $(
            // SAFETY: a number.
            unsafe impl Plain for $number {}
        )+
    };
}

numbers! { f32 f64 i32 u32 u8 u64 usize }
// SAFETY: an array of such numbers.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {}

/// A structure of plain numbers with the layout of C.
macro_rules! plain {
    ($(#[$about:meta])* pub struct $name:ident {
        $($(#[$of_field:meta])* pub $field:ident: $of:ty,)+
    }) => {
        $(#[$about])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $name {
            $($(#[$of_field])* pub $field: $of,)+
        }

        // Padding would hold what was there before.
        const _: () = assert!(size_of::<$name>() == 0 $(+ size_of::<$of>())+);

        // SAFETY: C layout, only numbers, no padding.
        #[allow(unsafe_code)]
        unsafe impl $crate::memory::Plain for $name {}
    };
}
pub(crate) use plain;

/// A pointer of the interface.
pub trait Pointer {
    /// As C would hand it over.
    ///
    /// # Safety
    /// NULL, or leads to memory of the type, which nobody else uses during the call.
    unsafe fn from_c(pointer: *mut u8) -> Self;
}

macro_rules! pointers {
    ($($(#[doc = $text:literal])+ $name:ident: $raw:ty,)+) => {$(
        $(#[doc = $text])+
        #[repr(transparent)]
        pub struct $name<T>($raw, PhantomData<T>);

        impl<T> Pointer for $name<T> {
            unsafe fn from_c(pointer: *mut u8) -> Self {
                Self(pointer, PhantomData)
            }
        }

        impl<T> fmt::Debug for $name<T> {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(formatter)
            }
        }
    )+};
}

pointers! {
    /// An object that is only looked at.
    Held: *const u8,
    /// An object that changes.
    HeldMut: *mut u8,
    /// Memory that is to hold an object.
    New: *mut u8,
    /// A value, or bytes in a row, that are read.
    In: *const u8,
    /// Where a value is written.
    Out: *mut u8,
}

fn usable(pointer: *const u8, alignment: usize) -> Result<(), Status> {
    if pointer.is_null() {
        return Err(status::NULL_POINTER);
    }
    // On the platforms of this library, pointers hold nothing but the address.
    if !pointer.addr().is_multiple_of(alignment) {
        return Err(status::MISALIGNED);
    }
    Ok(())
}

/// The object behind a pointer, if its tag identifies it as one.
fn object<K: Kind>(pointer: *const u8) -> Result<*const Stored<K>, Status> {
    usable(pointer, ALIGNMENT)?;
    // SAFETY: not NULL, aligned, and by the interface's contract memory of an object, which is larger than a tag.
    // Volatile: the memory may never have been written, and the compiler must not infer anything from that.
    let tag = unsafe { pointer.cast::<Tag>().read_volatile() };
    if tag == Tag::of::<K>() {
        Ok(pointer.cast())
    } else if tag.is_known() {
        Err(status::WRONG_KIND)
    } else {
        Err(status::NOT_INITIALIZED)
    }
}

/// Checks that an object and a range of bytes do not overlap.
fn no_overlap<K: Kind>(object: *const u8, other: *const u8, size: usize) -> Result<(), Status> {
    let (object, other) = (object.addr(), other.addr());
    let first = if object < other {
        size_of::<Stored<K>>()
    } else {
        size
    };
    if object.abs_diff(other) >= first {
        Ok(())
    } else {
        Err(status::OVERLAP)
    }
}

impl<K: Kind> Held<K> {
    /// The object.
    pub(crate) fn get(&self) -> Result<&K, Status> {
        let stored = object::<K>(self.0)?;
        // SAFETY: the tag shows that `New::put` wrote such an object here. By the interface's contract only this
        // library has changed it since, and nothing changes it during the reference's lifetime, which is this call.
        Ok(unsafe { &(*stored).value })
    }

    /// The object, and the bytes it needs from a separate buffer; they are written only if there are enough.
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
    /// The object, and bytes in a separate buffer.
    pub(crate) fn beside_bytes<'a>(
        &'a mut self,
        bytes: &'a In<u8>,
        size: usize,
    ) -> Result<(&'a mut K, &'a [u8]), Status> {
        object::<K>(self.0)?;
        no_overlap::<K>(self.0, bytes.0, size)?;
        Ok((self.get()?, bytes.row(size)?))
    }

    /// The object.
    pub(crate) fn get(&mut self) -> Result<&mut K, Status> {
        object::<K>(self.0)?;
        // SAFETY: as in `Held::get`; in addition, nothing else accesses the object during the call.
        Ok(unsafe { &mut (*self.0.cast::<Stored<K>>()).value })
    }

    /// The object, and another, separate one.
    pub(crate) fn beside<'a, L: Kind>(
        &'a mut self,
        other: &'a Held<L>,
    ) -> Result<(&'a mut K, &'a L), Status> {
        object::<K>(self.0)?;
        object::<L>(other.0)?;
        no_overlap::<K>(self.0, other.0, size_of::<Stored<L>>())?;
        Ok((self.get()?, other.get()?))
    }
}

impl<K: Kind> New<K> {
    /// Checks that the memory can hold the object. `size` is its size according to C.
    pub(crate) fn usable(&self, size: usize) -> Result<(), Status> {
        usable(self.0, ALIGNMENT)?;
        if size < K::SIZE {
            return Err(status::WRONG_SIZE);
        }
        Ok(())
    }

    /// Creates the object from a reference, so that a large one is not copied on the stack first.
    #[inline]
    pub(crate) fn put(&mut self, size: usize, value: &K) -> Result<(), Status> {
        // SAFETY: `value` is elsewhere, since it is not C's; an assertion in `kind` ensures that all kinds hold only numbers
        // and can be copied bytewise.
        self.make(size, |place| unsafe {
            ptr::copy_nonoverlapping(value, place.as_mut_ptr(), 1);
            Ok(place.assume_init_mut())
        })
    }

    /// Creates a large object where it stays: on the stack it would take as much again. `make` fails before it writes.
    #[inline]
    pub(crate) fn make<E: From<Status>>(
        &mut self,
        size: usize,
        make: impl FnOnce(&mut MaybeUninit<K>) -> Result<&mut K, E>,
    ) -> Result<(), E> {
        self.usable(size)?;
        let stored = self.0.cast::<Stored<K>>();
        // SAFETY: not NULL, aligned, and by the interface's contract `size` bytes of memory; an assertion in `kind`
        // limits the object to `K::SIZE`. Previous contents are not read and need no drop, as the same assertion ensures.
        // `make` has written the new ones when it returns them.
        unsafe {
            make(&mut *(&raw mut (*stored).value).cast())?;
            (&raw mut (*stored).tag).write(Tag::of::<K>());
        }
        Ok(())
    }
}

impl<T: Plain> In<T> {
    pub(crate) fn get(&self) -> Result<T, Status> {
        usable(self.0, align_of::<T>())?;
        // SAFETY: not NULL, aligned, and by the interface's contract a value, for which every bit pattern is valid.
        Ok(unsafe { self.0.cast::<T>().read() })
    }
}

impl In<u8> {
    /// The bytes in place.
    fn row(&self, count: usize) -> Result<&[u8], Status> {
        usable(self.0, 1)?;
        if isize::try_from(count).is_err() {
            return Err(status::WRONG_SIZE);
        }
        // SAFETY: not NULL, and by the interface's contract `count` bytes that nothing changes during the call.
        Ok(unsafe { core::slice::from_raw_parts(self.0, count) })
    }
}

impl Out<u8> {
    /// Zeroed memory for `count` bytes.
    fn row(&mut self, count: usize) -> Result<&mut [u8], Status> {
        self.usable()?;
        if isize::try_from(count).is_err() {
            return Err(status::WRONG_SIZE);
        }
        // SAFETY: not NULL, and by the interface's contract `count` bytes that nothing else uses during the call. The
        // memory may never have been written, so it is initialised first.
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

    /// The same, but NULL is allowed for a caller who does not need the value.
    pub(crate) fn usable_or_null(&self) -> Result<(), Status> {
        if self.0.is_null() {
            return Ok(());
        }
        self.usable()
    }

    /// Writes the value unless the pointer is NULL.
    pub(crate) fn put_if_there(&mut self, value: T) {
        let _ = self.put(value);
    }

    pub(crate) fn put(&mut self, value: T) -> Result<(), Status> {
        self.usable()?;
        // SAFETY: not NULL, aligned, and by the interface's contract memory of such a value.
        unsafe { self.0.cast::<T>().write(value) };
        Ok(())
    }
}

impl<T: Plain, const N: usize> Out<[[T; N]; N]> {
    /// Writes a matrix entry by entry, row by row as C stores it: all of it would be large on the stack.
    pub(crate) fn put_entries(&mut self, of: impl Fn(usize, usize) -> T) -> Result<(), Status> {
        self.usable()?;
        let first = self.0.cast::<T>();
        for (row, column) in (0..N).flat_map(|row| (0..N).map(move |column| (row, column))) {
            // SAFETY: as in `put`, and the matrix has this entry.
            unsafe { first.add(N * row + column).write(of(row, column)) };
        }
        Ok(())
    }
}
