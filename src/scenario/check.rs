//! Checks that need nothing but the scene itself.

use super::{Amplitude, Axis, BodyKind, Edge, Field, Integrator, Issue, LoadKind, MassKind, Scene};

pub(super) type Check = Result<(), Issue>;

/// Products of a few numbers of a scene must neither overflow nor vanish.
const LARGEST: f64 = 1e60;

fn positive(key: &str, value: f64) -> Check {
    if (1.0 / LARGEST..=LARGEST).contains(&value) {
        return Ok(());
    }
    if value.is_finite() && value > 0.0 {
        return Err(Issue::new(
            key,
            format!("is {value:e}: results would overflow"),
            format!("choose units in which it lies between {:e} and {LARGEST:e}", 1.0 / LARGEST),
        ));
    }
    Err(Issue::new(key, format!("must be positive and finite, is {value}"), "give a number > 0"))
}

fn finite(key: &str, value: f64) -> Check {
    if value.abs() <= LARGEST {
        return Ok(());
    }
    if value.is_finite() {
        return Err(Issue::new(
            key,
            format!("is {value:e}: results would overflow"),
            format!("choose units in which its size is at most {LARGEST:e}"),
        ));
    }
    Err(Issue::new(key, format!("must be finite, is {value}"), "give an ordinary number"))
}

fn count_from_one(key: &str, value: usize) -> Check {
    if value >= 1 {
        return Ok(());
    }
    Err(Issue::new(key, "modes are counted from 1", "give 1 for the lowest mode"))
}

fn length(key: &str, found: usize, wanted: usize, example: &str) -> Check {
    if found == wanted {
        return Ok(());
    }
    let s = if wanted == 1 { "" } else { "s" };
    Err(Issue::new(
        key,
        format!("needs {wanted} number{s}, has {found}"),
        format!("for example {example}"),
    ))
}

impl Scene {
    /// Space dimension of the displacement.
    pub fn dim(&self) -> usize {
        match self.body.kind {
            BodyKind::Bar | BodyKind::Matrices => 1,
            BodyKind::Plate => 2,
        }
    }

    pub(super) fn check(&self) -> Check {
        self.check_body()?;
        self.check_supports()?;
        self.check_contact()?;
        self.check_damping()?;
        self.check_loads()?;
        self.check_initial()?;
        self.check_orbit()?;
        self.check_run()
    }

    fn check_body(&self) -> Check {
        let b = &self.body;
        if b.kind == BodyKind::Matrices {
            return self.check_matrices();
        }
        let files = [
            ("body.mass_matrix", b.mass_matrix.is_some()),
            ("body.stiffness_matrix", b.stiffness_matrix.is_some()),
            ("body.damping_matrix", b.damping_matrix.is_some()),
        ];
        if let Some((key, _)) = files.iter().find(|f| f.1) {
            let message = "belongs to kind = \"matrices\", this body has elements";
            return Err(Issue::new(*key, message, "remove the key or change body.kind"));
        }
        for (key, value) in [("young", b.young), ("density", b.density)] {
            if value.is_none() {
                return Err(Issue::new(
                    format!("body.{key}"),
                    "is missing",
                    format!("{key} = 1.0"),
                ));
            }
        }
        for (key, is_empty) in [("size", b.size.is_empty()), ("elements", b.elements.is_empty())] {
            if is_empty {
                return Err(Issue::new(
                    format!("body.{key}"),
                    "is missing",
                    "see the scene reference in the README",
                ));
            }
        }
        let (size, elements) =
            if self.dim() == 1 { ("[1.0]", "[20]") } else { ("[1.0, 0.5]", "[20, 10]") };
        length("body.size", b.size.len(), self.dim(), size)?;
        length("body.elements", b.elements.len(), self.dim(), elements)?;
        b.size.iter().try_for_each(|&v| positive("body.size", v))?;
        positive("body.young", b.young.unwrap_or(f64::NAN))?;
        positive("body.density", b.density.unwrap_or(f64::NAN))?;
        if b.elements.contains(&0) {
            return Err(Issue::new("body.elements", "needs at least one element", elements));
        }
        let n_nodes = b.elements.iter().fold(1usize, |n, &e| n.saturating_mul(e.saturating_add(1)));
        if n_nodes > 50_000_000 {
            return Err(Issue::new(
                "body.elements",
                format!("{n_nodes} nodes are more than this program can hold"),
                "give at most 50 million nodes",
            ));
        }
        let misplaced = |key: &str, owner: &str| {
            let message = format!("belongs to a {owner}, this body is not one");
            Err(Issue::new(key, message, "remove the key or change body.kind"))
        };
        match b.kind {
            BodyKind::Bar if b.poisson.is_some() => misplaced("body.poisson", "plate"),
            BodyKind::Bar if b.thickness.is_some() => misplaced("body.thickness", "plate"),
            BodyKind::Bar => positive("body.area", b.area.unwrap_or(1.0)),
            BodyKind::Plate if b.area.is_some() => misplaced("body.area", "bar"),
            BodyKind::Matrices => Ok(()),
            BodyKind::Plate => {
                positive("body.thickness", b.thickness.unwrap_or(1.0))?;
                let nu = b.poisson.ok_or_else(|| {
                    Issue::new(
                        "body.poisson",
                        "is missing",
                        "a plate needs a Poisson ratio, -1 < ν < 1",
                    )
                })?;
                if nu > -1.0 && nu < 1.0 {
                    return Ok(());
                }
                Err(Issue::new(
                    "body.poisson",
                    format!("{nu} makes the plane-stress stiffness indefinite"),
                    "give -1 < ν < 1 (plane stress; isotropic solids have ν ≤ 0.5)",
                ))
            }
        }
    }

    pub(super) fn check_edge(&self, key: &str, edge: Edge) -> Check {
        if self.dim() == 1 && edge.axis() == 1 {
            let message = format!("a bar has no edge \"{}\"", edge.name());
            return Err(Issue::new(key, message, "give \"left\" or \"right\""));
        }
        Ok(())
    }

    fn check_supports(&self) -> Check {
        for (i, s) in self.supports.iter().enumerate() {
            self.check_edge(&format!("support[{i}].edge"), s.edge)?;
            let key = format!("support[{i}].fix");
            if s.fix.is_empty() {
                return Err(Issue::new(
                    key,
                    "fixes nothing",
                    "give [\"x\"], [\"y\"] or [\"x\", \"y\"]",
                ));
            }
            if self.dim() == 1 && s.fix.contains(&Axis::Y) {
                return Err(Issue::new(key, "a bar has no y displacement", "give [\"x\"]"));
            }
        }
        Ok(())
    }

    /// A body whose matrices come from files.
    fn check_matrices(&self) -> Check {
        let b = &self.body;
        for (key, given) in [
            ("size", !b.size.is_empty()),
            ("elements", !b.elements.is_empty()),
            ("young", b.young.is_some()),
            ("density", b.density.is_some()),
            ("poisson", b.poisson.is_some()),
            ("thickness", b.thickness.is_some()),
            ("area", b.area.is_some()),
        ] {
            if given {
                let message = "belongs to a body of elements, this one comes from files";
                return Err(Issue::new(
                    format!("body.{key}"),
                    message,
                    "remove the key or change body.kind",
                ));
            }
        }
        let lumped = [
            ("body.mass", b.mass == MassKind::Lumped),
            (
                "contact.boundary_mass",
                self.contact.as_ref().is_some_and(|c| c.boundary_mass == MassKind::Lumped),
            ),
        ];
        if let Some((key, _)) = lumped.iter().find(|l| l.1) {
            let message = "there are no elements to lump: the matrices are what they are";
            return Err(Issue::new(*key, message, "remove the key"));
        }
        for (key, file) in
            [("mass_matrix", &b.mass_matrix), ("stiffness_matrix", &b.stiffness_matrix)]
        {
            if file.is_none() {
                let help = format!("{key} = \"M.mtx\" (Matrix Market), or \"FILE.h5:/dataset\"");
                return Err(Issue::new(format!("body.{key}"), "is missing", help));
            }
        }
        if !self.supports.is_empty() {
            return Err(Issue::new(
                "support",
                "has no edges here",
                "leave prescribed displacements out of the matrices",
            ));
        }
        if let Some(i) = self.loads.iter().position(|l| l.kind != LoadKind::Mode) {
            let message = "needs a mesh, and this body comes from files";
            return Err(Issue::new(format!("load[{i}].kind"), message, "give kind = \"mode\""));
        }
        if self.initial.displacement.is_some() || self.initial.velocity.is_some() {
            let message = "expressions of x and y need a mesh";
            return Err(Issue::new("initial", message, "give mode and amplitude, or file"));
        }
        if b.damping_matrix.is_some() && self.damping.is_some() {
            let message = "stands beside body.damping_matrix";
            return Err(Issue::new("damping", message, "one of them is enough"));
        }
        Ok(())
    }

    fn check_damping(&self) -> Check {
        let Some(d) = &self.damping else { return Ok(()) };
        let given = [d.rayleigh.is_some(), d.ratio.is_some(), d.ratios.is_some()];
        if given.iter().filter(|&&g| g).count() != 1 {
            return Err(Issue::new(
                "damping",
                "give exactly one of rayleigh, ratio, ratios",
                "rayleigh = [0.0, 1e-3], or ratio = 0.01 with mode = 1, or ratios = [[1, 0.01], [3, 0.01]]",
            ));
        }
        let non_negative = |key: &str, v: f64| {
            if v.is_finite() && v >= 0.0 {
                return Ok(());
            }
            Err(Issue::new(key, format!("must not be negative, is {v}"), "give numbers ≥ 0"))
        };
        if let Some(r) = d.rayleigh {
            r.iter().try_for_each(|&v| non_negative("damping.rayleigh", v))?;
        }
        if let Some(r) = d.ratio {
            non_negative("damping.ratio", r)?;
        } else if d.mode.is_some() {
            return Err(Issue::new(
                "damping.mode",
                "goes with `ratio` only",
                "remove it or give ratio",
            ));
        }
        if let Some(m) = d.mode {
            count_from_one("damping.mode", m)?;
        }
        if let Some([(m1, r1), (m2, r2)]) = d.ratios {
            for (m, r) in [(m1, r1), (m2, r2)] {
                count_from_one("damping.ratios", m)?;
                non_negative("damping.ratios", r)?;
            }
            if m1 == m2 {
                return Err(Issue::new(
                    "damping.ratios",
                    "names one mode twice",
                    "give two different modes",
                ));
            }
        }
        Ok(())
    }

    fn check_loads(&self) -> Check {
        for (i, l) in self.loads.iter().enumerate() {
            let key = |name: &str| format!("load[{i}].{name}");
            for (name, given, kind) in [
                ("mode", l.mode.is_some(), LoadKind::Mode),
                ("edge", l.edge.is_some(), LoadKind::Traction),
                ("at", l.at.is_some(), LoadKind::Point),
            ] {
                let kind_name = format!("{kind:?}").to_lowercase();
                if given && l.kind != kind {
                    let message = format!("goes with kind = \"{kind_name}\" only");
                    return Err(Issue::new(key(name), message, "remove it or change the kind"));
                }
                if !given && l.kind == kind {
                    let message = format!("is missing: kind = \"{kind_name}\" needs it");
                    let help = match kind {
                        LoadKind::Mode => "mode = 1",
                        LoadKind::Traction => "edge = \"right\"",
                        _ => "at = [1.0, 0.0]",
                    };
                    return Err(Issue::new(key(name), message, help));
                }
            }
            if let Some(m) = l.mode {
                count_from_one(&key("mode"), m)?;
            }
            if let Some(edge) = l.edge {
                self.check_edge(&key("edge"), edge)?;
            }
            if let Some(at) = &l.at {
                length(&key("at"), at.len(), self.dim(), "[1.0, 0.0]")?;
                for (v, size) in at.iter().zip(&self.body.size) {
                    if !(*v >= 0.0 && v <= size) {
                        let message = format!("{v} is outside the body");
                        return Err(Issue::new(key("at"), message, format!("give 0 to {size}")));
                    }
                }
            }
            match l.omega {
                Some(w) => positive(&key("omega"), w)?,
                None if l.phase != 0.0 => {
                    return Err(Issue::new(
                        key("phase"),
                        "a constant load has no phase",
                        "remove it, or give omega",
                    ));
                }
                None => {}
            }
            finite(&key("phase"), l.phase)?;
            let Some(amplitude) = self.amplitude_of(i)? else { continue };
            match (amplitude, l.kind) {
                (Amplitude::Scalar(a), _) if l.kind == LoadKind::Mode || self.dim() == 1 => {
                    finite(&key("amplitude"), *a)?;
                }
                (Amplitude::Vector(v), k) if k != LoadKind::Mode => {
                    length(&key("amplitude"), v.len(), self.dim(), "[0.0, -9.81]")?;
                    v.iter().try_for_each(|&a| finite(&key("amplitude"), a))?;
                }
                (_, LoadKind::Mode) => {
                    return Err(Issue::new(
                        key("amplitude"),
                        "a mode has one amplitude",
                        "amplitude = 0.1",
                    ));
                }
                _ => {
                    return Err(Issue::new(
                        key("amplitude"),
                        "needs the x and y components",
                        "amplitude = [0.0, -9.81]",
                    ));
                }
            }
        }
        Ok(())
    }

    fn check_initial(&self) -> Check {
        let s = &self.initial;
        let field = s.displacement.is_some() || s.velocity.is_some() && !s.equilibrium;
        let forms = [s.mode.is_some(), field, s.file.is_some(), s.equilibrium];
        if forms.iter().filter(|&&g| g).count() > 1 {
            return Err(Issue::new(
                "initial",
                "mixes several forms",
                "give mode and amplitude, or displacement and velocity, or equilibrium, or file",
            ));
        }
        match (s.mode, s.amplitude) {
            (Some(m), Some(a)) => {
                count_from_one("initial.mode", m)?;
                finite("initial.amplitude", a)?;
                let scalable = match &self.contact {
                    Some(c) => !matches!(c.gap, Some(Field::Constant(0.0))),
                    None => true,
                };
                if !scalable {
                    return Err(Issue::new(
                        "initial.amplitude",
                        "counts in gaps, and the gap is 0",
                        "give the initial state as displacement = [\"…\"]",
                    ));
                }
            }
            (Some(_), None) => {
                return Err(Issue::new(
                    "initial.amplitude",
                    "is missing",
                    "give amplitude = -1.4 (in gaps)",
                ));
            }
            (None, Some(_)) => {
                return Err(Issue::new(
                    "initial.amplitude",
                    "goes with `mode` only",
                    "give mode = 1",
                ));
            }
            (None, None) => {}
        }
        for (key, list) in
            [("initial.displacement", &s.displacement), ("initial.velocity", &s.velocity)]
        {
            if let Some(list) = list {
                let example = if self.dim() == 1 { "[\"-2*x\"]" } else { "[\"-2*x\", \"0\"]" };
                length(key, list.len(), self.dim(), example)?;
            }
        }
        Ok(())
    }

    /// The amplitude of a load, or none where the peak of a resonance stands for it.
    fn amplitude_of(&self, i: usize) -> Result<Option<&Amplitude>, Issue> {
        let l = &self.loads[i];
        let key = format!("load[{i}].peak");
        let example = "peak = 3.0 with kind = \"mode\", omega and [damping], or amplitude = 0.1";
        let fail = |message: &str| Err(Issue::new(key.clone(), message, example));
        match (&l.amplitude, l.peak) {
            (Some(_), Some(_)) => fail("stands beside amplitude: one of them is enough"),
            (Some(a), None) => Ok(Some(a)),
            (None, None) => Err(Issue::new(format!("load[{i}].amplitude"), "is missing", example)),
            (None, Some(_)) if l.kind != LoadKind::Mode => fail("goes with kind = \"mode\" only"),
            (None, Some(_)) if l.omega.is_none() => {
                fail("is that of a harmonic load: omega is missing")
            }
            (None, Some(_)) if self.damping.is_none() || self.contact.is_none() => {
                fail("needs [damping] and [contact]: without them no peak and no grazing amplitude")
            }
            (None, Some(p)) => positive(&key, p).map(|()| None),
        }
    }

    fn check_orbit(&self) -> Check {
        let Some(o) = &self.orbit else { return Ok(()) };
        if o.omega.is_some() && o.period.is_some() {
            return Err(Issue::new(
                "orbit.period",
                "stands beside omega",
                "give omega or period, not both",
            ));
        }
        if let Some(w) = o.omega {
            positive("orbit.omega", w)?;
        }
        if let Some(t) = o.period {
            positive("orbit.period", t)?;
        }
        if let Some([a, b]) = o.range {
            positive("orbit.range", a)?;
            positive("orbit.range", b)?;
            if a >= b {
                return Err(Issue::new(
                    "orbit.range",
                    format!("[{a}, {b}] is empty"),
                    "give the lower frequency first",
                ));
            }
        }
        if o.harmonics == Some(0) {
            return Err(Issue::new("orbit.harmonics", "needs at least one", "harmonics = 15"));
        }
        if let Some(ratios) = &o.ratios {
            if ratios.is_empty() {
                return Err(Issue::new("orbit.ratios", "is empty", "ratios = [0.01, 0.02]"));
            }
            ratios.iter().try_for_each(|&r| positive("orbit.ratios", r))?;
            if self.damping.as_ref().is_none_or(|d| d.ratio.is_none()) {
                return Err(Issue::new(
                    "orbit.ratios",
                    "stands in place of the ratio in [damping], and there is none",
                    "[damping] with ratio = 0.02 and mode = 1",
                ));
            }
        }
        Ok(())
    }

    fn check_run(&self) -> Check {
        let Some(r) = &self.run else { return Ok(()) };
        match (r.until, r.periods) {
            (Some(t), None) => positive("run.until", t)?,
            (None, Some(n)) => {
                positive("run.periods", n)?;
                if self.period().is_none() {
                    return Err(Issue::new(
                        "run.periods",
                        "counts periods, and the scene has none",
                        "give until = …, or a load with omega, or [orbit] omega or period",
                    ));
                }
            }
            _ => {
                return Err(Issue::new(
                    "run",
                    "give exactly one of until, periods",
                    "until = 3.36",
                ));
            }
        }
        for (key, v) in [("run.rtol", r.rtol), ("run.atol", r.atol)] {
            positive(key, v)?;
            if v >= 0.1 {
                return Err(Issue::new(key, format!("{v} is no tolerance"), "give 1e-13 to 1e-3"));
            }
        }
        if r.rtol < 1e-14 {
            return Err(Issue::new(
                "run.rtol",
                format!("{} is below rounding error", r.rtol),
                "give at least 1e-14",
            ));
        }
        if r.samples < 1 {
            return Err(Issue::new(
                "run.samples",
                "needs at least one stored state",
                "samples = 400",
            ));
        }
        let moving = self.loads.iter().any(|l| l.omega.is_some());
        if r.integrator == Integrator::Chebyshev && (self.damping.is_some() || moving) {
            return Err(Issue::new(
                "run.integrator",
                "chebyshev needs an undamped body and constant loads",
                "give \"modal\" (exact) or \"dop853\", which take damping and harmonic loads",
            ));
        }
        positive("run.switch_limit", r.switch_limit)
    }
}
