//! Damaged and hostile inputs given to the program: it refuses them or reads them, and never falls over.
//!
//! Every case is a mutation of a small proper input, drawn from a seed, and one command that reads it. Whatever the input says,
//! the exit code is one of 0, 1, 2, 3, nothing panics, nothing takes more than ten seconds of a processor or four gigabytes, and
//! no input is changed. `make fuzz` runs all cases and keeps the input of each that fails; the suite runs a sample of them.
#[path = "fuzz/material.rs"]
mod material;
#[path = "fuzz/structure.rs"]
mod structure;
#[path = "fuzz/text.rs"]
mod text;

use std::collections::BTreeMap;
use std::fs::File;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::common::Splitmix;
use material::{Begun, FAMILIES, Material};

/// What no case may take by the clock: the machine may be busy.
const LIMIT: Duration = Duration::from_secs(60);
/// What ends a program that has used up its processor time: SIGXCPU.
const OUT_OF_TIME: i32 = 24;
/// Cases computed side by side.
const THREADS: usize = 2;
/// One case in so many makes the short form.
const SAMPLE: usize = 27;

/// What is damaged, and how many cases of it there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Family {
    Scene,
    Matrix,
    Csv,
    Bytes,
    Structure,
    Journal,
}

const CASES: [(Family, &str, usize); 6] = [
    (Family::Scene, "scene", 3000),
    (Family::Matrix, "matrix", 1200),
    (Family::Csv, "csv", 800),
    (Family::Bytes, "bytes", 2000),
    (Family::Structure, "structure", 2200),
    (Family::Journal, "journal", 800),
];

/// A command with the files that it may write among those that are there.
#[derive(Default)]
struct Invocation {
    arguments: Vec<String>,
    own: Vec<&'static str>,
}

fn command(words: &str) -> Invocation {
    Invocation { arguments: words.split(' ').map(str::to_owned).collect(), own: vec![] }
}

/// A case: a family and its number in it.
#[derive(Debug, Clone, Copy)]
struct Case {
    family: Family,
    name: &'static str,
    number: usize,
}

impl Case {
    fn label(&self) -> String {
        format!("{}-{:04}", self.name, self.number)
    }

    /// The numbers of a case depend on nothing but its label (and, for those who want other cases, the variable `FUZZ_SEED`).
    fn source(&self) -> Splitmix {
        let label = self.label() + &std::env::var("FUZZ_SEED").unwrap_or_default();
        let seed = label.bytes().fold(0xcbf2_9ce4_8422_2325u64, |h, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
        });
        Splitmix::new(seed)
    }

    /// Write the inputs into a folder and say what to do with them.
    fn build(&self, material: &Material, folder: &Path) -> Invocation {
        let rng = &self.source();
        let put = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
        let copy = |name: &str| put(name, &material.bytes(name));
        match self.family {
            Family::Scene => scene(rng, material, folder),
            Family::Matrix => {
                let names = ["M", "K", "C", "NC", "NO"].map(|n| format!("chain-{n}.mtx"));
                names.iter().for_each(|n| copy(n));
                copy("chain.toml");
                let name = &names[rng.below(names.len())];
                let mutated = text::matrix(rng, &material.text(name));
                // entries of any size make frequencies of any size, and a run of any length
                let usual = text::numbers(&mutated)
                    .into_iter()
                    .filter_map(|r| mutated[r].parse::<f64>().ok())
                    .all(|x| x == 0.0 || (1e-3..1e3).contains(&x.abs()));
                put(name, &text::encoded(rng, mutated));
                let run = usual && rng.below(3) == 0;
                command(if run { "run chain.toml -o out.h5" } else { "modes chain.toml --json" })
            }
            Family::Csv => {
                copy("bar.toml");
                let mutated = text::csv(rng, &material.text("series.csv"));
                put("series.csv", &text::encoded(rng, mutated));
                command(rng.pick(&[
                    "crosscheck series.csv bar.toml -o out.h5",
                    "crosscheck series.csv bar.toml -o out.h5 --quick --json",
                ]))
            }
            Family::Bytes | Family::Structure => {
                let names = [
                    "bar.h5",
                    "plate.h5",
                    "orbit.h5",
                    "backbone.h5",
                    "branch.h5",
                    "hbm.h5",
                    "response.h5",
                    "checked.h5",
                    "chain.h5",
                ];
                let name = rng.pick(&names);
                let mut bytes = material.bytes(name);
                if self.family == Family::Bytes {
                    text::bytes(rng, &mut bytes);
                    put("input.h5", &bytes);
                } else {
                    put("input.h5", &bytes);
                    let _files = FILES.lock().unwrap();
                    structure::mutate(rng, &folder.join("input.h5")).unwrap();
                }
                stored(rng, name, &copy)
            }
            Family::Journal => {
                let begun = &FAMILIES[rng.below(FAMILIES.len())];
                let file = format!("{}.h5", begun.name);
                let mutated = text::journal(rng, &material.text(&format!("{file}.kept")));
                let file = material.bytes(&file);
                match rng.below(8) {
                    // a kill may leave any part of the file itself
                    0 => put("input.h5", &file[..rng.below(file.len())]),
                    1 => put("input.h5", b""),
                    _ => put("input.h5", &file),
                }
                put("input.h5.journal", &text::encoded(rng, mutated));
                resumed(begun, &copy)
            }
        }
    }
}

/// A mutated scene and a command that takes it.
fn scene(rng: &Splitmix, material: &Material, folder: &Path) -> Invocation {
    let names = ["bar.toml", "plate.toml", "forced.toml", "falling.toml", "chain.toml"];
    let (name, other) = (rng.pick(&names), rng.pick(&names));
    let (base, other) = (material.text(name), material.text(other));
    let mut mutated = text::scene(rng, &base, &other);
    // a body of a million nodes is no fault, and takes its time
    for _ in 0..50 {
        if !is_large(&mutated) {
            break;
        }
        mutated = text::scene(rng, &base, &other);
    }
    let usual = is_usual(&mutated);
    let bytes = text::encoded(rng, mutated);
    // the last damage may make large what was small
    let bytes = match String::from_utf8(bytes.clone()) {
        Ok(text) if is_large(&text) || (usual && !is_usual(&text)) => base.into_bytes(),
        _ => bytes,
    };
    std::fs::write(folder.join("scene.toml"), bytes).unwrap();
    for m in ["M", "K", "C", "NC", "NO"] {
        let name = format!("chain-{m}.mtx");
        std::fs::write(folder.join(&name), material.bytes(&name)).unwrap();
    }
    if !usual {
        return command("modes scene.toml --json");
    }
    let run = [
        "run scene.toml -o out.h5",
        "run scene.toml -o out.h5 --json",
        "run scene.toml -o out.h5 --verify-lcp",
        "modes scene.toml",
    ];
    let periodic = [
        "orbit scene.toml -o out.h5",
        "orbit scene.toml --all --amplitudes 2",
        "backbone scene.toml -o out.h5 --step 0.05",
        "backbone scene.toml -o out.h5 --follow arclength --points 4",
        "backbone scene.toml -o out.h5 --method hbm --harmonics 1 --step 0.05",
    ];
    let forced = [
        "orbit scene.toml -o out.h5",
        "response scene.toml -o out.h5 --points 4",
        "response scene.toml -o out.h5 --method hbm --harmonics 1 --step 0.5",
    ];
    command(match name {
        "bar.toml" if rng.below(2) == 0 => rng.pick(&periodic),
        "forced.toml" if rng.below(2) == 0 => rng.pick(&forced),
        _ => rng.pick(&run),
    })
}

/// The numbers of a TOML value, by the name of their key.
fn numbers_of(value: &toml::Value, key: &str, found: &mut Vec<(String, f64)>) {
    match value {
        toml::Value::Float(x) => found.push((key.to_owned(), *x)),
        toml::Value::Integer(i) => found.push((key.to_owned(), *i as f64)),
        toml::Value::Array(list) => list.iter().for_each(|v| numbers_of(v, key, found)),
        toml::Value::Table(t) => t.iter().for_each(|(k, v)| numbers_of(v, k, found)),
        _ => {}
    }
}

fn numbers_in(scene: &str) -> Option<Vec<(String, f64)>> {
    let mut found = vec![];
    numbers_of(&toml::Value::Table(scene.parse().ok()?), "", &mut found);
    Some(found)
}

/// Whether a scene is a proper one of so many elements that setting it up takes seconds. More than the program holds is not.
fn is_large(scene: &str) -> bool {
    let found = numbers_in(scene).unwrap_or_default();
    let nodes: f64 = found.iter().filter(|n| n.0 == "elements").map(|n| n.1 + 1.0).product();
    (1000.0..=5e7).contains(&nodes)
}

/// Whether the numbers that decide how long a command takes are known, and near those of the proper scenes.
fn is_usual(scene: &str) -> bool {
    let within = |key: &str, x: f64| match key {
        "elements" => x <= 8.0,
        "size" => (0.1..10.0).contains(&x),
        "young" => (0.01..1e3).contains(&x),
        "density" => (0.1..10.0).contains(&x),
        "until" => x <= 20.0,
        "periods" => x <= 10.0,
        "omega" | "range" => (0.5..5.0).contains(&x),
        "period" => (1.0..10.0).contains(&x),
        "samples" => x <= 1000.0,
        "harmonics" => x <= 7.0,
        // stiff where it is large
        "ratio" | "ratios" | "rayleigh" => x <= 10.0,
        _ => true,
    };
    // what is not positive or not finite is to be refused
    let fine = |(key, x): &(String, f64)| !(*x > 0.0 && x.is_finite()) || within(key, *x);
    numbers_in(scene).is_some_and(|found| found.iter().all(fine))
}

/// A command that reads the damaged file `input.h5`, which was `name` once.
fn stored(rng: &Splitmix, name: &str, copy: &dyn Fn(&str)) -> Invocation {
    if name == "chain.h5" {
        let scene = "chain-hdf5.toml";
        copy(scene);
        // the scene names its file
        return Invocation { own: vec![], ..command("modes chain-hdf5.toml --json") };
    }
    let any = ["inspect input.h5", "inspect input.h5 --json", "inspect input.h5 --scene"];
    let run = [
        "plot input.h5 --only contact -o out",
        "plot input.h5 --only energy,gap -o out",
        "plot input.h5 --only shapes -o out",
        "plot input.h5 -o out",
        "export input.h5 --format csv -o out",
        "export input.h5 --format vtu -o out",
        "export input.h5 --format xdmf -o out",
        "orbit bar.toml --near-return input.h5 -o out.h5",
        "orbit bar.toml --near-return input.h5 --omega 1.8 -o out.h5",
        "run from.toml -o out.h5",
        "run from-other.toml -o out.h5",
        "orbit from.toml -o out.h5",
        "modes from.toml",
    ];
    let family = [
        "plot input.h5 -o out",
        "plot input.h5 --only backbone -o out",
        "plot input.h5 backbone.h5 -o out",
        "export input.h5 --format csv -o out",
        "crosscheck input.h5 bar.toml --quick -o out.h5",
        "crosscheck input.h5 bar.toml --omega hbm/omega --coefficients hbm/coefficients -o out.h5",
    ];
    let words = match name {
        _ if rng.below(4) == 0 => rng.pick(&any),
        "plate.h5" if rng.below(3) == 0 => "run from-plate.toml -o out.h5",
        "orbit.h5" if rng.below(3) == 0 => "plot input.h5 --only portrait,multipliers -o out",
        "bar.h5" | "plate.h5" | "orbit.h5" => rng.pick(&run),
        "checked.h5" if rng.below(3) == 0 => "plot input.h5 --only crosscheck -o out",
        "checked.h5" => rng.pick(&family),
        _ if rng.below(2) == 0 => rng.pick(&family),
        _ => {
            let of = FAMILIES.iter().find(|f| name.strip_suffix(".h5") == Some(f.name));
            return resumed(of.unwrap_or(&FAMILIES[0]), copy);
        }
    };
    words.split(' ').filter(|w| w.ends_with(".toml") || *w == "backbone.h5").for_each(copy);
    command(words)
}

/// The command that goes on with the family in `input.h5`.
fn resumed(begun: &Begun, copy: &dyn Fn(&str)) -> Invocation {
    copy(begun.command[1]);
    let all = [begun.command, begun.rest, &["--resume", "-o", "input.h5"]].concat();
    Invocation {
        arguments: all.into_iter().map(str::to_owned).collect(),
        own: vec!["input.h5", "input.h5.journal"],
    }
}

/// Held while this process has an HDF5 file open and while it starts another: a child would inherit the file with its lock.
static FILES: Mutex<()> = Mutex::new(());

/// What went wrong.
struct Fault {
    case: Case,
    /// The same for all cases of one cause, as far as one can tell from outside.
    cause: String,
    /// The program's own words.
    said: String,
    command: String,
}

/// All files of a folder.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path());
    files
        .filter(|f| f.is_file())
        .map(|f| (f.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(f).unwrap()))
        .collect()
}

/// Run to the end, or to the limit of time.
fn wait(mut command: Command, errors: &Path) -> (Option<ExitStatus>, String) {
    command.stderr(File::create(errors).unwrap());
    let mut child = {
        let _files = FILES.lock().unwrap();
        command.spawn().unwrap()
    };
    let start = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break Some(status),
            None if start.elapsed() > LIMIT => {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    };
    (status, String::from_utf8_lossy(&std::fs::read(errors).unwrap()).into_owned())
}

const HANGS: &str = "does not end";

/// What is wrong with how a command ended, if anything: its cause, the same for all cases of it, and what was said.
fn verdict(status: Option<ExitStatus>, errors: &str) -> Option<(String, String)> {
    let Some(status) = status.filter(|s| s.signal() != Some(OUT_OF_TIME)) else {
        return Some((HANGS.into(), String::new()));
    };
    // a panic may be one of the standard library, and so is the end of memory: whose call was it?
    let caller = || {
        let frames = errors.lines().filter_map(|l| Some(l.trim().split_once(": ")?.1));
        frames.into_iter().find(|f| f.starts_with("signorini::")).unwrap_or("unknown").to_owned()
    };
    if let Some((_, rest)) = errors.split_once("panicked at ") {
        let (place, said) = rest.split_once('\n').unwrap_or((rest, ""));
        let place = ["/library/", "/registry/src/"]
            .iter()
            .find_map(|p| Some(place.split_once(p)?.1))
            .unwrap_or(place);
        let said = said.lines().next().unwrap_or("").to_owned();
        return Some((format!("panic at {place} in {}", caller()), said));
    }
    if let Some(line) = errors.lines().find(|l| l.starts_with("memory allocation of ")) {
        return Some((format!("out of memory in {}", caller()), line.to_owned()));
    }
    if let Some(signal) = status.signal() {
        let said = errors.lines().last().unwrap_or("").to_owned();
        return Some((format!("signal {signal}"), said));
    }
    match status.code() {
        Some(0..=3) => None,
        code => Some((format!("exit code {code:?}"), String::new())),
    }
}

/// Whether a file has a global heap that the HDF5 library (2.2.0) never returns from: it walks the objects of the heap by their
/// sizes, and takes a free space of size 0 as one that it can step over.
fn is_endless(file: &[u8]) -> bool {
    let word = |at: usize| {
        let bytes = file.get(at..at + 8)?;
        Some(u64::from_le_bytes(bytes.try_into().ok()?))
    };
    let heaps = (0..file.len()).filter(|&k| file[k..].starts_with(b"GCOL"));
    heaps.into_iter().any(|heap| {
        let end = word(heap + 8).map_or(0, |size| (heap as u64).saturating_add(size));
        let mut at = heap + 16;
        // less than a header is left: free space
        while (at as u64 + 16) <= end {
            let (Some(head), Some(size)) = (word(at), word(at + 8)) else { return false };
            // the size of a free space counts its header, that of an object does not
            let step = match head & 0xffff {
                0 => size,
                _ => (size.wrapping_add(7) / 8 * 8).wrapping_add(16),
            };
            if step == 0 {
                return true;
            }
            at = at.saturating_add(usize::try_from(step).unwrap_or(usize::MAX));
        }
        false
    })
}

/// How long a case took, and its exit code.
type Outcome = (Duration, Option<i32>);

/// Run one case in a fresh folder.
fn run(case: Case, material: &Material, work: &Path, kept: &Path) -> (Option<Fault>, Outcome) {
    let label = case.label();
    let folder = work.join(&label);
    std::fs::create_dir(&folder).unwrap();
    let invocation = case.build(material, &folder);
    let before = contents(&folder);
    let arguments: Vec<&str> = invocation.arguments.iter().map(String::as_str).collect();
    let start = Instant::now();
    let (status, errors) =
        wait(material::limited(&folder, &arguments), &work.join(format!("{label}.txt")));
    let took = start.elapsed();
    let after = contents(&folder);
    let changed = before
        .iter()
        .find(|(name, bytes)| {
            !invocation.own.contains(&name.as_str()) && after.get(*name) != Some(*bytes)
        })
        .map(|(name, _)| ("changed its input".to_owned(), name.clone()));
    let command = format!("signorini {}", arguments.join(" "));
    let mut wrong = verdict(status, &errors).or(changed);
    if wrong.as_ref().is_some_and(|w| w.0 == HANGS)
        && before.get("input.h5").is_some_and(|bytes| is_endless(bytes))
    {
        println!("{label}: {command}: the HDF5 library does not return from this file");
        wrong = None;
    }
    let fault = wrong.map(|(cause, said)| {
        // the input as it was, with what was done and what came of it
        let place = kept.join(&label);
        let _ = std::fs::remove_dir_all(&place);
        std::fs::create_dir_all(&place).unwrap();
        for (name, bytes) in &before {
            std::fs::write(place.join(name), bytes).unwrap();
        }
        let report = format!("{command}\n\n{cause}\n{said}\n\n{errors}");
        std::fs::write(place.join("report.txt"), report).unwrap();
        Fault { case, cause, said, command }
    });
    std::fs::remove_dir_all(&folder).unwrap();
    let _ = std::fs::remove_file(work.join(format!("{label}.txt")));
    (fault, (took, status.and_then(|s| s.code())))
}

/// Where the inputs of cases that failed stay.
fn kept() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("fuzz")
}

/// Run cases on several threads; list what failed.
fn run_all(cases: &[Case], progress: bool) {
    let work = tempfile::tempdir().unwrap();
    let base = work.path().join("material");
    std::fs::create_dir(&base).unwrap();
    let material = Material::new(&base);
    let kept = kept();
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let (faults, outcomes) = (Mutex::new(vec![]), Mutex::new(vec![]));
    let start = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let (fault, outcome) = run(*case, &material, work.path(), &kept);
                    outcomes.lock().unwrap().push((outcome, *case));
                    if let Some(fault) = fault {
                        let place = kept.join(fault.case.label());
                        println!("{}: {}: {}", place.display(), fault.cause, fault.said);
                        println!("  {}", fault.command);
                        faults.lock().unwrap().push(fault);
                    }
                    let count = done.fetch_add(1, Ordering::Relaxed) + 1;
                    if progress && count.is_multiple_of(500) {
                        let failed = faults.lock().unwrap().len();
                        let seconds = start.elapsed().as_secs();
                        println!("{count} of {} cases, {failed} failed, {seconds} s", cases.len());
                    }
                }
            });
        }
    });
    if progress {
        statistics(&mut outcomes.into_inner().unwrap());
    }
    report(&faults.into_inner().unwrap(), cases.len(), &kept);
}

/// Whether the cases reach beyond the first check shows in how many of them end well; and which of them are slow.
fn statistics(outcomes: &mut [(Outcome, Case)]) {
    for (_, name, _) in CASES {
        let of = |code: Option<i32>| {
            outcomes.iter().filter(|(o, c)| c.name == name && o.1 == code).count()
        };
        let codes = [0, 1, 2, 3].map(|code| of(Some(code)));
        println!("{name}: {codes:?} cases end with exit codes 0 to 3, {} otherwise", of(None));
    }
    outcomes.sort_unstable_by_key(|o| std::cmp::Reverse(o.0.0));
    for ((took, _), case) in outcomes.iter().take(5) {
        println!("slow: {} {:.2} s", case.label(), took.as_secs_f64());
    }
}

/// Fail with the distinct faults, the most frequent ones first.
fn report(faults: &[Fault], cases: usize, kept: &Path) {
    let mut causes: BTreeMap<&str, Vec<&Fault>> = BTreeMap::new();
    faults.iter().for_each(|f| causes.entry(&f.cause).or_default().push(f));
    let mut causes: Vec<_> = causes.into_iter().collect();
    causes.sort_by_key(|c| std::cmp::Reverse(c.1.len()));
    let list: Vec<String> = causes
        .iter()
        .map(|(cause, of)| {
            let few: Vec<String> = of
                .iter()
                .take(4)
                .map(|f| format!("\n    {}: {} ({})", f.case.label(), f.command, f.said))
                .collect();
            format!("\n  {} × {cause}{}", of.len(), few.concat())
        })
        .collect();
    assert!(
        faults.is_empty(),
        "{} of {cases} cases failed, {} ways; their inputs are below {}, and FUZZ=NAME make fuzz runs one again{}",
        faults.len(),
        causes.len(),
        kept.display(),
        list.concat()
    );
}

fn all_cases() -> Vec<Case> {
    let of = |(family, name, count)| (0..count).map(move |number| Case { family, name, number });
    CASES.into_iter().flat_map(of).collect()
}

/// A sample of the cases of `make fuzz`.
#[test]
fn damaged_inputs_never_bring_the_program_down() {
    let sample: Vec<Case> = all_cases().into_iter().step_by(SAMPLE).collect();
    assert!(sample.len() >= 300);
    run_all(&sample, false);
}

/// All of them, or those whose names begin with the environment variable `FUZZ`.
#[test]
#[ignore = "ten thousand cases, minutes: make fuzz"]
fn ten_thousand_damaged_inputs() {
    let wanted = std::env::var("FUZZ").unwrap_or_default();
    let all = all_cases();
    assert_eq!(all.len(), 10_000);
    let chosen: Vec<Case> = all.into_iter().filter(|c| c.label().starts_with(&wanted)).collect();
    assert!(!chosen.is_empty(), "no case is called {wanted}");
    if wanted.is_empty() {
        let _ = std::fs::remove_dir_all(kept());
    }
    run_all(&chosen, true);
}
