//! Many independent runs over parameters, meshes and methods.
//!
//! A [`Study`] is a scene, a command and lists of values; its product (or the lists side by side) gives [`Task`]s, each an ordinary command with an
//! ordinary scene in a [`Folder`] of its own. A task is named by what it computes, so that a study with more values finds again what is done. Who carries
//! a task out (a worker here, an index of a job array elsewhere) takes its lock, and leaves its answer as the last thing: what has no answer and
//! no lock was interrupted, and may be gone on with.

pub mod benchmark;
mod definition;
mod folder;
mod gather;

pub use definition::Study;

pub(crate) use definition::Task;
pub use folder::{Done, Folder, TaskState};
pub(crate) use folder::{StudyError, TaskPlace, VERSION};
pub use gather::gather;
