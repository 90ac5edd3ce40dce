//! The functions of FMI 3.0 for co-simulation; those of the other interface types refuse.

use crate::instance::{Log, Logger, call, create, free, put, resources, room, slice, text};
use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use terraglue_fmi::export::{Answer, ExportedInstance, Handle, wrong};
use terraglue_subsystem::ValueType;

type Component = *mut c_void;
type State = *mut c_void;
type Text = *const c_char;
type Refs = *const c_uint;
type Logger3 = unsafe extern "C" fn(*mut c_void, c_int, Text, Text);

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> Text {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(
    c: Component,
    on: bool,
    _n: usize,
    _names: *const Text,
) -> c_int {
    // SAFETY: by the contract of the standard, here and in all functions below.
    unsafe {
        call(c, |i| {
            i.log.verbose = on;
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    name: Text,
    token: Text,
    resource_path: Text,
    _visible: bool,
    logging: bool,
    event_mode: bool,
    _early_return: bool,
    _intermediate: Refs,
    n_intermediate: usize,
    environment: *mut c_void,
    logger: Option<Logger3>,
    _intermediate_update: *const c_void,
) -> Component {
    // SAFETY: as above.
    unsafe {
        let log = log(name, environment, logger, logging);
        let refused = match (event_mode, n_intermediate) {
            (true, _) => Some("this FMU has no event mode (hasEventMode is false)"),
            (_, 1..) => Some("this FMU has no intermediate update"),
            _ => None,
        };
        create(token, resources(text(resource_path)), refused, log)
    }
}

/// # Safety
/// As for the functions that instantiate.
unsafe fn log(name: Text, environment: *mut c_void, logger: Option<Logger3>, verbose: bool) -> Log {
    // SAFETY: see above.
    let name = unsafe { text(name) }.unwrap_or_default();
    Log {
        logger: logger.map_or(Logger::None, Logger::Three),
        environment,
        name: CString::new(name).unwrap_or_default(),
        verbose,
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateModelExchange(
    name: Text,
    token: Text,
    resource_path: Text,
    _visible: bool,
    logging: bool,
    environment: *mut c_void,
    logger: Option<Logger3>,
) -> Component {
    // SAFETY: as above.
    unsafe {
        let log = log(name, environment, logger, logging);
        create(token, resources(text(resource_path)), Some("this FMU is for co-simulation only"), log)
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateScheduledExecution(
    name: Text,
    token: Text,
    resource_path: Text,
    _visible: bool,
    logging: bool,
    environment: *mut c_void,
    logger: Option<Logger3>,
    _clock_update: *const c_void,
    _lock: *const c_void,
    _unlock: *const c_void,
) -> Component {
    // SAFETY: as above.
    unsafe {
        let log = log(name, environment, logger, logging);
        create(token, resources(text(resource_path)), Some("this FMU is for co-simulation only"), log)
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(c: Component) {
    // SAFETY: as above.
    unsafe { free(c) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    c: Component,
    _tolerance_defined: bool,
    _tolerance: f64,
    start: f64,
    stop_defined: bool,
    stop: f64,
) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            i.fmu.set_experiment(start, stop_defined.then_some(stop))?;
            i.fmu.enter_initialization()
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitInitializationMode(c: Component) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.exit_initialization()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Terminate(c: Component) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.terminate()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Reset(c: Component) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.reset()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    c: Component,
    t: f64,
    h: f64,
    _no_going_back: bool,
    event_needed: *mut bool,
    terminate: *mut bool,
    early_return: *mut bool,
    last_time: *mut f64,
) -> c_int {
    // SAFETY: as above.
    unsafe {
        put(event_needed, false);
        put(terminate, false);
        put(early_return, false);
        call(c, |i| {
            let done = i.fmu.step(t, h);
            let reached = i.fmu.reached();
            put(last_time, reached.time);
            put(terminate, reached.terminate);
            done.map(drop)
        })
    }
}

macro_rules! numbers {
    ($($get:ident $set:ident $t:ty, [$($variant:ident),*];)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(c: Component, vr: Refs, n: usize, out: *mut $t, m: usize) -> c_int {
            // SAFETY: as above.
            unsafe { call(c, |i| i.fmu.get::<$t>(slice(vr, n)?, &[$(ValueType::$variant),*], room(out, m)?)) }
        }
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(c: Component, vr: Refs, n: usize, values: *const $t, m: usize) -> c_int {
            // SAFETY: as above.
            unsafe { call(c, |i| i.fmu.set::<$t>(slice(vr, n)?, &[$(ValueType::$variant),*], slice(values, m)?)) }
        }
    )*};
}

numbers! {
    fmi3GetFloat32 fmi3SetFloat32 f32, [F32];
    fmi3GetInt8 fmi3SetInt8 i8, [I8];
    fmi3GetUInt8 fmi3SetUInt8 u8, [U8];
    fmi3GetInt16 fmi3SetInt16 i16, [I16];
    fmi3GetUInt16 fmi3SetUInt16 u16, [U16];
    fmi3GetInt32 fmi3SetInt32 i32, [I32];
    fmi3GetUInt32 fmi3SetUInt32 u32, [U32];
    fmi3GetInt64 fmi3SetInt64 i64, [I64, Enumeration];
    fmi3GetUInt64 fmi3SetUInt64 u64, [U64];
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(c: Component, vr: Refs, n: usize, out: *mut f64, m: usize) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| get_with_time(&i.fmu, slice(vr, n)?, room(out, m)?)) }
}

/// Value reference 0 is the time.
fn get_with_time(fmu: &ExportedInstance, mut references: &[u32], mut out: &mut [f64]) -> Answer {
    while let Some(k) = references.iter().position(|r| *r == 0) {
        let before: usize = references[..k].iter().map(|r| fmu.len(*r).unwrap_or(1)).sum();
        if out.len() <= before {
            return wrong("too few values for the time");
        }
        let (head, rest) = std::mem::take(&mut out).split_at_mut(before);
        fmu.get(&references[..k], &[ValueType::F64], head)?;
        rest[0] = fmu.time();
        (references, out) = (&references[k + 1..], &mut rest[1..]);
    }
    fmu.get(references, &[ValueType::F64], out)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    c: Component,
    vr: Refs,
    n: usize,
    values: *const f64,
    m: usize,
) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.set(slice(vr, n)?, &[ValueType::F64], slice(values, m)?)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetBoolean(c: Component, vr: Refs, n: usize, out: *mut bool, m: usize) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let mut values = vec![false; m];
            i.fmu.get(slice(vr, n)?, &[ValueType::Bool], &mut values)?;
            room(out, m)?.copy_from_slice(&values);
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetBoolean(
    c: Component,
    vr: Refs,
    n: usize,
    values: *const u8,
    m: usize,
) -> c_int {
    // SAFETY: as above; a byte that is neither 0 nor 1 would be no bool.
    unsafe {
        call(c, |i| {
            let values: Vec<bool> = slice(values, m)?.iter().map(|v| *v != 0).collect();
            i.fmu.set(slice(vr, n)?, &[ValueType::Bool], &values)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetString(c: Component, vr: Refs, n: usize, out: *mut Text, m: usize) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let mut values = vec![String::new(); m];
            i.fmu.get(slice(vr, n)?, &[ValueType::String], &mut values)?;
            i.texts = values.into_iter().map(|v| CString::new(v).unwrap_or_default()).collect();
            room(out, m)?.iter_mut().zip(&i.texts).for_each(|(o, v)| *o = v.as_ptr());
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetString(
    c: Component,
    vr: Refs,
    n: usize,
    values: *const Text,
    m: usize,
) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let values: Vec<String> =
                slice(values, m)?.iter().map(|v| text(*v).unwrap_or_default()).collect();
            i.fmu.set(slice(vr, n)?, &[ValueType::String], &values)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetBinary(
    c: Component,
    vr: Refs,
    n: usize,
    sizes: *mut usize,
    out: *mut *const u8,
    m: usize,
) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let mut values = vec![Vec::new(); m];
            i.fmu.get::<Vec<u8>>(slice(vr, n)?, &[ValueType::Binary], &mut values)?;
            i.bytes = values;
            let (sizes, out) = (room(sizes, m)?, room(out, m)?);
            for ((value, size), place) in i.bytes.iter().zip(sizes).zip(out) {
                (*size, *place) = (value.len(), value.as_ptr());
            }
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetBinary(
    c: Component,
    vr: Refs,
    n: usize,
    sizes: *const usize,
    values: *const *const u8,
    m: usize,
) -> c_int {
    // SAFETY: as above.
    unsafe {
        call(c, |i| {
            let (sizes, values) = (slice(sizes, m)?, slice(values, m)?);
            let values: Answer<Vec<Vec<u8>>> =
                sizes.iter().zip(values).map(|(size, v)| Ok(slice(*v, *size)?.to_vec())).collect();
            i.fmu.set(slice(vr, n)?, &[ValueType::Binary], &values?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(c: Component, state: *mut State) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::save(c, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(c: Component, state: State) -> c_int {
    // SAFETY: as above.
    unsafe { call(c, |i| i.fmu.restore(Handle(state as usize))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(c: Component, state: *mut State) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::release(c, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializedFMUStateSize(c: Component, state: State, size: *mut usize) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::serialised_size(c, state, size) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializeFMUState(
    c: Component,
    state: State,
    out: *mut u8,
    size: usize,
) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::serialise(c, state, out, size) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DeserializeFMUState(
    c: Component,
    bytes: *const u8,
    size: usize,
    state: *mut State,
) -> c_int {
    // SAFETY: as above.
    unsafe { crate::instance::deserialise(c, bytes, size, state) }
}

/// Functions of what this FMU does not have. Arguments after the first are left unread: the caller owns them in the
/// C calling conventions of all platforms that the FMUs are made for.
macro_rules! refusals {
    ($($name:ident: $why:literal;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(c: Component) -> c_int {
            // SAFETY: as above.
            unsafe { call(c, |_| wrong(concat!(stringify!($name), ": ", $why))) }
        }
    )*};
}

refusals! {
    fmi3EnterEventMode: "this FMU has no event mode";
    fmi3EnterStepMode: "this FMU has no event mode";
    fmi3UpdateDiscreteStates: "this FMU has no event mode";
    fmi3EvaluateDiscreteStates: "this FMU has no event mode";
    fmi3EnterConfigurationMode: "this FMU has no structural parameters";
    fmi3ExitConfigurationMode: "this FMU has no structural parameters";
    fmi3GetDirectionalDerivative: "this FMU has no directional derivatives";
    fmi3GetAdjointDerivative: "this FMU has no adjoint derivatives";
    fmi3GetNumberOfVariableDependencies: "this FMU does not tell dependencies at run time";
    fmi3GetVariableDependencies: "this FMU does not tell dependencies at run time";
    fmi3GetOutputDerivatives: "this FMU has no derivatives of its outputs";
    fmi3GetClock: "this FMU has no clocks";
    fmi3SetClock: "this FMU has no clocks";
    fmi3GetIntervalDecimal: "this FMU has no clocks";
    fmi3GetIntervalFraction: "this FMU has no clocks";
    fmi3GetShiftDecimal: "this FMU has no clocks";
    fmi3GetShiftFraction: "this FMU has no clocks";
    fmi3SetIntervalDecimal: "this FMU has no clocks";
    fmi3SetIntervalFraction: "this FMU has no clocks";
    fmi3SetShiftDecimal: "this FMU has no clocks";
    fmi3SetShiftFraction: "this FMU has no clocks";
    fmi3ActivateModelPartition: "this FMU is for co-simulation only";
    fmi3EnterContinuousTimeMode: "this FMU is for co-simulation only";
    fmi3CompletedIntegratorStep: "this FMU is for co-simulation only";
    fmi3SetTime: "this FMU is for co-simulation only";
    fmi3SetContinuousStates: "this FMU is for co-simulation only";
    fmi3GetContinuousStateDerivatives: "this FMU is for co-simulation only";
    fmi3GetEventIndicators: "this FMU is for co-simulation only";
    fmi3GetContinuousStates: "this FMU is for co-simulation only";
    fmi3GetNominalsOfContinuousStates: "this FMU is for co-simulation only";
    fmi3GetNumberOfEventIndicators: "this FMU is for co-simulation only";
    fmi3GetNumberOfContinuousStates: "this FMU is for co-simulation only";
}
