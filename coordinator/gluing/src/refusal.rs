//! Why a strategy cannot glue a group, said when the scenario is loaded, with the strategies that could.

use super::{InterfaceProblem, Strategy, strategy};
use terraglue_host::Instance;
use terraglue_scenario::{GluingSpec, StrategyKind};
use terraglue_subsystem::Capabilities;

/// A refused strategy.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Why.
    pub reason: String,
    /// Strategies that this group could be glued with.
    pub would_work: Vec<&'static str>,
}

/// Why the scenario's strategy cannot glue these members; `None`: it can.
pub fn refusal(spec: &GluingSpec, problem: &InterfaceProblem, instances: &[Instance]) -> Option<Refusal> {
    let of = |kind: StrategyKind| {
        let spec = GluingSpec { strategy: kind, ..spec.clone() };
        why(strategy(&spec).as_ref(), problem, instances)
    };
    let reason = of(spec.strategy)?;
    let would_work =
        StrategyKind::ALL.iter().filter(|kind| of(**kind).is_none()).map(|kind| kind.name()).collect();
    Some(Refusal { reason, would_work })
}

fn why(strategy: &dyn Strategy, problem: &InterfaceProblem, instances: &[Instance]) -> Option<String> {
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
        |slot: usize| lacks(slot, if problem.glue.is_second(slot) { needs.second } else { needs.first });
    strategy
        .refuses(problem)
        .or_else(|| problem.body_slots().find_map(body))
        .or_else(|| problem.ground_slots().find_map(|s| lacks(s, needs.grounds)))
}

/// A pass of contacts meets a joint.
pub fn joints_refused(name: &str, problem: &InterfaceProblem) -> Option<String> {
    problem.glue.has_joints().then(|| {
        format!("`{name}` co-operates at contacts: the soil cannot say how a joint between bodies pulls")
    })
}

/// A strategy that asks soils meets a contact between bodies.
pub fn body_contacts_refused(name: &str, problem: &InterfaceProblem) -> Option<String> {
    let k = problem.glue.body_contact()?;
    Some(format!("`{name}` asks a soil for the force of a contact, but side 2 of glue {} is a body", k + 1))
}

/// An explicit strategy meets a constraint.
pub fn rigid_refused(name: &str, problem: &InterfaceProblem) -> Option<String> {
    let joint = problem.glue.rigid_joint().map(|k| {
        format!(
            "`{name}` is explicit and knows the force of a spring only: glue {} has no compliance_m_n",
            k + 1
        )
    });
    joint.or_else(|| body_contacts_refused(name, problem))
}

/// A strategy that drives side 2 by motion meets a glue where that cannot be.
pub fn second_refused(name: &str, problem: &InterfaceProblem) -> Option<String> {
    let spring = problem.glue.spring().map(|k| {
        format!(
            "`{name}` makes side 2 follow side 1: the compliance of glue {} would have to be inside side 2",
            k + 1
        )
    });
    let nobody = problem.glue.joint_without_second().map(|k| {
        format!(
            "`{name}` makes side 2 follow side 1: side 2 of glue {} is the world, or side 1 of another glue",
            k + 1
        )
    });
    spring.or_else(|| body_contacts_refused(name, problem)).or(nobody)
}
