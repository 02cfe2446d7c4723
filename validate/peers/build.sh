#!/bin/sh
# Builds target/peers/diffsol_peer, and, where SUNDIALS can be had, target/peers/sundials_peer: with the distribution's SUNDIALS if it is installed, otherwise with its packages unpacked beside it (no root needed).
set -eu
cd "$(dirname "$0")/../.."
out=target/peers
mkdir -p "$out"
RUSTFLAGS="-C target-cpu=native" ${CARGO:-cargo} build --release --quiet --locked --manifest-path validate/peers/diffsol/Cargo.toml --target-dir "$out/diffsol"
cp "$out/diffsol/release/diffsol_peer" "$out/diffsol_peer"
echo "peers: $out/diffsol_peer"
flags="-O3 -march=native"
if echo '#include <arkode/arkode_erkstep.h>' | ${CC:-cc} -E - >/dev/null 2>&1; then
    include=""
    libraries="-lsundials_cvode -lsundials_arkode -lsundials_nvecserial -lsundials_sunnonlinsolfixedpoint -lm"
else
    if [ ! -d "$out/sundials/usr/include/arkode" ]; then
        rm -rf "$out/packages" && mkdir -p "$out/packages"
        if ! (cd "$out/packages" && command -v apt-get && apt-get download -q libsundials-dev) >/dev/null; then
            rm -f "$out/sundials_peer"
            echo "SKIPPED: no SUNDIALS: install it with its headers (Debian: libsundials-dev), then run this again" >&2
            exit 0
        fi
        for package in "$out"/packages/*.deb; do dpkg -x "$package" "$out/sundials"; done
    fi
    root=$out/sundials/usr
    include="-I$root/include"
    # its own libraries are linked in: nothing has to be found when it runs
    libraries=""
    for name in cvode arkode nvecserial sunnonlinsolfixedpoint generic; do
        found=$(find "$root/lib" -name "libsundials_$name.a" | head -n 1)
        libraries="$libraries $found"
    done
    libraries="$libraries -lm"
fi
# shellcheck disable=SC2086
${CC:-cc} $flags $include validate/peers/sundials_peer.c -o "$out/sundials_peer" $libraries
echo "peers: $out/sundials_peer"
