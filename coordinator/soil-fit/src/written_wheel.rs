//! A soil fitted to a wheel, as a soil file for scenarios and as JSON.

use super::wheel::WheelFit;
use super::written::{digits, ends, measured_gravity, number_json};
use serde_json::{Value, json as value};
use terraglue_soil_identification::WheelPoint;

/// The table of a soil, for `parameters = "soil.toml"`. `source` says where the numbers come from.
pub fn wheel_toml(fit: &WheelFit, seen: &[WheelPoint], source: &str) -> String {
    let [sinkage, pull] = fit.fit.errors(seen);
    let mut text = format!(
        "# {source}\n# largest errors over {} slips: sinkage {:.1} %, drawbar pull {pull:.2} N; intervals: each slip left out in \
         turn\n\n[soil]\npressure_law = \"bekker\"\nk_c = 0.0\nslip_sinkage = \"ding\"\n\
         # the integral knows the depth alone, and digs by Ding's exponent\nslope_factor = false\nload_inclination = false\n\
         passive_pressure = false\n",
        seen.len(),
        100.0 * sinkage
    );
    for n in &fit.fit.numbers {
        text +=
            &format!("{} = {}  # {}; 95 %: {}\n", n.key, digits(n.value), n.help, ends(n.interval, digits));
    }
    text += &measured_gravity();
    for (key, number, what) in fit.others() {
        match number {
            Some(x) => text += &format!("{key} = {}\n", digits(x)),
            None => text += &format!("# {key} = …  # a wheel does not tell the {what}\n"),
        }
    }
    text
}

fn slips(fit: &WheelFit, points: &[WheelPoint]) -> Value {
    let of = |p: &WheelPoint| {
        let state = fit.fit.state(p.slip, p.load);
        value!({
            "slip": p.slip,
            "load_N": p.load,
            "sinkage_m": { "measured": p.sinkage, "fitted": state.sinkage },
            "pull_N": { "measured": p.pull, "fitted": state.pull },
        })
    };
    let [sinkage, pull] = fit.fit.errors(points);
    let slips: Vec<Value> = points.iter().map(of).collect();
    value!({ "slips": slips, "largest_error": { "sinkage": sinkage, "pull_N": pull } })
}

/// Everything for programs; `predicted`: points that the fit has not seen, and their file.
pub fn wheel_json(fit: &WheelFit, seen: &[WheelPoint], predicted: Option<(&str, &[WheelPoint])>) -> Value {
    let parameters: serde_json::Map<_, _> =
        fit.fit.numbers.iter().map(|n| (n.key.to_owned(), number_json(n.value, Some(n.interval)))).collect();
    let mut all = slips(fit, seen);
    all["law"] = value!("bekker");
    all["slip_sinkage"] = value!("ding");
    all["parameters"] = value!(parameters);
    all["intervals_from"] = value!({ "basis": "slips", "groups": fit.fit.groups, "confidence": 0.95 });
    all["predicted"] = match predicted {
        Some((file, points)) => {
            let mut unseen = slips(fit, points);
            unseen["file"] = value!(file);
            unseen
        }
        None => Value::Null,
    };
    all
}
