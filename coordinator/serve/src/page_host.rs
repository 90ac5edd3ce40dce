//! A page for one browser on this machine that makes something out of it: a server gives it the document, and takes what it posts,
//! one after another. Who does not know the address, with a number that nobody guesses in it, gets nothing.

use crate::access::token;
use crate::listener::listen;
use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::Deserialize;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use terraglue_diagnostics::Result;
use terraglue_page::ASSETS;

/// Posts that wait to be taken; the page waits with the next one.
const WAITING: usize = 2;
/// Largest post, bytes: a picture of 8192² with four bytes a pixel.
const LARGEST: usize = 256 << 20;

/// Something that the page made.
pub struct Posted {
    /// Its kind: the last part of the address that it was sent to.
    pub kind: String,
    /// Time that the page gives it, µs.
    pub time_us: u64,
    /// Whether it needs nothing that came before it.
    pub is_whole: bool,
    /// Its content.
    pub body: Bytes,
}

/// Attributes of something that a page posts.
#[derive(Deserialize)]
struct Label {
    #[serde(default)]
    t: u64,
    #[serde(default)]
    whole: u8,
}

#[derive(Clone)]
struct PageState {
    token: Arc<str>,
    document: Bytes,
    posted: SyncSender<Posted>,
}

/// The server; it ends when this is dropped.
pub struct PageHost {
    address: String,
    // its threads end with it
    _runtime: tokio::runtime::Runtime,
}

impl PageHost {
    /// Serves a document, and the modules of the page beside it, to who knows [`PageHost::address`]; what is posted comes out of the receiver.
    ///
    /// # Errors
    /// No port is free on this machine.
    pub fn start(document: String) -> Result<(Self, Receiver<Posted>)> {
        let at = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let (listener, own, runtime) = listen(at, "page")?;
        let (posted, taken) = sync_channel(WAITING);
        let token = token();
        let address = format!("http://{own}/{token}/");
        let shared = PageState { token: token.into(), document: document.into(), posted };
        runtime.spawn(async move {
            let served = match tokio::net::TcpListener::from_std(listener) {
                Ok(listener) => axum::serve(listener, routes(shared)).await,
                Err(e) => Err(e),
            };
            if let Err(e) = served {
                log::error!("the page is served no more: {e}");
            }
        });
        Ok((Self { address, _runtime: runtime }, taken))
    }

    /// Address of the document.
    pub fn address(&self) -> &str {
        &self.address
    }
}

fn routes(shared: PageState) -> Router {
    Router::new()
        .route("/{token}/", get(document))
        .route("/{token}/{name}", get(module))
        .route("/{token}/{name}", post(take))
        .layer(DefaultBodyLimit::max(LARGEST))
        .with_state(shared)
}

async fn document(State(shared): State<PageState>, Path(token): Path<String>) -> Response {
    match *token == *shared.token {
        true => ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], shared.document).into_response(),
        false => StatusCode::FORBIDDEN.into_response(),
    }
}

async fn module(State(shared): State<PageState>, Path((token, name)): Path<(String, String)>) -> Response {
    match ASSETS.iter().find(|asset| asset.path == name) {
        _ if *token != *shared.token => StatusCode::FORBIDDEN.into_response(),
        Some(asset) => ([(header::CONTENT_TYPE, asset.media_type)], asset.bytes).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

async fn take(
    State(shared): State<PageState>,
    Path((token, kind)): Path<(String, String)>,
    Query(label): Query<Label>,
    body: Bytes,
) -> StatusCode {
    if *token != *shared.token {
        return StatusCode::FORBIDDEN;
    }
    let posted = Posted { kind, time_us: label.t, is_whole: label.whole == 1, body };
    // whoever takes them may be busy: the page waits for the answer
    match tokio::task::spawn_blocking(move || shared.posted.send(posted)).await {
        Ok(Ok(())) => StatusCode::NO_CONTENT,
        _ => StatusCode::GONE,
    }
}
