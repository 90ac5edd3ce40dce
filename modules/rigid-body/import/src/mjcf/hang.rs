//! Joints: how a body hangs from the one above it.

use super::MjcfReader;
use super::defaults::{Defaults, Element};
use crate::error::Error;
use crate::model::{AxisData, Joint, JointKind};
use nalgebra::{Isometry3, Translation3, Unit, Vector3};
use roxmltree::Node;

/// Whether the body of a joint is one of the world's own.
fn is_at_the_top(joint: Node) -> bool {
    let around = joint.parent_element().and_then(|body| body.parent_element());
    around.is_some_and(|n| n.has_tag_name("worldbody"))
}

/// The joint that holds a body without one.
fn fixed(body: &str, parent: Option<usize>, child: usize, frame: Isometry3<f64>) -> Joint {
    Joint {
        name: format!("{body}_fixed"),
        kind: JointKind::Fixed,
        parent,
        child,
        parent_from_joint: frame,
        child_from_joint: Isometry3::identity(),
        axis: Vector3::x_axis(),
        limits: None,
        data: AxisData::default(),
    }
}

/// Forces along the axis of a joint; `unit`: of its coordinate in rad or m.
fn axis_data(d: &Defaults, e: &Element, unit: f64) -> Result<AxisData, Error> {
    let not_negative = |what: &str| Ok(d.not_negative(e, what, "it would drive the joint")?.unwrap_or(0.0));
    Ok(AxisData {
        damping: not_negative("damping")?,
        friction: not_negative("frictionloss")?,
        armature: not_negative("armature")?,
        stiffness: not_negative("stiffness")?,
        reference: unit * d.number(e, "springref")?.unwrap_or(0.0),
        effort: None,
        drive: None,
    })
}

impl MjcfReader<'_, '_> {
    /// Hangs a body on its parent; `frame`: its pose there or in the world.
    pub(super) fn hang(
        &mut self,
        joint: Option<Element>,
        parent: Option<usize>,
        child: usize,
        frame: Isometry3<f64>,
        body: &str,
    ) -> Result<(), Error> {
        let d = self.d;
        let Some(e) = joint else {
            self.robot.joints.push(fixed(body, parent, child, frame));
            return Ok(());
        };
        let kind =
            if e.node.has_tag_name("freejoint") { "free" } else { d.text(&e, "type").unwrap_or("hinge") };
        let kind = match kind {
            "hinge" => JointKind::Revolute,
            "slide" => JointKind::Prismatic,
            "ball" => JointKind::Spherical,
            "free" if is_at_the_top(e.node) && !self.is_one_of_several(e.node) => {
                self.robot.others.push((child, frame));
                return Ok(());
            }
            other => {
                let problem = format!(
                    "type `{other}` cannot be simulated here; hinge, slide, ball and free (alone, on a body of <worldbody> \
                     itself) can"
                );
                return Err(d.wrong(&e, problem));
            }
        };
        self.warn_ignored(e.node, e.class());
        let name = e.node.attribute("name").map_or_else(|| format!("{body}_joint"), str::to_owned);
        let axis = d.vector(&e, "axis")?.unwrap_or_else(Vector3::z);
        let axis = Unit::try_new(axis, 1e-9).ok_or_else(|| d.wrong(&e, "axis has no direction".into()))?;
        let anchor = Isometry3::from(Translation3::from(d.vector(&e, "pos")?.unwrap_or_else(Vector3::zeros)));
        let unit = if kind == JointKind::Revolute { d.angle } else { 1.0 };
        let data = axis_data(d, &e, unit)?;
        let limits = if kind == JointKind::Spherical {
            self.ball(&e)?;
            None
        } else {
            self.limits(&e, unit)?
        };
        self.robot.joints.push(Joint {
            name,
            kind,
            parent,
            child,
            parent_from_joint: frame * anchor,
            child_from_joint: anchor,
            axis,
            limits,
            data,
        });
        Ok(())
    }

    fn is_one_of_several(&self, joint: Node) -> bool {
        let of_body = joint.parent().into_iter().flat_map(|body| body.children());
        of_body.filter(|n| n.has_tag_name("joint") || n.has_tag_name("freejoint")).count() > 1
    }

    /// A ball joint turns freely: its other attributes are reported.
    fn ball(&mut self, e: &Element) -> Result<(), Error> {
        for name in ["range", "damping", "frictionloss", "armature", "stiffness"] {
            if self.d.numbers(e, name)?.is_some_and(|n| n.iter().any(|x| *x != 0.0)) {
                self.warn(
                    e.node,
                    &format!("is a ball and turns freely: `{name}` is not supported and does nothing"),
                );
            }
        }
        Ok(())
    }

    fn limits(&self, e: &Element, unit: f64) -> Result<Option<[f64; 2]>, Error> {
        let range = self.d.numbers(e, "range")?;
        match (self.d.choice(e, "limited", &["true", "false", "auto"])?, range.as_deref()) {
            (Some("false"), _) | (_, None) => Ok(None),
            (None | Some("auto"), _) if !self.d.autolimits => Ok(None),
            (_, Some([lower, upper])) if lower < upper => Ok(Some([unit * lower, unit * upper])),
            (_, Some(other)) => Err(self
                .d
                .wrong(e, format!("range = {other:?} leaves no room; write the smaller number first"))),
        }
    }
}
