//! The plots of a report, each from what the recording happens to hold; what is missing is left out.

use crate::body_track::roll_pitch_yaw;
use crate::reader::Recording;
use crate::report::contact_owners::Owners;
use crate::report::figure::{Curve, Figure, MOST_POINTS, Panel};
use crate::report::footprints::Leg;

/// A contact that slips more than this at any time is a wheel or a foot on its way, and no plate test.
const SLIPS: f64 = 1e-6;

/// All figures that the recording has data for.
pub(crate) fn all(recording: &Recording, legs: &[Leg]) -> Vec<Figure> {
    let figures = [
        pressure(recording, legs),
        body(recording),
        forces(recording, legs),
        joints(recording),
        gluing(recording),
        energy(recording),
        contacts(recording, legs),
        soil(recording),
    ];
    figures.into_iter().flatten().collect()
}

fn body(recording: &Recording) -> Option<Figure> {
    let (name, poses) = recording.reported_body()?;
    let t = &poses.t_s;
    let axis = |k: usize| poses.position.iter().map(|p| p[k]).collect::<Vec<f64>>();
    let angles: Vec<[f64; 3]> = poses.orientation.iter().map(roll_pitch_yaw).collect();
    let angle = |k: usize| angles.iter().map(|a| a[k]).collect::<Vec<f64>>();
    let panels = vec![
        Panel::new("position", "m", vec![Curve::new("x", 0, t, axis(0)), Curve::new("y", 1, t, axis(1))]),
        Panel::new("height", "m", vec![Curve::new("z", 2, t, axis(2))]),
        Panel::new(
            "attitude",
            "rad",
            vec![
                Curve::new("roll", 0, t, angle(0)),
                Curve::new("pitch", 1, t, angle(1)),
                Curve::new("yaw", 2, t, angle(2)),
            ],
        ),
    ];
    let note =
        format!("{}: origin of the body frame in the world; z-y-x Euler angles.", name.replace('/', "."));
    Some(Figure { id: "body", title: "Body".into(), note, panels, ..Figure::default() })
}

fn forces(recording: &Recording, legs: &[Leg]) -> Option<Figure> {
    if legs.is_empty() {
        return None;
    }
    let made = recording.first_step();
    let t: Vec<f64> = recording.gluing[made..].iter().map(|g| g.t).collect();
    let curve = |(k, leg): (usize, &Leg)| Curve::new(leg.body.clone(), k, &t, leg.normal_n[made..].to_vec());
    let curves: Vec<Curve> = legs.iter().enumerate().map(curve).collect();
    let total =
        (made..recording.gluing.len()).map(|row| legs.iter().map(|l| l.normal_n[row]).sum()).collect();
    let mut panels = vec![Panel::new("normal force", "N", curves)];
    if legs.len() > 1 {
        panels.push(Panel::new("sum of normal forces", "N", vec![Curve::new("sum", 0, &t, total)]));
    }
    let note = "Force that the ground exerts along its normal, after commit.".into();
    Some(Figure { id: "forces", title: "Foot forces".into(), note, panels, ..Figure::default() })
}

/// Joints by `subsystem.joint` in the order of the recording.
fn joint_names(recording: &Recording) -> Vec<String> {
    let mut joints = Vec::new();
    for (subsystem, table) in &recording.variables {
        for name in table.names.iter().filter_map(|n| n.strip_suffix(".torque")) {
            if table.column(&format!("{name}.angle")).is_some() {
                joints.push(format!("{subsystem}.{name}"));
            }
        }
    }
    joints
}

fn joints(recording: &Recording) -> Option<Figure> {
    let names = joint_names(recording);
    let wanted = recording.header.get("report_joint");
    let chosen = names.iter().position(|n| n == wanted).or((!names.is_empty()).then_some(0))?;
    let mut panels = Vec::new();
    for (choice, joint) in names.iter().enumerate() {
        let curve = |part: &str, colour: usize, dashed: bool| {
            let (t, y) = recording.series(&format!("{joint}.{part}"))?;
            let known = y.iter().any(|v| v.is_finite());
            let name = part.replace('_', " ");
            known.then(|| Curve { dashed, ..Curve::new(name, colour, t, y.to_vec()) })
        };
        let rows = [
            ("torque", "N m", [("torque", false), ("torque_target", true)]),
            ("angular velocity", "rad/s", [("velocity", false), ("velocity_target", true)]),
            ("angle", "rad", [("angle", false), ("angle_target", true)]),
        ];
        for (row, (quantity, unit, parts)) in rows.into_iter().enumerate() {
            let mut curves: Vec<Curve> = parts
                .iter()
                .filter_map(|(part, target)| curve(part, if *target { 7 } else { row }, *target))
                .collect();
            // A target that is never set is not drawn.
            curves.retain(|c| !c.dashed || c.y.iter().any(|v| *v != 0.0));
            panels.push(Panel { choice: Some(choice), ..Panel::new(quantity, unit, curves) });
        }
    }
    let note = "Motor torque on the joint, angular velocity and angle; dashed: target.".into();
    Some(Figure { id: "joint", title: "Joint".into(), note, choices: names, chosen, panels })
}

fn gluing(recording: &Recording) -> Option<Figure> {
    let rows: Vec<_> = recording.gluing.iter().filter(|g| g.since_last.steps > 0).collect();
    if rows.iter().all(|g| g.since_last.evaluations_bodies == 0 && g.since_last.evaluations_soil == 0) {
        return None;
    }
    let t: Vec<f64> = rows.iter().map(|g| g.t).collect();
    let column = |f: &dyn Fn(&crate::WindowRecord) -> f64| -> Vec<f64> {
        rows.iter().map(|g| f(&g.since_last)).collect()
    };
    let steps = |name: &str, colour, y| Curve { steps: true, ..Curve::new(name, colour, &t, y) };
    let mut panels = vec![
        Panel::new(
            "evaluations per step",
            "",
            vec![
                steps("bodies", 0, column(&|w| f64::from(w.evaluations_bodies_max))),
                steps("soil", 1, column(&|w| f64::from(w.evaluations_soil_max))),
            ],
        ),
        Panel::new(
            "force difference",
            "N",
            vec![Curve::new("|T* − T1|", 1, &t, column(&|w| w.estimate_gap_n))],
        )
        .log(true),
    ];
    let mut note = String::from("Largest of all steps since the record before.");
    // of a single pass neither is meaningful
    if rows.iter().any(|g| g.since_last.max_gap_m.is_some()) {
        let gap = column(&|w| w.max_gap_m.unwrap_or(f64::NAN));
        panels.insert(1, Panel::new("gap", "m", vec![Curve::new("largest gap", 0, &t, gap)]).log(true));
        let difference = column(&|w| w.max_action_reaction_gap_n);
        panels[2].curves.insert(0, Curve::new("action–reaction gap", 0, &t, difference));
        note += " Gap: |x1 − x2| over closed ports after commit.";
    } else {
        note += " Gap and convergence: not applicable, a single pass makes no iterations.";
    }
    Some(Figure { id: "gluing", title: "Gluing".into(), note, panels, ..Figure::default() })
}

fn energy(recording: &Recording) -> Option<Figure> {
    let table = &recording.energy;
    let t = &table.t_s;
    let curve = |(k, (column, name)): (usize, (&str, &str))| {
        let y = table.column(column)?;
        y.iter().any(|v| *v != 0.0 && !v.is_nan()).then(|| Curve::new(name, k, t, y.to_vec()))
    };
    let parts = |names: &[(&'static str, &'static str)]| -> Vec<Curve> {
        names.iter().copied().enumerate().filter_map(curve).collect()
    };
    let state = parts(&[("kinetic", "kinetic"), ("potential", "potential")]);
    let work = parts(&[
        ("dissipated", "dissipated"),
        ("port_work", "work at ports (net)"),
        ("actuator_work", "work of the motors"),
    ]);
    let mut panels = Vec::new();
    for (quantity, curves) in [("energy", state), ("energy since the start", work)] {
        if !curves.is_empty() {
            panels.push(Panel::new(quantity, "J", curves));
        }
    }
    let note =
        "All subsystems together. Net work at ports would be zero if the glue neither made nor took any.";
    let figure =
        Figure { id: "energy", title: "Energy".into(), note: note.into(), panels, ..Figure::default() };
    (!figure.panels.is_empty()).then_some(figure)
}

/// Pressure over sinkage of what is pressed in without slipping, as a bevameter shows it: one curve a contact.
fn pressure(recording: &Recording, legs: &[Leg]) -> Option<Figure> {
    let (mut curves, owners) = (Vec::new(), Owners::new(recording, legs));
    for table in recording.variables.values() {
        for name in table.names.iter().filter_map(|n| n.strip_suffix(".mean_pressure")) {
            let of = |part: &str| table.column(&format!("{name}.{part}"));
            let (Some(sinkage), Some(pressure)) = (of("sinkage"), of("mean_pressure")) else { continue };
            let slips = of("slip").is_some_and(|slip| slip.iter().any(|s| s.abs() > SLIPS));
            // before the first touch and in the air there is no pressure
            let loaded = sinkage.iter().zip(pressure).filter(|(_, p)| **p > 0.0);
            let (x, y): (Vec<f64>, Vec<f64>) = loaded.map(|(z, p)| (*z, *p)).unzip();
            if !slips && x.len() > 1 {
                let (x, y) = (spread_out(&x), spread_out(&y));
                let (label, colour) = owners.of(name, curves.len());
                curves.push(Curve::new(label, colour, &x, y));
            }
        }
    }
    let across = Some(("sinkage".to_owned(), "m".to_owned()));
    let panel = Panel { across, ..Panel::new("mean pressure", "Pa", curves) };
    let note =
        "Mean pressure below each contact over its sinkage, loading and unloading; from the outputs of the soil.".into();
    let title = "Pressure over sinkage".into();
    let figure = Figure { id: "pressure", title, note, panels: vec![panel], ..Figure::default() };
    (!figure.panels[0].curves.is_empty()).then_some(figure)
}

/// Every n-th value and the last, so that no more than [`MOST_POINTS`] are left.
fn spread_out(values: &[f64]) -> Vec<f64> {
    let every = values.len().div_ceil(MOST_POINTS - 1).max(1);
    let last = values.last().filter(|_| !(values.len() - 1).is_multiple_of(every));
    values.iter().step_by(every).chain(last).copied().collect()
}

/// Contact outputs of a soil, per wheel and foot: one panel per quantity, one curve per contact.
fn contacts(recording: &Recording, legs: &[Leg]) -> Option<Figure> {
    let owners = Owners::new(recording, legs);
    let shown = [("slip", ""), ("sinkage", "m"), ("mean_pressure", "Pa"), ("largest_pressure", "Pa")];
    let shown = shown.into_iter().chain([("area", "m²"), ("pull", "N"), ("torque", "N m"), ("power", "W")]);
    let panel = |(quantity, unit): (&'static str, &'static str)| {
        let mut curves = Vec::new();
        for table in recording.variables.values() {
            for (name, y) in table.names.iter().zip(&table.columns) {
                let contact = name.strip_suffix(quantity).and_then(|n| n.strip_suffix('.'));
                if let Some(contact) = contact.filter(|c| c.starts_with("contact")) {
                    let (label, colour) = owners.of(contact, curves.len());
                    curves.push(Curve::new(label, colour, &table.t_s, y.clone()));
                }
            }
        }
        Panel::new(&quantity.replace('_', " "), unit, curves)
    };
    let panels: Vec<Panel> = shown.map(panel).filter(|p| !p.curves.is_empty()).collect();
    let note = "Outputs of the soil after each commit; contacts in the order of their first touch.".into();
    let figure =
        Figure { id: "contacts", title: "Wheels and feet".into(), note, panels, ..Figure::default() };
    (!figure.panels.is_empty()).then_some(figure)
}

fn soil(recording: &Recording) -> Option<Figure> {
    let mut curves = Vec::new();
    for (subsystem, table) in &recording.variables {
        for (name, y) in table.names.iter().zip(&table.columns) {
            let counts = ["active", "visited"].iter().any(|w| name.contains(w));
            if counts && y.iter().any(|v| *v != 0.0) {
                let label = format!("{subsystem}: {}", name.replace('_', " "));
                curves.push(Curve { steps: true, ..Curve::new(label, curves.len(), &table.t_s, y.clone()) });
            }
        }
    }
    let panels = vec![Panel::new("nodes", "", curves).log(false)];
    let note = "Nodes of the ground that moved or were looked at; none on ground at rest.".into();
    let figure = Figure { id: "soil", title: "Soil activity".into(), note, panels, ..Figure::default() };
    (!figure.panels[0].curves.is_empty()).then_some(figure)
}
