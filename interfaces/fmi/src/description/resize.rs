//! Sizes of arrays by the values of structural parameters (FMI 3.0).

use super::model::{Causality, Dimension, ModelDescription, Start, Variability, Variable};
use super::printable;
use std::collections::BTreeMap;

/// Most elements of one array.
const ELEMENTS: u64 = 1 << 28;

impl ModelDescription {
    /// Values that dimensions may name, by number in calls: those of structural parameters and constants.
    pub(super) fn structure(&self) -> BTreeMap<u32, u64> {
        let value = |v: &Variable| match &v.start {
            Start::Integers(all) => all.first().and_then(|n| u64::try_from(*n).ok()),
            _ => None,
        };
        let names = |v: &&Variable| {
            v.causality == Causality::StructuralParameter || v.variability == Variability::Constant
        };
        let all = self.variables.iter().filter(names);
        all.filter_map(|v| Some((v.reference, value(v)?))).collect()
    }

    /// The same FMU after structural parameters (number in calls, value) were set: arrays have other sizes. Start values of
    /// arrays whose shape changed belong to the old shape and are gone.
    ///
    /// # Errors
    /// An array that would be larger than any.
    pub fn resized(&self, values: &[(u32, u64)]) -> Result<Self, String> {
        let mut parameters = self.structure();
        parameters.extend(values.iter().copied());
        let mut other = self.clone();
        for v in &mut other.variables {
            if v.causality == Causality::StructuralParameter
                && let Some((_, value)) = values.iter().find(|(reference, _)| *reference == v.reference)
            {
                v.start = Start::Integers(vec![i128::from(*value)]);
            }
            let sizes = v.shape(&parameters)?;
            if sizes != v.sizes {
                (v.sizes, v.start, v.resized) = (sizes, Start::None, true);
            }
        }
        Ok(other)
    }
}

impl Variable {
    /// Sizes of its dimensions where structural parameters have these values.
    pub(super) fn shape(&self, parameters: &BTreeMap<u32, u64>) -> Result<Vec<u32>, String> {
        let (mut product, mut sizes) = (1_u64, Vec::new());
        for dimension in &self.dimensions {
            let size = match dimension {
                Dimension::Fixed(n) => *n,
                Dimension::Parameter(reference) => *parameters.get(reference).ok_or_else(|| {
                    let name = printable(&self.name);
                    format!("`{name}`: {reference} is no structural parameter with a start value")
                })?,
            };
            // an empty array may have a long side; without it the sides themselves stay in bounds
            product =
                product.max(1).checked_mul(size).filter(|p| *p <= ELEMENTS).ok_or_else(|| {
                    format!("`{}` has more than {ELEMENTS} elements", printable(&self.name))
                })?;
            sizes.push(size as u32);
        }
        Ok(sizes)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use terraglue_subsystem::ValueType;

    fn sized() -> ModelDescription {
        let plain = Variable {
            name: "n".into(),
            reference: 1,
            value_type: ValueType::U64,
            causality: Causality::StructuralParameter,
            variability: Variability::Fixed,
            initial: None,
            start: Start::Integers(vec![2]),
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
            unit: None,
            items: Vec::new(),
            dimensions: Vec::new(),
            sizes: Vec::new(),
            description: String::new(),
            line: 1,
            alias: false,
            ticks: None,
            told: None,
            fraction: false,
            triggered: false,
            clocks: Vec::new(),
            resized: false,
            derivative_of: None,
            intermediate: false,
        };
        let array = Variable {
            name: "a".into(),
            reference: 2,
            value_type: ValueType::F64,
            causality: Causality::Parameter,
            start: Start::Numbers(vec![1.0; 6]),
            dimensions: vec![Dimension::Parameter(1), Dimension::Fixed(3)],
            sizes: vec![2, 3],
            ..plain.clone()
        };
        ModelDescription { variables: vec![plain, array], ..ModelDescription::default() }
    }

    #[test]
    fn arrays_follow_their_parameters_and_lose_the_start_of_another_shape() {
        let same = sized().resized(&[(1, 2)]).unwrap();
        assert_eq!(same.variables, sized().variables);
        let other = sized().resized(&[(1, 5)]).unwrap();
        let a = &other.variables[1];
        assert_eq!((a.sizes.as_slice(), &a.start, a.resized), ([5, 3].as_slice(), &Start::None, true));
        assert_eq!(other.variables[0].start, Start::Integers(vec![5]));
        assert!(sized().resized(&[(1, 0)]).unwrap().variables[1].is_empty());
    }

    #[test]
    fn what_no_memory_holds_is_refused() {
        for size in [1 << 28, 1 << 62, u64::MAX] {
            assert!(sized().resized(&[(1, size)]).unwrap_err().contains("`a` has more than"), "{size}");
        }
    }
}
