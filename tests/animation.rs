//! Animations: every frame is there, of one size, and the file says who made it.

use std::collections::BTreeMap;

use crate::common::{root, run};

/// Names of the chunks of a PNG and how often each stands there; the data of the first of each.
fn chunks(bytes: &[u8]) -> BTreeMap<String, (usize, Vec<u8>)> {
    let mut found: BTreeMap<String, (usize, Vec<u8>)> = BTreeMap::new();
    let mut at = 8;
    while at + 8 <= bytes.len() {
        let length = u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let name = String::from_utf8(bytes[at + 4..at + 8].to_vec()).unwrap();
        let data = bytes[at + 8..at + 8 + length].to_vec();
        let crc = u32::from_be_bytes(bytes[at + 8 + length..at + 12 + length].try_into().unwrap());
        assert_eq!(crc32fast::hash(&bytes[at + 4..at + 8 + length]), crc, "{name}");
        found.entry(name).or_insert((0, data)).0 += 1;
        at += 12 + length;
    }
    found
}

#[test]
fn a_run_plays_and_a_family_does_not() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let scene = root().join("scenarios/bar.toml");
    assert!(run(&["run", scene.to_str().unwrap(), "-o", &at("bar.h5"), "-q"]).status.success());
    let words = ["plot", &at("bar.h5"), "--animate", "--frames", "7", "--dpi", "48"];
    for _ in 0..2 {
        // its own may be drawn anew
        let done = run(&words);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    let found = chunks(&std::fs::read(at("bar-shapes.apng")).unwrap());
    assert_eq!(found["acTL"].1[..4], 7u32.to_be_bytes());
    assert_eq!((found["fcTL"].0, found["tEXt"].1.as_slice()), (7, &b"Software\0signorini"[..]));
    assert!(found["IHDR"].1[..4] != [0; 4] && found["fdAT"].0 >= 6);
    // what is not its own stays
    std::fs::write(at("bar-shapes.apng"), "mine").unwrap();
    assert_eq!(run(&words).status.code(), Some(2));
    let scene = root().join("scenarios/half-plate-orbit.toml");
    let out = at("family.h5");
    assert!(
        run(&["backbone", scene.to_str().unwrap(), "-o", &out, "--step", "0.05"]).status.success()
    );
    assert_eq!(run(&["plot", &out, "--animate"]).status.code(), Some(2));
}
