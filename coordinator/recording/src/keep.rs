//! State of a recorder from earlier steps, so that a run can continue in another process as if nothing had
//! happened: every field is either kept or named as one that the scenario and the modules give again.

/// A value that is made anew from scenario and modules, and then gets what earlier steps have left in it.
pub(crate) trait Keep {
    /// Appends what earlier steps have left.
    fn keep(&self, out: &mut Vec<u8>);
    /// Takes it from the front.
    fn recall(&mut self, from: &mut &[u8]) -> terraglue_subsystem::Result;
}

/// Makes [`Keep`] for a structure: values are kept, so are those that the parts keep, and all others are the same again. A
/// field that is left out does not compile.
macro_rules! keep {
    ($name:ty { $($value:ident),* $(,)? } parts { $($part:ident),* $(,)? } same { $($same:ident),* $(,)? }) => {
        impl $crate::keep::Keep for $name {
            fn keep(&self, out: &mut Vec<u8>) {
                let Self { $($value,)* $($part,)* $($same: _,)* } = self;
                $(terraglue_subsystem::bytes::Persist::write($value, out);)*
                $($part.iter().for_each(|part| part.keep(out));)*
            }
            fn recall(&mut self, from: &mut &[u8]) -> terraglue_subsystem::Result {
                let Self { $($value,)* $($part,)* $($same: _,)* } = self;
                $(*$value = terraglue_subsystem::bytes::Persist::read(from)?;)*
                $($part.iter_mut().try_for_each(|part| part.recall(from))?;)*
                Ok(())
            }
        }
    };
}
pub(crate) use keep;
