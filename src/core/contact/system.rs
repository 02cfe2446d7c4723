//! A body in contact as everyone above sees it: a piecewise linear second-order system, its units, its contact points.

use std::sync::Arc;

use super::ContactError;
use super::bearings::Bearings;
use super::boundary::{self, BoundaryOperator, Stress};
use super::conditions::{Conditions, Gaps};
use super::constraint::Constraint;
use super::damping::{Dampers, Rayleigh};
use super::friction::{Anchor, Slider, Tangent};
use super::impact::Impact;
use super::inertia::Inertia;
use super::law::{Law, Restitution};
use super::massive;
use super::method::{Degenerate, Method, Promise, Selection};
use super::monitor::MonitorKind;
use super::nbm::Nbm;
use super::phase::{Parts, Phase};
use super::redistribution::{self, MassChoice};
use super::rest::Rest;
use super::scratch::Scratch;
use super::site::{self, Site};
use super::states::{PointState, States};
use crate::fem::{Body, Csr, Harmonic, Kernel, Loads, Measured, Probe, Reduction};

/// What a scene says of the contact points that a body's numbering has.
#[derive(Debug, Clone, Default)]
pub struct Contacts {
    /// Gaps of the contact displacements.
    pub gaps: Gaps,
    /// Whether `G` is lumped.
    pub lumped: bool,
}

/// What is of the order of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Length: the largest gap in magnitude, or the body's size where that is smaller or all gaps vanish.
    pub length: f64,
    /// Circular frequency: that of a quarter wave over the body's length.
    pub frequency: f64,
    /// Bound of the natural frequencies of all phases.
    pub highest: f64,
}

/// Why no energy balance closes where [`System::omits_inertia`], and what to do.
pub const OMITTED_INERTIA: &str = "a load that moves in time acts on a contact displacement, and with nodal reactions the paper's mass leaves out the inertia \
                                   of what it does to it: inertia = \"constant\" or method = \"mass-redistribution\" has none";

/// A body in contact. A clone shares its matrices.
#[derive(Debug, Clone)]
pub struct System {
    /// Matrices over `u = (u_O, u_C)` as assembled, numbering, geometry.
    pub body: Arc<Body>,
    /// For products with its stiffness.
    kernel: Arc<Kernel>,
    /// The contact points, in the order of active sets and `u_C`.
    pub constraints: Vec<Constraint>,
    /// Damping in proportion to mass and stiffness, if any.
    pub damping: Option<Rayleigh>,
    /// Dampers on displacements of `u_O`, if any.
    pub dampers: Option<Arc<Dampers>>,
    /// Loads; phases keep those of the time when they were made.
    pub loads: Arc<Loads>,
    /// Units.
    pub units: Units,
    /// What holds the body.
    pub bearings: Arc<Bearings>,
    /// What is watched of its motion.
    pub probes: Arc<[Probe]>,
    /// The equilibrium that modes, amplitudes and energies are told around, where that is asked for.
    pub(super) rest: Option<Arc<Rest>>,
    method: Arc<dyn Method>,
}

/// A state at a time: `x = (u_O, u̇_O)`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    /// Displacements `u_O`.
    pub u: Vec<f64>,
    /// Velocities `u̇_O`.
    pub v: Vec<f64>,
}

impl State {
    /// All displacements and velocities at `t = 0`, in the phase of the state.
    pub fn full(&self, system: &System) -> Result<(Vec<f64>, Vec<f64>), ContactError> {
        let open = States::open(system.n_contact());
        let phase = system.phase(&system.select(0.0, &self.u, &open)?.set);
        let (mut u, mut v) = (vec![0.0; system.n()], vec![0.0; system.n()]);
        phase.expand_displacement(0.0, &self.u, &mut u);
        phase.expand_velocity(0.0, &self.v, &mut v);
        Ok((u, v))
    }
}

/// What rubs: one entry a contact point, or none at all, and the sliders.
#[derive(Debug, Clone, Default)]
pub struct Rubs {
    /// Friction at obstacles.
    pub tangents: Vec<Option<Tangent>>,
    /// Friction under forces that stay.
    pub sliders: Vec<Slider>,
}

impl System {
    /// Signorini's conditions at nodes; a body without contact points is a linear one.
    pub fn new(
        body: Body,
        contacts: &Contacts,
        choice: (Stress, MassChoice),
    ) -> Result<System, ContactError> {
        System::with_friction(body, contacts, choice, Rubs::default())
    }

    /// The same with friction at some of the contact points, and with sliders.
    pub fn with_friction(
        body: Body,
        contacts: &Contacts,
        choice: (Stress, MassChoice),
        rubs: Rubs,
    ) -> Result<System, ContactError> {
        let operator = match choice.0 {
            _ if body.dofs.n_c == 0 => BoundaryOperator::none(body.dofs.n_o),
            Stress::Projection => boundary::projection(&body, contacts.lumped),
            Stress::NodalMean => boundary::nodal_mean(&body),
            Stress::Reaction => boundary::reaction(&body, boundary::areas(&body)),
        };
        System::with_operator(body, operator, contacts.gaps.clone(), choice, rubs)
    }

    /// The same with a boundary operator that is given.
    pub fn with_operator(
        body: Body,
        operator: BoundaryOperator,
        gaps: Gaps,
        choice: (Stress, MassChoice),
        Rubs { tangents, sliders }: Rubs,
    ) -> Result<System, ContactError> {
        let method = Nbm::new(&body, operator, gaps, choice)?;
        let method = method.with_friction(&body, tangents, sliders)?;
        Ok(System::of_method(body, Arc::new(method)))
    }

    /// A law at places where displacements have inertia, of a body whose contact displacements move by themselves; one gap a site.
    pub fn with_law(
        body: Body,
        sites: Vec<Site>,
        gap: Vec<f64>,
        law: Arc<dyn Law>,
    ) -> Result<System, ContactError> {
        let (body, method) = massive::attach(body, sites, gap, law)?;
        Ok(System::of_method(body, Arc::new(method)))
    }

    /// Newton's law of impact at the contact nodes of such a body.
    pub fn with_impacts(
        body: Body,
        gap: Vec<f64>,
        law: Restitution,
    ) -> Result<System, ContactError> {
        let sites = site::at_nodes(&body, &boundary::areas(&body));
        System::with_law(body, sites, gap, Arc::new(law))
    }

    /// Friction of the contact points, if any; one entry a point.
    pub fn tangents(&self) -> Option<&[Option<Tangent>]> {
        self.method.friction().map(|f| &f.tangents[..])
    }

    /// Friction of one contact point by a displacement that has mass, unless a spring lies between the two.
    pub(crate) fn rigid_tangent(&self, point: usize) -> Option<&Tangent> {
        let elastic = self.slider(point).is_some_and(|s| s.elastic.is_some());
        self.tangent(point).filter(|t| !elastic && t.anchor.is_none())
    }

    /// Whether the state knows where springs of sliders stuck.
    pub fn remembers(&self) -> bool {
        self.n_remembered() > 0
    }

    /// Number of entries of `u_O` by which springs of sliders, and displacements without mass along obstacles, remember.
    pub fn n_remembered(&self) -> usize {
        self.sliders().iter().filter(|s| s.elastic.is_some()).count() + self.anchors().len()
    }

    /// The points whose displacements along the obstacle have no mass.
    pub fn anchors(&self) -> Vec<(usize, Anchor)> {
        self.method.friction().map_or(vec![], |f| f.anchors().collect())
    }

    /// Whether there are any: which of them stick is no matter of displacements alone.
    pub fn creeps(&self) -> bool {
        self.method.friction().is_some_and(|f| f.anchors().next().is_some())
    }

    /// The slider that a point is.
    pub(crate) fn slider(&self, point: usize) -> Option<&Slider> {
        self.sliders().get(point.checked_sub(self.facing().len())?)
    }

    /// The sliders, which are the last contact points.
    pub fn sliders(&self) -> &[Slider] {
        self.method.friction().map_or(&[], |f| &f.sliders)
    }

    /// Friction of one contact point.
    pub(crate) fn tangent(&self, point: usize) -> Option<&Tangent> {
        self.tangents().and_then(|t| t[point].as_ref())
    }

    /// `μ a` of a point: the largest force along its tangent over its pressure.
    pub fn limit_over_pressure(&self, point: usize) -> f64 {
        self.method.friction().map_or(0.0, |f| f.limit_over_pressure(point))
    }

    /// The law by which velocities jump, of a method that has one.
    pub fn impact(&self) -> Option<&Impact> {
        self.method.impact()
    }

    /// The system in fewer coordinates of `u_O`: the same contact conditions, damping and loads. Loads are those of the full body.
    pub fn reduced(&self, reduction: &Arc<Reduction>) -> Result<System, ContactError> {
        let body = self.body.reduced(reduction.clone())?;
        let method = self.method.reduced(&body, reduction)?;
        let mut system = System::of_method(body, method);
        system.damping = self.damping;
        // rows over the displacements of the mesh
        system.bearings = self.bearings.clone();
        system.probes = self.probes.iter().map(|p| p.reduced(reduction)).collect();
        system.dampers = self.dampers.as_ref().map(|d| Arc::new(d.reduced(reduction)));
        let loads = system.loads_mut();
        loads.constant = self.loads.constant.as_ref().map(|f| reduction.load(f));
        let harmonic = |h: &Harmonic| Harmonic { force: reduction.load(&h.force), ..h.clone() };
        loads.harmonics = self.loads.harmonics.iter().map(harmonic).collect();
        let measured = |m: &Measured| Measured { force: reduction.load(&m.force), ..m.clone() };
        loads.measured = self.loads.measured.iter().map(measured).collect();
        loads.carried = self.loads.carried.reduced(reduction);
        loads.borne = self.loads.borne.clone();
        Ok(system)
    }

    fn of_method(body: Body, method: Arc<dyn Method>) -> System {
        let constraints = method.constraints(&body);
        let gap = constraints.iter().fold(0.0f64, |m, c| m.max(c.gap.abs()));
        let size = body.mesh.length();
        let units = Units {
            length: if gap > 0.0 { gap.min(size) } else { size },
            frequency: body.frequency_unit(),
            highest: method.highest_frequency(),
        };
        System {
            constraints,
            damping: None,
            dampers: None,
            loads: Arc::default(),
            bearings: Arc::default(),
            probes: Arc::default(),
            units,
            rest: None,
            kernel: Arc::new(Kernel::new(&body.stiffness, body.dofs.dim, &body.dofs.whole_nodes())),
            body: Arc::new(body),
            method,
        }
    }

    /// Upper bound of the natural frequencies of the body and of all phases, as far as one is known.
    pub fn frequency_bound(&self) -> f64 {
        let highest = Some(self.units.highest).filter(|w| w.is_finite());
        self.body.frequency_bound().max(highest.unwrap_or(0.0))
    }

    /// Length of `x = u_O`.
    pub fn n_o(&self) -> usize {
        self.body.dofs.n_o
    }

    /// Number of contact points.
    pub fn n_contact(&self) -> usize {
        self.constraints.len()
    }

    /// What the contact points move by: along their normals, and over the sliders.
    pub fn at_points(&self, u: &[f64]) -> Vec<f64> {
        let mut moved = self.along_normals(u);
        let first = self.facing().len();
        self.sliders()
            .iter()
            .enumerate()
            .for_each(|(s, slider)| moved[first + s] = slider.along(u));
        moved
    }

    /// The states of the contact points of the body that touches everywhere, and whose sliders stick.
    pub fn closed_states(&self) -> States {
        let facing = self.facing().len();
        let of = |i: usize| if i < facing { PointState::Closed } else { PointState::Stick };
        (0..self.n_contact()).map(of).collect()
    }

    /// The contact points that stand before obstacles: all but the sliders.
    pub fn facing(&self) -> &[Constraint] {
        &self.constraints[..self.n_contact() - self.sliders().len()]
    }

    /// Whether contact displacements have inertia: `u_C` are displacements of the body that are seen, no unknowns that follow.
    pub fn contact_has_inertia(&self) -> bool {
        self.method.obstacle().is_some()
    }

    /// The rows over `u_O` by which an obstacle meets displacements that have inertia: along the normals, what meets it, what its push acts on.
    pub fn obstacle_rows(&self) -> Option<[&Csr; 3]> {
        self.method.obstacle().map(|o| [&*o.normal, &*o.depth, &*o.direction])
    }

    /// Number of displacements (or coordinates) of the body: those that are but seen are none, nor what springs of sliders remember.
    pub fn n_displacements(&self) -> usize {
        if self.contact_has_inertia() { self.n_o() } else { self.n() - self.n_remembered() }
    }

    /// Length of `u`.
    pub fn n(&self) -> usize {
        self.body.dofs.n()
    }

    /// The method in words.
    pub fn method_name(&self) -> String {
        self.method.name()
    }

    /// What one contact point does.
    pub fn law(&self) -> &dyn Law {
        self.method.law()
    }

    /// What a length makes of a monitor of a point, over that length: itself, or a pressure.
    pub(crate) fn monitor_unit(&self, kind: MonitorKind, point: usize) -> f64 {
        if kind == MonitorKind::Pressure { self.constraints[point].stiffness } else { 1.0 }
    }

    /// What the unit of length makes of the monitor of a point in a state: a length, or a pressure.
    pub(crate) fn unit_of_monitor(&self, state: PointState, point: usize) -> f64 {
        self.monitor_unit(self.law().watched(state), point) * self.units.length
    }

    /// What the method promises.
    pub fn promise(&self) -> Promise {
        self.method.promise()
    }

    /// The complementarity problem, for methods that have one.
    pub fn conditions(&self) -> &Conditions {
        self.method.conditions()
    }

    /// `p_f(t)` of the complementarity problem: see [`Conditions`].
    pub(crate) fn load_pressure(&self, t: f64) -> Option<Vec<f64>> {
        self.method.conditions().load_pressure(&self.loads, t, 0)
    }

    /// Whether a load that moves in time acts on contact displacements which follow the others without inertia (nodal reactions, the paper's mass): the
    /// inertia of what it does to them is left out, and no balance of energy closes.
    pub fn omits_inertia(&self) -> bool {
        let Promise { is_strong, yields, conserves_energy, .. } = self.promise();
        let n_o = self.n_o();
        let loads = &self.loads;
        let mut forces =
            loads.harmonics.iter().map(|h| &h.force).chain(loads.measured.iter().map(|m| &m.force));
        let follows = !is_strong && !yields && !conserves_energy && self.impact().is_none();
        follows && forces.any(|f| f[n_o..].iter().any(|f| *f != 0.0))
    }

    /// Gaps of all contact points.
    pub fn gaps(&self) -> Vec<f64> {
        self.constraints.iter().map(|c| c.gap).collect()
    }

    /// Whether anything damps the body.
    pub fn is_damped(&self) -> bool {
        self.damping.is_some() || self.dampers.is_some()
    }

    /// Whether anything takes energy from motions: damping, friction, or impacts that lose some.
    pub fn dissipates(&self) -> bool {
        self.damping.is_some_and(|d| d.alpha > 0.0 || d.beta > 0.0)
            || self.dampers.is_some()
            || self.tangents().is_some()
            || self.impact().is_some_and(|law| law.restitution < 1.0)
    }

    /// Undamped, the forces have a potential, and all loads are constant.
    pub fn is_conservative(&self) -> bool {
        !self.is_damped() && self.has_potential() && !self.loads.is_driven()
    }

    /// Whether elastic forces and those of the obstacle have a potential in every phase: friction has none, nor have Nitsche's with `θ ≠ 1`.
    pub fn has_potential(&self) -> bool {
        self.method.obstacle().is_none_or(|o| o.has_potential()) && self.method.friction().is_none()
    }

    /// Whether the natural modes of a phase decouple its motion: `K_α` is symmetric, and damping a combination of `M_α` and `K_α`.
    pub fn is_decoupled(&self) -> bool {
        let plain = !self.contact_has_inertia() || self.damping.is_none_or(|d| d.beta == 0.0);
        plain && self.dampers.is_none() && self.has_potential()
    }

    /// Whether every phase has an exact flow without modes: damping is `αM_α + βK_α` of a symmetric `K_α`, frequencies are bounded, and no load has a
    /// measured history.
    pub fn is_entire(&self) -> bool {
        self.is_decoupled() && self.units.highest.is_finite() && self.loads.measured.is_empty()
    }

    /// Whether the acceleration is the same on both sides of a switching surface: stiffness-proportional damping of contact displacements makes it
    /// jump even where the method does not.
    pub fn is_lipschitz(&self) -> bool {
        let plain = self.contact_has_inertia() || self.damping.is_none_or(|d| d.beta == 0.0);
        self.promise().is_lipschitz && plain
    }

    /// Change the loads; phases made before keep theirs.
    pub fn loads_mut(&mut self) -> &mut Loads {
        Arc::make_mut(&mut self.loads)
    }

    fn parts(&self) -> Parts {
        Parts {
            body: self.body.clone(),
            kernel: self.kernel.clone(),
            damping: self.damping,
            dampers: self.dampers.clone(),
            loads: self.loads.clone(),
            obstacle: self.method.obstacle().cloned(),
        }
    }

    /// The phase of an active set.
    pub fn phase(&self, set: &States) -> Phase {
        self.method.phase(&self.parts(), set)
    }

    /// The phase in which no point touches.
    pub fn open_phase(&self) -> Phase {
        self.phase(&States::open(self.n_contact()))
    }

    /// The phase of an active set with points held on the switching surface.
    pub(crate) fn held_phase(&self, set: &States, held: &[usize]) -> Phase {
        if held.is_empty() {
            return self.phase(set);
        }
        let mut set = set.clone();
        held.iter().for_each(|&i| set.set(i, PointState::Closed));
        let without = |&i: &usize| self.phase(&set.with(i, PointState::Open));
        let released = held.iter().map(without).collect();
        self.phase(&set).hold(held.to_vec(), released)
    }

    /// The active set of a state, warm from `start`.
    pub fn select(&self, t: f64, u_o: &[f64], start: &States) -> Result<Selection, ContactError> {
        if self.creeps() {
            return self.select_adhering(t, u_o, start);
        }
        self.method.select(&self.loads, t, u_o, start)
    }

    /// The same one order up, on degenerate points.
    pub(crate) fn select_rates(&self, at: Degenerate) -> Result<Selection, ContactError> {
        self.method.select_rates(&self.loads, at)
    }

    /// `M*` over `u`.
    pub fn mass(&self) -> &Csr {
        self.method.inertia().mass(&self.body)
    }

    /// Whether contact displacements have no inertia in any phase.
    pub fn has_massless_contact(&self) -> bool {
        let mut of_contact = self.n_o()..self.n();
        !of_contact.is_empty()
            && match self.inertia() {
                // `M_0` is one over `u_O`
                Inertia::Constant(_) => true,
                Inertia::Projected(_) => of_contact.all(|i| self.body.mass.row(i).next().is_none()),
            }
    }

    pub(super) fn inertia(&self) -> &Inertia {
        self.method.inertia()
    }

    /// The load of a uniform acceleration.
    pub fn gravity(&self, acceleration: &[f64]) -> Vec<f64> {
        self.method.gravity(&self.body, acceleration)
    }

    /// Columns over `u_O` on which the phases differ, as lists of entries.
    pub fn directions(&self) -> Vec<Vec<(usize, f64)>> {
        self.method.directions(&self.body)
    }

    /// Kinetic energy of the body at `t` and a full velocity: `½ vᵀ M* v`, and what supports that move add.
    pub fn kinetic(&self, t: f64, v: &[f64]) -> f64 {
        self.kinetic_of_free(v) + self.loads.carried.kinetic(t, v)
    }

    /// Kinetic energy `½ vᵀ M* v` of a full velocity, supports at rest.
    pub(crate) fn kinetic_of_free(&self, v: &[f64]) -> f64 {
        let whole = 0.5 * self.method.inertia().quadratic(&self.body, 0..self.n_o(), v);
        // what only remembers has the velocity of a surface
        let remembered = self.anchors().into_iter().map(|(_, a)| 0.5 * v[a.memory] * v[a.memory]);
        whole - remembered.sum::<f64>()
    }

    /// Work function of the constant loads and of what moves supports: the energy that these add at `t` ([`crate::fem::Carried`]), as the work of the
    /// forces on the other displacements is counted apart.
    pub fn potential(&self, t: f64, u: &[f64], v: &[f64]) -> f64 {
        self.loads.constant_potential(u) + self.loads.carried.energy(t, u, v)
    }

    /// By how much the kinetic energy grows where contact displacements of the velocity `u̇_C` come to have that of `v`: `½ (v − v⁻)ᵀ M* (v + v⁻)`.
    pub(crate) fn kinetic_jump(&self, v_c: &[f64], v: &[f64]) -> f64 {
        // a constant mass knows no contact displacements
        if matches!(self.inertia(), Inertia::Constant(_)) {
            return 0.0;
        }
        let (mass, n_o) = (self.mass(), self.n_o());
        let sum = |j: usize| v[j] + if j < n_o { v[j] } else { v_c[j - n_o] };
        let of_row = |i: usize| mass.row(n_o + i).map(|(j, m)| m * sum(j)).sum::<f64>();
        0.5 * (0..v_c.len()).map(|i| (v[n_o + i] - v_c[i]) * of_row(i)).sum::<f64>()
    }

    /// `xᵀM*x` of a full vector that is at rest but for some displacements of `u_O` and what follows them.
    pub(crate) fn mass_quadratic(&self, rows: std::ops::Range<usize>, x: &[f64]) -> f64 {
        self.method.inertia().quadratic(&self.body, rows, x)
    }

    /// `y = M* x`
    pub(crate) fn mass_product(&self, x: &[f64], y: &mut [f64]) {
        self.method.inertia().mul(&self.body, x, y);
    }

    /// Elastic energy of the body at `t` and a full displacement: `½ uᵀ K u`, what an obstacle that yields holds of it, and what supports that move add.
    pub fn elastic(&self, t: f64, u: &[f64]) -> f64 {
        let obstacle = self.method.obstacle().map_or(0.0, |o| o.energy(&u[..self.n_o()]));
        let sliders: f64 = self.sliders().iter().map(|s| s.energy(u)).sum();
        self.elastic_with(t, u, [obstacle, sliders])
    }

    /// The same where it is known what the obstacle and the sliders hold.
    fn elastic_with(&self, t: f64, u: &[f64], [obstacle, sliders]: [f64; 2]) -> f64 {
        let square = self.kernel.quadratic(&self.body.stiffness, u);
        0.5 * square + obstacle + sliders + self.loads.carried.elastic(t, u)
    }

    /// All displacements and velocities of a state in a phase.
    fn expanded(&self, phase: &Phase, t: f64, [u_o, v_o]: [&[f64]; 2]) -> [Vec<f64>; 2] {
        let (mut u, mut v) = (vec![0.0; self.n()], vec![0.0; self.n()]);
        phase.expand_displacement(t, u_o, &mut u);
        phase.expand_velocity(t, v_o, &mut v);
        [u, v]
    }

    /// Energy `H` at `t` of a full displacement and velocity; beyond that of the rest, where it is told around one.
    pub(crate) fn energy(&self, t: f64, u: &[f64], v: &[f64]) -> f64 {
        self.beyond_rest(self.elastic(t, u) + self.kinetic(t, v), u)
    }

    /// The same of a state in a phase.
    pub fn energy_in(&self, phase: &Phase, t: f64, state: &State) -> f64 {
        let [u, v] = self.expanded(phase, t, [&state.u, &state.v]);
        self.energy(t, &u, &v)
    }

    /// The same as a polynomial of the state, that of the phase: which springs are pressed, and which sliders stick, is not asked of the state.
    pub(crate) fn energy_of_phase(&self, phase: &Phase, t: f64, [u_o, v_o]: [&[f64]; 2]) -> f64 {
        let [u, v] = self.expanded(phase, t, [u_o, v_o]);
        let pushes = &phase.data.pushes;
        let obstacle = self.method.obstacle().map_or(0.0, |o| o.energy_of(pushes, u_o));
        let first = self.facing().len();
        let slider = |(s, slider): (usize, &Slider)| {
            slider.energy_if(phase.set.at(first + s).slip().is_none(), u_o)
        };
        let sliders: f64 = self.sliders().iter().enumerate().map(slider).sum();
        let elastic = self.elastic_with(t, &u, [obstacle, sliders]);
        self.beyond_rest(elastic + self.kinetic(t, &v), &u)
    }

    /// Displacements of the body at the contact points along their normals, of a full displacement; what is but seen need not be in it. Sliders have none.
    pub fn along_normals(&self, u: &[f64]) -> Vec<f64> {
        let (u_o, u_c) = u.split_at(self.n_o());
        let mut along = match self.method.obstacle() {
            Some(o) => (0..u_c.len()).map(|k| o.normal.row_dot(k, u_o)).collect(),
            None => self.conditions().at_points(u_c),
        };
        along.resize(self.n_contact(), 0.0);
        along
    }

    /// Displacements of the contact points that meet their obstacles, of a full displacement: at most the gap, where the obstacle yields.
    pub(crate) fn towards_obstacles(&self, u: &[f64]) -> Vec<f64> {
        match self.method.obstacle().filter(|o| !o.springs.is_empty()) {
            Some(o) => {
                let u_o = &u[..self.n_o()];
                (0..o.gap.len()).map(|k| o.depth.row_dot(k, u_o).min(o.gap[k])).collect()
            }
            None => self.along_normals(u),
        }
    }

    /// How far a shape `u_O` of the open body moves a contact point, or a slider, at the most.
    pub fn reach(&self, shape: &[f64]) -> f64 {
        let mut full = vec![0.0; self.n()];
        self.open_phase().expand(shape, &mut full);
        self.at_points(&full).into_iter().fold(0.0, |m, u| m.max(u.abs()))
    }

    /// How far a full displacement enters the obstacle at the most; negative where it touches nowhere.
    pub fn penetration(&self, u: &[f64]) -> f64 {
        let displacement = self.along_normals(u);
        let of_points = self.constraints.iter().zip(displacement).map(|(c, u)| u - c.gap);
        of_points.fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far the open contact displacements move at the most where no other displacement exceeds one: `‖A_∅‖_∞`.
    pub fn amplification(&self) -> f64 {
        self.open_phase().amplification()
    }

    /// `μ`, the largest eigenvalue of the open phase's mass over the closed one's: how much the paper's mass jumps at switches.
    pub fn mass_ratio(&self) -> Result<f64, ContactError> {
        redistribution::mass_ratio(&self.body, self.method.conditions())
    }

    /// Work vectors for the phases of this body.
    pub fn scratch(&self) -> Scratch {
        let (n, n_c) = (self.n(), self.conditions().count());
        Scratch::new(n, n_c, self.method.inertia().scratch())
    }
}
