//! Rows of numbers to arrays, on all cores. `delta_cal/_arrays.py` prepares the arguments.

use crate::errors::value_error;
use crate::files::call_python;
use crate::lanes::{Kernel, LANES, Lanes, Room, fill as fill_lanes};
use crate::wide::Lane;
use delta_cal_host::RobotFile;
use delta_cal_host::files::robot_file::Tool;
use delta_cal_host::halt::{self, Halt, Halted};
use numpy::{
    Element, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods, dtype,
};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::{ParallelSlice, ParallelSliceMut};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::any::Any;
use std::f64::consts::TAU;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Between two looks at the keyboard.
const LOOK: Duration = Duration::from_millis(50);
/// Rows that one core takes at once.
const CHUNK: usize = 2048;

/// An array of this shape, for reading.
pub(crate) fn array<'py, N: Element>(
    py: Python<'py>,
    values: Vec<N>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let array = PyArray1::from_vec(py, values);
    let array = array.call_method1("reshape", (PyTuple::new(py, shape)?,))?;
    array.call_method1("setflags", (false,))?;
    Ok(array)
}

/// `WIDTH` numbers of this shape for each row, on all cores and without the interpreter's lock. A row that has none is
/// NaN, or with `raise` an error that names it. From `LANES` rows on the kernel computes all of `several` but the rows that
/// are not clear to it. `angles`: the rows are joint angles.
pub(crate) fn each_row<'py, N: Element + Lane, const WIDTH: usize, K: Kernel<WIDTH>, E: Display>(
    (argument, rows, angles): (&str, &Bound<'py, PyAny>, bool),
    each: &[usize],
    raise: bool,
    several: Option<(&RobotFile, &Tool)>,
    compute: impl Fn(&[f64; 3]) -> Result<[f64; WIDTH], E> + Sync,
) -> PyResult<Bound<'py, PyAny>> {
    let py = rows.py();
    let given: PyReadonlyArrayDyn<'py, N> = rows.extract()?;
    let (from, _) = given.as_slice()?.as_chunks::<3>();
    let outer = given
        .shape()
        .split_last()
        .map_or(&[][..], |(_, outer)| outer);
    let shape = PyTuple::new(py, [outer, each].concat())?;
    let array = py
        .import("numpy")?
        .call_method1("empty", (shape, dtype::<N>(py)))?;
    let array = array.cast_into::<PyArrayDyn<N>>()?;
    let mut values = array.readwrite();
    let (into, _) = values.as_slice_mut()?.as_chunks_mut::<WIDTH>();
    let several = several.filter(|_| from.len() >= LANES);
    let kernel = several.and_then(|(robot, point)| Lanes::of(robot, point));
    // Joints that the kernel finds clear are within the limits.
    let degrees = AtomicBool::new(false);
    let exact = |into: &mut [N; WIDTH], row: &[N; 3]| {
        let row = row.map(Into::into);
        if angles && row.iter().any(|own| own.abs() > TAU) {
            degrees.store(true, Relaxed);
        }
        *into = compute(&row).unwrap_or([f64::NAN; WIDTH]).map(N::of);
    };
    let fill = |into: &mut [[N; WIDTH]], from: &[[N; 3]]| {
        halt::check();
        let mut room = Room::new();
        let mut last = ([[N::of(0.0); 3]; LANES], [[N::of(0.0); WIDTH]; LANES]);
        for (into, from) in into.chunks_mut(LANES).zip(from.chunks(LANES)) {
            let clear = kernel.as_ref().map(|robot| {
                if from.len() == LANES {
                    return fill_lanes::<K, N, WIDTH>(robot, from, into, &mut room);
                }
                let (rows, found) = &mut last;
                rows[..from.len()].copy_from_slice(from);
                fill_lanes::<K, N, WIDTH>(robot, rows, found, &mut room);
                into.copy_from_slice(&found[..into.len()]);
                false
            });
            if clear == Some(true) {
                continue;
            }
            for (into, row) in into.iter_mut().zip(from) {
                if clear.is_none() || into[0].into().is_nan() {
                    exact(into, row);
                }
            }
        }
    };
    if from.len() > CHUNK {
        with_cores(py, || {
            let parts = into.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK));
            parts.for_each(|(into, from)| fill(into, from));
        })?;
    } else {
        py.detach(|| fill(into, from));
    }
    if degrees.into_inner() {
        call_python(py, "_arrays", "radians", (argument, rows))?;
    }
    let is_nan = |row: &[N; WIDTH]| row.iter().any(|value| (*value).into().is_nan());
    if raise && let Some(row) = into.iter().position(is_nan) {
        compute(&from[row].map(Into::into))
            .map_err(|error| value_error(argument, format!("row {row}: {error}")))?;
    }
    drop(values);
    Ok(array.into_any())
}

/// Without the interpreter's lock, on threads of this process: those of a process that forked are not there in its
/// child. An interrupt stops the work; what stops because of another thread's interrupt begins again.
pub(crate) fn with_cores<T: Send>(py: Python<'_>, work: impl FnMut() -> T + Send) -> PyResult<T> {
    with_cores_telling(py, None, work, || [(); 0])
}

/// The same; `told`, if there is one, is called with what `far` gives at every look at the keyboard.
pub(crate) fn with_cores_telling<T: Send, F, const N: usize>(
    py: Python<'_>,
    told: Option<&Py<PyAny>>,
    mut work: impl FnMut() -> T + Send,
    far: impl Fn() -> [F; N] + Sync,
) -> PyResult<T>
where
    F: for<'py> IntoPyObject<'py>,
{
    let pool = cores()?;
    let tell = |py: Python<'_>| match told {
        Some(told) => told.bind(py).call1(PyTuple::new(py, far())?).map(drop),
        None => Ok(()),
    };
    let look = |py: Python<'_>| py.check_signals().and_then(|()| tell(py));
    loop {
        let found = py.detach(|| watched(|| pool.install(&mut work), &look))?;
        match found {
            Ok(found) => return tell(py).map(|()| found),
            Err(payload) if payload.is::<Halted>() => {
                while Halt::is_wanted() {
                    py.detach(|| std::thread::sleep(LOOK));
                    py.check_signals()?;
                }
            }
            Err(payload) => return Err(fault(payload.as_ref())),
        }
    }
}

/// Works on another thread while this one looks at the keyboard.
fn watched<T: Send>(
    work: impl FnOnce() -> T + Send,
    look: &(impl Fn(Python<'_>) -> PyResult<()> + Sync),
) -> PyResult<std::thread::Result<T>> {
    std::thread::scope(|scope| {
        let (done, finished) = channel();
        scope.spawn(move || {
            // Whoever waits for it is there.
            let _ = done.send(catch_unwind(AssertUnwindSafe(work)));
        });
        loop {
            match finished.recv_timeout(LOOK) {
                Ok(found) => return Ok(found),
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(interrupt) = Python::attach(look) {
                        let halt = Halt::new();
                        let _ = finished.recv();
                        drop(halt);
                        return Err(interrupt);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err("a thread ended without a result"));
                }
            }
        }
    })
}

/// A panic is a defect of this package.
fn fault(payload: &(dyn Any + Send)) -> PyErr {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or(payload.downcast_ref::<String>().map(String::as_str));
    let text = text.unwrap_or("no message");
    PyRuntimeError::new_err(format!("a defect of delta_cal, please report it: {text}"))
}

fn cores() -> PyResult<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let process = std::process::id();
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, own)) = pool.as_ref().filter(|(of, _)| *of == process) {
        return Ok(Arc::clone(own));
    }
    let new = ThreadPoolBuilder::new()
        .thread_name(|index| format!("delta-cal {index}"))
        .build()
        .map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    let new = Arc::new(new);
    // The pool of the parent process has no threads here that could be told to end.
    std::mem::forget(pool.replace((process, Arc::clone(&new))));
    Ok(new)
}
