//! An element of the description: attributes with their types, errors with line and name.

use super::{printable, wrong};
use crate::error::{Error, Result};
use roxmltree::{Document, Node};
use std::path::Path;

/// Deepest nesting that is accepted; the standard needs about ten levels, annotations of tools a few more.
const DEPTH: usize = 200;

/// Beginning of the namespaces of system structures; those of FMI have none.
const SSP: &str = "http://ssp-standard.org/SSP";

/// The file that is read.
pub struct Reader<'a> {
    pub path: &'a Path,
    pub file: &'static str,
}

impl Reader<'_> {
    pub fn error(&self, line: u32, element: &str, message: impl Into<String>) -> Error {
        wrong(self.path, self.file, line, element, message.into())
    }

    /// The bytes as text; FMI demands UTF-8.
    pub fn text<'b>(&self, bytes: &'b [u8]) -> Result<&'b str> {
        if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) || bytes.get(1) == Some(&0) {
            return Err(self.error(1, "xml", "is encoded in UTF-16; FMI demands UTF-8"));
        }
        let bytes = bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(bytes);
        std::str::from_utf8(bytes).map_err(|e| {
            let line = 1 + bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count();
            self.error(line as u32, "xml", "is not UTF-8, which FMI demands")
        })
    }

    /// Refuses nesting that would overflow the stack of a recursive parser, by a count of tags.
    pub fn depth(&self, text: &str) -> Result {
        let (mut depth, mut line, mut rest) = (0_usize, 1_u32, text);
        while let Some(at) = rest.find('<') {
            line += rest[..at].bytes().filter(|b| *b == b'\n').count() as u32;
            rest = &rest[at..];
            let end = match rest {
                r if r.starts_with("<!--") => r.find("-->").map(|e| e + 3),
                r if r.starts_with("<![CDATA[") => r.find("]]>").map(|e| e + 3),
                r => tag_end(r),
            };
            let Some(end) = end else { return Ok(()) };
            let tag = &rest[..end];
            if tag.starts_with("</") {
                depth = depth.saturating_sub(1);
            } else if !tag.starts_with("<!") && !tag.starts_with("<?") && !tag.ends_with("/>") {
                depth += 1;
            }
            if depth > DEPTH {
                return Err(self.error(
                    line,
                    "xml",
                    format!("elements are nested deeper than {DEPTH} levels"),
                ));
            }
            line += tag.bytes().filter(|b| *b == b'\n').count() as u32;
            rest = &rest[end..];
        }
        Ok(())
    }
}

/// End of a tag; `>` inside quotes does not count.
fn tag_end(text: &str) -> Option<usize> {
    let mut quote = None;
    for (k, b) in text.bytes().enumerate() {
        match (quote, b) {
            (Some(q), b) if b == q => quote = None,
            (None, b'"' | b'\'') => quote = Some(b),
            (None, b'>') => return Some(k + 1),
            _ => {}
        }
    }
    None
}

/// Counts lines in one pass over the file: of elements in their order.
pub struct LineCounter<'a> {
    text: &'a str,
    at: usize,
    line: u32,
}

impl<'a> LineCounter<'a> {
    /// Of the file of an element.
    pub fn of(element: &Element<'a>) -> Self {
        Self { text: element.document.input_text(), at: 0, line: 1 }
    }

    pub fn line(&mut self, element: &Element) -> u32 {
        let position = element.node.range().start;
        let between = self.text.as_bytes().get(self.at..position).unwrap_or_default();
        self.line += between.iter().filter(|b| **b == b'\n').count() as u32;
        self.at = self.at.max(position);
        self.line
    }
}

/// An element with its file.
#[derive(Clone, Copy)]
pub struct Element<'a> {
    pub reader: &'a Reader<'a>,
    pub document: &'a Document<'a>,
    pub node: Node<'a, 'a>,
}

impl<'a> Element<'a> {
    pub fn name(&self) -> &'a str {
        self.node.tag_name().name()
    }

    pub fn line(&self) -> u32 {
        self.document.text_pos_at(self.node.range().start).row
    }

    #[cold]
    pub fn error(&self, message: impl Into<String>) -> Error {
        self.reader.error(self.line(), self.name(), message)
    }

    #[cold]
    pub fn unsupported(&self, message: impl Into<String>) -> Error {
        Error::Unsupported { path: self.reader.path.into(), message: message.into() }
    }

    /// Child elements of the standards; those of foreign namespaces are not looked at.
    pub fn children(&self) -> impl Iterator<Item = Element<'a>> + use<'a> {
        let (reader, document) = (self.reader, self.document);
        let own = |n: &Node| n.is_element() && n.tag_name().namespace().is_none_or(|n| n.starts_with(SSP));
        self.node.children().filter(own).map(move |node| Element { reader, document, node })
    }

    pub fn child(&self, name: &str) -> Option<Element<'a>> {
        self.children().find(|e| e.name() == name)
    }

    /// An attribute without a namespace.
    pub fn attribute(&self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    /// An attribute, or nothing.
    pub fn text(&self, name: &str) -> &'a str {
        self.attribute(name).unwrap_or_default()
    }

    pub fn required(&self, name: &str) -> Result<&'a str> {
        self.attribute(name).ok_or_else(|| self.error(format!("lacks the attribute `{name}`")))
    }

    pub fn flag(&self, name: &str) -> Result<bool> {
        match self.attribute(name).map(str::trim) {
            None | Some("false" | "0") => Ok(false),
            Some("true" | "1") => Ok(true),
            Some(other) => Err(self.wrong(name, other, "true or false")),
        }
    }

    pub fn optional_number(&self, name: &str) -> Result<Option<f64>> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        number(text).map(Some).ok_or_else(|| self.wrong(name, text, "a number"))
    }

    pub fn whole<T: std::str::FromStr>(&self, name: &str, kind: &str) -> Result<Option<T>> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        text.trim().parse().map(Some).map_err(|_| self.wrong(name, text, kind))
    }

    /// A whole number from 0 to 2^32 − 1 that must be there.
    pub fn reference(&self, name: &str) -> Result<u32> {
        let kind = "a whole number from 0 to 4294967295";
        self.whole(name, kind)?.ok_or_else(|| self.error(format!("lacks the attribute `{name}`")))
    }

    #[cold]
    pub fn wrong(&self, name: &str, text: &str, kind: &str) -> Error {
        self.error(format!("{name} = \"{}\" is not {kind}", printable(text)))
    }
}

/// A number as XML Schema writes it.
pub fn number(text: &str) -> Option<f64> {
    match text.trim() {
        "INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        "NaN" => Some(f64::NAN),
        other => other.parse().ok(),
    }
}
