//! One page of HTML that shows what files hold: it needs no network and no other file.
//!
//! What it computes and draws with is in `web/` (sources, built into `page.js`); here it gets its data.

mod block;
mod body;
mod drawn;
mod motion;
mod said;
mod solid;

use serde_json::{Value, json};

use super::summary::significant;
use crate::fem::Material;
use crate::records::{OrbitRecord, PointKind, PointRecord};
use crate::store::{MARK, Stored, StoredFamily};
use drawn::Drawn;

const FRAME: &str = include_str!("web/page.html");
const STYLE: &str = include_str!("web/style.css");
const SCRIPT: &str = include_str!("page.js");
/// Of the libraries that are built into the script.
const LICENCES: &str = include_str!("web/LICENCES.txt");

/// A command without the folders of the machine that it was given on: a page goes to others.
fn without_folders(command: &str) -> String {
    let is_whole = |word: &str| {
        let drive = word.as_bytes().get(1) == Some(&b':') && word.contains('\\');
        word.starts_with('/') || word.starts_with("~/") || drive
    };
    let name = |word: &str| match is_whole(word) {
        true => word.rsplit(['/', '\\']).next().unwrap_or_default().to_owned(),
        false => word.to_owned(),
    };
    command.split(' ').map(name).collect::<Vec<_>>().join(" ")
}

/// The body that views show.
pub struct Body {
    drawn: Drawn,
    arrays: Value,
    /// Bytes of a state of an orbit.
    pub state: usize,
}

impl Body {
    /// That of a file; `materials` by region where they are known.
    pub fn of(stored: &Stored, materials: &[Material]) -> Body {
        let (drawn, arrays) = body::body(stored, materials);
        Body { state: drawn.bytes(stored.gap.len()), drawn, arrays }
    }
}

/// Something to look at.
pub struct View(Value);

impl View {
    /// A run, or an orbit with its multipliers; curves are those of some contact nodes, or of as many as show.
    pub fn run(stored: &Stored, body: Body, orbit: Option<&OrbitRecord>, nodes: &[usize]) -> View {
        View(json!({
            "kind": "run",
            "name": stored.path.file_name().map(|n| n.to_string_lossy()),
            "title": stored.title,
            "status": stored.status.to_string(),
            "command": without_folders(&stored.command),
            "said": said::of_run(&stored.path),
            "motion": motion::motion(stored, &body.drawn, nodes),
            "body": body.arrays,
            "orbit": orbit.map(of_orbit),
        }))
    }

    /// A family with its body; `motions` is what its points do over their periods, where that is known, of which
    /// about so many states are shown, and `why` there are none.
    pub fn family(
        family: &StoredFamily,
        body: Body,
        (motions, states): (&[Option<Stored>], usize),
        nodes: &[usize],
        why: Option<&str>,
    ) -> View {
        let of_point = |(k, p): (usize, &PointRecord)| {
            let moving = motions.get(k).and_then(Option::as_ref);
            point(p, moving.map(|m| motion::orbit(m, &body.drawn, states, nodes)))
        };
        let points: Vec<Value> = family.points.iter().enumerate().map(of_point).collect();
        View(json!({
            "kind": "family",
            "name": family.path.file_name().map(|n| n.to_string_lossy()),
            "title": family.title,
            "status": family.status.to_string(),
            "what": family.identity.to_string(),
            "sequential": family.outline().is_point_by_point(),
            "branches": family.branches.iter().map(|b| b.to_string()).collect::<Vec<_>>(),
            "body": body.arrays,
            "points": points,
            "why": why,
        }))
    }

    /// A picture that is drawn already.
    pub fn picture(name: &str, title: &str, svg: &str) -> View {
        View(json!({"kind": "picture", "name": name, "title": title, "svg": svg}))
    }
}

fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn of_orbit(o: &OrbitRecord) -> Value {
    json!({
        "period": finite(o.period), "energy": finite(o.energy), "amplitude": finite(o.amplitude), "residual": finite(o.residual),
        "contact_time": finite(o.contact_time), "stable": o.stable, "trivial": o.trivial,
        "multipliers": o.multipliers.iter().map(|m| m.map(|x| significant(x, 7).parse::<f64>().unwrap_or(x))).collect::<Vec<_>>(),
        "switches": o.switches.len(),
        "alpha": o.viscous.as_ref().map(|v| v.alpha), "beta": o.viscous.as_ref().map(|v| v.beta),
    })
}

fn point(p: &PointRecord, frames: Option<Value>) -> Value {
    let is_gap = matches!(p.special, PointKind::Gap(_));
    json!({
        "omega": p.omega, "branch": p.branch, "index": p.index,
        "special": if p.special == PointKind::Regular { Value::Null } else { p.special.to_string().into() },
        "gap": is_gap,
        "orbit": p.orbit.as_ref().map(of_orbit),
        "hbm": p.check.as_ref().map(|c| json!({"energy": finite(c.energy), "verdict": c.verdict.name(), "moved": finite(c.moved), "harmonics": c.n_h})),
        "frames": frames,
    })
}

/// What its author writes on a page.
#[derive(Debug, Clone, Default)]
pub struct Words {
    /// In place of the titles of the files.
    pub title: Option<String>,
    /// Below it; paragraphs stand apart by an empty line.
    pub text: Option<String>,
}

/// The page.
pub fn html(views: &[View], words: &Words) -> String {
    let views: Vec<&Value> = views.iter().map(|v| &v.0).collect();
    let title = views.first().and_then(|v| v["title"].as_str()).unwrap_or_default();
    let title = words.title.as_deref().unwrap_or(title);
    let paragraphs: Vec<&str> = words.text.iter().flat_map(|t| t.split("\n\n")).collect();
    let data = json!({
        "version": env!("CARGO_PKG_VERSION"), "title": words.title, "text": paragraphs, "views": views,
    });
    let data = data.to_string();
    // nothing in the data may end the element that it stands in
    let data = data.replace('<', "\\u003c");
    let title = escaped(title);
    let mut parts = FRAME.split("{{");
    let mut page = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once("}}").unwrap_or((part, ""));
        page += match name {
            "MARK" => MARK,
            "TITLE" => &title,
            "STYLE" => STYLE,
            "LICENCES" => LICENCES,
            "SCRIPT" => SCRIPT,
            _ => &data,
        };
        page += rest;
    }
    page
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::without_folders;

    #[test]
    fn pages_tell_no_folders() {
        for (command, told) in [
            (
                "/home/me/bin/signorini run /data/customer/x.toml -o y.h5",
                "signorini run x.toml -o y.h5",
            ),
            ("C:\\me\\signorini.exe run scenes\\x.toml", "signorini.exe run scenes\\x.toml"),
            (
                "signorini run scenarios/plate.toml --omega 1/2",
                "signorini run scenarios/plate.toml --omega 1/2",
            ),
            ("signorini run ~/x.toml", "signorini run x.toml"),
        ] {
            assert_eq!(without_folders(command), told);
        }
    }
}
