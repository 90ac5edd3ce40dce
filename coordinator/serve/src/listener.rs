//! An address that is listened to, with the thread that serves it.

use std::net::{SocketAddr, TcpListener};
use terraglue_diagnostics::{Error, Result};
use tokio::runtime::{Builder, Runtime};

/// Listens to an address; port 0: any that is free. The listener, where it really listens, and a runtime of one thread of this name.
///
/// # Errors
/// The address is taken or not of this machine, or there is no thread.
pub fn listen(address: SocketAddr, thread: &str) -> Result<(TcpListener, SocketAddr, Runtime)> {
    let failed = |source| Error::File { path: address.to_string(), source };
    let listener = TcpListener::bind(address).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    let own = listener.local_addr().map_err(failed)?;
    let runtime = Builder::new_multi_thread().worker_threads(1).thread_name(thread).enable_all().build();
    Ok((listener, own, runtime.map_err(failed)?))
}
