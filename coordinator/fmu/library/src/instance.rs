//! An instance behind a handle of C: calls that no panic leaves, the master's logger, memory for texts.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use terraglue_fmi::export::{Answer, ExportedInstance, Handle, Status, Wrong};
use terraglue_subsystem::LogLevel;

/// Logger of a master.
pub enum Logger {
    /// FMI 2.0: variadic, with the name of the instance.
    Two(unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...)),
    /// FMI 3.0.
    Three(unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char)),
    /// The master takes no log.
    None,
}

/// Where lines go.
pub struct Log {
    pub logger: Logger,
    pub environment: *mut c_void,
    pub name: CString,
    /// Whether more than errors is asked for.
    pub verbose: bool,
}

impl Log {
    /// Hands one line over.
    pub fn line(&self, status: Status, text: &str) {
        let category = if status == Status::Warning { c"logStatusWarning" } else { c"logStatusError" };
        let category = if status == Status::Ok { c"logAll" } else { category };
        // In FMI 2.0 the text is a format: a percent sign is written twice.
        let text = match &self.logger {
            Logger::Two(_) => text.replace('%', "%%"),
            _ => text.to_owned(),
        };
        let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
        // SAFETY: the master promises that its logger lives as long as the instance; all texts end in a zero.
        unsafe {
            match &self.logger {
                Logger::Two(f) => {
                    f(
                        self.environment,
                        self.name.as_ptr(),
                        status as c_int,
                        category.as_ptr(),
                        text.as_ptr(),
                    );
                }
                Logger::Three(f) => f(self.environment, status as c_int, category.as_ptr(), text.as_ptr()),
                Logger::None => {}
            }
        }
    }
}

/// The instance behind a handle of the master.
pub struct Instance {
    pub fmu: ExportedInstance,
    pub log: Log,
    /// Texts handed out by the last call; valid until the next.
    pub texts: Vec<CString>,
    /// Bytes handed out by the last call.
    pub bytes: Vec<Vec<u8>>,
    /// State that was serialised last, so that asking for its size and then for its bytes is one piece of work.
    pub serialised: Option<(usize, Vec<u8>)>,
}

impl Instance {
    fn say(&self, outcome: &Answer) {
        for (level, text) in self.fmu.mailbox().take() {
            let status = match level {
                LogLevel::Error => Status::Error,
                LogLevel::Warning => Status::Warning,
                _ => Status::Ok,
            };
            if self.log.verbose || status != Status::Ok {
                self.log.line(status, &text);
            }
        }
        if let Err(wrong) = outcome {
            self.log.line(wrong.status, &wrong.text);
        }
    }
}

/// Does a call on an instance and answers its status. A null handle is an error; a panic is fatal.
///
/// # Safety
/// `handle` is null or was made by [`create`], is not freed, and is used by one thread at a time.
pub unsafe fn call(handle: *mut c_void, body: impl FnOnce(&mut Instance) -> Answer) -> c_int {
    // SAFETY: see above.
    let Some(instance) = (unsafe { handle.cast::<Instance>().as_mut() }) else {
        return Status::Error as c_int;
    };
    let done = catch_unwind(AssertUnwindSafe(|| {
        let outcome = match instance.fmu.phase() {
            terraglue_fmi::export::Phase::Dead => Err(Wrong {
                status: Status::Fatal,
                text: "not called: the FMU failed for good before".into(),
            }),
            _ => body(instance),
        };
        instance.say(&outcome);
        outcome.map_or_else(|wrong| wrong.status as c_int, |()| Status::Ok as c_int)
    }));
    done.unwrap_or_else(|panic| {
        instance.fmu.kill();
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
        instance.log.line(Status::Fatal, &format!("a defect of the FMU: {text}"));
        Status::Fatal as c_int
    })
}

/// Makes an instance; null and a line in the log where that fails.
///
/// # Safety
/// The texts are null or end in a zero.
pub unsafe fn create(
    token: *const c_char,
    resources: Result<PathBuf, String>,
    refused: Option<&str>,
    log: Log,
) -> *mut c_void {
    // SAFETY: see above.
    let token = unsafe { text(token) };
    let name = log.name.to_string_lossy().into_owned();
    let made = catch_unwind(AssertUnwindSafe(|| {
        if let Some(why) = refused {
            return Err(why.to_owned());
        }
        let token = token.ok_or("no token was given")?;
        ExportedInstance::new(terraglue_fmu::export::open, &name, &resources?, Some(&token))
    }));
    match made.unwrap_or_else(|_| Err("a defect of the FMU while it was made".into())) {
        Ok(fmu) => {
            let instance = Instance { fmu, log, texts: Vec::new(), bytes: Vec::new(), serialised: None };
            instance.say(&Ok(()));
            Box::into_raw(Box::new(instance)).cast()
        }
        Err(why) => {
            log.line(Status::Error, &why);
            std::ptr::null_mut()
        }
    }
}

/// Frees an instance.
///
/// # Safety
/// As for [`call`]; the handle is not used again.
pub unsafe fn free(handle: *mut c_void) {
    if !handle.is_null() {
        // SAFETY: see above.
        let instance = unsafe { Box::from_raw(handle.cast::<Instance>()) };
        drop(catch_unwind(AssertUnwindSafe(|| drop(instance))));
    }
}

/// A text of the master.
///
/// # Safety
/// Null, or ends in a zero.
pub unsafe fn text(pointer: *const c_char) -> Option<String> {
    // SAFETY: see above.
    (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned())
}

/// An array of the master.
///
/// # Safety
/// Null, or points at `n` values that live as long as the call.
pub unsafe fn slice<'a, T>(pointer: *const T, n: usize) -> Answer<&'a [T]> {
    match (pointer.is_null(), n) {
        (_, 0) => Ok(&[]),
        (true, _) => terraglue_fmi::export::wrong("a null pointer was given for an array"),
        // SAFETY: see above.
        (false, n) => Ok(unsafe { std::slice::from_raw_parts(pointer, n) }),
    }
}

/// Room of the master.
///
/// # Safety
/// Null, or points at room for `n` values that nothing else reads or writes during the call.
pub unsafe fn room<'a, T>(pointer: *mut T, n: usize) -> Answer<&'a mut [T]> {
    match (pointer.is_null(), n) {
        (_, 0) => Ok(&mut []),
        (true, _) => terraglue_fmi::export::wrong("a null pointer was given for an array"),
        // SAFETY: see above.
        (false, n) => Ok(unsafe { std::slice::from_raw_parts_mut(pointer, n) }),
    }
}

/// One value of the master to write, where it gave a place for it.
///
/// # Safety
/// Null, or points at room for a value.
pub unsafe fn put<T>(pointer: *mut T, value: T) {
    if !pointer.is_null() {
        // SAFETY: see above.
        unsafe { pointer.write(value) };
    }
}

/// Folder of the resources from a path or a `file:` address.
pub fn resources(given: Option<String>) -> Result<PathBuf, String> {
    let given = given.ok_or("no folder of resources was given")?;
    let path = match given.strip_prefix("file:") {
        None => given,
        Some(rest) => decoded(rest.strip_prefix("//localhost").or(rest.strip_prefix("//")).unwrap_or(rest))?,
    };
    let path = PathBuf::from(path);
    if path.is_dir() {
        Ok(path)
    } else {
        Err(format!("the folder of resources `{}` is not there", path.display()))
    }
}

/// Replaces `%20` and its like.
fn decoded(text: &str) -> Result<String, String> {
    let mut out = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let code = (*first == b'%')
            .then(|| after.get(..2).and_then(|h| std::str::from_utf8(h).ok()))
            .flatten()
            .and_then(|h| u8::from_str_radix(h, 16).ok());
        match code {
            Some(byte) => (out.push(byte), rest = &after[2..]).0,
            None => (out.push(*first), rest = after).0,
        }
    }
    String::from_utf8(out).map_err(|_| format!("the address `{text}` is not UTF-8"))
}

/// `GetFMUState`.
///
/// # Safety
/// As for [`call`]; `state` points at a handle, null for a new state.
pub unsafe fn save(handle: *mut c_void, state: *mut *mut c_void) -> c_int {
    // SAFETY: see above.
    unsafe {
        call(handle, |i| {
            let place = &mut room(state, 1)?[0];
            let over = (!place.is_null()).then_some(Handle(*place as usize));
            i.serialised = None;
            *place = i.fmu.save(over)?.0 as *mut c_void;
            Ok(())
        })
    }
}

/// `FreeFMUState`.
///
/// # Safety
/// As for [`save`].
pub unsafe fn release(handle: *mut c_void, state: *mut *mut c_void) -> c_int {
    // SAFETY: see above.
    unsafe {
        call(handle, |i| {
            if state.is_null() || (*state).is_null() {
                return Ok(());
            }
            i.serialised = None;
            i.fmu.release(Handle(*state as usize))?;
            *state = std::ptr::null_mut();
            Ok(())
        })
    }
}

fn bytes_of(i: &mut Instance, state: *mut c_void) -> Answer<&[u8]> {
    let wanted = state as usize;
    if i.serialised.as_ref().is_none_or(|(of, _)| *of != wanted) {
        i.serialised = Some((wanted, i.fmu.serialize(Handle(wanted))?));
    }
    Ok(i.serialised.as_ref().map_or(&[], |(_, bytes)| bytes))
}

/// `SerializedFMUStateSize`.
///
/// # Safety
/// As for [`call`]; `size` points at room for a number.
pub unsafe fn serialised_size(handle: *mut c_void, state: *mut c_void, size: *mut usize) -> c_int {
    // SAFETY: see above.
    unsafe {
        call(handle, |i| {
            put(size, bytes_of(i, state)?.len());
            Ok(())
        })
    }
}

/// `SerializeFMUState`.
///
/// # Safety
/// As for [`call`]; `out` has room for `size` bytes.
pub unsafe fn serialise(handle: *mut c_void, state: *mut c_void, out: *mut u8, size: usize) -> c_int {
    // SAFETY: see above.
    unsafe {
        call(handle, |i| {
            let bytes = bytes_of(i, state)?;
            let out = room(out, size)?;
            let needed = bytes.len();
            let Some(out) = out.get_mut(..needed) else {
                return terraglue_fmi::export::wrong(format!("the state has {needed} bytes, not {size}"));
            };
            out.copy_from_slice(bytes);
            Ok(())
        })
    }
}

/// `DeserializeFMUState`.
///
/// # Safety
/// As for [`call`]; `bytes` points at `size` bytes, `state` at room for a handle.
pub unsafe fn deserialise(
    handle: *mut c_void,
    bytes: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> c_int {
    // SAFETY: see above.
    unsafe {
        call(handle, |i| {
            let place = &mut room(state, 1)?[0];
            *place = i.fmu.deserialize(slice(bytes, size)?)?.0 as *mut c_void;
            Ok(())
        })
    }
}
