//! What one begins with: scenes to change, completions, manual pages.

use std::process::Command;

use crate::common::{json, run};

/// Every kind of new scene runs as it is, and nothing is overwritten.
#[test]
fn new_scenes_run_as_they_are() {
    let place = tempfile::tempdir().unwrap();
    let signorini = |words: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_signorini"))
            .args(words)
            .current_dir(place.path())
            .output()
            .unwrap()
    };
    for kind in ["bar", "plate", "mesh", "space", "response", "matrices"] {
        let made = signorini(&["new", kind, "mine"]);
        assert!(made.status.success(), "{kind}: {}", String::from_utf8_lossy(&made.stderr));
        let text = std::fs::read_to_string(place.path().join("mine.toml")).unwrap();
        assert!(text.starts_with("# ") && !text.contains("\"NAME"), "{text}");
        let ran = signorini(&["run", "mine.toml", "--force", "--json"]);
        assert!(ran.status.success(), "{kind}: {}", String::from_utf8_lossy(&ran.stderr));
        let answer: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
        assert!(!answer["switches"].as_array().unwrap().is_empty(), "{kind} touches nothing");
        // a second one with the same name is refused, and leaves everything as it is
        let again = signorini(&["new", kind, "mine"]);
        assert_eq!(again.status.code(), Some(2), "{kind}");
        assert_eq!(std::fs::read_to_string(place.path().join("mine.toml")).unwrap(), text);
        for entry in std::fs::read_dir(place.path()).unwrap() {
            std::fs::remove_file(entry.unwrap().path()).unwrap();
        }
    }
}

/// Shells and `man` know every command.
#[test]
fn completions_and_manual_pages_know_every_command() {
    let text = |words: &[&str]| String::from_utf8(run(words).stdout).unwrap();
    let help = text(&["--help"]);
    let commands: Vec<&str> = help
        .lines()
        .skip_while(|l| !l.starts_with("Commands:"))
        .skip(1)
        .take_while(|l| !l.is_empty())
        .filter_map(|l| {
            l.strip_prefix("  ")?.split_whitespace().next().filter(|_| !l.starts_with("   "))
        })
        .filter(|c| *c != "help")
        .collect();
    assert!(commands.len() >= 17, "{commands:?}");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = text(&["completions", shell]);
        commands.iter().for_each(|c| assert!(script.contains(c), "{shell}: {c}"));
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().to_str().unwrap();
    assert!(run(&["man", "--to", folder]).status.success());
    for command in &commands {
        let page = std::fs::read_to_string(place.path().join(format!("signorini-{command}.1")));
        assert!(page.unwrap().contains(".SH SYNOPSIS"), "{command}");
    }
    assert!(text(&["man"]).starts_with(".ie"));
}

/// A run goes on from the last state of another one: under every contact method, whether its file holds what is but seen of the contact or not (time stepping, whose steps fall otherwise, begins).
#[test]
fn runs_go_on_from_the_state_of_another() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    for method in
        ["nbm", "mass-redistribution", "penalty", "nitsche", "stop", "impact", "moreau-jean"]
    {
        for edge in ["bottom", "right"] {
            let stop = if method == "stop" { "stiffness = 20.0\n" } else { "" };
            let scene = |name: &str, begin: &str, until: f64| {
                let text = format!(
                    "[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
                     [contact]\nedge = '{edge}'\ngap = 0.1\nmethod = '{method}'\n{stop}[initial]\n{begin}\n[run]\nuntil = {until:?}\n"
                );
                std::fs::write(at(name), text).unwrap();
                at(name)
            };
            let thrown = "velocity = ['0.3*x', '-0.1*x']";
            let run = |scene: &str, file: &str| json(&["run", scene, "-o", &at(file), "--force"]);
            run(&scene("first.toml", thrown, 1.0), "first.h5");
            let rest = run(&scene("rest.toml", "file = 'first.h5'", 1.0), "rest.h5");
            let whole = run(&scene("whole.toml", thrown, 2.0), "whole.h5");
            if method == "moreau-jean" {
                continue;
            }
            // the books of both parts are those of the whole
            let energy = |v: &serde_json::Value| v["energy_end"].as_f64().unwrap();
            assert!(
                (energy(&rest) / energy(&whole) - 1.0).abs() < 1e-6,
                "{method} {edge}: {} {}",
                energy(&rest),
                energy(&whole)
            );
        }
    }
}
