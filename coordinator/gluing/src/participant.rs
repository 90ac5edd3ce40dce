//! One subsystem's view of the glue of a group: its own ports, and the way between its packed vectors and the
//! group's.

use terraglue_diagnostics::{Error, Result};
use terraglue_host::{Instance, Progress};
use terraglue_subsystem::{
    Batch, Capabilities, Estimate, Input, Law, Level, Motion, Node, Port, Response, Step,
};

/// Time and number of the present trial.
#[derive(Clone, Copy, Debug)]
pub struct StepContext {
    /// Start of the step, s.
    pub t: f64,
    /// Length, s.
    pub h: f64,
    /// Accepted steps before.
    pub index: u64,
    /// Number of the trial in the step.
    pub trial: u32,
    /// Epoch of the set of ports: another one where a port came, went or changed its mask.
    pub epoch: u32,
}

impl Default for StepContext {
    fn default() -> Self {
        Self { t: 0.0, h: 0.0, index: 0, trial: 0, epoch: 0 }
    }
}

/// One end of a port: which side it is, and the material point in its own subsystem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// +1: T acts on it; −1: −T does.
    pub side: i32,
    /// Body, cell or terminal.
    pub body: u32,
    /// World place of the point at t, m.
    pub origin: [f64; 3],
}

/// A member of a group with its buffers; all are reused from step to step.
#[derive(Debug, Default)]
pub struct Participant {
    /// Index of the instance in the testbed.
    pub slot: usize,
    /// Whether −T acts on it at every port.
    second: bool,
    /// Sign of T on it by own component.
    signs: Vec<f64>,
    ports: Vec<Port>,
    /// Group port of each own port.
    port_index: Vec<usize>,
    /// Group component of each own component.
    index: Vec<usize>,
    laws: Vec<Law>,
    x: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    t: Vec<f64>,
    given_t: Vec<f64>,
    partner_x: Vec<f64>,
    partner_v: Vec<f64>,
    /// T* and the free X of its components of the estimate.
    t_star: Vec<f64>,
    x_free: Vec<f64>,
    matrix: Vec<f64>,
    active: Vec<u8>,
    /// dX, dV and dA/d(wrench on itself) by differences of trials, own n × n, column-major; in use until the next ones.
    differences: [Vec<f64>; 3],
    by_differences: bool,
    /// Wrenches of a batch of trials, one after the other, and its answers.
    batch_t: Vec<f64>,
    batch: [Vec<f64>; 3],
}

impl Participant {
    /// A member without ports yet.
    pub fn new(slot: usize) -> Self {
        Self { slot, ..Self::default() }
    }

    /// Whether −T acts on it at every port: it can be driven by the motion of its partners.
    pub fn is_second(&self) -> bool {
        self.second
    }

    /// Number of own components.
    pub fn n(&self) -> usize {
        self.index.len()
    }

    /// Takes from the group's ports those of this member.
    /// `belongs` answers which side of a port this member is: +1 or −1, with its body and origin there.
    pub fn take_ports(&mut self, group: &[Port], belongs: impl Fn(usize) -> Option<End>) {
        self.ports.clear();
        self.port_index.clear();
        self.index.clear();
        self.signs.clear();
        for (p, port) in group.iter().enumerate() {
            if let Some(End { side, body, origin }) = belongs(p) {
                let first = self.index.len() as u32;
                self.ports.push(Port { side, first, body, origin, ..*port });
                self.signs.extend(port.range().map(|_| f64::from(side)));
                self.port_index.push(p);
                self.index.extend(port.range());
            }
        }
        self.second = !self.ports.is_empty() && self.ports.iter().all(|p| p.side < 0);
        let n = self.n();
        let own = [&mut self.x, &mut self.v, &mut self.a, &mut self.t, &mut self.t_star, &mut self.x_free];
        for buffer in own.into_iter().chain([&mut self.partner_x, &mut self.partner_v]) {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        self.laws.clear();
        self.laws.extend(self.ports.iter().map(|p| p.law));
        self.active.clear();
        self.active.resize(self.ports.len(), 0);
    }

    fn step<'a>(ports: &'a [Port], n: usize, nodes: &'a [Node], at: &StepContext) -> Step<'a> {
        Step { t: at.t, h: at.h, index: at.index, trial: at.trial, n: n as u32, ports, nodes }
    }

    fn gather(own: &mut [f64], index: &[usize], group: &[f64]) {
        for (value, i) in own.iter_mut().zip(index) {
            *value = group[*i];
        }
    }

    fn scatter(own: &[f64], index: &[usize], group: &mut [f64]) {
        for (value, i) in own.iter().zip(index) {
            group[*i] = *value;
        }
    }

    /// Tells the ports; answers with own motion and force, and narrows the group's laws.
    pub fn set_ports(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        group_ports: &mut [Port],
        x: Option<&mut [f64]>,
        force: Option<&mut [f64]>,
    ) -> Result {
        for (own, p) in self.ports.iter_mut().zip(&self.port_index) {
            own.law = group_ports[*p].law;
        }
        self.laws.clear();
        self.laws.extend(self.ports.iter().map(|p| p.law));
        let step = Self::step(&self.ports, self.index.len(), nodes, at);
        let mut now = Response {
            x: &mut self.x,
            v: &mut self.v,
            a: &mut self.a,
            t: &mut self.t,
            reached: at.t,
            flags: 0,
        };
        instance.set_ports(&step, &mut self.laws, &mut now)?;
        for ((own, p), law) in self.ports.iter_mut().zip(&self.port_index).zip(&self.laws) {
            own.law = *law;
            group_ports[*p].law = *law;
        }
        if let Some(x) = x {
            Self::scatter(&self.x, &self.index, x);
        }
        if let Some(force) = force {
            Self::scatter(&self.t, &self.index, force);
        }
        Ok(())
    }

    /// Asks the bodies for T*, x_free and G1.
    pub fn estimate(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        partner: (&[f64], &[f64]),
        out: &mut super::group_estimate::GroupEstimate,
    ) -> Result {
        let n = self.n();
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        Self::gather(&mut self.partner_x, &self.index, partner.0);
        Self::gather(&mut self.partner_v, &self.index, partner.1);
        let step = Self::step(&self.ports, n, nodes, at);
        let mut estimate = Estimate {
            t_star: &mut self.t,
            x_free: &mut self.x,
            g: &mut self.matrix,
            active: &mut self.active,
            unique: true,
        };
        let partner = Motion { x: &self.partner_x, v: &self.partner_v };
        let progress = instance.estimate_forces(&step, &partner, &mut estimate)?;
        complete(instance, "estimate_forces", progress)?;
        out.unique &= estimate.unique;
        Self::scatter(&self.t, &self.index, &mut out.t_star);
        Self::scatter(&self.x, &self.index, &mut out.x_free);
        for (p, active) in self.port_index.iter().zip(&self.active) {
            out.active[*p] = *active;
        }
        self.scatter_matrix(&mut out.g);
        Ok(())
    }

    /// Asks the soil for T1 under the estimate, where it can; else `false`. Where the answer only starts an iteration
    /// (`start`), a soil that finds none in this step leaves T1 as it is.
    pub fn solve_compatibility(
        &mut self,
        start: bool,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        estimate: &super::group_estimate::GroupEstimate,
        [t1, x2]: [&mut [f64]; 2],
    ) -> Result<bool> {
        if !instance.capabilities().has(Capabilities::SOLVE) {
            return Ok(false);
        }
        let n = self.n();
        Self::gather(&mut self.t_star, &self.index, &estimate.t_star);
        Self::gather(&mut self.x_free, &self.index, &estimate.x_free);
        self.gather_matrix(&estimate.g, estimate.t_star.len());
        for (own, p) in self.active.iter_mut().zip(&self.port_index) {
            *own = estimate.active[*p];
        }
        let step = Self::step(&self.ports, n, nodes, at);
        let estimate = Estimate {
            t_star: &mut self.t_star,
            x_free: &mut self.x_free,
            g: &mut self.matrix,
            active: &mut self.active,
            unique: estimate.unique,
        };
        let mut out = Response {
            x: &mut self.x,
            v: &mut self.v,
            a: &mut self.a,
            t: &mut self.t,
            reached: f64::NAN,
            flags: 0,
        };
        let progress = instance.solve_compatibility(&step, &estimate, &mut out)?;
        if start && progress != Progress::Complete {
            return Ok(true);
        }
        complete(instance, "solve_compatibility", progress)?;
        Self::scatter(&self.t, &self.index, t1);
        Self::scatter(&self.x, &self.index, x2);
        Ok(true)
    }

    /// A trial under T (and the partner's motion, where given): own X, V and the wrench at the end.
    pub fn advance_under_force(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        t: &[f64],
        partner: Option<(&[f64], &[f64])>,
        out: Answer,
    ) -> Result {
        self.given_t.clear();
        self.given_t.resize(self.n(), 0.0);
        Self::gather(&mut self.given_t, &self.index, t);
        self.advance(instance, nodes, at, Given::Force { with_motion: partner.is_some() }, partner, out)
    }

    /// A trial of a soil under the bodies' motion.
    pub fn advance_under_motion(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        partner: (&[f64], &[f64]),
        out: Answer,
    ) -> Result {
        self.advance(instance, nodes, at, Given::Motion, Some(partner), out)
    }

    fn advance(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        given: Given,
        partner: Option<(&[f64], &[f64])>,
        out: Answer,
    ) -> Result {
        if let Some((x, v)) = partner {
            Self::gather(&mut self.partner_x, &self.index, x);
            Self::gather(&mut self.partner_v, &self.index, v);
        }
        let motion = Motion { x: &self.partner_x, v: &self.partner_v };
        let input = match given {
            Given::Motion => Input::Motion(motion),
            Given::Force { with_motion } => {
                Input::Force { t: &self.given_t, motion: with_motion.then_some(motion) }
            }
        };
        let step = Self::step(&self.ports, self.index.len(), nodes, at);
        let mut response = Response {
            x: &mut self.x,
            v: &mut self.v,
            a: &mut self.a,
            t: &mut self.t,
            reached: at.t + at.h,
            flags: 0,
        };
        let progress = instance.advance(&step, &input, &mut response)?;
        complete(instance, "advance", progress)?;
        self.answer(out);
        Ok(())
    }

    /// Own motion after the last trial to `first` where T acts on it, to `second` where −T does.
    pub fn motion_by_side(&self, first: [&mut [f64]; 3], second: [&mut [f64]; 3]) {
        for ((own, first), second) in [&self.x, &self.v, &self.a].into_iter().zip(first).zip(second) {
            for ((value, i), sign) in own.iter().zip(&self.index).zip(&self.signs) {
                if *sign > 0.0 { first[*i] = *value } else { second[*i] = *value }
            }
        }
    }

    fn answer(&self, out: Answer) {
        if let Some(x) = out.x {
            Self::scatter(&self.x, &self.index, x);
        }
        if let Some(v) = out.v {
            Self::scatter(&self.v, &self.index, v);
        }
        if let Some(t) = out.t {
            Self::scatter(&self.t, &self.index, t);
        }
    }

    /// The module's own Jacobian at the last trial, into the group's matrix; `false` if it has none.
    pub fn jacobian(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        out: &mut [f64],
    ) -> Result<bool> {
        if !instance.capabilities().has(Capabilities::DERIVATIVES) {
            return Ok(false);
        }
        let n = self.n();
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        let step = Self::step(&self.ports, n, nodes, at);
        instance.interface_jacobian(&step, Level::Position, &mut self.matrix)?;
        self.scatter_matrix(out);
        Ok(true)
    }

    /// Adds the Jacobian at the last trial to d(x1 − x2)/dT of the group: the module's own, or that of
    /// [`Participant::take_differences`].
    pub fn add_compliance(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        level: Level,
        out: &mut [f64],
    ) -> Result {
        let (n, n_group) = (self.n(), out.len().isqrt());
        if !self.by_differences {
            self.matrix.clear();
            self.matrix.resize(n * n, 0.0);
            let step = Self::step(&self.ports, n, nodes, at);
            instance.interface_jacobian(&step, level, &mut self.matrix)?;
        }
        let own = if self.by_differences { &self.differences[level as usize] } else { &self.matrix };
        for (c, column) in own.chunks_exact(n.max(1)).enumerate() {
            for (r, value) in column.iter().enumerate() {
                out[self.index[c] * n_group + self.index[r]] += self.signs[r] * self.signs[c] * value;
            }
        }
        Ok(())
    }

    /// From now on the module's own Jacobian counts.
    pub fn forget_differences(&mut self) {
        self.by_differences = false;
    }

    /// The Jacobian by differences of trials about T, forward from the last trial or central: all columns in one exchange.
    /// The number of trials, each of which is then the instance's last one.
    pub fn take_differences(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        t: &[f64],
        (central, least): (bool, f64),
    ) -> Result<u32> {
        let n = self.n();
        self.given_t.clear();
        self.given_t.resize(n, 0.0);
        Self::gather(&mut self.given_t, &self.index, t);
        let delta = |t: f64| 1e-6 * t.abs().max(least);
        let ways: &[f64] = if central { &[-1.0, 1.0] } else { &[1.0] };
        let width = self.given_t.len();
        let count = width * ways.len();
        self.batch_t.clear();
        for column in 0..width {
            for way in ways {
                let place = self.batch_t.len() + column;
                self.batch_t.extend_from_slice(&self.given_t);
                self.batch_t[place] += way * delta(self.given_t[column]);
            }
        }
        for answers in &mut self.batch {
            answers.clear();
            answers.resize(n * count, 0.0);
        }
        let step = Self::step(&self.ports, n, nodes, at);
        let [x, v, a] = &mut self.batch;
        let mut batch = Batch { x, v, a, t: &mut self.t, reached: at.t + at.h };
        let progress = instance.advance_batch(&step, &self.batch_t, &mut batch)?;
        complete(instance, "advance_batch", progress)?;
        let here = [&self.x, &self.v, &self.a];
        for ((differences, answers), here) in self.differences.iter_mut().zip(&self.batch).zip(here) {
            differences.clear();
            for column in 0..width {
                let of = |k: usize| &answers[(column * ways.len() + k) * n..][..n];
                let (before, after) = if central { (of(0), of(1)) } else { (here.as_slice(), of(0)) };
                let change = ways.len() as f64 * delta(self.given_t[column]) * self.signs[column % n];
                differences.extend(after.iter().zip(before).map(|(new, old)| (new - old) / change));
            }
        }
        self.by_differences = true;
        Ok(count as u32)
    }

    /// dX/d(wrench on itself) of [`Participant::take_differences`] into the group's matrix.
    pub fn differences(&mut self, out: &mut [f64]) {
        self.matrix.clone_from(&self.differences[Level::Position as usize]);
        self.scatter_matrix(out);
    }

    /// Numbers the own ports so that those of one number can be perturbed together: the columns of one component of them all
    /// then cost one trial (Curtis, Powell and Reid 1974). On a soil, whose `nodes` are given, ports meet that share a
    /// ground node, or without nodes a cell; on another body all do. Ports of one number do not meet, nor does a third one
    /// meet two of them. `meets[p·m + q]`: ports p and q of the group's m meet.
    pub fn colours(&self, nodes: Option<&[Node]>, m: usize, meets: &mut [bool], colours: &mut [u32]) {
        for (a, p) in self.ports.iter().zip(&self.port_index) {
            for (b, q) in self.ports.iter().zip(&self.port_index) {
                meets[p * m + q] = p == q || nodes.is_none_or(|nodes| meet(a, b, nodes));
            }
        }
        for p in &self.port_index {
            let near = |q: &usize| self.port_index.iter().any(|k| meets[k * m + p] && meets[k * m + q]);
            let taken = |c: u32| self.port_index.iter().any(|q| colours[*q] == c && near(q));
            colours[*p] = (0..m as u32).find(|c| !taken(*c)).unwrap_or(0);
        }
    }

    /// The last trial becomes the state at t + h.
    pub fn commit(
        &mut self,
        instance: &mut Instance,
        nodes: &[Node],
        at: &StepContext,
        t: &[f64],
        partner: (&[f64], &[f64]),
    ) -> Result {
        Self::gather(&mut self.t, &self.index, t);
        Self::gather(&mut self.partner_x, &self.index, partner.0);
        Self::gather(&mut self.partner_v, &self.index, partner.1);
        let step = Self::step(&self.ports, self.index.len(), nodes, at);
        instance.commit(&step, &self.t, &Motion { x: &self.partner_x, v: &self.partner_v })
    }

    fn scatter_matrix(&self, group: &mut [f64]) {
        let n_group = group.len().isqrt();
        for (own_column, column) in self.matrix.chunks_exact(self.n().max(1)).zip(&self.index) {
            Self::scatter(own_column, &self.index, &mut group[column * n_group..][..n_group]);
        }
    }

    fn gather_matrix(&mut self, group: &[f64], n_group: usize) {
        let n = self.n();
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        for (own_column, column) in self.matrix.chunks_exact_mut(n.max(1)).zip(&self.index) {
            Self::gather(own_column, &self.index, &group[column * n_group..][..n_group]);
        }
    }
}

/// Whether the boxes around the ground nodes of two ports overlap; without nodes, whether they lie in one cell.
fn meet(a: &Port, b: &Port, nodes: &[Node]) -> bool {
    let range = |port: &Port| {
        let none = [i32::MAX, i32::MIN, i32::MAX, i32::MIN];
        port.nodes(nodes)
            .iter()
            .fold(none, |r, n| [r[0].min(n.i), r[1].max(n.i), r[2].min(n.j), r[3].max(n.j)])
    };
    if a.node_count == 0 || b.node_count == 0 {
        return a.body == b.body;
    }
    let (a, b) = (range(a), range(b));
    a[0] <= b[1] && b[0] <= a[1] && a[2] <= b[3] && b[2] <= a[3]
}

/// Glued subsystems go to the end of the step together: one that cannot makes all of them repeat a shorter one.
fn complete(instance: &Instance, function: &'static str, progress: Progress) -> Result {
    match progress {
        Progress::Complete => Ok(()),
        Progress::Early { reached_s } => {
            Err(Error::Early { subsystem: instance.name().to_owned(), function, reached_s })
        }
    }
}

/// Argument of a trial.
#[derive(Clone, Copy)]
enum Given {
    /// The wrench in `given_t`.
    Force { with_motion: bool },
    /// The partner's motion.
    Motion,
}

/// Destination of a trial's answer; packed over the group.
#[derive(Default)]
pub struct Answer<'a> {
    /// X.
    pub x: Option<&'a mut [f64]>,
    /// V.
    pub v: Option<&'a mut [f64]>,
    /// T.
    pub t: Option<&'a mut [f64]>,
}
