//! Every contact method on the bar in its first nonsmooth mode ([`super::bar`]) against the closed form: errors of the displacement at `T/2` on 10 to 160
//! elements (expected: an independent prototype), impulse of the contact, and what each does to the energy.

use super::bar::error_at_half_period;
use super::{Case, Check, Effort, Outcome, integrate, order, scene};
use signorini::compare::Variant;
use signorini::scenario::Change;

pub const CASE: Case = Case {
    name: "methods",
    title: "every contact method on the uniform bar: error at half a period, energy, penetration",
    source: "closed form; expected errors of an independent prototype",
    only_by_name: false,
    run,
};

/// What a method does to the energy.
enum Energy {
    /// Nothing.
    Kept,
    /// It takes some, less under refinement.
    Lost,
    /// It adds some.
    Gained,
}

/// A method, its errors on 10, 20, 40, 80, 160 elements, what it does to the energy, and its penetration on 40 elements over the gap.
const EXPECTED: [(&str, [f64; 5], Energy, f64); 8] = [
    ("nbm", [4.85e-2, 1.92e-2, 9.23e-3, 4.45e-3, 2.31e-3], Energy::Lost, 0.0),
    ("mass-redistribution", [4.87e-2, 1.91e-2, 8.95e-3, 3.84e-3, 2.10e-3], Energy::Kept, 0.0),
    (
        "mass-redistribution:optimal",
        [9.77e-2, 4.26e-2, 1.96e-2, 9.42e-3, 4.62e-3],
        Energy::Kept,
        0.0,
    ),
    ("nitsche", [2.93e-2, 1.02e-2, 7.88e-3, 4.57e-3, 2.36e-3], Energy::Kept, 0.044),
    ("nitsche:1:theta=-1", [3.76e-2, 2.04e-2, 9.95e-3, 4.86e-3, 2.45e-3], Energy::Gained, 0.024),
    ("penalty", [9.99e-2, 6.01e-2, 3.28e-2, 1.67e-2, 8.41e-3], Energy::Kept, 0.084),
    ("impact", [4.96e-2, 2.05e-2, 9.66e-3, 4.66e-3, 2.42e-3], Energy::Lost, 0.0),
    ("moreau-jean", [4.96e-2, 2.01e-2, 1.00e-2, 4.86e-3, 2.43e-3], Energy::Lost, 2e-3),
];

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    let count = if effort.short { 4 } else { 5 };
    for (name, expected, energy, penetration) in &EXPECTED {
        let variant = Variant::of_name(name).map_err(|e| e.to_string())?;
        let mut errors = vec![];
        for (k, expected) in expected[..count].iter().enumerate() {
            let n = 10 << k;
            let mut changes = variant.changes();
            changes.push(Change::set("body.elements", format!("[{n}]")));
            let base = scene(include_str!("../bar/scene.toml"), None)?;
            let scene = base.with(&changes).map_err(|e| e.to_string())?;
            let (problem, report, trajectory) = integrate(&scene)?;
            let error = error_at_half_period(&problem, &trajectory, n);
            errors.push(error);
            checks.push(Check::near(
                format!("{name}, {n} elements: error at T/2"),
                error,
                *expected,
                0.02,
            ));
            let change = report.energy_end / report.energy_start - 1.0;
            let what = format!("{name}, {n} elements: change of energy over a period");
            // the last, longer part of a period is behind the contact
            let accepted = match energy {
                Energy::Kept => (-1e-10, 1e-10),
                Energy::Lost => (-0.08, -1e-4),
                Energy::Gained => (1e-3, 0.2),
            };
            checks.push(Check { what, measured: change, accepted });
            if n == 40 {
                let what = format!("{name}, 40 elements: largest penetration");
                checks.push(match *penetration {
                    0.0 => Check::at_most(what, report.max_penetration, 1e-12),
                    // over a whole period somewhat more than over the first half
                    least => Check {
                        what,
                        measured: report.max_penetration,
                        accepted: (0.85 * least, 1.4 * least),
                    },
                });
            }
        }
        let mean = order(errors[0], errors[count - 1]) / (count - 1) as f64;
        checks.push(Check::at_least(format!("{name}: mean order of convergence"), mean, 0.85));
    }
    for n in [10, 40, 160] {
        let base = scene(include_str!("../bar/scene.toml"), Some(&[n]))?;
        let changes = [
            Change::set("contact.method", "waves"),
            Change::set("body.elements", format!("[{n}]")),
        ];
        let scene = base.with(&changes).map_err(|e| e.to_string())?;
        let (problem, _, trajectory) = integrate(&scene)?;
        let error = error_at_half_period(&problem, &trajectory, n);
        checks.push(Check::at_most(format!("waves, {n} elements: error at T/2"), error, 1e-13));
    }
    Ok(checks)
}
