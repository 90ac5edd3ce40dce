//! Ports of the step: how impulses there act on the bodies, how the bodies move there, and the compliance G.

use crate::dynamics::Dynamics;
use crate::dynamics::carried::Carried;
use crate::math::{V3, cayley, cayley_shift, cayley_vector};
use crate::motion::Motion;
use terraglue_linear_solver::{Path, Tree};
use terraglue_subsystem::{Port, PortKind, Response};

/// One packed component: a generalised direction on one body.
#[derive(Clone, Copy, Debug)]
struct Component {
    body: usize,
    /// +1 where T acts on the body, −1 where −T does.
    side: f64,
    /// World force and moment about the centre of mass of a unit wrench on the body at the start of the step; also
    /// rates → own motion.
    row: [f64; 6],
    /// Of a force its arm, which turns with the body, at the start of the step; none for moments.
    carried: Option<V3>,
}

impl Component {
    /// A share of a unit as a force that goes with its body; none for moments.
    fn carried(&self, share: f64) -> Option<Carried> {
        let force = share * V3::from_row_slice(&self.row[..3]);
        self.carried.map(|arm| Carried { body: self.body, arm, force })
    }
}

/// Ports of the step with the factor's answer to each component.
#[derive(Default)]
pub(crate) struct Ports {
    components: Vec<Component>,
    /// Components side by side on one body, at most six: the body, the first of them, how many.
    groups: Vec<(usize, usize, usize)>,
    /// Answers of the factor to the components of each group, along their path to the root: six numbers an entry, `stride`
    /// entries a group.
    answers: Vec<f64>,
    stride: usize,
    answer: Vec<f64>,
    g: Vec<f64>,
    scratch: Vec<f64>,
    /// Number of the factorisation that `g` belongs to; 0: none.
    g_of: u64,
}

impl Ports {
    /// Takes over the ports; false when one names a body that does not exist or packs badly.
    pub fn assign(&mut self, ports: &[Port], n: usize, bodies: &[Motion]) -> bool {
        let idle = Component { body: 0, side: 1.0, row: [0.0; 6], carried: None };
        self.components.clear();
        self.components.resize(n, idle);
        self.g_of = 0;
        for port in ports {
            let Some(motion) = bodies.get(port.body as usize).filter(|_| port.range().end <= n) else {
                return false;
            };
            let arm = V3::from(port.origin) - motion.c;
            for (i, c) in port.components() {
                let d = V3::from(port.direction(c));
                let (force, moment) = if c < 3 { (d, arm.cross(&d)) } else { (V3::zeros(), d) };
                let row = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
                let side = f64::from(port.side.signum());
                let carried = (c < 3).then_some(arm);
                self.components[i] = Component { body: port.body as usize, side, row, carried };
            }
        }
        true
    }

    /// Number of packed components.
    pub fn len(&self) -> usize {
        self.components.len()
    }

    /// +1 where T acts on the own body.
    pub fn side(&self, i: usize) -> f64 {
        self.components[i].side
    }

    /// Change of the rate along component i by the impulses of the trial.
    pub fn kick(&self, dynamics: &Dynamics, i: usize) -> f64 {
        let Component { body, row, .. } = &self.components[i];
        dynamics.trial.kick(*body, &dynamics.kkt, &dynamics.start).iter().zip(row).map(|(k, r)| k * r).sum()
    }

    /// dX_r/d(wrench c), as last computed by [`Ports::compliance`].
    pub fn g(&self, r: usize, c: usize) -> f64 {
        self.g[c * self.components.len() + r]
    }

    /// Writes the impulses h·T into the external impulses of a trial; T itself in a step of no length.
    pub fn load(&self, dynamics: &mut Dynamics, t: &[f64]) {
        let per_force = if dynamics.h > 0.0 { dynamics.impulse_per_force() } else { 1.0 };
        dynamics.external.fill(0.0);
        dynamics.carried.clear();
        for (component, t) in self.components.iter().zip(t).filter(|(_, t)| **t != 0.0) {
            let at = dynamics.kkt.body_at[component.body];
            let impulse = per_force * component.side * t;
            let target = &mut dynamics.external[at..at + 6];
            target.iter_mut().zip(&component.row).for_each(|(e, r)| *e += impulse * r);
            if dynamics.integrator.is_second_order() {
                dynamics.carried.extend(component.carried(impulse));
            }
        }
    }

    /// The impulse of a unit of component i on its own body into a load of the system.
    pub fn load_unit(&self, dynamics: &Dynamics, i: usize, load: &mut [f64]) {
        let Component { body, row, .. } = &self.components[i];
        let at = dynamics.kkt.body_at[*body];
        let per_force = dynamics.impulse_per_force();
        let unit = row.map(|r| per_force * r);
        load[at..at + 6].copy_from_slice(&unit);
        if let Some(carried) = self.components[i].carried(per_force) {
            let moment = carried.turned(&dynamics.integrator, &dynamics.trial.turns);
            load[at + 3..at + 6].iter_mut().zip(&moment).for_each(|(l, m)| *l += m);
        }
    }

    /// Answers of the factor to all components.
    fn respond(&mut self, tree: &Tree) {
        self.groups.clear();
        for (i, component) in self.components.iter().enumerate() {
            match self.groups.last_mut() {
                Some((body, _, count)) if *body == component.body && *count < 6 => *count += 1,
                _ => self.groups.push((component.body, i, 1)),
            }
        }
        self.stride = self.groups.iter().map(|(body, ..)| Path::len(tree, *body)).max().unwrap_or(0);
        self.answers.clear();
        self.answers.resize(6 * self.groups.len() * self.stride, 0.0);
        self.answer.resize(self.stride, 0.0);
        for ((body, first, count), all) in
            self.groups.iter().zip(self.answers.chunks_exact_mut(6 * self.stride.max(1)))
        {
            for (lane, component) in self.components[*first..first + count].iter().enumerate() {
                Path::respond(tree, *body, &component.row, &mut self.answer);
                for (entry, y) in all.chunks_exact_mut(6).zip(&self.answer[..Path::len(tree, *body)]) {
                    entry[lane] = *y;
                }
            }
        }
    }

    /// G = dX/d(wrench on itself) = h²·J·K⁻¹·Jᵀ for the current factor, column-major; in a step of no length dA/d(wrench).
    ///
    /// Only along the paths of the bodies to the root: see [`Path`].
    pub fn compliance(&mut self, dynamics: &Dynamics) -> &[f64] {
        let n = self.components.len();
        if self.g_of == dynamics.kkt.factor_count
            && dynamics.contacts.pressing() == 0
            && self.g.len() == n * n
        {
            return &self.g;
        }
        let tree = &dynamics.kkt.solver;
        self.respond(tree);
        self.g.clear();
        self.g.resize(n * n, 0.0);
        let h2 = if dynamics.h > 0.0 { dynamics.h * dynamics.impulse_per_force() } else { 1.0 };
        for (i, (body, first, count)) in self.groups.iter().enumerate() {
            for (k, (other, start, others)) in self.groups[..=i].iter().enumerate() {
                let shared = Path::shared(tree, *body, *other);
                let answers = |group: usize| &self.answers[6 * group * self.stride..];
                let sums = Path::dots(tree, shared, answers(i), answers(k));
                for (r, row) in (*first..).zip(&sums[..*count]) {
                    for (c, sum) in (*start..).zip(&row[..*others]) {
                        self.g[c * n + r] = h2 * sum;
                        self.g[r * n + c] = h2 * sum;
                    }
                }
            }
        }
        self.g_of = dynamics.kkt.factor_count;
        if dynamics.contacts.pressing() > 0 {
            let components = &self.components;
            let rate = |p: usize, v: &[f64]| {
                let at = dynamics.kkt.body_at[components[p].body];
                dynamics.h * components[p].row.iter().zip(&v[at..at + 6]).map(|(r, v)| r * v).sum::<f64>()
            };
            dynamics.contacts.stiffen(
                n,
                &mut self.g,
                (tree, &dynamics.kkt.body_at),
                &rate,
                &mut self.scratch,
            );
            self.g_of = 0;
        }
        &self.g
    }
}

/// Own motion at the ports: committed (X = 0).
pub(crate) fn committed(ports: &[Port], bodies: &[Motion], out: &mut Response) {
    for port in ports {
        let motion = &bodies[port.body as usize];
        let arm = V3::from(port.origin) - motion.c;
        let v = motion.v + motion.w.cross(&arm);
        for (i, c) in port.components() {
            let d = V3::from(port.direction(c));
            out.x[i] = 0.0;
            out.v[i] = if c < 3 { v.dot(&d) } else { motion.w.dot(&d) };
            out.a[i] = 0.0;
            out.t[i] = 0.0;
        }
    }
}

/// Own displacement at the ports at the end of the trial: of the material point at the origin, and rotation. At a contact it is,
/// under a rule of first order, that of the velocities, θ × r without the terms of second order: by as much as the point of a rolling rim rises in the
/// step, its neighbour comes down, and T·X is then the work that the wrench does on the body.
pub(crate) fn displacement(ports: &[Port], dynamics: &Dynamics, x: &mut [f64]) {
    for port in ports {
        let b = port.body as usize;
        let arm = V3::from(port.origin) - dynamics.start.bodies[b].c;
        let mean = &dynamics.trial.solution[dynamics.kkt.body_at[b]..];
        let turn = cayley_vector(&dynamics.trial.turns[b]);
        let linear = port.kind == PortKind::Contact as u32 && !dynamics.integrator.is_second_order();
        let turned = if linear { turn.cross(&arm) } else { cayley_shift(&dynamics.trial.turns[b], &arm) };
        let shift = dynamics.h * V3::new(mean[0], mean[1], mean[2]) + turned;
        for (i, c) in port.components() {
            let d = V3::from(port.direction(c));
            x[i] = if c < 3 { shift.dot(&d) } else { turn.dot(&d) };
        }
    }
}

/// Own displacement, velocity and mean acceleration at the end of the trial.
pub(crate) fn response(ports: &[Port], dynamics: &Dynamics, out: &mut Response) {
    displacement(ports, dynamics, out.x);
    for port in ports {
        let b = port.body as usize;
        let (start, end) = (&dynamics.start.bodies[b], &dynamics.trial.ends[b]);
        let arm = V3::from(port.origin) - start.c;
        let before = start.v + start.w.cross(&arm);
        let after = end.v + end.w.cross(&(cayley(&dynamics.trial.turns[b]) * arm));
        for (i, c) in port.components() {
            let d = V3::from(port.direction(c));
            let (v0, v1) = if c < 3 { (before, after) } else { (start.w, end.w) };
            out.v[i] = v1.dot(&d);
            out.a[i] = (v1 - v0).dot(&d) / dynamics.h;
            if dynamics.integrator.is_second_order() {
                out.a[i] = acceleration(port, dynamics, c);
            }
        }
    }
}

/// Own velocity and acceleration at t after a trial of no length; X = 0.
pub(crate) fn standing(ports: &[Port], dynamics: &Dynamics, out: &mut Response) {
    committed(ports, &dynamics.start.bodies, out);
    for port in ports {
        let b = port.body as usize;
        let (motion, real) = (&dynamics.start.bodies[b], &dynamics.start.accelerations[b].real);
        let arm = V3::from(port.origin) - motion.c;
        for (i, c) in port.components() {
            out.a[i] = along(port, c, real, &motion.w, &arm);
        }
    }
}

/// Acceleration of the material point at the port's origin (angular: of the body) at the end of the trial.
fn acceleration(port: &Port, dynamics: &Dynamics, c: usize) -> f64 {
    let b = port.body as usize;
    let (end, real) = (&dynamics.trial.ends[b], &dynamics.trial.accelerations[b].real);
    let arm = cayley(&dynamics.trial.turns[b]) * (V3::from(port.origin) - dynamics.start.bodies[b].c);
    along(port, c, real, &end.w, &arm)
}

/// Component c of the acceleration of a point at `arm` from the centre of mass (angular: of the body).
fn along(port: &Port, c: usize, real: &[f64; 6], w: &V3, arm: &V3) -> f64 {
    let (linear, angular) = (V3::from_row_slice(&real[..3]), V3::from_row_slice(&real[3..]));
    let d = V3::from(port.direction(c));
    if c < 3 { (linear + angular.cross(arm) + w.cross(&w.cross(arm))).dot(&d) } else { angular.dot(&d) }
}
