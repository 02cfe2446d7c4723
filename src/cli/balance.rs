//! Harmonic balance behind `backbone --method hbm` and `response --method hbm`.

use clap::{Args, ValueEnum};

use signorini::continuation::{self, Go, Options, Place, Special, Stop};
use signorini::hbm::newton::{Settings, solve};
use signorini::hbm::response::{Harmonics, Origin, Point, Summary, Track, sequential};
use signorini::hbm::{Basis, Form, HbmError, Quadrature, Reduction, Series, Solution};
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::scenario::Scene;
use signorini::store::{OrbitRecord, PointRecord, SeriesRecord, StoredFamily, place_of_function};

use super::family::{self, Ended};
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
    /// The balance of forces, as the seed's paper has it
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
            Some(n) if n >= 8 => Quadrature::Sampled(n),
            Some(n) => return Err(CliError::Input(format!("--aft {n}: give at least 8 samples"))),
        };
        Ok(Settings { quadrature, ..Settings::default() })
    }

    fn reduction(&self, nbm: signorini::contact::Nbm) -> Result<Reduction, CliError> {
        let form = match self.form {
            FormName::Force => Form::Force,
            FormName::Acceleration => Form::Acceleration,
        };
        Reduction::new(nbm, form).map_err(numerics)
    }

    /// Words for the file.
    pub fn kind(&self) -> String {
        let form = if self.form == FormName::Force { "force form" } else { "acceleration form" };
        let aft = self.aft.map_or(String::new(), |n| format!(", {n} samples"));
        format!("{form}{aft}")
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

/// Modal series of stored coefficients.
pub fn series_of(reduction: &Reduction, record: &SeriesRecord) -> Series {
    let n = reduction.n();
    let mut q = Series::zeros(reduction.basis, record.n_h, n);
    for (i, function) in reduction.basis.functions(record.n_h).into_iter().enumerate() {
        let f = place_of_function(function);
        q.of_mut(i).copy_from_slice(&reduction.modal(&record.coefficients[f * n..(f + 1) * n]));
    }
    q
}

fn orbit_record(reduction: &Reduction, s: &Solution) -> Result<OrbitRecord, CliError> {
    let nbm = &reduction.nbm;
    let summary = Summary::new(reduction, s).map_err(numerics)?;
    let (q, dq) = s.q.at(0.0);
    let state = reduction.state(&q, &dq, s.omega);
    let (u0, v0) = state.full(nbm).map_err(|e| CliError::Numerics(e.to_string()))?;
    let node = |c: usize| nbm.body.dofs.contact_nodes[c];
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
    special: String,
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
            None if special == "regular" => special = format!("no orbit near: {}", verdict.word()),
            None => {}
        }
    }
    let series = Some(series_record(reduction, s));
    Ok(PointRecord { omega: s.omega, branch: 0, special, orbit: Some(orbit), place: None, series })
}

/// Names of the branches of a sequential continuation.
pub fn names(harmonics: &[usize]) -> Vec<String> {
    harmonics.iter().map(|n| format!("N_h = {n}")).collect()
}

/// Sequential continuation over a grid, all numbers of harmonics at once.
pub fn sequence(
    arguments: &Arguments,
    scene: &Scene,
    grid: &[f64],
    stored: Option<&StoredFamily>,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Ended, CliError> {
    let problem = load::of_scene(scene)?;
    family::closure(scene, &problem)?;
    let harmonics = arguments.list(scene)?;
    let settings = arguments.settings()?;
    let mut shooter = match arguments.shoot {
        true => Some(family::propagator(load::of_scene(scene)?.nbm)?),
        false => None,
    };
    let mut reduction = arguments.reduction(problem.nbm)?;
    let mut tracks = vec![Track::default(); harmonics.len() + 1];
    let mut done = 0;
    if let Some(stored) = stored {
        // whole frequencies only: the ladder begins anew at each
        done = stored.points.len() / harmonics.len();
        for p in &stored.points[..done * harmonics.len()] {
            let Some(series) = &p.series else { continue };
            if let Some(k) = harmonics.iter().position(|n| *n == series.n_h) {
                tracks[k + 1].push(p.omega, series_of(&reduction, series));
            }
        }
    }
    let mut failure = None;
    let mut interrupted = false;
    sequential(
        &mut reduction,
        &harmonics,
        &grid[done.min(grid.len())..],
        &settings,
        &mut tracks,
        |reduction, p| {
            let branch = harmonics.iter().position(|n| *n == p.n_h).unwrap_or(0);
            let record = match &p.solution {
                Err(e) => Ok(PointRecord {
                    omega: p.omega,
                    special: format!("gap: {e}"),
                    ..PointRecord::default()
                }),
                Ok(s) => point(reduction, s, special(&p), shooter.as_mut()),
            };
            match record {
                Ok(mut record) => {
                    record.branch = branch;
                    interrupted = take(record).is_break();
                    if interrupted { Go::Break(()) } else { Go::Continue(()) }
                }
                Err(e) => {
                    failure = Some(e);
                    Go::Break(())
                }
            }
        },
    )
    .map_err(numerics)?;
    if let Some(e) = failure {
        return Err(e);
    }
    let text = format!("{} frequencies, {} numbers of harmonics", grid.len(), harmonics.len());
    Ok(Ended { branch: 0, text, complete: !interrupted })
}

fn special(p: &Point) -> String {
    match (p.jumped, p.origin) {
        (true, _) => "jump".into(),
        (false, Origin::Started) => "start".into(),
        _ => "regular".into(),
    }
}

/// A branch by arclength from the linear response (forced) or from the first solution that is found.
#[allow(clippy::too_many_arguments)]
pub fn arclength(
    arguments: &Arguments,
    scene: &Scene,
    n_h: usize,
    (from, direction): (f64, f64),
    options: &Options,
    index: usize,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Ended, CliError> {
    let problem = load::of_scene(scene)?;
    let mut shooter = match arguments.shoot {
        true => Some(family::propagator(load::of_scene(scene)?.nbm)?),
        false => None,
    };
    let mut reduction = arguments.reduction(problem.nbm)?;
    reduction.set_frequency(from);
    let ended = |text: String, complete: bool| Ok(Ended { branch: index, text, complete });
    let settings = Settings::default();
    let start = match reduction.basis {
        Basis::Full => {
            let zero = Series::zeros(Basis::Full, n_h, reduction.n());
            solve(&reduction, &zero, from, &settings).map_err(numerics)?.ok()
        }
        Basis::Cosine => {
            let mut found = None;
            let mut tracks = vec![Track::default(); 2];
            sequential(&mut reduction, &[n_h], &[from], &settings, &mut tracks, |_, p| {
                found = p.solution.ok();
                Go::Continue(())
            })
            .map_err(numerics)?;
            found
        }
    };
    let Some(start) = start else {
        return ended(format!("no solution to start from at omega = {from}"), false);
    };
    let mut family = Harmonics { reduction: &mut reduction, n_h };
    let x = family.unknowns(&start).map_err(numerics)?;
    let place = Place::start(&mut family, x, direction, options.step.0).map_err(numerics)?;
    let Some(place) = place else {
        return ended("the first tangent could not be computed".into(), false);
    };
    let mut failure = None;
    let stop = continuation::follow(&mut family, place, options, |family, p| {
        let special = match &p.special {
            None => "regular".to_owned(),
            Some(Special::Fold) => "fold".into(),
            Some(Special::BranchPoint) => "branch point".into(),
            Some(Special::End) => "end of range".into(),
            Some(_) => "regular".into(),
        };
        let record = family
            .solution(&p.x)
            .map_err(numerics)
            .and_then(|s| point(family.reduction, &s, special, shooter.as_mut()));
        match record {
            Ok(mut record) => {
                record.branch = index;
                take(record)
            }
            Err(e) => {
                failure = Some(e);
                Go::Break(())
            }
        }
    })
    .map_err(numerics)?;
    match failure {
        Some(e) => Err(e),
        None => ended(stop.to_string(), matches!(stop, Stop::Range | Stop::Points)),
    }
}
