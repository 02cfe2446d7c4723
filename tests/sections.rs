//! Sections at closings: against the closed form of a mass that swings against an elastic stop.

use std::collections::BTreeSet;

use tempfile::TempDir;

use crate::common::{json, refused};

/// Dots of a picture, each place once, in pixels; and how many there are.
fn dots(svg: &str) -> (BTreeSet<(i64, i64)>, usize) {
    let number = |tag: &str, name: &str| -> i64 {
        let value = tag.split(&format!("{name}=\"")).nth(1).unwrap().split('"').next().unwrap();
        value.parse::<f64>().unwrap().round() as i64
    };
    let tags: Vec<&str> = svg.split("<circle").skip(1).collect();
    let places = tags.iter().map(|tag| (number(tag, "cx"), number(tag, "cy"))).collect();
    (places, tags.len())
}

#[test]
fn a_free_swing_closes_at_one_place_of_its_section() {
    let folder = TempDir::new().unwrap();
    let scene = |gap: f64| {
        format!(
            "title = \"swing\"\n[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [1]\nyoung = 1.0\ndensity = 3.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
             [contact]\nedge = \"right\"\ngap = {gap:?}\nmethod = \"penalty\"\nstiffness = 20.0\n\
             [initial]\ndisplacement = [\"-x\"]\n[run]\nuntil = 40.0\nsamples = 100\n"
        )
    };
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let write = |gap: f64| {
        std::fs::write(at("swing.toml"), scene(gap)).unwrap();
        at("swing.toml")
    };
    let path = write(0.0);
    json(&["run", &path, "-o", &at("swing.h5")]);
    json(&["plot", &at("swing.h5"), "--only", "section", "-o", &at("swing")]);
    let svg = std::fs::read_to_string(at("swing-section.svg")).unwrap();
    // first after a quarter of the swing, then after each π + π/√21
    let period = std::f64::consts::PI * (1.0 + 1.0 / 21.0f64.sqrt());
    let closings = 1 + ((40.0 - 0.5 * std::f64::consts::PI) / period) as usize;
    assert!(svg.contains(&format!("{closings} of them")), "{closings}");
    let (places, count) = dots(&svg);
    assert_eq!((places.len(), count), (2, closings - 1 + closings - 2));
    // one that never closes has none
    let path = write(2.0);
    json(&["run", &path, "-o", &at("swing.h5"), "--force"]);
    refused(&["plot", &at("swing.h5"), "--only", "section"], "closes three times");
}
