//! Matrices of other crates: `nalgebra` and `glam`, each behind the feature of its name.

/// Any matrix of this crate, such as a pose or a Jacobian, as one of nalgebra.
#[cfg(feature = "nalgebra")]
#[must_use]
pub fn to_nalgebra<T: nalgebra::Scalar, const R: usize, const C: usize>(
    matrix: &[[T; C]; R],
) -> nalgebra::SMatrix<T, R, C> {
    nalgebra::SMatrix::from_fn(|row, column| matrix[row][column].clone())
}

/// A matrix of nalgebra, such as a target (`isometry.to_homogeneous()`), as one of this crate.
#[cfg(feature = "nalgebra")]
#[must_use]
pub fn from_nalgebra<T: nalgebra::Scalar, const R: usize, const C: usize>(
    matrix: &nalgebra::SMatrix<T, R, C>,
) -> [[T; C]; R] {
    core::array::from_fn(|row| core::array::from_fn(|column| matrix[(row, column)].clone()))
}

/// A pose as a matrix of glam.
#[cfg(feature = "glam")]
#[must_use]
pub fn to_glam(pose: &[[f64; 4]; 4]) -> glam::DMat4 {
    glam::DMat4::from_cols_array_2d(pose).transpose()
}

/// A matrix of glam as a pose.
#[cfg(feature = "glam")]
#[must_use]
pub fn from_glam(pose: &glam::DMat4) -> [[f64; 4]; 4] {
    pose.transpose().to_cols_array_2d()
}

/// A pose in single precision as a matrix of glam.
#[cfg(feature = "glam")]
#[must_use]
pub fn to_glam_f32(pose: &[[f32; 4]; 4]) -> glam::Mat4 {
    glam::Mat4::from_cols_array_2d(pose).transpose()
}

/// A matrix of glam in single precision as a pose.
#[cfg(feature = "glam")]
#[must_use]
pub fn from_glam_f32(pose: &glam::Mat4) -> [[f32; 4]; 4] {
    pose.transpose().to_cols_array_2d()
}
