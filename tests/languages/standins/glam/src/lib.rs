//! A stand-in for the crate of the same name, written for tests. SPDX-License-Identifier: MIT
#![no_std]

macro_rules! matrix {
    ($name:ident, $number:ty) => {
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name([[$number; 4]; 4]);

        impl $name {
            pub fn from_cols_array_2d(columns: &[[$number; 4]; 4]) -> Self {
                $name(*columns)
            }

            pub fn to_cols_array_2d(&self) -> [[$number; 4]; 4] {
                self.0
            }

            pub fn to_cols_array(&self) -> [$number; 16] {
                core::array::from_fn(|i| self.0[i / 4][i % 4])
            }

            pub fn transpose(&self) -> Self {
                $name(core::array::from_fn(|row| core::array::from_fn(|column| self.0[column][row])))
            }
        }
    };
}

matrix!(Mat4, f32);
matrix!(DMat4, f64);
