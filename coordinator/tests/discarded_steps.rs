//! A step that several subsystems discard at once is halved once, not once for each of them.

use std::sync::Arc;
use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue::testbed::Options;
use terraglue_subsystem::{
    Capabilities, Config, Error, Host, Input, Kind, Module, Parameter, Response, Result, Schema, Step,
    Subsystem,
};

/// A subsystem that makes no step longer than it likes.
struct Short {
    longest: f64,
}

impl Module for Short {
    fn schema() -> Schema {
        Schema {
            name: "short".into(),
            kind: Kind::Controller,
            help: "Discards long steps".into(),
            parameters: vec![Parameter::number("longest_s", "s", 1.0, "Longest step").positive()],
        }
    }

    fn instantiate(config: &Config, _: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self { longest: config.number("longest_s")? }))
    }
}

impl Subsystem for Short {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY
    }

    fn advance(&mut self, step: &Step, _: &Input, _: &mut Response) -> Result {
        if step.h > self.longest {
            return Err(Error::Discard { reached: step.t + self.longest });
        }
        Ok(())
    }
}

/// Communication steps in a nominal step of 1 s of subsystems with these longest steps, s.
fn parts(longest: &[f64]) -> u64 {
    let mut text = "[time]\nstep_s = 1.0\nduration_s = 1.0\n".to_owned();
    for (k, longest) in longest.iter().enumerate() {
        text += &format!("[s{k}]\nmodule = \"short\"\nlongest_s = {longest}\n");
    }
    let scenario = Scenario::parse(&text, "discarded_steps.toml", &[]).expect("scenario");
    let options = Options { threads: 1, ..Options::default() };
    let library = terraglue::library().with::<Short>();
    let mut testbed = Testbed::build_with(&scenario, &options, &library).unwrap_or_else(|e| panic!("{e}"));
    testbed.step().unwrap_or_else(|e| panic!("{e}"));
    testbed.step_index()
}

#[test]
fn a_step_is_as_short_as_the_shortest_needs_and_no_shorter() {
    assert_eq!(parts(&[2.0, 2.0, 2.0]), 1);
    assert_eq!(parts(&[2.0, 0.6, 2.0]), 2);
    assert_eq!(parts(&[0.6, 0.6, 0.6]), 2);
    assert_eq!(parts(&[0.6, 0.3, 0.6]), 4);
}
