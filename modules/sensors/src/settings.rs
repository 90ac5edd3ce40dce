//! The parameters of the module.

use crate::errors::ErrorModel;
use crate::kind::SensorKind;
use terraglue_subsystem::{Config, Error, Kind, Mount, Parameter, ParameterType, Result, Schema};

/// Parameters of a sensor in a scenario.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub kind: SensorKind,
    pub mount: Option<Mount>,
    pub rate_hz: f64,
    pub delay_s: f64,
    pub range_m: f64,
    pub threshold_n: f64,
    pub models: [ErrorModel; 2],
}

/// Name, kind and parameters.
pub fn schema() -> Schema {
    let names = SensorKind::ALL.map(SensorKind::name);
    let kind = Parameter::of("kind", ParameterType::Text, "Which sensor it is");
    let not_negative = |name: &str, unit: &str, default: f64, help: &str| {
        Parameter::number(name, unit, default, help).within(0.0, f64::INFINITY)
    };
    let [mount, offset] = Mount::parameters();
    let parameters = vec![
        kind.or(SensorKind::JointEncoder.name()).choices(&names),
        mount.optional(),
        offset,
        not_negative("rate_hz", "Hz", 100.0, "Samples per second; 0: one at each step"),
        not_negative("delay_s", "s", 0.0, "Time from a sample until it is shown"),
        not_negative("bias", "", 0.0, "Standard deviation of the constant error, in the unit of the output"),
        not_negative(
            "noise",
            "",
            0.0,
            "Standard deviation of the noise of a sample, in the unit of the output",
        ),
        not_negative("quantum", "", 0.0, "Outputs are multiples of this; 0: not rounded"),
        not_negative("turn_bias", "", 0.0, "`bias` of angular rates and moments"),
        not_negative("turn_noise", "", 0.0, "`noise` of angular rates and moments"),
        not_negative("turn_quantum", "", 0.0, "`quantum` of angular rates and moments"),
        Parameter::number("range_m", "m", 10.0, "Farthest surface that a range finder meets").positive(),
        not_negative(
            "threshold_n",
            "N",
            1.0,
            "Force from which on a contact switch closes; it opens at half of it",
        ),
    ];
    let help = "IMU, inclinometer, range finder, joint encoder, foot force or contact switch with noise, bias, rounding and delay";
    Schema { name: "sensor".into(), kind: Kind::Sensor, help: help.into(), parameters }
}

impl Settings {
    pub fn from_config(config: &Config) -> Result<Self> {
        let name = config.text("kind")?;
        let unknown = || Error::Refused(format!("parameter `kind` = \"{name}\" is no sensor"));
        let kind = SensorKind::named(name).ok_or_else(unknown)?;
        let model = |prefix: &str| -> Result<ErrorModel> {
            let of = |key: &str| config.number(&format!("{prefix}{key}"));
            Ok(ErrorModel { bias: of("bias")?, noise: of("noise")?, quantum: of("quantum")? })
        };
        let has_mount = config.text(Mount::KEY).is_ok();
        if kind.is_mounted() != has_mount {
            let verb = if has_mount { "takes no" } else { "needs a" };
            return Err(Error::Refused(format!("a sensor of kind `{name}` {verb} `{}`", Mount::KEY)));
        }
        Ok(Self {
            kind,
            mount: has_mount.then(|| Mount::from_config(config)).transpose()?,
            rate_hz: config.number("rate_hz")?,
            delay_s: config.number("delay_s")?,
            range_m: config.number("range_m")?,
            threshold_n: config.number("threshold_n")?,
            models: [model("")?, model("turn_")?],
        })
    }
}
