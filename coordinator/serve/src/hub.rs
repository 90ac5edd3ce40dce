//! Where a run and its clients meet: topics, the last message of each, the recording, and a ring of messages that each client reads at
//! its own pace. A client that is slower than the run loses messages; the run never waits.

use crate::command::Request;
use crate::ground::{self, Ground};
use crate::tail::Tail;
use crate::topics::{CHANGED, CHANNELS, OWN_TOPICS, RUN, TILES};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, mpsc};
use terraglue_diagnostics::Result;
use terraglue_recording::{ChunkFile, Stored, TopicInfo};
use tokio::sync::{broadcast, oneshot};

/// Messages that a client may lag behind.
const RING: usize = 1024;

/// Something for clients.
#[derive(Clone)]
pub enum Out {
    /// A message of a topic, for those that have subscribed.
    Message(Arc<Stored>),
    /// Values of variables that have changed, by full name.
    Values(Arc<Vec<(String, Value)>>),
    /// New topics.
    Topics(Arc<Vec<TopicInfo>>),
    /// New services: names by number.
    Services,
    /// Simulated time, ns.
    Time(u64),
    /// The recording is another one from here on: what was sent last is sent again.
    Again,
}

/// The meeting place.
pub struct Hub {
    topics: RwLock<Vec<TopicInfo>>,
    services: RwLock<Vec<String>>,
    latest: Mutex<HashMap<u16, Arc<Stored>>>,
    tail: Mutex<Tail>,
    file: RwLock<Option<ChunkFile>>,
    ground: Mutex<Option<Ground>>,
    ring: broadcast::Sender<Out>,
    requests: mpsc::Sender<Request>,
    /// Variables that clients follow, by the number of the client.
    followed: Mutex<BTreeMap<u64, Vec<String>>>,
    /// Who may write, where only one may.
    writer: Mutex<Option<u64>>,
    many_write: bool,
    /// Clients that draw the ground as triangles.
    mesh_clients: Mutex<BTreeSet<u64>>,
    clients: AtomicU64,
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

fn read<T>(of: &RwLock<T>) -> RwLockReadGuard<'_, T> {
    of.read().unwrap_or_else(PoisonError::into_inner)
}

fn write<T>(of: &RwLock<T>) -> RwLockWriteGuard<'_, T> {
    of.write().unwrap_or_else(PoisonError::into_inner)
}

impl Hub {
    /// A hub whose requests come out of the receiver; `many_write`: not only one client may write.
    pub fn new(many_write: bool) -> (Arc<Self>, mpsc::Receiver<Request>) {
        let (requests, todo) = mpsc::channel();
        let hub = Self {
            topics: RwLock::new(OWN_TOPICS.iter().map(crate::topics::info).collect()),
            services: RwLock::default(),
            latest: Mutex::default(),
            tail: Mutex::default(),
            file: RwLock::default(),
            ground: Mutex::default(),
            ring: broadcast::Sender::new(RING),
            requests,
            followed: Mutex::default(),
            writer: Mutex::default(),
            many_write,
            mesh_clients: Mutex::default(),
            clients: AtomicU64::new(1),
        };
        (Arc::new(hub), todo)
    }

    /// The number of a new client and what comes for all from now on.
    pub fn join(&self) -> (u64, broadcast::Receiver<Out>) {
        (self.clients.fetch_add(1, Ordering::Relaxed), self.ring.subscribe())
    }

    /// A client is gone.
    pub fn leave(&self, client: u64) {
        locked(&self.followed).remove(&client);
        locked(&self.mesh_clients).remove(&client);
        let mut writer = locked(&self.writer);
        if *writer == Some(client) {
            *writer = None;
            drop(writer);
            self.send(Out::Again);
        }
    }

    /// Whether a client may write; the first that asks with `takes` may from then on.
    pub fn may_write(&self, client: u64, takes: bool) -> bool {
        let mut writer = locked(&self.writer);
        if takes && writer.is_none() {
            *writer = Some(client);
        }
        self.many_write || writer.is_none_or(|own| own == client)
    }

    /// Asks the run and waits for the answer.
    ///
    /// # Errors
    /// Why it was refused, in words.
    pub async fn call(&self, command: crate::command::Command) -> std::result::Result<Value, String> {
        let (reply, answer) = oneshot::channel();
        // nobody is there any more at the end, and then nobody answers
        drop(self.requests.send(Request { command, reply }));
        answer.await.unwrap_or_else(|_| Err("the run has ended".into()))
    }

    /// Sends something to all.
    pub fn send(&self, out: Out) {
        // an error means that nobody listens
        drop(self.ring.send(out));
    }

    /// A topic of the recording; a known one is not announced again.
    pub fn announce(&self, topic: TopicInfo) {
        let mut topics = write(&self.topics);
        if topics.iter().any(|known| known.channel == topic.channel && known.topic == topic.topic) {
            return;
        }
        topics.retain(|known| known.channel != topic.channel);
        topics.push(topic.clone());
        drop(topics);
        self.send(Out::Topics(Arc::new(vec![topic])));
    }

    /// All topics so far.
    pub fn topics(&self) -> Vec<TopicInfo> {
        read(&self.topics).clone()
    }

    /// Channels of the topics for which `wanted` holds.
    pub fn channels(&self, wanted: impl Fn(&str) -> bool) -> Vec<u16> {
        read(&self.topics).iter().filter(|t| wanted(&t.topic)).map(|t| t.channel).collect()
    }

    /// Names of the services by number.
    pub fn services(&self) -> Vec<String> {
        read(&self.services).clone()
    }

    /// Offers other services.
    pub fn offer(&self, services: Vec<String>) {
        *write(&self.services) = services;
        self.send(Out::Services);
    }

    /// Lets `act` look at or change what is not in the file.
    pub fn with_tail<R>(&self, act: impl FnOnce(&mut Tail) -> R) -> R {
        act(&mut locked(&self.tail))
    }

    /// Keeps the message as the last of its channel.
    pub fn remember(&self, message: &Arc<Stored>) {
        locked(&self.latest).insert(message.channel, Arc::clone(message));
    }

    /// The last message of a channel.
    pub fn latest(&self, channel: u16) -> Option<Arc<Stored>> {
        locked(&self.latest).get(&channel).cloned()
    }

    /// Sends JSON on a topic of our own, where it stays for those that come later.
    pub fn publish(&self, channel: u16, time_ns: u64, value: &Value) {
        let data = value.to_string().into_bytes();
        let message = Arc::new(Stored { channel, sequence: 0, time_ns, data });
        self.remember(&message);
        self.send(Out::Message(message));
    }

    /// The recording is in this folder from now on; what was there before is forgotten.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn open(&self, folder: &Path, is_growing: bool) -> Result {
        let file = ChunkFile::open(folder, is_growing)?;
        *write(&self.file) = Some(file);
        self.with_tail(|tail| *tail = Tail::default());
        let own = |channel: &u16| *channel >= RUN && *channel != TILES;
        locked(&self.latest).retain(|channel, _| own(channel));
        *locked(&self.ground) = None;
        Ok(())
    }

    /// Lets `act` look into the recording, with everything in it that is there by now.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn with_file<R>(&self, act: impl FnOnce(&ChunkFile) -> Result<R>) -> Result<Option<R>> {
        if let Some(file) = write(&self.file).as_mut() {
            file.refresh()?;
        }
        read(&self.file).as_ref().map(act).transpose()
    }

    /// Publishes the metadata of all topics for the page: information that messages cannot hold.
    pub fn publish_channels(&self) {
        let mut all = Map::new();
        for topic in read(&self.topics).iter().filter(|t| !t.metadata.is_empty()) {
            all.insert(topic.topic.clone(), json!(topic.metadata));
        }
        if let Some(ground) = locked(&self.ground).as_ref() {
            all.insert("/ground/tiles".into(), json!({ "header": ground.header().to_string() }));
        }
        self.publish(CHANNELS, 0, &Value::Object(all));
    }

    /// Looks whether there is ground by now, and sends the tiles that have changed since.
    pub fn send_ground(&self) {
        let mut held = locked(&self.ground);
        if held.is_none() {
            let [grid] = self.channels(|topic| topic == "/ground")[..] else { return };
            let Some(first) = self.latest(grid) else { return };
            *held = Ground::of(&first);
            let known = held.is_some();
            drop(held);
            if known {
                self.publish_channels();
            }
            return;
        }
        let Some(ground) = held.as_mut() else { return };
        let changed = ground.take(self.channels(ground::is_tile).into_iter().filter_map(|c| self.latest(c)));
        if let Some((time_ns, data)) = changed {
            drop(held);
            let message = Stored { channel: TILES, sequence: 0, time_ns, data };
            self.send(Out::Message(Arc::new(message)));
        }
    }

    /// Whether a client draws the ground as triangles from now on.
    pub fn draw_mesh(&self, client: u64, draws: bool) {
        let mut clients = locked(&self.mesh_clients);
        if draws {
            clients.insert(client)
        } else {
            clients.remove(&client)
        };
    }

    /// Sends triangles of the ground that has changed, where anybody draws them.
    pub fn send_mesh(&self) {
        if locked(&self.mesh_clients).is_empty() {
            return;
        }
        let stale = locked(&self.ground).as_mut().and_then(Ground::stale_mesh);
        if let Some(message) = stale {
            self.send(Out::Message(Arc::new(message)));
        }
    }

    /// All of the ground as triangles, for one that begins to draw it. What has changed while nobody drew counts no more.
    pub fn whole_mesh(&self) -> Option<Stored> {
        self.send_ground();
        let alone = locked(&self.mesh_clients).len() <= 1;
        let mut held = locked(&self.ground);
        let ground = held.as_mut()?;
        if alone {
            ground.forget_changes();
        }
        Some(ground.whole_mesh())
    }

    /// All of the ground as it is now.
    pub fn whole_ground(&self) -> Option<Stored> {
        locked(&self.ground).as_ref().map(Ground::whole)
    }

    /// All of the ground as it was when the last messages were these.
    pub fn ground_of<'a>(&self, tiles: impl Iterator<Item = &'a Stored>) -> Option<Stored> {
        let held = locked(&self.ground);
        let mut then = held.as_ref()?.clone();
        drop(held);
        then.begin_again();
        tiles.for_each(|tile| then.put(tile));
        Some(then.whole())
    }

    /// Variables that a client follows from now on.
    pub fn follow(&self, client: u64, names: Vec<String>) {
        locked(&self.followed).insert(client, names);
    }

    /// All variables that anybody follows.
    pub fn followed(&self) -> Vec<String> {
        let all = locked(&self.followed);
        let names: BTreeSet<&String> = all.values().flatten().collect();
        names.into_iter().cloned().collect()
    }

    /// The list of what was changed.
    pub fn publish_changed(&self, time_ns: u64, changed: &Value) {
        self.publish(CHANGED, time_ns, changed);
    }
}
