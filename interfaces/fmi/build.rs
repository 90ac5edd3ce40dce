//! Compiles the one function that Rust cannot define: the variadic logger of FMI 2.0.

fn main() {
    println!("cargo::rerun-if-changed=src/instance/logger.c");
    cc::Build::new().file("src/instance/logger.c").warnings(true).compile("terraglue_fmi_logger");
}
