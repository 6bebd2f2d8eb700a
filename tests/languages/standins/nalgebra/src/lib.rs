//! A stand-in for the crate of the same name, written for tests. SPDX-License-Identifier: MIT
#![no_std]

use core::fmt::Debug;
use core::ops::Index;

pub trait Scalar: 'static + Clone + PartialEq + Debug {}

impl<T: 'static + Clone + PartialEq + Debug> Scalar for T {}

/// R rows and C columns, column after column.
#[derive(Clone, Debug, PartialEq)]
pub struct SMatrix<T, const R: usize, const C: usize> {
    columns: [[T; R]; C],
}

impl<T: Scalar, const R: usize, const C: usize> SMatrix<T, R, C> {
    pub fn from_fn<F: FnMut(usize, usize) -> T>(mut entry: F) -> Self {
        let columns = core::array::from_fn(|column| core::array::from_fn(|row| entry(row, column)));
        SMatrix { columns }
    }
}

impl<T, const R: usize, const C: usize> Index<(usize, usize)> for SMatrix<T, R, C> {
    type Output = T;

    fn index(&self, (row, column): (usize, usize)) -> &T {
        &self.columns[column][row]
    }
}
