//! Compiles the C of the numeric inverse, without contraction, where its feature is on.

fn main() {
    #[cfg(feature = "numeric-inverse")]
    cc::Build::new()
        .flag_if_supported("-std=c99")
        .flag_if_supported("-ffp-contract=off")
        .flag_if_supported("-fno-tree-slp-vectorize")
        .include("csrc")
        .file("csrc/ur5.c")
        .file("csrc/ur5_numeric_inverse.c")
        .file("csrc/ur5_f32.c")
        .file("csrc/ur5_f32_numeric_inverse.c")
        .compile("ur5_numeric_inverse");
    println!("cargo:rerun-if-changed=csrc");
}
