//! Every shipped scene runs and is pinned: its numbers to the integration tolerance, its cost by counters.

use crate::common::{relative, root, shipped};
use signorini::event::{Report, Silent};
use signorini::problem::Problem;
use signorini::scenario::Integrator;
use signorini::simulate::simulate;

/// Name, number of switches, first and last switching time, energy at the end, right-hand sides, products and steps.
const GOLDEN: [(&str, usize, f64, f64, f64, u64); 41] = [
    ("bar", 2, 1.3598163377, 1.9800498668, 3.7054667511, 80),
    ("beam", 16, 1.4059687900e2, 4.3624021719e2, 2.6014009249e-10, 2083),
    ("blade", 14, 3.2864288542e1, 4.8348999608e2, 4.0216397725e-8, 16032),
    ("bouncing-bar", 6, 1.0000000000e0, 4.3143927094e0, 2.2846879468e1, 745),
    ("brake-reuss", 889, 4.168543329e-5, 5.974596074e-2, 2.196424687e-4, 480),
    ("bracket", 20, 2.7763040166e-4, 3.6893176645e-3, 1.8452437180e-1, 4444),
    ("driven-stop", 23, 6.2200597856e-1, 4.4375981915e1, 7.4824125467e-3, 104),
    ("feet", 284, 9.5423936824e-1, 2.4369294156e1, 1.9155653560e-4, 92936),
    ("half-disc", 10, 2.0000000000e-1, 5.8901486609e0, 7.8021102411e-3, 551),
    ("half-plate-20x6", 14, 1.5501658373e0, 2.0067953536e0, 3.0090074918e-1, 818),
    ("half-plate-20x6-response", 54, 1.9836689380e1, 3.1274342698e1, 1.6778130729e-1, 2293),
    ("half-plate-orbit", 8, 1.7132407257, 1.9918026789, 0.2211842615, 26),
    ("half-plate-redistribution", 24, 1.4950996976, 9.5455379485, 0.3634242631, 92),
    ("half-plate-response", 40, 19.7903931430, 34.8704911655, 0.2314748540, 139),
    ("half-plate-transient", 8, 1.4718691554, 1.9737934170, 0.3721764670, 46),
    ("half-plate-viscous", 108, 1.5511996680e0, 1.9953274497e0, 3.0485480952e-1, 2164),
    ("joint", 281, 5.9999979560e-2, 3.9559681900e1, 2.6223021390e-1, 359),
    ("oscillator", 6, 2.4183991523, 15.7195944900, 0.5000000000, 26),
    ("plate", 22, 1.4988821525, 2.0035976756, 0.5825145807, 4702),
    ("plate-forced", 206, 16.0715059737, 108.2634937412, 0.3600403608, 628),
    ("plate-half", 12, 1.4988821525, 2.0035976756, 0.2912572904, 4423),
    ("probed-plate", 110, 5.1241044445e-1, 3.8358527850e1, 2.3658408098e-4, 5530),
    ("rotating-casing", 172, 3.9728187802e1, 3.2348615621e2, 4.4452493073e-9, 108623),
    ("rough-wall", 36, 1.0000000000e-1, 1.2465644901e0, 1.1691924914e-2, 46),
    ("shaken-block", 250, 1.6014425139e0, 3.7150304452e1, 1.3391603242e-2, 479),
    ("sphere", 88, 5.0000000000e-1, 1.6922991372e1, 8.3775327552e-6, 40059),
    ("sphere-eighth", 26, 5.0000000000e-1, 1.6699643523e1, 1.0407217709e-6, 18624),
    ("squeal-belt", 312, 1.3788038101e0, 1.1987793766e2, 1.7506636645e-1, 572),
    ("two-frequencies", 79, 9.8338824183e-1, 8.5048591841e1, 6.7080441302e-2, 290),
    ("two-mass-stop", 72, 41.4010668552, 378.0610918347, 0.3995673372, 394),
    ("two-stops", 54, 3.3532829095e-1, 1.9330882425e1, 1.5344974552e-3, 8988),
    ("vadcard", 6, 1.209713529e-3, 1.405849021e-3, 8.026203612e1, 190),
    ("valve", 96, 1.0011765660e0, 8.1318328618e1, 1.4816785108e-4, 2969),
    ("blocks", 24, 2.0000000000e-1, 3.0893084528e0, 3.0000000000e-2, 405),
    ("cradle", 4, 5.0000000000e-2, 3.0831589371e0, 5.0000000000e-1, 70),
    ("cracked-beam", 10, 2.7637100980e-2, 5.2740372589e2, 7.2997419190e-8, 1627),
    ("lap-joint", 111, 7.8031800712e-1, 3.1187162906e1, 3.4646816566e-8, 40395),
    ("pressed-blocks", 30, 2.3372195078e0, 1.7859748004e1, 1.2665387411e-2, 128),
    ("cracked-beam-mode", 20, 1.0186971122e-1, 5.3113729632e2, 7.7760014046e-8, 3586),
    ("lap-joint-mode", 56, 4.2934574758e-3, 2.9259683046e1, 7.4756181217e-9, 22475),
    ("clatter", 19, 1.8721573129e2, 7.1727528179e2, 7.8645134788e-8, 803),
];

/// Copies of our own numbers: they guard change, not truth.
#[test]
fn pinned_numbers_of_shipped_scenes() {
    let mut failures = vec![];
    for (name, switches, first, last, energy, rhs) in GOLDEN {
        let scene = shipped(&format!("{name}.toml"));
        let problem = Problem::new(&scene, None).unwrap();
        let report = simulate(&scene, &problem, true, &mut Silent).unwrap();
        assert!(report.outcome.is_complete(), "{name}: {}", report.outcome);
        let times = (report.switches[0].t, report.switches[report.switches.len() - 1].t);
        let c = report.counters;
        let work = c.rhs_evaluations + c.products + c.steps;
        let line = format!(
            "(\"{name}\", {}, {:.10e}, {:.10e}, {:.10e}, {work}),",
            report.switches.len(),
            times.0,
            times.1,
            report.energy_end,
        );
        println!("    {line}");
        let scale = report.energy_end.abs().max(report.energy_start.abs());
        let same = report.switches.len() == switches
            && (times.0 - first).abs() < 1e-7 * first
            && (times.1 - last).abs() < 1e-7 * last
            && (report.energy_end - energy).abs() < 1e-7 * scale
            // rounding may move a step or two from one machine to another
            && work.abs_diff(rhs) <= rhs / 50;
        if !same {
            failures.push(line);
        }
        assert_eq!(report.proof.missed, 0, "{name}");
        assert!(report.energy_drift < 1e-9, "{name}: {}", report.energy_drift);
        let check = report.lcp_check.unwrap();
        assert!(check.interior_point < 1e-5 && check.gave_up == 0, "{name}: {check:?}");
        assert!(check.enumeration.is_none_or(|e| e < 1e-11), "{name}: {check:?}");
    }
    assert!(failures.is_empty(), "not as pinned:\n{}", failures.join("\n"));
}

#[test]
fn no_scene_is_forgotten() {
    let names: std::collections::BTreeSet<String> = std::fs::read_dir(root().join("scenarios"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    assert_eq!(names, GOLDEN.iter().map(|g| g.0.to_owned()).collect());
}

/// Two exact flows that share no formula give the same motion on every shipped scene that both can take.
#[test]
fn exact_flows_agree_on_the_shipped_scenes() {
    for (name, ..) in GOLDEN {
        let mut scene = shipped(&format!("{name}.toml"));
        if scene.damping.is_some() || scene.loads.iter().any(|l| l.omega.is_some()) {
            continue;
        }
        let problem = Problem::new(&scene, None).unwrap();
        // an eigenproblem of this size for every phase takes minutes; friction has no flow without modes
        if problem.system.n_o() > 1500 || problem.system.tangents().is_some() {
            continue;
        }
        let mut run = |integrator| {
            if let Some(run) = &mut scene.run {
                run.integrator = integrator;
            }
            let report = simulate(&scene, &problem, false, &mut Silent).unwrap();
            assert!(report.outcome.is_complete() && report.is_certified(), "{name}");
            report
        };
        let (a, b) = (run(Integrator::Modal), run(Integrator::Chebyshev));
        let omega = problem.system.body.frequency_unit();
        let state = |r: &Report| -> Vec<f64> {
            r.last.u.iter().copied().chain(r.last.v.iter().map(|v| v / omega)).collect()
        };
        let e = relative(&state(&a), &state(&b));
        println!("{name}: modal and chebyshev differ by {e:.1e}");
        // two weak bounces of the free bar (at 3.61 and 3.64) amplify what the eigensolution rounds, about 1e-13 in the
        // first switching time, some thousandfold
        // 108 switches, most of them weak, do the same to the undamped motion of the fine half plate
        let bound = match name {
            "bouncing-bar" => 1e-9,
            // thin triangles and two materials: frequencies over a factor of seven hundred
            "bracket" => 1e-9,
            // a slender beam, frequencies over a factor of 1243: the square of the lowest is known to 1.7e-10
            "cracked-beam-mode" => 1e-10,
            // tiny elements at the axis, 88 switches, most of them weak
            "sphere" => 1e-9,
            "half-plate-viscous" => 3e-10,
            _ => 1e-11,
        };
        assert!(e < bound, "{name}: {e:e}");
        assert_eq!(a.switches.len(), b.switches.len());
    }
}
