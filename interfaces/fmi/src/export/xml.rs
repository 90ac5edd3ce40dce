//! Writes elements and attributes as text.

use std::fmt::{Display, Write};

/// Text of an XML document that grows.
#[derive(Debug, Default)]
pub struct Xml {
    text: String,
    depth: usize,
}

impl Xml {
    pub fn new() -> Self {
        Self { text: "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".into(), depth: 0 }
    }

    fn start(&mut self, name: &str, attributes: &[(&str, &dyn Display)], end: &str) {
        self.text.extend(std::iter::repeat_n("  ", self.depth));
        self.text.push('<');
        self.text.push_str(name);
        for (key, value) in attributes {
            let value = escaped(&value.to_string());
            // writing to a String does not fail
            let _ = write!(self.text, " {key}=\"{value}\"");
        }
        self.text.push_str(end);
    }

    /// An element without content.
    pub fn leaf(&mut self, name: &str, attributes: &[(&str, &dyn Display)]) {
        self.start(name, attributes, "/>\n");
    }

    /// Opens an element.
    pub fn open(&mut self, name: &str, attributes: &[(&str, &dyn Display)]) {
        self.start(name, attributes, ">\n");
        self.depth += 1;
    }

    /// Closes the element that was opened last.
    pub fn close(&mut self, name: &str) {
        self.depth -= 1;
        self.text.extend(std::iter::repeat_n("  ", self.depth));
        self.text.push_str("</");
        self.text.push_str(name);
        self.text.push_str(">\n");
    }

    pub fn finish(self) -> String {
        self.text
    }
}

/// Text escaped for an attribute.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => {
                let _ = write!(out, "&#{};", u32::from(c));
            }
            c if c < ' ' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}
