//! Why a strategy cannot glue a group, said when the scenario is loaded, with the strategies that could.

use super::{Exchange, Strategy, strategy};
use terraglue_host::Instance;
use terraglue_scenario::{GluingSpec, HoldChoice, LevelChoice, StrategyKind};
use terraglue_subsystem::Capabilities;

/// A refused strategy.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// The key of `[gluing]` that it is about.
    pub key: &'static str,
    /// The way out, where another strategy is none.
    pub help: Option<String>,
    /// Why.
    pub reason: String,
    /// Strategies that this group could be glued with.
    pub would_work: Vec<&'static str>,
}

/// Why the scenario's strategy cannot glue these members; `None`: it can.
pub fn refusal(spec: &GluingSpec, exchange: &Exchange, instances: &[Instance]) -> Option<Refusal> {
    let of = |kind: StrategyKind| {
        let spec = GluingSpec { strategy: kind, ..spec.clone() };
        why(strategy(&spec).as_ref(), exchange, instances)
    };
    if let Some(refusal) = hold_refused(spec, exchange, instances) {
        return Some(refusal);
    }
    let reason = of(spec.strategy)?;
    let would_work =
        StrategyKind::ALL.iter().filter(|kind| of(**kind).is_none()).map(|kind| kind.name()).collect();
    Some(Refusal { key: "strategy", help: None, reason, would_work })
}

/// Holds that do not go with the level, the strategy, the glue or the members.
fn hold_refused(spec: &GluingSpec, exchange: &Exchange, instances: &[Instance]) -> Option<Refusal> {
    let refused = |reason: String, help: &str| {
        Some(Refusal { key: "hold", help: Some(help.into()), reason, would_work: Vec::new() })
    };
    if spec.hold == HoldChoice::Linear && spec.level == LevelChoice::Position {
        let reason = "a linear hold with the condition at position level grows by 2 + √3 = 3.73 per step";
        let help = "use hold = \"end\", \"constant\" or \"two-parameter\", or level = \"velocity\"";
        return refused(reason.into(), help);
    }
    let sub_cycles = |slot: usize| instances[slot].capabilities().has(Capabilities::SUBCYCLES);
    if matches!(spec.hold, HoldChoice::Constant | HoldChoice::Linear) && !exchange.members().any(sub_cycles) {
        let reason = format!(
            "a {} hold would have no effect: none of the glued subsystems sub-cycles, all read T at the end of the step",
            spec.hold
        );
        return refused(reason, "leave `hold` out");
    }
    if spec.hold != HoldChoice::TwoParameter {
        return None;
    }
    if spec.level != LevelChoice::Position {
        let reason = "a two-parameter hold closes place and rate at once: it has no other level";
        return refused(reason.into(), "leave `level` out");
    }
    if spec.strategy != StrategyKind::Iterative {
        let reason = format!("`{}` has no second force per step for a two-parameter hold", spec.strategy);
        return refused(reason, "use strategy = \"iterative\", or another hold");
    }
    if exchange.has_grounds() || exchange.glue.contact().is_some() || exchange.glue.spring().is_some() {
        let reason = "a two-parameter hold is for rigid joints: a law gives one force per place and rate";
        return refused(reason.into(), "use another hold");
    }
    let lacks = |slot: &usize| !instances[*slot].capabilities().has(Capabilities::RAMP);
    let slot = exchange.members().find(lacks)?;
    let (name, module) = (instances[slot].name(), instances[slot].module());
    let reason = format!("`{name}` (module {module}) takes one force per step, not two");
    refused(
        reason,
        "use another hold; sub-cycling modules may declare `force input with two parameters per step`",
    )
}

fn why(strategy: &dyn Strategy, exchange: &Exchange, instances: &[Instance]) -> Option<String> {
    let needs = strategy.needs();
    let lacks = |slot: usize, needs: Capabilities| {
        let have = instances[slot].capabilities();
        let missing = Capabilities(needs.0 & !have.0);
        (missing.0 != 0).then(|| {
            let names: Vec<_> = missing.names().collect();
            format!(
                "strategy `{}` needs {} of `{}` (module {}), which does not offer it",
                strategy.name(),
                names.join(", "),
                instances[slot].name(),
                instances[slot].module()
            )
        })
    };
    let body =
        |slot: usize| lacks(slot, if exchange.glue.is_second(slot) { needs.second } else { needs.first });
    strategy
        .refuses(exchange)
        .or_else(|| exchange.body_slots().find_map(body))
        .or_else(|| exchange.ground_slots().find_map(|s| lacks(s, needs.grounds)))
}

/// A pass of contacts meets a joint.
pub fn joints_refused(name: &str, exchange: &Exchange) -> Option<String> {
    exchange.glue.has_joints().then(|| {
        format!("`{name}` co-operates at contacts: the soil cannot say how a joint between bodies pulls")
    })
}

/// A strategy of joints meets a contact.
pub fn contacts_refused(name: &str, exchange: &Exchange) -> Option<String> {
    (exchange.has_grounds() || exchange.glue.contact().is_some())
        .then(|| format!("`{name}` glues joints: a contact opens and closes, and it cannot see when"))
}

/// A strategy that asks soils meets a contact between bodies.
pub fn body_contacts_refused(name: &str, exchange: &Exchange) -> Option<String> {
    let k = exchange.glue.body_contact()?;
    Some(format!("`{name}` asks a soil for the force of a contact, but side 2 of glue {} is a body", k + 1))
}

/// An explicit strategy meets a constraint.
pub fn rigid_refused(name: &str, exchange: &Exchange) -> Option<String> {
    let joint = exchange.glue.rigid_joint().map(|k| {
        format!(
            "`{name}` is explicit and knows the force of a spring only: glue {} has no compliance_m_n",
            k + 1
        )
    });
    joint.or_else(|| body_contacts_refused(name, exchange))
}

/// A strategy that drives side 2 by motion meets a glue where that cannot be.
pub fn second_refused(name: &str, exchange: &Exchange) -> Option<String> {
    let spring = exchange.glue.spring().map(|k| {
        format!(
            "`{name}` makes side 2 follow side 1: the compliance of glue {} would have to be inside side 2",
            k + 1
        )
    });
    let nobody = exchange.glue.joint_without_second().map(|k| {
        format!(
            "`{name}` makes side 2 follow side 1: side 2 of glue {} is the world, or side 1 of another glue",
            k + 1
        )
    });
    spring.or_else(|| body_contacts_refused(name, exchange)).or(nobody)
}
