//! Studies: the same data whoever carries the tasks out, and however often they are interrupted.

use std::collections::BTreeMap;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::common::{datasets, root, wait_until};
use serde_json::Value;

/// A bar that bounces for a while, by two methods on three meshes before four gaps; a viscous look at families costs more than a test may.
const STUDY: &str = "# two methods × three meshes × four gaps\nscene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n\
    \"contact.method\" = [\"nbm\", \"nbm:constant\"]\n\"body.elements\" = [[20], [30], [40]]\n\"contact.gap\" = [0.5, 0.8, 1.0, 1.2]\n";
const FAMILIES: &str = "scene = \"half-plate-orbit.toml\"\ncommand = \"backbone\"\noptions = [\"--step\", \"0.05\"]\n[vary]\n\
    \"contact.method\" = [\"nbm\", \"nbm:constant\"]\n\"body.elements\" = [[4, 2], [6, 2]]\n";

/// A folder with a study and its scene, and what is done in it.
struct Place {
    folder: tempfile::TempDir,
    environment: Vec<(&'static str, String)>,
}

impl Place {
    fn new(study: &str, until: f64) -> Place {
        let folder = tempfile::tempdir().unwrap();
        for scene in ["bar.toml", "half-plate-orbit.toml"] {
            let text = std::fs::read_to_string(root().join("scenarios").join(scene)).unwrap();
            let text = text.replace("until = 3.36", &format!("until = {until}"));
            std::fs::write(folder.path().join(scene), text).unwrap();
        }
        std::fs::write(folder.path().join("s.toml"), study).unwrap();
        Place { folder, environment: vec![] }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signorini"));
        command.args(words).current_dir(self.folder.path());
        command.envs(self.environment.iter().map(|(k, v)| (k, v)));
        command
    }

    /// Exit code and the object on standard output.
    fn said(&self, words: &[&str]) -> (i32, Value) {
        let output = self.command(&[words, &["--json"]].concat()).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let object = serde_json::from_str(&text)
            .unwrap_or_else(|e| panic!("{e}: {text}{}", String::from_utf8_lossy(&output.stderr)));
        (output.status.code().unwrap(), object)
    }

    fn done(&self, words: &[&str]) -> Value {
        let (code, object) = self.said(words);
        assert_eq!(code, 0, "{words:?}: {object}");
        object
    }

    /// Begin a run as a group of processes of its own.
    fn begin(&self, words: &[&str]) -> std::process::Child {
        let mut command = self.command(words);
        command.process_group(0).stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    }

    fn count(&self, state: &str) -> u64 {
        self.done(&["study", "status", "s.toml"])["counts"][state].as_u64().unwrap()
    }

    /// Wait for at least so many answers.
    fn wait_for(&self, done: u64) {
        wait_until(&format!("{done} tasks are done"), || {
            self.path("s.study/study.json").exists() && self.count("done") >= done
        });
    }

    /// The processes of tasks that said they stop, by their numbers.
    fn processes(&self) -> Vec<String> {
        let Ok(folders) = std::fs::read_dir(self.path("s.study/tasks")) else { return vec![] };
        let messages = folders
            .filter_map(|d| std::fs::read_to_string(d.unwrap().path().join("messages")).ok());
        let said = |text: String| -> Vec<String> {
            let lines = text.lines().filter_map(|l| l.split_once(", process "));
            lines.map(|(_, number)| number.to_owned()).collect()
        };
        messages.flat_map(said).collect()
    }

    /// Wait until two tasks stand still that did not before: they neither end nor go on by themselves.
    fn wait_for_stopped(&self, before: &[String]) -> Vec<String> {
        let stands = |number: &String| state_of_process(number) == Some('T');
        let mut now = vec![];
        wait_until("two tasks stand still", || {
            now = self.processes();
            now.retain(|number| !before.contains(number) && stands(number));
            now.len() == 2
        });
        now
    }

    /// Answers as they stand, by task.
    fn answers(&self) -> BTreeMap<String, String> {
        let folders = std::fs::read_dir(self.path("s.study/tasks")).unwrap().map(|d| d.unwrap());
        let text = |folder: &Path| std::fs::read_to_string(folder.join("done.json")).ok();
        let name = |d: &std::fs::DirEntry| d.file_name().into_string().unwrap();
        folders.filter_map(|d| Some((name(&d), text(&d.path())?))).collect()
    }

    /// What is collected, but for what it took.
    fn collected(&self) -> BTreeMap<String, (Vec<usize>, Vec<u8>)> {
        self.done(&["study", "collect", "s.toml", "--force"]);
        let mut all = datasets(&self.path("s.h5"));
        all.retain(|name, _| !name.starts_with("/work/"));
        assert!(all.contains_key("/study/state") && all.len() > 8, "{:?}", all.keys());
        all
    }
}

/// Its letter in the table of processes; none of a process that is not there.
fn state_of_process(number: &str) -> Option<char> {
    let stat = std::fs::read_to_string(format!("/proc/{number}/stat")).ok()?;
    stat.rsplit(") ").next()?.chars().next()
}

fn kill(what: &str) {
    let _ = Command::new("kill").args(["-9", "--", what]).status();
}

/// One worker, two workers, and one who is killed again and again: the same data.
#[test]
fn a_study_gives_the_same_data_however_it_is_carried_out() {
    for (study, until, tasks) in [(STUDY, 1500.0, 24), (FAMILIES, 3.36, 4)] {
        let one = Place::new(study, until);
        let answer = one.done(&["study", "run", "s.toml", "--workers", "1"]);
        assert_eq!(answer["counts"]["done"], tasks, "{answer}");
        let expected = one.collected();
        assert!(one.path("s.csv").exists());
        assert_eq!(one.path("s-points.csv").exists(), tasks == 4);

        let two = Place::new(study, until);
        two.done(&["study", "run", "s.toml", "--workers", "2"]);
        assert_eq!(two.collected(), expected);
        // a second time there is nothing to do
        let before = two.answers();
        two.done(&["study", "run", "s.toml"]);
        assert_eq!(two.answers(), before);

        let mut killed = Place::new(study, until);
        let words = ["study", "run", "s.toml", "--workers", "2", "--quiet"];
        // one task has its answer; two others stand still in the midst of their work
        let printed = killed.done(&["study", "run", "s.toml", "--print-tasks"]);
        let line = printed["tasks"][0].as_str().unwrap();
        let id = line.rsplit(' ').next().unwrap();
        killed.done(&["study", "task", "s.study", id]);
        let done = killed.answers();
        assert_eq!(done.len(), 1);
        let look = if tasks == 4 { 2 } else { 30 };
        killed.environment = vec![("SIGNORINI_AT_LOOK", format!("STOP {look} task"))];
        // all its processes at once
        let mut first = killed.begin(&words);
        killed.wait_for_stopped(&[]);
        kill(&format!("-{}", first.id()));
        first.wait().unwrap();
        assert_eq!(killed.answers(), done);
        // the controller alone: its tasks go on, and whoever comes next waits for them
        let gone = killed.processes();
        let mut second = killed.begin(&words);
        let held = killed.wait_for_stopped(&gone);
        kill(&second.id().to_string());
        second.wait().unwrap();
        // a task alone, while the next one waits for it
        killed.environment = vec![];
        let third = killed.begin(&words);
        kill(&held[0]);
        let _ = Command::new("kill").args(["-CONT", &held[1]]).status();
        third.wait_with_output().unwrap();
        let answer = killed.done(&["study", "run", "s.toml", "--workers", "2"]);
        assert_eq!(answer["counts"]["done"], tasks, "{answer}");
        // what had an answer was not carried out again
        let now = killed.answers();
        assert!(done.iter().all(|(id, answer)| now[id] == *answer));
        assert_eq!(killed.collected(), expected, "killed");
    }
}

/// A study of friction, coefficient by variant: energies of an independent program.
#[test]
fn friction_is_varied_as_any_number_is() {
    let study = "scene = \"rough-wall.toml\"\ncommand = \"run\"\n[vary]\n\
                 \"contact.friction\" = [0.1, 0.3]\n\"contact.tangent\" = [\"inertia\", \"massless\"]\n";
    let place = Place::new(study, 1.0);
    std::fs::copy(root().join("scenarios/rough-wall.toml"), place.path("rough-wall.toml")).unwrap();
    place.done(&["study", "run", "s.toml"]);
    place.collected();
    let table = std::fs::read_to_string(place.path("s.csv")).unwrap();
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = rows.next().unwrap();
    let energy = head.iter().position(|name| *name == "energy_end").unwrap();
    let found: Vec<f64> = rows.map(|row| row[energy].parse().unwrap()).collect();
    let wanted = [0.011_271_002_853, 0.011_153_072_892, 0.011_691_924_914, 0.011_292_399_297];
    assert_eq!(found.len(), wanted.len());
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found / wanted - 1.0).abs() < 1e-9, "{found} {wanted}");
    }
}

/// Failures are kept with their messages, the others are whole; more values find again what is done.
#[test]
fn failures_are_kept_and_studies_grow() {
    let study = "scene = \"bar.toml\"\ncommand = \"run\"\nzip = true\n[vary]\n\"run.switch_limit\" = [1000, 1]\n\"contact.gap\" = [0.5, 0.6]\n";
    let place = Place::new(study, 30.0);
    let (code, answer) = place.said(&["study", "run", "s.toml"]);
    assert_eq!(code, 3, "{answer}");
    assert_eq!((&answer["counts"]["done"], &answer["counts"]["failed"]), (&1.into(), &1.into()));
    // told by what is wrong, without the way to the task
    let told = place.command(&["study", "status", "s.toml"]).output().unwrap();
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(told.contains("task 1 (") && !told.contains("tasks/"), "{told}");
    let failed = &answer["tasks"][1];
    assert!(failed["message"].as_str().unwrap().contains("switch"), "{failed}");
    place.done(&["study", "collect", "s.toml"]);
    let table = std::fs::read_to_string(place.path("s.csv")).unwrap();
    assert!(table.starts_with("index,id,state,run.switch_limit,contact.gap,"), "{table}");
    assert_eq!(table.lines().count(), 3);
    // it is not tried again unless one asks for it
    let before = place.answers();
    assert_eq!(place.said(&["study", "run", "s.toml"]).0, 3);
    assert_eq!(place.answers(), before);
    // one value more: one task more
    let more = study.replace("1]", "1, 900]").replace("0.6]", "0.6, 0.7]");
    std::fs::write(place.path("s.toml"), more).unwrap();
    let lines = place.command(&["study", "run", "s.toml", "--print-tasks"]).output().unwrap();
    let lines = String::from_utf8(lines.stdout).unwrap();
    assert_eq!(lines.lines().count(), 1, "{lines}");
    // whoever carries the line out
    let status = Command::new("sh").args(["-c", lines.trim()]).status().unwrap();
    assert!(status.success());
    assert_eq!(place.count("done"), 2);
}

/// What is done belongs to the contents of the files that a scene names, to one study, and to the task that it was computed for.
#[test]
fn results_belong_to_what_was_asked() {
    let mesh = |from: &str, place: &Place| {
        let from = root().join("scenarios/meshes").join(from);
        std::fs::copy(from, place.path("m/body.msh")).unwrap();
    };
    let study = "scene = \"m/disc.toml\"\ncommand = \"run\"\n[vary]\n\"body.file\" = [\"body.msh\"]\n\"run.until\" = [0.5, 0.6]\n";
    let place = Place::new(study, 3.36);
    std::fs::create_dir(place.path("m")).unwrap();
    let text = std::fs::read_to_string(root().join("scenarios/half-disc.toml")).unwrap();
    std::fs::write(place.path("m/disc.toml"), text.replace("meshes/half-disc.msh", "body.msh"))
        .unwrap();
    mesh("half-disc.msh", &place);
    place.done(&["study", "run", "s.toml"]);
    let before = place.answers();
    // another mesh under the same name: other tasks, which fail, because it has other groups
    mesh("bracket.msh", &place);
    assert_eq!(place.said(&["study", "status", "s.toml"]).0, 2);
    assert_eq!(place.said(&["study", "collect", "s.toml"]).0, 2);
    assert_eq!(place.said(&["study", "run", "s.toml"]).0, 3);
    mesh("half-disc.msh", &place);
    place.done(&["study", "run", "s.toml"]);
    assert!(before.iter().all(|(id, a)| place.answers()[id] == *a));
    // a file that is not there, before anything is begun
    std::fs::write(place.path("n.toml"), study.replace("body.msh", "no.msh")).unwrap();
    assert_eq!(place.said(&["study", "run", "n.toml"]).0, 2);
    // another study does not take the folder over
    std::fs::write(place.path("o.toml"), study.replace("0.6", "0.7")).unwrap();
    let (code, said) = place.said(&["study", "run", "o.toml", "-o", "s.study"]);
    assert!(code == 2 && said["error"].as_str().unwrap().contains("belongs to"), "{said}");
    // a result that is gone, and one that is none, are computed anew; an answer of another task is none
    let ids: Vec<&String> = before.keys().collect();
    let task = |id: &str, name: &str| place.path("s.study/tasks").join(id).join(name);
    std::fs::remove_file(task(ids[0], "result.h5")).unwrap();
    std::fs::write(task(ids[1], "result.h5"), "junk").unwrap();
    std::fs::copy(task(ids[0], "done.json"), task(ids[1], "done.json")).unwrap();
    std::fs::write(task(ids[1], "scene.toml"), "junk").unwrap();
    assert_eq!(place.count("done"), 0);
    let answer = place.done(&["study", "run", "s.toml"]);
    assert_eq!(answer["counts"]["done"], 2, "{answer}");
    place.done(&["study", "collect", "s.toml"]);
    assert_eq!(place.done(&["inspect", "s.h5"])["done"], 2);
    assert_eq!(place.said(&["plot", "s.h5"]).0, 2);
}

/// Many tasks that fail of one cause are told once; a table of the study itself is collected anew without `--force`, and nobody else's is touched.
#[test]
fn one_cause_is_told_once_and_own_tables_are_drawn_anew() {
    let study = "scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n\"contact.gap\" = [1, -3]\n\"run.samples\" = [10, 20, 30]\n";
    let place = Place::new(study, 3.36);
    let bar = std::fs::read_to_string(place.path("bar.toml")).unwrap();
    let bar = bar.replace("gap = 1.0", "gap = 1.0\nmethod = \"impact\"");
    std::fs::write(place.path("bar.toml"), bar).unwrap();
    let (code, answer) = place.said(&["study", "run", "s.toml", "--workers", "1"]);
    assert_eq!((code, &answer["counts"]["failed"]), (3, &3.into()), "{answer}");
    let told = place.command(&["study", "status", "s.toml"]).output().unwrap();
    let told = String::from_utf8(told.stdout).unwrap();
    assert_eq!(told.matches("penetrates the obstacle").count(), 1, "{told}");
    assert!(told.contains("3 tasks failed (3, 4, 5): "), "{told}");
    assert!(!told.contains("tasks/"), "{told}");
    place.done(&["study", "collect", "s.toml"]);
    place.done(&["study", "collect", "s.toml"]);
    // another study of that name, or a run, is none of its own
    place.done(&["run", "bar.toml", "-o", "other.h5"]);
    let (code, refused) = place.said(&["study", "collect", "s.toml", "--to", "other"]);
    assert_eq!(code, 2, "{refused}");
}

/// What another version of the program found is said, and carried out anew where that is asked for.
#[test]
fn answers_of_another_version_are_told() {
    let study =
        "scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n\"contact.gap\" = [0.5, 0.8, 1.0]\n";
    let place = Place::new(study, 3.36);
    let answer = place.done(&["study", "run", "s.toml", "--workers", "1"]);
    assert_eq!((&answer["counts"]["done"], &answer["outdated"]), (&3.into(), &0.into()));
    let mut files: Vec<PathBuf> = std::fs::read_dir(place.path("s.study/tasks"))
        .unwrap()
        .map(|d| d.unwrap().path().join("done.json"))
        .collect();
    files.sort();
    for (file, version) in files.iter().zip(["0.0.1", ""]) {
        let mut done: Value =
            serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
        done["version"] = version.into();
        if version.is_empty() {
            done.as_object_mut().unwrap().remove("version");
        }
        std::fs::write(file, done.to_string()).unwrap();
    }
    let before = place.answers();
    let told = place.command(&["study", "status", "s.toml"]).output().unwrap();
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(
        told.contains("2 tasks have their answers from signorini") && told.contains("0.0.1"),
        "{told}"
    );
    let again = place.command(&["study", "run", "s.toml"]).output().unwrap();
    let said = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(again.status.success() && said.contains("--outdated"), "{said}");
    assert_eq!(place.answers(), before, "nothing is carried out anew unasked");
    let answer = place.done(&["study", "run", "s.toml", "--outdated", "--workers", "1"]);
    assert_eq!(
        (&answer["counts"]["done"], &answer["outdated"]),
        (&3.into(), &0.into()),
        "{answer}"
    );
    let now = place.answers();
    assert_eq!(now.iter().filter(|(id, text)| before[*id] == **text).count(), 1);
}

/// Bad studies are exit code 2 with file, line and what would be accepted, before anything is written.
#[test]
fn bad_studies_are_refused() {
    let vary = "[vary]\n\"contact.gap\" = [0.5]\n";
    for (text, said) in [
        (format!("scene = \"bar.toml\"\ncommand = \"plot\"\n{vary}"), "give one of run, orbit"),
        (format!("scene = \"no.toml\"\ncommand = \"run\"\n{vary}"), "cannot read the scene"),
        (format!("scene = \"bar.toml\"\ncommand = \"run\"\noption = []\n{vary}"), "s.toml:3:1"),
        (format!("scene = \"bar.toml\"\ncommand = \"run\"\noptions = [\"-o\", \"x\"]\n{vary}"), "the study says itself"),
        ("scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n".into(), "is empty"),
        (format!("scene = \"bar.toml\"\ncommand = \"run\"\noptions = [\"--bogus\"]\n{vary}"), "unexpected argument"),
        (format!("scene = \"bar.toml\"\ncommand = \"run\"\noptions = [\"--help\"]\n{vary}"), "ask for help"),
        ("scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\ncontact.gap = [1]\n".into(), "quotation marks"),
        ("scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n\"contact.gap\" = 1\n".into(), "no list of values"),
        ("scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n\"contact.gpa\" = [1]\n".into(), "contact.gpa = 1"),
        ("scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n\"contact.method\" = [\"nbn\"]\n".into(), "no contact method"),
        ("scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n\"contact.gap\" = [1, 1.0]\n".into(), "has 1.0 twice"),
        ("scene = \"bar.toml\"\ncommand = \"run\"\n[vary]\n\"contact.method\" = [\"nbm\", \"nbm\"]\n".into(), "computes what task 0 does"),
        ("scene = \"bar.toml\"\ncommand = \"run\"\nzip = true\n[vary]\n\"contact.gap\" = [1, 2]\n\"run.until\" = [1]\n".into(), "of one length"),
    ] {
        let place = Place::new(&text, 3.36);
        let output = place.command(&["study", "run", "s.toml"]).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ");
        assert_eq!(output.status.code(), Some(2), "{text}: {message}");
        assert!(message.contains(said), "{text}: {message}");
        assert!(!place.path("s.study").exists(), "{text}");
    }
    let place = Place::new(STUDY, 3.36);
    std::fs::create_dir(place.path("s.study")).unwrap();
    std::fs::write(place.path("s.study/notes"), "mine").unwrap();
    assert_eq!(place.said(&["study", "run", "s.toml"]).0, 2);
    assert_eq!(std::fs::read_dir(place.path("s.study")).unwrap().count(), 1);
}

/// A node of Slurm for as long as a test needs it.
struct Slurm {
    folder: tempfile::TempDir,
    conf: String,
}

impl Slurm {
    /// None where there is no Slurm, loudly.
    fn start() -> Option<Slurm> {
        let has = |program: &str| {
            Command::new("sh")
                .args(["-c", &format!("command -v {program}")])
                .output()
                .is_ok_and(|o| o.status.success())
        };
        let is_root = Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout == b"0\n");
        if !(is_root && ["munged", "slurmctld", "slurmd", "sbatch"].into_iter().all(has)) {
            crate::common::unavailable(
                "Slurm (Debian: slurm-wlm, munge; and root)",
                crate::common::Kind::System,
            );
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let output = Command::new(root().join("tests/slurm/node.sh"))
            .arg("start")
            .arg(folder.path())
            .stderr(Stdio::inherit())
            .output()
            .unwrap();
        assert!(output.status.success(), "Slurm does not start");
        let conf = String::from_utf8(output.stdout).unwrap().trim().to_owned();
        Some(Slurm { folder, conf })
    }

    fn run(&self, program: &str, words: &[&str]) -> String {
        let output =
            Command::new(program).args(words).env("SLURM_CONF", &self.conf).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn answers(&self, program: &str) -> bool {
        let asked = Command::new(program).env("SLURM_CONF", &self.conf).output();
        asked.unwrap().status.success()
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("{}{}", self.run("sinfo", &["-N", "-l"]), self.run("squeue", &["-l"]));
            for log in ["slurmctld.log", "slurmd.log"] {
                let text =
                    std::fs::read_to_string(self.folder.path().join(log)).unwrap_or_default();
                let lines: Vec<&str> = text.lines().collect();
                eprintln!("{log}:\n{}", lines[lines.len().saturating_sub(30)..].join("\n"));
            }
        }
        let _ = Command::new(root().join("tests/slurm/node.sh"))
            .arg("stop")
            .arg(self.folder.path())
            .status();
    }
}

/// On a job array with two slots, with a task and Slurm's controller killed in the middle: the same data.
#[test]
fn a_job_array_of_slurm_gives_the_same_data() {
    let Some(slurm) = Slurm::start() else { return };
    let until = 1500.0;
    let here = Place::new(STUDY, until);
    here.done(&["study", "run", "s.toml"]);
    let mut place = Place::new(STUDY, until);
    place.environment = vec![("SLURM_CONF", slurm.conf.clone())];
    let words = ["study", "run", "s.toml", "--engine", "slurm"];
    let answer = place.done(&words);
    assert_eq!(answer["submitted"], 24);
    // a second submission finds them in the queue
    let answer = place.done(&words);
    assert!(
        answer["submitted"].as_u64().unwrap() + place.count("done") < 24
            && answer["queued"].as_u64() > Some(0),
        "{answer}"
    );
    place.wait_for(3);
    let done = place.answers();
    // a task that runs, and the controller
    let running = slurm.run("squeue", &["-h", "-r", "-t", "R", "-o", "%A"]);
    running
        .split_whitespace()
        .take(1)
        .for_each(|job| drop(slurm.run("scancel", &["--signal=KILL", job])));
    let pid = std::fs::read_to_string(slurm.folder.path().join("slurmctld.pid")).unwrap();
    kill(pid.trim());
    // one whose parent does not ask after it stays in the table of processes, as Z
    wait_until("the controller is dead", || {
        matches!(state_of_process(pid.trim()), None | Some('Z'))
    });
    // nobody takes this for an empty queue
    let status = place.done(&["study", "status", "s.toml"]);
    assert!(status["queue_unknown"].is_string() && status["queued"].is_null(), "{status}");
    slurm.run("slurmctld", &[]);
    wait_until("the controller answers", || slurm.answers("squeue"));
    // what was killed is submitted again by the next, and so is an array that the controller had not yet written down
    wait_until("the array is done", || {
        let mut waits = place.begin(&[&words[..], &["--wait"]].concat());
        wait_until("the queue is empty", || {
            // a controller that forgot a job gives its number again; where that job is still there, it takes the node out of use and holds the new one
            if slurm.run("sinfo", &["-h", "-o", "%t"]).contains("dr") {
                slurm.run("scontrol", &["update", "NodeName=ALL", "State=RESUME"]);
            }
            for job in slurm.run("squeue", &["-h", "-r", "-t", "PD", "-o", "%i %r"]).lines() {
                if let Some((id, reason)) = job.split_once(' ')
                    && reason.contains("held")
                {
                    slurm.run("scontrol", &["release", id]);
                }
            }
            waits.try_wait().unwrap().is_some()
        });
        place.count("done") == 24
    });
    let now = place.answers();
    assert!(done.iter().all(|(id, answer)| now[id] == *answer));
    assert_eq!(place.collected(), here.collected());
}
