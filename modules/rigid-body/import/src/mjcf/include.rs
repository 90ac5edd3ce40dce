//! `<include>`: the text of other files in its place, and where each piece of the whole comes from.

use crate::error::{Error, Source};
use roxmltree::{Document, Node};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A file with all that it includes.
pub(super) struct MergedFile {
    /// One text.
    pub text: String,
    pieces: Vec<Piece>,
}

/// A stretch of the whole out of one file.
struct Piece {
    /// Its start in the whole.
    start: usize,
    file: String,
    /// Line of its beginning in its file.
    line: usize,
}

impl MergedFile {
    /// Puts the files in place of their elements; they are named from the folder of the first one.
    pub fn read(file: &str, text: &str) -> Result<Self, Error> {
        let mut whole = Self { text: String::with_capacity(text.len()), pieces: Vec::new() };
        let folder = Path::new(file).parent().map(Path::to_path_buf).unwrap_or_default();
        let document = parse(file, text)?;
        whole.add(&Origin { file, text, folder: &folder }, &document, 0..text.len(), &mut Vec::new())?;
        Ok(whole)
    }

    /// File and line of a place in the text.
    pub fn place(&self, at: usize) -> (&str, usize) {
        let piece = &self.pieces[self.pieces.partition_point(|p| p.start <= at).saturating_sub(1)];
        (&piece.file, piece.line + lines(&self.text[piece.start..at]))
    }

    /// Adds a range of a file; `known`: files that are in it already.
    fn add(
        &mut self,
        origin: &Origin,
        document: &Document,
        range: Range<usize>,
        known: &mut Vec<PathBuf>,
    ) -> Result<(), Error> {
        let mut from = range.start;
        for node in document.descendants().filter(|n| n.has_tag_name("include")) {
            let here = node.range();
            if here.start < from || here.end > range.end {
                continue;
            }
            self.copy(origin, from..here.start);
            self.include(origin, node, known)?;
            from = here.end;
        }
        self.copy(origin, from..range.end);
        Ok(())
    }

    fn copy(&mut self, origin: &Origin, range: Range<usize>) {
        let line = 1 + lines(&origin.text[..range.start]);
        self.pieces.push(Piece { start: self.text.len(), file: origin.file.into(), line });
        self.text.push_str(&origin.text[range]);
    }

    fn include(&mut self, origin: &Origin, node: Node, known: &mut Vec<PathBuf>) -> Result<(), Error> {
        let wrong = |problem: String| Error::Element {
            file: origin.file.into(),
            line: 1 + lines(&origin.text[..node.range().start]),
            element: "include".into(),
            problem,
        };
        let name = node.attribute("file").ok_or_else(|| wrong("has no `file`".into()))?;
        let path = origin.folder.join(name);
        if known.contains(&path) {
            return Err(wrong(format!("`{name}` is included twice; a file may be included once")));
        }
        known.push(path.clone());
        let read = terraglue_subsystem::files::read_text(&path);
        let text = read.map_err(|e| wrong(format!("{} cannot be read: {e}", path.display())))?;
        let file = path.display().to_string();
        let document = parse(&file, &text)?;
        let root = document.root_element();
        if !root.has_tag_name("mujoco") && !root.has_tag_name("mujocoinclude") {
            return Err(wrong(format!("the root of {file} is neither <mujoco> nor <mujocoinclude>")));
        }
        let (Some(first), Some(last)) = (root.first_child(), root.last_child()) else { return Ok(()) };
        let range = first.range().start..last.range().end;
        self.add(&Origin { file: &file, text: &text, folder: origin.folder }, &document, range, known)
    }
}

/// A file that is being read.
struct Origin<'a> {
    file: &'a str,
    text: &'a str,
    /// Folder of the included files.
    folder: &'a Path,
}

fn parse<'a>(file: &str, text: &'a str) -> Result<Document<'a>, Error> {
    let source = Source { file, text };
    crate::syntax::check_depth(&source)?;
    Document::parse(text).map_err(|e| source.syntax(e.pos().row as usize, e.to_string()))
}

fn lines(text: &str) -> usize {
    text.matches('\n').count()
}
