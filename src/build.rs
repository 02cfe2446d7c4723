//! Cargo reads `[build-dependencies]` of packages that have a build script.

fn main() {
    println!("cargo:rerun-if-changed=src/build.rs");
}
