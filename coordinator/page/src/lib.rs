//! The page that shows runs, live and replayed, and the modules of it that reports hold: JavaScript, styles and the document,
//! embedded as bytes. A server sends [`ASSETS`] as they are; a page that is one file holds modules by [`import_map`].
//!
//! All modules name each other `terraglue/<file>`. A map in the document says where that is: beside it, or inside it.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod colour_map;

use std::fmt::Write;

const DOCUMENT: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

/// A file of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asset {
    /// Its path below the address of the page.
    pub path: &'static str,
    /// Media type, as in the HTTP header.
    pub media_type: &'static str,
    /// Its content.
    pub bytes: &'static [u8],
}

macro_rules! assets {
    ($($media:ident $path:literal),* $(,)?) => {
        /// All files of the page.
        pub const ASSETS: &[Asset] =
            &[$(Asset { path: $path, media_type: $media, bytes: include_bytes!(concat!("../assets/", $path)) }),*];
    };
}

assets! {
    SCRIPT "axes.js",
    SCRIPT "batch.js",
    SCRIPT "beside.js",
    SCRIPT "bodies.js",
    SCRIPT "camera.js",
    SCRIPT "columns.js",
    SCRIPT "export.js",
    SCRIPT "figures.js",
    SCRIPT "frames.js",
    SCRIPT "gl.js",
    DOCUMENT "index.html",
    SCRIPT "keys.js",
    SCRIPT "link.js",
    SCRIPT "lists.js",
    STYLE "live.css",
    SCRIPT "live.js",
    SCRIPT "map.js",
    SCRIPT "math.js",
    SCRIPT "menus.js",
    SCRIPT "nodes.js",
    STYLE "page.css",
    SCRIPT "palette.js",
    SCRIPT "plot.js",
    SCRIPT "properties.js",
    SCRIPT "protobuf.js",
    SCRIPT "relief.js",
    SCRIPT "renderer.js",
    SCRIPT "replay.js",
    SCRIPT "report.js",
    SCRIPT "run.js",
    SCRIPT "scope.js",
    SCRIPT "shaders.js",
    SCRIPT "solids.js",
    SCRIPT "stage.js",
    SCRIPT "tabs.js",
    SCRIPT "theme.js",
    SCRIPT "timeline.js",
    SCRIPT "topbar.js",
    SCRIPT "track.js",
    SCRIPT "tree.js",
    SCRIPT "video.js",
    STYLE "view.css",
    SCRIPT "view.js",
    SCRIPT "xy.js",
}

/// The modules that a page of one file needs: plots, map and replay.
pub const REPORT_MODULES: &[&str] = &[
    "axes.js",
    "batch.js",
    "bodies.js",
    "camera.js",
    "figures.js",
    "gl.js",
    "map.js",
    "math.js",
    "menus.js",
    "nodes.js",
    "palette.js",
    "plot.js",
    "protobuf.js",
    "relief.js",
    "renderer.js",
    "replay.js",
    "report.js",
    "shaders.js",
    "solids.js",
    "track.js",
    "view.js",
    "xy.js",
];

/// The text of a file; empty where there is none of that name.
pub fn text(path: &str) -> &'static str {
    let asset = ASSETS.iter().find(|asset| asset.path == path);
    asset.and_then(|asset| std::str::from_utf8(asset.bytes).ok()).unwrap_or_default()
}

/// An import map (JSON) that holds the modules themselves, for a page that may be opened from a folder.
pub fn import_map(modules: &[&str]) -> String {
    let entry = |path: &&str| {
        format!("\"terraglue/{path}\":\"data:text/javascript;charset=utf-8,{}\"", quoted(text(path)))
    };
    let entries: Vec<String> = modules.iter().map(entry).collect();
    format!("{{\"imports\":{{{}}}}}", entries.join(","))
}

/// Escaped for use in an address, in JSON and inside an element of a page.
fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() * 5 / 4);
    for byte in text.bytes() {
        match byte {
            b'%' | b'#' | b'"' | b'\\' | b'<' | b'>' | b'&' | 0..=0x1f | 0x7f.. => {
                let _ = write!(out, "%{byte:02X}");
            }
            byte => out.push(char::from(byte)),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_module_of_a_report_is_there_and_names_only_modules_that_are_there() {
        for path in REPORT_MODULES {
            let script = text(path);
            assert!(!script.is_empty(), "{path}");
            let named = script.split("from \"terraglue/").skip(1).filter_map(|rest| rest.split('"').next());
            for other in named {
                assert!(REPORT_MODULES.contains(&other), "{path} imports {other}");
            }
        }
    }

    #[test]
    fn the_page_stays_small() {
        let bytes: usize = ASSETS.iter().map(|asset| asset.bytes.len()).sum();
        assert!(bytes <= 250_000, "{bytes} bytes");
        let scripts = || ASSETS.iter().filter(|asset| asset.path.ends_with(".js"));
        let lines: usize = scripts().map(|asset| text(asset.path).lines().count()).sum();
        assert!(lines <= 6000, "{lines} lines");
    }

    #[test]
    fn a_module_inside_a_page_ends_no_element_and_no_text() {
        assert_eq!(quoted("a < \"b\" // 100 %\n"), "a %3C %22b%22 // 100 %25%0A");
        assert!(
            import_map(&["axes.js"])
                .starts_with("{\"imports\":{\"terraglue/axes.js\":\"data:text/javascript")
        );
    }
}
