//! The module's side of the border: wraps a Rust [`Module`] into the table of C functions.
//!
//! Every function catches panics. An instance that panicked is dead: it answers `TG_FATAL` with the text of the
//! panic from then on, because its state may be half-written.

mod data;
mod descriptions;
mod services;
mod sight;
mod steps;
mod values;

use crate::abi::*;
use crate::text::{borrowed, c_string, panic_text};
use descriptions::ExportedDescriptions;
use services::ForeignHost;
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::ffi::{CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use terraglue_subsystem::{Config, Error, LawModule, Module, Result, Schema, Subsystem};

thread_local! {
    /// Why `instantiate` or `schema` failed on this thread; instances keep their own text.
    static FAILURE: RefCell<CString> = RefCell::default();
}

/// An instance behind the opaque pointer.
struct Exported {
    subsystem: Box<dyn Subsystem>,
    host: Arc<ForeignHost>,
    descriptions: ExportedDescriptions,
    failure: RefCell<CString>,
    dead: Cell<bool>,
    scratch: RefCell<Scratch>,
    known: sight::Known,
}

/// Buffers that are kept from call to call.
#[derive(Default)]
struct Scratch {
    estimate: Vec<f64>,
    active: Vec<u8>,
    strings: Vec<String>,
    binaries: Vec<Vec<u8>>,
    bytes: Vec<u8>,
    overlays: Option<(Vec<TgOverlay>, crate::keep::Keep)>,
}

impl Exported {
    fn fail(&self, error: Error) -> TgStatus {
        let (status, text) = crate::convert::status(error);
        *self.failure.borrow_mut() = c_string(&text);
        self.dead.set(self.dead.get() || status == TG_FATAL);
        status
    }

    fn die(&self, payload: &(dyn std::any::Any + Send)) -> TgStatus {
        self.fail(Error::Fatal(panic_text(payload)))
    }
}

/// Runs a call that may change the instance.
///
/// # Safety
/// `instance` comes from `instantiate`, is not freed, and no other call of it is running.
unsafe fn change(instance: *mut c_void, f: impl FnOnce(&mut Exported) -> Result) -> TgStatus {
    // SAFETY: by the contract of this function the pointer is a live Exported without other users.
    let exported = unsafe { &mut *instance.cast::<Exported>() };
    if exported.dead.get() {
        return TG_FATAL;
    }
    match catch_unwind(AssertUnwindSafe(|| f(exported))) {
        Ok(Ok(())) => TG_OK,
        Ok(Err(error)) => exported.fail(error),
        Err(payload) => exported.die(payload.as_ref()),
    }
}

/// Runs a call that only looks; `fallback` is answered after a failure.
///
/// # Safety
/// `instance` comes from `instantiate`, is not freed, and no changing call of it is running.
unsafe fn look<T>(instance: *mut c_void, fallback: T, f: impl FnOnce(&Exported) -> T) -> T {
    // SAFETY: by the contract of this function the pointer is a live Exported that nobody changes.
    let exported = unsafe { &*instance.cast::<Exported>() };
    if exported.dead.get() {
        return fallback;
    }
    catch_unwind(AssertUnwindSafe(|| f(exported))).unwrap_or_else(|payload| {
        exported.die(payload.as_ref());
        fallback
    })
}

/// As `look` for a call that answers with a status.
///
/// # Safety
/// As `look`.
unsafe fn look_status(instance: *mut c_void, f: impl FnOnce(&Exported) -> Result) -> TgStatus {
    // SAFETY: the same contract.
    unsafe { look(instance, TG_FATAL, |e| f(e).map_or_else(|error| e.fail(error), |()| TG_OK)) }
}

fn set_failure(text: &str) {
    FAILURE.with(|f| *f.borrow_mut() = c_string(text));
}

/// The table of a module. Its texts live as long as the process: this is called once per library.
///
/// `fallback_name` replaces the name where the module has no schema; `description` is the text of the section
/// `.terraglue`.
pub fn table<M: Module>(fallback_name: &str, description: &'static [u8]) -> TgSubsystem {
    let schema = catch_unwind(M::schema).ok();
    let kind = schema.as_ref().map_or(TG_CONTROLLER, |s| s.kind as u32);
    let id = c_string(schema.as_ref().map_or(fallback_name, |s| &s.name));
    TgSubsystem {
        size: size_of::<TgSubsystem>() as u32,
        abi_major: TG_ABI_MAJOR,
        abi_minor: TG_ABI_MINOR,
        kind,
        id: id.into_raw(),
        description: description.as_ptr().cast(),
        schema: Some(schema_json::<M>),
        instantiate: Some(instantiate::<M>),
        free: Some(free),
        capabilities: Some(data::capabilities),
        advance: Some(steps::advance),
        last_error: Some(last_error),
        set_ports: Some(steps::set_ports),
        estimate_forces: Some(steps::estimate_forces),
        solve_compatibility: Some(steps::solve_compatibility),
        interface_jacobian: Some(steps::interface_jacobian),
        commit: Some(steps::commit),
        save_state: Some(data::save_state),
        restore_state: Some(data::restore_state),
        serialize: Some(data::serialize),
        deserialize: Some(data::deserialize),
        variables: Some(data::variables),
        get: Some(values::get),
        set: Some(values::set),
        actions: Some(data::actions),
        act: Some(data::act),
        next_event_time: Some(data::next_event_time),
        scene: Some(data::scene),
        body_states: Some(data::body_states),
        fields: Some(data::fields),
        field_tile: Some(data::field_tile),
        energy: Some(data::energy),
        pressure: None,
        shear: None,
        law_state_doubles: 0,
        reserved: 0,
        law: std::ptr::null(),
        observe: Some(sight::observe),
        scene_joints: Some(sight::scene_joints),
        shape_materials: Some(sight::shape_materials),
        shape_visibility: Some(sight::shape_visibility),
        streams: Some(sight::streams),
        stream: Some(sight::stream),
        overlays: Some(sight::overlays),
    }
}

/// The table of a law; as [`table`].
pub fn law_table<L: LawModule>(fallback_name: &str, description: &'static [u8]) -> TgSubsystem {
    let name = catch_unwind(L::schema).map(|s| s.name).ok();
    let id = c_string(name.as_deref().unwrap_or(fallback_name));
    // SAFETY: all zero is a table whose functions are null.
    let empty: TgSubsystem = unsafe { std::mem::zeroed() };
    TgSubsystem {
        size: size_of::<TgSubsystem>() as u32,
        abi_major: TG_ABI_MAJOR,
        abi_minor: TG_ABI_MINOR,
        kind: TG_LAW,
        id: id.into_raw(),
        description: description.as_ptr().cast(),
        schema: Some(law_schema::<L>),
        law: Box::into_raw(Box::new(crate::law::functions::<L>())),
        ..empty
    }
}

unsafe extern "C" fn law_schema<L: LawModule>() -> *const c_char {
    schema_text(L::schema)
}

unsafe extern "C" fn schema_json<M: Module>() -> *const c_char {
    schema_text(M::schema)
}

fn schema_text(schema: fn() -> Schema) -> *const c_char {
    let json = catch_unwind(|| serde_json::to_string(&schema()));
    let text = match json {
        Ok(Ok(text)) => text,
        Ok(Err(error)) => {
            set_failure(&format!("the schema cannot be written as JSON: {error}"));
            return std::ptr::null();
        }
        Err(payload) => {
            set_failure(&panic_text(payload.as_ref()));
            return std::ptr::null();
        }
    };
    kept(c_string(&text))
}

/// The same text as one that belongs to the process: asking again costs no memory.
fn kept(text: CString) -> *const c_char {
    static KEPT: Mutex<BTreeSet<CString>> = Mutex::new(BTreeSet::new());
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let known = kept.get(&text).map(|known| known.as_ptr());
    // the characters stay where they are when the owner moves into the set
    known.unwrap_or_else(|| {
        let new = text.as_ptr();
        kept.insert(text);
        new
    })
}

unsafe extern "C" fn instantiate<M: Module>(
    host: *const TgHost,
    config: *const c_char,
    instance: *mut *mut c_void,
) -> TgStatus {
    let made = catch_unwind(|| -> Result<Box<Exported>> {
        // SAFETY: the host passes a complete tg_host and a zero-terminated text for this call.
        let (host, config) = unsafe { (ForeignHost::new(host)?, borrowed(config)?) };
        let host = Arc::new(host);
        let subsystem = M::instantiate(&Config::parse(config)?, host.clone());
        host.close_terrain();
        let subsystem = subsystem?;
        let descriptions = ExportedDescriptions::of(subsystem.as_ref());
        Ok(Box::new(Exported {
            subsystem,
            host,
            descriptions,
            failure: RefCell::default(),
            dead: Cell::new(false),
            scratch: RefCell::default(),
            known: sight::Known::default(),
        }))
    });
    let error = match made {
        Ok(Ok(exported)) => {
            // SAFETY: the host passes a place for the pointer.
            unsafe { *instance = Box::into_raw(exported).cast() };
            return TG_OK;
        }
        Ok(Err(error)) => error,
        Err(payload) => Error::Fatal(panic_text(payload.as_ref())),
    };
    let (status, text) = crate::convert::status(error);
    set_failure(&text);
    status
}

unsafe extern "C" fn free(instance: *mut c_void) {
    if instance.is_null() {
        return;
    }
    // SAFETY: the host frees an instance once, after its last call.
    let exported = unsafe { Box::from_raw(instance.cast::<Exported>()) };
    let host = exported.host.clone();
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(exported))) {
        let text = format!("while it was freed it {}", panic_text(payload.as_ref()));
        terraglue_subsystem::Host::log(host.as_ref(), terraglue_subsystem::LogLevel::Error, &text);
    }
}

unsafe extern "C" fn last_error(instance: *mut c_void) -> *const c_char {
    if instance.is_null() {
        return FAILURE.with(|f| f.borrow().as_ptr());
    }
    // SAFETY: a live instance; the text is replaced by the next call only.
    unsafe { (*instance.cast::<Exported>()).failure.borrow().as_ptr() }
}
