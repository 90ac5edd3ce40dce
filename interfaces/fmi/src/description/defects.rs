//! Defects of a description that do not make the FMU unusable: where it contradicts the standard, with line and element.

use super::model::{
    Causality, Defect, DefectKind, Initial, ModelDescription, Start, Variability, Variable, Version,
};
use super::printable;
use terraglue_subsystem::ValueType;

/// Finds defects of one variable.
type Rule = fn(&ModelDescription, &Variable) -> Option<String>;

const RULES: [(DefectKind, Rule); 17] = [
    (DefectKind::Enumeration, enumeration),
    (DefectKind::Enumeration, same_items),
    (DefectKind::Enumeration, declared_type),
    (DefectKind::Role, initial),
    (DefectKind::Role, clocked),
    (DefectKind::Range, range),
    (DefectKind::StartRange, start_range),
    (DefectKind::StartCount, start_count),
    (DefectKind::StartMissing, start_missing),
    (DefectKind::StartCalculated, start_calculated),
    (DefectKind::Unit, unit),
    (DefectKind::BaseUnit, base_unit),
    (DefectKind::Clock, clock),
    (DefectKind::Role, role),
    (DefectKind::Continuous, continuous),
    (DefectKind::Derivative, derivative),
    (DefectKind::ClockReference, clock_reference),
];

impl ModelDescription {
    /// Contradictions to the standard that do not make the FMU unusable.
    pub fn defects(&self) -> Vec<Defect> {
        all(self)
    }

    /// Warnings of a run: [`ModelDescription::problems`], and one for each kind of defect that concerns it.
    pub fn warnings(&self) -> Vec<String> {
        let mut all = self.problems.clone();
        let defects = self.defects().into_iter().filter(|d| d.kind.concerns_a_run());
        all.extend(grouped(&defects.collect::<Vec<_>>()));
        all
    }
}

/// All defects, those of attributes and lists first, then those of variables in their order.
fn all(description: &ModelDescription) -> Vec<Defect> {
    let own = description.variables.iter().filter(|v| !v.alias);
    let of_variable = |v| {
        RULES.iter().filter_map(move |(kind, rule)| {
            let found = rule(description, v)?;
            let message = format!("`{}` {found}", printable(&v.name));
            Some(Defect { kind: *kind, line: Some(v.line), message })
        })
    };
    let details = description.details.iter().cloned();
    details.chain(own.flat_map(of_variable)).chain(structure(description)).collect()
}

/// One warning for each kind of defect: the first of them, and how many more there are.
fn grouped(defects: &[Defect]) -> Vec<String> {
    let mut kinds: Vec<DefectKind> = Vec::new();
    defects.iter().for_each(|d| {
        if !kinds.contains(&d.kind) {
            kinds.push(d.kind);
        }
    });
    let warning = |kind: &DefectKind| {
        let mut same = defects.iter().filter(|d| d.kind == *kind);
        let first = same.next().map(Defect::to_string).unwrap_or_default();
        match same.count() {
            0 => first,
            more => format!("{first}; {more} more like it are listed by `terraglue fmu check`"),
        }
    };
    kinds.iter().map(warning).collect()
}

fn enumeration(_: &ModelDescription, v: &Variable) -> Option<String> {
    (v.value_type == ValueType::Enumeration && v.items.is_empty())
        .then(|| "is an enumeration without a declared type that lists its items".into())
}

fn declared_type(_: &ModelDescription, v: &Variable) -> Option<String> {
    let foreign = v.value_type != ValueType::Enumeration && !v.items.is_empty();
    foreign.then(|| format!("is {} and has the declared type of an enumeration", type_name(v.value_type)))
}

fn same_items(_: &ModelDescription, v: &Variable) -> Option<String> {
    let twice = |(k, (_, number)): (usize, &(String, i64))| {
        v.items[..k].iter().any(|(_, other)| other == number).then_some(*number)
    };
    let number = v.items.iter().enumerate().find_map(twice)?;
    Some(format!("is an enumeration with two items of the value {number}"))
}

/// Inputs and the independent variable start exactly, and say nothing of it (FMI 2.0.4 §2.2.7); inputs may say so in FMI 3
/// (FMI 3.0.2 §2.4.7.5, table of `initial`).
fn initial(d: &ModelDescription, v: &Variable) -> Option<String> {
    let initial = v.initial?;
    match (v.causality, d.version) {
        (Causality::Input, Version::V3) if initial == Initial::Exact => None,
        (Causality::Input | Causality::Independent, _) => {
            Some(format!("is {:?} and has `initial`, which it must not", v.causality))
        }
        _ => None,
    }
}

/// A variable that belongs to clocks changes when they tick (FMI 3.0.2 §2.4.7.4).
fn clocked(_: &ModelDescription, v: &Variable) -> Option<String> {
    let continuous = v.variability == Variability::Continuous && !v.clocks.is_empty();
    continuous.then(|| "belongs to clocks and is continuous, where discrete is wanted".to_owned())
}

/// Name of a type in the standards.
fn type_name(value_type: ValueType) -> String {
    let text = format!("{value_type:?}");
    let long = [("I", "Int"), ("U", "UInt"), ("F", "Float")];
    let renamed = long.iter().find_map(|(short, long)| {
        let bits = text.strip_prefix(short)?;
        bits.chars().all(|c| c.is_ascii_digit()).then(|| format!("{long}{bits}"))
    });
    renamed.unwrap_or(text)
}

/// Numbers that a type of whole numbers can hold.
fn limits(value_type: ValueType) -> Option<(i128, i128)> {
    Some(match value_type {
        ValueType::I8 => (i8::MIN.into(), i8::MAX.into()),
        ValueType::U8 => (0, u8::MAX.into()),
        ValueType::I16 => (i16::MIN.into(), i16::MAX.into()),
        ValueType::U16 => (0, u16::MAX.into()),
        ValueType::I32 => (i32::MIN.into(), i32::MAX.into()),
        ValueType::U32 => (0, u32::MAX.into()),
        ValueType::I64 | ValueType::Enumeration => (i64::MIN.into(), i64::MAX.into()),
        ValueType::U64 => (0, u64::MAX.into()),
        _ => return None,
    })
}

/// Whether a number of 32 bits is finite where this one is.
fn holds_single(x: f64) -> bool {
    !x.is_finite() || (x as f32).is_finite()
}

fn range(_: &ModelDescription, v: &Variable) -> Option<String> {
    if v.min.is_nan() || v.max.is_nan() {
        return Some(format!("has min = {} and max = {}: NaN is no number", v.min, v.max));
    }
    if v.min > v.max {
        return Some(format!("has min = {} above max = {}", v.min, v.max));
    }
    let outside = |bound: f64| match (v.value_type, limits(v.value_type)) {
        (ValueType::F32, _) => !holds_single(bound),
        (_, Some((low, high))) => bound.is_finite() && !(low as f64..=high as f64).contains(&bound),
        _ => false,
    };
    let (name, bound) = [("min", v.min), ("max", v.max)].into_iter().find(|(_, bound)| outside(*bound))?;
    Some(format!("has {name} = {bound}, which {} cannot hold", type_name(v.value_type)))
}

fn start_range(_: &ModelDescription, v: &Variable) -> Option<String> {
    let bounds = || format!("outside its range from {} to {}", v.min, v.max);
    match &v.start {
        Start::Numbers(numbers) => {
            if numbers.iter().any(|x| x.is_nan()) {
                return Some("has the start value NaN, which is no number".into());
            }
            let single = v.value_type == ValueType::F32;
            let large = |x: &&f64| single && !holds_single(**x);
            if let Some(x) = numbers.iter().find(large) {
                return Some(format!("has the start value {x:e}, which Float32 cannot hold"));
            }
            let outside = numbers.iter().find(|x| v.min <= v.max && (**x < v.min || **x > v.max))?;
            Some(format!("has the start value {outside} {}", bounds()))
        }
        Start::Integers(numbers) => {
            if let Some((low, high)) = limits(v.value_type)
                && let Some(x) = numbers.iter().find(|x| !(low..=high).contains(*x))
            {
                return Some(format!(
                    "has the start value {x}, which {} cannot hold",
                    type_name(v.value_type)
                ));
            }
            if let Some(x) =
                numbers.iter().find(|x| v.min <= v.max && ((**x as f64) < v.min || **x as f64 > v.max))
            {
                return Some(format!("has the start value {x} {}", bounds()));
            }
            let item = |x: &&i128| v.items.iter().all(|(_, value)| i128::from(*value) != **x);
            let none = numbers.iter().find(item).filter(|_| !v.items.is_empty())?;
            Some(format!("has the start value {none}, which is no item of its enumeration"))
        }
        _ => None,
    }
}

fn start_count(_: &ModelDescription, v: &Variable) -> Option<String> {
    let count = match &v.start {
        Start::None => return None,
        Start::Numbers(x) => x.len(),
        Start::Integers(x) => x.len(),
        Start::Texts(x) => x.len(),
        Start::Bytes(x) => x.len(),
    };
    (count != 1 && count != v.len()).then(|| match v.sizes.is_empty() {
        true => format!("has {count} start values and is a scalar"),
        false => format!("has {count} start values for {} elements", v.len()),
    })
}

fn start_missing(_: &ModelDescription, v: &Variable) -> Option<String> {
    let exact = matches!(v.initial, Some(Initial::Exact | Initial::Approx));
    let fixed = v.variability == Variability::Constant
        || matches!(v.causality, Causality::Input | Causality::Parameter | Causality::StructuralParameter)
            && v.initial != Some(Initial::Calculated);
    (v.start == Start::None && v.value_type != ValueType::Clock && (exact || fixed))
        .then(|| "needs a start value".into())
}

/// Where nothing else is said, outputs, local variables and calculated parameters that are not constant are calculated
/// (FMI 2.0.4 §2.2.7, FMI 3.0.2 §2.4.7.5, tables of `initial`).
fn start_calculated(_: &ModelDescription, v: &Variable) -> Option<String> {
    if v.start == Start::None {
        return None;
    }
    let result = matches!(v.causality, Causality::Output | Causality::Local | Causality::CalculatedParameter);
    match (v.causality, v.initial) {
        (Causality::Independent, _) => Some("is the independent variable and has a start value".into()),
        (_, Some(Initial::Calculated)) => Some("is initially calculated and has a start value".into()),
        (_, None) if result && v.variability != Variability::Constant => {
            Some("has a start value and is initially calculated, as it has no `initial`".into())
        }
        _ => None,
    }
}

fn unit(d: &ModelDescription, v: &Variable) -> Option<String> {
    let unit = v.unit.as_ref()?;
    let defined = d.units.iter().any(|(n, _)| n == unit) || d.plain_units.contains(unit);
    (!defined).then(|| format!("has the unit `{}`, which UnitDefinitions does not define", printable(unit)))
}

fn base_unit(d: &ModelDescription, v: &Variable) -> Option<String> {
    let unit = v.unit.as_ref().filter(|u| d.plain_units.contains(u))?;
    Some(format!("has the unit `{}`, whose base units are not given", printable(unit)))
}

fn clock(_: &ModelDescription, v: &Variable) -> Option<String> {
    let known = v.ticks.is_some() || v.told.is_some() || v.triggered;
    (v.value_type == ValueType::Clock && v.causality == Causality::Input && !known)
        .then(|| "is a clock without an intervalVariability of the standard".into())
}

/// Combinations of causality and variability that the standards forbid (FMI 2.0.4 §2.2.7, FMI 3.0.2 §2.4.7.5).
fn role(_: &ModelDescription, v: &Variable) -> Option<String> {
    use Causality as C;
    use Variability as V;
    let parameter = matches!(v.causality, C::Parameter | C::CalculatedParameter | C::StructuralParameter);
    let wrong = match v.variability {
        V::Constant => parameter || matches!(v.causality, C::Input | C::Independent),
        V::Fixed | V::Tunable => matches!(v.causality, C::Input | C::Output | C::Independent),
        V::Discrete => parameter || v.causality == C::Independent,
        V::Continuous => parameter,
    };
    wrong.then(|| format!("is {:?} and {:?}, which no variable can be", v.causality, v.variability))
}

fn continuous(_: &ModelDescription, v: &Variable) -> Option<String> {
    let float = matches!(v.value_type, ValueType::F64 | ValueType::F32);
    (v.variability == Variability::Continuous && !float)
        .then(|| format!("is continuous; {:?} changes in steps only", v.value_type))
}

fn derivative(d: &ModelDescription, v: &Variable) -> Option<String> {
    let of = v.derivative_of?;
    let (there, how) = match d.version {
        Version::V2 => ((1..=d.variables.len()).contains(&(of as usize)), "index"),
        Version::V3 => (d.variables.iter().any(|other| other.reference == of), "valueReference"),
    };
    (!there).then(|| format!("is the derivative of the variable with the {how} {of}, which does not exist"))
}

fn clock_reference(d: &ModelDescription, v: &Variable) -> Option<String> {
    let of = |number: u32| d.variables.iter().find(move |other| other.reference == number);
    let wrong = |number: &u32| of(*number).is_none_or(|other| other.value_type != ValueType::Clock);
    let number = *v.clocks.iter().find(|number| wrong(number))?;
    Some(match of(number) {
        None => format!("belongs to the clock with the valueReference {number}, which does not exist"),
        Some(other) => format!("belongs to the clock `{}`, which is none", printable(&other.name)),
    })
}

/// Outputs and the model structure: each output is listed once, and nothing else.
fn structure(d: &ModelDescription) -> Vec<Defect> {
    let listed = |k: usize| d.outputs.iter().filter(|u| u.variable == k).count();
    let of = |line, message| Defect { kind: DefectKind::Structure, line, message };
    let mut all = Vec::new();
    for (k, v) in d.variables.iter().enumerate().filter(|(_, v)| !v.alias) {
        let output = v.causality == Causality::Output;
        // a clock need not be listed in FMI 3
        let wanted = output && (d.version == Version::V2 || v.value_type != ValueType::Clock);
        let message = match (output, listed(k)) {
            (true, 0) if wanted => "is an output that ModelStructure does not list",
            (false, 1..) => "is listed as an output in ModelStructure, and is none",
            (true, 2..) => "is listed more than once as an output in ModelStructure",
            _ => continue,
        };
        all.push(of(Some(v.line), format!("`{}` {message}", printable(&v.name))));
    }
    let own = |v: &&Variable| v.causality == Causality::Independent && !v.alias;
    let independent: Vec<&Variable> = d.variables.iter().filter(own).collect();
    if independent.len() > 1 || d.version == Version::V3 && independent.is_empty() {
        let line = independent.get(1).map(|second| second.line);
        let count = independent.len();
        all.push(of(line, format!("there are {count} independent variables, where one is wanted")));
    }
    all
}
