//! The server: the page and its files, the socket, and questions about the past, on one port. It runs on threads of its own.

use crate::access::Access;
use crate::beside::Beside;
use crate::connection::{Connection, LARGEST};
use crate::hub::Hub;
use crate::listener::listen;
use crate::past;
use crate::protocol::{self, Welcome};
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{ConnectInfo, Path, Query, Request, State, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Extension, Router};
use serde::Deserialize;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use terraglue_diagnostics::Result;
use terraglue_page::ASSETS;

/// How often the ground is looked at for tiles that have changed.
const GROUND_EVERY: Duration = Duration::from_millis(100);
/// How many times that lies between triangles of it, for other viewers.
const MESH_EVERY: u32 = 5;
/// Most points of a variable over time.
const MOST_POINTS: usize = 200_000;

/// State shared by all routes.
#[derive(Clone)]
struct Shared {
    hub: Arc<Hub>,
    access: Arc<Access>,
    welcome: Welcome,
    beside: Option<Beside>,
}

/// Whether a request may change anything.
#[derive(Clone, Copy)]
struct Trusted(bool);

/// A server; it ends when this is dropped.
pub struct Server {
    address: SocketAddr,
    // its threads end with it
    _runtime: tokio::runtime::Runtime,
}

impl Server {
    /// Serves a hub, and a recording beside it, at this address from now on; port 0: any that is free.
    ///
    /// # Errors
    /// The address is taken or not of this machine.
    pub fn start(
        (hub, beside): (Arc<Hub>, Option<Beside>),
        address: SocketAddr,
        access: Access,
        mut welcome: Welcome,
    ) -> Result<Self> {
        let (listener, own, runtime) = listen(address, "serve")?;
        welcome.session = crate::access::token();
        let shared = Shared { hub, access: Arc::new(access), welcome, beside };
        let ground = Arc::clone(&shared.hub);
        runtime.spawn(async move {
            let mut every = tokio::time::interval(GROUND_EVERY);
            let mut times = 0_u32;
            loop {
                every.tick().await;
                times = times.wrapping_add(1);
                let (hub, meshes) = (Arc::clone(&ground), times.is_multiple_of(MESH_EVERY));
                let send = move || {
                    hub.send_ground();
                    if meshes {
                        hub.send_mesh();
                    }
                };
                if tokio::task::spawn_blocking(send).await.is_err() {
                    log::warn!("a tile of ground could not be sent");
                }
            }
        });
        runtime.spawn(async move {
            let served = match tokio::net::TcpListener::from_std(listener) {
                Ok(listener) => {
                    let routes = routes(shared).into_make_service_with_connect_info::<SocketAddr>();
                    axum::serve(listener, routes).await
                }
                Err(e) => Err(e),
            };
            if let Err(e) = served {
                log::error!("the server has ended: {e}");
            }
        });
        Ok(Self { address: own, _runtime: runtime })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

fn routes(shared: Shared) -> Router {
    let mut routes = Router::new()
        .route("/", get(root))
        .route("/ws", get(socket))
        .merge(past_routes())
        .route("/{file}", get(asset));
    if let Some(beside) = &shared.beside {
        let about = beside.about().to_string();
        let own = Shared { hub: Arc::clone(&beside.hub), ..shared.clone() };
        let past = past_routes()
            .route("/about", get(async move || ([(header::CONTENT_TYPE, "application/json")], about)));
        routes = routes.nest("/beside", past.with_state(own));
    }
    routes.layer(from_fn_with_state(shared.clone(), guard)).with_state(shared)
}

/// Questions about what is recorded.
fn past_routes() -> Router<Shared> {
    Router::new().route("/at", get(at)).route("/history", get(history)).route("/messages", get(messages))
}

/// Lets nobody in whose page is from elsewhere.
async fn guard(
    State(shared): State<Shared>,
    ConnectInfo(from): ConnectInfo<SocketAddr>,
    Query(asked): Query<Token>,
    mut request: Request,
    next: Next,
) -> Response {
    match shared.access.check(request.headers(), from, asked.token.as_deref()) {
        Ok(trusted) => {
            request.extensions_mut().insert(Trusted(trusted));
            next.run(request).await
        }
        Err(reason) => (StatusCode::FORBIDDEN, reason).into_response(),
    }
}

#[derive(Deserialize)]
struct Token {
    token: Option<String>,
}

/// Options of a client for the socket.
#[derive(Deserialize)]
struct Wishes {
    /// Of poses, forces and clouds only the newest, so often.
    rate_hz: Option<f64>,
}

type Upgrade = std::result::Result<WebSocketUpgrade, WebSocketUpgradeRejection>;

/// The page, or the socket where a client asks for one: others connect to the root.
async fn root(
    state: State<Shared>,
    trusted: Extension<Trusted>,
    wishes: Query<Wishes>,
    headers: HeaderMap,
    upgrade: Upgrade,
) -> Response {
    match headers.contains_key(header::UPGRADE) {
        true => socket(state, trusted, wishes, upgrade).await,
        false => file("index.html"),
    }
}

async fn socket(
    State(shared): State<Shared>,
    Extension(Trusted(trusted)): Extension<Trusted>,
    Query(wishes): Query<Wishes>,
    upgrade: Upgrade,
) -> Response {
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(reason) => return reason.into_response(),
    };
    upgrade.protocols(protocol::SUBPROTOCOLS).max_message_size(LARGEST).max_frame_size(LARGEST).on_upgrade(
        move |socket| {
            let rate_hz = wishes.rate_hz.filter(|hz| *hz > 0.0);
            Connection::serve(shared.hub, socket, shared.welcome, (trusted, rate_hz))
        },
    )
}

async fn asset(Path(name): Path<String>) -> Response {
    file(&name)
}

fn file(name: &str) -> Response {
    match ASSETS.iter().find(|asset| asset.path == name) {
        Some(asset) => {
            let headers = [(header::CONTENT_TYPE, asset.media_type), (header::CACHE_CONTROL, "no-cache")];
            (headers, asset.bytes).into_response()
        }
        None => (StatusCode::NOT_FOUND, format!("there is no `{name}`")).into_response(),
    }
}

#[derive(Deserialize)]
struct At {
    t: f64,
    topics: String,
}

/// Answers by work that takes a while, on a thread for it.
async fn looked_up<R: Send + 'static>(
    hub: Arc<Hub>,
    look: impl FnOnce(&Hub) -> Result<R> + Send + 'static,
    answer: impl FnOnce(R) -> Response,
) -> Response {
    let broken = |reason: String| (StatusCode::INTERNAL_SERVER_ERROR, reason).into_response();
    match tokio::task::spawn_blocking(move || look(&hub)).await {
        Ok(Ok(found)) => answer(found),
        Ok(Err(e)) => broken(e.to_string()),
        Err(_) => broken("the question could not be answered".into()),
    }
}

fn bytes(body: Vec<u8>) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream")], body).into_response()
}

async fn at(State(shared): State<Shared>, Query(asked): Query<At>) -> Response {
    if !asked.t.is_finite() {
        return (StatusCode::BAD_REQUEST, "`t` is to be a time in s").into_response();
    }
    let look = move |hub: &Hub| past::at(hub, &asked.topics.split(',').collect::<Vec<_>>(), asked.t);
    looked_up(shared.hub, look, bytes).await
}

#[derive(Deserialize)]
struct History {
    names: String,
    points: Option<usize>,
}

async fn history(State(shared): State<Shared>, Query(asked): Query<History>) -> Response {
    let points = asked.points.unwrap_or(4000).clamp(2, MOST_POINTS);
    let look = move |hub: &Hub| past::history(hub, &asked.names.split(',').collect::<Vec<_>>(), points);
    let answer = |found: serde_json::Value| {
        ([(header::CONTENT_TYPE, "application/json")], found.to_string()).into_response()
    };
    looked_up(shared.hub, look, answer).await
}

#[derive(Deserialize)]
struct Messages {
    topic: String,
}

async fn messages(State(shared): State<Shared>, Query(asked): Query<Messages>) -> Response {
    looked_up(shared.hub, move |hub: &Hub| past::messages(hub, &asked.topic), bytes).await
}
