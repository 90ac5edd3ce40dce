//! Laws written as text: mistakes with their place, tangents against closed forms, agreement with the built-in laws.

use proptest::prelude::*;
use terraglue_soil_law::{PressureCurve, PressureLaw, SoilExpressions, SoilParameters, first_loading};
use terraglue_subsystem::Config;

const BEKKER: &str = "(k_c/b + k_phi)*z^n";
const JANOSI: &str = "(c + sigma*tan(phi))*(1 - exp(-j/K))";

fn texts(law: serde_json::Value) -> Result<SoilExpressions, String> {
    let config = Config::parse(&serde_json::json!({ "law": law }).to_string()).map_err(|e| e.to_string())?;
    SoilExpressions::from_config(&config).map_err(|e| e.to_string())?.ok_or_else(|| "no law".into())
}

fn refusal(law: serde_json::Value) -> String {
    let soil = SoilParameters { elastic_stiffness_pa_m: Some(4e8), ..SoilParameters::default() };
    let made = texts(law).and_then(|t| {
        t.pressure(&soil).map_err(|e| e.to_string())?;
        t.shear(&soil).map_err(|e| e.to_string())
    });
    made.expect_err("refused")
}

fn pressure_law(text: &str, soil: &SoilParameters, own: &[(&str, &str)]) -> PressureLaw {
    let own: serde_json::Map<_, _> = own.iter().map(|(k, v)| ((*k).into(), (*v).into())).collect();
    let texts = texts(serde_json::json!({ "pressure": text, "parameters": own })).expect("read");
    PressureLaw::Expression(texts.pressure(soil).expect("good").expect("there is one"))
}

const ANSWERS: &str = "no module: it always answers";

fn curve(law: &PressureLaw, b: f64, k_u: f64) -> PressureCurve {
    law.curve(b, k_u).expect(ANSWERS)
}

#[test]
fn a_mistake_is_shown_where_it_stands() {
    let text = refusal(serde_json::json!({ "pressure": "(k_c/b + k_ph)*z^n" }));
    assert!(text.contains("`law.pressure`: unknown name `k_ph` (column 10)"), "{text}");
    assert!(text.contains("    (k_c/b + k_ph)*z^n\n             ^^^^\n"), "{text}");
    assert!(text.contains("did you mean `k_phi`?"), "{text}");
    for (law, part) in [
        ("(k_c/b + k_phi*z^n", "not closed (column 1)"),
        ("k_phi*z^n)", "`)` is not expected here (column 10)"),
        ("k_phi**z", "powers are written with ^"),
        ("k_phi*z^", "a value is missing at the end"),
        ("k_phi*sine(z)", "unknown function `sine`"),
        ("k_phi(z)", "write k_phi*(…) for a product"),
        ("1.2.3*z", "this is not a number (column 1)"),
        ("k_phi*z^n*max(z)", "`max` takes two arguments"),
        ("", "a value is missing"),
    ] {
        let text = refusal(serde_json::json!({ "pressure": law }));
        assert!(text.contains(part), "{law}: {text}");
    }
}

#[test]
fn the_dimension_must_be_a_pressure() {
    let text = refusal(serde_json::json!({ "pressure": "(k_c + k_phi)*z^n" }));
    assert!(text.contains("`k_c` is Pa") && text.contains("but `k_phi` is Pa m^-1"), "{text}");
    let text = refusal(serde_json::json!({ "pressure": "k_phi*z^(n+1)" }));
    assert!(text.contains("the law is Pa m, it must be Pa"), "{text}");
    let text = refusal(serde_json::json!({ "pressure": "k_phi*z^n*exp(z)" }));
    assert!(text.contains("`z` is m, but a pure number is needed here (column 15)"), "{text}");
    let text = refusal(serde_json::json!({ "pressure": "k_phi*z^(n*z/b)" }));
    assert!(text.contains("must not change during the run"), "{text}");
    // right for one n only
    let own = serde_json::json!({ "m": "1.1 [0.5, 1.5]", "k": "8e5 N/m^3.1" });
    let text = refusal(serde_json::json!({ "pressure": "k*z^m", "parameters": own }));
    assert!(text.contains("it must be Pa"), "{text}");
    let own = serde_json::json!({ "m": "1.1 [0.5, 1.5]", "k": "8e5 N/m^(m+2)" });
    let good = texts(serde_json::json!({ "pressure": "k*z^m", "parameters": own })).expect("read");
    good.pressure(&SoilParameters::default()).expect("good");
}

#[test]
fn a_law_is_defined_over_its_whole_range() {
    for (law, part) in [
        ("k_phi*b*z/(b - 0.1*b/b*k_c/k_c*b - z)", "division by a number that may be zero"),
        ("c*ln(z/b)", "logarithm of a number that may be 0"),
        ("k_phi*(z - b)*sqrt(z/b - 1)", "square root of a number that may be -"),
        ("c*(1 - z/b)^0.5", "power of a number that may be -"),
        ("c*(b/z)^n", "division by a number that may be zero"),
        ("c*tan(z/b)", "the tangent has a pole there"),
        ("-k_phi*z^n", "soil does not pull"),
        ("c*(2 - min(z/b, 1))", "the pressure falls"),
        ("1e6*k_phi*z", "stiffer than unloading"),
        ("0*c*z/b", "the pressure is 0 down to"),
    ] {
        let text = refusal(serde_json::json!({ "pressure": law }));
        assert!(text.contains(part), "{law}: {text}");
    }
    let text = refusal(serde_json::json!({ "shear": "c*exp(-j/K)" }));
    assert!(text.contains("the stress falls with the slip j"), "{text}");
    let text = refusal(serde_json::json!({ "shear": "c - sigma*tan(phi)" }));
    assert!(text.contains("the stress falls with the pressure sigma"), "{text}");
}

#[test]
fn parameters_have_unit_and_range() {
    for (own, part) in [
        ("abc", "is not a number"),
        ("1.0 furlong", "in the unit of `a`: `furlong` is not a unit"),
        ("1.0 Pa [2, 3]", "`a` = 1 is outside its range 2 … 3"),
        ("1.0 Pa [2 3]", "is not of the form [MIN, MAX]"),
    ] {
        let text = refusal(serde_json::json!({ "pressure": "a*z/b", "parameters": { "a": own } }));
        assert!(text.contains(part), "{own}: {text}");
    }
    let text = refusal(serde_json::json!({ "parameters": { "a": "1.0" } }));
    assert!(text.contains("neither `law.pressure` nor `law.shear`"), "{text}");
    // units other than SI are converted
    let soil = SoilParameters::default();
    let p = |a| curve(&pressure_law("a*z/b", &soil, &[("a", a)]), 0.1, 4e8).virgin(0.02).expect(ANSWERS);
    assert_eq!(p("1.5 kPa"), p("1500 Pa"));
}

#[test]
fn a_power_law_is_the_built_in_one() {
    let soil = SoilParameters { n: 0.8, k_c: 5e3, k_phi: 2e6, ..SoilParameters::default() };
    let built_in = curve(&soil.pressure(), 0.07, 4e8);
    assert_eq!(curve(&pressure_law(BEKKER, &soil, &[]), 0.07, 4e8), built_in);
}

/// Bekker's law in a form that is not recognised as a power law.
const BEKKER_AS_PROGRAM: &str = "k_c/b*z^n + k_phi*exp(n*ln(max(z, 1e-300*b)/b))*b^n";

proptest! {
    #[test]
    fn a_program_does_all_that_the_built_in_law_does(
        n in 0.3..1.6f64, z in 1e-6..0.3f64, z_max in 0.0..0.1f64, b in 0.01..0.3f64,
    ) {
        let soil = SoilParameters { n, k_c: 2e4, k_phi: 1e6, ..SoilParameters::default() };
        let built_in = curve(&soil.pressure(), b, 4e8);
        let curve = curve(&pressure_law(BEKKER_AS_PROGRAM, &soil, &[]), b, 4e8);
        prop_assert!(curve.is_batched());
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs() + 1e-300;
        let virgin = |curve: &PressureCurve| curve.virgin(z_max).expect(ANSWERS);
        let p_max = virgin(&built_in);
        prop_assert!(near(virgin(&curve), p_max));
        let at = |curve: &PressureCurve| curve.at(z, z_max, p_max).expect(ANSWERS);
        let ((p, slope), (q, other)) = (at(&curve), at(&built_in));
        prop_assert!(near(p, q) && near(slope, other), "{p} {q} {slope} {other}");
        prop_assert!((curve.elastic_limit() - built_in.elastic_limit()).abs() <= 1e-9 + 1e-12 * built_in.elastic_limit());
        let depth = |curve: &PressureCurve| curve.virgin_depth(q.max(1.0)).expect(ANSWERS);
        let (found, depth) = (depth(&curve), depth(&built_in));
        prop_assert!((found - depth).abs() <= 1e-9 + 1e-11 * depth);
    }

    #[test]
    fn shear_follows_the_built_in_law(p in 1.0..1e5f64, s in 1e-6..0.1f64, before in 0.0..0.05f64) {
        let soil = SoilParameters::default();
        let texts = texts(serde_json::json!({ "shear": JANOSI })).expect("read");
        let law = soil.shear().with_expression(texts.shear(&soil).expect("good").expect("there is one"));
        let state = terraglue_soil_law::ShearState { elastic: [1e-6, 0.0], slip: before };
        let [a, b] = [law, soil.shear()].map(|law| law.respond(&state, p, [0.6 * s, 0.8 * s]).expect(ANSWERS));
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs() + 1e-9;
        prop_assert!(near(a.stress[0], b.stress[0]) && near(a.stress[1], b.stress[1]), "{a:?} {b:?}");
        prop_assert!((0..3).all(|k| near(a.tangent[k], b.tangent[k])), "{a:?} {b:?}");
        prop_assert!((0..2).all(|k| near(a.by_pressure[k], b.by_pressure[k])), "{a:?} {b:?}");
        prop_assert!(near(a.dissipated, b.dissipated));
    }
}

/// Laws with their derivative by hand.
#[allow(clippy::type_complexity)]
const TANGENTS: [(&str, fn(f64, f64) -> f64, fn(f64, f64) -> f64); 6] = [
    ("1e4*z^2/b^2 + c*0", |z, b| 1e4 * z * z / (b * b), |z, b| 2e4 * z / (b * b)),
    ("1e5*tanh(z/b)", |z, b| 1e5 * (z / b).tanh(), |z, b| 1e5 / b / (z / b).cosh().powi(2)),
    ("2e4*(exp(min(z/b, 50)) - 1)", |z, b| 2e4 * (z / b).exp_m1(), |z, b| 2e4 / b * (z / b).exp()),
    (
        "3e4*ln(1 + z/b)*sqrt(1 + z/b)",
        |z, b| 3e4 * (z / b).ln_1p() * (1.0 + z / b).sqrt(),
        |z, b| {
            let u = 1.0 + z / b;
            3e4 / b * (1.0 / u * u.sqrt() + u.ln() * 0.5 / u.sqrt())
        },
    ),
    ("1e5*z/(z + b)", |z, b| 1e5 * z / (z + b), |z, b| 1e5 * b / (z + b).powi(2)),
    (
        "1e4*(2 + sin(z/b)*0.1 + 2*z/b)^1.3",
        |z, b| 1e4 * (2.0 + 0.1 * (z / b).sin() + 2.0 * z / b).powf(1.3),
        |z, b| 1.3e4 * (2.0 + 0.1 * (z / b).sin() + 2.0 * z / b).powf(0.3) * (0.1 * (z / b).cos() + 2.0) / b,
    ),
];

#[test]
fn tangents_are_those_of_the_closed_form() {
    for (text, value, slope) in TANGENTS {
        // 1e4 is a pressure: give it the unit through c
        let soil = SoilParameters { c_pa: 1.0, ..SoilParameters::default() };
        let law = pressure_law(&format!("c*({text})").replace("+ c*0", ""), &soil, &[]);
        for (z, b) in [(0.003, 0.02), (0.02, 0.05), (0.11, 0.3), (0.3, 0.1)] {
            let (p, by_z) = curve(&law, b, 1e9).at(z, 0.0, 0.0).expect(ANSWERS);
            assert!((p / value(z, b) - 1.0).abs() < 1e-13, "{text}: {p} {}", value(z, b));
            assert!((by_z / slope(z, b) - 1.0).abs() < 1e-12, "{text}: {by_z} {}", slope(z, b));
        }
    }
}

#[test]
fn a_batch_equals_its_nodes() {
    let soil = SoilParameters { n: 0.9, ..SoilParameters::default() };
    let curve = curve(&pressure_law(BEKKER_AS_PROGRAM, &soil, &[]), 0.05, 4e8);
    for count in [1, 5, 31, 32, 33, 70, 100] {
        let depth: Vec<f64> = (0..count).map(|k| -0.002 + 3e-4 * f64::from(k)).collect();
        let (mut p, mut slope) = (vec![f64::NAN; count as usize], vec![f64::NAN; count as usize]);
        first_loading(&curve, &depth, &mut p, &mut slope).expect(ANSWERS);
        for k in 0..count as usize {
            assert_eq!(Ok((p[k], slope[k])), curve.first_loading(depth[k]), "{k} of {count}");
        }
    }
}
