//! `[contact]`: the obstacle, the contact method and its parameters.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};

use super::coefficient;
use super::counted::Counted;
use super::given::Given;
use super::meeting::{GapKey, Meeting, ProjectionKey, SidesKey};
use super::nodes::{DirectionKey, NodesKey};
use super::number::{Check, finite, length, positive};
use super::portion::{Keys, Portion};
use super::side::{EdgeKey, side};
use super::{
    Activation, BodyKind, BoundaryMass, ContactMethod, Field, Inertia, Instants, Issue,
    METHOD_KEYS, RedistributedMass, Scene, StressKey, Swings, TangentKey,
};

/// `[contact]`, or all tables `[[contact]]`: rigid obstacles and one contact method.
#[derive(Debug, Clone, Default)]
pub struct Contact {
    /// The obstacles, one a table.
    pub obstacles: Vec<Obstacle>,
    /// Written as `[[contact]]`.
    is_list: bool,
    /// What tangential displacements of contact points are like.
    pub tangent: Option<TangentKey>,
    /// File of `N_C` (kind `matrices`), `n_C × n_C` in the order of `displacements`.
    pub n_c: Option<String>,
    /// File of `N_O`, `n_C × n_O`, the other displacements in their order.
    pub n_o: Option<String>,
    /// `G`: consistent or lumped.
    pub boundary_mass: BoundaryMass,
    /// How contact is modelled.
    pub method: ContactMethod,
    /// `nbm`: where the pressure comes from.
    pub stress: Option<StressKey>,
    /// `nbm`: the mass of the phases.
    pub inertia: Option<Inertia>,
    /// `mass-redistribution`: which mass.
    pub mass: Option<RedistributedMass>,
    /// `penalty`: stiffness over `E′/h` (1 by default); of kind `matrices`, and of `stop`, that of a spring.
    pub stiffness: Option<f64>,
    /// `stop`: what its spring is compressed by, 0 by default.
    pub preload: Option<f64>,
    /// `nitsche`: stiffness over `E′/h`, 2 by default.
    pub gamma: Option<f64>,
    /// `nitsche`: 1 (symmetric), 0 or −1.
    pub theta: Option<f64>,
    /// `impact`, `moreau-jean`: `e` in `[0, 1]`, 0 by default.
    pub restitution: Option<f64>,
    /// `moreau-jean`: time step, a tenth of the time of a wave over an element by default.
    pub step: Option<f64>,
    /// `waves`: when contact is decided.
    pub instants: Option<Instants>,
    /// `moreau-jean`: which points are pushed over a step.
    pub activation: Option<Activation>,
    /// Pairs of surfaces: whose inertia along the normals is given up.
    pub sides: Option<SidesKey>,
    /// The obstacles move together: `amplitude cos(ωt + phase)` is added to the gap.
    pub motion: Option<Motion>,
}

/// A rigid obstacle before some sides of the body, or the surface that these meet.
#[derive(Debug, Clone, Default)]
pub struct Obstacle {
    /// The edge of a bar or plate, the group of a mesh; of a pair the slave; empty for kind `matrices`.
    pub group: String,
    /// The sides of another group that it has; none: all of its own.
    pub portion: Option<(String, Portion)>,
    /// The other surface of a pair; none: a rigid obstacle.
    pub meeting: Option<Meeting>,
    /// Distance along the contact direction; what stays of it where it moves.
    pub gap: Option<Field>,
    /// What moves of it in time.
    pub swings: Option<Swings>,
    /// In its place: the obstacle itself.
    pub plane: Option<Plane>,
    /// Distance to a second obstacle behind, against the contact direction.
    pub gap_behind: Option<Field>,
    /// Coulomb's coefficient `μ`.
    pub friction: Option<f64>,
    /// Velocity of the obstacle's surface along itself.
    pub surface: Option<Vec<f64>>,
    /// What faces it of a body of matrices.
    pub given: Given,
}

impl Obstacle {
    /// Coulomb's coefficient, where there is friction.
    pub(crate) fn coefficient(&self) -> Option<f64> {
        self.friction.filter(|mu| *mu > 0.0)
    }

    /// Whether another surface, or other displacements of given matrices, are met.
    pub(super) fn meets(&self) -> bool {
        self.meeting.is_some() || self.given.against.is_some()
    }
}

/// The obstacle fills `normal·x ≥ offset`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Normal, of any length, towards the obstacle.
    pub normal: Vec<f64>,
    /// `normal·x` on its surface.
    pub offset: f64,
}

impl Plane {
    /// Length of its normal.
    pub fn scale(&self) -> f64 {
        self.normal.iter().fold(0.0, |m, n| n.hypot(m))
    }
}

/// One table.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Table {
    /// The edge of a bar or plate.
    edge: Option<EdgeKey>,
    /// The physical group of a mesh, by name, or `"#3"` by tag: of curves, in space of surfaces. One group may turn by 50° at a node; beyond a corner it is another group.
    group: Option<String>,
    /// Only a part of the edge or group (in the plane): between two shares of its length, from the end of lower coordinates; of a mesh in the order of its sides. Sides whose middle lies
    /// there face the obstacle.
    #[schemars(extend("examples" = [[0.9, 1.0]]))]
    from: Option<[f64; 2]>,
    /// In its place: the part in a box along the axes.
    #[schemars(extend("examples" = [[[0.9, 0.0], [1.0, 0.5]]]))]
    r#box: Option<[Vec<f64>; 2]>,
    /// In its place: the part where conditions hold.
    #[schemars(extend("examples" = ["x > 0.9", "0.2 < y < 0.5 and x > 0"]))]
    r#where: Option<String>,
    /// In its place: chosen nodes of the edge or group, by their numbers in the file of the mesh (of plates by those in results, from 0). Contact there has no area: what is
    /// called pressure is a force at each. With nodal reactions and a constant mass, which are then the defaults. Of bodies from matrices, in place of `displacements`: nodes by
    /// their names, or a set of `body.deck`.
    #[schemars(extend("examples" = [[12, 17], "TIP"]))]
    nodes: Option<NodesKey>,
    /// Bodies from matrices with `nodes`: where the obstacle is, `x`, `y`, `z`, with a minus the other way: contact rows count towards it everywhere, in files, loads and probes too. Or a
    /// vector of any length and direction: rows of these nodes are then `101.n`, towards the obstacle, and `101.t` across it (in space `t1`, `t2`), in files and results; loads, probes
    /// and elements that name `101.1` keep to its axis. `normal`: of a set of `body.deck`, at each node the outward normal of its faces.
    #[schemars(extend("examples" = ["x", "-z", [0.6, 0.8, 0.0]]))]
    direction: Option<DirectionKey>,
    /// A pair of surfaces, in place of `edge` or `group`: the group whose nodes are contact nodes, the coarser one, or the one that the other covers.
    #[schemars(extend("examples" = ["block-foot"]))]
    slave: Option<String>,
    /// The group that the slave meets, of the same body or of another part. Displacements stay small: what meets what is decided once.
    #[schemars(extend("examples" = ["plate-top"]))]
    master: Option<String>,
    /// Pairs: how the two meshes are joined. By default `match` where every node of the slave has its partner, else `dual`.
    projection: Option<ProjectionKey>,
    /// Pairs: which surface has no inertia along its normals; one choice for the scene.
    #[schemars(extend("default" = "both"))]
    sides: Option<SidesKey>,
    /// Pairs: the gap may be negative, an interference: parts that were pressed together.
    #[schemars(extend("default" = false))]
    press: Option<bool>,
    /// Distance to the obstacle along the outward normals of the nodes, undeformed; may be 0 or negative. An expression may hold the time `t` inside sines and cosines: a
    /// gap that moves from place to place. Of pairs `"geometry"` (the default): what the meshes leave between
    /// them; where curved surfaces of different meshes are meant to coincide, give 0.
    #[schemars(extend("examples" = [1.0, "1.0 + 0.02*y", "0.36 + 0.1*cos(2*x - 5.0*t)", "geometry"]))]
    gap: Option<GapKey>,
    /// The obstacle itself, in place of `gap` (meshes, bars, plates).
    plane: Option<Plane>,
    /// A second stop: `−gap_behind ≤ u_C ≤ gap`.
    gap_behind: Option<Field>,
    /// Bodies from matrices: gaps, one number a contact displacement, in place of `gap`.
    gaps: Option<Vec<f64>>,
    /// Bodies from matrices: the contact displacements, as rows of the matrices counted from 0, positive towards the obstacle; or by their names, node and direction as their program
    /// writes them. A name with a minus points away from the obstacle: that displacement counts the other way everywhere, in files, loads and probes too.
    #[schemars(with = "Option<Vec<super::names::Row>>", extend("examples" = [[66, 67, 68, 69], ["109.1", "-101.1"]]))]
    displacements: Option<Vec<usize>>,
    /// Bodies from matrices that meet: what each contact displacement is counted against, `u_C = u - sum P_j u_j`: a row (P = 1), or a list of `[row, P]`; negative weights where the
    /// other body's displacement points the other way.
    #[schemars(extend("examples" = [[12, [[13, 0.5], [14, 0.5]]]]))]
    against: Option<Vec<Counted>>,
    /// Coulomb's coefficient of friction μ between the body and this obstacle; absent or 0: none. With nodal reactions and a constant mass, which are
    /// then the defaults of `nbm`; in space only before a `surface` that slides.
    #[serde(default, deserialize_with = "coefficient::one")]
    #[schemars(extend("examples" = [0.3]), range(min = 0.0))]
    friction: Option<f64>,
    /// Velocity of the obstacle's surface along itself (a belt), with `friction`; of pairs that of the master's material past its place (a disc that turns); of bodies from matrices one number, along `tangents`. In space friction acts along
    /// this velocity alone: it is to be larger than those of the body, and where a node comes to rest on the surface the run ends.
    #[schemars(extend("examples" = [[0.0, 0.05]]))]
    surface: Option<Vec<f64>>,
    /// Bodies from matrices with `friction`: the displacements along the obstacle, as rows of the matrices, one a contact displacement. With `nodes` of a body in the plane they follow.
    #[schemars(with = "Option<Vec<super::names::Row>>", extend("examples" = [[1, 3], ["101.2", "102.t"]]))]
    tangents: Option<Vec<usize>>,
    /// Bodies from matrices with `friction` and `against`: what each displacement of `tangents` is counted against, likewise.
    #[schemars(extend("examples" = [[11, 13]]))]
    tangents_against: Option<Vec<Counted>>,
    /// With `friction`: whether displacements along the obstacle keep their mass.
    #[schemars(extend("default" = "inertia"))]
    tangent: Option<TangentKey>,
    /// Bodies from matrices: `N_C` of `λ = N_C u_C + N_O u_O`, `n_C × n_C` in the order of `displacements`; a file, or `FILE.h5:/path`.
    n_c: Option<String>,
    /// Bodies from matrices: `N_O`, `n_C × n_O`, the other displacements in their order.
    n_o: Option<String>,
    /// `nbm` with `stress = "projection"`: how `G`, the mass matrix of the boundary, is integrated.
    #[schemars(extend("default" = "consistent"))]
    boundary_mass: Option<BoundaryMass>,
    /// How contact is modelled; one choice for the body.
    #[schemars(extend("default" = "nbm"))]
    method: Option<ContactMethod>,
    /// `nbm`: where the pressure comes from. By default `projection` on bars and plates, `nodal-mean` on meshes.
    stress: Option<StressKey>,
    /// `nbm`: the mass of the phases. By default `paper` on bars and plates, `constant` on meshes.
    inertia: Option<Inertia>,
    /// `mass-redistribution`: which mass.
    #[schemars(extend("default" = "condensed"))]
    mass: Option<RedistributedMass>,
    /// `penalty`: stiffness κ₀ over `E′/h`; of bodies from matrices that of a spring at each contact displacement (no default). `stop` (no default): pressure over
    /// penetration, of bodies from matrices force over penetration.
    #[schemars(extend("default" = 1.0))]
    stiffness: Option<f64>,
    /// `stop`: the pressure (of bodies from matrices the force) by which its spring is compressed already.
    #[schemars(extend("default" = 0.0), range(min = 0.0))]
    preload: Option<f64>,
    /// `nitsche`: γ₀ over `E′/h`, above a bound that a refusal names.
    #[schemars(extend("default" = 2.0))]
    gamma: Option<f64>,
    /// `nitsche`: 1 (symmetric), 0 or −1; the last two for `run`.
    #[schemars(extend("default" = 1.0, "enum" = [1.0, 0.0, -1.0]))]
    theta: Option<f64>,
    /// `impact`, `moreau-jean`: coefficient of restitution e, from 0 to 1.
    #[schemars(extend("default" = 0.0), range(min = 0.0, max = 1.0))]
    restitution: Option<f64>,
    /// `moreau-jean`: time step; by default a tenth of the time of a wave over an element.
    step: Option<f64>,
    /// `waves`: when contact is decided.
    #[schemars(extend("default" = "exact"))]
    instants: Option<Instants>,
    /// `moreau-jean`: which points are pushed over a step.
    #[schemars(extend("default" = "half-step"))]
    activation: Option<Activation>,
    /// The obstacles move together: `amplitude cos(ωt + phase)` is added to the gap. Displacements are then those seen from the obstacle.
    motion: Option<Motion>,
}

/// The tables of a scene: `[contact]`, or `[[contact]]`.
#[derive(Debug, Clone, Default)]
pub(super) struct Tables {
    all: Vec<Table>,
    is_list: bool,
}

impl JsonSchema for Tables {
    fn schema_name() -> Cow<'static, str> {
        "Contact".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let table = generator.subschema_for::<Table>();
        json_schema!({"anyOf": [table, {"type": "array", "items": table}]})
    }
}

impl<'de> Deserialize<'de> for Tables {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OneOrSeveral;
        impl<'de> Visitor<'de> for OneOrSeveral {
            type Value = Tables;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a table [contact], or tables [[contact]]")
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Tables, A::Error> {
                let table = Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Tables { all: vec![table], is_list: false })
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Tables, A::Error> {
                let mut all = vec![];
                while let Some(table) = seq.next_element()? {
                    all.push(table);
                }
                Ok(Tables { all, is_list: true })
            }
        }
        deserializer.deserialize_any(OneOrSeveral)
    }
}

impl Tables {
    /// The obstacles, and the one method that they share; nothing is said without a table.
    pub(crate) fn merge(self, kind: BodyKind) -> Result<Option<Contact>, Issue> {
        if self.all.is_empty() {
            return Ok(None);
        }
        let motion = self.one("motion", |t| &t.motion)?;
        if let (Some(_), Some(still)) = (&motion, self.all.iter().position(|t| t.motion.is_none()))
        {
            let message = "is missing, and another obstacle moves: they move together";
            return Err(Issue::new(self.key(still, "motion"), message, "give all the same motion"));
        }
        let obstacle = |(k, t): (usize, &Table)| {
            let (group, meeting) = self.faces(kind, k, t)?;
            let portion = self.portion(kind, k, t)?.map(|portion| (group.clone(), portion));
            let group = portion.as_ref().map_or(group, |(group, portion)| portion.name(group));
            let (gap, swings) = match &t.gap {
                Some(GapKey::Given(given)) => (Some(given.still.clone()), given.swings.clone()),
                Some(GapKey::Geometry) if meeting.is_none() => {
                    let message =
                        "\"geometry\" is for pairs of surfaces: a rigid obstacle has none";
                    return Err(Issue::new(self.key(k, "gap"), message, "give a number, or plane"));
                }
                Some(GapKey::Geometry) | None => (None, None),
            };
            let (plane, gap_behind) = (t.plane.clone(), t.gap_behind.clone());
            let (friction, surface) = (t.friction, t.surface.clone());
            let given = Given {
                displacements: t.displacements.clone(),
                // of bodies of elements they are a portion of a group
                nodes: t.nodes.clone().filter(|_| kind == BodyKind::Matrices),
                direction: t.direction.clone(),
                gaps: t.gaps.clone(),
                against: t.against.clone(),
                tangents: t.tangents.clone(),
                tangents_against: t.tangents_against.clone(),
            };
            Ok(Obstacle {
                group,
                portion,
                meeting,
                gap,
                swings,
                plane,
                gap_behind,
                friction,
                surface,
                given,
            })
        };
        Ok(Some(Contact {
            obstacles: self.all.iter().enumerate().map(obstacle).collect::<Result<_, Issue>>()?,
            is_list: self.is_list,
            tangent: self.one("tangent", |t| &t.tangent)?,
            n_c: self.one("n_c", |t| &t.n_c)?,
            n_o: self.one("n_o", |t| &t.n_o)?,
            boundary_mass: self.one("boundary_mass", |t| &t.boundary_mass)?.unwrap_or_default(),
            method: self.one("method", |t| &t.method)?.unwrap_or_default(),
            stress: self.one("stress", |t| &t.stress)?,
            inertia: self.one("inertia", |t| &t.inertia)?,
            mass: self.one("mass", |t| &t.mass)?,
            stiffness: self.one("stiffness", |t| &t.stiffness)?,
            preload: self.one("preload", |t| &t.preload)?,
            gamma: self.one("gamma", |t| &t.gamma)?,
            theta: self.one("theta", |t| &t.theta)?,
            restitution: self.one("restitution", |t| &t.restitution)?,
            step: self.one("step", |t| &t.step)?,
            instants: self.one("instants", |t| &t.instants)?,
            activation: self.one("activation", |t| &t.activation)?,
            sides: self.one("sides", |t| &t.sides)?,
            motion,
        }))
    }

    /// The part of its edge or group that a table is about.
    fn portion(&self, kind: BodyKind, k: usize, t: &Table) -> Result<Option<Portion>, Issue> {
        let nodes = match &t.nodes {
            Some(NodesKey::Numbers(nodes)) if kind != BodyKind::Matrices => Some(&nodes[..]),
            Some(NodesKey::Set(set)) if kind != BodyKind::Matrices => {
                let message = format!("\"{set}\" is a name, and the numbers of nodes are wanted");
                let help = "nodes = [12, 17]; a set of a deck is a group of sides: group = \"…\"";
                return Err(Issue::new(self.key(k, "nodes"), message, help));
            }
            _ => None,
        };
        let keys =
            Keys { from: t.from, r#box: t.r#box.as_ref(), nodes, r#where: t.r#where.as_deref() };
        match Portion::given(&keys, &|name| self.key(k, name))? {
            Some(part) if t.slave.is_some() => {
                let message = "is for rigid obstacles; a slave meets what lies before it";
                let help = "remove the key, or give the part a group of its own in the mesh";
                Err(Issue::new(self.key(k, part.key()), message, help))
            }
            found => Ok(found),
        }
    }

    /// The sides that a table is about, and the surface that they meet in a pair.
    fn faces(
        &self,
        kind: BodyKind,
        k: usize,
        t: &Table,
    ) -> Result<(String, Option<Meeting>), Issue> {
        let issue = |name: &str, message: &str, help: &str| {
            Err(Issue::new(self.key(k, name), message, help))
        };
        let (slave, master) = match (&t.slave, &t.master) {
            (Some(slave), Some(master)) => (slave, master),
            (Some(_), None) => {
                return issue(
                    "master",
                    "is missing",
                    "master = \"…\", the group that the slave meets",
                );
            }
            (None, Some(_)) => {
                return issue(
                    "slave",
                    "is missing",
                    "slave = \"…\", the group that meets the master",
                );
            }
            (None, None) => {
                for (key, given) in
                    [("projection", t.projection.is_some()), ("press", t.press.is_some())]
                {
                    if given {
                        let message = "belongs to a pair of surfaces";
                        return issue(key, message, "remove the key, or give slave and master");
                    }
                }
                let group = match kind {
                    BodyKind::Matrices if t.edge.is_none() && t.group.is_none() => String::new(),
                    _ => side(kind, &self.key(k, ""), t.edge.as_ref(), t.group.as_ref(), "right")?,
                };
                return Ok((group, None));
            }
        };
        if kind == BodyKind::Matrices {
            let message = "needs a body of elements, and this body comes from files";
            return issue("slave", message, "give displacements = [66, 67]");
        }
        for (key, given) in [("edge", t.edge.is_some()), ("group", t.group.is_some())] {
            if given {
                let message = "stands beside slave and master, which name the two surfaces";
                return issue(key, message, "remove the key");
            }
        }
        let press = t.press.unwrap_or(false);
        let meeting = Meeting { master: master.clone(), projection: t.projection, press };
        Ok((slave.clone(), Some(meeting)))
    }

    fn key(&self, table: usize, name: &str) -> String {
        key(self.is_list, table, name)
    }

    /// The value of a key that all tables share: given in any of them, the same in all that give it.
    fn one<T: PartialEq + Clone>(
        &self,
        name: &str,
        of: impl Fn(&Table) -> &Option<T>,
    ) -> Result<Option<T>, Issue> {
        let mut found: Option<&T> = None;
        for (k, table) in self.all.iter().enumerate() {
            match (found, of(table)) {
                (Some(known), Some(other)) if known != other => {
                    let message =
                        "differs from that of another [[contact]]: it is one choice for the body";
                    return Err(Issue::new(self.key(k, name), message, "give it once"));
                }
                (None, Some(value)) => found = Some(value),
                _ => {}
            }
        }
        Ok(found.cloned())
    }
}

/// `contact.gap`, or `contact[1].gap` in a list.
fn key(is_list: bool, table: usize, name: &str) -> String {
    let dot = if name.is_empty() { "" } else { "." };
    match is_list {
        true => format!("contact[{table}]{dot}{name}"),
        false => format!("contact{dot}{name}"),
    }
}

/// The harmonic part of a gap.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Amplitude along the outward normal: away from the body.
    pub amplitude: f64,
    /// Circular frequency.
    pub omega: f64,
    /// Phase, in radians.
    #[serde(default)]
    pub phase: f64,
}

impl Contact {
    /// Whether the pressure is the nodal reaction.
    pub(crate) fn is_reaction(&self) -> bool {
        let by_forces = self.has_friction() || self.takes_forces();
        self.method == ContactMethod::MassRedistribution
            || self.stress == Some(StressKey::Reaction)
            || by_forces && self.stress.is_none()
    }

    /// Whether it asks for forces at nodes, friction aside: pairs, gaps that move, contact by nodes.
    pub fn takes_forces(&self) -> bool {
        self.has_pairs() || self.swings() || self.at_nodes().is_some() || self.by_nodes()
    }

    /// The first obstacle before chosen nodes.
    pub fn at_nodes(&self) -> Option<usize> {
        let chosen = |o: &Obstacle| matches!(o.portion, Some((_, Portion::Nodes(_))));
        self.obstacles.iter().position(chosen)
    }

    /// What contact at chosen nodes goes with.
    fn check_nodes(&self) -> Check {
        let Some(k) = self.at_nodes() else { return Ok(()) };
        let knows =
            matches!(self.method, ContactMethod::NodalBoundary | ContactMethod::MassRedistribution);
        if knows && self.is_reaction() {
            return Ok(());
        }
        let message =
            "has no area, and this method or stress reads pressures: nodal reactions are forces";
        let help = "remove method and stress (their defaults are then \"nbm\" and \"reaction\"), or give method = \"mass-redistribution\"";
        Err(Issue::new(self.key(k, "nodes"), message, help))
    }

    /// Whether a gap moves from place to place.
    pub fn swings(&self) -> bool {
        self.obstacles.iter().any(|o| o.swings.is_some())
    }

    /// Circular frequency of the obstacles' motion, the first of several.
    pub(super) fn omega(&self) -> Option<f64> {
        let swing = || self.obstacles.iter().find_map(|o| o.swings.as_ref()?.omega());
        self.motion.map(|m| m.omega).or_else(swing)
    }

    /// Whether obstacles move in any way.
    pub fn moves(&self) -> bool {
        self.motion.is_some() || self.swings()
    }

    /// What a gap that moves goes with.
    fn check_swings(&self) -> Check {
        let Some(k) = self.obstacles.iter().position(|o| o.swings.is_some()) else { return Ok(()) };
        let is_paper = self.method == ContactMethod::NodalBoundary
            && (!self.is_reaction() || self.inertia == Some(Inertia::Paper));
        let knows =
            matches!(self.method, ContactMethod::NodalBoundary | ContactMethod::MassRedistribution);
        if is_paper || !knows {
            let message = "moves in time from place to place: this goes with contact displacements without mass, whose pressures are nodal reactions";
            let help = "remove method, stress and inertia (their defaults are then \"nbm\", \"reaction\", \"constant\"), or give method = \"mass-redistribution\"";
            return Err(Issue::new(self.key(k, "gap"), message, help));
        }
        if self.motion.is_some() {
            let message = "stands beside a gap that moves in time";
            return Err(Issue::new("contact.motion", message, "write both into gap"));
        }
        if let Some(k) = self.obstacles.iter().position(|o| o.gap_behind.is_some()) {
            let message = "stays where it is, and the obstacle in front moves towards it";
            let help = "remove it, or the time from gap";
            return Err(Issue::new(self.key(k, "gap_behind"), message, help));
        }
        Ok(())
    }

    /// Whether some obstacle has friction.
    pub fn has_friction(&self) -> bool {
        self.obstacles.iter().any(|o| o.coefficient().is_some())
    }

    /// Whether displacements along rough obstacles have no mass.
    pub fn is_massless_along(&self) -> bool {
        self.tangent == Some(TangentKey::Massless) && self.has_friction()
    }

    /// The key of the first coefficient of friction.
    pub(crate) fn friction_key(&self) -> String {
        let first = self.obstacles.iter().position(|o| o.coefficient().is_some());
        self.key(first.unwrap_or(0), "friction")
    }

    /// What friction does not go with.
    fn check_friction(&self, kind: BodyKind) -> Check {
        for (k, o) in self.obstacles.iter().enumerate() {
            if let Some(mu) = o.friction.filter(|mu| !(mu.is_finite() && *mu >= 0.0)) {
                let help = "give Coulomb's coefficient, a number that is not negative";
                return Err(Issue::new(self.key(k, "friction"), format!("is {mu}"), help));
            }
            let Some(velocity) = &o.surface else { continue };
            if o.coefficient().is_none() {
                let message = "is not read without friction";
                return Err(Issue::new(
                    self.key(k, "surface"),
                    message,
                    "remove the key, or give friction",
                ));
            }
            let (wanted, example) = match kind {
                BodyKind::Matrices => (1, "surface = [0.2]"),
                BodyKind::Mesh | BodyKind::Parts if velocity.len() == 3 => {
                    (3, "surface = [0.0, 0.05, 0.0]")
                }
                _ => (2, "surface = [0.0, 0.05]"),
            };
            length(&self.key(k, "surface"), velocity.len(), wanted, example)?;
            velocity.iter().try_for_each(|&v| finite(&self.key(k, "surface"), v))?;
        }
        if self.has_friction() {
            let methods = [ContactMethod::NodalBoundary, ContactMethod::MassRedistribution];
            if !methods.contains(&self.method) {
                let name = self.method.name();
                let message =
                    format!("is not read by method = \"{name}\": it acts on nodal reactions");
                let help = "give method = \"mass-redistribution\", or remove friction";
                return Err(Issue::new(self.friction_key(), message, help));
            }
            if self.is_massless_along() {
                let behind = self.obstacles.iter().any(|o| o.gap_behind.is_some());
                let others = [
                    (self.has_pairs(), "pairs of surfaces"),
                    (behind, "obstacles behind (gap_behind)"),
                    (self.swings() || self.motion.is_some(), "obstacles that move"),
                    (self.at_nodes().is_some() || self.by_nodes(), "contact at chosen nodes"),
                ];
                if let Some((_, what)) = others.iter().find(|o| o.0) {
                    let message = format!("\"massless\" does not go with {what}");
                    let help = "give tangent = \"inertia\": displacements along the obstacle keep their mass";
                    return Err(Issue::new(self.key(0, "tangent"), message, help));
                }
            }
            return Ok(());
        }
        let message = "is not read without friction";
        let unread =
            |key: String| Err(Issue::new(key, message, "remove the key, or give friction"));
        for (k, o) in self.obstacles.iter().enumerate() {
            let of_table = [
                ("tangents", o.given.tangents.is_some()),
                ("tangents_against", o.given.tangents_against.is_some()),
            ];
            if let Some((key, _)) = of_table.iter().find(|key| key.1) {
                return unread(self.key(k, key));
            }
        }
        match self.tangent {
            Some(_) => unread(self.key(0, "tangent")),
            None => Ok(()),
        }
    }

    /// The keys that a method does not read.
    fn check_method(&self) -> Check {
        let is_lumped = self.boundary_mass == BoundaryMass::Lumped;
        let has = |key: &str| match key {
            "stress" => self.stress.is_some(),
            "inertia" => self.inertia.is_some(),
            "boundary_mass" => is_lumped,
            "mass" => self.mass.is_some(),
            "stiffness" => self.stiffness.is_some(),
            "preload" => self.preload.is_some(),
            "gamma" => self.gamma.is_some(),
            "theta" => self.theta.is_some(),
            "restitution" => self.restitution.is_some(),
            "step" => self.step.is_some(),
            "instants" => self.instants.is_some(),
            "activation" => self.activation.is_some(),
            _ => self.obstacles.iter().any(|o| o.gap_behind.is_some()),
        };
        let unread = |k: &&(&str, &[ContactMethod])| has(k.0) && !k.1.contains(&self.method);
        if let Some((key, by)) = METHOD_KEYS.iter().find(unread) {
            let names: Vec<_> = by.iter().map(|m| format!("\"{}\"", m.name())).collect();
            let (name, names) = (self.method.name(), names.join(" and "));
            let message = format!("is not read by method = \"{name}\"; it belongs to {names}");
            return Err(Issue::new(self.key(0, key), message, "remove the key"));
        }
        let is_mean = self.stress == Some(StressKey::NodalMean);
        if (self.is_reaction() || is_mean) && is_lumped {
            let message = "is not read: nodal reactions and means need no boundary mass";
            return Err(Issue::new("contact.boundary_mass", message, "remove the key"));
        }
        self.stiffness.map_or(Ok(()), |k| positive("contact.stiffness", k))?;
        if let Some(p) = self.preload.filter(|p| !(p.is_finite() && *p >= 0.0)) {
            let message = format!("is {p}");
            return Err(Issue::new(
                "contact.preload",
                message,
                "give a number that is not negative",
            ));
        }
        if self.method == ContactMethod::Stop && self.stiffness.is_none() {
            let message = "is missing: what the stop pushes with, over penetration";
            return Err(Issue::new(self.key(0, "stiffness"), message, "stiffness = 100.0"));
        }
        self.gamma.map_or(Ok(()), |k| positive("contact.gamma", k))?;
        self.step.map_or(Ok(()), |k| positive("contact.step", k))?;
        if let Some(e) = self.restitution.filter(|e| !(0.0..=1.0).contains(e)) {
            let message = format!("is {e}");
            return Err(Issue::new("contact.restitution", message, "give a number from 0 to 1"));
        }
        match self.theta {
            None | Some(1.0 | 0.0 | -1.0) => Ok(()),
            Some(theta) => {
                let message = format!("is {theta}");
                Err(Issue::new("contact.theta", message, "give 1 (symmetric), 0 or -1"))
            }
        }
    }

    /// The key of a table: `contact.gap`, or `contact[1].gap`.
    pub fn key(&self, obstacle: usize, name: &str) -> String {
        key(self.is_list, obstacle, name)
    }

    /// Whether contact displacements are among those that move by themselves.
    pub(crate) fn moves_contact(&self) -> bool {
        self.has_springs() || self.has_impacts()
    }

    /// Whether velocities jump by a law of impact.
    pub(crate) fn has_impacts(&self) -> bool {
        use ContactMethod::{Impact, MoreauJean, Waves};
        matches!(self.method, Impact | MoreauJean | Waves)
    }

    /// Whether the obstacle pushes like springs at points of the edge.
    pub(crate) fn has_springs(&self) -> bool {
        matches!(self.method, ContactMethod::Penalty | ContactMethod::Nitsche | ContactMethod::Stop)
    }
}

impl Scene {
    pub(super) fn check_contact(&self) -> Check {
        let Some(c) = &self.contact else { return Ok(()) };
        c.check_method()?;
        c.check_swings()?;
        c.check_nodes()?;
        c.check_friction(self.body.kind)?;
        c.check_pairs()?;
        if self.body.kind == BodyKind::Matrices {
            return self.check_given_contact();
        }
        let of_tables = c.obstacles.iter().enumerate();
        let of_tables = of_tables.filter_map(|(k, o)| Some((k, o.given.first()?)));
        let shared = [
            ("n_c", c.n_c.is_some()),
            ("n_o", c.n_o.is_some()),
            ("stress", matches!(c.stress, Some(StressKey::Terms(_)))),
        ];
        let shared = shared.iter().filter(|key| key.1).map(|key| (0, key.0));
        if let Some((k, key)) = of_tables.chain(shared).next() {
            let message = "belongs to body.kind = \"matrices\"";
            return Err(Issue::new(c.key(k, key), message, "give edge and gap"));
        }
        for (k, obstacle) in c.obstacles.iter().enumerate() {
            self.check_obstacle(obstacle, |name| c.key(k, name))?;
        }
        if let Some(m) = &c.motion {
            finite("contact.motion.amplitude", m.amplitude)?;
            positive("contact.motion.omega", m.omega)?;
            finite("contact.motion.phase", m.phase)?;
        }
        Ok(())
    }

    fn check_obstacle(&self, o: &Obstacle, key: impl Fn(&str) -> String) -> Check {
        let issue =
            |name: &str, message: &str, help: &str| Err(Issue::new(key(name), message, help));
        if let Some((_, portion)) = &o.portion {
            portion.check(self, &key)?;
        }
        match (&o.gap, &o.plane) {
            (None, None) if o.meeting.is_some() => Ok(()),
            (None, None) => issue("gap", "is missing", "gap = 1.0, or an expression of x and y"),
            (Some(_), Some(_)) => issue(
                "plane",
                "stands beside gap: the gap follows from the plane and the mesh",
                "remove one of them",
            ),
            (None, Some(_)) if o.gap_behind.is_some() => issue(
                "plane",
                "stands beside gap_behind, which is measured along the normals of the surface",
                "give gap and gap_behind, or a second [[contact]]",
            ),
            (Some(_), None) => Ok(()),
            (None, Some(plane)) => {
                let example = self.example(["[1.0]", "[1.0, 0.0]", "[1.0, 0.0, 0.0]"]);
                length(&key("plane.normal"), plane.normal.len(), self.dim(), example)?;
                plane.normal.iter().try_for_each(|&n| finite(&key("plane.normal"), n))?;
                finite(&key("plane.offset"), plane.offset)?;
                let size = plane.scale();
                if size == 0.0 {
                    return issue("plane.normal", "has no direction", example);
                }
                positive(&key("plane.normal"), size)
            }
        }
    }
}
