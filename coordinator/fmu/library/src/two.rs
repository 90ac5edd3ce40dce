//! The functions of FMI 2.0 for co-simulation.

use crate::instance::{Log, Logger, call, create, free, put, resources, room, slice, text};
use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use terraglue_fmi::export::{Handle, Status, Wrong, wrong};
use terraglue_subsystem::ValueType;

type Component = *mut c_void;
type State = *mut c_void;
type Text = *const c_char;

const REAL: &[ValueType] = &[ValueType::F64, ValueType::F32];
const INTEGER: &[ValueType] =
    &[ValueType::I32, ValueType::I8, ValueType::I16, ValueType::U8, ValueType::U16, ValueType::Enumeration];
const BOOLEAN: &[ValueType] = &[ValueType::Bool];
const STRING: &[ValueType] = &[ValueType::String];
/// `fmi2CoSimulation`.
const CO_SIMULATION: c_int = 1;

/// `fmi2CallbackFunctions`; memory is our own, and no step is asynchronous.
#[repr(C)]
pub struct Callbacks {
    logger: Option<unsafe extern "C" fn(*mut c_void, Text, c_int, Text, Text, ...)>,
    allocate: *const c_void,
    free: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> Text {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> Text {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    c: Component,
    on: c_int,
    _n: usize,
    _names: *const Text,
) -> c_int {
    // SAFETY: by the contract of the standard, here and in all functions below.
    unsafe {
        call(c, |i| {
            i.log.verbose = on != 0;
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: Text,
    kind: c_int,
    guid: Text,
    location: Text,
    functions: *const Callbacks,
    _visible: c_int,
    logging: c_int,
) -> Component {
    // SAFETY: as above.
    unsafe {
        let callbacks = functions.as_ref();
        let log = Log {
            logger: callbacks.and_then(|c| c.logger).map_or(Logger::None, Logger::Two),
            environment: callbacks.map_or(std::ptr::null_mut(), |c| c.environment),
            name: CString::new(text(name).unwrap_or_default()).unwrap_or_default(),
            verbose: logging != 0,
        };
        let refused = (kind != CO_SIMULATION).then_some("this FMU is for co-simulation only");
        create(guid, resources(text(location)), refused, log)
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(c: Component) {
    // SAFETY: as above.
    unsafe { free(c) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    c: Component,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.set_experiment(start, (stop_defined != 0).then_some(stop))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(c: Component) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.enter_initialization()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(c: Component) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.exit_initialization()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(c: Component) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.terminate()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(c: Component) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.reset()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(c: Component, vr: *const c_uint, n: usize, out: *mut f64) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.get(slice(vr, n)?, REAL, room(out, n)?)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(c: Component, vr: *const c_uint, n: usize, out: *mut c_int) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.get::<i32>(slice(vr, n)?, INTEGER, room(out, n)?)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBoolean(c: Component, vr: *const c_uint, n: usize, out: *mut c_int) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let mut values = vec![false; n];
            i.fmu.get(slice(vr, n)?, BOOLEAN, &mut values)?;
            room(out, n)?.iter_mut().zip(values).for_each(|(o, v)| *o = v.into());
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetString(c: Component, vr: *const c_uint, n: usize, out: *mut Text) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let mut values = vec![String::new(); n];
            i.fmu.get(slice(vr, n)?, STRING, &mut values)?;
            i.texts = values.into_iter().map(|v| CString::new(v).unwrap_or_default()).collect();
            room(out, n)?.iter_mut().zip(&i.texts).for_each(|(o, v)| *o = v.as_ptr());
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(c: Component, vr: *const c_uint, n: usize, values: *const f64) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.set(slice(vr, n)?, REAL, slice(values, n)?)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetInteger(
    c: Component,
    vr: *const c_uint,
    n: usize,
    values: *const c_int,
) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.set::<i32>(slice(vr, n)?, INTEGER, slice(values, n)?)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetBoolean(
    c: Component,
    vr: *const c_uint,
    n: usize,
    values: *const c_int,
) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let values: Vec<bool> = slice(values, n)?.iter().map(|v| *v != 0).collect();
            i.fmu.set(slice(vr, n)?, BOOLEAN, &values)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetString(
    c: Component,
    vr: *const c_uint,
    n: usize,
    values: *const Text,
) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let values: Vec<String> =
                slice(values, n)?.iter().map(|v| text(*v).unwrap_or_default()).collect();
            i.fmu.set(slice(vr, n)?, STRING, &values)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(c: Component, t: f64, h: f64, _no_going_back: c_int) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let reached = i.fmu.step(t, h)?;
            if reached.complete && !reached.terminate {
                return Ok(());
            }
            let text = format!("the FMU asks for the end of the run at t = {} s", reached.time);
            Err(Wrong { status: Status::Discard, text })
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2CancelStep(c: Component) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |_| wrong("no step is ever pending")) }
}

/// `fmi2LastSuccessfulTime`.
const LAST_SUCCESSFUL_TIME: c_int = 2;
/// `fmi2Terminated`.
const TERMINATED: c_int = 3;

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStatus(c: Component, _kind: c_int, _out: *mut c_int) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |_| discarded("no step is ever pending")) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(c: Component, kind: c_int, out: *mut f64) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            if kind != LAST_SUCCESSFUL_TIME {
                return discarded("of the real statuses only fmi2LastSuccessfulTime is known");
            }
            put(out, i.fmu.reached().time);
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetIntegerStatus(c: Component, _kind: c_int, _out: *mut c_int) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |_| discarded("there is no integer status")) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(c: Component, kind: c_int, out: *mut c_int) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            if kind != TERMINATED {
                return discarded("of the boolean statuses only fmi2Terminated is known");
            }
            put(out, i.fmu.reached().terminate.into());
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStringStatus(c: Component, _kind: c_int, _out: *mut Text) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |_| discarded("no step is ever pending")) }
}

fn discarded(text: &str) -> terraglue_fmi::export::Answer {
    Err(Wrong { status: Status::Discard, text: text.into() })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(c: Component, state: *mut State) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::save(c, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(c: Component, state: State) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.restore(Handle(state as usize))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(c: Component, state: *mut State) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::release(c, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(c: Component, state: State, size: *mut usize) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::serialised_size(c, state, size) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    c: Component,
    state: State,
    out: *mut u8,
    size: usize,
) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::serialise(c, state, out, size) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    c: Component,
    bytes: *const u8,
    size: usize,
    state: *mut State,
) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::deserialise(c, bytes, size, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetDirectionalDerivative(
    c: Component,
    _unknowns: *const c_uint,
    _n_unknowns: usize,
    _knowns: *const c_uint,
    _n_knowns: usize,
    _seed: *const f64,
    _out: *mut f64,
) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |_| wrong("this FMU has no directional derivatives")) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetRealInputDerivatives(
    c: Component,
    _vr: *const c_uint,
    _n: usize,
    _order: *const c_int,
    _values: *const f64,
) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |_| wrong("this FMU does not interpolate its inputs")) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealOutputDerivatives(
    c: Component,
    _vr: *const c_uint,
    _n: usize,
    _order: *const c_int,
    _out: *mut f64,
) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |_| wrong("this FMU has no derivatives of its outputs")) }
}
