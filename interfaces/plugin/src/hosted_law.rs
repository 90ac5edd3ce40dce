//! A law that lives in the host – in another process, say – as foreign soils see it: a table of functions like that of any
//! law, whose only number is the place of the law.
//!
//! A status carries less than the law's own message: that is kept here, and completes the error of the soil's call.

use crate::abi::*;
use crate::law::{TableLaw, pressed, sheared};
use std::sync::{Arc, Mutex, PoisonError};
use terraglue_subsystem::{Error, NodeLaw, Result};

/// The law, and the message of its last failure.
struct Inner {
    law: Arc<dyn NodeLaw>,
    words: Mutex<Option<String>>,
}

/// A law of the host with its table.
pub(crate) struct HostedLaw {
    // Both stay where they are: the host's table points at the first, and the first at the second.
    table: Box<TableLaw>,
    inner: Box<Inner>,
}

impl HostedLaw {
    /// None: the law has functions that no table can hold.
    pub(crate) fn new(law: Arc<dyn NodeLaw>) -> Option<Self> {
        let inner = Box::new(Inner { law, words: Mutex::new(None) });
        let functions = TgNodeLaw {
            size: size_of::<TgNodeLaw>() as u32,
            state_doubles: inner.law.state_doubles() as u32,
            pressure: inner.law.has_pressure().then_some(pressure),
            shear: inner.law.has_shear().then_some(shear),
        };
        // An address has at most 52 bits on every machine that modules are made for, so that it is a whole number.
        let address = (&raw const *inner).expose_provenance() as f64;
        // SAFETY: the functions are ours and keep to the header; the table is copied.
        let table = unsafe { TableLaw::new(inner.law.name(), &raw const functions, vec![address]) };
        table.ok().map(|table| Self { table: Box::new(table), inner })
    }

    /// As the table of a host shows it; valid as long as this.
    pub(crate) fn open(&self) -> TgOpenLaw {
        self.table.open()
    }

    /// Message of its failure, given once.
    pub(crate) fn words(&self) -> Option<String> {
        self.inner.words.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Inner {
    /// The law whose place the numbers name.
    ///
    /// # Safety
    /// They are those of a [`HostedLaw`] that lives.
    unsafe fn of<'a>(numbers: &[f64]) -> Option<&'a Self> {
        let address = *numbers.first()? as usize;
        // SAFETY: made in `HostedLaw::new` from a box that it owns.
        unsafe { std::ptr::with_exposed_provenance::<Self>(address).as_ref() }
    }

    fn kept(&self, done: Result) -> Result {
        if let Err(error) = &done
            && !matches!(error, Error::Discard { .. })
        {
            let mut words = self.words.lock().unwrap_or_else(PoisonError::into_inner);
            words.get_or_insert_with(|| error.to_string());
        }
        done
    }
}

unsafe extern "C" fn pressure(nodes: *const TgPressureNodes, out: *mut TgPressureAnswer) -> TgStatus {
    // SAFETY: the soil hands our numbers back, while the instance and with it the law lives.
    unsafe {
        let numbers = nodes.as_ref().map(|n| crate::text::slice(n.parameters, n.n_parameters));
        let Some(inner) = numbers.and_then(|numbers| Inner::of(numbers)) else { return TG_ERROR };
        pressed(nodes, out, inner.law.state_doubles(), |_, nodes, out| {
            inner.kept(inner.law.pressure(nodes, out))
        })
    }
}

unsafe extern "C" fn shear(nodes: *const TgShearNodes, out: *mut TgShearAnswer) -> TgStatus {
    // SAFETY: as in `pressure`.
    unsafe {
        let numbers = nodes.as_ref().map(|n| crate::text::slice(n.parameters, n.n_parameters));
        let Some(inner) = numbers.and_then(|numbers| Inner::of(numbers)) else { return TG_ERROR };
        sheared(nodes, out, inner.law.state_doubles(), |_, nodes, out| {
            inner.kept(inner.law.shear(nodes, out))
        })
    }
}
