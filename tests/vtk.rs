//! VTK reads what is exported, where it is installed (`tests/requirements-vtk.txt` into the environment of `make setup`; CI does).

use std::process::Command;

use crate::common::cuboid::cuboid;
use crate::common::rectangle::msh;
use crate::common::root;
use signorini::mesh::ElementKind;

#[test]
fn vtk_reads_series_of_every_solid_element() {
    let Some(python) = crate::common::python("vtk, h5py", "VTK") else { return };
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    for kind in ElementKind::ALL.into_iter().filter(|k| k.dim() == 3) {
        let mesh = cuboid(kind, [1.0, 0.5, 0.4], [2, 1, 1], 0.1);
        std::fs::write(at("body.msh"), msh(&mesh, |_| 0)).unwrap();
        let scene = "[body]\nkind = \"mesh\"\nfile = \"body.msh\"\n[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
            [[support]]\ngroup = \"xmin\"\nfix = [\"x\", \"y\", \"z\"]\n[contact]\ngroup = \"xmax\"\ngap = 0.1\n\
            [initial]\ndisplacement = [\"-0.5*x*(1 + 0.1*y)\", \"0.03*x*y\", \"0.02*x*z\"]\n[run]\nuntil = 4.0\nsamples = 10\n";
        std::fs::write(at("scene.toml"), scene).unwrap();
        for arguments in [
            vec!["run", &at("scene.toml"), "-o", &at("run.h5"), "--force", "-q"],
            vec!["export", &at("run.h5"), "--format", "vtkhdf", "-q"],
        ] {
            let done = crate::common::run(&arguments);
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        }
        let read = Command::new(&python)
            .arg(root().join("tests/vtk_reader.py"))
            .args([at("run.h5"), at("run.vtkhdf"), "0.2".into()])
            .output()
            .unwrap();
        let fault = String::from_utf8_lossy(&read.stderr);
        assert!(read.status.success(), "{kind:?}: {fault}");
        eprint!("{}: {}", kind.name(), String::from_utf8_lossy(&read.stdout));
    }
}
