//! Harmonic balance behind `backbone --method hbm` and `response --method hbm`: its arguments.

use clap::{Args, ValueEnum};

use signorini::contact::System;
use signorini::hbm::bem::BarBalance;
use signorini::hbm::branch::BalancedBody;
use signorini::hbm::newton::Settings;
use signorini::hbm::{Form, Quadrature, Viscous, prepare, viscous_mode};
use signorini::orbit::Pin;
use signorini::problem::Problem;
use signorini::records::{Branch, PointMethod};
use signorini::scenario::{ContactMethod, Issue, Scene};

use super::{CliError, family, load, resources};

/// How families are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// In time, by shooting: true orbits
    Shooting,
    /// By harmonic balance: approximations
    Hbm,
    /// Bars: by harmonic balance of boundary elements, the continuum without a mesh (backbone)
    Bem,
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
    /// Harmonic balance: shoot from every point, and give the multipliers and stability of the orbit that it approximates; where there is none near,
    /// the multipliers along the series, with an estimate of their error
    #[arg(long)]
    pub shoot: bool,
}

impl Arguments {
    /// What is asked for, if it makes sense.
    pub fn choice(&self, scene: &Scene) -> Result<Choice, CliError> {
        self.check_method()?;
        let (harmonics, quadrature) = (self.list(scene)?, self.quadrature()?);
        let form = match self.form {
            FormName::Force => Form::Force,
            FormName::Acceleration => Form::Acceleration,
        };
        let (method, samples, shoot) = (self.method, self.aft, self.shoot);
        let settings = Settings { quadrature, ..Settings::default() };
        Ok(Choice { method, harmonics, form, samples, shoot, settings })
    }

    /// Refuse what the viscous nonlinear mode by harmonic balance does not have.
    pub(crate) fn check_viscous(&self) -> Result<(), String> {
        if self.aft.is_some() {
            return Err("--aft samples a force that jumps with the acceleration of a viscous body, and half of its solutions do not converge: leave it out".into());
        }
        if self.form != FormName::Force {
            return Err(
                "--viscous --method hbm solves for the acceleration anyway: leave --form out"
                    .into(),
            );
        }
        Ok(())
    }

    /// The numbers of harmonics, ascending.
    fn list(&self, scene: &Scene) -> Result<Vec<usize>, CliError> {
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
    fn check_method(&self) -> Result<(), CliError> {
        let given = [
            ("--harmonics", self.harmonics.is_some()),
            ("--aft", self.aft.is_some()),
            ("--shoot", self.shoot),
            ("--form", self.form != FormName::Force),
        ];
        let wrong = |(name, given): &&(&str, bool)| match self.method {
            Method::Shooting => *given,
            Method::Bem => *given && *name != "--harmonics",
            Method::Hbm => false,
        };
        match given.iter().find(wrong) {
            Some((name, _)) => Err(CliError::Input(format!("{name} goes with --method hbm"))),
            None => Ok(()),
        }
    }

    /// How the equations are integrated over the period.
    fn quadrature(&self) -> Result<Quadrature, CliError> {
        match self.aft {
            None => Ok(Quadrature::EventResolved),
            Some(n) if (8..=1_000_000).contains(&n) => Ok(Quadrature::Sampled(n)),
            Some(n) => Err(CliError::Input(format!("--aft {n}: give 8 to 1000000 samples"))),
        }
    }
}

/// How families are computed, checked.
#[derive(Debug, Clone)]
pub struct Choice {
    method: Method,
    /// Numbers of harmonics, ascending.
    pub harmonics: Vec<usize>,
    form: Form,
    samples: Option<usize>,
    shoot: bool,
    /// Newton's settings.
    pub settings: Settings,
}

impl Choice {
    /// Whether harmonic balance is chosen.
    pub(crate) fn is_balance(&self) -> bool {
        self.method != Method::Shooting
    }

    /// Whether harmonic balance is chosen, with integrals from switch to switch, and nothing is shot.
    pub(crate) fn is_event_resolved(&self) -> bool {
        self.method == Method::Hbm && self.samples.is_none() && !self.shoot
    }

    /// Whether boundary elements are chosen.
    pub(crate) fn is_bem(&self) -> bool {
        self.method == Method::Bem
    }

    /// The bar that boundary elements are asked for; an error where there is none, or another family than a backbone on a grid.
    pub fn bar(
        &self,
        scene: &Scene,
        system: &System,
        on_grid: bool,
    ) -> Result<Option<BarBalance>, CliError> {
        if !self.is_bem() {
            return Ok(None);
        }
        let refuse = |why: &str| Err(CliError::Input(format!("--method bem: {why}")));
        if !on_grid {
            return refuse(
                "backbones frequency by frequency, without --viscous: leave --follow out",
            );
        }
        let method = scene.contact.as_ref().map(|c| c.method).unwrap_or_default();
        if method != ContactMethod::NodalBoundary {
            let text = "is not read by --method bem, which is the bar itself before its obstacle";
            let issue = Issue::new("contact.method", text, "remove the key, or give --method hbm");
            return Err(scene.error(issue).into());
        }
        if !system.is_conservative() || !system.loads.is_none() {
            return refuse("a bar without damping and loads; leave them out, or give --method hbm");
        }
        match BarBalance::of(system).filter(|_| !scene.has_elements()) {
            Some(bar) => Ok(Some(bar)),
            None => refuse("a uniform bar that is held at its other end; give --method hbm"),
        }
    }

    /// Whether an orbit is shot from every solution.
    pub(crate) fn is_shot(&self) -> bool {
        self.shoot
    }

    /// A body for the harmonic balance of its viscous nonlinear mode, and for shooting if that is asked for.
    pub(crate) fn viscous_body(
        &self,
        problem: &Problem,
        pin: Pin,
    ) -> Result<viscous_mode::ViscousBody, CliError> {
        let shooter = match self.shoot {
            true => Some(family::propagator(problem.system.clone())?),
            false => None,
        };
        Ok(viscous_mode::ViscousBody {
            viscous: Viscous::new(problem.system.clone(), pin)?,
            shooter,
        })
    }

    /// How a point is computed, for the file.
    pub fn method(&self) -> PointMethod {
        match self.method {
            Method::Shooting => PointMethod::Shooting,
            Method::Bem => PointMethod::BoundaryElements,
            Method::Hbm => PointMethod::HarmonicBalance {
                acceleration: self.form == Form::Acceleration,
                samples: self.samples,
                shot: self.shoot,
            },
        }
    }

    /// Most harmonics of a series in the file.
    pub(crate) fn most_harmonics(&self) -> usize {
        let most = self.harmonics.iter().copied().max().unwrap_or(0);
        if self.is_balance() { most } else { 0 }
    }

    /// The branches of a sequential continuation.
    pub(crate) fn sequential_branches(&self) -> Vec<Branch> {
        let series = |&harmonics: &usize| Branch::Series { harmonics, direction: None };
        self.harmonics.iter().map(series).collect()
    }

    /// The body of a scene, ready for harmonic balance, and for shooting if that is asked for.
    pub fn body(&self, scene: &Scene) -> Result<BalancedBody, CliError> {
        let problem = load::of_scene(scene)?;
        let shooter = match self.shoot {
            true => Some(family::propagator(load::of_scene(scene)?.system)?),
            false => None,
        };
        let balanced = prepare(problem.system, self.form)?;
        let (interface, harmonics) = (balanced.interface(), self.most_harmonics());
        let functions = interface.basis.len(harmonics);
        let sizes = (functions * interface.rank(), functions * interface.rank_in());
        resources::check_balance(scene, harmonics, sizes)?;
        Ok(BalancedBody { balanced, shooter })
    }
}
