//! JSON schemas of the topics, as text that goes into the recording.
//!
//! `/tf`, `/scene`, `/ground` and `/events` follow message types that robotics viewers know by name; nothing is
//! referenced, everything is written out, because viewers do not resolve references.

use crate::recording::snapshot::{ScalarKind, Scalars};
use serde_json::{Map, Value, json};

/// Topic, name of the schema, and its text.
pub(crate) struct Topic {
    pub topic: String,
    pub schema: String,
    pub text: String,
}

impl Topic {
    fn new(topic: &str, schema: &str, body: Value) -> Self {
        Self { topic: topic.into(), schema: schema.into(), text: body.to_string() }
    }
}

fn object(properties: Value) -> Value {
    json!({ "type": "object", "properties": properties })
}

fn list(items: Value) -> Value {
    json!({ "type": "array", "items": items })
}

fn number(description: &str) -> Value {
    json!({ "type": "number", "description": description })
}

fn maybe(what: &str) -> Value {
    json!({ "type": ["number", "null"], "description": what })
}

fn time(title: &str) -> Value {
    let mut time = object(json!({
        "sec": { "type": "integer" },
        "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 },
    }));
    time["title"] = title.into();
    time
}

fn titled(title: &str, mut schema: Value) -> Value {
    schema["title"] = title.into();
    schema
}

fn vector3() -> Value {
    let axes = json!({ "x": { "type": "number" }, "y": { "type": "number" }, "z": { "type": "number" } });
    titled("foxglove.Vector3", object(axes))
}

fn quaternion() -> Value {
    let n = json!({ "type": "number" });
    titled("foxglove.Quaternion", object(json!({ "x": n, "y": n, "z": n, "w": n })))
}

fn pose() -> Value {
    titled("foxglove.Pose", object(json!({ "position": vector3(), "orientation": quaternion() })))
}

fn color() -> Value {
    let n = json!({ "type": "number" });
    titled("foxglove.Color", object(json!({ "r": n, "g": n, "b": n, "a": n })))
}

/// `/tf`: pose of every body's frame in the world.
pub(crate) fn transforms() -> Topic {
    let one = object(json!({
        "timestamp": time("time"),
        "parent_frame_id": { "type": "string" },
        "child_frame_id": { "type": "string" },
        "translation": vector3(),
        "rotation": quaternion(),
    }));
    let all = json!({ "transforms": list(titled("foxglove.FrameTransform", one)) });
    Topic::new("/tf", "foxglove.FrameTransforms", titled("foxglove.FrameTransforms", object(all)))
}

/// `/scene`: the shapes of all bodies, fixed to the frames of `/tf`.
pub(crate) fn scene() -> Topic {
    let solid = |title: &str, extra: Value| {
        let mut primitive = object(json!({ "pose": pose(), "size": vector3(), "color": color() }));
        if let (Some(p), Value::Object(extra)) = (primitive["properties"].as_object_mut(), extra) {
            p.extend(extra);
        }
        list(titled(title, primitive))
    };
    let scale = json!({ "bottom_scale": { "type": "number" }, "top_scale": { "type": "number" } });
    let triangles = object(json!({
        "pose": pose(),
        "points": list(titled("foxglove.Point3", vector3())),
        "color": color(),
        "colors": list(color()),
        "indices": list(json!({ "type": "integer", "minimum": 0 })),
    }));
    let empty = list(json!({ "type": "object" }));
    let entity = object(json!({
        "timestamp": time("time"),
        "frame_id": { "type": "string" },
        "id": { "type": "string" },
        "lifetime": time("duration"),
        "frame_locked": { "type": "boolean" },
        "metadata": list(object(json!({ "key": { "type": "string" }, "value": { "type": "string" } }))),
        "arrows": empty,
        "cubes": solid("foxglove.CubePrimitive", json!({})),
        "spheres": solid("foxglove.SpherePrimitive", json!({})),
        "cylinders": solid("foxglove.CylinderPrimitive", scale),
        "lines": empty,
        "triangles": list(titled("foxglove.TriangleListPrimitive", triangles)),
        "texts": empty,
        "models": empty,
    }));
    let deletion = object(json!({
        "timestamp": time("time"), "type": { "type": "integer" }, "id": { "type": "string" },
    }));
    let update = object(json!({
        "deletions": list(titled("foxglove.SceneEntityDeletion", deletion)),
        "entities": list(titled("foxglove.SceneEntity", entity)),
    }));
    Topic::new("/scene", "foxglove.SceneUpdate", titled("foxglove.SceneUpdate", update))
}

/// `/ground`: height and sinkage on a lattice; a node is the centre of a cell.
pub(crate) fn ground() -> Topic {
    let count = json!({ "type": "integer", "minimum": 0 });
    let n = json!({ "type": "number" });
    let field = object(json!({ "name": { "type": "string" }, "offset": count, "type": count }));
    let grid = object(json!({
        "timestamp": time("time"),
        "frame_id": { "type": "string" },
        "pose": pose(),
        "column_count": count,
        "cell_size": titled("foxglove.Vector2", object(json!({ "x": n, "y": n }))),
        "row_stride": count,
        "cell_stride": count,
        "fields": list(titled("foxglove.PackedElementField", field)),
        "data": { "type": "string", "contentEncoding": "base64" },
    }));
    Topic::new("/ground", "foxglove.Grid", titled("foxglove.Grid", grid))
}

/// `/events`: what happened, as log lines.
pub(crate) fn events() -> Topic {
    let log = object(json!({
        "timestamp": time("time"),
        "level": { "type": "integer" },
        "message": { "type": "string" },
        "name": { "type": "string" },
        "file": { "type": "string" },
        "line": { "type": "integer" },
        "t_s": number("simulated time, s"),
        "what": { "type": "string", "description": "what happened, as it can be written back into a scenario" },
    }));
    Topic::new("/events", "foxglove.Log", titled("foxglove.Log", log))
}

/// `/<subsystem>`: time and all scalar variables by name, with unit and help.
pub(crate) fn variables(scalars: &Scalars) -> Topic {
    let mut properties = Map::new();
    properties.insert("t".into(), json!({ "type": "number", "description": "simulated time", "unit": "s" }));
    for column in &scalars.columns {
        let mut p = match &column.kind {
            ScalarKind::Real => json!({ "type": "number" }),
            ScalarKind::Integer => json!({ "type": "integer" }),
            ScalarKind::Bool => json!({ "type": "boolean" }),
            ScalarKind::Enumeration(names) => json!({ "type": "integer", "names": names }),
        };
        p["description"] = column.help.as_str().into();
        p["unit"] = column.unit.as_str().into();
        properties.insert(column.name.clone(), p);
    }
    let name = format!("terraglue.Variables.{}", scalars.name);
    Topic::new(&format!("/{}", scalars.name), &name, titled(&name, object(Value::Object(properties))))
}

/// `/energy`: kinetic, potential, dissipated energy and work, J; the sum and each subsystem.
pub(crate) fn energy() -> Topic {
    let joule = |what: &str| json!({ "type": ["number", "null"], "description": format!("{what}; null: unknown"), "unit": "J" });
    let body = object(json!({
        "t": number("simulated time, s"),
        "kinetic": joule("kinetic energy of all subsystems"),
        "potential": joule("potential energy of all subsystems"),
        "dissipated": joule("turned into heat since the start"),
        "port_work": joule("work done on the subsystems through their ports since the start"),
        "actuator_work": joule("mechanical work of the motors since the start"),
        "electrical": joule("electrical energy drawn by the motors since the start"),
    }));
    Topic::new("/energy", "terraglue.Energy", titled("terraglue.Energy", body))
}

/// `/gluing`: how the recorded step was glued, its ports, and the extremes since the message before.
pub(crate) fn gluing() -> Topic {
    let count = json!({ "type": "integer" });
    let numbers = list(json!({ "type": "number" }));
    let port = object(json!({
        "key": { "type": "string", "description": "stable key of the port" },
        "subsystem": { "type": "string" },
        "body": { "type": "string" },
        "shape": count,
        "origin": vector3(),
        "frame": numbers,
        "wrench": { "type": "array", "items": { "type": "number" },
            "description": "on the body along n, t1, t2, N, and about them, N m" },
        "t_star_n": number("normal force of the rigid-contact estimate, N"),
        "gap_m": number("signed gap along n after commit, m; > 0 apart"),
    }));
    let window = object(json!({
        "steps": count,
        "evaluations_bodies": count,
        "evaluations_bodies_max": count,
        "evaluations_soil": count,
        "evaluations_soil_max": count,
        "not_converged": count,
        "max_gap_m": maybe("m; null for a single pass at contacts"),
        "max_action_reaction_gap_n": number("N"),
        "estimate_gap_n": number("N"),
        "interface_work_error_j": maybe("sum of magnitudes, J; null: unknown"),
    }));
    let body = object(json!({
        "t": number("simulated time, s"),
        "evaluations_bodies": count,
        "evaluations_soil": count,
        "evaluations_line_search": count,
        "evaluations_jacobian": count,
        "jacobian_refreshes": count,
        "halvings": count,
        "converged": { "type": ["boolean", "null"], "description": "null: a single pass has no tolerance" },
        "xt_form": { "type": "boolean" },
        "max_gap_m": maybe("largest gap over the closed ports, m; null for a single pass at contacts"),
        "max_action_reaction_gap_n": number("N"),
        "residual": number("|Λe| / T_ref at the end"),
        "complementarity_n": number("N"),
        "kappa_max": number("largest eigenvalue of K·G1"),
        "estimate_gap_n": number("largest |T* - T1| along n, N"),
        "interface_work_error_j": maybe("J; null: unknown"),
        "rank": count,
        "size": count,
        "ports": list(port),
        "since_last": window,
    }));
    Topic::new("/gluing", "terraglue.StepReport", titled("terraglue.StepReport", body))
}
