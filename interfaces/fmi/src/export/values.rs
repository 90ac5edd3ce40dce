//! Reading and writing the variables of a subsystem as one of the types of FMI.

use super::{Answer, wrong};
use terraglue_subsystem::{Error, Result, Subsystem, ValueType, Values, ValuesMut, Variable};

/// A type in which values cross the C interfaces.
pub trait FmiType: Clone + Default {
    /// Reads a whole variable.
    ///
    /// # Errors
    /// A variable of another type, or the error of the subsystem.
    fn read(subsystem: &dyn Subsystem, v: &Variable, out: &mut [Self]) -> Result;
    /// Writes a whole variable.
    ///
    /// # Errors
    /// A variable of another type, or the error of the subsystem.
    fn write(subsystem: &mut dyn Subsystem, v: &Variable, values: &[Self]) -> Result;
    /// Why a value is not acceptable for any variable.
    fn objection(&self) -> Option<String> {
        None
    }
}

/// Reads through another type and converts every element.
fn narrow<A: FmiType, B>(
    subsystem: &dyn Subsystem,
    v: &Variable,
    out: &mut [B],
    convert: impl Fn(&A) -> Option<B>,
) -> Result {
    let mut own = vec![A::default(); out.len()];
    A::read(subsystem, v, &mut own)?;
    for (out, own) in out.iter_mut().zip(&own) {
        *out = convert(own).ok_or_else(|| unfit(v))?;
    }
    Ok(())
}

/// Converts every element and writes another type.
fn widen<A: FmiType, B>(
    subsystem: &mut dyn Subsystem,
    v: &Variable,
    values: &[B],
    convert: impl Fn(&B) -> Option<A>,
) -> Result {
    let own: Option<Vec<A>> = values.iter().map(convert).collect();
    A::write(subsystem, v, &own.ok_or_else(|| unfit(v))?)
}

fn unfit(v: &Variable) -> Error {
    Error::Refused(format!("a value of `{}` does not fit its type", v.name))
}

macro_rules! plain {
    ($($t:ty = $variant:ident),*) => {$(
        impl FmiType for $t {
            fn read(subsystem: &dyn Subsystem, v: &Variable, out: &mut [Self]) -> Result {
                subsystem.get(&[v.id], ValuesMut::$variant(out))
            }
            fn write(subsystem: &mut dyn Subsystem, v: &Variable, values: &[Self]) -> Result {
                subsystem.set(&[v.id], Values::$variant(values))
            }
        }
    )*};
}
plain!(i8 = I8, i16 = I16, u8 = U8, u16 = U16, u32 = U32, u64 = U64, bool = Bool);
plain!(String = String, Vec<u8> = Binary);

macro_rules! float {
    ($($t:ty = $variant:ident),*) => {$(
        impl FmiType for $t {
            fn read(subsystem: &dyn Subsystem, v: &Variable, out: &mut [Self]) -> Result {
                if v.value_type != ValueType::$variant {
                    return narrow(subsystem, v, out, |x: &f32| Some(<$t>::from(*x)));
                }
                out.fill(<$t>::NAN);
                subsystem.get(&[v.id], ValuesMut::$variant(out))?;
                match out.iter().any(|x| x.is_nan()) {
                    true => Err(Error::Failed(format!("the variable `{}` is NaN", v.name))),
                    false => Ok(()),
                }
            }
            fn write(subsystem: &mut dyn Subsystem, v: &Variable, values: &[Self]) -> Result {
                if v.value_type != ValueType::$variant {
                    return widen(subsystem, v, values, |x: &$t| Some(*x as f32));
                }
                subsystem.set(&[v.id], Values::$variant(values))
            }
            fn objection(&self) -> Option<String> {
                (!self.is_finite()).then(|| format!("{self} is not a finite number"))
            }
        }
    )*};
}
float!(f32 = F32, f64 = F64);

impl FmiType for i64 {
    fn read(subsystem: &dyn Subsystem, v: &Variable, out: &mut [Self]) -> Result {
        let out = if v.value_type == ValueType::Enumeration {
            ValuesMut::Enumeration(out)
        } else {
            ValuesMut::I64(out)
        };
        subsystem.get(&[v.id], out)
    }
    fn write(subsystem: &mut dyn Subsystem, v: &Variable, values: &[Self]) -> Result {
        if v.value_type != ValueType::Enumeration {
            return subsystem.set(&[v.id], Values::I64(values));
        }
        let names = v.enumeration.len() as i64;
        match values.iter().find(|x| !(0..names).contains(*x)) {
            Some(x) => Err(Error::Refused(format!("`{}` = {x} is none of 0 … {}", v.name, names - 1))),
            None => subsystem.set(&[v.id], Values::Enumeration(values)),
        }
    }
}

impl FmiType for i32 {
    fn read(subsystem: &dyn Subsystem, v: &Variable, out: &mut [Self]) -> Result {
        match v.value_type {
            ValueType::I8 => narrow(subsystem, v, out, |x: &i8| Some((*x).into())),
            ValueType::I16 => narrow(subsystem, v, out, |x: &i16| Some((*x).into())),
            ValueType::U8 => narrow(subsystem, v, out, |x: &u8| Some((*x).into())),
            ValueType::U16 => narrow(subsystem, v, out, |x: &u16| Some((*x).into())),
            ValueType::Enumeration => narrow(subsystem, v, out, |x: &i64| (*x).try_into().ok()),
            _ => subsystem.get(&[v.id], ValuesMut::I32(out)),
        }
    }
    fn write(subsystem: &mut dyn Subsystem, v: &Variable, values: &[Self]) -> Result {
        match v.value_type {
            ValueType::I8 => widen(subsystem, v, values, |x: &i32| i8::try_from(*x).ok()),
            ValueType::I16 => widen(subsystem, v, values, |x: &i32| i16::try_from(*x).ok()),
            ValueType::U8 => widen(subsystem, v, values, |x: &i32| u8::try_from(*x).ok()),
            ValueType::U16 => widen(subsystem, v, values, |x: &i32| u16::try_from(*x).ok()),
            ValueType::Enumeration => widen(subsystem, v, values, |x: &i32| Some(i64::from(*x))),
            _ => subsystem.set(&[v.id], Values::I32(values)),
        }
    }
}

/// Reads the entries behind `references`, one after the other, into `out`.
pub(super) fn read<T: FmiType>(
    subsystem: &dyn Subsystem,
    layout: &super::Layout,
    references: &[u32],
    types: &[ValueType],
    out: &mut [T],
) -> Answer {
    let (mut at, mut k) = (0, 0);
    while k < references.len() {
        let entry = find(subsystem, layout, references[k], types)?;
        let v = &subsystem.variables()[entry.variable];
        if entry.element.is_none() {
            let end = at + v.len();
            let part = out.get_mut(at..end).ok_or_else(|| short(&v.name))?;
            T::read(subsystem, v, part)?;
            (at, k) = (end, k + 1);
            continue;
        }
        let mut whole = vec![T::default(); v.len()];
        T::read(subsystem, v, &mut whole)?;
        while let Some(element) = same(layout, references.get(k), entry.variable) {
            *out.get_mut(at).ok_or_else(|| short(&v.name))? = whole[element].clone();
            (at, k) = (at + 1, k + 1);
        }
    }
    if at == out.len() { Ok(()) } else { wrong(format!("{} values asked for, {at} are there", out.len())) }
}

/// Writes `values` to the entries behind `references`. `may` says whether a variable can be set now.
pub(super) fn write<T: FmiType>(
    subsystem: &mut dyn Subsystem,
    layout: &super::Layout,
    references: &[u32],
    types: &[ValueType],
    values: &[T],
    may: impl Fn(&Variable) -> Answer,
) -> Answer {
    let (mut at, mut k) = (0, 0);
    while k < references.len() {
        let entry = find(subsystem, layout, references[k], types)?;
        let v = subsystem.variables()[entry.variable].clone();
        may(&v)?;
        let mut whole = vec![T::default(); v.len()];
        if entry.element.is_none() {
            let end = at + v.len();
            whole.clone_from_slice(values.get(at..end).ok_or_else(|| short(&v.name))?);
            (at, k) = (end, k + 1);
        } else {
            T::read(subsystem, &v, &mut whole)?;
            while let Some(element) = same(layout, references.get(k), entry.variable) {
                whole[element] = values.get(at).ok_or_else(|| short(&v.name))?.clone();
                (at, k) = (at + 1, k + 1);
            }
        }
        if let Some(why) = whole.iter().find_map(T::objection) {
            return wrong(format!("`{}` cannot be set: {why}", v.name));
        }
        T::write(subsystem, &v, &whole)
            .map_err(|e| super::Wrong { text: format!("`{}` cannot be set: {e}", v.name), ..e.into() })?;
    }
    if at == values.len() { Ok(()) } else { wrong(format!("{} values given, {at} are taken", values.len())) }
}

fn find<'a>(
    subsystem: &dyn Subsystem,
    layout: &'a super::Layout,
    reference: u32,
    types: &[ValueType],
) -> Answer<&'a super::Entry> {
    let Some(entry) = layout.entry(reference) else {
        return wrong(format!("there is no variable with the value reference {reference}"));
    };
    let found = subsystem.variables()[entry.variable].value_type;
    if types.contains(&found) {
        return Ok(entry);
    }
    wrong(format!("`{}` (value reference {reference}) is of type {found:?}", entry.name))
}

/// The element that a reference stands for, if it is one of this variable.
fn same(layout: &super::Layout, reference: Option<&u32>, variable: usize) -> Option<usize> {
    let entry = layout.entry(*reference?)?;
    (entry.variable == variable).then_some(entry.element?)
}

fn short(name: &str) -> super::Wrong {
    super::Wrong { status: super::Status::Error, text: format!("too few values for `{name}`") }
}
