//! The functions of the C interfaces, by hand from the text of the standards.
//!
//! Every function is optional here: a missing one is an error of the call that needs it, or at load time where the
//! standard demands it or the description promises it. Functions that every step calls come first in a table, on one
//! line of the cache: a chain of FMUs is as quick as its memory.

use crate::error::{Error, Result};
use crate::fmu::Fmu;
use libloading::os::unix::Library;
use std::ffi::{c_char, c_int, c_void};

/// An instance on the other side.
pub type InstanceHandle = *mut c_void;
/// A saved state on the other side.
pub type StateHandle = *mut c_void;
/// A reference to a variable.
pub type Vr = u32;
type Text = *const c_char;

macro_rules! table {
    ($(#[$doc:meta])* $name:ident { $($field:ident = $symbol:literal : fn($($argument:ty),*) $(-> $ret:ty)?;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[repr(C)]
        #[allow(missing_docs)]
        pub struct $name { $(pub $field: Option<unsafe extern "C" fn($($argument),*) $(-> $ret)?>,)* }

        impl $name {
            /// Looks all functions up.
            pub fn find(library: &Library) -> Self {
                // SAFETY: a function of this name has this type, by the standard.
                unsafe {
                    Self { $($field: library.get(concat!($symbol, "\0").as_bytes()).ok().map(|s| *s),)* }
                }
            }

            /// Names of those that are not there.
            pub fn missing(&self) -> Vec<&'static str> {
                let all = [$(($symbol, self.$field.is_some()),)*];
                all.into_iter().filter(|(_, there)| !there).map(|(symbol, _)| symbol).collect()
            }
        }
    };
}

/// The logger of FMI 2.0, which is variadic; only its address is handed over.
pub type Logger2 = unsafe extern "C" fn(*mut c_void, Text, c_int, Text, Text, ...);

/// `fmi2CallbackFunctions`.
#[repr(C)]
#[derive(Debug)]
#[allow(missing_docs)]
pub struct Callbacks2 {
    pub logger: Logger2,
    pub allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    pub free: unsafe extern "C" fn(*mut c_void),
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    pub environment: *mut c_void,
}

/// `fmi3LogMessageCallback`.
pub type Logger3 = unsafe extern "C" fn(*mut c_void, c_int, Text, Text);

/// `fmi3IntermediateUpdateCallback`.
pub type Update3 = unsafe extern "C" fn(*mut c_void, f64, bool, bool, bool, bool, *mut bool, *mut f64);

table! {
    /// FMI 2.0 for co-simulation.
    Two {
        do_step = "fmi2DoStep": fn(InstanceHandle, f64, f64, c_int) -> c_int;
        get_real = "fmi2GetReal": fn(InstanceHandle, *const Vr, usize, *mut f64) -> c_int;
        set_real = "fmi2SetReal": fn(InstanceHandle, *const Vr, usize, *const f64) -> c_int;
        instantiate = "fmi2Instantiate": fn(Text, c_int, Text, Text, *const Callbacks2, c_int, c_int) -> InstanceHandle;
        free = "fmi2FreeInstance": fn(InstanceHandle);
        setup = "fmi2SetupExperiment": fn(InstanceHandle, c_int, f64, f64, c_int, f64) -> c_int;
        enter_initialization = "fmi2EnterInitializationMode": fn(InstanceHandle) -> c_int;
        exit_initialization = "fmi2ExitInitializationMode": fn(InstanceHandle) -> c_int;
        set_logging = "fmi2SetDebugLogging": fn(InstanceHandle, c_int, usize, *const Text) -> c_int;
        terminate = "fmi2Terminate": fn(InstanceHandle) -> c_int;
        reset = "fmi2Reset": fn(InstanceHandle) -> c_int;
        get_integer = "fmi2GetInteger": fn(InstanceHandle, *const Vr, usize, *mut c_int) -> c_int;
        get_boolean = "fmi2GetBoolean": fn(InstanceHandle, *const Vr, usize, *mut c_int) -> c_int;
        get_string = "fmi2GetString": fn(InstanceHandle, *const Vr, usize, *mut Text) -> c_int;
        set_integer = "fmi2SetInteger": fn(InstanceHandle, *const Vr, usize, *const c_int) -> c_int;
        set_boolean = "fmi2SetBoolean": fn(InstanceHandle, *const Vr, usize, *const c_int) -> c_int;
        set_string = "fmi2SetString": fn(InstanceHandle, *const Vr, usize, *const Text) -> c_int;
        get_real_status = "fmi2GetRealStatus": fn(InstanceHandle, c_int, *mut f64) -> c_int;
        get_boolean_status = "fmi2GetBooleanStatus": fn(InstanceHandle, c_int, *mut c_int) -> c_int;
        get_state = "fmi2GetFMUstate": fn(InstanceHandle, *mut StateHandle) -> c_int;
        set_state = "fmi2SetFMUstate": fn(InstanceHandle, StateHandle) -> c_int;
        free_state = "fmi2FreeFMUstate": fn(InstanceHandle, *mut StateHandle) -> c_int;
        state_size = "fmi2SerializedFMUstateSize": fn(InstanceHandle, StateHandle, *mut usize) -> c_int;
        serialize = "fmi2SerializeFMUstate": fn(InstanceHandle, StateHandle, *mut c_char, usize) -> c_int;
        deserialize = "fmi2DeSerializeFMUstate": fn(InstanceHandle, *const c_char, usize, *mut StateHandle) -> c_int;
        directional = "fmi2GetDirectionalDerivative":
            fn(InstanceHandle, *const Vr, usize, *const Vr, usize, *const f64, *mut f64) -> c_int;
        set_slopes = "fmi2SetRealInputDerivatives": fn(InstanceHandle, *const Vr, usize, *const c_int, *const f64) -> c_int;
        get_slopes = "fmi2GetRealOutputDerivatives": fn(InstanceHandle, *const Vr, usize, *const c_int, *mut f64) -> c_int;
    }
}

table! {
    /// FMI 3.0 for co-simulation.
    Three {
        do_step = "fmi3DoStep": fn(
            InstanceHandle, f64, f64, bool, *mut bool, *mut bool, *mut bool, *mut f64
        ) -> c_int;
        get_f64 = "fmi3GetFloat64": fn(InstanceHandle, *const Vr, usize, *mut f64, usize) -> c_int;
        set_f64 = "fmi3SetFloat64": fn(InstanceHandle, *const Vr, usize, *const f64, usize) -> c_int;
        instantiate = "fmi3InstantiateCoSimulation": fn(
            Text, Text, Text, bool, bool, bool, bool, *const Vr, usize, *mut c_void, Logger3, Option<Update3>
        ) -> InstanceHandle;
        free = "fmi3FreeInstance": fn(InstanceHandle);
        enter_configuration = "fmi3EnterConfigurationMode": fn(InstanceHandle) -> c_int;
        exit_configuration = "fmi3ExitConfigurationMode": fn(InstanceHandle) -> c_int;
        enter_initialization = "fmi3EnterInitializationMode": fn(InstanceHandle, bool, f64, f64, bool, f64) -> c_int;
        exit_initialization = "fmi3ExitInitializationMode": fn(InstanceHandle) -> c_int;
        enter_event_mode = "fmi3EnterEventMode": fn(InstanceHandle) -> c_int;
        enter_step_mode = "fmi3EnterStepMode": fn(InstanceHandle) -> c_int;
        update_discrete = "fmi3UpdateDiscreteStates": fn(
            InstanceHandle, *mut bool, *mut bool, *mut bool, *mut bool, *mut bool, *mut f64
        ) -> c_int;
        set_logging = "fmi3SetDebugLogging": fn(InstanceHandle, bool, usize, *const Text) -> c_int;
        terminate = "fmi3Terminate": fn(InstanceHandle) -> c_int;
        reset = "fmi3Reset": fn(InstanceHandle) -> c_int;
        get_f32 = "fmi3GetFloat32": fn(InstanceHandle, *const Vr, usize, *mut f32, usize) -> c_int;
        get_i8 = "fmi3GetInt8": fn(InstanceHandle, *const Vr, usize, *mut i8, usize) -> c_int;
        get_u8 = "fmi3GetUInt8": fn(InstanceHandle, *const Vr, usize, *mut u8, usize) -> c_int;
        get_i16 = "fmi3GetInt16": fn(InstanceHandle, *const Vr, usize, *mut i16, usize) -> c_int;
        get_u16 = "fmi3GetUInt16": fn(InstanceHandle, *const Vr, usize, *mut u16, usize) -> c_int;
        get_i32 = "fmi3GetInt32": fn(InstanceHandle, *const Vr, usize, *mut i32, usize) -> c_int;
        get_u32 = "fmi3GetUInt32": fn(InstanceHandle, *const Vr, usize, *mut u32, usize) -> c_int;
        get_i64 = "fmi3GetInt64": fn(InstanceHandle, *const Vr, usize, *mut i64, usize) -> c_int;
        get_u64 = "fmi3GetUInt64": fn(InstanceHandle, *const Vr, usize, *mut u64, usize) -> c_int;
        get_bool = "fmi3GetBoolean": fn(InstanceHandle, *const Vr, usize, *mut u8, usize) -> c_int;
        get_string = "fmi3GetString": fn(InstanceHandle, *const Vr, usize, *mut Text, usize) -> c_int;
        get_binary = "fmi3GetBinary": fn(InstanceHandle, *const Vr, usize, *mut usize, *mut *const u8, usize) -> c_int;
        set_f32 = "fmi3SetFloat32": fn(InstanceHandle, *const Vr, usize, *const f32, usize) -> c_int;
        set_i8 = "fmi3SetInt8": fn(InstanceHandle, *const Vr, usize, *const i8, usize) -> c_int;
        set_u8 = "fmi3SetUInt8": fn(InstanceHandle, *const Vr, usize, *const u8, usize) -> c_int;
        set_i16 = "fmi3SetInt16": fn(InstanceHandle, *const Vr, usize, *const i16, usize) -> c_int;
        set_u16 = "fmi3SetUInt16": fn(InstanceHandle, *const Vr, usize, *const u16, usize) -> c_int;
        set_i32 = "fmi3SetInt32": fn(InstanceHandle, *const Vr, usize, *const i32, usize) -> c_int;
        set_u32 = "fmi3SetUInt32": fn(InstanceHandle, *const Vr, usize, *const u32, usize) -> c_int;
        set_i64 = "fmi3SetInt64": fn(InstanceHandle, *const Vr, usize, *const i64, usize) -> c_int;
        set_u64 = "fmi3SetUInt64": fn(InstanceHandle, *const Vr, usize, *const u64, usize) -> c_int;
        set_bool = "fmi3SetBoolean": fn(InstanceHandle, *const Vr, usize, *const bool, usize) -> c_int;
        set_string = "fmi3SetString": fn(InstanceHandle, *const Vr, usize, *const Text, usize) -> c_int;
        set_binary = "fmi3SetBinary":
            fn(InstanceHandle, *const Vr, usize, *const usize, *const *const u8, usize) -> c_int;
        get_clock = "fmi3GetClock": fn(InstanceHandle, *const Vr, usize, *mut u8) -> c_int;
        get_interval = "fmi3GetIntervalDecimal": fn(InstanceHandle, *const Vr, usize, *mut f64, *mut c_int) -> c_int;
        get_fraction = "fmi3GetIntervalFraction": fn(InstanceHandle, *const Vr, usize, *mut u64, *mut u64, *mut c_int) -> c_int;
        set_clock = "fmi3SetClock": fn(InstanceHandle, *const Vr, usize, *const bool) -> c_int;
        get_state = "fmi3GetFMUState": fn(InstanceHandle, *mut StateHandle) -> c_int;
        set_state = "fmi3SetFMUState": fn(InstanceHandle, StateHandle) -> c_int;
        free_state = "fmi3FreeFMUState": fn(InstanceHandle, *mut StateHandle) -> c_int;
        state_size = "fmi3SerializedFMUStateSize": fn(InstanceHandle, StateHandle, *mut usize) -> c_int;
        serialize = "fmi3SerializeFMUState": fn(InstanceHandle, StateHandle, *mut u8, usize) -> c_int;
        deserialize = "fmi3DeserializeFMUState": fn(InstanceHandle, *const u8, usize, *mut StateHandle) -> c_int;
        directional = "fmi3GetDirectionalDerivative":
            fn(InstanceHandle, *const Vr, usize, *const Vr, usize, *const f64, usize, *mut f64, usize) -> c_int;
        adjoint = "fmi3GetAdjointDerivative":
            fn(InstanceHandle, *const Vr, usize, *const Vr, usize, *const f64, usize, *mut f64, usize) -> c_int;
        get_slopes = "fmi3GetOutputDerivatives":
            fn(InstanceHandle, *const Vr, usize, *const c_int, *mut f64, usize) -> c_int;
    }
}

/// Functions of one version.
#[derive(Clone, Copy, Debug)]
pub enum Api {
    /// FMI 2.0.
    Two(Two),
    /// FMI 3.0.
    Three(Three),
}

/// Finds the functions of an FMU and checks that those are there which the standard demands of every co-simulation
/// FMU and which the description promises.
pub fn find(fmu: &Fmu, library: &Library) -> Result<Api> {
    use crate::description::Version;
    let (api, missing) = match fmu.description().version {
        Version::V2 => {
            let two = Two::find(library);
            (Api::Two(two), two.missing())
        }
        Version::V3 => {
            let three = Three::find(library);
            (Api::Three(three), three.missing())
        }
    };
    let c = &fmu.description().capabilities;
    let needed = |symbol: &&str| {
        let name = &symbol[4..];
        let always = ["FreeInstance", "EnterInitializationMode", "ExitInitializationMode", "DoStep"];
        let instantiate = name.starts_with("Instantiate") || name == "SetupExperiment";
        let state = name.ends_with("FMUstate") || name.ends_with("FMUState") || name.contains("FMUstateSize");
        let bytes = name.contains("erialize");
        always.contains(&name)
            || instantiate
            || bytes && c.serialize
            || state && !bytes && c.state
            || name == "GetDirectionalDerivative" && c.directional_derivatives
            || name == "GetAdjointDerivative" && c.adjoint_derivatives
            || name == "SetRealInputDerivatives" && c.interpolates_inputs
    };
    match missing.iter().find(|s| needed(s)) {
        None => Ok(api),
        Some(symbol) => Err(Error::Library {
            path: fmu.path().into(),
            message: format!(
                "its library has no function `{symbol}`, which the standard or its description promises"
            ),
        }),
    }
}
