//! The shipped table of soils: every usable row makes laws, every other one is refused with its reason.

use terraglue_scenario::{COLUMNS, SoilTable, TableError};

const TABLE: &str = include_str!("../../../models/soils.csv");
const PUBLISHED: &str = include_str!("../../../tests/reference/terramechanics/soils.csv");

fn table() -> SoilTable {
    SoilTable::parse(TABLE).expect("the shipped table is readable")
}

#[test]
fn resolved_short_names_have_the_agreed_numbers() {
    for (name, k_c, k_phi, n, c, phi_deg, k) in [
        ("dry_sand_LLL_K010", 990.0, 1_528_430.0, 1.1, 1040.0, 28.0, 0.010),
        ("LETE_sand", 102e3, 5301e3, 0.793, 1300.0, 31.1, 0.012),
        ("lunar_nominal_Apollo", 1400.0, 820e3, 1.0, 170.0, 35.0, 0.018),
        ("FJS1_beta0", 1370.0, 814e3, 1.0, 800.0, 37.2, 0.036),
        ("CMU_Direct90_s0", 0.0, 8000e3, 1.46, 1000.0, 29.0, 0.021),
    ] {
        let table = table();
        let row = table.row(name).expect(name);
        let v = |c| row.value(c).expect(c);
        assert_eq!([v("k_c"), v("k_phi"), v("n"), v("c_pa"), v("K_m")], [k_c, k_phi, n, c, k], "{name}");
        assert!((v("phi_rad") - f64::to_radians(phi_deg)).abs() < 1e-11, "{name}");
    }
    assert_eq!(table().row("lunar_nominal_Apollo").expect("row").value("density_kg_m3"), Some(1500.0));
}

#[test]
fn every_published_soil_is_usable_or_refused_with_a_reason() {
    let table = table();
    for line in PUBLISHED.lines().skip(1) {
        let published = line.split([',', ' ']).next().expect("a name");
        let name = if published == "GRC-1" { "GRC-1_GRC-3_JSC-1A" } else { published };
        let row = table.row(name).expect(name);
        match row.offered(&[]) {
            Ok(values) => assert!(row.refused.is_none() && values.len() >= 6, "{name}"),
            Err(e) => assert!(row.refused.is_some() && e.to_string().contains(name), "{name}: {e}"),
        }
    }
}

#[test]
fn a_range_offers_both_ends_and_an_override_makes_the_row_usable() {
    let table = table();
    let row = table.row("dry_sand_LLL").expect("row");
    let message = row.offered(&[]).expect_err("K is a range").to_string();
    assert!(message.contains("K_m = 0.01") && message.contains("K_m = 0.025"), "{message}");
    let offered = row.offered(&["K_m"]).expect("K is given");
    assert!(offered.iter().all(|(key, _)| *key != "K_m" && COLUMNS.contains(key)));
}

#[test]
fn unknown_names_and_broken_tables_are_refused() {
    assert!(matches!(table().row("moon_cheese"), Err(TableError::Unknown { .. })));
    assert!(matches!(SoilTable::parse(""), Err(TableError::Malformed { .. })));
    let broken = TABLE.replacen("1528430", "many", 1);
    let message = SoilTable::parse(&broken).expect_err("not a number").to_string();
    assert!(message.contains("line 2") && message.contains("many"), "{message}");
}
