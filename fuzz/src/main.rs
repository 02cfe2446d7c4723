//! One reader of files under libFuzzer: bytes go in, a value or an error comes out, and never a panic.
//!
//! The environment variable `READER` names it; see [`READERS`] and `run.sh`.
#![no_main]

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use libfuzzer_sys::{Corpus, fuzz_target};
use signorini::matrices::read_matrix;
use signorini::mesh::gmsh;
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::store::{self, Stored, StoredFamily};
use signorini::study::Study;

/// A reader: its name, and what it does with the bytes; no more than a fraction of a second and of a gigabyte.
type Reader = (&'static str, fn(&Path, &[u8]) -> Option<()>);

const READERS: [Reader; 9] = [
    ("scene", scene),
    ("study", study),
    ("msh", msh),
    ("mtx", mtx),
    ("mat", mat),
    ("series", series),
    ("history", history),
    ("results", results),
    ("journal", journal),
];

/// The reader, and a folder in memory for those that want a file.
static CHOSEN: LazyLock<(Reader, tempfile::TempDir)> = LazyLock::new(|| {
    let name = std::env::var("READER").unwrap_or_default();
    let reader = READERS.into_iter().find(|r| r.0 == name).expect("READER is a name of READERS");
    let memory = Path::new("/dev/shm");
    let place = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
    (reader, tempfile::tempdir_in(place).expect("a folder"))
});

fuzz_target!(|data: &[u8]| -> Corpus {
    let ((_, read), folder) = &*CHOSEN;
    // what is no text is told once; the corpus shall hold what is read
    match read(folder.path(), data) {
        Some(()) => Corpus::Keep,
        None => Corpus::Reject,
    }
});

fn text(data: &[u8]) -> Option<&str> {
    std::str::from_utf8(data).ok()
}

fn written(folder: &Path, name: &str, data: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, data).expect("the folder takes a file");
    path
}

fn scene(folder: &Path, data: &[u8]) -> Option<()> {
    if let Ok(scene) = Scene::parse(text(data)?, &folder.join("scene.toml")) {
        // what is said of it reads all of it
        let _ = format!("{scene:?}").len();
    }
    Some(())
}

fn study(folder: &Path, data: &[u8]) -> Option<()> {
    text(data)?;
    let scene = folder.join("bar.toml");
    if !scene.is_file() {
        written(folder, "bar.toml", BAR.as_bytes());
    }
    let _ = Study::read(&written(folder, "study.toml", data));
    Some(())
}

fn msh(_: &Path, data: &[u8]) -> Option<()> {
    if let Ok(file) = gmsh::read(data) {
        let _ = file.body(1.0, &[]);
    }
    Some(())
}

fn mtx(folder: &Path, data: &[u8]) -> Option<()> {
    text(data)?;
    written(folder, "a.mtx", data);
    let _ = read_matrix(folder, "a.mtx");
    Some(())
}

fn mat(folder: &Path, data: &[u8]) -> Option<()> {
    written(folder, "a.mat", data);
    let _ = read_matrix(folder, "a.mat:/K");
    Some(())
}

fn series(folder: &Path, data: &[u8]) -> Option<()> {
    let _ = store::read_csv(&written(folder, "series.csv", data), 2);
    Some(())
}

const BAR: &str = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [2]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
    [contact]\nedge = 'right'\ngap = 1.0\n[run]\nuntil = 1.0\n";

fn history(folder: &Path, data: &[u8]) -> Option<()> {
    text(data)?;
    written(folder, "load.csv", data);
    let load = "[[load]]\nkind = 'mode'\nmode = 1\namplitude = 1.0\ntable = 'load.csv'\n";
    let scene = Scene::parse(&format!("{BAR}{load}"), &folder.join("s.toml")).expect("a scene");
    if let Ok(problem) = Problem::new(&scene, None) {
        let mut force = vec![0.0; problem.system.body.dofs.n()];
        problem.system.loads.at(0.5, &mut force);
    }
    Some(())
}

fn results(folder: &Path, data: &[u8]) -> Option<()> {
    let path = &written(folder, "results.h5", data);
    let _ = Stored::read(path);
    let _ = Stored::body(path);
    let _ = StoredFamily::read(path);
    let _ = store::read_comparison(path);
    let _ = store::read_crosscheck(path);
    let _ = store::read_origin(path);
    let _ = store::read_stored_orbit(path);
    let _ = store::read_switch_rates(path);
    let _ = store::content(path);
    Some(())
}

/// The lines of a journal without their checksums, which are made here.
fn journal(folder: &Path, data: &[u8]) -> Option<()> {
    let mut before = 0u32;
    let mut lines = String::new();
    for line in text(data)?.lines() {
        let mut hash = crc32fast::Hasher::new();
        hash.update(&before.to_le_bytes());
        hash.update(line.as_bytes());
        before = hash.finalize();
        lines.push_str(&format!("{before:08x} {line}\n"));
    }
    written(folder, "family.h5.journal", lines.as_bytes());
    let _ = StoredFamily::recover(&folder.join("family.h5"));
    Some(())
}
