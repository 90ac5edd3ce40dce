//! Where messages go: a file of chunks, at first in the thread of the run, then behind a bounded queue on a thread of its own, which
//! encodes chunks, compresses them and writes.
//!
//! One thread takes all messages in their order, so the bytes of a recording do not depend on it. A step costs a copy of its
//! messages; it waits while the queue is full, and at the end of a chunk while the chunk before is not on disk. An error
//! of the thread is returned by a later call.

use crate::topics::Topic;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, McapResult};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use terraglue_host::kept_file::KeptFile;

/// The encoder of the file.
pub(super) type Encoder = mcap::Writer<NoSeek<BufWriter<KeptFile>>>;

/// Messages that may wait.
const WAITING: usize = 1024;

/// Size of the part of the file that is safe whatever comes after, bytes, and its simulated time, s.
pub(super) type Kept = (u64, f64);

/// A job of the thread.
enum Job {
    Message(MessageHeader, Vec<u8>),
    /// Announces a topic and answers the number of its channel.
    Topic(Topic, SyncSender<u16>),
    /// Ends the chunk, hands everything up to this time to the operating system, and answers then.
    Flush(f64, SyncSender<()>),
    /// Answers when all before it is done.
    Answer(SyncSender<()>),
}

/// A file of chunks.
pub(super) struct Sink {
    path: PathBuf,
    place: EncoderPlace,
    progress: Arc<Mutex<Progress>>,
}

/// Where the encoder is.
enum EncoderPlace {
    Here(Box<Encoder>),
    Behind(Queue),
    /// Closed, or gone after an error.
    Gone,
}

struct Queue {
    jobs: SyncSender<Job>,
    /// Buffers of messages that are written.
    spent: Receiver<Vec<u8>>,
    thread: JoinHandle<Option<Box<Encoder>>>,
    /// Answers when the last flush is done.
    flushed: Option<Receiver<()>>,
}

/// Progress of the thread.
#[derive(Default)]
struct Progress {
    kept: Kept,
    failed: Option<McapError>,
}

impl Sink {
    /// Over an encoder that has written nothing that is kept.
    pub fn new(path: &Path, encoder: Encoder) -> Self {
        Self { path: path.to_owned(), place: EncoderPlace::Here(Box::new(encoder)), progress: Arc::default() }
    }

    /// The encoder before [`Sink::start`], for what another process has written; none later.
    pub fn encoder(&mut self) -> Option<&mut Encoder> {
        match &mut self.place {
            EncoderPlace::Here(encoder) => Some(encoder),
            _ => None,
        }
    }

    /// From now on messages are written by a thread of their own; where none can be made, as before.
    pub fn start(&mut self) {
        let EncoderPlace::Here(encoder) = std::mem::replace(&mut self.place, EncoderPlace::Gone) else {
            return;
        };
        let (jobs, todo) = sync_channel(WAITING);
        let (done, spent) = channel();
        let (path, progress) = (self.path.clone(), Arc::clone(&self.progress));
        // handed over once there is a thread: one that cannot be made drops what it was given
        let (give, given) = sync_channel(1);
        let work = move || {
            let encoder = given.recv().ok()?;
            write_all(encoder, &path, &progress, &todo, |buffer| drop(done.send(buffer)))
        };
        self.place = match std::thread::Builder::new().name("recording".into()).spawn(work) {
            Ok(thread) => {
                // it takes the encoder before it can end
                give.send(encoder).ok();
                EncoderPlace::Behind(Queue { jobs, spent, thread, flushed: None })
            }
            Err(e) => {
                log::warn!("{}: written by the thread of the run: {e}", self.path.display());
                EncoderPlace::Here(encoder)
            }
        };
    }

    /// Writes a message; what `message` holds afterwards does not matter.
    pub fn write(&mut self, header: &MessageHeader, message: &mut Vec<u8>) -> McapResult<()> {
        match &mut self.place {
            EncoderPlace::Here(encoder) => encoder.write_to_known_channel(header, message),
            EncoderPlace::Behind(queue) => {
                let empty = queue.spent.try_recv().unwrap_or_default();
                let job = Job::Message(*header, std::mem::replace(message, empty));
                self.ask(job)
            }
            EncoderPlace::Gone => Ok(()),
        }
    }

    /// Announces a topic; the number of its channel.
    pub fn topic(&mut self, topic: Topic) -> McapResult<u16> {
        match &mut self.place {
            EncoderPlace::Here(encoder) => announce(encoder, &topic),
            EncoderPlace::Behind(_) => {
                let (done, answer) = sync_channel(1);
                self.ask(Job::Topic(topic, done))?;
                self.answered(&answer)
            }
            EncoderPlace::Gone => Ok(0),
        }
    }

    /// Ends the chunk and hands everything up to time `t_s` to the operating system: at once, or by the thread, which has done so
    /// with the chunk before when this returns.
    pub fn flush(&mut self, t_s: f64) -> McapResult<()> {
        match &mut self.place {
            EncoderPlace::Here(encoder) => flush(encoder, &self.path, t_s, &self.progress),
            EncoderPlace::Behind(queue) => {
                let (done, answer) = sync_channel(1);
                let before = queue.flushed.replace(answer);
                self.ask(Job::Flush(t_s, done))?;
                before.map_or(Ok(()), |answer| self.answered(&answer))
            }
            EncoderPlace::Gone => Ok(()),
        }
    }

    /// Returns when all that was asked for is done.
    pub fn wait(&mut self) -> McapResult<()> {
        if !matches!(self.place, EncoderPlace::Behind(_)) {
            return Ok(());
        }
        let (done, answer) = sync_channel(1);
        self.ask(Job::Answer(done))?;
        self.answered(&answer)
    }

    /// Waits for an answer of the thread; an error on the way ends it, and it answers nothing.
    fn answered<T>(&mut self, answer: &Receiver<T>) -> McapResult<T> {
        match answer.recv() {
            Ok(answer) => Ok(answer),
            Err(_) => Err(self.ended()),
        }
    }

    /// Size and time that are safe whatever comes after; behind a queue they may lag the last flush, until [`Sink::wait`].
    pub fn kept(&self) -> Kept {
        lock(&self.progress).kept
    }

    /// Takes what is there from an earlier process for kept.
    pub fn keep(&mut self, kept: Kept) {
        lock(&self.progress).kept = kept;
    }

    /// Writes the footer; later calls do nothing.
    pub fn close(&mut self) -> McapResult<()> {
        self.wait()?;
        let Some(mut encoder) = self.take() else { return Ok(()) };
        encoder.finish()?;
        Ok(encoder.into_inner().into_inner().flush()?)
    }

    /// Stops writing, and waits for the thread; the file ends where that has come to.
    pub fn abandon(&mut self) {
        drop(self.take());
    }

    fn take(&mut self) -> Option<Box<Encoder>> {
        match std::mem::replace(&mut self.place, EncoderPlace::Gone) {
            EncoderPlace::Here(encoder) => Some(encoder),
            EncoderPlace::Behind(Queue { jobs, thread, .. }) => {
                drop(jobs);
                thread.join().ok().flatten()
            }
            EncoderPlace::Gone => None,
        }
    }

    fn ask(&mut self, job: Job) -> McapResult<()> {
        match &self.place {
            EncoderPlace::Behind(queue) if queue.jobs.send(job).is_err() => Err(self.ended()),
            _ => Ok(()),
        }
    }

    /// Why the thread has ended before its time.
    fn ended(&mut self) -> McapError {
        self.abandon();
        let why = lock(&self.progress).failed.take();
        why.unwrap_or_else(|| McapError::Io(std::io::Error::other("the thread of the recording has ended")))
    }
}

impl Drop for Sink {
    fn drop(&mut self) {
        self.abandon();
    }
}

/// Does what comes in, until nothing can come any more, or something fails.
fn write_all(
    mut encoder: Box<Encoder>,
    path: &Path,
    progress: &Mutex<Progress>,
    todo: &Receiver<Job>,
    spent: impl Fn(Vec<u8>),
) -> Option<Box<Encoder>> {
    for job in todo {
        let done = match job {
            Job::Message(header, message) => {
                let written = encoder.write_to_known_channel(&header, &message);
                spent(message);
                written
            }
            Job::Topic(topic, done) => {
                announce(&mut encoder, &topic).and_then(|channel| tell(&done, channel))
            }
            Job::Flush(t_s, done) => flush(&mut encoder, path, t_s, progress).and_then(|()| tell(&done, ())),
            Job::Answer(done) => tell(&done, ()),
        };
        if let Err(e) = done {
            // the encoder ends before the error is returned: its last bytes are cut off then
            drop(encoder);
            lock(progress).failed = Some(e);
            return None;
        }
    }
    Some(encoder)
}

/// Answers whoever still waits; nobody does after an error.
fn tell<T>(done: &SyncSender<T>, answer: T) -> McapResult<()> {
    done.send(answer).ok();
    Ok(())
}

fn announce(encoder: &mut Encoder, topic: &Topic) -> McapResult<u16> {
    let schema = encoder.add_schema(&topic.schema, topic.schema_encoding, &topic.schema_data)?;
    encoder.add_channel(schema, &topic.topic, &topic.encoding, &topic.metadata)
}

fn flush(encoder: &mut Encoder, path: &Path, t_s: f64, progress: &Mutex<Progress>) -> McapResult<()> {
    encoder.flush()?;
    let mut progress = lock(progress);
    progress.kept = (std::fs::metadata(path).map_or(progress.kept.0, |m| m.len()), t_s);
    Ok(())
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
