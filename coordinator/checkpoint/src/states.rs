//! States of a testbed as bytes, for another testbed of the same scenario, in this process or another.

use crate::FORM;
use crate::origin::Origin;
use terraglue_diagnostics::Result;
use terraglue_engine::testbed::{Options, Testbed};
use terraglue_scenario::{InputError, Scenario};
use terraglue_subsystem::bytes::{self, Block};
use terraglue_subsystem::persist;

/// Mark of these bytes: a checkpoint holds a recorder, too.
const MARK: u64 = 0x7374_6174;

/// A state with what it belongs to.
struct State {
    origin: Origin,
    testbed: Block,
}
persist!(State { origin, testbed });

/// Gives and takes the states of testbeds of one scenario.
#[derive(Debug)]
pub struct States {
    origin: Origin,
    scenario: Scenario,
    options: Options,
}

impl States {
    /// Of a scenario as it is now.
    ///
    /// # Errors
    /// A module that cannot be found.
    pub fn of(scenario: &Scenario, options: &Options) -> Result<Self> {
        let origin = Origin::of(scenario, options)?;
        Ok(Self { origin, scenario: scenario.clone(), options: options.clone() })
    }

    /// The whole state of a testbed.
    ///
    /// # Errors
    /// A module that does not give its state as bytes.
    pub fn bytes(&self, testbed: &Testbed) -> Result<Vec<u8>> {
        let state = State { origin: self.origin.clone(), testbed: Block(testbed.serialize()?) };
        Ok(bytes::seal(FORM, MARK, &state))
    }

    /// Puts a testbed into a state.
    ///
    /// # Errors
    /// [`terraglue_diagnostics::Error::Input`]: the bytes are damaged, or of another scenario, version, file or module. A module that does
    /// not take its state.
    pub fn restore(&self, testbed: &mut Testbed, all: &[u8]) -> Result {
        let state: State = bytes::open(FORM, MARK, all).map_err(|_| {
            let message = format!(
                "these {} bytes are no state of a testbed, damaged, or of another version",
                all.len()
            );
            let help = "give the bytes as `serialize` has returned them, to the version that made them";
            InputError::plain(message, Some(help.into()))
        })?;
        state.origin.check_scenario(&self.origin)?;
        state.origin.check(&self.scenario, &self.options)?;
        testbed.deserialize(&state.testbed.0)
    }
}
