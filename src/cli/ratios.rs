//! Scenes with one damping ratio after the other.

use signorini::scenario::{Change, Issue, Scene};

use super::CliError;

/// Key of the damping ratio.
const RATIO: &str = "damping.ratio";

/// The scene once for each damping ratio, with the ratio in percent; `option` gave them.
pub(super) fn with_ratios(
    scene: &Scene,
    option: &str,
    given: Option<&[f64]>,
) -> Result<Vec<(Option<f64>, Scene)>, CliError> {
    let of_scene = scene.orbit.as_ref().and_then(|o| o.ratios.as_deref());
    let Some(list) = given.or(of_scene) else {
        return Ok(vec![(None, scene.clone())]);
    };
    if let Some(bad) = list.iter().find(|r| !(r.is_finite() && **r > 0.0)) {
        return Err(CliError::Input(format!(
            "{option}: {bad} is not a damping ratio; give a positive number"
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

/// The same where a number of the scene, by its key, takes other values later: not the ratio itself.
pub(super) fn changed_ratio(
    scene: &Scene,
    ratio: Option<f64>,
    key: &str,
) -> Result<Scene, CliError> {
    if key == RATIO && ratio.is_some() {
        let text = format!(
            "--ratio gives one damping ratio, and --over {RATIO} changes it: leave --ratio out"
        );
        return Err(CliError::Input(text));
    }
    Ok(one_ratio(scene, ratio)?.1)
}

/// The scene with one damping ratio, which is given in percent, or with its own damping.
pub(super) fn one_ratio(
    scene: &Scene,
    ratio: Option<f64>,
) -> Result<(Option<f64>, Scene), CliError> {
    let given = ratio.map(|ratio| vec![ratio]);
    let mut scenes = with_ratios(scene, "--ratio", given.as_deref())?;
    if scenes.len() > 1 {
        let text = "the scene has several damping ratios in [orbit]: give one of them with --ratio";
        return Err(CliError::Input(text.into()));
    }
    let one = scenes.pop().ok_or_else(|| CliError::Input("no damping ratio".into()))?;
    let Some(ratio) = one.1.damping.as_ref().and_then(|d| d.ratio).filter(|_| one.0.is_some())
    else {
        return Ok(one);
    };
    // as it would stand in the file: scenes beside are made from its text
    Ok((one.0, scene.with(&[Change::set(RATIO, format!("{ratio:?}"))])?))
}
