#!/bin/sh
# For cargo as RUSTC_WRAPPER: the crates that are looked into get counters on every edge and see what is compared with what (the flags of `cargo fuzz --sanitizer none`,
# which stable Rust takes); all others are built as ever.
case " $* " in
*" --crate-name signorini "* | *" --crate-name signorini_fuzz "*)
    exec "$@" --cfg fuzzing -Ccodegen-units=4 -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
        -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares
    ;;
*) exec "$@" ;;
esac
