//! The balance of energies of whole runs: a foot or a wheel on a rig of four joints is pressed, dragged, twisted, rolled and
//! yawed on both soils, glued by four strategies, on three grids. Soil, bodies and motors must account for every joule: the
//! drift is at most 1 % of the work of the motors.

use crate::parallel::in_parallel;
use crate::process::{Outcome, run_scenario, write};
use crate::{Context, Figure, Limit};
use serde_json::Value;
use terraglue_numerics::extremes::larger;

const SOILS: [&str; 2] = ["soil-bekker", "soil-cellular-automaton"];
const STRATEGIES: [&str; 4] = ["cooperative", "cooperative-compliant", "iterative", "xt-newton"];
const ROWS: [&str; 4] = ["lunar_nominal_Apollo", "LETE_sand", "snow_US_Harrison", "clayey_Thai38_K010"];
const SPACINGS: [f64; 3] = [0.02, 0.01, 0.005];

/// Motion of the rig.
struct Way {
    name: &'static str,
    shape: &'static str,
    /// Lowest point below the middle of the shape, m.
    low: f64,
    /// m/s, rad/s, rad/s.
    travel: f64,
    turn: f64,
    roll: f64,
    /// Angle between the plane of the wheel and the way, degrees.
    yaw: f64,
}

const SPHERE: &str = r#"<sphere radius="0.03"/>"#;
const DISC: &str = r#"<cylinder radius="0.04" length="0.04"/>"#;
const BOX: &str = r#"<box size="0.08 0.05 0.04"/>"#;
const WHEEL: &str = r#"<cylinder radius="0.092" length="0.107"/>"#;
const fn foot(name: &'static str, shape: &'static str, low: f64, travel: f64, turn: f64) -> Way {
    Way { name, shape, low, travel, turn, roll: 0.0, yaw: 0.0 }
}
/// A wheel at a slip (rolling radius 92 mm, 0.1 m/s) and a yaw.
const fn wheel(name: &'static str, roll: f64, yaw: f64) -> Way {
    Way { name, shape: WHEEL, low: 0.092, travel: 0.1, turn: 0.0, roll, yaw }
}
const WAYS: [Way; 12] = [
    foot("press_sphere", SPHERE, 0.03, 0.0, 0.0),
    foot("press_box", BOX, 0.02, 0.0, 0.0),
    foot("drag_sphere", SPHERE, 0.03, 0.1, 0.0),
    foot("drag_box", BOX, 0.02, 0.1, 0.0),
    foot("drag_disc", DISC, 0.02, 0.1, 0.0),
    foot("twist_box", BOX, 0.02, 0.0, 1.0),
    wheel("roll_braked", 0.1 * 0.5 / 0.092, 0.0),
    wheel("roll_0", 0.1 / 0.092, 0.0),
    wheel("roll_0.5", 0.1 / 0.5 / 0.092, 0.0),
    wheel("roll_0.9", 1.0 / 0.092, 0.0),
    wheel("yaw_15", 0.1 / 0.8 / 0.092, 15.0),
    wheel("yaw_30", 0.1 / 0.8 / 0.092, 30.0),
];

struct EnergyCase {
    way: usize,
    soil: &'static str,
    strategy: &'static str,
    row: &'static str,
    spacing: f64,
}

impl EnergyCase {
    fn id(&self) -> String {
        let millimetres = (1e3 * self.spacing).round();
        format!("{}.{}.{}.{}.{millimetres}mm", WAYS[self.way].name, self.soil, self.strategy, self.row)
    }

    fn run(&self, context: &Context) -> Outcome<Value> {
        self.run_with(context, 1e-3)
    }

    /// A run in steps of `h` (s).
    fn run_with(&self, context: &Context, h: f64) -> Outcome<Value> {
        let (way, id) = (&WAYS[self.way], format!("{}.{h}", self.id()));
        let folder = context.scratch.join(format!("energy.{id}"));
        write(&folder.join("rig.urdf"), &way.model())?;
        write(&folder.join("rig.toml"), &self.scenario(h))?;
        let scenario = folder.join("rig.toml").display().to_string();
        run_scenario(&context.program, &id, &scenario, &folder.join("out"), &[])
    }

    fn scenario(&self, h: f64) -> String {
        let Way { low, travel, turn, roll, .. } = WAYS[self.way];
        // 64.7 N on a wheel, 20 N on a foot, the load that weak snow carries; fork, mount and foot weigh 9.81 N
        let load = match (WAYS[self.way].shape == WHEEL, self.row.starts_with("snow")) {
            (true, false) => 64.7,
            (true, true) => 20.0,
            (false, false) => 20.0,
            (false, true) => 6.0,
        } - 9.81;
        // k_u of snow: Wong (2008) gives A_u = 109.6 MPa/m² at 2 cm
        let stiff = if self.row.starts_with("snow") { "elastic_stiffness_pa_m = 2.2e6\n" } else { "" };
        format!(
            "[time]\nstep_s = {h:?}\nduration_s = 0.6\n[world]\ngravity_m_s2 = [0.0, 0.0, -9.81]\n\
             [terrain]\nkind = \"flat\"\nsize_m = [0.8, 0.6]\nspacing_m = {:?}\n[gluing]\nstrategy = \"{}\"\n\
             [soil]\nmodule = \"{}\"\nparameters = \"{}\"\n{stiff}\
             [rig]\nmodule = \"rigid-body\"\nmodel = \"rig.urdf\"\nposition_m = [-0.1, 0.0013, {low:?}]\nfixed_base = true\n\
             motor = {{ travel = \"velocity\", press = \"torque\", turn = \"velocity\", roll = \"velocity\" }}\n\
             max_torque = 5000.0\nvelocity_target = {{ travel = {travel:?}, turn = {turn:?}, roll = {roll:?} }}\n\
             torque_target = {{ press = {load:?} }}\n",
            self.spacing, self.strategy, self.soil, self.row
        )
    }
}

impl Way {
    /// A carriage along x, a fork that slides down, a mount that turns about z, and the shape that rolls about its y axis.
    fn model(&self) -> String {
        let link = |name: &str, mass: f64, more: &str| {
            format!(
                r#"<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0"
                izz="0.002"/></inertial>{more}</link>"#
            )
        };
        let joint = |name: &str, kind: &str, [parent, child]: [&str; 2], axis: &str, yaw: f64| {
            format!(
                r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin rpy="0 0 {yaw}"/>
                <axis xyz="{axis}"/><limit lower="-10" upper="10" effort="5000" velocity="100"/></joint>"#
            )
        };
        let lying = if self.shape == WHEEL { "1.5707963267948966 0 0" } else { "0 0 0" };
        let shape =
            format!(r#"<collision><origin rpy="{lying}"/><geometry>{}</geometry></collision>"#, self.shape);
        [
            r#"<robot name="rig"><link name="frame"/>"#.to_owned(),
            joint("travel", "prismatic", ["frame", "carriage"], "1 0 0", 0.0),
            link("carriage", 2.0, ""),
            joint("press", "prismatic", ["carriage", "fork"], "0 0 -1", 0.0),
            link("fork", 0.3, ""),
            joint("turn", "continuous", ["fork", "mount"], "0 0 1", 0.0),
            link("mount", 0.1, ""),
            joint("roll", "continuous", ["mount", "foot"], "0 1 0", self.yaw.to_radians()),
            link("foot", 0.6, &shape),
            "</robot>".to_owned(),
        ]
        .concat()
    }
}

/// Every case; quickly 24 that have each way, soil, strategy and row, on the coarser grids.
fn cases(quick: bool) -> Vec<EnergyCase> {
    let mut all = Vec::new();
    if quick {
        for k in 0..24_usize {
            // steps that go through all combinations of soil, strategy and row; coarse grids are quicker
            all.push(of([k % WAYS.len(), (k / 2) % 2, (k + k / 4) % 4, (k + k / 8) % 4, k % 2]));
        }
        return all;
    }
    for way in 0..WAYS.len() {
        for soil in 0..SOILS.len() {
            for strategy in 0..STRATEGIES.len() {
                for row in 0..ROWS.len() {
                    all.extend((0..SPACINGS.len()).map(|grid| of([way, soil, strategy, row, grid])));
                }
            }
        }
    }
    all
}

fn of([way, soil, strategy, row, grid]: [usize; 5]) -> EnergyCase {
    EnergyCase {
        way,
        soil: SOILS[soil],
        strategy: STRATEGIES[strategy],
        row: ROWS[row],
        spacing: SPACINGS[grid],
    }
}

/// The largest drift of each way over its soils, strategies, rows and grids.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let cases = cases(context.quick);
    let runs = in_parallel(&cases, |case| case.run(context)).into_iter().collect::<Outcome<Vec<_>>>()?;
    let drift = |run: &Value| {
        let number = |key: &str| run[key].as_f64().unwrap_or(f64::NAN);
        let (drift, work) = (number("energy_balance_j"), number("energy_j"));
        let done = run["status"] == "done";
        if !done {
            f64::NAN
        } else if drift.abs() <= 1e-9 {
            0.0
        } else {
            100.0 * drift.abs() / work
        }
    };
    let mut all = dragged(context)?;
    for (k, way) in WAYS.iter().enumerate() {
        let of_way = cases.iter().zip(&runs).filter(|(case, _)| case.way == k);
        let worst = of_way.clone().max_by(|a, b| drift(a.1).total_cmp(&drift(b.1)));
        let Some((case, run)) = worst else { continue };
        let what = format!(
            "largest drift of the energy ledger, % of the work of the motors, {} runs; {}{}",
            of_way.count(),
            case.id(),
            run["error"].as_str().map(|e| format!(": {e}")).unwrap_or_default()
        );
        let form = if context.quick { "" } else { "long." };
        all.push(Figure::new(
            format!("soil.energy.{form}{}", way.name),
            drift(run),
            Limit::AtMost(1.0),
            what,
        ));
    }
    Ok(all)
}

/// A foot dragged by the single pass against the iteration, at two steps.
fn dragged(context: &Context) -> Outcome<Vec<Figure>> {
    let rows = ["LETE_sand", "clayey_Thai38_K010"];
    let ways = ["drag_sphere", "drag_disc"];
    let steps: &[f64] = if context.quick { &[1e-3] } else { &[2e-3, 1e-3, 5e-4, 2.5e-4] };
    let mut cases = Vec::new();
    for name in ways {
        let Some(way) = WAYS.iter().position(|w| w.name == name) else { continue };
        for row in rows {
            for strategy in ["cooperative", "iterative"] {
                let case = || EnergyCase { way, soil: SOILS[0], strategy, row, spacing: 0.01 };
                cases.extend(steps.iter().map(|h| (case(), *h)));
            }
        }
    }
    let runs = in_parallel(&cases, |(case, h)| case.run_with(context, *h))
        .into_iter()
        .collect::<Outcome<Vec<_>>>()?;
    let mut all = Vec::new();
    for (name, row) in ways.iter().flat_map(|w| rows.map(|r| (*w, r))) {
        let of = |strategy: &str, h: f64| {
            let is = |(c, step): &&(EnergyCase, f64)| {
                WAYS[c.way].name == name && c.row == row && c.strategy == strategy && *step == h
            };
            cases.iter().position(|c| is(&c)).map_or(&Value::Null, |k| &runs[k])
        };
        let sinkage = |run: &Value| run["max_sinkage_m"].as_f64().unwrap_or(f64::NAN);
        let heat = |run: &Value| run["energies"]["soil_heat_j"].as_f64().unwrap_or(f64::NAN);
        let apart = |quantity: fn(&Value) -> f64| {
            100.0 * (quantity(of("cooperative", 1e-3)) / quantity(of("iterative", 1e-3)) - 1.0).abs()
        };
        let what = format!(
            "{name} in {row}: sinkage and heat of the soil by cooperative against iterative at 1 ms, %"
        );
        let worst = larger(apart(sinkage), apart(heat));
        all.push(Figure::new(format!("soil.{name}.{row}.strategies"), worst, Limit::AtMost(5.0), what));
        if !context.quick {
            let at = |quantity: fn(&Value) -> f64| {
                steps.iter().map(|h| quantity(of("cooperative", *h))).collect::<Vec<_>>()
            };
            all.extend(convergence(name, row, &at(sinkage), &at(heat)));
        }
    }
    Ok(all)
}

/// How sinkage (m) and heat (J) of a dragged foot converge over steps that halve from 2 ms on.
///
/// A sphere rides on the soil that it meets: its sinkage has an order, its heat is within the contribution of single nodes
/// as they come under it (4 % on a lattice of 10 mm, 1 % on 2.5 mm). A flat disc sinks until it is carried, whatever the
/// step: its sinkage has converged, its heat has an order.
fn convergence(name: &str, row: &str, sinkage: &[f64], heat: &[f64]) -> Vec<Figure> {
    let figure = |end: &str, value: f64, limit: Limit, what: &str| {
        let what = format!("{name} in {row}: {what} by cooperative in steps of 2 to 0.25 ms");
        Figure::new(format!("soil.{name}.{row}.{end}"), value, limit, what)
    };
    let apart = |values: &[f64]| {
        let [low, high] = [f64::min, f64::max].map(|of| values.iter().copied().fold(values[0], of));
        100.0 * (high / low - 1.0)
    };
    if name == "drag_disc" {
        return vec![
            figure("order", order(heat), Limit::AtLeast(0.9), "order of the heat of the soil"),
            figure("sinkage", apart(sinkage), Limit::AtMost(0.1), "largest over smallest sinkage, %,"),
        ];
    }
    vec![
        figure("order", order(sinkage), Limit::AtLeast(0.9), "order of the sinkage"),
        figure("heat", apart(heat), Limit::AtMost(5.0), "largest over smallest heat of the soil, %,"),
    ]
}

/// Richardson's order from the last three values, without a reference.
fn order(values: &[f64]) -> f64 {
    match values {
        [.., a, b, c] => ((a - b) / (b - c)).abs().log2(),
        _ => f64::NAN,
    }
}
