//! Scenes with one damping ratio after the other.

use signorini::scenario::{Issue, Scene};

use super::CliError;

/// The scene once for each damping ratio, with the ratio in percent.
pub(super) fn with_ratios(
    scene: &Scene,
    given: Option<&[f64]>,
) -> Result<Vec<(Option<f64>, Scene)>, CliError> {
    let of_scene = scene.orbit.as_ref().and_then(|o| o.ratios.as_deref());
    let Some(list) = given.or(of_scene) else {
        return Ok(vec![(None, scene.clone())]);
    };
    if let Some(bad) = list.iter().find(|r| !(r.is_finite() && **r > 0.0)) {
        return Err(CliError::Input(format!(
            "--ratios: {bad} is not a damping ratio; give positive numbers"
        )));
    }
    let with = |&ratio: &f64| {
        let mut scene = scene.clone();
        match &mut scene.damping {
            Some(d) if d.ratio.is_some() => d.ratio = Some(ratio),
            _ => {
                let help = "[damping] with ratio = 0.02 and mode = 1";
                let issue = Issue::new(
                    "damping",
                    "several ratios stand in place of one, and there is none",
                    help,
                );
                return Err(CliError::from(scene.error(issue)));
            }
        }
        Ok((Some(100.0 * ratio), scene))
    };
    list.iter().map(with).collect()
}
