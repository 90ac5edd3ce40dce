//! The table of our figures and those of the peers: `docs/rigid-body.md`.

use crate::Figure;

/// Quantity; our figures, MuJoCo's and Rapier's by the end of their names.
struct PeerRow(&'static str, &'static [&'static str], &'static [&'static str], &'static [&'static str]);

const ROWS: [PeerRow; 20] = [
    PeerRow(
        "gait, drive A: CPU time of a step, µs (MuJoCo: soft, stiff contacts)",
        &["gait.six.step"],
        &["gait.soft.step", "gait.stiff_contacts.step"],
        &["gait.soft.step"],
    ),
    PeerRow(
        "the same: 99th percentile / median (each step the least of five runs)",
        &["gait.six.tail"],
        &["gait.soft.tail", "gait.stiff_contacts.tail"],
        &["gait.soft.tail"],
    ),
    PeerRow(
        "the same: deepest foot, mm",
        &["gait.soft.penetration"],
        &["gait.soft.penetration", "gait.stiff_contacts.penetration"],
        &["gait.soft.penetration"],
    ),
    PeerRow(
        "the same: slip in stance, mm/s",
        &["gait.soft.slip"],
        &["gait.soft.slip", "gait.stiff_contacts.slip"],
        &["gait.soft.slip"],
    ),
    PeerRow("the same: joint gap, mm", &["gait.joint_gap"], &[], &["gait.soft.joint_gap"]),
    PeerRow("the same: axis error, mrad", &["gait.axis_error"], &[], &["gait.soft.axis_error"]),
    PeerRow("gait, drive B: deepest foot, mm", &["gait.stiff.penetration"], &[], &["gait.stiff.penetration"]),
    PeerRow("the same: slip in stance, mm/s", &["gait.stiff.slip"], &[], &["gait.stiff.slip"]),
    same("20° incline, μ = 0.5: creep, mm/s", &["incline.creep"]),
    PeerRow(
        "35° incline: error of 2x/t² (ours: x at the time of the rates, at the end of the step)",
        &["incline.acceleration", "incline.acceleration_at_end"],
        &["incline.acceleration"],
        &["incline.acceleration"],
    ),
    same("stack of ten boxes, 5 s: sink, mm", &["stack.sink"]),
    same("1000 kg on 1 kg, 5 s: sink, mm", &["heavy.sink"]),
    PeerRow(
        "intermediate axis, 60 s: ΔE/E (MuJoCo: Euler, RK4)",
        &["dzhanibekov.energy"],
        &["dzhanibekov.euler.energy", "dzhanibekov.rk4.energy"],
        &["dzhanibekov.energy"],
    ),
    PeerRow(
        "the same: ΔL/L",
        &["dzhanibekov.momentum"],
        &["dzhanibekov.euler.momentum", "dzhanibekov.rk4.momentum"],
        &["dzhanibekov.momentum"],
    ),
    PeerRow(
        "the same: flips (22)",
        &["dzhanibekov.flips"],
        &["dzhanibekov.euler.flips", "dzhanibekov.rk4.flips"],
        &["dzhanibekov.flips"],
    ),
    PeerRow(
        "spatial chain, 10 s: largest ΔE, J (ours: first order, energy-momentum; MuJoCo: Euler, RK4)",
        &["chain8.first-order.energy", "chain8.energy-momentum.energy"],
        &["chain8.euler.energy", "chain8.rk4.energy"],
        &["chain8.energy"],
    ),
    PeerRow(
        "the same: ΔE at the end, J",
        &["chain8.first-order.energy_end", "chain8.energy-momentum.energy_end"],
        &["chain8.euler.energy_end", "chain8.rk4.energy_end"],
        &["chain8.energy_end"],
    ),
    PeerRow(
        "the same: tip at 1 s, mm",
        &["chain8.first-order.tip", "chain8.energy-momentum.tip"],
        &["chain8.euler.tip", "chain8.rk4.tip"],
        &["chain8.tip"],
    ),
    PeerRow(
        "1000 kg on a chain of 1 kg links, 10 s: gap, mm (ours: energy-momentum)",
        &["chain8_m1000.energy-momentum.gap"],
        &[],
        &["chain8_m1000.gap"],
    ),
    PeerRow(
        "the same: largest ΔE, J (MuJoCo: Euler, RK4)",
        &["chain8_m1000.energy-momentum.energy"],
        &["chain8_m1000.euler.energy", "chain8_m1000.rk4.energy"],
        &["chain8_m1000.energy"],
    ),
];

const fn same(what: &'static str, id: &'static [&'static str]) -> PeerRow {
    PeerRow(what, id, id, id)
}

/// The table as text; none where no peer was measured.
pub fn comparison(figures: &[Figure]) -> Option<String> {
    let peer = |name: &str| {
        let id = format!("rigid-body.peer.{name}.version");
        figures.iter().find(|f| f.id == id)?.what.split(": ").nth(1).map(str::to_owned)
    };
    let versions = [peer("mujoco"), peer("rapier")];
    if versions.iter().all(Option::is_none) {
        return None;
    }
    let [mujoco, rapier] = versions.map(|v| v.unwrap_or_else(|| "not measured".into()));
    let head = format!("| quantity | Terraglue | MuJoCo {mujoco} | Rapier {rapier} |\n|---|---|---|---|\n");
    let row = |PeerRow(what, ours, mujoco, rapier): &PeerRow| {
        let cells = [("", ours), ("peer.mujoco.", mujoco), ("peer.rapier.", rapier)];
        let [a, b, c] = cells.map(|(whose, ids)| cell(figures, whose, ids));
        format!("| {what} | {a} | {b} | {c} |\n")
    };
    Some(std::iter::once(head).chain(ROWS.iter().map(row)).collect())
}

fn cell(figures: &[Figure], whose: &str, ids: &[&str]) -> String {
    let value = |id: &&str| {
        let id = format!("rigid-body.{whose}{id}");
        let figure = figures.iter().find(|f| f.id == id);
        figure.map_or_else(
            || "-".into(),
            |f| if f.value.is_some() { f.value_text() } else { "diverges".into() },
        )
    };
    let values: Vec<String> = ids.iter().map(value).collect();
    if values.is_empty() { "-".into() } else { values.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Limit;

    #[test]
    fn figures_stand_beside_each_other() {
        let figure = |id: &str, value: f64, what: &str| {
            Figure::new(format!("rigid-body.{id}"), value, Limit::None, what)
        };
        let ours = figure("stack.sink", 0.25, "");
        assert_eq!(comparison(std::slice::from_ref(&ours)), None);
        let all = [
            ours,
            figure("peer.rapier.version", 36.0, "Rapier: 0.36"),
            figure("peer.rapier.stack.sink", 2.5, ""),
            Figure::skipped("rigid-body.peer.rapier.heavy.sink", "Rapier: sink: NaN"),
        ];
        let text = comparison(&all).unwrap_or_default();
        assert!(text.starts_with("| quantity | Terraglue | MuJoCo not measured | Rapier 0.36 |"));
        assert!(text.contains("sink, mm | 0.25 | - | 2.5 |"));
        assert!(text.contains("sink, mm | - | - | diverges |"));
    }
}
