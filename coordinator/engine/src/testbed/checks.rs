//! Demands of a scenario on its subsystems together that they cannot meet, found before the first step.

use super::group::Group;
use crate::signals::Directory;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::{PageSpec, Scenario};

/// Refuses groups whose members lack a capability.
///
/// # Errors
/// A member is an FMU although the run settles before t = 0, or makes a step of its own length.
pub fn check_groups(scenario: &Scenario, groups: &[Group], instances: &[Instance]) -> Result {
    check_multiples(scenario, groups)?;
    check_settling(scenario, groups, instances)
}

/// FMUs have no time before their start, so none can be among the subsystems that come to rest before t = 0.
fn check_settling(scenario: &Scenario, groups: &[Group], instances: &[Instance]) -> Result {
    let settle_s = scenario.time.settle_s;
    let glued = |slot: usize| groups.iter().any(|g| g.problem.members().any(|m| m == slot));
    let mut fmus = instances.iter().enumerate().filter(|(slot, i)| {
        terraglue_scenario::ModuleKind::is_fmu(i.module()) && (glued(*slot) || !i.scene().bodies.is_empty())
    });
    let Some((_, fmu)) = fmus.next().filter(|_| settle_s > 0.0) else { return Ok(()) };
    let message = format!(
        "`settle_s` = {settle_s} s: `{}` is a functional mock-up unit, whose time begins at 0",
        fmu.name()
    );
    let help = Some("leave `settle_s` out, or give the body a module".to_owned());
    Err(scenario.source.error_at_value(&["time", "settle_s"], message, help).into())
}

/// Glued subsystems make every step together: a wrench at a port holds for one step of both sides.
fn check_multiples(scenario: &Scenario, groups: &[Group]) -> Result {
    let glued = |slot: usize| groups.iter().any(|g| g.problem.members().any(|m| m == slot));
    let mut slower = scenario.subsystems.iter().enumerate().filter(|(_, spec)| spec.step_multiple > 1);
    let Some((slot, spec)) = slower.find(|(slot, _)| glued(*slot)) else { return Ok(()) };
    let (name, multiple) = (&spec.name, spec.step_multiple);
    let group = groups.iter().find(|g| g.problem.members().any(|m| m == slot));
    let others = group.into_iter().flat_map(|g| g.problem.members()).filter(|m| *m != slot);
    let others: Vec<String> = others.map(|m| format!("`{}`", scenario.subsystems[m].name)).collect();
    let with = if others.is_empty() { "the world".into() } else { others.join(", ") };
    let message = format!(
        "`step_multiple` = {multiple}: `{name}` is glued to {with}, and what is glued makes every step together"
    );
    let help = format!(
        "leave it out, or make `time.step_s` {multiple} times as long; `step_multiple` is for subsystems that are connected by \
         signals only"
    );
    Err(scenario.source.error_at_value(&[name, "step_multiple"], message, Some(help)).into())
}

/// The variables that the page plots must exist, and what it selects must have some.
fn check_page(scenario: &Scenario, directory: &Directory) -> Result {
    let (source, page) = (&scenario.source, &scenario.page);
    let mut plotted = page.plots.iter().flat_map(|plot| PageSpec::variables(plot));
    if let Some(name) = plotted.find(|name| directory.find(name).is_none()) {
        let message = format!("variable `{name}` does not exist");
        return Err(source.error_at_value(&["page", "plots"], message, directory.hint(name)).into());
    }
    if let Some(part) = &page.select {
        let below = format!("{part}.");
        if !directory.names().iter().any(|name| name == part || name.starts_with(&below)) {
            let message = format!("`{part}` is no variable, and no part that has some");
            return Err(source.error_at_value(&["page", "select"], message, directory.hint(part)).into());
        }
    }
    Ok(())
}

/// The names that report and page refer to must exist.
///
/// # Errors
/// One does not.
pub fn check_report(scenario: &Scenario, directory: &Directory, instances: &[Instance]) -> Result {
    check_page(scenario, directory)?;
    let source = &scenario.source;
    if let Some(name) = &scenario.report.commanded_speed
        && directory.find(name).is_none()
    {
        let help = directory.hint(name);
        let message = format!("variable `{name}` does not exist");
        return Err(source.error_at_value(&["report", "commanded_speed"], message, help).into());
    }
    if let Some(name) = &scenario.report.joint
        && directory.find(&format!("{name}.angle")).is_none()
    {
        let joints: Vec<&str> = directory.names().iter().filter_map(|n| n.strip_suffix(".angle")).collect();
        let help = terraglue_scenario::did_you_mean(name, joints.iter().copied());
        let message = format!("joint `{name}` does not exist");
        return Err(source.error_at_value(&["report", "joint"], message, help).into());
    }
    if let Some(name) = &scenario.report.body {
        let bodies: Vec<String> = instances
            .iter()
            .flat_map(|i| i.scene().bodies.iter().map(move |b| format!("{}.{}", i.name(), b.name)))
            .collect();
        if !bodies.iter().any(|b| b == name) {
            let help = terraglue_scenario::did_you_mean(name, bodies.iter().map(String::as_str));
            let message = format!("body `{name}` does not exist");
            return Err(source.error_at_value(&["report", "body"], message, help).into());
        }
    }
    Ok(())
}

/// Message about a joint whose points are `gap_m` apart, m, and the way out.
pub(super) fn gap_words([a, b]: &[String; 2], gap_m: f64) -> (String, String) {
    let gap = if gap_m < 1e-3 { format!("{gap_m:.2e}") } else { format!("{gap_m:.4}") };
    let message = format!(
        "glue: `{a}` and `{b}` are {gap} m apart along what the joint glues; the first step would close this gap at once"
    );
    let help = "move one of the two bodies there, glue one point of both with `at_m = [x, y, z]`, move a robot there with \
                `close = \"project\"`, or close the gap slowly with `ramp_s = 0.5`";
    (message, help.into())
}
