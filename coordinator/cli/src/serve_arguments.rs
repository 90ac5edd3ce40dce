//! Arguments of `terraglue serve`.

use crate::scenario_arguments::ScenarioArguments;
use clap::Args;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;

/// Arguments of `serve`.
#[derive(Args, Debug, Clone)]
#[command(after_help = EXAMPLES)]
pub struct ServeArguments {
    /// The scenario; or the folder of a run, which is replayed.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Folder for the results [default: runs/<scenario>]; runs that go on from a time in the past are recorded in DIR-2, DIR-3, ….
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Simulated time in seconds, instead of the scenario's.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub duration: Option<String>,
    /// Threads for the loops inside modules; 0: one per core. Results do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub threads: usize,
    /// Times real time, 0.001 to 1000; or `free`: as fast as it goes.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = pace)]
    pub pace: TimesRealTime,
    /// Begin with a pause.
    #[arg(long)]
    pub paused: bool,
    /// Memory for states to go back to, MB; where it is used up, every second one is dropped.
    #[arg(long, value_name = "MB", default_value_t = 512)]
    pub rewind_memory: u32,
    /// Another run that is shown beside this one: its robot as a ghost in the view, its curves in the oscilloscope.
    #[arg(long, value_name = "DIR")]
    pub with: Option<PathBuf>,
    /// Where to listen, and for whom.
    #[command(flatten)]
    pub listen: ListenArguments,
}

/// Where a server listens.
#[derive(Args, Debug, Clone)]
pub struct ListenArguments {
    /// Address to listen at; 0.0.0.0 lets other machines watch, and write with the token that is printed.
    #[arg(long, value_name = "IP", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    pub host: IpAddr,
    /// Port; 0: any that is free [default: 8765, or any where that is taken].
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// Do not open the browser.
    #[arg(long)]
    pub no_open: bool,
    /// How many clients may change the run at a time.
    #[arg(long, value_name = "WHO", default_value = "one", value_parser = ["one", "many"])]
    pub writers: String,
    /// Pages of this origin may connect, too, e.g. https://app.foxglove.dev. May be repeated.
    #[arg(long, value_name = "URL")]
    pub allow_origin: Vec<String>,
}

const EXAMPLES: &str = "\
Examples:
  terraglue serve scenarios/moon_walk.toml          opens the page: the run goes on in real time
  terraglue serve runs/moon_walk                    the recording of a run through the same page
  terraglue serve runs/bekker --with runs/moon_walk both in one view
  terraglue serve scenarios/moon_walk.toml --pace free --no-open --port 9000";

/// Times real time; none: as fast as it goes.
#[derive(Clone, Copy, Debug)]
pub struct TimesRealTime(pub Option<f64>);

fn pace(text: &str) -> std::result::Result<TimesRealTime, String> {
    if text == "free" {
        return Ok(TimesRealTime(None));
    }
    let factor = text.parse::<f64>().ok().filter(|x| (1e-3..=1e3).contains(x));
    factor
        .map(|x| TimesRealTime(Some(x)))
        .ok_or_else(|| "a factor from 0.001 to 1000, or `free`, is wanted".into())
}

impl ServeArguments {
    /// Edits of the scenario, that of `--duration` behind those of `--set`.
    pub fn sets(&self) -> Vec<(String, String)> {
        let duration = self.duration.iter().map(|s| ("time.duration_s".to_owned(), s.clone()));
        self.scenario.sets.iter().cloned().chain(duration).collect()
    }
}
