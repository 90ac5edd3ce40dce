//! Moduli measured under one gravity, used under another.

use terraglue_soil_law::SoilParameters;

fn lete() -> SoilParameters {
    SoilParameters {
        n: 0.793,
        k_c: 102e3,
        k_phi: 5301e3,
        measured_gravity: Some(9.81),
        gravity_scaling: true,
        ..SoilParameters::default()
    }
}

fn pressure(soil: SoilParameters, depth: f64) -> f64 {
    soil.pressure().curve(0.05, 1e18).and_then(|curve| curve.virgin(depth)).expect("a pressure")
}

#[test]
fn what_stands_for_weight_is_scaled_and_cohesion_is_not() {
    let measured = SoilParameters { gravity: 9.81, ..lete() };
    let unscaled = SoilParameters { gravity_scaling: false, ..lete() };
    for depth in [0.002, 0.01, 0.05] {
        let earth = pressure(measured, depth);
        assert_eq!(pressure(unscaled, depth), earth);
        let cohesive = pressure(SoilParameters { k_phi: 0.0, ..measured }, depth);
        let expected = cohesive + (earth - cohesive) * 1.62 / 9.81;
        assert!((pressure(lete(), depth) / expected - 1.0).abs() < 1e-12, "{depth}");
    }
}

#[test]
fn a_mass_sinks_alike_under_any_gravity_where_nothing_is_cohesive() {
    // p = k_phi·(g/g_0)·zⁿ carries m·g: z does not depend on g (Kobayashi et al. 2010)
    let depth = |g: f64| {
        let soil = SoilParameters { gravity: g, k_c: 0.0, ..lete() };
        let load = 300.0 * g;
        (load / pressure(soil, 1.0)).powf(1.0 / lete().n)
    };
    for g in [1.62, 3.71, 24.8] {
        assert!((depth(g) / depth(9.81) - 1.0).abs() < 1e-12, "{g}");
    }
}

#[test]
fn scaling_from_an_unknown_gravity_is_refused() {
    let refused = SoilParameters { measured_gravity: None, ..lete() }.check().map_err(|e| e.to_string());
    assert!(refused.as_ref().is_err_and(|e| e.contains("measured_gravity_m_s2")), "{refused:?}");
}
