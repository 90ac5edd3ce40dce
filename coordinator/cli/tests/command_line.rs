//! The program as it is called: exit codes, messages and a closed pipe.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_terraglue"));
    command.args(arguments).current_dir(root());
    command
}

fn run(arguments: &[&str]) -> (Option<i32>, String) {
    let Output { status, stderr, .. } = program(arguments).output().expect("started");
    (status.code(), String::from_utf8_lossy(&stderr).into_owned())
}

#[test]
fn a_closed_pipe_ends_quietly() {
    let mut child = program(&["soils", "--file", "models/soils.csv"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    drop(child.stdout.take());
    let done = child.wait_with_output().expect("ended");
    assert_eq!((done.status.code(), done.stderr.is_empty()), (Some(0), true), "{done:?}");
}

#[test]
fn a_file_that_is_no_recording_is_refused_and_kept() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("recording.mcap");
    for content in ["", "no magic at all"] {
        std::fs::write(&path, content).expect("written");
        let (code, message) = run(&["report", &folder.path().display().to_string()]);
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains("recording.mcap"), "{message}");
        assert_eq!(std::fs::read_to_string(&path).expect("kept"), content);
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 1);
    }
}

#[test]
fn only_a_soil_takes_the_place_of_a_soil() {
    let scenario = "scenarios/plate_sinkage.toml";
    for arguments in [
        ["compare", scenario, "--soils", "gait"],
        ["run", scenario, "--set", "soil.module=gait"],
        ["check", scenario, "--set", "soil.module=gait"],
    ] {
        let (code, message) = run(&arguments);
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains("`gait` is no soil") && message.contains("soil-bekker"), "{message}");
    }
}

#[test]
fn a_terrain_without_soil_is_mentioned() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("no_soil.toml");
    let text = std::fs::read_to_string(root().join("scenarios/plate_sinkage.toml")).expect("there");
    let model = root().join("models").canonicalize().expect("there");
    let text = text.replace("../models", &model.display().to_string());
    let soil = text.find("[soil]").expect("a soil");
    let next = text.find("[bevameter]").expect("a robot");
    std::fs::write(&path, format!("{}{}", &text[..soil], &text[next..])).expect("written");
    let (code, message) = run(&["check", &path.display().to_string()]);
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("terrain is not used: no subsystem of kind soil"), "{message}");
    let (_, message) = run(&["check", "scenarios/plate_sinkage.toml"]);
    assert!(!message.contains("terrain is not used"), "{message}");
}
