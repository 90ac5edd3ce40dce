//! Checks of the pieces of one link in a scenario that cuts a robot.
//!
//! A subsystem whose body is a piece of a divided link has `BODY.link_share`, the share of the link in it. Pieces of
//! one name that glue of all six components welds are that link again: their shares add up to 1, and they start in one
//! place with the same rates.

use terraglue_diagnostics::Result;
use terraglue_gluing::glue::Recipe;
use terraglue_host::Instance;
use terraglue_scenario::Scenario;
use terraglue_subsystem::{BodyState, ValuesMut, component};

/// The variable that marks a body as a piece of a link.
const SHARE: &str = ".link_share";
/// Shares and places that differ by less are equal, dimensionless, m, rad, m/s and rad/s.
const EQUAL: f64 = 1e-9;

/// One piece.
#[derive(Clone, Debug)]
struct Piece {
    slot: usize,
    body: u32,
    name: String,
    share: f64,
}

/// Refuses cuts that are not welded again, and parts that do not fit together.
///
/// # Errors
/// [`terraglue_diagnostics::Error::Input`] with the place in the scenario and a way out.
pub(super) fn check(
    scenario: &Scenario,
    instances: &[Instance],
    glue: &[Recipe],
    states: &[Vec<BodyState>],
) -> Result {
    let pieces = pieces(instances)?;
    let mut link: Vec<usize> = (0..pieces.len()).collect();
    for recipe in glue.iter().filter(|r| !r.contact && r.mask == component::WRENCH) {
        let of = |end: Option<(usize, u32)>| pieces.iter().position(|p| Some((p.slot, p.body)) == end);
        let [Some(a), Some(b)] = recipe.ends.map(of) else { continue };
        if pieces[a].name == pieces[b].name {
            fit(scenario, instances, [&pieces[a], &pieces[b]], states)?;
            let (from, to) = (link[a].max(link[b]), link[a].min(link[b]));
            link.iter_mut().filter(|l| **l == from).for_each(|l| *l = to);
        }
    }
    for k in (0..pieces.len()).filter(|k| link[*k] == *k) {
        let all: Vec<&Piece> = (k..pieces.len()).filter(|i| link[*i] == k).map(|i| &pieces[i]).collect();
        whole(scenario, instances, &all)?;
    }
    note(instances, &pieces);
    Ok(())
}

fn pieces(instances: &[Instance]) -> Result<Vec<Piece>> {
    let mut all = Vec::new();
    for (slot, instance) in instances.iter().enumerate() {
        for variable in instance.variables() {
            let Some(name) = variable.name.strip_suffix(SHARE) else { continue };
            let found = instance.scene().bodies.iter().position(|b| b.name == name);
            let Some(body) = found else { continue };
            let mut share = [f64::NAN];
            instance.get(&[variable.id], ValuesMut::F64(&mut share))?;
            all.push(Piece { slot, body: body as u32, name: name.to_owned(), share: share[0] });
        }
    }
    Ok(all)
}

/// Whether two welded pieces start in one place and with the same rates.
fn fit(
    scenario: &Scenario,
    instances: &[Instance],
    [a, b]: [&Piece; 2],
    states: &[Vec<BodyState>],
) -> Result {
    let [x, y] = [a, b].map(|p| &states[p.slot][p.body as usize]);
    let far = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt();
    let (p, q) = (&x.world_from_body, &y.world_from_body);
    let same =
        if (0..4).map(|k| p.orientation[k] * q.orientation[k]).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    let apart = far(&p.position, &q.position);
    let turned = 2.0 * far(&p.orientation, &q.orientation.map(|k| same * k));
    let faster =
        far(&x.linear_velocity, &y.linear_velocity).max(far(&x.angular_velocity, &y.angular_velocity));
    if apart <= EQUAL && turned <= EQUAL && faster <= EQUAL {
        return Ok(());
    }
    let message = format!(
        "the pieces of link `{}` in `{}` and `{}` do not start as one: they lie {apart:.3e} m and {turned:.3e} rad apart, \
         their rates differ by {faster:.3e} m/s or rad/s",
        a.name,
        instances[a.slot].name(),
        instances[b.slot].name()
    );
    let help = "give both subsystems the same model, position_m, heading_rad, joints and rates: each is a part of the whole \
                robot in that pose";
    Err(scenario.source.error_at_value(&[instances[b.slot].name(), "cut"], message, Some(help.into())).into())
}

/// Whether the pieces of a link make it whole.
fn whole(scenario: &Scenario, instances: &[Instance], pieces: &[&Piece]) -> Result {
    let sum: f64 = pieces.iter().map(|p| p.share).sum();
    if (sum - 1.0).abs() <= EQUAL {
        return Ok(());
    }
    let name = |p: &Piece| format!("{}.{}", instances[p.slot].name(), p.name);
    let list: Vec<String> = pieces.iter().map(|p| format!("`{}` {}", name(p), p.share)).collect();
    let link = &pieces[0].name;
    let (key, message, help) = if sum < 1.0 {
        (
            "cut",
            format!("link `{link}` is divided, but only {sum} of it is there: {}", list.join(", ")),
            format!(
                "weld the other piece to it with glue of all six components, `[[glue]] side_1 = \"{}\"`, `side_2` the body \
                 `{link}` of the subsystem that has the other side of the cut; all parts have the same cut_share",
                name(pieces[0])
            ),
        )
    } else {
        (
            "cut_share",
            format!("the pieces of link `{link}` make {sum} of it: {}", list.join(", ")),
            "give all parts of the robot the same cut_share".into(),
        )
    };
    let at = instances[pieces[0].slot].name();
    Err(scenario.source.error_at_value(&[at, key], message, Some(help)).into())
}

/// Says what parts of one robot do not do.
fn note(instances: &[Instance], pieces: &[Piece]) {
    let mut names: Vec<&str> = pieces
        .iter()
        .filter(|p| instances[p.slot].scene().shapes.iter().any(|s| s.collides))
        .map(|p| instances[p.slot].name())
        .collect();
    names.dedup();
    if names.len() > 1 {
        log::info!(
            "bodies of {} are parts of one robot and do not collide with each other",
            names.join(", ")
        );
    }
}
