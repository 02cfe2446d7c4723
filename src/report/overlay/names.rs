//! What the families of one picture are called: their kind, and what tells them apart.

use crate::records::Branch;
use crate::report::families::kind;
use crate::scenario::{Contact, ContactMethod, Inertia, Reduction, Scene};
use crate::store::StoredFamily;

/// Names of families; `common` begins all titles and stands above the picture.
pub(super) fn names(families: &[&StoredFamily], common: &str) -> Vec<String> {
    let scenes: Vec<Option<Scene>> =
        families.iter().map(|f| Scene::parse(&f.scene, &f.path).ok()).collect();
    let of_scene = |word: fn(&Scene) -> Option<String>| -> Vec<String> {
        scenes.iter().map(|s| s.as_ref().and_then(word).unwrap_or_default()).collect()
    };
    let mut names: Vec<String> = families.iter().map(|f| kind(f)).collect();
    let titles = families.iter().map(|f| rest(&f.title, common)).collect();
    for facet in [titles, of_scene(mesh), of_scene(contact), of_scene(reduction)] {
        if facet.iter().any(|word| *word != facet[0]) {
            add(&mut names, &facet, |_| true);
        }
    }
    let ways = families.iter().map(|f| f.outline().way.to_string()).collect::<Vec<_>>();
    let files = families.iter().map(|f| file(f)).collect::<Vec<_>>();
    for last in [ways, files] {
        let known = names.clone();
        let clash = |k: usize, l: usize| {
            k != l && known[k] == known[l] && may_be_confused(families[k], families[l])
        };
        add(&mut names, &last, |k| (0..known.len()).any(|l| clash(k, l)));
    }
    names
}

/// Families by shooting, and series with the same number of harmonics.
fn may_be_confused(a: &StoredFamily, b: &StoredFamily) -> bool {
    let all = |f: &StoredFamily| -> Vec<Option<usize>> {
        f.branches.iter().map(Branch::harmonics).collect()
    };
    let of_b = all(b);
    all(a).iter().any(|n| of_b.contains(n))
}

/// Add a word to some names, unless they say it already.
fn add(names: &mut [String], words: &[String], wanted: impl Fn(usize) -> bool) {
    for (k, (name, word)) in names.iter_mut().zip(words).enumerate() {
        let said = word.is_empty() || name.split(", ").any(|part| part == word);
        if wanted(k) && !said {
            *name = format!("{name}, {word}");
        }
    }
}

/// A title without what all have in common.
fn rest(title: &str, common: &str) -> String {
    let rest = title.strip_prefix(common).unwrap_or(title);
    rest.trim_start_matches([',', ':', ' ']).chars().filter(|c| !c.is_control()).take(60).collect()
}

fn file(family: &StoredFamily) -> String {
    family.path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// `10 × 3 elements`
fn mesh(scene: &Scene) -> Option<String> {
    let counts: Vec<String> = scene.body.elements.iter().map(usize::to_string).collect();
    (!counts.is_empty()).then(|| format!("{} elements", counts.join(" × ")))
}

fn contact(scene: &Scene) -> Option<String> {
    let contact: &Contact = scene.contact.as_ref()?;
    let mut words = vec![match contact.method {
        ContactMethod::NodalBoundary => "nodal boundary method",
        ContactMethod::MassRedistribution => "mass redistribution",
        ContactMethod::Penalty => "penalty",
        ContactMethod::Nitsche => "Nitsche",
        ContactMethod::Stop => "stop",
        ContactMethod::Impact => "impact law",
        ContactMethod::MoreauJean => "Moreau-Jean",
        ContactMethod::Waves => "waves",
    }];
    if contact.method == ContactMethod::NodalBoundary && contact.is_reaction() {
        words.push("nodal reactions");
    }
    if contact.inertia == Some(Inertia::Constant) {
        words.push("constant mass");
    }
    let mut words: Vec<String> = words.into_iter().map(str::to_owned).collect();
    let stiffness = if contact.method == ContactMethod::Stop { "k" } else { "κ₀" };
    words.extend(contact.stiffness.map(|k| format!("{stiffness} = {k}")));
    words.extend(contact.preload.map(|p| format!("P = {p}")));
    words.extend(contact.gamma.map(|k| format!("γ₀ = {k}")));
    Some(words.join(", "))
}

fn reduction(scene: &Scene) -> Option<String> {
    match scene.reduction {
        None => Some("all displacements".into()),
        Some(Reduction { modes: Some(n), .. }) => Some(format!("{n} modes")),
        Some(Reduction { cutoff, .. }) => cutoff.map(|w| format!("modes up to ω = {w}")),
    }
}
