//! The page around a report: head, sections, data, scripts.

use crate::report::figure::{Figure, Times};
use crate::report::html::{escape, number};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use terraglue_page::{REPORT_MODULES, import_map, text};

/// A page under construction.
pub struct Page {
    title: String,
    class: &'static str,
    header: String,
    body: String,
    contents: Vec<(String, String)>,
    figures: Vec<Value>,
    events: Vec<Value>,
    data: Map<String, Value>,
    times: Times,
}

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Self {
        Self {
            title: title.into(),
            class: "",
            header: String::new(),
            body: String::new(),
            contents: Vec::new(),
            figures: Vec::new(),
            events: Vec::new(),
            data: Map::new(),
            times: Times::default(),
        }
    }

    /// An empty page for a table with many columns.
    pub fn wide(title: &str) -> Self {
        Self { class: " class=\"broad\"", ..Self::new(title) }
    }

    /// HTML below the title.
    pub fn header(&mut self, html: &str) {
        self.header.push_str(html);
    }

    /// A section with a heading.
    pub fn section(&mut self, title: &str, id: &str, html: &str) {
        self.contents.push((id.into(), title.into()));
        let _ = write!(self.body, "<section id=\"{id}\"><h2>{}</h2>\n{html}\n</section>\n", escape(title));
    }

    /// A section with plots.
    pub fn figure(&mut self, figure: Figure) {
        let mut html = format!("<p class=\"note\">{}</p>", escape(&figure.note));
        if figure.choices.len() > 1 {
            let _ = write!(html, "<label class=\"choose\">show <select data-choose=\"{}\">", figure.id);
            for (k, name) in figure.choices.iter().enumerate() {
                let selected = if k == figure.chosen { " selected" } else { "" };
                let _ = write!(html, "<option value=\"{k}\"{selected}>{}</option>", escape(name));
            }
            html.push_str("</select></label>");
        }
        let _ = write!(html, "<div class=\"plots\" data-figure=\"{}\"></div>", figure.id);
        self.section(&figure.title, figure.id, &html);
        self.figures.push(figure.json(&mut self.times));
    }

    /// Events: markers in all plots and a list.
    pub fn events(&mut self, events: &[(f64, &str)]) {
        if events.is_empty() {
            return;
        }
        let mut html = String::from(
            "<div class=\"scroll\"><table class=\"events\"><thead><tr><th></th><th>time (s)</th><th>what</th></tr></thead><tbody>",
        );
        for (k, (t_s, what)) in events.iter().enumerate() {
            let _ = write!(
                html,
                "<tr><td><span class=\"flag\">{}</span></td><td class=\"num\">{}</td><td><code>{}</code></td></tr>",
                k + 1,
                number(*t_s, 6),
                escape(what)
            );
        }
        html.push_str("</tbody></table></div>");
        self.section("Events", "events", &html);
        self.events.extend(events.iter().map(|(t, what)| json!({ "t": t, "what": what })));
    }

    /// Data that a script finds under `name`.
    pub fn data(&mut self, name: &str, value: Value) {
        self.data.insert(name.into(), value);
    }

    /// The whole page.
    pub fn finish(mut self) -> String {
        self.data.insert("times".into(), self.times.json());
        self.data.insert("figures".into(), Value::Array(self.figures));
        self.data.insert("events".into(), Value::Array(self.events));
        // "</" would end the script element.
        let data = Value::Object(self.data).to_string().replace("</", "<\\/");
        let title = escape(&self.title);
        let mut contents = String::new();
        for (id, name) in &self.contents {
            let _ = write!(contents, "<a href=\"#{id}\">{}</a>", escape(name));
        }
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title} · Terraglue</title>\n<style>\n{style}</style>\n<script>\n{theme}</script>\n\
             <script type=\"importmap\">{modules}</script>\n</head>\n<body{class}>\n\
             <header class=\"top\"><div class=\"bar\"><span class=\"brand\">Terraglue</span><nav>{contents}</nav>\
             <button type=\"button\" id=\"theme\" aria-label=\"switch between light and dark\">◐</button></div></header>\n\
             <main>\n<h1>{title}</h1>\n{header}\n{body}</main>\n\
             <footer>Made by Terraglue from the recording beside this file. All quantities in SI units; z is up.</footer>\n\
             <script type=\"application/json\" id=\"data\">{data}</script>\n\
             <script type=\"module\">import \"terraglue/report.js\";</script>\n</body>\n</html>\n",
            style = [text("page.css"), text("view.css")].concat(),
            theme = text("theme.js"),
            modules = import_map(REPORT_MODULES),
            class = self.class,
            header = self.header,
            body = self.body,
        )
    }
}
