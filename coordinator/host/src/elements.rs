//! Elements of arrays as variables of their own, `position[2,1]`, counted from 1: what is connected, changed by an event
//! or a fault and compared in a condition is one value.
//!
//! Whole arrays keep their numbers; elements get numbers behind all of them.

use std::cell::RefCell;
use terraglue_subsystem::{Error, Result, Subsystem, Values, ValuesMut, Variable};

/// Numbers of elements start here, so that code that is reloaded may have more variables.
const FIRST: u32 = 1 << 31;

/// The elements of one subsystem.
pub struct Elements {
    /// Scalars, and in the place of each array its elements.
    pub variables: Vec<Variable>,
    /// Number of the first element.
    first: u32,
    /// Of each element.
    places: Vec<Place>,
    /// Number and length of each array.
    arrays: Vec<(u32, usize)>,
    /// Room for an array of which a part is asked.
    room: RefCell<Vec<f64>>,
}

#[derive(Clone, Copy)]
struct Place {
    array: u32,
    element: usize,
    count: usize,
}

/// Numbers that are looked up together.
enum Run {
    /// So many, with so many values in all, that the subsystem knows itself.
    Own(usize, usize),
    /// All elements of an array in their order.
    Whole(Place),
    /// So many elements of one array.
    Part(usize, Place),
}

/// `go!(type, values, an empty value, room for an array)`; numbers, which flow in every step, ask for no memory.
macro_rules! each_type {
    ($elements:expr, $kind:ident, $values:expr, $go:ident) => {
        match $values {
            $kind::F64(values) => $go!(F64, values, f64::NAN, &mut *$elements.room.borrow_mut()),
            $kind::F32(values) => $go!(F32, values, f32::NAN, &mut Vec::new()),
            $kind::I8(values) => $go!(I8, values, 0, &mut Vec::new()),
            $kind::I16(values) => $go!(I16, values, 0, &mut Vec::new()),
            $kind::I32(values) => $go!(I32, values, 0, &mut Vec::new()),
            $kind::I64(values) => $go!(I64, values, 0, &mut Vec::new()),
            $kind::U8(values) => $go!(U8, values, 0, &mut Vec::new()),
            $kind::U16(values) => $go!(U16, values, 0, &mut Vec::new()),
            $kind::U32(values) => $go!(U32, values, 0, &mut Vec::new()),
            $kind::U64(values) => $go!(U64, values, 0, &mut Vec::new()),
            $kind::Bool(values) => $go!(Bool, values, false, &mut Vec::new()),
            $kind::String(values) => $go!(String, values, String::new(), &mut Vec::new()),
            $kind::Binary(values) => $go!(Binary, values, Vec::new(), &mut Vec::new()),
            $kind::Enumeration(values) => $go!(Enumeration, values, 0, &mut Vec::new()),
        }
    };
}

type Get<T> = fn(&dyn Subsystem, &[u32], &mut [T]) -> Result;
type Set<T> = fn(&mut dyn Subsystem, &[u32], &[T]) -> Result;

impl Elements {
    /// `None` where no variable is an array.
    pub fn of(own: &[Variable]) -> Option<Self> {
        let arrays: Vec<_> = own.iter().filter(|v| !v.dims.is_empty()).map(|v| (v.id, v.len())).collect();
        if arrays.is_empty() {
            return None;
        }
        let largest = own.iter().map(|v| v.id).max().unwrap_or(0);
        let first = if largest < FIRST { FIRST } else { largest.checked_add(1)? };
        let (mut variables, mut places) = (Vec::new(), Vec::new());
        for v in own {
            if v.dims.is_empty() {
                variables.push(v.clone());
                continue;
            }
            for element in 0..v.len() {
                let id = first.checked_add(u32::try_from(places.len()).ok()?)?;
                variables.push(Variable { id, name: v.element_name(element), dims: Vec::new(), ..v.clone() });
                places.push(Place { array: v.id, element, count: v.len() });
            }
        }
        let longest = arrays.iter().map(|a| a.1).max().unwrap_or(0);
        Some(Self { variables, first, places, arrays, room: RefCell::new(Vec::with_capacity(longest)) })
    }

    /// Whether a number is that of an element.
    pub fn has(&self, id: u32) -> bool {
        self.place(id).is_some()
    }

    /// Numbers of the elements of an array; none for a scalar.
    pub fn of_array(&self, id: u32) -> impl Iterator<Item = u32> + '_ {
        let own = self.places.iter().zip(self.first..).filter(move |(place, _)| place.array == id);
        own.map(|(_, id)| id)
    }

    fn place(&self, id: u32) -> Option<Place> {
        self.places.get(id.checked_sub(self.first)? as usize).copied()
    }

    fn length(&self, id: u32) -> usize {
        self.arrays.iter().find(|a| a.0 == id).map_or(1, |a| a.1)
    }

    /// Longest run at the front of `ids`, which is not empty.
    fn run(&self, ids: &[u32]) -> Run {
        let Some(front) = self.place(ids[0]) else {
            let own = ids.iter().take_while(|id| !self.has(**id));
            let (count, values) = own.fold((0, 0), |(n, sum), id| (n + 1, sum + self.length(*id)));
            return Run::Own(count, values);
        };
        let of_array = ids.iter().map_while(|id| self.place(*id)).take_while(|p| p.array == front.array);
        let in_order = of_array.clone().take(front.count).enumerate().filter(|(k, p)| p.element == *k);
        if front.element == 0 && in_order.count() == front.count {
            return Run::Whole(front);
        }
        Run::Part(of_array.count(), front)
    }

    /// Values of scalars, arrays and elements, one behind the other.
    pub fn get(&self, subsystem: &dyn Subsystem, ids: &[u32], out: ValuesMut) -> Result {
        macro_rules! read {
            ($variant:ident, $out:expr, $empty:expr, $room:expr) => {{
                let get =
                    |s: &dyn Subsystem, ids: &[u32], out: &mut [_]| s.get(ids, ValuesMut::$variant(out));
                self.read(subsystem, ids, $out, $empty, $room, get)
            }};
        }
        each_type!(self, ValuesMut, out, read)
    }

    fn read<T: Clone>(
        &self,
        subsystem: &dyn Subsystem,
        mut ids: &[u32],
        mut out: &mut [T],
        empty: T,
        room: &mut Vec<T>,
        get: Get<T>,
    ) -> Result {
        while !ids.is_empty() {
            let run = self.run(ids);
            let (count, values) = run.size();
            let (front, rest) = out.split_at_mut_checked(values).ok_or_else(mismatch)?;
            match run {
                Run::Own(..) => get(subsystem, &ids[..count], front)?,
                Run::Whole(place) => get(subsystem, &[place.array], front)?,
                Run::Part(_, place) => {
                    room.clear();
                    room.resize(place.count, empty.clone());
                    get(subsystem, &[place.array], room)?;
                    let places = ids.iter().filter_map(|id| self.place(*id));
                    front.iter_mut().zip(places).for_each(|(out, p)| out.clone_from(&room[p.element]));
                }
            }
            (ids, out) = (&ids[count..], rest);
        }
        Ok(())
    }

    /// Sets scalars, arrays and elements; the other elements of an array stay as they are.
    pub fn set(&self, subsystem: &mut dyn Subsystem, ids: &[u32], values: Values) -> Result {
        macro_rules! write {
            ($variant:ident, $values:expr, $empty:expr, $room:expr) => {{
                let get =
                    |s: &dyn Subsystem, ids: &[u32], out: &mut [_]| s.get(ids, ValuesMut::$variant(out));
                let set = |s: &mut dyn Subsystem, ids: &[u32], new: &[_]| s.set(ids, Values::$variant(new));
                self.write(subsystem, ids, $values, $empty, $room, (get, set))
            }};
        }
        each_type!(self, Values, values, write)
    }

    fn write<T: Clone>(
        &self,
        subsystem: &mut dyn Subsystem,
        mut ids: &[u32],
        mut values: &[T],
        empty: T,
        room: &mut Vec<T>,
        (get, set): (Get<T>, Set<T>),
    ) -> Result {
        while !ids.is_empty() {
            let run = self.run(ids);
            let (count, n) = run.size();
            let (front, rest) = values.split_at_checked(n).ok_or_else(mismatch)?;
            match run {
                Run::Own(..) => set(subsystem, &ids[..count], front)?,
                Run::Whole(place) => set(subsystem, &[place.array], front)?,
                Run::Part(_, place) => {
                    room.clear();
                    room.resize(place.count, empty.clone());
                    get(subsystem, &[place.array], room)?;
                    let places = ids.iter().filter_map(|id| self.place(*id));
                    front.iter().zip(places).for_each(|(value, p)| room[p.element].clone_from(value));
                    set(subsystem, &[place.array], room)?;
                }
            }
            (ids, values) = (&ids[count..], rest);
        }
        Ok(())
    }
}

impl Run {
    /// Count of the numbers, and of the values that they encode.
    fn size(&self) -> (usize, usize) {
        match self {
            Self::Own(count, values) => (*count, *values),
            Self::Whole(place) => (place.count, place.count),
            Self::Part(count, _) => (*count, *count),
        }
    }
}

fn mismatch() -> Error {
    Error::Refused("the numbers of variables and of their values do not fit".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use terraglue_subsystem::{Capabilities, Causality, Input, Response, Step, ValueType};

    /// A scalar, a 2 × 3 array, a scalar, a list of three; and a list of texts.
    struct Board {
        variables: Vec<Variable>,
        numbers: Vec<f64>,
        texts: [String; 2],
    }

    impl Board {
        fn new() -> Self {
            let one = |id, name: &str, dims: &[u32]| Variable {
                dims: dims.to_vec(),
                ..Variable::real(id, name, "m", Causality::Input, "")
            };
            let texts = one(9, "e", &[2]).typed(ValueType::String);
            Self {
                variables: vec![
                    one(2, "a", &[]),
                    one(3, "b", &[2, 3]),
                    one(5, "c", &[]),
                    one(7, "d", &[3]),
                    texts,
                ],
                numbers: (0..11).map(f64::from).collect(),
                texts: ["x".into(), "y".into()],
            }
        }

        fn range(&self, id: u32) -> Result<std::ops::Range<usize>> {
            match id {
                2 => Ok(0..1),
                3 => Ok(1..7),
                5 => Ok(7..8),
                7 => Ok(8..11),
                _ => Err(Error::Refused(format!("no number {id}"))),
            }
        }
    }

    impl Subsystem for Board {
        fn capabilities(&self) -> Capabilities {
            Capabilities::FORCE
        }
        fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
            Ok(())
        }
        fn variables(&self) -> &[Variable] {
            &self.variables
        }
        fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
            match out {
                ValuesMut::F64(mut out) => {
                    for id in ids {
                        let own = &self.numbers[self.range(*id)?];
                        let (front, rest) = out.split_at_mut(own.len());
                        front.copy_from_slice(own);
                        out = rest;
                    }
                    Ok(())
                }
                ValuesMut::String(out) => {
                    out.clone_from_slice(&self.texts);
                    Ok(())
                }
                _ => Err(Error::Unsupported),
            }
        }
        fn set(&mut self, ids: &[u32], values: Values) -> Result {
            match values {
                Values::F64(mut values) => {
                    for id in ids {
                        let range = self.range(*id)?;
                        let (front, rest) = values.split_at(range.len());
                        self.numbers[range].copy_from_slice(front);
                        values = rest;
                    }
                    Ok(())
                }
                Values::String(values) => {
                    self.texts.clone_from_slice(values);
                    Ok(())
                }
                _ => Err(Error::Unsupported),
            }
        }
    }

    #[test]
    fn elements_stand_in_the_place_of_their_array() {
        let elements = Elements::of(&Board::new().variables).expect("arrays");
        let names: Vec<&str> = elements.variables.iter().map(|v| v.name.as_str()).collect();
        let expected = "a b[1,1] b[1,2] b[1,3] b[2,1] b[2,2] b[2,3] c d[1] d[2] d[3] e[1] e[2]";
        assert_eq!(names.join(" "), expected);
        assert_eq!(elements.of_array(7).count(), 3);
        assert!(Elements::of(&[Variable::real(0, "a", "", Causality::Input, "")]).is_none());
    }

    #[test]
    fn one_text_of_a_list_is_changed_alone() {
        let mut board = Board::new();
        let elements = Elements::of(&board.variables).expect("arrays");
        let id = elements.variables.last().expect("a text").id;
        elements.set(&mut board, &[id], Values::String(&["z".into()])).expect("set");
        assert_eq!(board.texts, ["x", "z"]);
        let mut out = [String::new()];
        elements.get(&board, &[id], ValuesMut::String(&mut out)).expect("read");
        assert_eq!(out, ["z"]);
    }

    proptest! {
        /// Reading and setting any of them in any order is reading and setting the numbers behind them.
        #[test]
        fn elements_are_the_numbers_of_their_arrays(
            places in prop::collection::vec(0..11_usize, 1..30), new in prop::collection::vec(-1e3..1e3_f64, 30),
        ) {
            let mut board = Board::new();
            let elements = Elements::of(&board.variables).expect("arrays");
            let ids: Vec<u32> = places.iter().map(|k| elements.variables[*k].id).collect();
            elements.set(&mut board, &ids, Values::F64(&new[..ids.len()])).expect("set");
            let mut expected: Vec<f64> = (0..11).map(f64::from).collect();
            places.iter().zip(&new).for_each(|(k, x)| expected[*k] = *x);
            prop_assert_eq!(&board.numbers, &expected);
            let mut out = vec![f64::NAN; ids.len()];
            elements.get(&board, &ids, ValuesMut::F64(&mut out)).expect("read");
            let told: Vec<f64> = places.iter().map(|k| expected[*k]).collect();
            prop_assert_eq!(out, told);
        }

        /// Whole arrays keep their numbers beside those of elements.
        #[test]
        fn whole_arrays_are_read_beside_elements(order in prop::collection::vec(0..4_usize, 1..8)) {
            let board = Board::new();
            let elements = Elements::of(&board.variables).expect("arrays");
            let own = [2, 3, elements.variables[5].id, 7];
            let ids: Vec<u32> = order.iter().map(|k| own[*k]).collect();
            let values = [vec![0.0], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0], vec![5.0], vec![8.0, 9.0, 10.0]];
            let expected: Vec<f64> = order.iter().flat_map(|k| values[*k].clone()).collect();
            let mut out = vec![f64::NAN; expected.len()];
            elements.get(&board, &ids, ValuesMut::F64(&mut out)).expect("read");
            prop_assert_eq!(out, expected);
            prop_assert!(elements.get(&board, &ids, ValuesMut::F64(&mut [])).is_err());
        }
    }
}
