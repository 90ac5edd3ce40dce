//! `terraglue new`: the folder of a new module, or of a scenario around a robot.

use super::arguments::{New, NewArguments};
use super::output::outln;
use super::{Exit, robot};
use std::path::{Component, Path, PathBuf};
use terraglue_diagnostics::{Error, Result};
use terraglue_robot_import::{Options, Robot, read_robot};
use terraglue_scaffold::{Kind, Language, Scaffold, ScaffoldError, Standing, scaffold, spoken_program};
use terraglue_scenario::InputError;

/// Writes the folder and says what to type next.
pub fn new(arguments: &NewArguments) -> Result<Exit> {
    match (arguments.kind, &arguments.robot, &arguments.name) {
        (New::Scenario, Some(file), _) => scenario(arguments, file),
        (New::Scenario, None, _) => {
            let help =
                "`terraglue new scenario --robot my.urdf`, or copy one of the folder scenarios".to_owned();
            Err(plain("a new scenario needs a robot", Some(help)))
        }
        (New::Module(kind), None, Some(name)) => module(arguments, kind, name),
        (New::Module(_), ..) => {
            let help = "leave --robot out, or write `terraglue new scenario --robot FILE`".to_owned();
            Err(plain("--robot is for `new scenario`", Some(help)))
        }
    }
}

fn plain(message: &str, help: Option<String>) -> Error {
    Error::Input(InputError::plain(message, help))
}

fn unwritten(e: ScaffoldError) -> Error {
    plain(&e.to_string(), None)
}

fn module(arguments: &NewArguments, kind: Kind, name: &str) -> Result<Exit> {
    let usual = if kind == Kind::Law { Language::Scenario } else { Language::Rust };
    let program = spoken_program();
    let made = scaffold(kind, arguments.lang.unwrap_or(usual), name, &program).map_err(unwritten)?;
    let exit = written(&made, Path::new(name))?;
    if let Some(bin) = Path::new(&program).parent().filter(|bin| bin.is_absolute()) {
        outln!("\nThe files call the program `terraglue`: export PATH={}:$PATH", bin.display());
    }
    Ok(exit)
}

fn written(made: &Scaffold, folder: &Path) -> Result<Exit> {
    made.write(folder).map_err(unwritten)?;
    let files = made.files.len();
    outln!("{files} file{} in {}. Next:\n", if files > 1 { "s" } else { "" }, folder.display());
    let [first, run] = &made.commands;
    outln!("  cd {} && {first}\n  {run}", folder.display());
    Ok(Exit::Done)
}

fn scenario(arguments: &NewArguments, file: &Path) -> Result<Exit> {
    let (read, fixed) = read(file)?;
    read.warnings.iter().for_each(|warning| log::warn!("{warning}"));
    let stem = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = stem.split('.').next().unwrap_or("robot").to_owned();
    let named = arguments.output.clone().or(arguments.name.as_ref().map(PathBuf::from));
    let folder = named.unwrap_or_else(|| PathBuf::from(format!("{stem}-moon")));
    let Some(standing) = Standing::new(&read, fixed) else {
        let message = format!("{}: nothing of the robot can touch the soil", file.display());
        let help = "give its feet or wheels a <collision> (URDF) or a geom that collides (MJCF)".to_owned();
        return Err(plain(&message, Some(help)));
    };
    standing
        .doubt()
        .into_iter()
        .chain(standing.weak())
        .for_each(|doubt| log::warn!("{}: {doubt}", file.display()));
    let text = standing.scenario(&stem, &from_folder(&folder, file).to_string_lossy());
    let program = spoken_program();
    let commands = [format!("{program} check scenario.toml"), format!("{program} run scenario.toml")];
    let files = vec![("scenario.toml".into(), text)];
    written(&Scaffold { files, commands, crates: &[] }, &folder)
}

/// The robot, and whether its root has to be held: one without mass cannot move.
fn read(file: &Path) -> Result<(Robot, bool)> {
    let options = Options::default().with_ros_package_path();
    let free = match read_robot(file, &options) {
        Ok(robot) => return Ok((robot, false)),
        Err(error) => error,
    };
    match read_robot(file, &Options { fixed_base: true, ..options }) {
        Ok(robot) => Ok((robot, true)),
        Err(_) => Err(Error::Input(robot::wrong(&free))),
    }
}

/// The path of a file as seen from a folder.
fn from_folder(folder: &Path, file: &Path) -> PathBuf {
    let whole = |path: &Path| -> PathBuf {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
        let mut parts: Vec<Component> = Vec::new();
        for part in path.components() {
            match part {
                Component::ParentDir => drop(parts.pop()),
                other => parts.push(other),
            }
        }
        parts.into_iter().collect()
    };
    let (folder, file) = (whole(folder), whole(file));
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(file.components().skip(shared)).collect()
}
