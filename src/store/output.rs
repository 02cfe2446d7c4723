//! Which files may be written, and how.
//!
//! An output is never one of the inputs, by whatever name (symbolic and hard links included). What stands at its place is replaced
//! only if this program made it: an HDF5 file with its attribute, a picture or a text with its mark. New content is written
//! beside (`NAME.part`) and renamed, so that a full disk or a kill leaves the old file whole. While a file is being written a second
//! process that would write it is turned away (`NAME.lock`).

use std::fs::{File, OpenOptions, TryLockError};
use std::io::Read;
use std::path::{Path, PathBuf};

use super::{StoreError, careful};

/// How far the mark of this program is looked for.
const MARK_WITHIN: u64 = 1 << 20;
/// The mark of texts and pictures (SVG, VTU, PVD, XDMF).
pub const MARK: &str = "<!-- signorini -->";

/// A file name with something behind its ending.
pub fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// The beginning of file names, without one of the endings that they will have.
pub fn without_ending(stem: PathBuf, endings: &[&str]) -> PathBuf {
    match stem.extension().is_some_and(|e| endings.iter().any(|ending| e == *ending)) {
        true => stem.with_extension(""),
        false => stem,
    }
}

/// Whether two names lead to one file.
fn same_file(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let id = |p: &Path| std::fs::metadata(p).ok().map(|m| (m.dev(), m.ino()));
        id(a).is_some() && id(a) == id(b)
    }
    #[cfg(not(unix))]
    {
        matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
    }
}

/// What stands at a path.
fn is_ours(path: &Path) -> bool {
    let mut start = vec![];
    let read = File::open(path).and_then(|f| f.take(MARK_WITHIN).read_to_end(&mut start));
    let holds = |mark: &[u8]| start.windows(mark.len()).any(|w| w == mark);
    read.is_ok()
        && match start.get(..4) {
            // of a large mesh the attribute may stand far behind
            Some(b"\x89HDF") => {
                let has_mark = |file: hdf5::File| file.attr("signorini_version").is_ok();
                holds(b"signorini_version") || careful::open(path).is_ok_and(has_mark)
            }
            Some(b"\x89PNG" | b"%PDF") => holds(b"signorini"),
            // nothing is lost with an empty file
            _ => start.is_empty() || holds(MARK.as_bytes()),
        }
}

/// The rules for the outputs of a command.
#[derive(Debug, Clone, Default)]
pub struct Outputs {
    inputs: Vec<PathBuf>,
    force: bool,
}

impl Outputs {
    /// With `force` files of this program may be replaced.
    pub fn new(force: bool) -> Outputs {
        Outputs { inputs: vec![], force }
    }

    /// A file that the command reads.
    pub fn reads(mut self, path: impl Into<PathBuf>) -> Outputs {
        self.inputs.push(path.into());
        self
    }

    /// Files that the command reads.
    pub(crate) fn reads_all(mut self, paths: impl IntoIterator<Item = PathBuf>) -> Outputs {
        self.inputs.extend(paths);
        self
    }

    /// Whether files of this program may be replaced.
    pub(crate) fn is_forced(&self) -> bool {
        self.force
    }

    /// The same rules, with another word on replacing.
    pub(crate) fn with_force(&self, force: bool) -> Outputs {
        Outputs { force, ..self.clone() }
    }

    /// Whether results may be written at `path`: refused early, before anything is computed.
    pub fn check(&self, path: &Path) -> Result<(), StoreError> {
        self.permit(path, self.force)
    }

    /// Whether a picture or an export may be written at `path`: what this program drew may be drawn anew without `--force`.
    pub(crate) fn check_derived(&self, path: &Path) -> Result<(), StoreError> {
        // a table carries no mark of its own
        self.permit(path, self.force || is_ours(path) || !is_own_table(path))
    }

    fn permit(&self, path: &Path, replace: bool) -> Result<(), StoreError> {
        if let Some(input) = self.inputs.iter().find(|input| same_file(input, path)) {
            return Err(StoreError::IsInput { path: path.to_owned(), input: input.clone() });
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|f| !f.is_dir()) {
            return Err(StoreError::unusable(folder, "no such folder; create it first"));
        }
        let Ok(meta) = std::fs::metadata(path) else { return Ok(()) };
        if is_null(path) {
            return Ok(());
        }
        if meta.is_dir() {
            return Err(StoreError::unusable(path, "is a folder; give the name of a file"));
        }
        if !meta.is_file() {
            return Err(StoreError::unusable(path, "is not a regular file; give another name"));
        }
        if !replace {
            return Err(StoreError::Exists(path.to_owned()));
        }
        match is_ours(path) || is_own_table(path) {
            true => Ok(()),
            false => Err(StoreError::Foreign(path.to_owned())),
        }
    }
}

/// The place where nothing is kept.
pub(super) fn is_null(path: &Path) -> bool {
    path == Path::new("/dev/null")
}

/// Tables (CSV) have no place for a mark; they are told by their header.
fn is_own_table(path: &Path) -> bool {
    const HEADERS: [&str; 14] = [
        "kind,name,value",
        "value,direction,kind,period_number,",
        "branch,index,omega,amplitude,amplitude_deviation,",
        "curve,of,periods,omega,value,",
        "value,locked,periods,omega,",
        "omega,rotation_number,size,tail,",
        "variant,changed,mesh,h,",
        "method,rtol,error,switch_error,switches,wall_s,work",
        "t,kinetic,elastic,external,dissipated,jumps",
        "t,node,kind,energy_jump",
        "omega,energy,amplitude,residual,contact_time",
        "omega,harmonics,hbm_energy,residual",
        "index,id,state,",
        "task,id,",
    ];
    let mut start = String::new();
    let read = File::open(path).and_then(|f| f.take(4096).read_to_string(&mut start));
    // of basins the coordinates of the states come first
    let of_basins = || start.lines().next().is_some_and(|l| l.ends_with(",attractor,fate,periods"));
    read.is_ok() && (HEADERS.iter().any(|h| start.starts_with(h)) || of_basins())
}

/// Put a whole file in its place: written beside, then renamed.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    replace_with(path, |part| std::fs::write(part, bytes))
}

/// The same with a file that `write` makes at the path it is given.
pub(crate) fn replace_with(
    path: &Path,
    write: impl FnOnce(&Path) -> std::io::Result<()>,
) -> Result<(), StoreError> {
    let part = beside(path, ".part");
    write(&part).and_then(|()| std::fs::rename(&part, path)).map_err(|e| {
        // what is half there helps nobody
        let _ = std::fs::remove_file(&part);
        StoreError::write(path, e)
    })
}

/// The sole right to write a file; gone with the process, however it ends.
#[derive(Debug)]
struct Lock {
    path: PathBuf,
    /// Holds the lock while it is open.
    _file: File,
}

impl Lock {
    fn take(target: &Path) -> Result<Lock, StoreError> {
        let path = beside(target, ".lock");
        for _ in 0..100 {
            let open = OpenOptions::new().create(true).truncate(false).write(true).open(&path);
            let file = open.map_err(|e| StoreError::write(&path, e))?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    return Err(StoreError::Busy(target.to_owned()));
                }
                // a file system without locks
                Err(TryLockError::Error(_)) | Ok(()) => {}
            }
            // the last holder may have removed the name between the opening and the locking
            if is_open_file(&file, &path) {
                return Ok(Lock { path, _file: file });
            }
        }
        Err(StoreError::Busy(target.to_owned()))
    }
}

#[cfg(unix)]
fn is_open_file(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |m: std::fs::Metadata| (m.dev(), m.ino());
    let known = file.metadata().ok().map(id);
    known.is_some() && known == std::fs::metadata(path).ok().map(id)
}

#[cfg(not(unix))]
fn is_open_file(_: &File, path: &Path) -> bool {
    path.exists()
}

impl Drop for Lock {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// A file that is being written.
#[derive(Debug)]
pub struct Staged {
    path: PathBuf,
    at: PathBuf,
    /// Held until the file is done.
    _lock: Option<Lock>,
}

impl Staged {
    /// Claim `path`. Where nothing stands yet the file grows in its place (a killed program leaves it there); where an
    /// old one stands, beside it.
    pub fn begin(outputs: &Outputs, path: &Path) -> Result<Staged, StoreError> {
        outputs.check(path)?;
        if is_null(path) {
            let name = format!("signorini-{}.h5", std::process::id());
            return Ok(Staged {
                path: path.to_owned(),
                at: std::env::temp_dir().join(name),
                _lock: None,
            });
        }
        // through a symbolic link: the file it leads to
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let _lock = Some(Lock::take(&path)?);
        // between the check and the lock another process may have finished
        outputs.check(&path)?;
        let at = if path.exists() { beside(&path, ".part") } else { path.clone() };
        if at != path && at.exists() && !is_ours(&at) {
            return Err(StoreError::Foreign(at));
        }
        Ok(Staged { path, at, _lock })
    }

    /// Where to write now.
    pub fn at(&self) -> &Path {
        &self.at
    }

    /// The file that it will be.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Write the next version beside what was committed.
    pub(crate) fn restart(&mut self) {
        self.at = beside(&self.path, ".part");
    }

    /// Go on writing where the file stands.
    pub(crate) fn in_place(&mut self) {
        self.at.clone_from(&self.path);
    }

    /// The file is whole: it takes its place. It can go on growing there.
    pub(crate) fn commit(&mut self) -> Result<(), StoreError> {
        if is_null(&self.path) {
            let _ = std::fs::remove_file(&self.at);
        } else if self.at != self.path {
            std::fs::rename(&self.at, &self.path).map_err(|e| StoreError::write(&self.path, e))?;
            self.at.clone_from(&self.path);
        }
        Ok(())
    }

    /// Nothing of it is worth keeping.
    pub(crate) fn discard(&self) {
        let _ = std::fs::remove_file(&self.at);
    }
}

/// Room on the disk that a path lies on, in bytes; none where it cannot be told.
pub fn room(path: &Path) -> Option<u64> {
    #[cfg(unix)]
    {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        let s = rustix::fs::statvfs(folder.unwrap_or(Path::new("."))).ok()?;
        Some(s.f_bavail.saturating_mul(s.f_frsize))
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        None
    }
}

/// Whether `bytes` more fit on the disk; asked before the HDF5 library is, which leaves a broken file where they do not.
pub(crate) fn check_room(path: &Path, bytes: u64) -> Result<(), StoreError> {
    /// For what the library writes besides the data.
    const MARGIN: u64 = 64 << 10;
    match room(path) {
        Some(there) if there < bytes.saturating_add(MARGIN) => {
            Err(StoreError::DiskFull { path: path.to_owned(), needed: bytes + MARGIN, there })
        }
        _ => Ok(()),
    }
}

/// The checksum of a line behind one with the checksum `before`.
pub(super) fn checksum(before: u32, text: &str) -> u32 {
    let mut hash = crc32fast::Hasher::new();
    hash.update(&before.to_le_bytes());
    hash.update(text.as_bytes());
    hash.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_and_foreign_files_stay_as_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("scene.toml"), "mine").unwrap();
        std::fs::hard_link(at("scene.toml"), at("twin.h5")).unwrap();
        std::fs::write(at("other.png"), "mine too").unwrap();
        std::fs::write(at("drawn.svg"), "<svg><!-- signorini --></svg>").unwrap();
        std::fs::write(at("empty.h5"), "").unwrap();
        let outputs = Outputs::new(true).reads(at("scene.toml"));
        assert!(matches!(outputs.check(&at("twin.h5")), Err(StoreError::IsInput { .. })));
        assert!(matches!(outputs.check(&at("other.png")), Err(StoreError::Foreign(_))));
        assert!(outputs.check(&at("drawn.svg")).is_ok());
        assert!(outputs.check(&at("empty.h5")).is_ok());
        let careful = outputs.with_force(false);
        assert!(matches!(careful.check(&at("drawn.svg")), Err(StoreError::Exists(_))));
        assert!(careful.check_derived(&at("drawn.svg")).is_ok());
        assert!(matches!(careful.check_derived(&at("other.png")), Err(StoreError::Foreign(_))));
        assert!(careful.check(&at("new.h5")).is_ok());
    }

    /// The attribute of a file stands where HDF5 puts it: behind a mesh, if that was written first.
    #[test]
    fn the_mark_of_a_file_may_stand_far_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large.h5");
        for is_ours in [true, false] {
            let file = hdf5::File::create(&path).unwrap();
            let names: Vec<String> = (0..40).map(|k| format!("attribute {k}")).collect();
            let write = |name: &str| {
                file.new_attr::<f64>().create(name).unwrap().write_scalar(&1.0).unwrap();
            };
            names.iter().for_each(|name| write(name));
            let mesh = vec![0.5f64; 400_000];
            file.new_dataset_builder().with_data(&mesh).create("mesh").unwrap();
            file.flush().unwrap();
            if is_ours {
                write("signorini_version");
            }
            (40..80).for_each(|k| write(&format!("attribute {k}")));
            drop(file);
            let bytes = std::fs::read(&path).unwrap();
            let place = bytes.windows(17).position(|w| w == b"signorini_version");
            assert!(place.is_none_or(|at| at as u64 > MARK_WITHIN), "{place:?}");
            assert_eq!(Outputs::new(true).check(&path).is_ok(), is_ours);
        }
    }

    #[test]
    fn a_second_claim_is_refused_until_the_first_is_released() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.h5");
        let outputs = Outputs::new(false);
        let first = Staged::begin(&outputs, &path).unwrap();
        assert!(matches!(Staged::begin(&outputs, &path), Err(StoreError::Busy(_))));
        drop(first);
        assert!(Staged::begin(&outputs, &path).is_ok());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
