//! Where feet pressed: contact spells of every port that carried a normal force.

use crate::recording::reader::Recording;

/// Shorter breaks of contact than this do not end a footprint, s.
const BREAK_S: f64 = 0.05;
/// A foot that has moved further than this leaves a new print, m.
const APART_M: f64 = 0.03;

/// A body that stood on the ground at some time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Leg {
    pub subsystem: String,
    pub body: String,
    /// Sum of the normal forces of its ports at every time of `/gluing`, N.
    pub normal_n: Vec<f64>,
    pub prints: Vec<Print>,
}

/// One spell of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Print {
    /// Place of the largest force, m.
    pub at: [f64; 2],
    pub from_s: f64,
    pub to_s: f64,
    pub largest_n: f64,
}

/// All bodies that carried load, in order of their names.
pub(crate) fn legs(recording: &Recording) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::new();
    for (row, record) in recording.gluing.iter().enumerate() {
        for port in &record.ports {
            let normal = port.wrench.first().copied().unwrap_or(0.0);
            let same = |l: &Leg| l.body == port.body && l.subsystem == port.subsystem;
            let k = legs.iter().position(same).unwrap_or_else(|| {
                let (subsystem, body) = (port.subsystem.clone(), port.body.clone());
                legs.push(Leg {
                    subsystem,
                    body,
                    normal_n: vec![0.0; recording.gluing.len()],
                    prints: Vec::new(),
                });
                legs.len() - 1
            });
            legs[k].normal_n[row] += normal;
            if normal > 0.0 {
                legs[k].press([port.origin.x, port.origin.y], record.t, normal);
            }
        }
    }
    legs.retain(|l| !l.prints.is_empty());
    legs.sort_by(|a, b| (&a.subsystem, &a.body).cmp(&(&b.subsystem, &b.body)));
    legs
}

impl Leg {
    fn press(&mut self, at: [f64; 2], t_s: f64, normal_n: f64) {
        if let Some(last) = self.prints.last_mut() {
            let moved = (at[0] - last.at[0]).hypot(at[1] - last.at[1]);
            if t_s - last.to_s <= BREAK_S && moved <= APART_M {
                last.to_s = t_s;
                if normal_n > last.largest_n {
                    (last.at, last.largest_n) = (at, normal_n);
                }
                return;
            }
        }
        self.prints.push(Print { at, from_s: t_s, to_s: t_s, largest_n: normal_n });
    }
}
