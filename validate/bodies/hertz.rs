//! Two bodies with round noses, pressed together: Hertz (Johnson, Contact Mechanics, 1985, sections 4.2 and 4.3).
//!
//! Cylinders (plane strain): `b² = 4FR/(πE*)`, `p₀ = 2F/(πb)`; spheres: `a³ = 3FR/(4E*)`, `p₀ = 3F/(2πa²)`; `1/R = 1/R₁ + 1/R₂`, `1/E* = Σ (1 − ν²)/E`. The theory takes both
//! bodies for half spaces: what it leaves out is of the order of `(a/L)²` for bodies of the size `L`. Sizes and peaks are those of `p² = p₀²(1 − x²/a²)`, fitted to the
//! nodal pressures above a third of the largest.

use std::f64::consts::PI;

use signorini::mesh::{ElementKind, Facet, Family, Mesh, Point};

use super::super::Check;
use super::super::cuboid::cuboid;
use super::super::rectangle::rectangle;
use super::meshes::Folder;
use super::{Run, go, material};

/// Size of the bodies; how much finer they are at the contact.
const SIZE: f64 = 0.8;
const FINE: f64 = 4.0;

/// How far from the planes of symmetry contact is looked for: on the lower body, and on the upper one, which is the slave and must be covered.
const REACH: [f64; 2] = [0.5, 0.3];

/// A body that ends in a round nose.
#[derive(Clone, Copy)]
struct Nose {
    cells: usize,
    radius: f64,
    young: f64,
    poisson: f64,
}

/// Half of a cylinder or a quarter of a sphere, cut from a block whose lower side is `x²/2R`, finer near the origin.
fn nose(kind: ElementKind, Nose { cells: n, radius, .. }: Nose, reach: f64) -> Mesh {
    let solid = kind.family() == Family::Cube;
    let unit = match solid {
        true => cuboid(kind, [1.0; 3], [n; 3], 0.0),
        false => rectangle(kind, [0.0, 1.0], 1.0, (n, n), 0.0),
    };
    let graded = |s: f64| SIZE * (FINE * s).sinh() / FINE.sinh();
    let placed = unit.moved(|x| {
        let [x, y, z] = x.map(graded);
        let (across, depth) = if solid { (x.hypot(y), z) } else { (x, y) };
        let height = across * across / (2.0 * radius) * (1.0 - depth / SIZE) + depth;
        if solid { [x, y, height] } else { [x, height, 0.0] }
    });
    let below = if solid { "zmin" } else { "bottom" };
    let is_near = |facet: &Facet| {
        let nodes = placed.side_nodes(*facet).into_iter().map(|n| placed.nodes()[n]);
        nodes.map(|[x, y, _]| if solid { x.max(y) } else { x }).fold(0.0, f64::max) < reach
    };
    let keep = |name: &str| -> Vec<Facet> {
        let all = placed.group(name).iter().copied();
        all.filter(|f| name != below || is_near(f)).collect()
    };
    let names =
        if solid { ["xmin", "ymin", "zmin", "zmax"] } else { ["left", "right", "bottom", "top"] };
    placed.clone().with_groups(names.map(|name| (name.to_owned(), keep(name))))
}

/// The distance from the axis.
fn across([x, y, _]: Point, solid: bool) -> f64 {
    if solid { x.hypot(y) } else { x.abs() }
}

/// Size of the contact, peak and force over those of the theory.
fn pressed(
    folder: &Folder,
    kind: ElementKind,
    noses: [Nose; 2],
    force: f64,
) -> Result<[f64; 3], String> {
    let solid = kind.family() == Family::Cube;
    let names = ["lower", "upper"];
    let (up, share, below, above, sides) = match solid {
        true => ("z", 0.25, "zmin", "zmax", &["xmin", "ymin"][..]),
        false => ("y", 0.5, "bottom", "top", &["left"][..]),
    };
    let (state, direction) = match solid {
        true => ("", "[0.0, 0.0, 1.0]"),
        false => ("state = \"plane strain\"\n", "[0.0, 1.0]"),
    };
    let mut text = String::new();
    for ((name, of), reach) in names.iter().zip(noses).zip(REACH) {
        folder.put(name, &nose(kind, of, reach))?;
        let mirror = if *name == "lower" { format!("mirror = \"{up}\"\n") } else { String::new() };
        text += &format!(
            "[[body]]\nname = \"{name}\"\nkind = \"mesh\"\nfile = {}\n{state}{mirror}",
            folder.file(name)
        );
    }
    for (name, of) in names.iter().zip(noses) {
        text += &material(name, [of.young, of.poisson, 1.0]);
        for side in sides {
            text += &format!(
                "[[support]]\ngroup = \"{name}:{side}\"\nfix = [\"{}\"]\n",
                if *side == "ymin" { "y" } else { "x" }
            );
        }
    }
    let curvature: f64 = noses.iter().map(|n| 1.0 / n.radius).sum();
    let square = if solid { "(x*x + y*y)" } else { "x*x" };
    let loaded = if solid { SIZE * SIZE } else { SIZE };
    let traction = -share * force / loaded;
    let along =
        if solid { format!("[0.0, 0.0, {traction:?}]") } else { format!("[0.0, {traction:?}]") };
    // a spring that bears next to nothing holds the upper body while it is apart
    text += &format!(
        "[[support]]\ngroup = \"lower:{above}\"\nfix = [\"{up}\"]\n\
         [[spring]]\ngroup = \"upper:{above}\"\ndirection = {direction}\nstiffness = 1e-5\n\
         [[contact]]\nslave = \"upper:{below}\"\nmaster = \"lower:{below}\"\ngap = \"{:?}*{square}\"\n\
         [[load]]\nkind = \"traction\"\ngroup = \"upper:{above}\"\namplitude = {along}\n\
         [initial]\nequilibrium = true\n[run]\nuntil = 1e-7\nsamples = 1\n",
        0.5 * curvature
    );
    let found = fitted(&go(&text)?, solid)?;
    let modulus = 1.0 / noses.iter().map(|n| (1.0 - n.poisson * n.poisson) / n.young).sum::<f64>();
    let [size, peak] = hertz(solid, force, 1.0 / curvature, modulus);
    Ok([found[0] / size, found[1] / peak, found[2] / (share * force)])
}

/// Half width or radius, and largest pressure.
fn hertz(solid: bool, force: f64, radius: f64, modulus: f64) -> [f64; 2] {
    if solid {
        let a = (0.75 * force * radius / modulus).cbrt();
        [a, 1.5 * force / (PI * a * a)]
    } else {
        let b = (4.0 * force * radius / (PI * modulus)).sqrt();
        [b, 2.0 * force / (PI * b)]
    }
}

/// Size and peak of `p² = p₀²(1 − x²/a²)`, by least squares weighted with the areas of the nodes; the sum of the forces.
fn fitted((problem, _, trajectory): &Run, solid: bool) -> Result<[f64; 3], String> {
    let system = &problem.system;
    let (pressure, area) = (&trajectory.pressure[0], &system.conditions().area);
    let largest = pressure.iter().fold(0.0f64, |m, p| m.max(*p));
    let [mut w, mut x, mut xx, mut y, mut xy] = [0.0; 5];
    for ((p, area), at) in pressure.iter().zip(area).zip(&system.constraints) {
        if *p > 0.3 * largest {
            let s = across(system.body.mesh.nodes()[at.node], solid).powi(2);
            let q = p * p;
            w += area;
            x += area * s;
            xx += area * s * s;
            y += area * q;
            xy += area * s * q;
        }
    }
    let slope = (w * xy - x * y) / (w * xx - x * x);
    let at_axis = (y - slope * x) / w;
    if slope >= 0.0 {
        return Err("the pressure does not fall from the middle".into());
    }
    let force = pressure.iter().zip(area).map(|(p, a)| p * a).sum();
    Ok([(-at_axis / slope).sqrt(), at_axis.sqrt(), force])
}

pub(super) fn run(folder: &Folder, short: bool, checks: &mut Vec<Check>) -> Result<(), String> {
    let like = |cells: usize| Nose { cells, radius: 1.0, young: 1.0, poisson: 0.3 };
    let other = |cells: usize| Nose { cells, radius: 2.0, young: 3.0, poisson: 0.2 };
    let plane = [
        ("like", [like(47), like(60)], 0.005, [0.01, 0.01]),
        ("like", [like(60), like(47)], 0.001_25, [0.02, 0.01]),
        ("unlike", [like(47), other(60)], 0.005, [0.01, 0.01]),
    ];
    for (what, noses, force, within) in plane {
        let name = format!("cylinders, {what}, F = {force}");
        push(checks, &name, pressed(folder, ElementKind::Tri3, noses, force)?, within);
    }
    let space: &[(ElementKind, usize, usize)] = match short {
        true => &[(ElementKind::Hex27, 4, 5)],
        false => &[(ElementKind::Hex8, 10, 12), (ElementKind::Hex27, 6, 7)],
    };
    for &(kind, a, b) in space {
        let unlike = (kind == ElementKind::Hex8).then(|| ("unlike", [like(a), other(b)]));
        for (what, noses) in std::iter::once(("like", [like(a), like(b)])).chain(unlike) {
            let name = format!("spheres of {}, {what}, F = 0.0005", kind.name());
            push(checks, &name, pressed(folder, kind, noses, 0.0005)?, [0.04, 0.03]);
        }
    }
    Ok(())
}

fn push(checks: &mut Vec<Check>, name: &str, found: [f64; 3], within: [f64; 2]) {
    let [size, peak, force] = found;
    checks.push(Check::near(format!("{name}: size over Hertz's"), size, 1.0, within[0]));
    checks.push(Check::near(format!("{name}: peak over Hertz's"), peak, 1.0, within[1]));
    // the weak spring bears the rest
    checks.push(Check::near(format!("{name}: force"), force, 1.0, 0.003));
}
