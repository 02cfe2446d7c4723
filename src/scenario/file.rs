//! Files that a scene names.

use std::path::{Path, PathBuf};

use super::names::BESIDE;
use super::{Scene, Whole};

/// What a key says that names a file: a path, or a matrix in a file as `FILE.h5:/dataset`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileName<'a> {
    /// Its path, relative to the scene.
    pub file: &'a str,
    /// A dataset in it, without the slash at the root.
    pub dataset: Option<&'a str>,
}

impl<'a> FileName<'a> {
    /// Take it apart.
    pub fn parse(name: &'a str) -> FileName<'a> {
        match name.split_once(":/") {
            Some((file, dataset)) => FileName { file, dataset: Some(dataset) },
            None => FileName { file: name, dataset: None },
        }
    }
}

impl Scene {
    /// The keys that name files, and what they say (see [`FileName`]).
    pub(crate) fn named_files(&self) -> Vec<(String, String)> {
        let contact = self.contact.as_ref();
        let matrices = [
            ("body.mass_matrix", self.body.mass_matrix.as_ref()),
            ("body.stiffness_matrix", self.body.stiffness_matrix.as_ref()),
            ("body.damping_matrix", self.body.damping_matrix.as_ref()),
            ("contact.n_c", contact.and_then(|c| c.n_c.as_ref())),
            ("contact.n_o", contact.and_then(|c| c.n_o.as_ref())),
        ];
        let matrices = matrices.into_iter().filter_map(|(key, name)| Some((key.to_owned(), name?)));
        let matrices = matrices.filter(|(_, name)| self.attached.get(name).is_none());
        let path = |p: &PathBuf| p.display().to_string();
        let bodies = self.bodies().into_iter().map(|(key, b)| (format!("{key}.file"), &b.file));
        let others = bodies.chain([
            ("body.deck".to_owned(), &self.body.deck),
            ("body.names".to_owned(), &self.body.names),
            ("initial.file".to_owned(), &self.initial.file),
        ]);
        let others = others.filter_map(|(key, p)| Some((key, path(p.as_ref()?))));
        let loads = self.loads.iter().enumerate();
        let tables =
            loads.filter_map(|(k, l)| Some((format!("load[{k}].table"), l.table.clone()?)));
        matrices.map(|(key, name)| (key, name.clone())).chain(others).chain(tables).collect()
    }

    /// Whether the rows of its matrices have names.
    fn has_names(&self) -> bool {
        !self.rows.names.is_empty()
    }

    /// All files that it names, and those that stand beside them, seen from where its own path is.
    pub fn files(&self) -> Vec<PathBuf> {
        let folder = self.source.file.parent().unwrap_or(Path::new(""));
        let names = self.named_files();
        let mut all: Vec<PathBuf> =
            names.iter().map(|(_, name)| folder.join(FileName::parse(name).file)).collect();
        // what decks include
        let decks = |p: &&PathBuf| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("inp"));
        let included: Vec<PathBuf> =
            all.iter().filter(decks).flat_map(|p| Whole::others_of(p)).collect();
        all.extend(included);
        // the names of its rows
        if let Some(stiffness) = self.body.stiffness_matrix.as_ref().filter(|_| self.has_names()) {
            let beside = |ending: &&str| folder.join(stiffness).with_extension(ending);
            all.extend(BESIDE.iter().map(beside).filter(|path| path.is_file()));
        }
        all
    }
}
