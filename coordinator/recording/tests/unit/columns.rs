//! Columns of numbers, written and read back.

use super::*;

fn column(name: &str, kind: ScalarKind) -> Column {
    Column::new(name.into(), "m".into(), "help".into(), kind)
}

fn columns() -> Vec<Column> {
    let real = |name: &str| column(name, ScalarKind::Real);
    let mut all: Vec<_> = ["t", "LF_j2.angle", "a.b.c", "a.b", "2-wheel"].map(real).into();
    all.extend(["[1,1]", "[1,2]", "[2,1]"].map(|e| real(&format!("feet.position{e}"))));
    all.extend([column("on", ScalarKind::Bool), column("count", ScalarKind::Integer)]);
    all.push(column("mode", ScalarKind::Enumeration(vec!["off".into(), "on".into()])));
    all.extend((0..40).map(|k| real(&format!("LF_j2.more{k}"))));
    all
}

#[test]
fn numbers_are_read_back_to_the_bit() {
    let list = columns();
    let (written, about) = Columns::new(list.iter().enumerate());
    let text = serde_json::to_string(&about).expect("text");
    let again: Vec<About> = serde_json::from_str(&text).expect("readable");
    let read = Columns::read(&again);
    let mut values: Vec<f64> = (0..list.len()).map(|k| libm::sin(k as f64 + 0.1) * 1e3).collect();
    (values[0], values[1], values[2]) = (0.0, -0.0, f64::INFINITY);
    (values[8], values[9], values[10]) = (1.0, -3.0, 1.0);
    let mut bytes = Vec::new();
    written.encode(&values, &mut bytes);
    let mut back = vec![7.0; list.len()];
    read.decode(&bytes, &mut back).expect("whole");
    let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&back), bits(&values));
    for cut in 0..bytes.len() {
        let _ = read.decode(&bytes[..cut], &mut back);
    }
    // groups that are shorter or longer than as a rule: lengths of one and of two bytes
    for empty in 0..=list.len() {
        let few: Vec<f64> = (0..list.len()).map(|k| if k < empty { 0.0 } else { 3.0 }).collect();
        bytes.clear();
        written.encode(&few, &mut bytes);
        read.decode(&bytes, &mut back).expect("whole");
        let flag = |k: usize, v: f64| if k == 8 && v != 0.0 { 1.0 } else { v };
        assert_eq!(back, few.iter().enumerate().map(|(k, v)| flag(k, *v)).collect::<Vec<_>>());
    }
}

#[test]
fn fields_are_the_parts_of_names() {
    let list = columns();
    let (type_, about) = Columns::new(list.iter().enumerate());
    let bytes = type_.descriptor("terraglue.Variables", "robot");
    let set = <prost_types::FileDescriptorSet as prost::Message>::decode(&bytes[..]).expect("descriptor");
    let robot = &set.file[0].message_type[0];
    let names: Vec<_> = robot.field.iter().map(|f| f.name()).collect();
    assert_eq!(names, ["t", "LF_j2", "a", "_2_wheel", "feet", "on", "count", "mode"]);
    assert_eq!(about[5].field, about[7].field);
    assert_ne!(about[2].field, about[3].field);
}
