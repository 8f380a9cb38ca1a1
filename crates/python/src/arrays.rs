//! Poses and stamps between numpy and the library.

use dose3::lie::{Matrix, Pose, Rotation, Vector};
use dose3::nalgebra::{Quaternion, UnitQuaternion};
use dose3_datasets::Error;
use numpy::ndarray::{
    Array2, Array3, ArrayView, ArrayView1, ArrayView2, ArrayView3, Ix2, Ix3, ShapeBuilder,
};
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use std::mem::{offset_of, size_of};

/// How far the norm of a quaternion may be from 1, as for files.
const QUATERNION_TOLERANCE: f64 = 1e-2;

/// Rotations as they were given.
pub enum Rotations<'a> {
    /// `[n, 4]`, x, y, z, w.
    Quaternions(ArrayView2<'a, f64>),
    /// `[n, 3, 3]`.
    Matrices(ArrayView3<'a, f64>),
}

/// Poses of a log from positions `[n, 3]` and rotations. Quaternions are normalised; matrices are taken as they are,
/// [`Trajectory::from_poses`](dose3::Trajectory::from_poses) checks them.
///
/// # Errors
/// A quaternion that is none, with the index of its pose.
pub fn poses(
    name: &str,
    positions: ArrayView2<'_, f64>,
    rotations: &Rotations<'_>,
) -> Result<Vec<Pose>, Error> {
    let fault = |pose: usize, expected: &'static str, found: String| Error::Memory {
        name: name.to_owned(),
        pose,
        expected,
        found,
    };
    let rotation = |i: usize| match rotations {
        Rotations::Quaternions(all) => {
            let [x, y, z, w] = [0, 1, 2, 3].map(|axis| all[[i, axis]]);
            let quaternion = Quaternion::new(w, x, y, z);
            let norm = quaternion.norm();
            let error = (norm - 1.0).abs();
            if error.is_nan() || error > QUATERNION_TOLERANCE {
                let found = format!("norm {norm:.6} of ({x}, {y}, {z}, {w}) (x, y, z, w)");
                return Err(fault(i, "a unit quaternion", found));
            }
            Ok(UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix())
        }
        Rotations::Matrices(all) => {
            let matrix = Matrix::from_fn(|row, column| all[[i, row, column]]);
            Ok(Rotation::from_matrix_unchecked(matrix))
        }
    };
    let pose = |i: usize| {
        let position = Vector::from_fn(|axis, _| positions[[i, axis]]);
        Ok(Pose::new(rotation(i)?, position))
    };
    (0..positions.nrows()).map(pose).collect()
}

/// Homogeneous matrices `[n, 4, 4]`.
pub fn matrices(poses: &[Pose]) -> Array3<f64> {
    let mut out = Array3::zeros((poses.len(), 4, 4));
    for (mut out, pose) in out.outer_iter_mut().zip(poses) {
        let matrix = pose.matrix();
        out.indexed_iter_mut()
            .for_each(|((row, column), value)| *value = matrix[(row, column)]);
    }
    out
}

/// Stamps as a read-only view into what `owner` keeps.
///
/// # Safety
/// `owner` keeps `stamps` alive and unchanged for as long as it lives.
pub unsafe fn stamps_of<'py>(
    stamps: &[i64],
    owner: Bound<'py, PyAny>,
) -> Bound<'py, PyArray1<i64>> {
    // SAFETY: as the caller promises.
    unsafe { view(ArrayView1::from(stamps), owner) }
}

/// Numbers per pose between two poses, and from the pose's start to its translation and rotation.
const STEP: usize = size_of::<Pose>() / size_of::<f64>();
const TRANSLATION: usize = offset_of!(Pose, translation) / size_of::<f64>();
const ROTATION: usize = offset_of!(Pose, rotation) / size_of::<f64>();
const _: () = assert!(size_of::<Pose>() == 12 * size_of::<f64>());

/// Positions `[n, 3]` as a read-only view into poses that `owner` keeps.
///
/// # Safety
/// As [`stamps_of`].
pub unsafe fn positions_of<'py>(
    poses: &[Pose],
    owner: Bound<'py, PyAny>,
) -> Bound<'py, PyArray2<f64>> {
    let shape = Ix2(poses.len(), 3).strides(Ix2(STEP, 1));
    // SAFETY: a pose is twelve numbers, of which three in a row are its translation.
    unsafe {
        let first = poses.as_ptr().cast::<f64>().add(TRANSLATION);
        view(ArrayView::from_shape_ptr(shape, first), owner)
    }
}

/// Rotation matrices `[n, 3, 3]` as a read-only view into poses that `owner` keeps.
///
/// # Safety
/// As [`stamps_of`].
pub unsafe fn rotations_of<'py>(
    poses: &[Pose],
    owner: Bound<'py, PyAny>,
) -> Bound<'py, PyArray3<f64>> {
    let shape = Ix3(poses.len(), 3, 3).strides(Ix3(STEP, 1, 3));
    // SAFETY: a pose is twelve numbers, of which nine in a row are its matrix, column after column.
    unsafe {
        let first = poses.as_ptr().cast::<f64>().add(ROTATION);
        view(ArrayView::from_shape_ptr(shape, first), owner)
    }
}

/// Homogeneous matrices as a read-only view into what `owner` keeps.
///
/// # Safety
/// As [`stamps_of`].
pub unsafe fn matrices_of<'py>(
    matrices: &Array3<f64>,
    owner: Bound<'py, PyAny>,
) -> Bound<'py, PyArray3<f64>> {
    // SAFETY: as the caller promises.
    unsafe { view(matrices.view(), owner) }
}

/// # Safety
/// `owner` keeps what `array` looks at.
unsafe fn view<'py, T: Element, D: numpy::ndarray::Dimension>(
    array: ArrayView<'_, T, D>,
    owner: Bound<'py, PyAny>,
) -> Bound<'py, PyArray<T, D>> {
    // SAFETY: as the caller promises.
    let view = unsafe { PyArray::borrow_from_array(&array, owner) };
    // Others look at the same numbers.
    view.readwrite().make_nonwriteable();
    view
}

/// Quaternions `[n, 4]`, x, y, z, w with w not negative.
pub fn quaternions(poses: &[Pose]) -> Array2<f64> {
    let mut out = Array2::zeros((poses.len(), 4));
    for (mut out, pose) in out.outer_iter_mut().zip(poses) {
        let q = UnitQuaternion::from_rotation_matrix(&pose.rotation);
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        for (value, entry) in out.iter_mut().zip([q.i, q.j, q.k, q.w]) {
            *value = sign * entry;
        }
    }
    out
}
