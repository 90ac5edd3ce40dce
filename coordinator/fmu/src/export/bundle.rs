//! Collects everything that a scenario needs, lays it out as an FMU and packs it.

use super::{ExportSettings, Request, SCENARIO, SETTINGS, open, page, place, wrap};
use crate::driven_bodies::{self, DrivenBodiesSettings};
use crate::references;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::testbed::{Options, Testbed};
use terraglue_fmi::elf::needed_glibc;
use terraglue_fmi::export::{
    About, Compression, Content, Mailbox, Opened, Opening, describe, identifier, pack,
};
use terraglue_fmi::{Fmu, Version};
use terraglue_host::SearchPath;
use terraglue_scenario::{InputError, Scenario, SubsystemSpec, find_soil_table};
use terraglue_subsystem::bytes::{hash, hash_from};
use terraglue_subsystem::{Capabilities, Config, ParameterType};
use toml_edit::{DocumentMut, Item, value};

/// An FMU that was written.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The FMU.
    pub path: PathBuf,
    /// Variables in its description.
    pub variables: usize,
    /// Whether its state can be saved and restored, and whether it can be serialised.
    pub states: [bool; 2],
    /// Why it brings no results of its first steps with it, where it was to.
    pub unproved: Option<String>,
    /// The oldest glibc that its library runs with, as `2.34`: that of the machine that built it, or older.
    pub glibc: Option<String>,
    /// Subsystems that are isolated in the scenario and not in the FMU.
    pub isolated: Vec<String>,
    /// Names that the version of the standard has no type for.
    pub left_out: Vec<String>,
}

/// File of the library inside every FMU.
const LIBRARY: &str = "libterraglue_fmu_library.so";

/// Exports a scenario or a module.
///
/// # Errors
/// Wrong input: a scenario or module that cannot be built, a file that cannot be read or written.
pub fn write(request: &Request) -> Result<Exported> {
    let (scenario, bare) = scenario(request)?;
    let search = SearchPath::standard(&request.module_paths, &scenario.folder);
    let stage = tempfile::tempdir().map_err(|e| plain(format!("a temporary folder: {e}")))?;
    let resources = stage.path().join("resources");
    let mut bundle = Bundle {
        scenario: &scenario,
        search: &search,
        resources: &resources,
        document: document(&scenario)?,
    };
    bundle.subsystems()?;
    bundle.terrain()?;
    let text = bundle.document.to_string();
    place(&resources, SCENARIO, text.as_bytes()).map_err(plain)?;
    let settings = ExportSettings {
        version: if request.version == Version::V2 { 2 } else { 3 },
        scalars: request.scalars,
        token: token(&resources, request)?,
        bare: bare.map(str::to_owned),
    };
    let json = serde_json::to_vec_pretty(&settings).map_err(|e| plain(e.to_string()))?;
    place(&resources, SETTINGS, &json).map_err(plain)?;
    // The description is made from the instance that the FMU itself will open.
    let opening = Opening { name: "export".into(), resources: resources.clone(), log: Mailbox::default() };
    let opened = open(&opening).map_err(|message| at_home(&scenario, request, bare, message))?;
    let about = about(request, &scenario, &settings);
    let mut entries = entries(request, &search, &resources, &opened, &about)?;
    let unproved = match request.reference {
        true => add_reference(&scenario, &stage.path().join("copy.fmu"), &mut entries)?,
        false => None,
    };
    pack(&request.out, &entries, Compression::Deflate).map_err(plain)?;
    let can = opened.subsystem.capabilities();
    let state = can.has(Capabilities::STATE);
    let isolated = scenario.subsystems.iter().filter(|s| s.isolate).map(|s| s.name.clone());
    Ok(Exported {
        isolated: isolated.collect(),
        path: request.out.clone(),
        variables: opened.layout.entries.len(),
        states: [state, state && can.has(Capabilities::SERIALIZE)],
        unproved,
        glibc: glibc(&entries)?,
        left_out: opened.layout.left_out(opened.subsystem.variables()).map(str::to_owned).collect(),
    })
}

/// Results of the first steps of an FMU as more of its entries; why there are none, if so. A copy that is not compressed is run for them.
fn add_reference(
    scenario: &Scenario,
    copy: &Path,
    entries: &mut Vec<(String, Content)>,
) -> Result<Option<String>> {
    pack(copy, entries, Compression::None).map_err(plain)?;
    let fmu = Fmu::open(copy).map_err(|e| plain(e.to_string()))?;
    let inputs = references::pressed(&touching(scenario)?, references::stop_s(&fmu));
    match references::files(&fmu, &inputs, Box::new(|_| {})) {
        Ok(files) => entries.extend(files.into_iter().map(|(path, text)| (path, Content::Text(text)))),
        Err(error) => return Ok(Some(error.to_string())),
    }
    Ok(None)
}

/// Where the feet of an exported soil touch level ground at z = 0, m: at their own places, else up to sixteen of them half a metre apart.
fn touching(scenario: &Scenario) -> Result<Vec<[f64; 3]>> {
    let feet = |spec: &&SubsystemSpec| spec.name == "foot" && spec.module == driven_bodies::NAME;
    let Some(feet) = scenario.subsystems.iter().find(feet) else { return Ok(Vec::new()) };
    let json = Value::Object(feet.parameters.clone()).to_string();
    let config = Config::parse(&json).map(|config| config.with_defaults(&driven_bodies::schema()));
    let settings =
        config.and_then(|config| Ok((config.numbers("position_m")?, DrivenBodiesSettings::read(&config)?)));
    let (given, settings) = settings.map_err(|e| plain(e.to_string()))?;
    let [_, [.., height]] = settings.shape.extent();
    let count = settings.positions.len();
    if given.is_empty() && count <= 16 {
        let place = |k: usize| [(k % 4) as f64 * 0.5 - 0.75, (k / 4) as f64 * 0.5 - 0.75, height];
        return Ok((0..count).map(place).collect());
    }
    Ok(given.as_chunks::<3>().0.iter().map(|[x, y, _]| [*x, *y, height]).collect())
}

/// Error of a scenario, at its place in the original and not in the copy. The scenario around a single module is no
/// file: only edits of it have a place.
fn at_home(scenario: &Scenario, request: &Request, bare: Option<&str>, message: String) -> Error {
    let options = Options { module_paths: request.module_paths.clone(), ..Options::default() };
    match Testbed::build_with(scenario, &options, &crate::library()) {
        Err(Error::Input(wrong)) if bare.is_none() || wrong.source_code.name().starts_with("--") => {
            wrong.into()
        }
        Err(other) if bare.is_none() => other,
        _ => plain(message),
    }
}

fn plain(message: impl Into<String>) -> Error {
    InputError::plain(message, None).into()
}

/// The scenario, and the subsystem whose variables have no prefix where it is made for one module.
fn scenario(request: &Request) -> Result<(Scenario, Option<&'static str>)> {
    let path = Path::new(&request.target);
    // a scenario, or a system structure that is read as one
    if path.extension().is_some_and(|e| ["toml", "ssp", "ssd"].iter().any(|known| e == *known)) {
        return Ok((Scenario::load(path, &request.sets)?, None));
    }
    let search = SearchPath::standard(&request.module_paths, Path::new("."));
    let (text, name) = wrap(&request.target, &search).map_err(plain)?;
    let stem = path.file_stem().map_or(request.target.clone(), |s| s.to_string_lossy().into_owned());
    Ok((Scenario::parse(&text, &format!("./{stem}.toml"), &request.sets)?, Some(name)))
}

fn document(scenario: &Scenario) -> Result<DocumentMut> {
    scenario.source.text.parse().map_err(|e| plain(format!("the scenario after its edits: {e}")))
}

/// Copies of files, and a scenario that refers to them.
struct Bundle<'a> {
    scenario: &'a Scenario,
    search: &'a SearchPath,
    resources: &'a Path,
    document: DocumentMut,
}

impl Bundle<'_> {
    /// Copies a file that the scenario names; its path in the resources.
    fn take(&self, from: &Path, to: String) -> Result<String> {
        let bytes =
            terraglue_subsystem::files::read(from).map_err(|e| plain(format!("{}: {e}", from.display())))?;
        place(self.resources, &to, &bytes).map_err(plain)?;
        Ok(to)
    }

    fn set(&mut self, table: &str, key: &str, to: &str) {
        if let Some(table) = self.document.get_mut(table).and_then(Item::as_table_like_mut) {
            table.insert(key, value(to));
        }
    }

    /// A process of its own is the affair of the master that loads the FMU.
    fn forget_isolation(&mut self, name: &str) {
        if let Some(table) = self.document.get_mut(name).and_then(Item::as_table_like_mut) {
            table.remove("isolate");
        }
    }

    fn subsystems(&mut self) -> Result {
        for spec in &self.scenario.subsystems {
            self.forget_isolation(&spec.name);
            if spec.is_fmu() {
                let to =
                    self.take(&self.scenario.folder.join(&spec.module), format!("fmus/{}.fmu", spec.name))?;
                self.set(&spec.name, "fmu", &to);
                continue;
            }
            let found = crate::library().find(&spec.module, self.search, &self.scenario.folder);
            let module = found.map_err(|e| {
                self.scenario.source.error_at_value(&[&spec.name, "module"], e.to_string(), None)
            })?;
            let paths: Vec<&str> = (module.schema().parameters.iter())
                .filter(|p| p.parameter_type == ParameterType::Path)
                .map(|p| p.name.as_str())
                .collect();
            for key in paths {
                self.parameter(spec, key)?;
            }
            self.soil_table(spec)?;
            self.law(spec)?;
            if let Some(path) = module.path() {
                let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                let to = self.take(path, format!("modules/{}/{file}", spec.name))?;
                self.set(&spec.name, "module", &to);
            }
        }
        Ok(())
    }

    /// A parameter that is the path of a file, with the files that this one names.
    fn parameter(&mut self, spec: &SubsystemSpec, key: &str) -> Result {
        let below = |value: &Value, part: &str| value.get(part).cloned();
        let all = Value::Object(spec.parameters.clone());
        let given = key.split('.').try_fold(all, |value, part| below(&value, part));
        let Some(path) = given.as_ref().and_then(|v| v.as_str()) else { return Ok(()) };
        let from = self.scenario.folder.join(path);
        let file = from.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let folder = format!("files/{}", spec.name);
        let to = self.take(&from, format!("{folder}/{file}"))?;
        for named in named_files(&from) {
            let below = from.parent().unwrap_or(Path::new("")).join(&named);
            if named.contains("..") || named.starts_with('/') {
                let text = format!("{} names `{named}`, which lies outside its folder", from.display());
                return Err(plain(text + "; put it beside the file"));
            }
            if below.is_file() {
                self.take(&below, format!("{folder}/{named}"))?;
            }
        }
        // The sub-table of the module comes on top of the subsystem's own, so it is changed where it is written.
        let parts = || key.split('.');
        let table = self.document.get(&spec.name);
        let own = table.and_then(|t| parts().try_fold(t.get(&spec.module)?, |item, part| item.get(part)));
        let mut item = match own.is_some() {
            true => &mut self.document[&spec.name][&spec.module],
            false => &mut self.document[&spec.name],
        };
        for part in parts() {
            item = &mut item[part];
        }
        *item = value(to);
        Ok(())
    }

    /// The module that is the law of a soil.
    fn law(&mut self, spec: &SubsystemSpec) -> Result {
        let named = spec.parameters.get("law").and_then(|law| law.get("plugin"));
        let Some(name) = named.and_then(|v| v.as_str()) else { return Ok(()) };
        let path = terraglue_host::law::locate(name, self.search, &self.scenario.folder);
        let path = path.map_err(|e| {
            let place = [spec.name.as_str(), "law", "plugin"];
            self.scenario.source.error_at_value(&place, e.to_string(), None)
        })?;
        let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let to = self.take(&path, format!("modules/{}/law/{file}", spec.name))?;
        let law = self.document.get_mut(&spec.name).and_then(|t| t.get_mut("law"));
        if let Some(law) = law.and_then(Item::as_table_like_mut) {
            law.insert("plugin", value(to));
        }
        Ok(())
    }

    /// The soil file that `parameters` names, or the table with the row that it names.
    fn soil_table(&mut self, spec: &SubsystemSpec) -> Result {
        if spec.offered.is_empty() && spec.regions.is_empty() {
            return Ok(());
        }
        let folder = &self.scenario.folder;
        for region in spec.regions.iter().filter(|region| region.soil.ends_with(".toml")) {
            self.take(&folder.join(&region.soil), region.soil.clone())?;
        }
        let text = |key: &str| self.document.get(&spec.name).and_then(|t| t.get(key)).and_then(Item::as_str);
        if let Some(file) = text("parameters").filter(|p| p.ends_with(".toml")) {
            let to = self.take(&folder.join(file), format!("models/{}.toml", spec.name))?;
            self.set(&spec.name, "parameters", &to);
            return Ok(());
        }
        let path = text("parameters_file").map(|f| folder.join(f)).or_else(|| find_soil_table(folder));
        if let Some(path) = path {
            let to = self.take(&path, "models/soils.csv".into())?;
            self.set(&spec.name, "parameters_file", &to);
        }
        Ok(())
    }

    fn terrain(&mut self) -> Result {
        let named = self.document.get("terrain").and_then(|t| t.get("file")).and_then(Item::as_str);
        let Some(named) = named.map(|f| self.scenario.folder.join(f)) else { return Ok(()) };
        let file = named.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let to = self.take(&named, format!("terrain/{file}"))?;
        self.set("terrain", "file", &to);
        Ok(())
    }
}

/// Files that a robot file needs, relative to its folder: meshes, textures and other files that it names, with those that an
/// included file names, below the folders that MJCF sets for them.
fn named_files(path: &Path) -> Vec<String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let (mut found, mut folders) = (BTreeSet::new(), BTreeSet::from([String::new()]));
    let mut open = vec![path.to_owned()];
    while let Some(file) = open.pop() {
        let Ok(text) = terraglue_subsystem::files::read_text(&file) else { continue };
        for key in ["meshdir", "assetdir", "texturedir"] {
            folders.extend(attributes(&text, key).map(|d| d.trim_end_matches('/').to_owned() + "/"));
        }
        for name in ["filename", "file"].iter().flat_map(|key| attributes(&text, key)) {
            let name = name.strip_prefix("package://").unwrap_or(name).to_owned();
            let below = folder.join(&name);
            let is_text = [".xml", ".xacro", ".urdf", ".mjcf"].iter().any(|end| name.ends_with(end));
            if is_text && below.is_file() && !found.contains(&name) {
                open.push(below);
            }
            found.insert(name);
        }
    }
    let placed = |name: String| {
        let there = folders.iter().map(|f| format!("{f}{name}")).find(|path| folder.join(path).is_file());
        there.unwrap_or(name)
    };
    let all: BTreeSet<String> = found.into_iter().map(placed).collect();
    all.into_iter().collect()
}

/// Values of an attribute, in either kind of quotes.
fn attributes<'a>(text: &'a str, name: &'a str) -> impl Iterator<Item = &'a str> {
    text.match_indices(name).filter_map(move |(at, _)| {
        let begins = text[..at].ends_with(|c: char| c.is_whitespace());
        let rest = text[at + name.len()..].trim_start().strip_prefix('=')?.trim_start();
        let quote = rest.chars().next().filter(|q| begins && ['"', '\''].contains(q))?;
        rest[1..].split(quote).next()
    })
}

/// 128 bits over all resources and the way they are shown, as a GUID: FNV-1a twice, with two starts.
fn token(resources: &Path, request: &Request) -> Result<String> {
    let mut files = Vec::new();
    collect(resources, &mut files).map_err(|e| plain(format!("{}: {e}", resources.display())))?;
    files.sort();
    let mut hashes = [hash(&[]), 0x8422_2325_cbf2_9ce4];
    let mut feed = |bytes: &[u8]| {
        for hash in &mut hashes {
            *hash = hash_from(*hash, bytes);
        }
    };
    feed(format!("{:?} {}", request.version, request.scalars).as_bytes());
    for file in &files {
        feed(file.strip_prefix(resources).unwrap_or(file).to_string_lossy().as_bytes());
        feed(&terraglue_subsystem::files::read(file).map_err(|e| plain(format!("{}: {e}", file.display())))?);
    }
    let [a, b] = hashes;
    let part = |shift: u32, mask: u64| (a >> shift) & mask;
    let guid = format!("{:08x}-{:04x}-{:04x}", part(32, 0xffff_ffff), part(16, 0xffff), part(0, 0xffff));
    Ok(format!("{{{guid}-{:04x}-{:012x}}}", b >> 48, b & 0xffff_ffff_ffff))
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { collect(&path, files)? } else { files.push(path) }
    }
    Ok(())
}

fn about(request: &Request, scenario: &Scenario, settings: &ExportSettings) -> About {
    let help = match settings.bare {
        Some(_) => format!("The module {} of Terraglue", request.target),
        None => format!("The scenario {} of Terraglue", scenario.name),
    };
    About {
        name: scenario.name.clone(),
        identifier: identifier(&scenario.name),
        description: help,
        token: settings.token.clone(),
        tool: format!("Terraglue {}", env!("CARGO_PKG_VERSION")),
        license: "The library: MIT OR Apache-2.0. The model: that of its files.".into(),
        origin: request.origin.clone(),
        stop_s: scenario.time.duration_s,
        step_s: scenario.time.step_s,
        fixed_step_s: None,
    }
}

/// The oldest glibc that the libraries of an FMU run with.
fn glibc(entries: &[(String, Content)]) -> Result<Option<String>> {
    let mut all = Vec::new();
    for (name, content) in entries.iter().filter(|(name, _)| name.ends_with(".so")) {
        let read = |path: &PathBuf| std::fs::read(path).map_err(|e| plain(format!("{name}: {e}")));
        all.extend(match content {
            Content::File(path) => needed_glibc(&read(path)?),
            Content::Bytes(bytes) => needed_glibc(bytes),
            Content::Text(_) => None,
        });
    }
    let minor = |version: &String| version.rsplit('.').next().and_then(|m| m.parse::<u32>().ok());
    Ok(all.into_iter().max_by_key(minor))
}

/// Everything in the archive, in its order.
fn entries(
    request: &Request,
    search: &SearchPath,
    resources: &Path,
    opened: &Opened,
    about: &About,
) -> Result<Vec<(String, Content)>> {
    let library = search.folders().iter().map(|f| f.join(LIBRARY)).find(|p| p.is_file());
    let library = library.ok_or_else(|| {
        // beside a program of release, a library of release
        let profile = if cfg!(debug_assertions) { "" } else { " --release" };
        let help = format!(
            "build it with `cargo build{profile} --package terraglue-fmu-library`, or give its folder by --module-path"
        );
        InputError::plain(
            format!("the library of exported FMUs, {LIBRARY}, was not found"),
            Some(help),
        )
    })?;
    let two = request.version == Version::V2;
    let description =
        describe(opened.subsystem.as_ref(), &opened.layout, about).map_err(|e| plain(e.to_string()))?;
    let platform = terraglue_fmi::platform(request.version);
    let mut all = vec![
        ("modelDescription.xml".to_owned(), Content::Text(description)),
        (format!("binaries/{platform}/{}.so", about.identifier), Content::File(library)),
        ("documentation/index.html".into(), Content::Text(page::page(opened, about))),
        ("documentation/licenses/license.txt".into(), Content::Text(page::LICENSE.into())),
    ];
    let icon = page::icon().map_err(|e| plain(format!("the icon: {e}")))?;
    all.push((if two { "model.png" } else { "terminalsAndIcons/icon.png" }.into(), Content::Bytes(icon)));
    if let Some(terminals) = terraglue_fmi::export::terminals(&opened.layout, &opened.joints) {
        all.push(("terminalsAndIcons/terminalsAndIcons.xml".into(), Content::Text(terminals)));
    }
    let mut files = Vec::new();
    collect(resources, &mut files).map_err(|e| plain(format!("{}: {e}", resources.display())))?;
    files.sort();
    for file in files {
        let name = file.strip_prefix(resources).unwrap_or(&file).to_string_lossy().into_owned();
        let bytes =
            terraglue_subsystem::files::read(&file).map_err(|e| plain(format!("{}: {e}", file.display())))?;
        all.push((format!("resources/{name}"), Content::Bytes(bytes)));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_a_robot_are_found_in_either_quotes_and_below_its_folders() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap_or(Path::new("")))?;
            std::fs::write(path, text)
        };
        for mesh in ["meshes/a.stl", "meshes/parts/b.obj", "c.stl", "pictures/d.png"] {
            write(mesh, "")?;
        }
        write(
            "robot.xml",
            "<mujoco><compiler meshdir='meshes' texturedir = \"pictures/\"/><include file=\"more/legs.xml\"/>\
             <asset><mesh file='a.stl'/><texture file='d.png'/></asset></mujoco>",
        )?;
        write("more/legs.xml", "<mujoco><asset><mesh file=\"parts/b.obj\"/></asset></mujoco>")?;
        let all = named_files(&folder.path().join("robot.xml"));
        assert_eq!(all, ["meshes/a.stl", "meshes/parts/b.obj", "more/legs.xml", "pictures/d.png"]);
        write(
            "robot.urdf",
            "<robot><mesh filename='c.stl'/><mesh filename = \"package://meshes/a.stl\"/></robot>",
        )?;
        assert_eq!(named_files(&folder.path().join("robot.urdf")), ["c.stl", "meshes/a.stl"]);
        Ok(())
    }
}
