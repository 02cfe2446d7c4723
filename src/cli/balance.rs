//! Harmonic balance behind `backbone --method hbm` and `response --method hbm`.

use clap::{Args, ValueEnum};

use signorini::continuation::{self, Go, Options, Place};
use signorini::hbm::newton::{Failure, Settings, solve};
use signorini::hbm::response::{Harmonics, Origin, Point, Summary, Track, sequential};
use signorini::hbm::{Basis, Form, HbmError, Quadrature, Reduction, Series, Solution};
use signorini::orbit::branch::kind_of;
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::records::{
    Branch, BranchEnd, EndReason, GapReason, Grid, OrbitRecord, PlaceRecord, PointKind,
    PointMethod, PointRecord, SeriesRecord, place_of_function,
};
use signorini::scenario::Scene;

use super::family::{self, Known, Legs};
use super::{CliError, load};

/// How families are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// In time, by shooting: true orbits
    Shooting,
    /// By harmonic balance: approximations
    Hbm,
}

/// What is projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FormName {
    /// The balance of forces, as in the paper of Urman and Legrand
    Force,
    /// The equation solved for the acceleration: converges faster
    Acceleration,
}

/// Options of harmonic balance.
#[derive(Debug, Clone, Args)]
pub struct Arguments {
    /// Shooting, or harmonic balance
    #[arg(long, value_enum, default_value_t = Method::Shooting)]
    pub method: Method,
    /// Harmonic balance: numbers of harmonics [default: that of [orbit], or 15]
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub harmonics: Option<Vec<usize>>,
    /// Harmonic balance: what is projected
    #[arg(long, value_enum, default_value_t = FormName::Force)]
    pub form: FormName,
    /// Harmonic balance: sample the period this often (AFT) instead of resolving the switches; an approximation
    #[arg(long, value_name = "SAMPLES")]
    pub aft: Option<usize>,
    /// Harmonic balance: shoot from every point, and give the stability of the orbit that is found
    #[arg(long)]
    pub shoot: bool,
}

impl Arguments {
    /// The numbers of harmonics, ascending.
    pub fn list(&self, scene: &Scene) -> Result<Vec<usize>, CliError> {
        let of_scene = scene.orbit.as_ref().and_then(|o| o.harmonics);
        let mut list = self.harmonics.clone().unwrap_or_else(|| vec![of_scene.unwrap_or(15)]);
        list.sort_unstable();
        list.dedup();
        match list.first() {
            None | Some(0) => Err(CliError::Input(
                "--harmonics: give numbers from 1, for example 1,3,7,15".into(),
            )),
            _ if list.iter().any(|n| *n > 500) => {
                Err(CliError::Input("--harmonics: at most 500".into()))
            }
            _ => Ok(list),
        }
    }

    /// Refuse options of harmonic balance where it is not asked for.
    pub fn check_method(&self) -> Result<(), CliError> {
        let given = [
            ("--harmonics", self.harmonics.is_some()),
            ("--aft", self.aft.is_some()),
            ("--shoot", self.shoot),
            ("--form", self.form != FormName::Force),
        ];
        match given.iter().find(|(_, given)| *given && self.method != Method::Hbm) {
            Some((name, _)) => Err(CliError::Input(format!("{name} goes with --method hbm"))),
            None => Ok(()),
        }
    }

    /// Newton's settings.
    pub fn settings(&self) -> Result<Settings, CliError> {
        let quadrature = match self.aft {
            None => Quadrature::EventResolved,
            Some(n) if (8..=1_000_000).contains(&n) => Quadrature::Sampled(n),
            Some(n) => {
                return Err(CliError::Input(format!("--aft {n}: give 8 to 1000000 samples")));
            }
        };
        Ok(Settings { quadrature, ..Settings::default() })
    }

    fn reduction(&self, system: signorini::contact::System) -> Result<Reduction, CliError> {
        let form = match self.form {
            FormName::Force => Form::Force,
            FormName::Acceleration => Form::Acceleration,
        };
        Reduction::new(system, form).map_err(numerics)
    }

    /// How a point is computed, for the file.
    pub fn method(&self) -> PointMethod {
        match self.method {
            Method::Shooting => PointMethod::Shooting,
            Method::Hbm => PointMethod::HarmonicBalance {
                acceleration: self.form == FormName::Acceleration,
                samples: self.aft,
                shot: self.shoot,
            },
        }
    }
}

fn numerics(e: HbmError) -> CliError {
    CliError::Numerics(e.to_string())
}

/// Coefficients of `u_O` in the order of files.
fn series_record(reduction: &Reduction, s: &Solution) -> SeriesRecord {
    let n = reduction.n();
    let n_h = s.q.n_h;
    let mut coefficients = vec![0.0; (2 * n_h + 1) * n];
    for (i, function) in s.q.basis.functions(n_h).into_iter().enumerate() {
        let f = place_of_function(function);
        let state = reduction.state(s.q.of(i), &vec![0.0; n], 1.0);
        coefficients[f * n..(f + 1) * n].copy_from_slice(&state.u);
    }
    SeriesRecord { omega: s.omega, n_h, coefficients }
}

fn orbit_record(reduction: &Reduction, s: &Solution) -> Result<OrbitRecord, CliError> {
    let system = &reduction.system;
    let summary = Summary::new(reduction, s).map_err(numerics)?;
    let (q, dq) = s.q.at(0.0);
    let state = reduction.state(&q, &dq, s.omega);
    let (u0, v0) = state.full(system).map_err(|e| CliError::Numerics(e.to_string()))?;
    let node = |c: usize| system.body.dofs.contact_nodes[c];
    Ok(OrbitRecord {
        period: Reduction::period(s.omega),
        energy: summary.energy,
        amplitude: summary.amplitude,
        residual: s.residual,
        contact_time: summary.contact_time,
        grazing: f64::NAN,
        jumps: vec![f64::NAN; summary.switches.len()],
        switches: summary.switches.iter().map(|&(t, c, closes)| (t, node(c), closes)).collect(),
        u0,
        v0,
        ..OrbitRecord::default()
    })
}

/// A solution as a point, with the stability of the orbit shot from it if that is asked for.
fn point(
    reduction: &Reduction,
    s: &Solution,
    special: PointKind,
    shooter: Option<&mut Propagator>,
) -> Result<PointRecord, CliError> {
    let mut orbit = orbit_record(reduction, s)?;
    let mut special = special;
    if let Some(body) = shooter {
        let closure =
            if s.q.basis == Basis::Cosine { Closure::Reversible } else { Closure::Forced };
        let (q, dq) = s.q.at(0.0);
        let z = body.frame(&reduction.state(&q, &dq, s.omega));
        let effort = Effort { rescue: false, ..Effort::default() };
        let verdict = find(body, closure, &z[..closure.unknowns(body.n())], s.omega, &effort)
            .map_err(|e| CliError::Numerics(e.to_string()))?;
        match verdict.orbit().and_then(|o| o.stability.as_ref()) {
            Some(stability) => {
                orbit.stable = Some(stability.is_stable());
                orbit.multipliers = stability.multipliers.iter().map(|m| [m.0, m.1]).collect();
                orbit.trivial = stability.trivial;
            }
            None if special == PointKind::Regular => {
                special = PointKind::NoOrbitNear(verdict.kind());
            }
            None => {}
        }
    }
    if s.undecided > 0 && special == PointKind::Regular {
        special = PointKind::Undecided(s.undecided);
    }
    let series = Some(series_record(reduction, s));
    Ok(PointRecord {
        omega: s.omega,
        special,
        orbit: Some(orbit),
        series,
        ..PointRecord::default()
    })
}

/// Why there is no solution, as a file keeps it.
fn gap_reason(failure: &Failure) -> GapReason {
    match *failure {
        Failure::NotConverged { residual, iterations } => {
            GapReason::NotConverged { residual, iterations }
        }
        Failure::NoContact => GapReason::NoContact,
        Failure::Inadmissible { theta } => GapReason::Inadmissible { theta },
        Failure::NoStart => GapReason::NoStart,
    }
}

/// The branches of a sequential continuation.
pub fn branches(harmonics: &[usize]) -> Vec<Branch> {
    harmonics.iter().map(|&harmonics| Branch::Series { harmonics, direction: None }).collect()
}

/// Where a sequential continuation stands: the solution in modal coordinates, and what its ladder began with.
fn place_record(p: &Point, s: &Solution) -> PlaceRecord {
    PlaceRecord {
        x: s.q.a.iter().copied().chain([p.omega]).collect(),
        base: p.base.as_ref().map_or(vec![], |q| q.a.clone()),
        ..PlaceRecord::default()
    }
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
fn tracks_of(reduction: &Reduction, harmonics: &[usize], known: &[&PointRecord]) -> Vec<Track> {
    let mut tracks = vec![Track::default(); harmonics.len() + 1];
    let (basis, n) = (reduction.basis, reduction.n());
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

/// Sequential continuation over a grid, all numbers of harmonics at once. `known` are the points of an earlier run.
pub fn sequence(
    arguments: &Arguments,
    scene: &Scene,
    (grid, range, downwards): (Grid, (f64, f64), bool),
    known: &[&PointRecord],
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<BranchEnd, CliError> {
    let problem = load::of_scene(scene)?;
    family::closure(scene, &problem)?;
    let harmonics = arguments.list(scene)?;
    let settings = arguments.settings()?;
    let mut shooter = match arguments.shoot {
        true => Some(family::propagator(load::of_scene(scene)?.system)?),
        false => None,
    };
    let mut reduction = arguments.reduction(problem.system)?;
    let mut failure = None;
    let mut interrupted = false;
    let legs = Legs::new(grid, range, downwards, known);
    for (places, before) in legs.each(known) {
        let mut tracks = tracks_of(&reduction, &harmonics, &before);
        let frequencies = legs.frequencies(places);
        let mut count = 0;
        let each = |reduction: &Reduction, p: Point| {
            let branch = count % harmonics.len();
            let index = places[count / harmonics.len()];
            count += 1;
            let record = match &p.solution {
                Err(e) => Ok(PointRecord {
                    omega: p.omega,
                    special: PointKind::Gap(gap_reason(e)),
                    // the ladder may have stood all the same
                    place: p.base.as_ref().map(|base| PlaceRecord {
                        x: vec![p.omega],
                        base: base.a.clone(),
                        ..PlaceRecord::default()
                    }),
                    ..PointRecord::default()
                }),
                Ok(s) => point(reduction, s, special(&p), shooter.as_mut())
                    .map(|record| PointRecord { place: Some(place_record(&p, s)), ..record }),
            };
            match record {
                Ok(record) => {
                    interrupted = take(PointRecord { branch, index, ..record }).is_break();
                    if interrupted { Go::Break(()) } else { Go::Continue(()) }
                }
                Err(e) => {
                    failure = Some(e);
                    Go::Break(())
                }
            }
        };
        sequential(&mut reduction, &harmonics, &frequencies, &settings, &mut tracks, each)
            .map_err(numerics)?;
        if interrupted || failure.is_some() {
            break;
        }
    }
    if let Some(e) = failure {
        return Err(e);
    }
    let all = grid.within(range).count();
    let text = format!("{all} frequencies, {} numbers of harmonics", harmonics.len());
    let reason = if interrupted { EndReason::Interrupted } else { EndReason::Range };
    Ok(family::ended(0, reason, text, !interrupted))
}

fn special(p: &Point) -> PointKind {
    match (p.jumped, p.origin) {
        (true, _) => PointKind::Jump,
        (false, Origin::Started) => PointKind::Start,
        _ => PointKind::Regular,
    }
}

/// The solution that a branch by arclength starts from: the linear response (forced), or the first one that is found.
fn first_solution(
    reduction: &mut Reduction,
    n_h: usize,
    from: f64,
) -> Result<Option<Solution>, CliError> {
    reduction.set_frequency(from);
    let settings = Settings::default();
    if reduction.basis == Basis::Full {
        let zero = Series::zeros(Basis::Full, n_h, reduction.n());
        return Ok(solve(reduction, &zero, from, &settings).map_err(numerics)?.ok());
    }
    let mut found = None;
    let mut tracks = vec![Track::default(); 2];
    sequential(reduction, &[n_h], &[from], &settings, &mut tracks, |_, p| {
        found = p.solution.ok();
        Go::Continue(())
    })
    .map_err(numerics)?;
    Ok(found)
}

/// A branch by arclength.
pub fn arclength(
    arguments: &Arguments,
    scene: &Scene,
    (n_h, from, direction): (usize, f64, f64),
    options: Options,
    (index, known): (usize, &Known),
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<BranchEnd, CliError> {
    let problem = load::of_scene(scene)?;
    let mut shooter = match arguments.shoot {
        true => Some(family::propagator(load::of_scene(scene)?.system)?),
        false => None,
    };
    let mut reduction = arguments.reduction(problem.system)?;
    if reduction.is_free() {
        let message = "harmonic balance by arclength has the interface as its unknowns, which does not hold a body that can move rigidly: leave \
                       --follow arclength out, or shoot";
        return Err(CliError::Input(message.into()));
    }
    family::go_on(index, known, options, true, take, |place, options, take| {
        let unknowns = reduction.basis.len(n_h) * reduction.q.ncols();
        let place = match place {
            Some(p) if p.x.len() != unknowns + 1 || p.tangent.len() != unknowns + 1 => {
                let message = "the place that the earlier run left does not fit the body: damaged";
                return Err(CliError::Input(message.into()));
            }
            Some(p) => Place {
                x: p.x.clone(),
                tangent: p.tangent.clone(),
                step: p.step,
                chart: (),
                orientation: p.orientation,
                signature: p.signature.clone(),
            },
            None => {
                let Some(start) = first_solution(&mut reduction, n_h, from)? else {
                    return Ok(Err(format!("no solution to start from at omega = {from}")));
                };
                let mut family = Harmonics { reduction: &mut reduction, n_h };
                let x = family.unknowns(&start).map_err(numerics)?;
                let place = Place::start(&mut family, x, direction, options.step.0);
                match place.map_err(numerics)? {
                    Some(place) => place,
                    None => return Ok(Err("the first tangent could not be computed".into())),
                }
            }
        };
        let mut family = Harmonics { reduction: &mut reduction, n_h };
        let mut failure = None;
        let stop = continuation::follow(&mut family, place, options, |family, p| {
            let special = p.special.as_ref().map_or(PointKind::Regular, kind_of);
            // a special point inside a step is no place to go on from: the step is made anew
            let place = p.special.is_none().then(|| PlaceRecord {
                x: p.place.x.clone(),
                tangent: p.place.tangent.clone(),
                step: p.place.step,
                orientation: p.place.orientation,
                signature: p.place.signature.clone(),
                ..PlaceRecord::default()
            });
            let record = family
                .solution(&p.x)
                .map_err(numerics)
                .and_then(|s| point(family.reduction, &s, special, shooter.as_mut()));
            match record {
                Ok(record) => take(PointRecord { place, ..record }),
                Err(e) => {
                    failure = Some(e);
                    Go::Break(())
                }
            }
        })
        .map_err(numerics)?;
        match failure {
            Some(e) => Err(e),
            None => Ok(Ok(stop)),
        }
    })
}
