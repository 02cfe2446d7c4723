//! Results are neither lost nor changed: resumed, interrupted, on a full disk, over other files, by several processes.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Output, Stdio};

use crate::common::{datasets, program, root, wait_until};
use tempfile::TempDir;

const SCENE: &str = "scenarios/half-plate-orbit.toml";

fn run(arguments: &[&str]) -> Output {
    program().args(arguments).output().unwrap()
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Run, and expect an exit code.
fn expect(code: i32, arguments: &[&str]) -> Output {
    let output = run(arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", text(&output));
    assert!(!text(&output).contains("panicked"), "{arguments:?}: {}", text(&output));
    output
}

fn at(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

fn omegas(file: &str) -> Vec<(f64, f64)> {
    let file = crate::common::hdf5_files().open(file).unwrap();
    let column = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap();
    column("backbone/branch").into_iter().zip(column("backbone/omega")).collect()
}

fn status(file: &str) -> String {
    let file = crate::common::hdf5_files().open(file).unwrap();
    let text = file.attr("status").unwrap().read_scalar::<hdf5::types::VarLenUnicode>().unwrap();
    text.as_str().to_owned()
}

/// review.md N1: a finished harmonic-balance backbone, with gaps in it, resumed: no byte of a dataset changes.
#[test]
fn resuming_a_finished_family_changes_nothing() {
    let folder = TempDir::new().unwrap();
    let file = at(&folder, "hbm.h5");
    let command = [
        "backbone",
        SCENE,
        "--method",
        "hbm",
        "--harmonics",
        "1,3,7",
        "--range",
        "1.6,1.9",
        "-o",
        &file,
        "-q",
    ];
    expect(0, &command);
    let before = std::fs::read(&file).unwrap();
    assert_eq!(omegas(&file).len(), 183);
    expect(0, &[&command[..], &["--resume"]].concat());
    assert!(std::fs::read(&file).unwrap() == before, "the file changed");
    let file = at(&folder, "arc.h5");
    let command = [
        "backbone",
        SCENE,
        "--follow",
        "arclength",
        "--omega",
        "1.8",
        "--range",
        "1.75,1.85",
        "--points",
        "12",
        "-o",
        &file,
        "-q",
    ];
    expect(0, &command);
    let before = std::fs::read(&file).unwrap();
    expect(0, &[&command[..], &["--resume"]].concat());
    assert!(std::fs::read(&file).unwrap() == before, "the file changed");
}

/// review.md N2: a wider range on the same grid extends without holes and repeats; any other is refused.
#[test]
fn a_wider_range_extends_and_any_other_is_refused() {
    let folder = TempDir::new().unwrap();
    for method in [&["--method", "hbm", "--harmonics", "1,5"][..], &[]] {
        let file = at(&folder, "grid.h5");
        let base = [&["backbone", SCENE, "-o", &file, "-q", "--range"], method].concat();
        let with = |range: &str| {
            let mut list: Vec<String> = base.iter().map(|s| s.to_string()).collect();
            list.insert(6, range.to_owned());
            list
        };
        let call = |code: i32, range: &str, more: &[&str]| {
            let list = with(range);
            let list: Vec<&str> =
                list.iter().map(String::as_str).chain(more.iter().copied()).collect();
            expect(code, &list)
        };
        call(0, "1.80,1.82", &["--force"]);
        let known = omegas(&file);
        call(0, "1.785,1.83", &["--resume"]);
        let branches = known.iter().map(|p| p.0 as usize).max().unwrap() + 1;
        for branch in 0..branches {
            let of: Vec<f64> =
                omegas(&file).iter().filter(|p| p.0 as usize == branch).map(|p| p.1).collect();
            assert_eq!(of.len(), 10, "{of:?}");
            for (k, w) in of.iter().enumerate() {
                assert!((w - (1.785 + 0.005 * k as f64)).abs() < 1e-12, "{of:?}");
            }
        }
        assert_eq!(status(&file), "complete");
        let before = std::fs::read(&file).unwrap();
        for (range, words) in
            [("1.80,1.83", "is less"), ("1.7861,1.83", "none of them"), ("1.785,1.82", "is less")]
        {
            let refused = call(2, range, &["--resume"]);
            assert!(text(&refused).contains(words), "{range}: {}", text(&refused));
        }
        for more in [&["--step", "0.01"][..], &["--follow", "arclength", "--omega", "1.8"]] {
            let refused = call(2, "1.785,1.83", &[&["--resume"], more].concat());
            assert!(text(&refused).contains("other options"), "{}", text(&refused));
        }
        assert!(std::fs::read(&file).unwrap() == before);
        std::fs::remove_file(&file).unwrap();
    }
}

/// A family that is widened upwards is, to the last bit, the one that was asked for in one go.
#[test]
fn a_family_that_is_widened_equals_one_in_one_go() {
    let folder = TempDir::new().unwrap();
    let wider = [&["--range", "1.68,1.72"][..], &["--range", "1.68,1.76"]];
    let longer =
        [&["--range", "1.68,1.9", "--points", "5"][..], &["--range", "1.68,1.9", "--points", "9"]];
    for (name, options, [first, then]) in [
        ("hbm", &["--method", "hbm", "--harmonics", "3,7"][..], wider),
        (
            "hbm-arc",
            &["--method", "hbm", "--harmonics", "5", "--follow", "arclength", "--omega", "1.7"],
            wider,
        ),
        ("arc", &["--follow", "arclength", "--omega", "1.8"], longer),
    ] {
        let (whole, parts) =
            (at(&folder, &format!("{name}-whole.h5")), at(&folder, &format!("{name}-parts.h5")));
        let command = |file: &str, more: &[&str]| {
            expect(0, &[&["backbone", SCENE, "-q", "-o", file], options, more].concat());
        };
        command(&whole, then);
        command(&parts, first);
        command(&parts, &[then, &["--resume"]].concat());
        assert!(datasets(Path::new(&whole)) == datasets(Path::new(&parts)), "{name}");
    }
}

/// hostile.md A5: a digit changed in the journal, or a line taken away, is told, and what stands behind is computed again.
#[test]
fn a_damaged_journal_is_told_and_mended() {
    let folder = TempDir::new().unwrap();
    let whole = at(&folder, "whole.h5");
    let command = |file: &str| {
        [
            "backbone",
            SCENE,
            "--method",
            "hbm",
            "--harmonics",
            "3,7",
            "--range",
            "1.74,1.80",
            "-o",
            file,
        ]
        .map(str::to_owned)
    };
    let call = |file: &str, more: &[&str]| {
        let list = command(file);
        let list: Vec<&str> = list.iter().map(String::as_str).chain(more.iter().copied()).collect();
        expect(0, &list)
    };
    call(&whole, &["-q"]);
    // the journal of a run that was killed: it stands still behind its eighth point until these are written
    let cut = at(&folder, "cut.h5");
    let list = command(&cut);
    let words = [&list.each_ref().map(String::as_str)[..], &["-q", "--threads", "1"]].concat();
    let mut held = Held::at(8, &words);
    let journal = PathBuf::from(format!("{cut}.journal"));
    let begun = || std::fs::read_to_string(&journal).is_ok_and(|t| t.lines().count() > 8);
    wait_until("some points are written down", begun);
    held.child.kill().unwrap();
    held.child.wait().unwrap();
    let original = std::fs::read_to_string(&journal).unwrap();
    let lines: Vec<&str> = original.split_inclusive('\n').collect();
    let changed = {
        let mut lines: Vec<String> = lines.iter().map(|l| l.to_string()).collect();
        let place = lines[4].find("\"u0\":[").unwrap() + 8;
        let digit = if &lines[4][place..=place] == "1" { "2" } else { "1" };
        lines[4].replace_range(place..=place, digit);
        lines.concat()
    };
    let missing = [&lines[..3], &lines[4..]].concat().concat();
    let half = original[..original.len() - 40].to_owned();
    for (name, journal_text, warned) in
        [("changed", changed, true), ("missing", missing, true), ("half", half, false)]
    {
        let file = at(&folder, &format!("{name}.h5"));
        std::fs::write(format!("{file}.journal"), journal_text).unwrap();
        let output = call(&file, &["--resume", "-q"]);
        assert_eq!(text(&output).contains("is damaged"), warned, "{name}: {}", text(&output));
        assert!(datasets(Path::new(&whole)) == datasets(Path::new(&file)), "{name}");
        assert!(!Path::new(&format!("{file}.journal")).exists());
    }
}

/// A run that does something to itself at a certain look for signals (`src/cli/interrupt.rs`): no test waits for a time.
fn run_until(what: &str, look: usize, arguments: &[&str]) -> Output {
    let at_look = format!("{what} {look}");
    program().args(arguments).env("SIGNORINI_AT_LOOK", at_look).output().unwrap()
}

/// A run that stands still.
struct Held {
    child: Child,
    stderr: BufReader<ChildStderr>,
}

impl Held {
    /// At its look of this number, and not before.
    fn at(look: usize, arguments: &[&str]) -> Held {
        let mut child = program()
            .args(arguments)
            .env("SIGNORINI_AT_LOOK", format!("WAIT {look}"))
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains("waits at look") {
            line.clear();
            assert!(stderr.read_line(&mut line).unwrap() > 0, "it ended before: {arguments:?}");
        }
        Held { child, stderr }
    }

    /// Let it go on: its exit code and what it says.
    fn go_on(mut self) -> (Option<i32>, String) {
        drop(self.child.stdin.take());
        let mut said = String::new();
        self.stderr.read_to_string(&mut said).unwrap();
        (self.child.wait().unwrap().code(), said)
    }
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([name, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

/// hostile.md C18: a second process on the same file is refused with words, and the first one ends well.
#[test]
fn a_second_process_is_turned_away() {
    let folder = TempDir::new().unwrap();
    let file = at(&folder, "busy.h5");
    let command = ["backbone", SCENE, "--range", "1.74,1.80", "-q", "-o", &file];
    let first = Held::at(2, &command);
    for more in ["--resume", "--force"] {
        let refused = expect(2, &[&command[..], &[more]].concat());
        assert!(text(&refused).contains("another process"), "{}", text(&refused));
    }
    let (code, said) = first.go_on();
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(status(&file), "complete");
    let left: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(left, ["busy.h5"]);
}

/// hostile.md C21: a signal ends a run where its file is whole; the run goes on, and is the same as one without the signal.
#[test]
fn an_interrupted_run_goes_on_to_the_last_bit() {
    let folder = TempDir::new().unwrap();
    let scene = at(&folder, "long.toml");
    let plate = std::fs::read_to_string(root().join("scenarios/plate.toml")).unwrap();
    let plate = plate.replace("elements = [20, 10]", "elements = [10, 5]");
    let bar = std::fs::read_to_string(root().join("scenarios/bar.toml")).unwrap();
    let bar = bar.replace("elements = [40]", "elements = [200]");
    let scene_of = |body: &str, contact: &str, run: &str| {
        let (head, _) = body.split_once("[run]").unwrap();
        let head = head.replace("[contact]\n", &format!("[contact]\n{contact}"));
        format!("{head}[run]\n{run}")
    };
    let steps = "method = \"moreau-jean\"\n";
    let impact = "method = \"impact\"\nrestitution = 0.5\n";
    for (name, text) in [
        ("modal", scene_of(&plate, "", "until = 1500.0\nintegrator = \"modal\"\n")),
        // the rule changes its mind: sets pay for their modes after some phases
        (
            "auto",
            scene_of(&plate, "", "until = 400.0\nsamples = 50\n")
                .replace("elements = [10, 5]", "elements = [14, 7]"),
        ),
        ("dop853", scene_of(&plate, "", "until = 250.0\nintegrator = \"dop853\"\n")),
        ("impact", scene_of(&plate, impact, "until = 60.0\n")),
        ("steps", scene_of(&plate, steps, "until = 60.0\n")),
        ("waves", scene_of(&bar, "method = \"waves\"\n", "until = 500.0\nsamples = 2000\n")),
        // checkpoints are where the whole body is known
        (
            "zone",
            scene_of(&plate, "", "until = 40.0\nintegrator = \"chebyshev\"\nstore = \"contact\"\n")
                .replace("elements = [10, 5]", "elements = [120, 10]\nmass = \"lumped\""),
        ),
    ] {
        std::fs::write(&scene, text).unwrap();
        let whole = at(&folder, &format!("{name}-whole.h5"));
        let said = expect(0, &["run", &scene, "-o", &whole, "--json"]);
        let said: serde_json::Value = serde_json::from_slice(&said.stdout).unwrap();
        let note = said["integrator_note"].as_str().unwrap_or_default();
        let has_changed = note.contains("chebyshev for ") && note.contains(", modal for ");
        assert_eq!(has_changed, name == "auto", "{name}: {note}");
        goes_on(&scene, &at(&folder, &format!("{name}-cut.h5")), &whole, &said["integrator_note"]);
    }
}

/// Signals at places of the run that no clock has a say in, a kill, and a run that goes on.
fn goes_on(scene: &str, cut: &str, whole: &str, note: &serde_json::Value) {
    let words = ["run", scene, "-o", cut, "-q", "--resume"];
    let mut rows = 0;
    // at the very beginning; further on; twice before what was stored is reached again; and by a kill, after which the last flush counts
    for (what, look, code) in [
        ("INT", 1, Some(130)),
        ("TERM", 40, Some(143)),
        ("INT", 2, Some(130)),
        ("TERM", 7, Some(143)),
        ("KILL", 9, None),
        ("INT", 25, Some(130)),
    ] {
        let output = run_until(what, look, &words);
        assert_eq!(output.status.code(), code, "{cut}, {what} {look}: {}", text(&output));
        if what == "KILL" {
            assert_eq!(status(cut), "running");
            rows = 0;
            continue;
        }
        assert!(text(&output).contains("--resume"), "{}", text(&output));
        assert_eq!(status(cut), "interrupted");
        let file = crate::common::hdf5_files().open(cut).unwrap();
        let stored = ["trajectory/t", "switches/t"].map(|name| file.dataset(name).unwrap().size());
        let now = stored.iter().sum();
        println!("{cut}: {what} {look}: {stored:?} rows");
        assert!(now >= rows, "{cut}: {rows} rows became {now}");
        rows = now;
    }
    // from another thread of the system, while it stands still
    let held = Held::at(5, &words);
    signal(&held.child, "-INT");
    let (code, said) = held.go_on();
    assert_eq!(code, Some(130), "{said}");
    if status(cut) == "interrupted" {
        // a kill between the last words of a run and its end leaves them in the file
        let file = crate::common::hdf5_files().open_rw(cut).unwrap();
        file.create_group("report").unwrap().create_group("final").unwrap();
    }
    let ended = expect(0, &["run", scene, "-o", cut, "--json", "--resume"]);
    let ended: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
    assert_eq!(ended["integrator_note"], *note, "{cut}: {ended}");
    assert_eq!(status(cut), "complete");
    assert!(datasets(Path::new(whole)) == datasets(Path::new(cut)), "{cut}");
    assert!(!Path::new(&format!("{cut}.checkpoint")).exists());
    let again = expect(0, &["run", scene, "-o", cut, "--resume"]);
    assert!(String::from_utf8_lossy(&again.stdout).contains("nothing is left to do"));
}

/// Basins, diagrams, tests of phase resonance, tori and bands, written again and again while they are computed.
#[test]
fn basins_and_diagrams_go_on() {
    let folder = TempDir::new().unwrap();
    let scene = "scenarios/two-mass-stop.toml";
    let basins = ["basins", scene, "--omega", "0.7", "--size", "10"].map(str::to_owned);
    let over = "load[0].amplitude=0.05,0.4";
    let diagram = ["diagram", scene, "--omega", "0.7", "--over", over, "--steps", "30"];
    let test = ["phase-resonance", scene, "--over", over, "--steps", "4", "--noise", "0.01"];
    let tori = ["tori", "scenarios/two-frequencies.toml", "--omega", "2.9209", "--curves", "8"];
    let family = at(&folder, "family.h5");
    expect(0, &["response", scene, "--method", "shooting", "--range", "0.6,0.7", "-o", &family]);
    let bands = ["bands", &family, "--deviation", "contact.gap=2%"];
    for (name, words, looks) in [
        ("basins", basins.to_vec(), [12, 15]),
        ("diagram", diagram.map(str::to_owned).to_vec(), [12, 15]),
        // in the middle of the first value, and of a later one
        ("test", test.map(str::to_owned).to_vec(), [100, 1000]),
        ("tori", tori.map(str::to_owned).to_vec(), [4, 7]),
        ("bands", bands.map(str::to_owned).to_vec(), [10, 12]),
    ] {
        let (whole, cut) =
            (at(&folder, &format!("{name}-whole.h5")), at(&folder, &format!("{name}-cut.h5")));
        let with = |file: &str, more: &[&str]| -> Vec<String> {
            let more = ["-o", file].into_iter().chain(more.iter().copied()).map(str::to_owned);
            words.iter().cloned().chain(more).collect()
        };
        let call = |code: i32, words: Vec<String>| {
            expect(code, &words.iter().map(String::as_str).collect::<Vec<_>>())
        };
        call(0, with(&whole, &[]));
        let [first, second] = looks;
        for (what, look, code) in [("INT", first, Some(130)), ("TERM", second, Some(143))] {
            let words = with(&cut, &["-q", "--resume"]);
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let output = run_until(what, look, &words);
            assert_eq!(output.status.code(), code, "{name}: {}", text(&output));
            assert!(text(&output).contains("--resume"), "{}", text(&output));
            assert_eq!(status(&cut), "interrupted");
        }
        call(0, with(&cut, &["--resume"]));
        assert_eq!(status(&cut), "complete");
        assert!(datasets(Path::new(&whole)) == datasets(Path::new(&cut)), "{name}");
        // what is there is not written over without a word
        call(2, with(&cut, &[]));
    }
}

/// A kill between the end of a run and the end of its program leaves checkpoints that say nothing; one before the first checkpoint leaves a file with nothing to go on
/// with, which is begun anew.
#[test]
fn what_a_kill_leaves_beside_a_file_is_no_run() {
    let folder = TempDir::new().unwrap();
    let (whole, cut) = (at(&folder, "whole.h5"), at(&folder, "cut.h5"));
    let command =
        |file: &str| ["run", "scenarios/plate-forced.toml", "-o", file].map(str::to_owned);
    let call = |file: &str, more: &[&str]| {
        let list = command(file);
        let list: Vec<&str> = list.iter().map(String::as_str).chain(more.iter().copied()).collect();
        run(&list)
    };
    assert!(call(&whole, &[]).status.success());
    let list = command(&cut);
    let list: Vec<&str> = list.iter().map(String::as_str).collect();
    assert_eq!(run_until("INT", 9, &list).status.code(), Some(130));
    let checkpoint = std::fs::read(format!("{cut}.checkpoint")).unwrap();
    // a file that is whole, and checkpoints of earlier days
    let before = std::fs::read(&whole).unwrap();
    for name in [format!("{whole}.part.checkpoint"), format!("{whole}.checkpoint")] {
        std::fs::write(&name, &checkpoint).unwrap();
        let again = call(&whole, &["--resume"]);
        assert!(again.status.success(), "{name}: {}", text(&again));
        let said = String::from_utf8_lossy(&again.stdout).into_owned();
        assert!(said.contains("nothing is left to do"), "{name}: {said}{}", text(&again));
        assert!(std::fs::read(&whole).unwrap() == before && !Path::new(&name).exists(), "{name}");
    }
    // an interrupted file without a checkpoint
    std::fs::remove_file(format!("{cut}.checkpoint")).unwrap();
    let anew = call(&cut, &["--resume"]);
    assert!(anew.status.success(), "{}", text(&anew));
    assert!(datasets(Path::new(&whole)) == datasets(Path::new(&cut)));
    let left: Vec<PathBuf> = bytes_of(folder.path()).into_keys().collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

/// The same for families, with the journal.
#[test]
fn an_interrupted_family_says_how_to_go_on() {
    let folder = TempDir::new().unwrap();
    for (name, options) in [
        ("shooting", &["--range", "1.78,1.805"][..]),
        ("hbm", &["--range", "1.7,1.9", "--method", "hbm", "--harmonics", "1,7,15"]),
    ] {
        let (whole, cut) =
            (at(&folder, &format!("{name}-whole.h5")), at(&folder, &format!("{name}-cut.h5")));
        let command =
            |file: &'static str| [&["backbone", SCENE, "-q", "-o", file], options].concat();
        let leak = |s: &str| -> &'static str { Box::leak(s.to_owned().into_boxed_str()) };
        expect(0, &command(leak(&whole)));
        let output = run_until("INT", 5, &command(leak(&cut)));
        assert_eq!(output.status.code(), Some(130), "{}", text(&output));
        assert!(text(&output).contains("--resume"));
        assert_eq!(status(&cut), "interrupted");
        expect(0, &[&command(leak(&cut))[..], &["--resume"]].concat());
        assert!(datasets(Path::new(&whole)) == datasets(Path::new(&cut)), "{name}");
    }
}

fn bytes_of(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries.filter(|p| p.is_file()).map(|p| (p.clone(), std::fs::read(p).unwrap())).collect()
}

/// hostile.md A1, A3: no file is overwritten that the program did not make, and never an input, by whatever name.
#[test]
fn foreign_files_and_inputs_are_never_overwritten() {
    let folder = TempDir::new().unwrap();
    let scene = at(&folder, "bar.toml");
    std::fs::copy(root().join("scenarios/bar.toml"), &scene).unwrap();
    let run_file = at(&folder, "pp.h5");
    expect(0, &["run", &scene, "-o", &run_file, "-q"]);
    let results = at(&folder, "own.csv");
    std::fs::copy(root().join("validate/foreign/half-plate.csv"), &results).unwrap();
    let checked = at(&folder, "own.h5");
    let half_plate = root().join(SCENE).display().to_string();
    expect(0, &["crosscheck", &results, &half_plate, "--quick", "-q", "-o", &checked]);
    std::fs::write(at(&folder, "pp-contact.png"), "mine").unwrap();
    std::fs::write(at(&folder, "mine.h5"), "mine, and no HDF5 file").unwrap();
    std::fs::copy(&run_file, at(&folder, "x-contact.png")).unwrap();
    std::fs::hard_link(&scene, at(&folder, "twin.h5")).unwrap();
    std::os::unix::fs::symlink(&scene, at(&folder, "link.h5")).unwrap();
    let foreign = root().join("validate/foreign");
    for name in ["M.mtx", "K.mtx", "N_C.mtx", "N_O.mtx"] {
        std::fs::copy(foreign.join(name), at(&folder, name)).unwrap();
    }
    let matrices = at(&folder, "matrices.toml");
    std::fs::copy(foreign.join("half-plate.toml"), &matrices).unwrap();
    let from_file = at(&folder, "from.toml");
    let bar = std::fs::read_to_string(&scene).unwrap();
    let before_initial = bar.split("[initial]").next().unwrap();
    std::fs::write(
        &from_file,
        format!("{before_initial}[initial]\nfile = \"pp.h5\"\n[run]\nuntil = 1.0\n"),
    )
    .unwrap();
    let before = bytes_of(folder.path());
    let (twin, link, mine, x) =
        (at(&folder, "twin.h5"), at(&folder, "link.h5"), at(&folder, "mine.h5"), at(&folder, "x"));
    let mass = at(&folder, "M.mtx");
    for command in [
        &["export", &checked][..],
        &["plot", &run_file],
        &["plot", &at(&folder, "x-contact.png"), "-o", &x],
        &["export", &checked, "--force"],
        &["run", &scene, "-o", &scene, "--force"],
        &["run", &scene, "-o", &twin, "--force"],
        &["run", &scene, "-o", &link, "--force"],
        &["run", &scene, "-o", &mine, "--force"],
        &["run", &scene, "-o", &mine],
        &["run", &scene, "-o", &run_file],
        &["run", &from_file, "-o", &run_file, "--force"],
        &["crosscheck", &results, &half_plate, "--quick", "-o", &results, "--force"],
        &["crosscheck", &checked, &half_plate, "--quick", "-o", &checked, "--force"],
        &["backbone", &matrices, "--range", "1.8,1.81", "-o", &mass, "--force"],
        &["backbone", &half_plate, "--range", "1.8,1.81", "-o", &run_file, "--resume"],
        &["orbit", &half_plate, "--omega", "1.8", "-o", &mine, "--force"],
        &["run", &scene, "-o", folder.path().to_str().unwrap(), "--force"],
    ] {
        expect(2, command);
        assert!(bytes_of(folder.path()) == before, "{command:?} changed something");
    }
    // what the program made is drawn anew without a word, and replaced with --force
    expect(0, &["plot", &run_file, "-o", &at(&folder, "drawn"), "-q"]);
    expect(0, &["plot", &run_file, "-o", &at(&folder, "drawn"), "-q"]);
    expect(0, &["run", &scene, "-o", &run_file, "--force", "-q"]);
    expect(0, &["run", &scene, "-o", "/dev/null", "-q"]);
    assert!(std::fs::metadata("/dev/null").is_ok_and(|m| !m.is_file()));
}

/// hostile.md B6: standard output that cannot be written is an error and no panic; the results are there.
#[test]
fn a_full_standard_output_is_an_error() {
    let folder = TempDir::new().unwrap();
    let file = at(&folder, "bar.h5");
    for arguments in [
        &["run", "scenarios/bar.toml", "-o", &file][..],
        &["modes", "scenarios/bar.toml", "--json"],
        &["inspect", &file, "--scene"],
        &["inspect", &file],
        &["validate", "--list"],
        &["run", "no-such-scene.toml", "--json"],
    ] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = program().args(arguments).stdout(full).output().unwrap();
        let wanted = if arguments[1].starts_with("no-") { 2 } else { 1 };
        assert_eq!(output.status.code(), Some(wanted), "{arguments:?}: {}", text(&output));
        assert!(!text(&output).contains("panicked"), "{}", text(&output));
    }
    assert_eq!(status(&file), "complete");
}

/// A small disk, where the test may make one (as root).
struct SmallDisk(TempDir);

impl SmallDisk {
    fn new(size: &str) -> Option<SmallDisk> {
        let folder = TempDir::new().unwrap();
        let option = format!("size={size}");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &option, "tmpfs"])
            .arg(folder.path())
            .stderr(Stdio::null())
            .status();
        mounted.is_ok_and(|s| s.success()).then(|| SmallDisk(folder))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).status();
    }
}

/// hostile.md C11 to C13: a full disk is exit code 1; an old file stays whole, and nothing half-written stays.
#[test]
fn a_full_disk_leaves_whole_files_only() {
    let (Some(tiny), Some(small)) = (SmallDisk::new("256k"), SmallDisk::new("1M")) else {
        println!("left out: this needs the right to mount a file system");
        return;
    };
    let file = at(&tiny.0, "p.h5");
    let refused = expect(1, &["run", "scenarios/plate.toml", "-o", &file]);
    assert!(text(&refused).contains("kB"), "{}", text(&refused));
    assert!(bytes_of(tiny.0.path()).is_empty());
    // without the estimate: the disk fills while the run goes on, and the file is whole up to the last flush
    let file = at(&small.0, "p.h5");
    expect(1, &["run", "scenarios/plate.toml", "-o", &file, "--force-large"]);
    if Path::new(&file).exists() {
        expect(0, &["inspect", &file]);
    }
    let _ = std::fs::remove_file(&file);
    let _ = std::fs::remove_file(format!("{file}.checkpoint"));
    // an old file and no room for a new one
    expect(0, &["run", "scenarios/bar.toml", "-o", &file, "-q"]);
    let old = std::fs::read(&file).unwrap();
    let filler = small.0.path().join("filler");
    let _ = std::fs::write(&filler, vec![1u8; 1 << 20]);
    expect(1, &["run", "scenarios/bar.toml", "-o", &file, "--force"]);
    assert!(std::fs::read(&file).unwrap() == old);
    // a family
    let family = at(&small.0, "b.h5");
    let command = ["backbone", SCENE, "--range", "1.80,1.81", "-o", &family, "-q"];
    expect(1, &command);
    // pictures and tables
    expect(1, &["plot", &file, "-o", &at(&small.0, "pic")]);
    expect(1, &["export", &file, "-o", &at(&small.0, "table")]);
    let left: Vec<PathBuf> = bytes_of(small.0.path()).into_keys().collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

/// A family that is refused before it has begun leaves nothing, and what was there stays.
#[test]
fn a_refused_family_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, file) = (at(&folder, "s.toml"), at(&folder, "f.h5"));
    let text = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [4]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
                [contact]\nedge = 'right'\ngap = 1.0\nmethod = 'impact'\nrestitution = 1.0\n[orbit]\nrange = [1.7, 1.8]\n[run]\nuntil = 1.0\n";
    std::fs::write(&scene, text).unwrap();
    let refused = ["backbone", &scene, "--method", "hbm", "-o", &file];
    expect(2, &refused);
    assert_eq!(bytes_of(folder.path()).len(), 1, "{:?}", bytes_of(folder.path()).keys());
    expect(0, &["run", &scene, "-o", &file, "-q"]);
    let old = std::fs::read(&file).unwrap();
    expect(2, &[&refused[..], &["--force"]].concat());
    assert!(std::fs::read(&file).unwrap() == old);
    assert_eq!(bytes_of(folder.path()).len(), 2, "{:?}", bytes_of(folder.path()).keys());
}
