//! Commands that a program calls as functions: what one is asked for says nothing of the next.

use std::sync::Arc;

use crate::common::root;
use signorini::cli::{Call, Desk, call};

/// The command on record is the call, and not that of the program that calls; each has its own number of threads.
#[test]
fn a_call_is_on_record_as_it_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let scene = root().join("scenarios/bar.toml").display().to_string();
    let mut sets = vec![];
    for threads in ["1", "2", "1"] {
        let file = folder.path().join(format!("{threads}-{}.h5", sets.len()));
        let words = ["run", &scene, "--threads", threads, "-o", file.to_str().unwrap()];
        let arguments: Vec<String> = words.iter().map(|w| w.to_string()).collect();
        let made = Call { arguments, ..Call::default() };
        let said = call(made, Arc::new(Desk::default()));
        assert!(said.is_ok(), "{:?}", said.err());
        let opened = crate::common::hdf5_files().open(&file).unwrap();
        let command = opened.attr("command").unwrap();
        let command = command.read_scalar::<hdf5::types::VarLenUnicode>().unwrap();
        assert_eq!(command.as_str(), format!("signorini {}", words.join(" ")));
        sets.push(crate::common::datasets(&file));
    }
    assert!(sets[0] == sets[1] && sets[1] == sets[2]);
}

/// Families are computed on the threads of their call, one thread included, with nobody waiting for another.
#[test]
fn a_family_is_computed_on_the_threads_of_its_call() {
    let folder = tempfile::tempdir().unwrap();
    let scene = root().join("scenarios/half-plate-orbit.toml").display().to_string();
    let of = |threads: &str| {
        let file = folder.path().join(format!("{threads}.h5"));
        let words = [
            "backbone",
            &scene,
            "--method",
            "hbm",
            "--harmonics",
            "1,3",
            "--range",
            "1.78,1.80",
            "--threads",
            threads,
            "-o",
            file.to_str().unwrap(),
        ];
        let arguments = words.iter().map(|w| w.to_string()).collect();
        let made = Call { arguments, ..Call::default() };
        let said = call(made, Arc::new(Desk::default()));
        assert!(said.is_ok(), "{:?}", said.err());
        crate::common::datasets(&file)
    };
    assert!(of("1") == of("3"));
}
