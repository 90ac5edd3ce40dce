//! Calls that no coordinator makes, straight through the table of a module: what a checker asks.
#![allow(unsafe_code)] // Goes around the safe conversion on purpose.

use super::HostServices;
use super::error::LoadError;
use super::library::{LoadedModule, entry};
use std::ffi::{CStr, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};
use terraglue_plugin::abi::*;
use terraglue_plugin::{ForeignModule, ForeignSubsystem};
use terraglue_subsystem::Config;

/// Facts of the table of a module before anything is made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableFacts {
    /// Its `size`, bytes.
    pub size: u32,
    /// Its `abi_minor`.
    pub abi_minor: u32,
    /// Whether `id` is not null.
    pub id_is_set: bool,
    /// Its `description`.
    pub description: Option<String>,
}

/// Loads a library and reads the head of its table.
///
/// # Errors
/// As [`LoadedModule::load`].
pub fn table_of(path: &Path) -> Result<TableFacts, LoadError> {
    LoadedModule::load(path)?;
    let entry = entry(path)?;
    // SAFETY: `load` has found the table usable: it is not null and longer than the fields read here.
    let table = unsafe { &*entry() };
    let description = (!table.description.is_null()).then(|| {
        // SAFETY: not null, zero-terminated by contract.
        unsafe { CStr::from_ptr(table.description) }.to_string_lossy().into_owned()
    });
    Ok(TableFacts {
        size: table.size,
        abi_minor: table.abi_minor,
        id_is_set: !table.id.is_null(),
        description,
    })
}

/// A call that the module must answer by a status, and what it did instead.
pub type OddCall = (&'static str, String);

/// Makes an instance and asks it for what cannot be: unknown inputs, levels, slots, types, tiles, names.
///
/// # Errors
/// The call, with its odd argument and the wrong answer.
pub fn probe_odd_calls(path: &Path, config: &Config, services: &HostServices) -> Result<(), OddCall> {
    let module = LoadedModule::load(path).map_err(|e| ("loading", e.to_string()))?;
    let Some(module) = module.foreign() else { return Ok(()) };
    let made = made(module, config, services)?;
    let (table, instance) = made.raw();
    let table = *table;
    // SAFETY: all calls below hand over valid memory of the sizes that they name, for the length of the call.
    unsafe {
        steps(&table, instance)?;
        states(&table, instance, services.slots)?;
        values(&table, instance)?;
        if let Some(tile) = table.field_tile {
            let mut out: TgFieldTile = std::mem::zeroed();
            refused("field_tile", "field 1000", tile(instance, 1000, 0, 0, &raw mut out))?;
        }
        if let Some(text) = table.last_error.map(|f| f(instance))
            && text.is_null()
        {
            return Err(("last_error", "null after a refusal; a text says why".into()));
        }
    }
    Ok(())
}

fn made(
    module: &ForeignModule,
    config: &Config,
    services: &HostServices,
) -> Result<ForeignSubsystem, OddCall> {
    module.instantiate(config, services.for_instance("checked")).map_err(|e| ("instantiate", e.to_string()))
}

/// An empty step at t = 0 of a millisecond.
fn empty_step() -> TgStep {
    TgStep { t: 0.0, h: 1e-3, index: 0, trial: 0, n: 0, n_ports: 0, n_nodes: 0, ports: null(), nodes: null() }
}

unsafe fn steps(table: &TgSubsystem, instance: *mut c_void) -> Result<(), OddCall> {
    let step = empty_step();
    let mut out: TgResponse = unsafe { std::mem::zeroed() };
    out.reached = 1e-3;
    let input = TgInput { kind: 77, reserved: 0, t: null(), x: null(), v: null() };
    if let Some(advance) = table.advance {
        let status = unsafe { advance(instance, &raw const step, &raw const input, &raw mut out) };
        // An input without numbers is no input: a step without ports may take it, but must not end the instance.
        alive("advance", "the unknown kind of input 77", status)?;
    }
    if let Some(jacobian) = table.interface_jacobian {
        let status = unsafe { jacobian(instance, &raw const step, 9, null_mut()) };
        alive("interface_jacobian", "the unknown level 9, no port", status)?;
    }
    Ok(())
}

unsafe fn states(table: &TgSubsystem, instance: *mut c_void, slots: u32) -> Result<(), OddCall> {
    for slot in [slots, u32::MAX] {
        if let Some(save) = table.save_state {
            refused("save_state", "a slot beyond host->slots", unsafe { save(instance, slot) })?;
        }
        if let Some(restore) = table.restore_state {
            refused("restore_state", "a slot beyond host->slots", unsafe { restore(instance, slot) })?;
        }
    }
    if let Some(deserialize) = table.deserialize {
        let status = unsafe { deserialize(instance, TgBytes { data: null(), size: 0 }) };
        refused("deserialize", "no bytes", status)?;
    }
    Ok(())
}

unsafe fn values(table: &TgSubsystem, instance: *mut c_void) -> Result<(), OddCall> {
    let mut number = 0.0f64;
    let id = u32::MAX;
    for (value_type, given) in [(TG_F64, "the unknown id 4294967295"), (99, "the unknown type 99")] {
        let data = (&raw mut number).cast();
        let values = TgValues { value_type, n_ids: 1, ids: &raw const id, count: 1, data };
        if let Some(get) = table.get {
            refused("get", given, unsafe { get(instance, &raw const values) })?;
        }
        if let Some(set) = table.set {
            refused("set", given, unsafe { set(instance, &raw const values) })?;
        }
    }
    if let Some(act) = table.act {
        refused("act", "an action without a name", unsafe { act(instance, c"".as_ptr(), c"".as_ptr()) })?;
    }
    Ok(())
}

/// A known status that is no success and does not end the instance.
fn refused(call: &'static str, given: &str, status: TgStatus) -> Result<(), OddCall> {
    if status == TG_OK {
        return Err((call, format!("success for {given}")));
    }
    alive(call, given, status)
}

fn alive(call: &'static str, given: &str, status: TgStatus) -> Result<(), OddCall> {
    match status {
        TG_OK | TG_REFUSED | TG_ERROR | TG_UNSUPPORTED | TG_DISCARD => Ok(()),
        TG_FATAL => Err((call, format!("the end of the instance for {given}"))),
        other => Err((call, format!("the unknown status {other} for {given}"))),
    }
}
