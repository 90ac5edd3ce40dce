//! Overlays and hidden shapes in recordings.

use super::*;
use foxglove::messages::SceneUpdate;
use prost::Message;
use terraglue_scenario::Scenario;

/// With the gait sitting on the body of the robot, which hides a shape for a while.
fn fixture(overlays: bool) -> Fixture {
    let mut fixture = Fixture::new("iterative");
    fixture.scenario.recording.overlays = overlays;
    let text =
        "[time]\nstep_s = 0.001\nduration_s = 1.0\n[gait]\nmodule = \"gait\"\nmount = \"robot.body\"\n";
    let mounted = Scenario::parse(text, "mounted.toml", &[]).expect("a scenario");
    fixture.scenario.subsystems[0].parameters = mounted.subsystems[0].parameters.clone();
    fixture.parts[1].1.hides = true;
    fixture
}

/// Times (s) and messages of the topics of scenes.
fn scenes(folder: &Path, topic: &str) -> Vec<(f64, SceneUpdate)> {
    let bytes = std::fs::read(folder.join(RECORDING)).expect("written");
    let messages = mcap::MessageStream::new(&bytes).expect("complete").map(|m| m.expect("whole"));
    let own = messages.filter(|m| m.channel.topic == topic);
    own.map(|m| (m.log_time as f64 * 1e-9, SceneUpdate::decode(&m.data[..]).expect("a scene"))).collect()
}

fn topics(folder: &Path) -> Vec<String> {
    let bytes = std::fs::read(folder.join(RECORDING)).expect("written");
    let mut all: Vec<String> = mcap::MessageStream::new(&bytes)
        .expect("complete")
        .map(|m| m.expect("whole").channel.topic.clone())
        .filter(|topic| topic.starts_with("/overlays"))
        .collect();
    all.sort();
    all.dedup();
    all
}

#[test]
fn overlays_are_asked_for_only_where_the_scenario_wants_them() {
    let f = folder();
    let mut fixture = fixture(false);
    fixture.recorded(f.path(), RecorderOptions::default(), 400);
    assert!(topics(f.path()).is_empty());
    assert!(fixture.parts.iter().all(|(_, part)| part.asked.get() == 0));
}

#[test]
fn every_layer_is_a_topic_in_the_frames_of_its_figures() {
    let f = folder();
    let mut fixture = fixture(true);
    fixture.recorded(f.path(), RecorderOptions::default(), 400);
    // fifty times a second, at the start and to 0.4 s
    assert!(fixture.parts.iter().all(|(_, part)| part.asked.get() == 21));
    let layers = ["gait/polygon", "gluing/residual", "robot/name", "robot/the_way"];
    assert_eq!(topics(f.path()), layers.map(|layer| format!("/overlays/{layer}")));
    let way = scenes(f.path(), "/overlays/robot/the_way");
    assert_eq!(way.len(), 21);
    let [entity] = &way[10].1.entities[..] else { panic!("one frame") };
    assert_eq!((entity.frame_id.as_str(), way[10].1.deletions.len()), ("robot/body", 1));
    let arrow = &entity.arrows[0];
    let length = f64::hypot(1.0, way[10].0);
    assert!((arrow.shaft_length + arrow.head_length - length).abs() < 1e-6);
    let polygon = scenes(f.path(), "/overlays/gait/polygon");
    let entity = &polygon[0].1.entities[0];
    assert_eq!(
        (entity.frame_id.as_str(), entity.lines.len(), entity.lines[0].points.len()),
        ("robot/body", 2, 2)
    );
    let far = entity.lines[1].points.iter().map(|p| f64::hypot(p.x / 0.2, p.y / 0.1));
    assert!(far.into_iter().all(|r| (r - 1.0).abs() < 1e-6));
    // a layer that comes later, in two frames; the figure in a frame that there is not is left out
    let name = scenes(f.path(), "/overlays/robot/name");
    assert!((name[0].0 - 0.26).abs() < 1e-9, "{}", name[0].0);
    let frames: Vec<&str> = name[0].1.entities.iter().map(|e| e.frame_id.as_str()).collect();
    assert_eq!(frames, ["robot/body", "world"]);
    assert_eq!(name[0].1.entities[0].texts[0].text, "walker");
    assert_eq!(name[0].1.entities[1].spheres.len(), 1);
    let residual = scenes(f.path(), "/overlays/gluing/residual");
    let standing = residual[5].1.entities[0].texts.len();
    assert!((3..=6).contains(&standing), "{standing} feet carry a force");
    assert!(residual[5].1.entities[0].texts.iter().all(|t| t.text == "0.0e0 m"));
}

#[test]
fn a_shape_that_is_hidden_is_not_drawn_until_it_is_shown_again() {
    let f = folder();
    fixture(false).recorded(f.path(), RecorderOptions::default(), 700);
    let all = scenes(f.path(), "/scene");
    let times: Vec<f64> = all.iter().map(|(t, _)| *t).collect();
    assert_eq!(all.len(), 3, "{times:?}");
    let spheres = |k: usize, id: &str| {
        let entity = all[k].1.entities.iter().find(|e| e.id == id);
        entity.map(|e| (e.spheres.len(), e.cubes.len()))
    };
    assert_eq!((times[0], spheres(0, "robot/LF4")), (0.0, Some((1, 0))));
    // only the body whose shape it is, at the first record that shows it
    assert!((times[1] - 0.3).abs() < 1e-9 && (times[2] - 0.6).abs() < 1e-9, "{times:?}");
    assert_eq!((all[1].1.entities.len(), spheres(1, "robot/LF4")), (1, Some((0, 0))));
    assert_eq!((all[2].1.entities.len(), spheres(2, "robot/LF4")), (1, Some((1, 0))));
}

#[test]
fn layers_and_hidden_shapes_go_on_from_a_checkpoint_to_the_same_bytes() {
    let whole = folder();
    fixture(true).recorded(whole.path(), RecorderOptions::default(), 700);
    let options = RecorderOptions { csv: false, checkpoints: true };
    // before and behind the layer that comes at 0.26 s, and between two records that meet a hidden shape
    for at in [199, 259, 261, 303, 401, 597] {
        let f = folder();
        fixture(true).recorded_twice(f.path(), options, at, 700);
        let read = |f: &Path| std::fs::read(f.join(RECORDING)).expect("written");
        assert!(read(whole.path()) == read(f.path()), "differs after step {at}");
    }
}
