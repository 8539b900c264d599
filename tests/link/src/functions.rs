//! The symbols: both scalars, every function; results are written through a pointer.
#![allow(unsafe_code)] // naming a symbol
#![allow(improper_ctypes_definitions)] // nobody calls them
#![allow(clippy::too_many_arguments)]

macro_rules! symbols {
    ($prefix:literal; $(
        fn $name:ident($($argument:ident: $kind:ty),* $(,)?) -> $result:ty $body:block
    )*) => {$(
        #[unsafe(export_name = concat!("core_", $prefix, stringify!($name)))]
        extern "C" fn $name(out: &mut MaybeUninit<$result>, $($argument: $kind),*) {
            out.write($body);
        }
    )*};
}

mod calibrator;
mod drives;
mod joint;
mod observations;
mod robot;
mod samples;
mod scalar;
mod stream;
mod stream_calibrator;
