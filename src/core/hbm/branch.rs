//! Families of harmonic-balance solutions, point by point, with all that a file keeps of them.

use std::convert::Infallible;
use std::f64::consts::TAU;

use super::check::Likeness;
use super::extremes::extremes;
use super::multipliers::{AlongSeries, Told};
use super::newton::Settings;
use super::response::{self, Harmonics, Origin, Point, Summary, Track, Walk};
use super::{Balanced, Basis, HbmError, Interface, Series, Solution};
use crate::continuation::{self, Family, Go, Options, Place, Stop};
use crate::orbit::branch::{kind_of, record as orbit_record};
use crate::orbit::search::{Effort, Verdict, find};
use crate::orbit::{Closure, Propagator};
use crate::records::{
    GapReason, OrbitRecord, PlaceRecord, PointKind, PointRecord, SeriesRecord, VerdictKind,
    place_of_function,
};

/// The body of a family.
pub struct BalancedBody {
    /// For harmonic balance.
    pub balanced: Box<dyn Balanced>,
    /// For shooting from every solution, which gives the stability of the orbit there; none: nothing is shot.
    pub shooter: Option<Propagator>,
}

/// Coefficients of `u_O` in the order of files.
fn series_record(s: &Solution, u: &Series) -> SeriesRecord {
    let (n, n_h) = (u.n, u.n_h);
    let mut coefficients = vec![0.0; (2 * n_h + 1) * n];
    for (i, function) in u.basis.functions(n_h).into_iter().enumerate() {
        let f = place_of_function(function);
        coefficients[f * n..(f + 1) * n].copy_from_slice(u.of(i));
    }
    SeriesRecord { omega: s.omega, n_h, coefficients, alpha: None }
}

/// A solution of displacements `u` in the time domain as a file keeps it.
pub(super) fn record(
    interface: &Interface,
    s: &Solution,
    u: &Series,
) -> Result<OrbitRecord, HbmError> {
    record_of(interface, s, u, &Summary::along(interface, s, u))
}

/// The same of a summary that is known.
pub(super) fn record_of(
    interface: &Interface,
    s: &Solution,
    u: &Series,
    summary: &Summary,
) -> Result<OrbitRecord, HbmError> {
    let system = &interface.system;
    let (u0, v0) = s.state(u, 0.0, 0).full(system)?;
    let (u0, v0) = (system.body.nodal(&u0).into_owned(), system.body.nodal(&v0).into_owned());
    let node = |c: usize| system.constraints[c].node;
    Ok(OrbitRecord {
        period: TAU / s.omega,
        energy: summary.energy,
        amplitude: summary.amplitude,
        residual: s.residual,
        contact_time: summary.contact_time,
        grazing: f64::NAN,
        jumps: vec![f64::NAN; summary.switches.len()],
        switches: summary.switches.iter().map(|&(t, c, kind)| (t, node(c), kind)).collect(),
        u0,
        v0,
        extremes: extremes(interface, s, u),
        ..OrbitRecord::default()
    })
}

/// A solution as a point, with the stability of the orbit shot from it if that is asked for.
fn point(
    body: &dyn Balanced,
    shooter: Option<&mut Propagator>,
    s: &Solution,
    kind: PointKind,
) -> Result<PointRecord, HbmError> {
    let u = body.displacements(s)?;
    let orbit = record(body.interface(), s, &u)?;
    let closure = if s.q.basis == Basis::Cosine { Closure::Reversible } else { Closure::FORCED };
    let shooter = shooter.map(|body| (body, closure));
    let mut fewer = |n_h: usize| -> Result<Option<Told>, HbmError> {
        let found = body.solve(&s.q.with_harmonics(n_h), s.omega, &Settings::default())?;
        let Ok(solution) = found else { return Ok(None) };
        let displacements = body.displacements(&solution)?;
        Ok(Some(Told { solution, displacements, alpha: None }))
    };
    confirmed(shooter, (s, &u, None), (orbit, kind), &mut fewer)
}

/// A solution as a point: with the multipliers of the orbit that is shot from it (and from its `α`), if that is asked for; where there is none near, with those
/// along the series, whose error the solutions with `fewer` harmonics tell.
pub(super) fn confirmed(
    shooter: Option<(&mut Propagator, Closure)>,
    (s, u, alpha): (&Solution, &Series, Option<f64>),
    (mut orbit, kind): (OrbitRecord, PointKind),
    fewer: &mut dyn FnMut(usize) -> Result<Option<Told>, HbmError>,
) -> Result<PointRecord, HbmError> {
    let mut special = kind;
    if let Some((body, closure)) = shooter {
        let mut guess = body.frame(&s.state(u, 0.0, 0));
        guess.truncate(closure.sizes(body.n()).1);
        guess.extend(alpha);
        let effort = Effort { rescue: false, ..Effort::of(closure) };
        let verdict = find(body, closure, &guess, s.omega, &effort)?;
        let (kind, known) = examined(body, &verdict, &guess, &s.sequence())?;
        orbit.no_orbit_near = matches!(kind, PointKind::NoOrbitNear(_));
        if let Some(known) = known {
            orbit.stable = known.stable;
            orbit.multipliers = known.multipliers;
            orbit.trivial = known.trivial;
        } else if orbit.no_orbit_near
            && let Some(known) = AlongSeries::new((body, closure), (s, u, alpha), fewer)?
        {
            orbit.multipliers = known.stability.pairs();
            orbit.trivial = known.stability.trivial;
            orbit.multipliers_within = Some(known.error);
        }
        if special == PointKind::Regular {
            special = kind;
        }
    }
    if s.undecided > 0 && special == PointKind::Regular {
        special = PointKind::Undecided(s.undecided);
    }
    let series = Some(SeriesRecord { alpha, ..series_record(s, u) });
    Ok(PointRecord {
        omega: s.omega,
        special,
        orbit: Some(orbit),
        series,
        ..PointRecord::default()
    })
}

/// What the orbit that was shot from a solution makes of its point, and its record, if it is the one that the solution approximates and its multipliers
/// are known. Those of another orbit say nothing of the series.
fn examined(
    body: &Propagator,
    verdict: &Verdict,
    guess: &[f64],
    sequence: &[(usize, bool)],
) -> Result<(PointKind, Option<OrbitRecord>), HbmError> {
    let Some(orbit) = verdict.orbit() else {
        return Ok((PointKind::NoOrbitNear(verdict.kind()), None));
    };
    if !Likeness::new(orbit, orbit.closure.frame(guess), sequence).is_near() {
        return Ok((PointKind::NoOrbitNear(VerdictKind::AnotherOrbit), None));
    }
    Ok(match orbit.stability {
        Some(_) => (PointKind::Regular, Some(orbit_record(body, orbit)?)),
        None => (PointKind::NotExamined, None),
    })
}

/// What a point of a sequential continuation is.
fn kind_of_point(p: &Point) -> PointKind {
    match (&p.solution, p.jumped, p.origin) {
        (Err(failure), ..) => PointKind::Gap(failure.clone()),
        (Ok(_), true, _) => PointKind::Jump,
        (Ok(_), false, Origin::Started) => PointKind::Start,
        (Ok(_), false, _) => PointKind::Regular,
    }
}

/// Where a sequential continuation stands: the solution in the coordinates of its body if there is one, the frequency, and the solution of one
/// harmonic that the ladder began with (which may have stood all the same).
fn sequential_place(p: &Point) -> Option<PlaceRecord> {
    let base = p.base.as_ref().map(|q| q.a.clone());
    let found = p.solution.as_ref().ok().map(|s| &s.q.a[..]);
    if found.is_none() && base.is_none() {
        return None;
    }
    let x = found.unwrap_or_default().iter().copied().chain([p.omega]).collect();
    Some(PlaceRecord { x, base: base.unwrap_or_default(), ..PlaceRecord::default() })
}

/// The series of a place.
fn series_of_place(basis: Basis, n_h: usize, n: usize, a: &[f64]) -> Option<Series> {
    let mut q = Series::zeros(basis, n_h, n);
    (a.len() == q.a.len()).then(|| {
        q.a.copy_from_slice(a);
        q
    })
}

/// What the points of an earlier run let the continuation know, in the order of the walk.
fn tracks_of(body: &dyn Balanced, harmonics: &[usize], known: &[&PointRecord]) -> Vec<Track> {
    let mut tracks = vec![Track::default(); harmonics.len() + 1];
    let (basis, n) = (body.interface().basis, body.components());
    for p in known {
        let Some(place) = &p.place else { continue };
        let (a, omega) = place.x.split_at(place.x.len().saturating_sub(1));
        let &[omega] = omega else { continue };
        let Some(&n_h) = harmonics.get(p.branch) else { continue };
        if p.branch == 0
            && let Some(base) = series_of_place(basis, 1, n, &place.base)
        {
            tracks[0].push(omega, base);
        }
        if let Some(q) = series_of_place(basis, n_h, n, a) {
            tracks[p.branch + 1].push(omega, q);
        }
    }
    tracks
}

/// What a sequential continuation computes at each frequency.
pub struct Sequential<'a> {
    /// Frequencies, in order.
    pub grid: &'a [f64],
    /// Numbers of harmonics, ascending: a branch each.
    pub harmonics: &'a [usize],
    /// Newton's settings.
    pub settings: &'a Settings,
    /// Solutions that another walk over the same frequencies found: where this one loses its branch, it goes on with them.
    pub aside: &'a [PointRecord],
}

/// Sequential continuation, all numbers of harmonics at each frequency. `known` are the points of an earlier part.
pub fn sequential(
    body: &mut BalancedBody,
    plan: &Sequential,
    known: &[&PointRecord],
    mut take: impl FnMut(PointRecord) -> Go,
) -> Result<(), HbmError> {
    let BalancedBody { balanced, shooter } = body;
    let mut tracks = tracks_of(balanced.as_ref(), plan.harmonics, known);
    let mut branches = (0..plan.harmonics.len()).cycle();
    let mut failed = None;
    let each = |body: &dyn Balanced, p: Point| {
        let branch = branches.next().unwrap_or_default();
        let kind = kind_of_point(&p);
        let record = match &p.solution {
            Ok(s) => point(body, shooter.as_mut(), s, kind),
            Err(_) => Ok(PointRecord { omega: p.omega, special: kind, ..PointRecord::default() }),
        };
        match record {
            Ok(record) => take(PointRecord { branch, place: sequential_place(&p), ..record }),
            Err(e) => {
                failed = Some(e);
                Go::Break(())
            }
        }
    };
    let Sequential { grid, harmonics, settings, aside } = *plan;
    let what = (balanced.interface().basis, balanced.components());
    let elsewhere = |n_h: usize, omega: f64| {
        let is_there = |p: &&PointRecord| (p.omega / omega - 1.0).abs() < 1e-9;
        let places = aside.iter().filter(is_there).filter_map(|p| p.place.as_ref());
        let mut series =
            places.filter_map(|p| series_of_place(what.0, n_h, what.1, p.x.split_last()?.1));
        series.next()
    };
    let walk = Walk { elsewhere: &elsewhere, ..Walk::new(harmonics, grid, settings) };
    response::sequential(balanced.as_mut(), &walk, &mut tracks, each)?;
    failed.map_or(Ok(()), Err)
}

/// The solution that a branch by arclength starts from: the linear response (forced), or the first one that is found.
pub fn first_solution(
    body: &mut dyn Balanced,
    n_h: usize,
    omega: f64,
) -> Result<Option<Solution>, HbmError> {
    body.set_frequency(omega);
    let settings = Settings::default();
    if body.interface().basis == Basis::Full {
        return Ok(body.solve(&response::at_rest(body, n_h), omega, &settings)?.ok());
    }
    let mut found = None;
    let mut tracks = vec![Track::default(); 2];
    let (harmonics, grid) = ([n_h], [omega]);
    let walk = Walk::new(&harmonics, &grid, &settings);
    response::sequential(body, &walk, &mut tracks, |_, p| {
        found = p.solution.ok();
        Go::Continue(())
    })?;
    Ok(found)
}

/// Where a continuation stands, as a file keeps it.
fn place_record(place: &Place<()>) -> PlaceRecord {
    PlaceRecord {
        x: place.x.clone(),
        tangent: place.tangent.clone(),
        step: place.step,
        orientation: place.orientation,
        signature: place.signature.clone(),
        ..PlaceRecord::default()
    }
}

/// The place that a file kept, if it is one of this body's with `n_h` harmonics.
pub fn place_of(interface: &Interface, n_h: usize, record: &PlaceRecord) -> Option<Place<()>> {
    place_with(interface.basis.len(n_h) * interface.rank() + 1, record)
}

/// The place that a file kept, if it has so many unknowns.
pub(super) fn place_with(unknowns: usize, record: &PlaceRecord) -> Option<Place<()>> {
    let fits = record.x.len() == unknowns && record.tangent.len() == unknowns;
    fits.then(|| Place {
        x: record.x.clone(),
        tangent: record.tangent.clone(),
        step: record.step,
        chart: (),
        orientation: record.orientation,
        signature: record.signature.clone(),
    })
}

/// Where a branch begins.
pub enum Start<S = Solution> {
    /// At a solution, towards growing (`> 0`) or falling frequency.
    Solution(Box<S>, f64),
    /// Where an earlier continuation stood.
    Place(Place<()>),
}

/// Follow a family of `n_h` harmonics by arclength (or, with `natural`, by frequency).
pub fn arclength(
    body: &mut BalancedBody,
    n_h: usize,
    start: Start,
    options: &Options,
    take: impl FnMut(PointRecord) -> Go,
) -> Result<Option<Stop>, HbmError> {
    let BalancedBody { balanced, shooter } = body;
    let mut family = Harmonics { body: balanced.as_mut(), n_h };
    let begin = match start {
        Start::Place(place) => Begin::Place(place),
        Start::Solution(solution, direction) => {
            Begin::At(Harmonics::unknowns(&solution), direction)
        }
    };
    let record = |family: &mut Harmonics, x: &[f64], kind| match family.solution(x)? {
        Ok(solution) => point(family.body, shooter.as_mut(), &solution, kind),
        Err(failure) => Ok(without(x[x.len() - 1], kind, &failure)),
    };
    along(&mut family, begin, options, record, take)
}

/// A point of a branch that is no solution of the contact problem: what happens to the branch there, else why.
pub(super) fn without(omega: f64, kind: PointKind, failure: &GapReason) -> PointRecord {
    let special = if kind.is_event() { kind } else { PointKind::Gap(failure.clone()) };
    PointRecord { omega, special, ..PointRecord::default() }
}

/// Where a branch begins, in the unknowns of its family.
pub(super) enum Begin {
    /// Where an earlier continuation stood.
    Place(Place<()>),
    /// At a solution, towards growing (`> 0`) or falling frequency.
    At(Vec<f64>, f64),
}

/// Follow a family of series; `record` makes a point of its unknowns.
pub(super) fn along<F: Family<Chart = (), Border = Infallible, Error = HbmError>>(
    family: &mut F,
    begin: Begin,
    options: &Options,
    mut record: impl FnMut(&mut F, &[f64], PointKind) -> Result<PointRecord, HbmError>,
    mut take: impl FnMut(PointRecord) -> Go,
) -> Result<Option<Stop>, HbmError> {
    let place = match begin {
        Begin::Place(place) => place,
        Begin::At(x, direction) => match Place::start(family, x, direction, options.step.0)? {
            Some(place) => place,
            None => return Ok(None),
        },
    };
    let mut failed = None;
    let stop = continuation::follow(family, place, options, |family, p| {
        // a special point inside a step is no place to go on from: the step is made anew
        let place = p.special.is_none().then(|| place_record(&p.place));
        let kind =
            p.special.as_ref().map_or(PointKind::Regular, |s| kind_of(s, |b, _| match *b {}));
        match record(family, &p.x, kind) {
            Ok(record) => take(PointRecord { place, ..record }),
            Err(e) => {
                failed = Some(e);
                Go::Break(())
            }
        }
    })?;
    failed.map_or(Ok(Some(stop)), Err)
}
