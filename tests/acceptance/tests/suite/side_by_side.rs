//! Determinism: the same input gives the same bytes, whatever runs in parallel and with any number of threads.

use std::path::Path;
use terraglue::Testbed;
use terraglue::observer::Observer;
use terraglue::recording::{Recorder, RecorderOptions, Status};
use terraglue::scenario::Scenario;
use terraglue::testbed::Options;
use terraglue_acceptance::shipped;

struct Run {
    testbed: Testbed,
    recorder: Recorder,
}

impl Run {
    fn start(scenario: &Scenario, threads: usize, folder: &Path) -> Self {
        let options = Options { threads, ..Options::default() };
        let testbed =
            Testbed::build_with(scenario, &options, &terraglue::library()).unwrap_or_else(|e| panic!("{e}"));
        let mut recorder = Recorder::create(folder, scenario, RecorderOptions::default()).expect("folder");
        testbed.view(|v| recorder.started(v)).expect("started");
        Self { testbed, recorder }
    }

    fn advance(&mut self, until_s: f64) {
        self.testbed.run_until(until_s, &mut [&mut self.recorder]).unwrap_or_else(|e| panic!("{e}"));
    }

    fn finish(mut self, folder: &Path) -> Vec<u8> {
        self.testbed.view(|v| self.recorder.finished(v, None)).expect("finished");
        self.recorder.finish(0.0, 0.0, None, Status::Done).expect("closed");
        std::fs::read(folder.join("recording.mcap")).expect("recording")
    }
}

#[test]
fn two_testbeds_stepped_alternately_give_the_bytes_of_each_alone() {
    let scenarios = [
        shipped("moon_walk", &[("gluing.strategy", "iterative")]),
        shipped("sand_walk", &[("soil.module", "soil-bekker")]),
    ];
    let folder = tempfile::tempdir().expect("folder");
    let at = |name: &str, k: usize| folder.path().join(format!("{name}{k}"));
    let alone: Vec<_> = (0..2)
        .map(|k| {
            let mut run = Run::start(&scenarios[k], 1, &at("alone", k));
            run.advance(0.8);
            run.finish(&at("alone", k))
        })
        .collect();
    let mut together: Vec<_> = (0..2).map(|k| Run::start(&scenarios[k], 2, &at("together", k))).collect();
    for step in 1..=80 {
        together.iter_mut().for_each(|r| r.advance(f64::from(step) * 0.01));
    }
    for (k, run) in together.into_iter().enumerate() {
        assert!(run.finish(&at("together", k)) == alone[k], "recording {k} differs");
    }
}
