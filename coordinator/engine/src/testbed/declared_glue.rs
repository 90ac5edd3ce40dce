//! The glue that a scenario declares: between which bodies, where, and whether their points meet at the start.

use super::checks::gap_words;
use terraglue_diagnostics::{Error, Result};
use terraglue_gluing::glue::Recipe;
use terraglue_host::{Instance, Reply};
use terraglue_numerics::rotation;
use terraglue_scenario as scenario;
use terraglue_scenario::{GlueSpec, Scenario};
use terraglue_subsystem::{BodyState, Kind, Law, Values, ValuesMut};

/// Committed states of all bodies.
pub(super) fn body_states(instances: &[Instance]) -> Result<Vec<Vec<BodyState>>> {
    let mut states: Vec<Vec<BodyState>> = Vec::new();
    for instance in instances {
        let mut own = vec![BodyState::REST; instance.scene().bodies.len()];
        instance.body_states(&mut own)?;
        states.push(own);
    }
    Ok(states)
}

/// The glue that the scenario declares, between bodies that exist and whose gap at the start is closed.
///
/// # Errors
/// Glue between what is not there, or a gap.
pub(super) fn declared(scenario: &Scenario, instances: &mut [Instance]) -> Result<Vec<Recipe>> {
    let glue = recipes(scenario, instances)?;
    for (recipe, spec) in glue.iter().zip(&scenario.glue).filter(|(_, spec)| spec.projects) {
        project(recipe, instances, scenario, spec)?;
    }
    // after all have moved: a body that two joints pull has a gap left
    let states = body_states(instances)?;
    for (recipe, spec) in glue.iter().zip(&scenario.glue) {
        if let Some(gap) = gap_at_start(recipe, &states) {
            let (message, help) = gap_words(&spec.sides, rotation::length(gap));
            let error = scenario.source.error_in(spec.entry, &[&spec.sides[1]], message, Some(help));
            return Err(error.into());
        }
        warn_of_speeds(recipe, spec, &states);
    }
    Ok(glue)
}

/// Says where the points of a joint meet at the start, and go on at different speeds: the first step makes them equal by an impulse.
fn warn_of_speeds(recipe: &Recipe, spec: &GlueSpec, states: &[Vec<BodyState>]) {
    let speed = |state: &BodyState| state.linear_velocity;
    let scale = recipe.ends.iter().flatten().map(|(slot, body)| &states[*slot][*body as usize]);
    let scale = scale.map(|state| rotation::length(speed(state))).fold(1e-3, f64::max);
    let apart = rotation::length(apart_at_start(recipe, states, speed));
    if is_rigid(recipe) && recipe.at.is_none() && apart > GAP * scale {
        let [a, b] = &spec.sides;
        log::warn!(
            "glue: `{a}` and `{b}` differ by {apart:.3} m/s at the start, which the first step makes equal by an impulse: bodies whose force is held over a step may \
             then swap their speeds in every step. Give them the same speed"
        );
    }
}

/// Moves a free body of side 1, or else of side 2, with all that hangs on it, so that the points of a joint meet.
fn project(recipe: &Recipe, instances: &mut [Instance], scenario: &Scenario, spec: &GlueSpec) -> Result {
    let Some(gap) = gap_at_start(recipe, &body_states(instances)?) else { return Ok(()) };
    for (end, sign) in [(0, -1.0), (1, 1.0)] {
        let Some((slot, _)) = recipe.ends[end] else { continue };
        let by = gap.map(|x| sign * x);
        let bodies: Vec<String> = instances[slot].scene().bodies.iter().map(|b| b.name.clone()).collect();
        for body in bodies {
            if !shift(&mut instances[slot], &body, by)? {
                continue;
            }
            if gap_at_start(recipe, &body_states(instances)?).is_none() {
                let by = by.map(|x| (1e6 * x).round() * 1e-6);
                log::info!("{}.{body} was moved by {by:?} m to where it is glued", instances[slot].name());
                return Ok(());
            }
            // the glued body hangs on another one
            shift(&mut instances[slot], &body, by.map(|x| -x))?;
        }
    }
    let message = format!(
        "glue: `close = \"project\"` moves free bodies of robots, and neither `{}` nor `{}` hangs on one",
        spec.sides[0], spec.sides[1]
    );
    let help = "give the bodies their places at the start, or close the gap slowly with `ramp_s = 0.5`";
    Err(scenario.source.error_in(spec.entry, &["project"], message, Some(help.into())).into())
}

/// Moves a body by its variables of place, as they can be set before the first step; false: it has none that can be set.
fn shift(instance: &mut Instance, body: &str, by: [f64; 3]) -> Result<bool> {
    for (axis, by) in ["x", "y", "z"].iter().zip(by).filter(|(_, by)| *by != 0.0) {
        let name = format!("{body}.{axis}");
        let Some(id) = instance.variables().iter().find(|v| v.name == name).map(|v| v.id) else {
            return Ok(false);
        };
        let mut place = [0.0];
        instance.get(&[id], ValuesMut::F64(&mut place))?;
        if let Reply::Refused(_) = instance.set(&[id], Values::F64(&[place[0] + by]))? {
            return Ok(false);
        }
    }
    Ok(true)
}

fn recipes(scenario: &Scenario, instances: &[Instance]) -> Result<Vec<Recipe>> {
    let mut glue = Vec::new();
    let source = &scenario.source;
    let wrong = |spec: &GlueSpec, words: &[&str], message: String, help: Option<String>| {
        Error::from(source.error_in(spec.entry, words, message, help))
    };
    let states = body_states(instances)?;
    for (number, spec) in scenario.glue.iter().enumerate() {
        let mut ends = [None; 2];
        for (end, side) in ends.iter_mut().zip(&spec.sides).filter(|(_, side)| *side != "world") {
            let (name, body) = side.split_once('.').unwrap_or((side, ""));
            let slot = instances.iter().position(|i| i.name() == name);
            let found = slot
                .and_then(|s| Some((s, instances[s].scene().bodies.iter().position(|b| b.name == body)?)));
            let Some((slot, k)) = found else {
                let names: Vec<&str> = slot
                    .iter()
                    .flat_map(|s| instances[*s].scene().bodies.iter().map(|b| b.name.as_str()))
                    .collect();
                let help = scenario::did_you_mean(body, names.iter().copied());
                return Err(wrong(spec, &[side], format!("glue: body `{side}` does not exist"), help));
            };
            *end = Some((slot, k as u32));
        }
        let soil_at = |e: usize| ends[e].is_some_and(|(s, _)| instances[s].kind() == Kind::Soil);
        if soil_at(0) || soil_at(1) && !spec.contact {
            let message = "a soil is side 2 of glue of kind `contact`".into();
            return Err(wrong(spec, &[&spec.sides[1]], message, None));
        }
        if ends[0].map(|e| e.0) == ends[1].map(|e| e.0) {
            return Err(wrong(spec, &[&spec.sides[1]], "glue joins two different subsystems".into(), None));
        }
        let law = Law {
            t_min: if spec.contact { 0.0 } else { f64::NEG_INFINITY },
            t_max: spec.t_max,
            mu: if spec.contact { spec.mu } else { f64::INFINITY },
            compliance: spec.compliance,
        };
        let axes =
            if spec.contact { axes(spec.normal) } else { [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0] };
        let at = spec.at_m.or(if spec.contact && soil_at(1) {
            ends[0].map(|(s, b)| states[s][b as usize].world_from_body.position)
        } else {
            None
        });
        let (mask, turning, soil) = (spec.mask, spec.turning, soil_at(1));
        let (damping, contact, ramp_s) = (spec.damping, spec.contact, spec.ramp_s);
        glue.push(Recipe { number, ends, at, mask, axes, turning, law, damping, ramp_s, contact, soil });
    }
    Ok(glue)
}

/// From the point of side 2 to that of side 1 of a joint without compliance and ramp, at the start along the components that it
/// glues, m, world axes; none: they are apart by rounding only.
fn gap_at_start(recipe: &Recipe, states: &[Vec<BodyState>]) -> Option<[f64; 3]> {
    if !is_rigid(recipe) || recipe.ramp_s > 0.0 || recipe.at.is_some() {
        return None;
    }
    let place = |state: &BodyState| state.world_from_body.position;
    let ends = recipe.ends.iter().flatten().map(|(slot, body)| place(&states[*slot][*body as usize]));
    let scale = ends.flatten().fold(1.0_f64, |m, x| m.max(x.abs()));
    let gap = apart_at_start(recipe, states, place);
    (rotation::length(gap) > GAP * scale).then_some(gap)
}

/// Whether it lets its points come apart by rounding only.
fn is_rigid(recipe: &Recipe) -> bool {
    !recipe.contact && recipe.law.compliance <= 0.0
}

/// What side 1 has more than side 2 of a vector of bodies, along the components that are glued, world axes.
fn apart_at_start(
    recipe: &Recipe,
    states: &[Vec<BodyState>],
    of: impl Fn(&BodyState) -> [f64; 3],
) -> [f64; 3] {
    let end =
        |e: usize| of(recipe.ends[e].map_or(&BodyState::REST, |(slot, body)| &states[slot][body as usize]));
    let apart = rotation::minus(end(0), end(1));
    let mut out = [0.0; 3];
    for axis in (0..3).filter(|axis| recipe.mask & (1 << axis) != 0) {
        let along: [f64; 3] = std::array::from_fn(|k| recipe.axes[3 * axis + k]);
        let size = rotation::dot(along, apart);
        out.iter_mut().zip(along).for_each(|(out, d)| *out += size * d);
    }
    out
}

/// Gap at the start that is rounding, as a share of the places of the two bodies, or in m where these are below 1 m.
const GAP: f64 = 1e-6;

/// n along a vector and two tangents: the first in the plane of n and x where that exists.
fn axes(normal: [f64; 3]) -> [f64; 9] {
    let size = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    let n = normal.map(|x| if size > 0.0 { x / size } else { 0.0 });
    let seed = if n[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let along: f64 = (0..3).map(|k| seed[k] * n[k]).sum();
    let t = [0, 1, 2].map(|k| seed[k] - along * n[k]);
    let length = t.iter().map(|x| x * x).sum::<f64>().sqrt();
    let t = t.map(|x| x / length);
    let b = [n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]];
    [n[0], n[1], n[2], t[0], t[1], t[2], b[0], b[1], b[2]]
}
