//! Arrays of numpy as slices of points and indices, and back.
//!
//! `medial_axis/_arrays.py` has checked kind and shape, and made them contiguous where they were not; here they are
//! borrowed. An array that a thread reads stays alive as long as that thread ([`Held`]).

#![allow(unsafe_code)] // Memory that numpy owns cannot be borrowed without.

use std::sync::OnceLock;

use medial::Vec3;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::error::Failure;

/// Rows of an array, which live as long as this does, on whichever thread.
pub struct Held<T: 'static> {
    rows: *const T,
    len: usize,
    _array: Py<PyAny>,
}

// Safety: the rows are only read, and numpy keeps them where they are while a reference exists.
unsafe impl<T: Sync> Send for Held<T> {}
unsafe impl<T: Sync> Sync for Held<T> {}

impl<T> Held<T> {
    /// The rows.
    pub fn rows(&self) -> &[T] {
        // Safety: pointer and length come from a contiguous array that `_array` keeps alive.
        unsafe { std::slice::from_raw_parts(self.rows, self.len) }
    }
}

/// The rows of an n x 3 array as points.
///
/// # Errors
/// When the array is not contiguous or has another shape.
pub fn points(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Held<Vec3>> {
    triples(array)
}

/// The rows of an n x 3 array as triangles.
///
/// # Errors
/// As [`points`].
pub fn triangles(array: &PyReadonlyArray2<'_, u32>) -> PyResult<Held<[u32; 3]>> {
    triples(array)
}

/// An n x 3 array as `Row`, which has to be three `T` in memory.
fn triples<T: Element, Row>(array: &PyReadonlyArray2<'_, T>) -> PyResult<Held<Row>> {
    const { assert!(size_of::<Row>() == 3 * size_of::<T>() && align_of::<Row>() == align_of::<T>()) };
    let slice = array.as_slice()?;
    if array.as_array().ncols() != 3 {
        return Err(Failure::input("an array without three columns").into());
    }
    Ok(Held {
        rows: slice.as_ptr().cast(),
        len: slice.len() / 3,
        _array: array.as_any().clone().unbind(),
    })
}

/// The numbers of an array.
///
/// # Errors
/// When the array is not contiguous.
pub fn numbers(array: &PyReadonlyArray1<'_, f64>) -> PyResult<Held<f64>> {
    let slice = array.as_slice()?;
    Ok(Held { rows: slice.as_ptr(), len: slice.len(), _array: array.as_any().clone().unbind() })
}

/// A new array of points, n x 3.
pub fn of_points<'py>(
    py: Python<'py>,
    points: impl ExactSizeIterator<Item = Vec3>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    of_rows(py, points.map(|point| point.to_array()))
}

/// A new array with these rows.
pub fn of_rows<'py, T: Element + Copy, const N: usize>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = [T; N]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let count = rows.len();
    let flat: Vec<T> = rows.flatten().collect();
    PyArray1::from_vec(py, flat).reshape([count, N])
}

/// An array that is made when it is first asked for; it cannot be written to, since others see it too.
#[derive(Default)]
pub struct Once(OnceLock<Py<PyAny>>);

impl Once {
    /// The array.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn get<'py, A>(
        &self,
        py: Python<'py>,
        make: impl FnOnce() -> PyResult<Bound<'py, A>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if let Some(known) = self.0.get() {
            return Ok(known.bind(py).clone());
        }
        let made = make()?.into_any();
        made.getattr("flags")?.setattr("writeable", false)?;
        Ok(self.0.get_or_init(|| made.unbind()).bind(py).clone())
    }
}
