//! `terraglue serve` and `run --serve`: a run, or a recording, on the page of the program and for viewers of the Foxglove WebSocket
//! protocol.

use super::arguments::RunCommand;
use super::folder::results_folder;
use super::interrupt::Interrupt;
use super::output::outln;
use super::serve_arguments::{ListenArguments, ServeArguments};
use super::testbed::{build, options_of};
use super::{Exit, exit_of, show, soil_module, strict};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use terraglue_diagnostics::{Error, Result};
use terraglue_recording::Summary;
use terraglue_scenario::{InputError, Scenario};
use terraglue_serve::{Access, Beside, Ended, Hub, Live, Mission, Replay, Server, Welcome, token};

/// The port that viewers ask at first.
const PORT: u16 = 8765;

/// Serves a scenario or a recording.
pub fn serve(arguments: &ServeArguments) -> Result<Exit> {
    let interrupt = Interrupt::listen();
    let path = &arguments.scenario.scenario;
    if path.is_dir() {
        return replay(arguments, path, &interrupt);
    }
    let sets: Vec<(String, String)> = arguments.sets();
    let scenario = strict::load(&arguments.scenario, &sets, false)?;
    soil_module::check(&scenario, &arguments.scenario)?;
    let served = Served {
        scenario: &scenario,
        module_paths: &arguments.scenario.module_path,
        threads: arguments.threads,
        out: arguments.out.as_deref(),
        pace: arguments.pace.0,
        plays: !arguments.paused,
        stays: true,
        budget: (arguments.rewind_memory as usize) << 20,
        beside: beside(arguments)?,
        listen: &arguments.listen,
    };
    let ended = served.run(&interrupt)?;
    for folder in &ended.folders {
        outln!("report: {}", folder.join("report.html").display());
    }
    Ok(exit(&ended))
}

/// `run --serve`: the run as it would be, and on the page.
pub fn run(command: &RunCommand, scenario: &Scenario, interrupt: &Interrupt) -> Result<Exit> {
    let arguments = &command.run;
    let listen = ListenArguments {
        host: IpAddr::V4(Ipv4Addr::LOCALHOST),
        port: None,
        no_open: true,
        writers: "one".into(),
        allow_origin: Vec::new(),
    };
    let served = Served {
        scenario,
        module_paths: &arguments.scenario.module_path,
        threads: arguments.threads,
        out: arguments.out.as_deref(),
        pace: command.realtime.then_some(1.0),
        plays: true,
        stays: false,
        budget: 512 << 20,
        beside: None,
        listen: &listen,
    };
    let ended = served.run(interrupt)?;
    let folder = ended.folders.last().cloned().unwrap_or_default();
    if let Ok(summary) = Summary::read(&folder) {
        match arguments.json {
            true => outln!("{}", serde_json::to_string_pretty(&summary).unwrap_or_default()),
            false if !arguments.quiet => outln!("{}", show::summary(&summary)),
            false => {}
        }
    }
    Ok(exit(&ended))
}

fn exit(ended: &Ended) -> Exit {
    match &ended.error {
        Some(error) => {
            show::error(error);
            exit_of(error)
        }
        None if ended.is_done => Exit::Done,
        None => Exit::Interrupted,
    }
}

/// A run that is served.
struct Served<'a> {
    scenario: &'a Scenario,
    module_paths: &'a [PathBuf],
    threads: usize,
    out: Option<&'a Path>,
    pace: Option<f64>,
    plays: bool,
    stays: bool,
    budget: usize,
    beside: Option<Beside>,
    listen: &'a ListenArguments,
}

impl Served<'_> {
    fn run(&self, interrupt: &Interrupt) -> Result<Ended> {
        let options = options_of(self.threads, self.module_paths, &Arc::default());
        let (hub, todo) = Hub::new(self.listen.writers == "many");
        let make = || build(self.scenario, &options);
        let folder = results_folder(self.out, &self.scenario.name)?;
        let mission = Mission {
            scenario: self.scenario,
            folder,
            build: &make,
            pace: self.pace,
            plays: self.plays,
            stays: self.stays,
            budget: self.budget,
            tell: show::error,
        };
        let live = Live::new(Arc::clone(&hub), mission)?;
        let welcome = Welcome {
            name: self.scenario.name.clone(),
            page: self.scenario.page.to_json(),
            ..Welcome::default()
        };
        let server = self.listen.start((hub, self.beside.clone()), welcome)?;
        interrupt.run();
        let ended = live.run(&todo, &interrupt.flag());
        drop(server);
        Ok(ended)
    }
}

/// Shows a recording until Ctrl-C.
fn replay(arguments: &ServeArguments, folder: &Path, interrupt: &Interrupt) -> Result<Exit> {
    let (hub, todo) = Hub::new(arguments.listen.writers == "many");
    let mut replay = Replay::open(Arc::clone(&hub), folder)?;
    let welcome = Welcome { name: replay.name().to_owned(), page: replay.page(), ..Welcome::default() };
    let server = arguments.listen.start((hub, beside(arguments)?), welcome)?;
    interrupt.run();
    let flag: Arc<AtomicBool> = interrupt.flag();
    replay.run(&todo, &flag)?;
    drop(server);
    Ok(Exit::Done)
}

/// The run that is shown beside, if one was asked for.
fn beside(arguments: &ServeArguments) -> Result<Option<Beside>> {
    arguments.with.as_deref().map(Beside::open).transpose()
}

impl ListenArguments {
    /// Starts the server, says where it is, and shows it.
    fn start(&self, shown: (Arc<Hub>, Option<Beside>), mut welcome: Welcome) -> Result<Server> {
        welcome.beside = shown.1.as_ref().map(|beside| beside.name.clone());
        let is_open = !self.host.is_loopback();
        let token = token();
        let access = Access::new(token.clone(), self.allow_origin.clone(), is_open);
        let at = |port| SocketAddr::new(self.host, port);
        let first =
            Server::start(shown.clone(), at(self.port.unwrap_or(PORT)), access.clone(), welcome.clone());
        let server = match (first, self.port) {
            (Err(_), None) => Server::start(shown, at(0), access, welcome),
            (first, _) => first,
        };
        let server = server.map_err(|e| self.unheard(e))?;
        let address = match is_open {
            // what other machines call this one is not known here
            true => format!("http://{}/?token={token}", server.address()),
            false => format!("http://{}/", server.address()),
        };
        outln!("{address}");
        if !self.no_open {
            open(&address);
        }
        Ok(server)
    }

    fn unheard(&self, error: Error) -> Error {
        let help = "name another port with --port, or an address of this machine with --host";
        InputError::plain(format!("no server can be started at {error}"), Some(help.into())).into()
    }
}

/// Opens a browser, where there is a program for it and a screen.
fn open(address: &str) {
    let has_screen = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    if !has_screen && !cfg!(target_os = "macos") {
        return;
    }
    let program = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let started = Command::new(program)
        .arg(address)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    if let Err(e) = started {
        log::info!("{program}: {e}");
    }
}
