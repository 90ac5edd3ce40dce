//! Descriptions of both versions, and archives around them.

use crate::zip::{Entry, archive};
use crate::{DESCRIPTION, LIBRARIES};

/// An FMU of FMI 2.0.
pub const TWO: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">
<CoSimulation modelIdentifier="m" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="x" valueReference="0" causality="output"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="1"/></Outputs></ModelStructure>
</fmiModelDescription>"#;

/// An FMU of FMI 3.0.
pub const THREE: &str = r#"<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="g">
<CoSimulation modelIdentifier="m" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Float64 name="x" valueReference="1" causality="output"/>
</ModelVariables>
<ModelStructure><Output valueReference="1"/></ModelStructure>
</fmiModelDescription>"#;

/// An archive of description and library.
pub fn fmu(description: &[u8], library: &[u8]) -> Vec<u8> {
    archive(&entries(description, library))
}

/// The same as entries.
pub fn entries(description: &[u8], library: &[u8]) -> Vec<Entry> {
    let mut all = vec![Entry::file(DESCRIPTION, description)];
    all.extend(LIBRARIES.map(|name| Entry::file(name, library).with(|e| e.mode = 0o100_755)));
    all
}

/// A good FMU with more entries.
pub fn with(library: &[u8], more: impl IntoIterator<Item = Entry>) -> Vec<u8> {
    let mut all = entries(TWO.as_bytes(), library);
    all.extend(more);
    archive(&all)
}
