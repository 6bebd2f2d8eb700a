//! Joint values for a pose, also for arms without a closed form: damped least squares, in C.
//!
//! The C files in `csrc` are those that a build of C verifies; `cc` compiles them. The header there is the manual: method,
//! worst case, and what the options mean.
#![allow(unsafe_code)]

use crate::DOF;

/// Options of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Search {
    /// Tolerance of the distance to the target, in m.
    pub position_tolerance: f32,
    /// Tolerance of the angle to the target, in rad.
    pub rotation_tolerance: f32,
    /// Descents after the first.
    pub restarts: i32,
    /// Of the random starts; the same seed gives the same search.
    pub seed: u32,
    /// Most evaluations of the kernel in a call; 0: only restarts bound it.
    pub budget: i32,
    /// Most steps of a descent; 0 means the largest value.
    pub steps: i32,
}

impl Default for Search {
    fn default() -> Self {
        let (position_tolerance, rotation_tolerance) = (1e-05, 1e-05);
        Self { position_tolerance, rotation_tolerance, restarts: 10, seed: 1, budget: 0, steps: 0 }
    }
}

/// What a search found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Whether both errors are within their tolerances.
    pub is_solution: bool,
    /// Joint vector, within the limits; the nearest that was found if none is within the tolerances.
    pub q: [f32; DOF],
    /// Distance to the target, in m.
    pub position_error: f32,
    /// Angle to the target, in rad.
    pub rotation_error: f32,
    /// Steps of all descents.
    pub iterations: i32,
    /// The first descent and restarts.
    pub descents: i32,
}

/// The result in C.
#[repr(C)]
struct Errors {
    position_error: f32,
    rotation_error: f32,
    iterations: i32,
    descents: i32,
}

extern "C" {
    fn ur5_f32_numeric_inverse(
        base_T_tool: &[[f32; 4]; 4],
        start: &[f32; DOF],
        search: &Search,
        q: &mut [f32; DOF],
        found: &mut Errors,
    ) -> i32;
}

/// Joint values for a pose of the tool in the base frame.
///
/// - `base_T_tool`: the target, 4x4 matrix, with a proper rotation
/// - `start`: joint vector of the first descent; an entry that is not finite counts as the middle of its range
/// - `search`: how to search
///
/// A target that is not a pose gives no solution at once, with errors of 1e30 and the start in `q`.
#[must_use]
pub fn numeric_inverse(base_T_tool: &[[f32; 4]; 4], start: &[f32; DOF], search: &Search) -> Found {
    let mut q = [0.0; DOF];
    let mut errors = Errors { position_error: 0.0, rotation_error: 0.0, iterations: 0, descents: 0 };
    // SAFETY: the function reads and writes its arguments alone, whose layouts are those of the header.
    #[rustfmt::skip]
    let solved = unsafe { ur5_f32_numeric_inverse(base_T_tool, start, search, &mut q, &mut errors) };
    Found {
        is_solution: solved == 1,
        q,
        position_error: errors.position_error,
        rotation_error: errors.rotation_error,
        iterations: errors.iterations,
        descents: errors.descents,
    }
}
