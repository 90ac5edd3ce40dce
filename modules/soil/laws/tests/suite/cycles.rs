//! Cycles of first loading and elastic unloading under users' laws: never stiffer than unloading, so that no cycle yields
//! energy.

use proptest::prelude::*;
use terraglue_soil_law::{PressureCurve, PressureLaw, SoilExpressions, SoilParameters, first_loading};
use terraglue_subsystem::Config;

/// A law as text above unloading with `k_u`; None: refused, since it is stiffer from the surface on.
fn accepted(text: &str, k_u: f64) -> Option<PressureLaw> {
    let config =
        serde_json::json!({ "law": { "pressure": text, "parameters": { "m": "1 m", "P": "1 Pa" } } });
    let texts = SoilExpressions::from_config(&Config::parse(&config.to_string()).expect("config"));
    let soil = SoilParameters { elastic_stiffness_pa_m: Some(k_u), ..SoilParameters::default() };
    let texts = texts.expect("read").expect("there is one");
    Some(PressureLaw::Expression(texts.pressure(&soil).ok()?.expect("a law")).looked_at(k_u))
}

fn law(text: &str, k_u: f64) -> PressureLaw {
    accepted(text, k_u).expect("good")
}

const ANSWERS: &str = "no module: it always answers";

fn curve(law: &PressureLaw, b: f64, k_u: f64) -> PressureCurve {
    law.curve(b, k_u).expect(ANSWERS)
}

fn virgin(curve: &PressureCurve, z: f64) -> f64 {
    curve.virgin(z).expect(ANSWERS)
}

/// Work of first loading between depths, by many trapezia.
fn work(curve: &PressureCurve, from: f64, to: f64) -> f64 {
    let steps = 2000;
    let p = |k: i32| virgin(curve, from + (to - from) * f64::from(k) / f64::from(steps));
    (1..=steps).map(|k| 0.5 * (p(k) + p(k - 1)) * (to - from) / f64::from(steps)).sum()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn no_cycle_under_a_stiff_convex_law_yields_energy(
        a in 3.0..6.5f64, c in 4.0..9.0f64, n in 1.1..3.0f64, k_u in 4.0..8.0f64, which in 0..3usize,
        one in 1e-5..0.4f64, two in 1e-5..0.4f64, b in 0.005..0.3f64,
    ) {
        let (a, c, k_u) = (10f64.powf(a), 10f64.powf(c), 10f64.powf(k_u));
        prop_assume!(a < 0.9 * k_u);
        let text = [
            format!("P*({a}*z/m + {c}*(z/m)^{n})"),
            format!("P*({a}*z/m + {c}*max(z/m - 0.01, 0)*m/b)"),
            format!("P*{a}*0.05*expm1(z/(0.05*m))"),
        ][which].clone();
        let law = accepted(&text, k_u);
        prop_assume!(law.is_some());
        let curve = curve(&law.expect("assumed"), b, k_u);
        let (from, to) = (one.min(two), one.max(two));
        let [p_from, p_to] = [from, to].map(|z| virgin(&curve, z));
        prop_assert!(curve.first_loading(to).expect(ANSWERS).1 <= k_u);
        // pressed to `from`, released, pressed to `to`, released
        let elastic = |p: f64| 0.5 * p * p / k_u;
        let first = work(&curve, 0.0, from);
        prop_assert!(first - elastic(p_from) >= -1e-5 * first);
        let second = work(&curve, from, to);
        prop_assert!(elastic(p_from) + second - elastic(p_to) >= -1e-5 * (first + second));
        // a batch answers as its nodes do
        let depth = curve.virgin_depth(p_to).expect(ANSWERS);
        prop_assert!((depth - to).abs() <= 1e-7 * to + 1e-9, "{depth} {to}");
        let (mut p, mut slope) = ([0.0; 2], [0.0; 2]);
        first_loading(&curve, &[from, to], &mut p, &mut slope).expect(ANSWERS);
        prop_assert_eq!(p[0], p_from);
        prop_assert_eq!(Ok((p[1], slope[1])), curve.first_loading(to));
    }
}

#[test]
fn a_text_goes_on_straight_where_the_built_in_law_does() {
    let (k_u, n) = (2e6, 1.6);
    let soil = SoilParameters { n, k_c: 0.0, k_phi: 8e6, ..SoilParameters::default() };
    let built_in = curve(&soil.pressure(), 0.05, k_u);
    // a term that is nothing hides that it is a power law
    let text = curve(&law("P*(8e6*(z/m)^1.6 + 1e-9*tanh(z/m))", k_u), 0.05, k_u);
    assert!(text.is_batched() && (text.straight_from() / built_in.straight_from() - 1.0).abs() < 1e-12);
    for z in [0.01, 0.05, 0.2, 0.7] {
        assert!((virgin(&text, z) / virgin(&built_in, z) - 1.0).abs() < 1e-9, "{z}");
    }
}

#[test]
fn what_unloading_changes_is_said_with_the_way_out() {
    let k_u = 2e6;
    let stiff = law("P*(1e5*z/m + 8e6*(z/m)^1.6)", k_u);
    let softened = stiff.softened(k_u).expect("softened");
    let said = softened.message(" of label 3");
    assert!(
        said.contains("`elastic_stiffness_pa_m` = 2e6 is softer than the law of label 3 from 40.886 mm"),
        "{said}"
    );
    assert_eq!(law("P*(1e5*z/m + 8e6*(z/m)^1.6)", softened.needed).softened(softened.needed), None);
    assert_eq!(stiff.softened(4e8), None);
    // the built-in laws, also where their modulus itself is bounded
    let n = |n| SoilParameters { n, k_c: 0.0, k_phi: 8e6, ..SoilParameters::default() }.pressure();
    assert!(
        n(1.6).softened(k_u).is_some() && n(1.0).softened(k_u).is_some() && n(0.8).softened(k_u).is_none()
    );
    assert_eq!(n(1.0).softened(1e7), None);
}
