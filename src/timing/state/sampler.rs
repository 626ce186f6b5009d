//! A thread that reads the state of the machine while frames run.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::row::{Event, StateRow};
use super::sources::{DeviceNames, Folders, Sources};
use crate::gpu::{Device, MemoryProbe};

/// Time between two readings.
const PERIOD: Duration = Duration::from_millis(100);
/// Longest wait for the sources to be opened and read once. A driver may hang in it.
const OPENING: Duration = Duration::from_secs(2);
/// Longest wait for a reading in progress at the end.
const CLOSING: Duration = Duration::from_millis(50);

/// The thread, and what it has read.
pub struct Sampler {
    to_thread: Sender<Message>,
    ended: Receiver<()>,
    log: StateLog,
}

/// The readings of a [`Sampler`]; other threads may look at them at any time.
#[derive(Debug, Clone)]
pub struct StateLog {
    /// The start of the run, from which times count.
    pub zero: Instant,
    log: Arc<Mutex<Log>>,
}

#[derive(Debug, Default)]
struct Log {
    rows: Vec<StateRow>,
    sources: Vec<String>,
    notes: Vec<String>,
}

/// Tells the thread of a [`Sampler`] which block runs, without waiting for it. The default one
/// tells nobody.
#[derive(Debug, Clone, Default)]
pub struct BlockWatch(Option<Sender<Message>>);

#[derive(Debug)]
enum Message {
    Begin(u32),
    End(u32),
    Stop,
}

impl BlockWatch {
    /// The timed frames of a block begin.
    pub fn begin(&self, i_block: u32) {
        self.tell(Message::Begin(i_block));
    }

    /// The frames of a block have ended.
    pub fn end(&self, i_block: u32) {
        self.tell(Message::End(i_block));
    }

    fn tell(&self, message: Message) {
        if let Some(to_thread) = &self.0 {
            // It fails only after the thread has ended: the run is over.
            let _ = to_thread.send(message);
        }
    }
}

impl StateLog {
    /// Returns the readings so far.
    pub fn rows(&self) -> Vec<StateRow> {
        self.lock().rows.clone()
    }

    /// Returns the names of the sources.
    pub fn sources(&self) -> Vec<String> {
        self.lock().sources.clone()
    }

    /// Returns remarks on sources that are missing.
    pub fn notes(&self) -> Vec<String> {
        self.lock().notes.clone()
    }

    fn lock(&self) -> MutexGuard<'_, Log> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sampler {
    /// Starts the thread for an open device and waits for its first reading. The thread reads only
    /// while a block runs, which [`Sampler::watch`] tells it.
    pub fn start(device: &Device) -> Sampler {
        let (named, memory) = (DeviceNames::of(device), device.memory_probe());
        Sampler::with_sources(named, Some(memory), Folders::default())
    }

    /// Starts the thread with the folders of a test.
    pub fn with_sources(
        named: DeviceNames,
        memory: Option<MemoryProbe>,
        folders: Folders,
    ) -> Sampler {
        let log = StateLog { zero: Instant::now(), log: Arc::default() };
        let (to_thread, messages) = mpsc::channel();
        let (end, ended) = mpsc::channel();
        let (ready, is_ready) = mpsc::channel();
        let of_thread = log.clone();
        let started = thread::Builder::new().name("state".to_owned()).spawn(move || {
            let (sources, notes) = Sources::open(&named, memory, &folders);
            let mut reader = Reader { sources, log: of_thread };
            reader.log.lock().sources = reader.sources.names();
            reader.log.lock().notes = notes;
            reader.read(Event::Start, None);
            // Whoever waits may have given up.
            let _ = ready.send(());
            reader.run(&messages);
            let _ = end.send(());
        });
        match started {
            Ok(_) => {
                let _ = is_ready.recv_timeout(OPENING);
            }
            Err(cause) => log.lock().notes.push(format!("no thread for the state: {cause}")),
        }
        Sampler { to_thread, ended, log }
    }

    /// Returns what tells the thread about blocks.
    pub fn watch(&self) -> BlockWatch {
        BlockWatch(Some(self.to_thread.clone()))
    }

    /// Returns the readings, which go on.
    pub fn log(&self) -> StateLog {
        self.log.clone()
    }
}

/// Ends the thread. A reading that hangs in a driver is left behind.
impl Drop for Sampler {
    fn drop(&mut self) {
        let _ = self.to_thread.send(Message::Stop);
        let _ = self.ended.recv_timeout(CLOSING);
    }
}

struct Reader {
    sources: Sources,
    log: StateLog,
}

impl Reader {
    fn read(&mut self, event: Event, block: Option<u32>) {
        let row = self.sources.read(self.log.zero.elapsed().as_secs_f64(), event, block);
        self.log.lock().rows.push(row);
    }

    /// Reads until it is told to stop, or nobody is left to tell it.
    fn run(&mut self, messages: &Receiver<Message>) {
        let mut block = None;
        let mut next = Instant::now() + PERIOD;
        loop {
            let message = match block {
                Some(_) => messages.recv_timeout(next.saturating_duration_since(Instant::now())),
                None => messages.recv().map_err(RecvTimeoutError::from),
            };
            match message.map(|first| last_of(first, messages)) {
                Ok(Message::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Ok(Message::Begin(i)) => {
                    self.read(Event::Begin, Some(i));
                    block = Some(i);
                    next = Instant::now() + PERIOD;
                }
                Ok(Message::End(i)) => {
                    self.read(Event::End, Some(i));
                    block = None;
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.read(Event::Tick, block);
                    // A reading that took long is not made up for.
                    next = (next + PERIOD).max(Instant::now());
                }
            }
        }
    }
}

/// Returns the message that counts of all that have come: blocks that are shorter than a reading
/// are left out.
fn last_of(first: Message, messages: &Receiver<Message>) -> Message {
    let mut last = first;
    for message in messages.try_iter() {
        if matches!(last, Message::Stop) {
            break;
        }
        last = message;
    }
    last
}
