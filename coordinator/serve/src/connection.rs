//! One client: what it has subscribed to, what it may write, and the messages to and from it.

use crate::command::{Command, of_service};
use crate::hub::{Hub, Out};
use crate::protocol::{self, ClientText, Welcome};
use crate::topics::{MESH, RUN, TILES};
use axum::extract::ws::{Message, WebSocket};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;
use std::time::Duration;
use terraglue_recording::Stored;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::MissedTickBehavior;

/// Largest message of a client, bytes.
pub const LARGEST: usize = 1 << 20;
/// A beat that nobody needs.
const NEVER: Duration = Duration::from_secs(86_400);

/// Whether the connection goes on.
type Goes = Result<(), axum::Error>;

/// Whether each message of a topic is complete in itself: a later one replaces it.
fn only_newest_counts(topic: &str, schema: &str) -> bool {
    let own = topic == "/tf" || topic.starts_with("/joints/") || topic.starts_with("/contact_forces");
    own || ["foxglove.PointCloud", "foxglove.LaserScan"].contains(&schema)
}

/// A reason with the name of the variable in it.
fn named(name: &str, reason: String) -> String {
    if reason.contains(name) { reason } else { format!("{name}: {reason}") }
}

/// A client.
pub struct Connection {
    hub: Arc<Hub>,
    number: u64,
    /// Whether it may write at all.
    trusted: bool,
    /// Whether it wants no more than the newest of poses, forces and clouds.
    thins: bool,
    /// Numbers of the subscriptions by channel.
    subscriptions: HashMap<u16, u32>,
    /// Channels of which only the newest message counts, with that message until the next beat.
    held: BTreeMap<u16, Option<Arc<Stored>>>,
    /// Message sent last on each channel whose last message stays valid.
    sent: HashMap<u16, Arc<Stored>>,
    followed: BTreeSet<String>,
    services: Vec<String>,
}

impl Connection {
    /// Talks with a client until it goes.
    ///
    /// `rate_hz`: of poses, forces and clouds it gets only the newest, so often.
    pub async fn serve(
        hub: Arc<Hub>,
        mut socket: WebSocket,
        welcome: Welcome,
        (trusted, rate_hz): (bool, Option<f64>),
    ) {
        let (number, mut ring) = hub.join();
        let beat = rate_hz.map_or(NEVER, |hz| Duration::from_secs_f64(1.0 / hz.clamp(0.1, 1e3)));
        let mut beat = tokio::time::interval(beat);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut own = Self {
            hub: Arc::clone(&hub),
            number,
            trusted,
            subscriptions: HashMap::new(),
            held: BTreeMap::new(),
            sent: HashMap::new(),
            thins: rate_hz.is_some(),
            followed: BTreeSet::new(),
            services: Vec::new(),
        };
        let mut goes = own.greet(&mut socket, &welcome).await;
        while goes.is_ok() {
            goes = tokio::select! {
                from = socket.recv() => match from {
                    None | Some(Err(_)) | Some(Ok(Message::Close(_))) => break,
                    Some(Ok(Message::Text(text))) => own.text(&mut socket, &text).await,
                    Some(Ok(Message::Binary(bytes))) => own.binary(&mut socket, &bytes).await,
                    Some(Ok(_)) => Ok(()),
                },
                out = ring.recv() => match out {
                    Ok(out) => own.pass(&mut socket, out).await,
                    // it was too slow: what stands is sent again, the rest is lost to it
                    Err(RecvError::Lagged(_)) => own.behind(&mut socket).await,
                    Err(RecvError::Closed) => break,
                },
                _ = beat.tick() => own.send_held(&mut socket).await,
            };
        }
        hub.leave(number);
    }

    async fn say(&self, socket: &mut WebSocket, message: &Value) -> Goes {
        socket.send(Message::Text(message.to_string().into())).await
    }

    async fn greet(&mut self, socket: &mut WebSocket, welcome: &Welcome) -> Goes {
        self.say(socket, &protocol::server_info(welcome)).await?;
        self.say(socket, &protocol::advertise(&self.hub.topics())).await?;
        self.offer(socket).await
    }

    async fn offer(&mut self, socket: &mut WebSocket) -> Goes {
        if !self.services.is_empty() {
            self.say(socket, &protocol::unadvertise_services(self.services.len())).await?;
        }
        self.services = self.hub.services();
        self.say(socket, &protocol::advertise_services(&self.services)).await
    }

    /// Hands on what comes for all.
    async fn pass(&mut self, socket: &mut WebSocket, out: Out) -> Goes {
        match out {
            Out::Message(message) => self.message(socket, &message).await,
            Out::Values(values) => {
                let own: Vec<_> =
                    values.iter().filter(|(name, _)| self.followed.contains(name)).cloned().collect();
                if own.is_empty() {
                    return Ok(());
                }
                self.say(socket, &protocol::parameter_values(&own, None)).await
            }
            Out::Topics(topics) => self.say(socket, &protocol::advertise(&topics)).await,
            Out::Services => self.offer(socket).await,
            Out::Time(time_ns) => socket.send(Message::Binary(protocol::time(time_ns).into())).await,
            Out::Again => self.again(socket).await,
        }
    }

    /// A message of a channel, where it is subscribed to.
    async fn message(&mut self, socket: &mut WebSocket, message: &Arc<Stored>) -> Goes {
        if let Some(held) = self.held.get_mut(&message.channel) {
            *held = Some(Arc::clone(message));
            return Ok(());
        }
        self.send(socket, message).await
    }

    /// The newest of what is held back.
    async fn send_held(&mut self, socket: &mut WebSocket) -> Goes {
        let newest: Vec<Arc<Stored>> = self.held.values_mut().filter_map(Option::take).collect();
        for message in newest {
            self.send(socket, &message).await?;
        }
        Ok(())
    }

    async fn send(&mut self, socket: &mut WebSocket, message: &Arc<Stored>) -> Goes {
        let Some(id) = self.subscriptions.get(&message.channel).copied() else { return Ok(()) };
        let bytes = match message.channel {
            RUN => protocol::message(id, &self.run_state(message)),
            _ => protocol::message(id, message),
        };
        self.sent.insert(message.channel, Arc::clone(message));
        socket.send(Message::Binary(bytes.into())).await
    }

    /// The state of the run with the permission of this client to write.
    fn run_state(&self, message: &Stored) -> Stored {
        let mut state: Value = serde_json::from_slice(&message.data).unwrap_or_default();
        state["may_write"] = (self.trusted && self.hub.may_write(self.number, false)).into();
        Stored { data: state.to_string().into_bytes(), ..message.clone() }
    }

    /// Reports that messages were omitted, and sends the last ones again.
    async fn behind(&mut self, socket: &mut WebSocket) -> Goes {
        let mut told =
            protocol::status(0, "messages were left out: this client reads more slowly than the run goes");
        told["id"] = "behind".into();
        self.say(socket, &told).await?;
        self.again(socket).await
    }

    /// Sends the last message of every subscribed channel, unless it was sent already.
    async fn again(&mut self, socket: &mut WebSocket) -> Goes {
        let mut channels: Vec<u16> = self.subscriptions.keys().copied().collect();
        channels.sort_unstable();
        for channel in channels {
            self.standing(socket, channel).await?;
        }
        Ok(())
    }

    /// The last message of a channel.
    async fn standing(&mut self, socket: &mut WebSocket, channel: u16) -> Goes {
        if channel == TILES || channel == MESH {
            let hub = Arc::clone(&self.hub);
            // packing a large ground takes a while
            let pack = move || if channel == MESH { hub.whole_mesh() } else { hub.whole_ground() };
            let whole = tokio::task::spawn_blocking(pack).await.ok().flatten();
            return match whole {
                Some(whole) => self.send(socket, &Arc::new(whole)).await,
                None => Ok(()),
            };
        }
        let is_new = |m: &Arc<Stored>| {
            channel == RUN || self.sent.get(&channel).is_none_or(|sent| !Arc::ptr_eq(sent, m))
        };
        match self.hub.latest(channel).filter(is_new) {
            Some(message) => self.send(socket, &message).await,
            None => Ok(()),
        }
    }

    async fn text(&mut self, socket: &mut WebSocket, text: &str) -> Goes {
        let read = match serde_json::from_str::<ClientText>(text) {
            Ok(read) => read,
            Err(e) => {
                return self
                    .say(socket, &protocol::status(1, &format!("a message was not understood: {e}")))
                    .await;
            }
        };
        match read {
            ClientText::Subscribe { subscriptions } => {
                for s in subscriptions {
                    self.subscribe(socket, s.id, s.channel_id).await?;
                }
                Ok(())
            }
            ClientText::Unsubscribe { subscription_ids } => {
                self.subscriptions.retain(|_, id| !subscription_ids.contains(id));
                self.held.retain(|channel, _| self.subscriptions.contains_key(channel));
                self.sent.retain(|channel, _| self.subscriptions.contains_key(channel));
                self.hub.draw_mesh(self.number, self.subscriptions.contains_key(&MESH));
                Ok(())
            }
            ClientText::GetParameters { parameter_names, id } => {
                let values = self.values(parameter_names).await;
                self.say(socket, &protocol::parameter_values(&values, id.as_deref())).await
            }
            ClientText::SetParameters { parameters, id } => self.set(socket, parameters, id).await,
            ClientText::SubscribeParameterUpdates { parameter_names } => {
                self.followed.extend(parameter_names);
                self.hub.follow(self.number, self.followed.iter().cloned().collect());
                Ok(())
            }
            ClientText::UnsubscribeParameterUpdates { parameter_names } => {
                match parameter_names.is_empty() {
                    true => self.followed.clear(),
                    false => self.followed.retain(|name| !parameter_names.contains(name)),
                }
                self.hub.follow(self.number, self.followed.iter().cloned().collect());
                Ok(())
            }
            ClientText::FetchAsset { uri, request_id } => {
                let answer = protocol::no_asset(
                    request_id,
                    &format!("there is no `{uri}`: shapes come whole in /scene"),
                );
                socket.send(Message::Binary(answer.into())).await
            }
            ClientText::Advertise {} => {
                self.say(socket, &protocol::status(1, "this server takes no messages of clients")).await
            }
            ClientText::Unadvertise {}
            | ClientText::SubscribeConnectionGraph {}
            | ClientText::UnsubscribeConnectionGraph {} => Ok(()),
        }
    }

    async fn subscribe(&mut self, socket: &mut WebSocket, id: u32, channel: u64) -> Goes {
        let topics = self.hub.topics();
        let Some(topic) = topics.iter().find(|t| u64::from(t.channel) == channel) else {
            return self.say(socket, &protocol::status(1, &format!("there is no channel {channel}"))).await;
        };
        let channel = topic.channel;
        if self.thins && only_newest_counts(&topic.topic, &topic.schema) {
            self.held.insert(channel, None);
        }
        self.sent.remove(&channel);
        self.subscriptions.insert(channel, id);
        if channel == MESH {
            self.hub.draw_mesh(self.number, true);
        }
        self.standing(socket, channel).await
    }

    /// Values by name; all where no name is given.
    async fn values(&self, names: Vec<String>) -> Vec<(String, Value)> {
        let answer = self.hub.call(Command::Get(names)).await.unwrap_or_default();
        let Value::Object(values) = answer else { return Vec::new() };
        values.into_iter().collect()
    }

    async fn set(
        &mut self,
        socket: &mut WebSocket,
        parameters: Vec<protocol::Parameter>,
        id: Option<String>,
    ) -> Goes {
        let mut names = Vec::new();
        for parameter in parameters {
            let name = parameter.name.clone();
            let done = match self.allowed() {
                Ok(()) => self.hub.call(Command::Set(parameter.name, parameter.value)).await.map(drop),
                Err(reason) => Err(reason),
            };
            if let Err(reason) = done {
                self.say(socket, &protocol::status(1, &named(&name, reason))).await?;
            }
            names.push(name);
        }
        // the true values, taken or not
        let values = self.values(names).await;
        self.say(socket, &protocol::parameter_values(&values, id.as_deref())).await
    }

    /// Whether this client may change anything.
    fn allowed(&self) -> Result<(), String> {
        if !self.trusted {
            return Err(
                "only clients with the token may change anything; the address that was printed has it".into(),
            );
        }
        match self.hub.may_write(self.number, true) {
            true => Ok(()),
            false => Err("another client is at the controls; `--writers many` lets several write".into()),
        }
    }

    async fn binary(&mut self, socket: &mut WebSocket, bytes: &[u8]) -> Goes {
        let call = match protocol::call(bytes) {
            Ok(call) => call,
            Err(reason) => return self.say(socket, &protocol::status(1, &reason)).await,
        };
        let (service, number) = (call.service, call.call);
        let answer = match self.command(&call) {
            Ok(command) => self.hub.call(command).await,
            Err(reason) => Err(reason),
        };
        match answer {
            Ok(body) => socket.send(Message::Binary(protocol::response(service, number, &body).into())).await,
            Err(reason) => self.say(socket, &protocol::call_failure(service, number, &reason)).await,
        }
    }

    fn command(&self, call: &protocol::Call) -> Result<Command, String> {
        let place = (call.service as usize).checked_sub(1);
        let name = place
            .and_then(|k| self.services.get(k))
            .ok_or_else(|| format!("there is no service {}", call.service))?;
        if !["json", ""].contains(&call.encoding) {
            return Err(format!("{name}: requests are JSON, not `{}`", call.encoding));
        }
        let command = of_service(name, call.request)?;
        if !matches!(command, Command::CastRay(..) | Command::Changes) {
            self.allowed()?;
        }
        Ok(command)
    }
}
