//! `viewer_layout.json`: a layout for Foxglove and Lichtblick that shows this run: robot, relief and forces in 3-D, the
//! path of the body, energies, the joint of the report, and the events.

use crate::ground_points::GroundPoints;
use crate::layout::{VIEWER_LAYOUT, at};
use crate::{body_track, descriptor};
use serde_json::{Map, Value, json};
use std::path::Path;
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::View;
use terraglue_scenario::ReportSpec;

/// Writes the layout.
pub(crate) fn write(
    folder: &Path,
    view: &View,
    points: Option<&GroundPoints>,
    report: &ReportSpec,
) -> Result {
    let path = folder.join(VIEWER_LAYOUT);
    let text = format!("{:#}\n", layout(view, points, report));
    std::fs::write(&path, text).map_err(at(&path))
}

fn layout(view: &View, points: Option<&GroundPoints>, report: &ReportSpec) -> Value {
    let body = body_track::find_body(view, report.body.as_deref())
        .map(|(s, b)| (view.subsystems[s].name, view.subsystems[s].scene.bodies[b].name.as_str()));
    let joint = report.joint.as_deref().map(path).unwrap_or_default();
    let lines = ["angle", "angle_target", "torque"].map(|part| format!("{joint}.{part}"));
    let height = body.map(|(s, b)| path(&format!("{s}.{b}.z"))).into_iter().collect::<Vec<_>>();
    let energy =
        ["kinetic", "potential", "dissipated", "actuator_work"].map(|part| format!("/energy.{part}"));
    json!({
        "configById": {
            "3D!ground": three_d(points, body),
            "Plot!body": plot("Body", &height),
            "Plot!joint": plot("Joint", if joint.is_empty() { &[] } else { &lines }),
            "Plot!energy": plot("Energy", &energy),
            "RosOut!events": { "searchTerms": [], "minLogLevel": 1, "topicToRender": "/events" },
        },
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": { "speed": 1.0 },
        "layout": {
            "direction": "row",
            "splitPercentage": 65,
            "first": "3D!ground",
            "second": {
                "direction": "column",
                "splitPercentage": 50,
                "first": { "direction": "column", "first": "Plot!body", "second": "Plot!joint" },
                "second": { "direction": "column", "first": "Plot!energy", "second": "RosOut!events" },
            },
        },
    })
}

/// The path of a variable in the messages: `robot.2-wheel.angle` is `/robot._2_wheel.angle`.
fn path(name: &str) -> String {
    let (subsystem, rest) = name.split_once('.').unwrap_or((name, ""));
    let parts: Vec<String> = rest.split('.').map(descriptor::identifier).collect();
    format!("/{subsystem}.{}", parts.join("."))
}

fn three_d(points: Option<&GroundPoints>, body: Option<(&str, &str)>) -> Value {
    let mut topics = Map::new();
    for topic in ["/scene", "/contact_forces"] {
        topics.insert(topic.into(), json!({ "visible": true }));
    }
    topics.insert("/contact_forces/points".into(), json!({ "visible": false }));
    let tile = json!({ "visible": true, "colorMode": "rgba-fields", "pointShape": "square", "pointSize": 4 });
    for k in 0..points.map_or(0, GroundPoints::count) {
        topics.extend(points.map(|p| (p.topic(k), tile.clone())));
    }
    let follow = body.map(|(s, b)| format!("{s}/{b}"));
    json!({
        "cameraState": {
            "perspective": true, "distance": 3.0, "phi": 60, "thetaOffset": 45, "fovy": 45, "near": 0.01, "far": 5000,
            "target": [0, 0, 0], "targetOffset": [0, 0, 0], "targetOrientation": [0, 0, 0, 1],
        },
        "followMode": "follow-position",
        "followTf": follow,
        "scene": { "enableStats": false, "transforms": { "showLabel": false, "axisScale": 0 } },
        "topics": topics,
        "layers": {},
        "imageMode": {},
    })
}

fn plot(title: &str, paths: &[String]) -> Value {
    let one = |value: &String| json!({ "value": value, "enabled": true, "timestampMethod": "receiveTime" });
    json!({
        "title": title,
        "paths": paths.iter().map(one).collect::<Vec<_>>(),
        "xAxisVal": "timestamp",
        "showXAxisLabels": true,
        "showYAxisLabels": true,
        "showLegend": true,
        "legendDisplay": "floating",
        "isSynced": true,
        "sidebarDimension": 240,
    })
}
