//! Attributes of an element: its own, else those of its default class.

use super::include::MergedFile;
use crate::error::Error;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::Node;
use std::collections::BTreeMap;

/// Attributes by element and name.
type Class = BTreeMap<(String, String), String>;

/// The default classes of a file and how it writes angles.
pub(crate) struct Defaults<'a> {
    whole: &'a MergedFile,
    classes: BTreeMap<String, Class>,
    /// rad per unit of angle.
    pub angle: f64,
    eulerseq: String,
    /// Whether a range alone makes a limit.
    pub autolimits: bool,
    /// Whether geoms weigh although there is an `<inertial>`.
    pub weigh_geoms: bool,
}

/// An element with the class that it takes defaults from.
#[derive(Clone, Copy)]
pub(crate) struct Element<'a, 'i> {
    pub node: Node<'a, 'i>,
    class: Option<&'a str>,
}

impl<'a, 'i> Element<'a, 'i> {
    /// The class that it takes defaults from.
    pub fn class(&self) -> Option<&'a str> {
        self.class
    }

    /// The same with another class.
    pub fn inheriting(self, class: Option<&'a str>) -> Self {
        Self { class, ..self }
    }
}

impl<'a> Defaults<'a> {
    pub fn new(whole: &'a MergedFile, root: Node) -> Result<Self, Error> {
        // of several the last one counts
        let compilers = || root.children().filter(|n| n.has_tag_name("compiler"));
        let text = |name: &str| compilers().filter_map(|c| c.attribute(name).map(str::to_owned)).next_back();
        let angle =
            if text("angle").as_deref() == Some("radian") { 1.0 } else { std::f64::consts::PI / 180.0 };
        let eulerseq = text("eulerseq").unwrap_or_else(|| "xyz".into());
        let autolimits = text("autolimits").as_deref() != Some("false");
        let weigh_geoms = text("inertiafromgeom").as_deref() == Some("true");
        let mut me = Self { whole, classes: BTreeMap::new(), angle, eulerseq, autolimits, weigh_geoms };
        compilers().try_for_each(|c| me.check_compiler(c))?;
        for node in root.children().filter(|n| n.has_tag_name("default")) {
            // a further section extends the earlier ones
            let before = me.classes.get("main").cloned().unwrap_or_default();
            let name = node.attribute("class").unwrap_or("main");
            me.read(node, &before, name)?;
            let main = me.classes.get(name).cloned().unwrap_or_default();
            me.classes.insert("main".into(), main);
        }
        Ok(me)
    }

    /// Refuses words that choose nothing.
    fn check_compiler(&self, node: Node) -> Result<(), Error> {
        let e = self.element(node, None);
        self.choice(&e, "angle", &["degree", "radian"])?;
        for switch in ["autolimits", "strippath"] {
            self.choice(&e, switch, &["true", "false"])?;
        }
        self.choice(&e, "inertiafromgeom", &["true", "false", "auto"])?;
        match node.attribute("eulerseq") {
            Some(seq) if seq.len() != 3 || !seq.chars().all(|c| "xyzXYZ".contains(c)) => {
                Err(self.wrong(&e, format!("eulerseq = \"{seq}\" is not three of the letters x y z X Y Z")))
            }
            _ => Ok(()),
        }
    }

    fn read(&mut self, node: Node, above: &Class, otherwise: &str) -> Result<(), Error> {
        let mut class = above.clone();
        for element in node.children().filter(|n| n.is_element() && !n.has_tag_name("default")) {
            for a in element.attributes() {
                class.insert((element.tag_name().name().into(), a.name().into()), a.value().into());
            }
        }
        for below in node.children().filter(|n| n.has_tag_name("default")) {
            let name = below.attribute("class").unwrap_or_default();
            if name.is_empty() || self.classes.contains_key(name) {
                let problem =
                    format!("class = \"{name}\" is empty or used twice; names of classes are unique");
                return Err(self.wrong(&self.element(below, None), problem));
            }
            self.read(below, &class, "")?;
        }
        self.classes.insert(node.attribute("class").unwrap_or(otherwise).into(), class);
        Ok(())
    }

    /// Whether a default class has this name; `main` is always there.
    pub fn has_class(&self, name: &str) -> bool {
        name == "main" || self.classes.contains_key(name)
    }

    /// Names of all default classes.
    pub fn class_names(&self) -> impl Iterator<Item = &str> {
        self.classes.keys().map(String::as_str)
    }

    /// An element with its class; `inherited`: the `childclass` of the bodies around it.
    pub fn element<'n, 'i>(&self, node: Node<'n, 'i>, inherited: Option<&'n str>) -> Element<'n, 'i> {
        Element { node, class: node.attribute("class").or(inherited) }
    }

    /// Text of an attribute.
    pub fn text<'e>(&'e self, e: &'e Element, name: &str) -> Option<&'e str> {
        e.node.attribute(name).or_else(|| {
            let class = self.classes.get(e.class.unwrap_or("main"))?;
            tags(e).find_map(|tag| class.get(&(tag.into(), name.into()))).map(String::as_str)
        })
    }

    /// All attributes of an element, its own first.
    pub fn attributes(&self, e: &Element) -> Vec<(String, String)> {
        let own = e.node.attributes().map(|a| (a.name().to_owned(), a.value().to_owned()));
        let mut all: Vec<_> = own.collect();
        let class = self.classes.get(e.class.unwrap_or("main"));
        for ((tag, name), value) in class.into_iter().flatten() {
            if tags(e).any(|t| t == tag) && !all.iter().any(|(n, _)| n == name) {
                all.push((name.clone(), value.clone()));
            }
        }
        all
    }

    /// One of some words; none where it is not there.
    pub fn choice(
        &self,
        e: &Element,
        name: &str,
        words: &[&'static str],
    ) -> Result<Option<&'static str>, Error> {
        let Some(text) = self.text(e, name) else { return Ok(None) };
        let found = words.iter().find(|w| **w == text).copied();
        let wrong = || self.wrong(e, format!("{name} = \"{text}\" is none of {}", words.join(", ")));
        found.ok_or_else(wrong).map(Some)
    }

    /// Numbers of an attribute; none where it is not there.
    pub fn numbers(&self, e: &Element, name: &str) -> Result<Option<Vec<f64>>, Error> {
        let Some(text) = self.text(e, name) else { return Ok(None) };
        let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse::<f64>).collect();
        match numbers {
            Ok(n) if !n.is_empty() => Ok(Some(n)),
            _ => Err(self.wrong(e, format!("{name} = \"{text}\" is not a list of numbers"))),
        }
    }

    /// A number.
    pub fn number(&self, e: &Element, name: &str) -> Result<Option<f64>, Error> {
        match self.numbers(e, name)?.as_deref() {
            None => Ok(None),
            Some([number]) => Ok(Some(*number)),
            Some(other) => Err(self.wrong(e, format!("{name} has {} numbers; one is needed", other.len()))),
        }
    }

    /// A number that is not negative; `why` is the effect of a negative one.
    pub fn not_negative(&self, e: &Element, name: &str, why: &str) -> Result<Option<f64>, Error> {
        match self.number(e, name)? {
            Some(x) if x < 0.0 => Err(self.wrong(e, format!("{name} = {x} is negative: {why}"))),
            other => Ok(other),
        }
    }

    /// A whole number from 0 to `most`.
    pub fn count(&self, e: &Element, name: &str, most: u32) -> Result<Option<u32>, Error> {
        match self.number(e, name)? {
            None => Ok(None),
            Some(x) if x.fract() == 0.0 && (0.0..=f64::from(most)).contains(&x) => Ok(Some(x as u32)),
            Some(x) => Err(self.wrong(e, format!("{name} = {x} is not a whole number from 0 to {most}"))),
        }
    }

    /// The first of several numbers, where the others have no effect here.
    pub fn first(&self, e: &Element, name: &str) -> Result<Option<f64>, Error> {
        Ok(self.numbers(e, name)?.map(|n| n[0]))
    }

    /// Three numbers.
    pub fn vector(&self, e: &Element, name: &str) -> Result<Option<Vector3<f64>>, Error> {
        match self.numbers(e, name)?.as_deref() {
            None => Ok(None),
            Some([x, y, z]) => Ok(Some(Vector3::new(*x, *y, *z))),
            Some(other) => {
                Err(self.wrong(e, format!("{name} has {} numbers; three are needed", other.len())))
            }
        }
    }

    /// `pos` with one of `quat`, `axisangle`, `euler`, `xyaxes`, `zaxis`.
    pub fn pose(&self, e: &Element) -> Result<Isometry3<f64>, Error> {
        let place = self.vector(e, "pos")?.unwrap_or_else(Vector3::zeros);
        Ok(Isometry3::from_parts(Translation3::from(place), self.rotation(e)?))
    }

    fn rotation(&self, e: &Element) -> Result<UnitQuaternion<f64>, Error> {
        let count = |name: &str, n: usize, v: Vec<f64>| match v.len() == n {
            true => Ok(v),
            false => Err(self.wrong(e, format!("{name} has {} numbers; {n} are needed", v.len()))),
        };
        let along = |v: &[f64], name: &str| {
            Unit::try_new(Vector3::new(v[0], v[1], v[2]), 1e-9)
                .ok_or_else(|| self.wrong(e, format!("{name} has no direction")))
        };
        if let Some(q) = self.numbers(e, "quat")? {
            let q = count("quat", 4, q)?;
            let q = nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
            return UnitQuaternion::try_new(q, 1e-9).ok_or_else(|| self.wrong(e, "quat is 0".into()));
        }
        if let Some(v) = self.numbers(e, "axisangle")? {
            let v = count("axisangle", 4, v)?;
            return Ok(UnitQuaternion::from_axis_angle(&along(&v, "axisangle")?, self.angle * v[3]));
        }
        if let Some(v) = self.numbers(e, "euler")? {
            return Ok(self.euler(&count("euler", 3, v)?));
        }
        if let Some(v) = self.numbers(e, "xyaxes")? {
            let v = count("xyaxes", 6, v)?;
            let x = along(&v, "xyaxes")?;
            let y = Vector3::new(v[3], v[4], v[5]);
            let y = along((y - *x * x.dot(&y)).as_slice(), "xyaxes")?;
            let m = Matrix3::from_columns(&[*x, *y, x.cross(&y)]);
            return Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(m)));
        }
        if let Some(v) = self.numbers(e, "zaxis")? {
            return Ok(from_z(&along(&count("zaxis", 3, v)?, "zaxis")?));
        }
        Ok(UnitQuaternion::identity())
    }

    /// Lower-case letters turn about the axes that turn along, capitals about those that stay.
    fn euler(&self, angles: &[f64]) -> UnitQuaternion<f64> {
        let mut q = UnitQuaternion::identity();
        for (axis, angle) in self.eulerseq.chars().zip(angles) {
            let about = match axis.to_ascii_lowercase() {
                'x' => Vector3::x_axis(),
                'y' => Vector3::y_axis(),
                _ => Vector3::z_axis(),
            };
            let turn = UnitQuaternion::from_axis_angle(&about, self.angle * angle);
            q = if axis.is_ascii_lowercase() { q * turn } else { turn * q };
        }
        q
    }

    /// File and line of an element.
    pub fn place(&self, node: Node) -> (&str, usize) {
        self.whole.place(node.range().start)
    }

    /// Error of an element.
    pub fn wrong(&self, e: &Element, problem: String) -> Error {
        let name = e.node.attribute("name").map(|n| format!(" `{n}`")).unwrap_or_default();
        let (file, line) = self.place(e.node);
        Error::Element {
            file: file.into(),
            line,
            element: format!("{}{name}", e.node.tag_name().name()),
            problem,
        }
    }
}

/// The names of an element in a default class: all actuators are also `<general>`.
fn tags<'n>(e: &Element<'n, '_>) -> impl Iterator<Item = &'n str> + use<'n> {
    let tag = e.node.tag_name().name();
    let general = ["position", "velocity", "motor"].contains(&tag).then_some("general");
    std::iter::once(tag).chain(general)
}

/// A rotation that takes z to a direction.
pub(crate) fn from_z(z: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), z)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}
