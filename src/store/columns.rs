//! The datasets of all files, a row each: path, unit, what the dimensions count, meaning, and how a row of the table gives the value.

use std::borrow::Cow;

use super::row::Row;
use super::schema::{About, Column, Get};
use crate::event::{Grazing, Switch};
use crate::records::{
    AttractorRecord, BranchEnd, CheckRow, ExtremesRecord, FrictionRecord, GrazingRecord,
    OrbitRecord, Peak, PointRecord, VerdictKind, ViscousRecord,
};

// a dataset is a row
type Axes = &'static [&'static str];
const NODE: Axes = &["node", "axis"];
const CONTACT: Axes = &["contact point"];
const DIRECTION: Axes = &["contact point", "axis"];
const STATE: Axes = &["state"];
const POINT: Axes = &["point"];
const SWITCH: Axes = &["switch"];
const GRAZING: Axes = &["grazing"];
const TASK: Axes = &["task"];
const PEAK: Axes = &["peak"];
const SWEPT: Axes = &["row"];
const SWEPT_POINT: Axes = &["row", "contact point"];

/// What is written once.
#[rustfmt::skip]
static ONCE: &[About] = &[
    About::new("mesh/nodes", "length", NODE, "places of the nodes: x, y (and z in space)"),
    About::new("mesh/elements", "node", &["element", "corner"], "nodes of each element, from 0; -1 behind the last of a smaller one"),
    About::new("mesh/regions", "material", &["element"], "material of each element, from 0"),
    About::new("mesh/dof_map", "column", NODE, "column of trajectory/u of each nodal displacement; -1: prescribed; those below the attribute n_o move by themselves. Of a body of matrices: node i carries row i, behind these are the rows that supports of the scene hold, and the last node is the ground; u[:, dof_map[dof_map >= 0]] has the columns in the order of the rows"),
    About::new("mesh/contact_nodes", "node", CONTACT, "mesh node of each contact point, from 0; of a body of matrices the row of its displacement"),
    About::new("mesh/contact_points", "length", DIRECTION, "place of each contact point that is no node"),
    About::new("mesh/contact_normals", "1", DIRECTION, "outward normal of the body at each contact point"),
    About::new("mesh/contact_groups", "group", CONTACT, "which of the groups before obstacles each contact point belongs to"),
    About::new("mesh/contact_dofs", "column", CONTACT, "column of trajectory/u along the normal, up to its sign; -1: along no axis"),
    About::new("mesh/contact_area", "area", CONTACT, "area of each contact point: force = pressure x area"),
    About::new("mesh/gap", "length along the contact normal", CONTACT, "distance to the obstacle along the normal, undeformed"),
    About::new("mesh/row_names", "words", &["row"], "of a body of matrices whose program names its rows: node and direction of each, and of those that supports of the scene hold; the attribute turned says which count along other directions than in the matrices"),
    About::new("obstacle/omega", "1/time", &["part"], "of gaps that move: circular frequency of each harmonic part"),
    About::new("obstacle/phase", "1", &["part"], "its phase: cos(omega t + phase)"),
    About::new("obstacle/motion", "length", &["part", "contact point", "direction"], "its amplitude, along the axes: contact displacements are counted from there, nodes stand farther by it"),
    About::new("moving/node", "node", &["moving node"], "nodes of supports that move"),
    About::new("moving/motion", "length", &["part", "moving node", "direction"], "how far each part moves them along the axes; they have no columns of trajectory/u"),
    About::new("moving/omega", "1/time", &["part"], "circular frequency of each part; not a number where it follows a table"),
    About::new("moving/phase", "1", &["part"], "its phase: cos(omega t + phase)"),
    About::new("moving/table_part", "part", &["row"], "of tables: the part that each row belongs to"),
    About::new("moving/table_t", "time", &["row"], "time of each row; between rows a cubic spline, straight at its ends"),
    About::new("moving/table_value", "1", &["row"], "factor of the motion"),
    About::new("bodies/name", "words", &["body"], "name of each body, or of each group of cells with a material of its own"),
    About::new("bodies/of_node", "body", &["node"], "body that each node belongs to, from 0"),
    About::new("contact/against/indptr", "entry", &["contact point"], "first entry of each contact point in indices and data (one more at the end): its displacement is n.(u - sum of data u[indices]), the second term where two surfaces meet"),
    About::new("contact/against/indices", "node", &["entry"], "nodes of masters"),
    About::new("contact/against/data", "1", &["entry"], "their weights P"),
    About::new("contact/pairs/slave", "words", &["pair"], "group whose nodes are contact nodes"),
    About::new("contact/pairs/master", "words", &["pair"], "group that they meet"),
    About::new("contact/pairs/projection", "match | dual", &["pair"], "how the two meshes are joined"),
    About::new("contact/pairs/sides", "both | slave", &["pair"], "which surface has no inertia along its normals"),
    About::new("contact/pairs/lever", "length", &["pair"], "largest distance by which the line of action of a contact force misses the slave's normal"),
    About::new("forces/contact/group", "words", &["group"], "groups before obstacles, and slaves"),
    About::new("forces/support/group", "words", &["group"], "groups that supports hold"),
    About::new("forces/spring/name", "words", &["spring"], "ends of each spring"),
    About::new("backbone/extremes/name", "words", &["quantity"], "what is watched, as columns of tables are called: force_x[right], the same as a whole force[right], support_x[left], spring[…], displacement_x[tip]"),
    About::new("backbone/extremes/kind", "contact | support | spring | probe", &["quantity"], "what each of them is"),
    About::new("trajectory/columns", "column", &["column"], "which of all displacements (mesh/dof_map) u and v hold"),
    About::new("friction/work", "energy", CONTACT, "what friction took at each contact point over the run"),
    About::new("friction/path", "length", CONTACT, "how far each contact point slipped"),
    About::new("friction/coefficient", "1", CONTACT, "coefficient of friction of each contact point, 0: none"),
    About::new("friction/surface", "length/time", CONTACT, "velocity of the obstacle's surface along the tangent of each contact point"),
    About::new("friction/direction", "1", DIRECTION, "tangent of each contact point: its outward normal turned by +90 degrees"),
    About::new("report/final/u", "length", &["unknown"], "last state: displacements u_O"),
    About::new("report/final/v", "length/time", &["unknown"], "last state: velocities of u_O"),
    About::new("orbit/u0", "length", &["displacement"], "displacements at t = 0, in the order of trajectory/u"),
    About::new("orbit/v0", "length/time", &["displacement"], "velocities at t = 0"),
    About::new("orbit/multipliers", "1", &["multiplier", "part"], "Floquet multipliers: real part, imaginary part"),
    About::new("orbit/multipliers_under_load", "1", &["multiplier", "part"], "multipliers of a viscous mode as the response to the load that takes the place of its feedback"),
    About::new("sensitivity/KEY/u0", "length by the number", &["displacement"], "derivative of orbit/u0 by the number of the scene at KEY"),
    About::new("sensitivity/KEY/v0", "length/time by the number", &["displacement"], "derivative of orbit/v0"),
    About::new("sensitivity/KEY/multipliers", "1 by the number", &["multiplier", "part"], "derivative of orbit/multipliers: real part, imaginary part"),
    About::new("curves/range", "unit of the number", &["end"], "range of the number of the scene at key, the attribute of /curves"),
    About::new("curves/frequencies", "1/time", &["end"], "range of the frequencies"),
    About::new("curves/K/omega", "1/time", POINT, "curve K, from 0: circular frequency of each point"),
    About::new("curves/K/value", "unit of the number", POINT, "the number of the scene"),
    About::new("curves/K/theta", "rad", POINT, "angle of the multipliers on the unit circle at a Neimark-Sacker point"),
    About::new("curves/K/amplitude", "length", POINT, "largest contact displacement in magnitude"),
    About::new("curves/K/energy", "energy", POINT, "largest energy"),
    About::new("curves/K/outside", "number", POINT, "multipliers outside of the unit circle, but for those that single the orbit out"),
    About::new("curves/K/special", "start | cusp | turn | end of range", POINT, "what a point is besides: at a cusp two folds meet, at a turn the number alone turns back; empty: nothing"),
    About::new("curves/K/ends", "words", &["side"], "how the curve ended before its first point and behind its last"),
    About::new("curves/K/u0", "length", &["point", "displacement"], "displacements at t = 0, in the order of orbit/u0"),
    About::new("curves/K/v0", "length/time", &["point", "displacement"], "velocities at t = 0"),
    About::new("diagram/range", "unit of the number", &["end"], "range of the number of the scene at key, the attribute of /diagram"),
    About::new("diagram/value", "unit of the number", SWEPT, "the number of the scene in each row of /sweep"),
    About::new("diagram/direction", "1 | -1", SWEPT, "whether the number goes up or down there"),
    About::new("diagram/special", "words", SWEPT, "start, jump, or another kind of motion than in the row before; empty: nothing"),
    About::new("diagram/x", "square root of energy", &["row", "number"], "a state at phase zero of the loads, in the frame of the body at the scene's own value: from there a run goes on"),
    About::new("diagram/goes_on", "1 = yes", SWEPT, "a value of the grid, from which a run goes on; 0: one between, where a change is closed in on"),
    About::new("phase_resonance/range", "unit of the number", &["end"], "range of the number of the scene at key, the attribute of /phase_resonance"),
    About::new("phase_resonance/gains", "1/time", &["gain"], "gains of the loop, of frequency over radians of lag: the proportional one, and that of the sum of each period's error"),
    About::new("phase_resonance/value", "unit of the number", SWEPT, "the number of the scene"),
    About::new("phase_resonance/locked", "1 = yes", SWEPT, "whether the loop came to rest; else readings are no numbers, and note says why"),
    About::new("phase_resonance/periods", "number", SWEPT, "periods of the loads until it did"),
    About::new("phase_resonance/omega", "1/time", SWEPT, "circular frequency, mean of the periods that are averaged over"),
    About::new("phase_resonance/omega_error", "1/time", SWEPT, "its standard error"),
    About::new("phase_resonance/lag", "rad", SWEPT, "lag of the displacement that the loads work on"),
    About::new("phase_resonance/lag_error", "rad", SWEPT, "its standard error"),
    About::new("phase_resonance/amplitude", "length", SWEPT, "largest displacement of a contact point in magnitude"),
    About::new("phase_resonance/amplitude_error", "length", SWEPT, "its standard error"),
    About::new("phase_resonance/force", "force", SWEPT, "largest force of all contact points together"),
    About::new("phase_resonance/force_error", "force", SWEPT, "its standard error"),
    About::new("phase_resonance/work", "energy", SWEPT, "work of the loads in a period"),
    About::new("phase_resonance/work_error", "energy", SWEPT, "its standard error"),
    About::new("phase_resonance/energy", "energy", SWEPT, "largest energy"),
    About::new("phase_resonance/kinetic", "energy", SWEPT, "largest kinetic energy"),
    About::new("phase_resonance/damping", "1", SWEPT, "W/(4πK): damping ratio of the oscillator that loses as much in a period and has the same largest kinetic energy K"),
    About::new("phase_resonance/sensitivity/KEY/omega", "1/time by the number", SWEPT, "derivative of omega by the number of the scene at KEY, at phase resonance; no number where there is none"),
    About::new("phase_resonance/sensitivity/KEY/amplitude", "length by the number", SWEPT, "derivative of amplitude"),
    About::new("phase_resonance/sensitivity/KEY/work", "energy by the number", SWEPT, "derivative of work"),
    About::new("phase_resonance/note", "words", SWEPT, "why the loop did not come to rest, or why derivatives are missing; else empty"),
    About::new("phase_resonance/x", "square root of energy", &["row", "number"], "a state at phase zero of the loads, in the frame of the body at the scene's own value: from there a run goes on"),
    About::new("bands/branch", "number", POINT, "branch of the family that each orbit is of, from 0"),
    About::new("bands/index", "number", POINT, "its place there"),
    About::new("bands/omega", "1/time", POINT, "circular frequency"),
    About::new("bands/amplitude", "length", POINT, "largest contact displacement"),
    About::new("bands/amplitude_deviation", "length", POINT, "its standard deviation at the frequency of the orbit, to first order in those of the numbers; no number where a derivative is missing"),
    About::new("bands/amplitude_along", "length time", POINT, "its derivative by the frequency, along the branch"),
    About::new("bands/energy", "energy", POINT, "energy"),
    About::new("bands/energy_deviation", "energy", POINT, "its standard deviation"),
    About::new("bands/energy_along", "energy time", POINT, "its derivative by the frequency"),
    About::new("bands/note", "words", POINT, "why derivatives are missing; else empty"),
    About::new("bands/sensitivity/KEY/amplitude", "length by the number", POINT, "derivative of amplitude by the number of the scene at KEY, at the frequency of the orbit"),
    About::new("bands/sensitivity/KEY/energy", "energy by the number", POINT, "derivative of energy"),
    About::new("tori/range", "1/time", &["end"], "circular frequencies that curves are followed in"),
    About::new("tori/omega", "1/time", SWEPT, "circular frequency of the loads"),
    About::new("tori/rotation_number", "1", SWEPT, "turns around the curve in a period of the loads"),
    About::new("tori/size", "square root of energy", SWEPT, "norm of the first coefficient of the curve"),
    About::new("tori/tail", "1", SWEPT, "the larger one of its last two coefficients over the first"),
    About::new("tori/attraction", "1", SWEPT, "by how much a state beside it comes nearer in a period: below 1 it attracts; not a number: nothing to be seen"),
    About::new("tori/amplitude", "length", SWEPT, "largest contact displacement in magnitude"),
    About::new("tori/force", "force", SWEPT, "largest force of all contact points together"),
    About::new("tori/step", "square root of energy", SWEPT, "by how much larger the next one was to be: from there a run goes on"),
    About::new("tori/K/x", "square root of energy", &["phase", "number"], "states of curve K, from 0, at phase zero of the loads: frame vectors at even phases around it"),
    About::new("tori/K/lead", "length; length/time", &["phase", "part"], "displacement and velocity of the contact point that moves most around it, at these"),
    About::new("basins/range", "1", &["axis", "end"], "range of each coordinate of the states, in the order of the attribute axes"),
    About::new("basins/starts", "1", &["start", "axis"], "coordinates of each state: qK, amplitude of mode K over its first grazing; vK, its velocity over its frequency in the same unit"),
    About::new("basins/attractor", "attractor", &["start"], "number of the attractor that each state leads to; -1: not settled, -2: unbounded, -3: lost, -4: inside an obstacle, -9: not computed. Of a plane of cells (attribute size) the first axis runs fastest"),
    About::new("basins/maps", "number", &["start"], "periods of the loads that it took to tell"),
    About::new("attractors/K/peak", "length", CONTACT, "attractor K, from 0: largest displacement of each contact point along its normal"),
    About::new("attractors/K/trough", "length", CONTACT, "least displacement"),
    About::new("attractors/K/sections", "length", &["number"], "contact displacements at the beginning of each period of the loads, one period after the other"),
    About::new("attractors/K/least", "length", &["number"], "least contact displacements in each of these periods"),
    About::new("attractors/K/spectrum", "length", &["line"], "magnitudes of the harmonics of the contact point that moves most, at multiples of a twelfth of the frequency of the loads"),
    About::new("attractors/K/x", "square root of energy", &["number"], "a state at phase zero of the loads, in the frame of the body: from there a run goes on"),
    About::new("attractors/K/u0", "length", &["state", "displacement"], "displacements at phase zero of the loads, in the order of orbit/u0: of an orbit one row for each of its periods"),
    About::new("attractors/K/v0", "length/time", &["state", "displacement"], "velocities there"),
    About::new("attractors/K/at", "1", &["state", "axis"], "states at phase zero of the loads along the axes of the basins: those of an orbit, a cloud of what is not periodic"),
    About::new("lyapunov/exponents", "1/time", &["exponent"], "Lyapunov exponents, the largest first"),
    About::new("lyapunov/errors", "1/time", &["exponent"], "their standard errors, of means of blocks of periods that hang together no more"),
    About::new("lyapunov/bounds", "1/time", &["exponent"], "the largest standard error that blocks of any length give"),
    About::new("lyapunov/growths", "1", &["period", "exponent"], "logarithm of the growth of each direction in each period"),
    About::new("orbit/switches/t", "time", SWITCH, "time of each switch of the period"),
    About::new("orbit/switches/node", "mesh node", SWITCH, "mesh node that switches"),
    About::new("orbit/switches/kind", "close | open | impact | rest | sticking | slipping", SWITCH, "what the switch is"),
    About::new("orbit/switches/energy_jump", "energy", SWITCH, "jump of the energy at the switch"),
    About::new("hbm/coefficients", "length; order a_0, a_1, b_1, a_2, b_2, … of u_O (of the coordinates of a reduced body)", &["series", "function", "unknown"], "u_O(t) = sum of a_k cos k omega t + b_k sin k omega t"),
    About::new("backbone/points/NNNN/continuation/x", "units of the problem", &["unknown"], "unknowns of the continuation, the frequency last (a point has the datasets of /orbit besides)"),
    About::new("backbone/points/NNNN/continuation/tangent", "units of the problem", &["unknown"], "tangent of the branch"),
    About::new("backbone/points/NNNN/continuation/signature", "number", &["test"], "signs of the tests that change at special points"),
    About::new("backbone/points/NNNN/continuation/active", "1 = contact", &["phase", "contact point"], "active set of each phase"),
    About::new("backbone/points/NNNN/continuation/node", "contact point", SWITCH, "contact point of each switch"),
    About::new("backbone/points/NNNN/continuation/base", "length", &["coefficient"], "the solution of one harmonic that the ladder began with"),
    About::new("backbone/points/NNNN/continuation/memory", "units of the problem", &["number"], "what the branch remembers of its way"),
    About::new("backbone/error_statement/omega", "1/time", POINT, "circular frequency"),
    About::new("backbone/error_statement/energy", "energy", POINT, "energy of the family"),
    About::new("backbone/error_statement/slope", "energy time", POINT, "its derivative by the frequency"),
    About::new("study/id", "words", TASK, "folder of the task"),
    About::new("study/state", "done | failed | running | interrupted | waiting", TASK, "what became of the task"),
    About::new("study/message", "words", TASK, "why a task failed"),
    About::new("points/special", "words", POINT, "what is special about the point"),
    About::new("points/task", "task", POINT, "task that the point belongs to, from 0"),
    About::new("points/omega", "1/time", POINT, "circular frequency"),
    About::new("points/energy", "energy", POINT, "energy of the motion"),
    About::new("points/amplitude", "length", POINT, "largest contact displacement"),
    About::new("comparison/variant", "words", &["row"], "contact method, options included"),
    About::new("comparison/changed", "words", &["row"], "keys of the scene that were changed"),
    About::new("comparison/mesh", "words", &["row"], "mesh of the row"),
    About::new("comparison/note", "words", &["row"], "why there are no numbers, or what to know of them"),
    About::new("comparison/h", "length", &["row"], "size of an element"),
];

/// `/trajectory`, a row a stored state.
#[rustfmt::skip]
pub(super) static STATES: &[Column<Row>] = &[
    Column::new("trajectory/t", "time", STATE, "time of each stored state", Get::Number(|s| s.t)),
    Column::new("trajectory/u", "length", &["state", "displacement"], "displacements; contact displacements come last: mesh/dof_map says which column is which", Get::Numbers(|s| &s.u)),
    Column::new("trajectory/v", "length/time", &["state", "displacement"], "velocities, in the order of trajectory/u", Get::Numbers(|s| &s.v)),
    Column::new("trajectory/active", "1 = contact", &["state", "contact point"], "what a contact point does: 0 open, 1 in contact; with friction 2 sticks, 3 slips forwards along the tangent, 4 backwards", Get::States(|s| &s.active)),
    Column::new("trajectory/pressure", "stress", &["state", "contact point"], "contact pressure, positive in compression", Get::Numbers(|s| &s.pressure)),
];

/// Forces of the groups of contact points besides.
#[rustfmt::skip]
pub(super) static FORCES: &[Column<Row>] = &[
    Column::new("forces/contact/force", "force", &["state", "component"], "force on the body at each group of contact points (forces/contact/group), components of the first, then of the next; what it meets has the opposite", Get::Numbers(|s| &s.forces[0])),
    Column::new("forces/contact/place", "length", &["state", "component"], "place of the line of action of its normal part, undeformed; not a number without pressure", Get::Numbers(|s| &s.forces[1])),
];

/// Forces of supports besides.
#[rustfmt::skip]
pub(super) static SUPPORTS: &[Column<Row>] = &[
    Column::new("forces/support/force", "force", &["state", "component"], "force of each support on the body (forces/support/group), components of the first, then of the next; not a number where the scheme knows no accelerations", Get::Numbers(|s| &s.borne.supports)),
];

/// Forces of springs besides.
#[rustfmt::skip]
pub(super) static SPRINGS: &[Column<Row>] = &[
    Column::new("forces/spring/force", "force", &["state", "spring"], "force of each spring (forces/spring/name), preload included: positive where it pulls its ends together, of one to the ground where it pulls against its direction", Get::Numbers(|s| &s.borne.springs)),
];

/// How far surfaces that meet have slid besides.
#[rustfmt::skip]
pub(super) static SLIDING: &[Column<Row>] = &[
    Column::new("contact/pairs/sliding", "1", &["state", "pair"], "largest displacement of the slave's nodes along the master, over the length of their sides: small displacements keep it below 1", Get::Numbers(|s| &s.strayed.sliding)),
];

/// Rotations of bodies that meet besides.
#[rustfmt::skip]
pub(super) static ROTATIONS: &[Column<Row>] = &[
    Column::new("bodies/rotation", "rad", &["state", "component"], "rotation of each part (bodies/name) as a whole, one component in the plane, three in space", Get::Numbers(|s| &s.strayed.rotation)),
];

/// Momenta of several bodies besides.
#[rustfmt::skip]
pub(super) static MOMENTA: &[Column<Row>] = &[
    Column::new("bodies/momentum", "momentum", &["state", "component"], "momentum of each part (bodies/name), components of the first, then of the next", Get::Numbers(|s| &s.borne.momentum)),
];

/// `/energy`, a row a stored state.
#[rustfmt::skip]
pub(super) static ENERGY: &[Column<Row>] = &[
    Column::new("energy/t", "time", STATE, "time", Get::Number(|s| s.t)),
    Column::new("energy/kinetic", "energy", STATE, "kinetic energy of the whole body, what moving supports carry included (seen from an obstacle that moves)", Get::Number(|s| s.energy(0))),
    Column::new("energy/elastic", "energy", STATE, "elastic energy of the whole body, elements at moving supports included", Get::Number(|s| s.energy(1))),
    Column::new("energy/external", "energy", STATE, "work so far of the loads, and of supports and obstacles that move (all that changes the energy but damping of free displacements and jumps)", Get::Number(|s| s.energy(2))),
    Column::new("energy/dissipated", "energy", STATE, "work so far of the damping forces of free displacements on themselves", Get::Number(|s| s.energy(3))),
    Column::new("energy/jumps", "energy", STATE, "sum of the jumps at switches so far", Get::Number(|s| s.jumps)),
];

/// The columns of states with friction besides.
#[rustfmt::skip]
pub(super) static TRACTIONS: &[Column<Row>] = &[
    Column::new("trajectory/traction", "stress", &["state", "contact point"], "traction of the obstacle on the body along the tangent (friction/direction), with friction", Get::Numbers(|s| &s.traction)),
    Column::new("trajectory/slide", "length", &["state", "contact point"], "displacement of each contact point along its tangent (friction/direction), of a slider that over which it slides, with friction", Get::Numbers(|s| &s.slide)),
];

/// The columns of energies with friction besides.
#[rustfmt::skip]
pub(super) static FRICTION: &[Column<Row>] = &[
    Column::new("energy/friction", "energy", STATE, "what friction took so far", Get::Number(|s| s.energy(4))),
    Column::new("energy/belt", "energy", STATE, "work so far of obstacles' surfaces that move along themselves", Get::Number(|s| s.energy(5))),
];

/// `/switches`.
#[rustfmt::skip]
pub(super) static SWITCHES: &[Column<Switch>] = &[
    Column::new("switches/t", "time", SWITCH, "time of each switch of the active set", Get::Number(|s| s.t)),
    Column::new("switches/node", "mesh node", SWITCH, "mesh node that switches", Get::Whole(|s| s.node as i64)),
    Column::new("switches/kind", "close | open | impact | rest | sticking | slipping", SWITCH, "close or open; of an impact law also impact (a rebound) or rest (rebounds that ended); with friction sticking or slipping (breaks loose, or turns back)", Get::Words(32, |s| s.kind.name().into())),
    Column::new("switches/energy_jump", "energy", SWITCH, "jump of the energy at the switch", Get::Number(|s| s.energy_jump)),
    Column::new("switches/point", "contact point", SWITCH, "its contact point: column of the tables by contact point", Get::Whole(|s| s.point as i64)),
    Column::new("switches/monitor", "gap | pressure | closing | opening | stick+ | stick- | slip", SWITCH, "what vanishes: gap, pressure; of a point held on the surface: closing, opening; with friction what is left of mu p before slip+ or slip-, and the velocity of a slip", Get::Name(|s| s.monitor.word())),
    Column::new("switches/from", "open | closed | stick | slip+ | slip-", SWITCH, "state of the point before the switch: open, closed; with friction stick, slip+, slip-", Get::Name(|s| s.from().word())),
    Column::new("switches/to", "open | closed | stick | slip+ | slip-", SWITCH, "state of the point behind the switch", Get::Name(|s| s.to().word())),
    Column::new("switches/monitor_rate", "length/time (close) | stress/time (open)", SWITCH, "rate of the gap (close) or the pressure (open) that vanishes", Get::Number(|s| s.monitor_rate)),
    Column::new("switches/active_before", "1 = contact", &["switch", "contact point"], "active set before the switch", Get::States(|s| &s.before)),
    Column::new("switches/active_after", "1 = contact", &["switch", "contact point"], "active set behind the switch", Get::States(|s| &s.after)),
];

/// `/grazings`.
#[rustfmt::skip]
pub(super) static GRAZINGS: &[Column<Grazing>] = &[
    Column::new("grazings/t", "time", GRAZING, "time of each grazing", Get::Number(|g| g.t)),
    Column::new("grazings/node", "mesh node", GRAZING, "mesh node that grazes", Get::Whole(|g| g.node as i64)),
    Column::new("grazings/distance", "length (gap) | stress (pressure)", GRAZING, "how near", Get::Number(|g| g.distance)),
    Column::new("grazings/kind", "words", GRAZING, "of a run: gap or pressure that comes near zero; of a family: closing (a touch begins or ends to be) or opening (a resting point leaves for a moment)", Get::Words(32, |g| g.kind.name().into())),
];

/// A grazing of a branch.
pub(super) struct GrazingRow {
    pub omega: f64,
    pub branch: i64,
    pub point: i64,
    pub grazing: GrazingRecord,
    pub multiplier: f64,
}

/// `/grazings` of a family; node and kind are those of a run.
#[rustfmt::skip]
pub(super) static FAMILY_GRAZINGS: &[Column<GrazingRow>] = &[
    Column::new("grazings/omega", "1/time", GRAZING, "circular frequency of each grazing of a branch", Get::Number(|g| g.omega)),
    Column::new("grazings/branch", "number", GRAZING, "its branch", Get::Whole(|g| g.branch)),
    Column::new("grazings/point", "row of /backbone", GRAZING, "its point", Get::Whole(|g| g.point)),
    Column::new("grazings/node", "mesh node", GRAZING, "mesh node that grazes; where several do together a row for each", Get::Whole(|g| g.grazing.node as i64)),
    Column::new("grazings/kind", "words", GRAZING, "closing or opening", Get::Words(32, |g| g.grazing.visit().into())),
    Column::new("grazings/turns", "1 = it does", GRAZING, "whether the frequency of the branch turns back there", Get::Whole(|g| g.grazing.turns.into())),
    Column::new("grazings/multiplier", "1", GRAZING, "largest modulus of a multiplier at the next orbit behind it", Get::Number(|g| g.multiplier)),
];

/// `/branches` of a family.
#[rustfmt::skip]
pub(super) static BRANCHES: &[Column<BranchEnd>] = &[
    Column::new("branches/branch", "number", &["end"], "branch that ended", Get::Whole(|e| e.branch as i64)),
    Column::new("branches/end", "words", &["end"], "range (everything is there), points (as many as were asked for), met (closed, or another branch), lost, interrupted", Get::Words(32, |e| e.reason.word().into())),
    Column::new("branches/why", "words", &["end"], "in words, with the numbers", Get::Words(512, |e| (&*e.text).into())),
];

/// A number of the orbit of a point; not a number where there is none.
fn of_orbit(p: &PointRecord, get: fn(&OrbitRecord) -> f64) -> f64 {
    p.orbit.as_ref().map_or(f64::NAN, get)
}

fn of_viscous(p: &PointRecord, get: fn(&ViscousRecord) -> f64) -> f64 {
    p.orbit.as_ref().and_then(|o| o.viscous.as_ref()).map_or(f64::NAN, get)
}

/// `α`, of the orbit if it is known, else of the series.
fn alpha(p: &PointRecord) -> f64 {
    let of_series = p.series.as_ref().and_then(|s| s.alpha).unwrap_or(f64::NAN);
    Some(of_viscous(p, |v| v.alpha)).filter(|a| !a.is_nan()).unwrap_or(of_series)
}

/// `/backbone`, a row a point.
#[rustfmt::skip]
pub(super) static FAMILY: &[Column<PointRecord>] = &[
    Column::new("backbone/omega", "1/time", POINT, "circular frequency", Get::Number(|p| p.omega)),
    Column::new("backbone/energy", "energy", POINT, "energy of the motion", Get::Number(PointRecord::energy)),
    Column::new("backbone/amplitude", "length", POINT, "largest contact displacement", Get::Number(PointRecord::amplitude)),
    Column::new("backbone/residual", "relative", POINT, "what is left of the periodicity, over the size of the state", Get::Number(|p| of_orbit(p, |o| o.residual))),
    Column::new("backbone/contact_time", "time", POINT, "time in contact in a period", Get::Number(|p| of_orbit(p, |o| o.contact_time))),
    Column::new("backbone/grazing_distance", "relative", POINT, "nearest grazing, over the gap", Get::Number(|p| of_orbit(p, |o| o.grazing))),
    Column::new("backbone/switches", "number a period", POINT, "switches in a period", Get::Number(PointRecord::switches)),
    Column::new("backbone/stable", "1 stable, 0 unstable, -1 not computed", POINT, "1 stable, 0 unstable, -1 not computed", Get::Number(|p| of_orbit(p, |o| o.stable.map_or(-1.0, |s| f64::from(u8::from(s)))))),
    Column::new("backbone/branch", "number", POINT, "branch that the point belongs to", Get::Number(|p| p.branch as f64)),
    Column::new("backbone/index", "place on the branch", POINT, "place of the point in its branch", Get::Number(|p| p.index as f64)),
    Column::new("backbone/special", "words", POINT, "what is special about the point", Get::Words(128, |p| Cow::Owned(p.special.to_string()))),
];

/// What forces and probes come to at a point.
#[rustfmt::skip]
pub(super) static EXTREMES: &[Column<ExtremesRecord>] = &[
    Column::new("backbone/extremes/largest", "unit of each", &["point", "quantity"], "the largest of each force and of what each probe sees over the period (extremes/name), at 200 states of it (in a sweep 128) and the tops of parabolas through three of one phase; not a number where it is not known", Get::Numbers(|e| &e.largest)),
    Column::new("backbone/extremes/least", "unit of each", &["point", "quantity"], "the least of each", Get::Numbers(|e| &e.least)),
];

/// Columns of viscous nonlinear modes besides.
#[rustfmt::skip]
pub(super) static VISCOUS: &[Column<PointRecord>] = &[
    Column::new("backbone/alpha", "1/time", POINT, "feedback of a viscous nonlinear mode", Get::Number(alpha)),
    Column::new("backbone/beta", "time", POINT, "viscosity", Get::Number(|p| of_viscous(p, |v| v.beta))),
    Column::new("backbone/energy_turned_over", "energy a period", POINT, "energy that viscosity and feedback hand round in a period", Get::Number(|p| of_viscous(p, |v| v.turned_over))),
];

fn of_friction(p: &PointRecord, get: fn(&FrictionRecord) -> f64) -> f64 {
    p.orbit.as_ref().and_then(|o| o.friction.as_ref()).map_or(f64::NAN, get)
}

/// Columns of bodies with friction besides.
#[rustfmt::skip]
pub(super) static RUBBED: &[Column<PointRecord>] = &[
    Column::new("backbone/friction_work", "energy a period", POINT, "work that friction takes in a period", Get::Number(|p| of_friction(p, |f| f.work))),
    Column::new("backbone/belt_work", "energy a period", POINT, "work of moving surfaces on the body in a period", Get::Number(|p| of_friction(p, |f| f.belt))),
    Column::new("backbone/family_dimension", "number", POINT, "parameters of the family of residual positions that the orbit is a member of", Get::Number(|p| of_friction(p, |f| f.family.map_or(f64::NAN, |k| k as f64)))),
    Column::new("backbone/drift", "length a period", POINT, "how far a body whose place only friction holds walks along the obstacle in a period", Get::Number(|p| of_friction(p, |f| f.drift.unwrap_or(f64::NAN)))),
];

/// `/backbone/ridge`, a row a peak.
#[rustfmt::skip]
pub(super) static RIDGE: &[Column<Peak>] = &[
    Column::new("backbone/ridge/branch", "number", PEAK, "branch of the peak", Get::Number(|p| p.branch as f64)),
    Column::new("backbone/ridge/omega", "1/time", PEAK, "circular frequency of the peak", Get::Number(|p| p.omega)),
    Column::new("backbone/ridge/amplitude", "length", PEAK, "largest contact displacement there", Get::Number(|p| p.amplitude)),
    Column::new("backbone/ridge/energy", "energy", PEAK, "energy there", Get::Number(|p| p.energy)),
];

/// What a body settles to at a row of `/backbone`.
pub(super) struct SweepRow {
    pub point: i64,
    pub omega: f64,
    pub seen: AttractorRecord,
}

/// `/sweep`, a row a frequency of a sweep.
#[rustfmt::skip]
pub(super) static SWEEP: &[Column<SweepRow>] = &[
    Column::new("sweep/omega", "1/time", SWEPT, "circular frequency of the loads", Get::Number(|s| s.omega)),
    Column::new("sweep/point", "row of /backbone", SWEPT, "point that the row belongs to (its branch says which sweep); of a diagram the row itself", Get::Whole(|s| s.point)),
    Column::new("sweep/kind", "periodic | quasi-periodic | chaotic | slow | unbounded | lost | transient", SWEPT, "what the body settles to", Get::Words(32, |s| s.seen.kind.word().into())),
    Column::new("sweep/period_number", "periods of the loads", SWEPT, "periods of the loads in one of an orbit; 0: no orbit", Get::Whole(|s| s.seen.kind.periods() as i64)),
    Column::new("sweep/lyapunov", "1 a period of the loads", SWEPT, "largest Lyapunov exponent: of an orbit the logarithm of its largest multiplier, else a mean along the motion", Get::Number(|s| s.seen.exponent)),
    Column::new("sweep/lyapunov_error", "1 a period of the loads", SWEPT, "standard error of that mean", Get::Number(|s| s.seen.exponent_error)),
    Column::new("sweep/amplitude", "length", SWEPT, "largest contact displacement in magnitude", Get::Number(|s| s.seen.amplitude())),
    Column::new("sweep/force", "force", SWEPT, "largest force of all contact points together, of 128 states a period and those at the switches", Get::Number(|s| s.seen.force)),
    Column::new("sweep/energy", "energy", SWEPT, "largest energy", Get::Number(|s| s.seen.energy)),
    Column::new("sweep/switches", "number a period of the loads", SWEPT, "switches", Get::Number(|s| s.seen.switches)),
    Column::new("sweep/peak", "length", SWEPT_POINT, "largest displacement of each contact point along the normal", Get::Numbers(|s| &s.seen.peak)),
    Column::new("sweep/trough", "length", SWEPT_POINT, "least displacement of each contact point along the normal", Get::Numbers(|s| &s.seen.trough)),
    Column::new("sweep/spectrum", "length", &["row", "line"], "magnitudes of the harmonics of the contact point that moves most, at multiples of omega/12", Get::Numbers(|s| &s.seen.spectrum)),
    Column::new("sweep/maps", "periods of the loads", SWEPT, "periods until the body had settled", Get::Whole(|s| s.seen.maps as i64)),
    Column::new("sweep/note", "words", SWEPT, "what there is to say besides", Get::Words(256, |s| (&*s.seen.note).into())),
];

/// A state at the beginning of a period of the loads.
pub(super) struct SectionRow {
    pub row: i64,
    pub at: Vec<f64>,
    pub least: Vec<f64>,
}

/// The states of `/sweep` at the beginning of the periods of the loads.
#[rustfmt::skip]
pub(super) static SECTIONS: &[Column<SectionRow>] = &[
    Column::new("sweep/points_of", "row of /sweep", &["section"], "row that the section belongs to", Get::Whole(|s| s.row)),
    Column::new("sweep/points", "length", &["section", "contact point"], "displacements of the contact points along the normal at the beginning of each period of the loads: of an orbit as many as it has, of other motions 40", Get::Numbers(|s| &s.at)),
    Column::new("sweep/least", "length", &["section", "contact point"], "least displacements of the contact points along the normal in each of these periods, of 128 states", Get::Numbers(|s| &s.least)),
];

/// A series, but for its coefficients.
pub(super) struct SeriesRow {
    pub omega: f64,
    pub harmonics: i64,
    pub point: i64,
    pub alpha: f64,
}

/// `/hbm`, a row a series.
#[rustfmt::skip]
pub(super) static SERIES: &[Column<SeriesRow>] = &[
    Column::new("hbm/omega", "1/time", &["series"], "circular frequency", Get::Number(|s| s.omega)),
    Column::new("hbm/harmonics", "number", &["series"], "harmonics of the series", Get::Whole(|s| s.harmonics)),
    Column::new("hbm/point", "row of /backbone", &["series"], "point that the series belongs to", Get::Whole(|s| s.point)),
    Column::new("hbm/alpha", "1/time", &["series"], "feedback of a viscous nonlinear mode", Get::Number(|s| s.alpha)),
];

/// `/crosscheck`, a row a point of harmonic balance.
#[rustfmt::skip]
pub(super) static CHECKS: &[Column<CheckRow>] = &[
    Column::<CheckRow>::new("crosscheck/omega", "1/time", POINT, "circular frequency", Get::Number(|r| r.omega)).kept(|r, x| r.omega = x),
    Column::<CheckRow>::new("crosscheck/harmonics", "number", POINT, "harmonics of the series", Get::Number(|r| r.n_h as f64)).kept(|r, x| r.n_h = x as usize),
    Column::<CheckRow>::new("crosscheck/hbm_energy", "energy", POINT, "energy of the series, of a forced motion the largest", Get::Number(|r| r.energy)).kept(|r, x| r.energy = x),
    Column::<CheckRow>::new("crosscheck/residual", "relative", POINT, "residual of the series in time", Get::Number(|r| r.residual)).kept(|r, x| r.residual = x),
    Column::<CheckRow>::new("crosscheck/return_error", "relative", POINT, "how far the state of the series is from itself after a period", Get::Number(|r| r.return_error)).kept(|r, x| r.return_error = x),
    Column::<CheckRow>::new("crosscheck/moved", "relative", POINT, "distance of both states at t = 0 over the size of the orbit's", Get::Number(|r| r.moved)).kept(|r, x| r.moved = x),
    Column::<CheckRow>::new("crosscheck/orbit_energy", "energy", POINT, "energy of the orbit", Get::Number(|r| r.orbit_energy)).kept(|r, x| r.orbit_energy = x),
    Column::<CheckRow>::new("crosscheck/contact_change", "relative", POINT, "change of the contact time over the period", Get::Number(|r| r.contact_change)).kept(|r, x| r.contact_change = x),
    Column::<CheckRow>::new("crosscheck/same_sequence", "1 = the same", POINT, "whether the sequence of switches stayed", Get::Number(|r| f64::from(u8::from(r.same_sequence)))).kept(|r, x| r.same_sequence = x == 1.0),
    Column::<CheckRow>::new("crosscheck/verdict", "words", POINT, "orbit where shooting ends near the series and with its switches, another orbit where it ends elsewhere, else why there is none", Get::Words(32, |r| r.verdict.name().into())),
    Column::<CheckRow>::new("crosscheck/message", "words", POINT, "the verdict in words", Get::Words(256, |r| (&*r.message).into())),
];

/// A row to read into.
pub(super) fn empty_check(verdict: VerdictKind, message: String) -> CheckRow {
    let nan = f64::NAN;
    CheckRow {
        omega: nan,
        n_h: 0,
        energy: nan,
        residual: nan,
        return_error: nan,
        verdict,
        message,
        moved: nan,
        orbit_energy: nan,
        contact_change: nan,
        same_sequence: false,
    }
}

/// All datasets, group by group.
pub fn datasets() -> Vec<&'static About> {
    fn of<R>(columns: &'static [Column<R>]) -> impl Iterator<Item = &'static About> {
        columns.iter().map(|c| &c.about)
    }
    let states = of(STATES)
        .chain(of(TRACTIONS))
        .chain(of(FORCES))
        .chain(of(SUPPORTS))
        .chain(of(SPRINGS))
        .chain(of(MOMENTA))
        .chain(of(SLIDING))
        .chain(of(ROTATIONS))
        .chain(of(ENERGY))
        .chain(of(FRICTION));
    let tables = states.chain(of(SWITCHES)).chain(of(GRAZINGS));
    // what runs and families have both is told once
    let is_new = |about: &&'static About| of(GRAZINGS).all(|known| known.path != about.path);
    let tables = tables.chain(of(FAMILY_GRAZINGS).filter(is_new));
    let tables = tables
        .chain(of(FAMILY))
        .chain(of(EXTREMES))
        .chain(of(VISCOUS))
        .chain(of(FRICTION))
        .chain(of(RIDGE))
        .chain(of(BRANCHES));
    let tables = tables.chain(of(SWEEP)).chain(of(SECTIONS)).chain(of(SERIES));
    let mut all: Vec<_> = ONCE.iter().chain(tables).chain(of(CHECKS)).collect();
    // groups in the order of their first rows
    let first: Vec<&str> = all.iter().map(|about| about.place().0).collect();
    all.sort_by_cached_key(|about| first.iter().position(|group| *group == about.place().0));
    all
}

/// The columns of `/switches` with one value a switch.
pub(crate) fn switch_columns() -> impl Iterator<Item = &'static About> {
    SWITCHES.iter().map(|c| &c.about).filter(|about| about.axes.len() == 1)
}
