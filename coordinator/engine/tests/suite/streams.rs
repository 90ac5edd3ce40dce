//! Streams that feed inputs of other subsystems: a message arrives at the next communication point, faults cut and freeze it,
//! and a run that goes on from a snapshot hears every message once.

use std::sync::Arc;
use terraglue_engine::{Options, Testbed};
use terraglue_host::Library;
use terraglue_scenario::Scenario;
use terraglue_subsystem::*;

/// Number of the next step, and the last message with its time.
type Scanned = (u64, Option<(f64, Vec<u8>)>);

/// Gives a cloud of three points after each of its steps; their height is the number of the step.
struct Scanner {
    step: u64,
    cloud: Option<(f64, Vec<u8>)>,
    streams: [StreamInfo; 1],
    saved: Vec<Option<Scanned>>,
}

impl Module for Scanner {
    fn schema() -> Schema {
        Schema { name: "scanner".into(), kind: Kind::Sensor, help: "Scans".into(), parameters: Vec::new() }
    }
    fn instantiate(_: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let cloud = StreamInfo {
            name: "cloud".into(),
            schema: "test.Cloud".into(),
            encoding: "raw".into(),
            rate_hz: 10.0,
            most_bytes: 64,
            help: String::new(),
        };
        let saved = vec![None; host.slots() as usize];
        Ok(Box::new(Self { step: 0, cloud: None, streams: [cloud], saved }))
    }
}

impl Subsystem for Scanner {
    fn capabilities(&self) -> Capabilities {
        Capabilities::SEES | Capabilities::STATE
    }
    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }
    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        self.step += u64::from(step.h > 0.0);
        let z = self.step as f32;
        let points = [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        let bytes = points.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        self.cloud = Some((world.time(), bytes));
        Ok(())
    }
    fn save_state(&mut self, slot: u32) -> Result {
        self.saved[slot as usize] = Some((self.step, self.cloud.clone()));
        Ok(())
    }
    fn restore_state(&mut self, slot: u32) -> Result {
        (self.step, self.cloud) = self.saved[slot as usize].clone().unwrap();
        Ok(())
    }
    fn streams(&self) -> &[StreamInfo] {
        &self.streams
    }
    fn stream(&self, _: usize) -> Result<Option<Message<'_>>> {
        Ok(self.cloud.as_ref().map(|(time, bytes)| Message { time: *time, bytes }))
    }
}

/// Tells the mean height of the last cloud, and how many came.
struct Mapper {
    now: [f64; 2],
    variables: Vec<Variable>,
    saved: Vec<[f64; 2]>,
}

impl Module for Mapper {
    fn schema() -> Schema {
        Schema { name: "mapper".into(), kind: Kind::Controller, help: "Maps".into(), parameters: Vec::new() }
    }
    fn instantiate(_: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let real = |id, name: &str, causality| Variable::real(id, name, "", causality, "");
        let cloud = Variable { value_type: ValueType::Binary, ..real(3, "cloud", Causality::Input) };
        let variables = vec![
            real(0, "height", Causality::Output),
            real(1, "count", Causality::Output),
            real(2, "gain", Causality::Input),
            cloud,
        ];
        Ok(Box::new(Self { now: [-1.0, 0.0], variables, saved: vec![[0.0; 2]; host.slots() as usize] }))
    }
}

impl Subsystem for Mapper {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::STATE
    }
    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }
    fn save_state(&mut self, slot: u32) -> Result {
        self.saved[slot as usize] = self.now;
        Ok(())
    }
    fn restore_state(&mut self, slot: u32) -> Result {
        self.now = self.saved[slot as usize];
        Ok(())
    }
    fn variables(&self) -> &[Variable] {
        &self.variables
    }
    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::F64(out) = out else { return Err(Error::Unsupported) };
        for (id, out) in ids.iter().zip(out) {
            *out = self.now.get(*id as usize).copied().unwrap_or(0.0);
        }
        Ok(())
    }
    fn set(&mut self, _: &[u32], values: Values) -> Result {
        let Values::Binary([cloud]) = values else { return Err(Error::Unsupported) };
        let numbers = cloud.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b)));
        let heights: Vec<f64> = numbers.skip(2).step_by(3).collect();
        self.now = [heights.iter().sum::<f64>() / heights.len() as f64, self.now[1] + 1.0];
        Ok(())
    }
}

const CONNECTED: &str = "[[connect]]\nfrom = \"scanner.cloud\"\nto = \"mapper.cloud\"\n";

fn testbed(scanner: &str, tables: &str) -> std::result::Result<Testbed, String> {
    let text = format!(
        "[time]\nstep_s = 0.1\nduration_s = 1.0\n[mapper]\nmodule = \"mapper\"\n\
         [scanner]\nmodule = \"scanner\"\n{scanner}\n{tables}"
    );
    let scenario = Scenario::parse(&text, "streams.toml", &[]).map_err(|e| e.to_string())?;
    let library = Library::new().with::<Scanner>().with::<Mapper>();
    Testbed::build_with(&scenario, &Options::default(), &library).map_err(|e| format!("{e:?}"))
}

fn fault(kind: &str, variable: &str) -> String {
    format!("{CONNECTED}[[fault]]\nvariable = \"{variable}\"\nkind = {kind}\nat_s = 0.3\nuntil_s = 0.6\n")
}

/// Height and count after each of some steps.
fn heard(testbed: &mut Testbed, steps: usize) -> Vec<[f64; 2]> {
    (0..steps)
        .map(|_| {
            testbed.step().unwrap();
            ["mapper.height", "mapper.count"].map(|name| testbed.read(name).unwrap())
        })
        .collect()
}

#[test]
fn a_message_arrives_at_the_next_communication_point() {
    let mut testbed = testbed("", CONNECTED).unwrap();
    testbed.begin().unwrap();
    // the cloud of the start in the first step, then each in the step after the one that made it
    let expected: Vec<[f64; 2]> = (0..10).map(|k| [k as f64, (k + 1) as f64]).collect();
    assert_eq!(heard(&mut testbed, 10), expected);
    assert_eq!(testbed.signals().connections(), 1);
    let explained = testbed.explain();
    let note = &explained.connections[0];
    assert_eq!((note.from.as_str(), note.to.as_str()), ("scanner.cloud", "mapper.cloud"));
    assert_eq!((note.value.as_str(), note.delay.as_str()), ("each message", "1"));
}

#[test]
fn where_no_message_comes_the_input_is_not_set() {
    let mut testbed = testbed("step_multiple = 3", CONNECTED).unwrap();
    testbed.begin().unwrap();
    let counts: Vec<f64> = heard(&mut testbed, 10).iter().map(|h| h[1]).collect();
    assert_eq!(counts, [1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 4.0]);
}

#[test]
fn a_fault_cuts_a_stream() {
    for variable in ["scanner.cloud", "mapper.cloud"] {
        let mut testbed = testbed("", &fault("\"drop-out\"\nprobability = 1.0", variable)).unwrap();
        testbed.begin().unwrap();
        // three messages from t = 0.3 s on are lost, and the input keeps the one of 0.2 s
        let all = heard(&mut testbed, 8);
        let expected = [[0., 1.], [1., 2.], [2., 3.], [2., 3.], [2., 3.], [2., 3.], [6., 4.], [7., 5.]];
        assert_eq!(all, expected, "{variable}");
    }
}

#[test]
fn a_fault_freezes_a_stream() {
    for variable in ["scanner.cloud", "mapper.cloud"] {
        let mut testbed = testbed("", &fault("\"freeze\"", variable)).unwrap();
        testbed.begin().unwrap();
        // messages go on to arrive, with the content of the one of 0.3 s
        let all = heard(&mut testbed, 8);
        let expected = [[0., 1.], [1., 2.], [2., 3.], [3., 4.], [3., 5.], [3., 6.], [6., 7.], [7., 8.]];
        assert_eq!(all, expected, "{variable}");
    }
}

#[test]
fn a_run_that_goes_on_from_a_snapshot_hears_the_same() {
    for kind in ["\"freeze\"", "\"drop-out\"\nprobability = 0.5"] {
        for scanner in ["", "step_multiple = 3"] {
            let mut testbed = testbed(scanner, &fault(kind, "scanner.cloud")).unwrap();
            testbed.begin().unwrap();
            heard(&mut testbed, 4);
            let kept = testbed.snapshot(0).unwrap();
            let first = heard(&mut testbed, 6);
            let told = |testbed: &mut Testbed| -> Vec<f64> {
                (0..6)
                    .flat_map(|_| {
                        testbed.step().unwrap();
                        testbed.view(|v| v.streams[0].messages.iter().map(|m| m.0).collect::<Vec<_>>())
                    })
                    .collect()
            };
            testbed.restore(&kept).unwrap();
            assert_eq!(heard(&mut testbed, 6), first, "{kind} {scanner}");
            testbed.restore(&kept).unwrap();
            let times = told(&mut testbed);
            let count = if scanner.is_empty() { 6 } else { 2 };
            // the earlier message is not delivered once more
            assert!(times.len() == count && times[0] > 0.4 + 1e-9, "{kind} {scanner} {times:?}");
        }
    }
}

#[test]
fn what_cannot_be_connected_or_broken_is_refused() {
    let refused = |tables: &str, words: &[&str]| {
        let text = testbed("", tables).err().expect("refused");
        assert!(words.iter().all(|word| text.contains(word)), "{text}");
    };
    let connect =
        |from: &str, to: &str, more: &str| format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n{more}");
    refused(
        &connect("scanner.cloud", "mapper.gain", ""),
        &["`scanner.cloud` is a stream", "`mapper.gain` no input of bytes"],
    );
    refused(&connect("scanner.cloud", "mapper.cloud", "factor = 2.0\n"), &["neither `map` nor `factor`"]);
    refused(&connect("scanner.clod", "mapper.cloud", ""), &["no variable and no stream", "`scanner.cloud`"]);
    refused(&format!("{CONNECTED}{CONNECTED}"), &["is fed by `scanner.cloud` already"]);
    refused(&fault("\"gain\"\nvalue = 2.0", "scanner.cloud"), &["`freeze` and `drop-out`"]);
    let loose = fault("\"freeze\"", "scanner.cloud").replace(CONNECTED, "");
    refused(&loose, &["feeds no other subsystem"]);
}
