//! A law that comes as a module of its own, in use by one soil: calls over nodes, and checks of the answers.
//!
//! A law that fails, or gives an impossible answer, is an error of that call. How long a step the law can answer for is no
//! failure: the smallest of its answers is kept until the end of a trial, see [`PluginLaw::reaches`].

use crate::shear_strength::{YieldAnswer, YieldNodes};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use terraglue_subsystem::{Error, NodeLaw, PressureAnswer, PressureNodes, Result, ShearAnswer, ShearNodes};

struct InUse {
    law: Arc<dyn NodeLaw>,
    h: AtomicU64,
    longest: AtomicU64,
}

/// A law module in the hands of a soil. Copies share the length of the step.
#[derive(Clone)]
pub struct PluginLaw {
    used: Arc<InUse>,
    /// Stiffness of unloading (Pa/m) below which its slopes are known to stay.
    gentle_at: Option<f64>,
}

/// Nodes below one contact, for a law that keeps a state.
#[derive(Clone, Copy, Debug)]
pub struct KeptNodes<'a> {
    /// Depths, m.
    pub depth: &'a [f64],
    /// Depths of the unloaded surface, m.
    pub permanent: &'a [f64],
    /// Accumulated slips, m.
    pub slip: &'a [f64],
    /// Committed state.
    pub state: &'a [f64],
}

impl PluginLaw {
    /// Takes a law into use.
    pub fn new(law: Arc<dyn NodeLaw>) -> Self {
        let (h, longest) = (AtomicU64::new(0), AtomicU64::new(f64::INFINITY.to_bits()));
        let used = Arc::new(InUse { law, h, longest });
        Self { used, gentle_at: None }
    }

    /// The same law, whose slopes are known to stay below `k_u` (Pa/m) beyond the elastic limit.
    pub(crate) fn gentle_at(self, k_u: f64) -> Self {
        Self { gentle_at: Some(k_u), ..self }
    }

    /// Whether its slopes are known to stay below `k_u` (Pa/m) beyond the elastic limit.
    pub(crate) fn is_gentle(&self, k_u: f64) -> bool {
        self.gentle_at == Some(k_u)
    }

    /// Name, for messages.
    pub fn name(&self) -> &str {
        self.used.law.name()
    }

    /// Doubles per node.
    #[inline]
    pub fn state_doubles(&self) -> usize {
        self.used.law.state_doubles()
    }

    /// Whether it has a pressure law.
    pub fn has_pressure(&self) -> bool {
        self.used.law.has_pressure()
    }

    /// Whether it has a shear law.
    pub fn has_shear(&self) -> bool {
        self.used.law.has_shear()
    }

    /// A call of the soil begins that takes a step of `h` (s).
    pub fn begin(&self, h: f64) {
        self.used.h.store(h.to_bits(), Relaxed);
    }

    /// The committed state has changed: the law's limit of the step no longer holds.
    pub fn forget(&self) {
        self.used.longest.store(f64::INFINITY.to_bits(), Relaxed);
    }

    /// Whether the law can answer for the whole step, which starts at `t` (s).
    ///
    /// # Errors
    /// [`Error::Discard`] with the time that it can reach.
    pub fn reaches(&self, t: f64) -> Result {
        let (h, longest) = (self.h(), f64::from_bits(self.used.longest.load(Relaxed)));
        if longest < h { Err(Error::Discard { reached: t + longest.max(0.0) }) } else { Ok(()) }
    }

    #[inline]
    fn h(&self) -> f64 {
        f64::from_bits(self.used.h.load(Relaxed))
    }

    #[inline]
    fn limit(&self, longest: f64) {
        if longest < f64::INFINITY {
            let before = f64::from_bits(self.used.longest.load(Relaxed));
            self.used.longest.store(before.min(longest).to_bits(), Relaxed);
        }
    }

    #[cold]
    fn impossible<T>(&self, what: &str) -> Result<T> {
        Err(Error::Failed(format!("[TG15] the law `{}`: {what}", self.name())))
    }

    /// First loading at one depth by a law without state: pressure, slope.
    #[inline]
    pub(crate) fn at(&self, b: f64, z: f64) -> Result<(f64, f64)> {
        let (mut p, mut slope) = ([0.0], [0.0]);
        self.first_loading(b, &[z], &mut p, &mut slope)?;
        Ok((p[0], slope[0]))
    }

    /// First loading of nodes by a law without state, to look at it: where it has no answer there is NaN.
    pub(crate) fn look(&self, b: f64, depth: &[f64], p: &mut [f64], slope: &mut [f64]) {
        p.fill(f64::NAN);
        slope.fill(f64::NAN);
        let nodes = PressureNodes { b, h: self.h(), depth, ..PressureNodes::default() };
        let (permanent, state) = (&mut [][..], &mut [][..]);
        let mut out = PressureAnswer {
            pressure: &mut *p,
            slope: &mut *slope,
            permanent,
            state,
            longest_s: f64::INFINITY,
        };
        if self.used.law.pressure(&nodes, &mut out).is_err() {
            p.fill(f64::NAN);
        }
    }

    /// First loading of nodes by a law without state.
    #[inline]
    pub(crate) fn first_loading(&self, b: f64, depth: &[f64], p: &mut [f64], slope: &mut [f64]) -> Result {
        let nodes = PressureNodes { b, h: self.h(), depth, ..PressureNodes::default() };
        self.answer(&nodes, p, slope, &mut [], &mut [])
    }

    /// Pressures, slopes, unloaded surfaces and new states by a law with a state.
    ///
    /// # Errors
    /// The law has failed, or given an impossible answer.
    pub fn kept(
        &self,
        b: f64,
        nodes: &KeptNodes,
        [p, slope, permanent]: [&mut [f64]; 3],
        state: &mut [f64],
    ) -> Result {
        let KeptNodes { depth, permanent: unloaded, slip, state: committed } = *nodes;
        let nodes = PressureNodes { b, h: self.h(), depth, permanent: unloaded, slip, state: committed };
        self.answer(&nodes, p, slope, permanent, state)?;
        match permanent.iter().chain(&*state).position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(k) if k < permanent.len() => {
                self.impossible("a depth of the unloaded surface is not a finite number")
            }
            Some(_) => self.impossible("a state is not a finite number"),
        }
    }

    fn answer(
        &self,
        nodes: &PressureNodes,
        p: &mut [f64],
        slope: &mut [f64],
        permanent: &mut [f64],
        state: &mut [f64],
    ) -> Result {
        for out in [&mut *p, &mut *slope, &mut *permanent, &mut *state] {
            out.fill(f64::NAN);
        }
        let mut out = PressureAnswer { pressure: p, slope, permanent, state, longest_s: f64::INFINITY };
        self.used.law.pressure(nodes, &mut out)?;
        self.limit(out.longest_s);
        let good = |(p, slope): (&f64, &f64)| *p >= 0.0 && p.is_finite() && slope.is_finite();
        if p.iter().zip(&*slope).fold(true, |all, one| all & good(one)) {
            return Ok(());
        }
        let k = p.iter().zip(&*slope).position(|one| !good(one)).unwrap_or(0);
        let (z, b) = (nodes.depth[k], nodes.b);
        self.impossible(&format!("pressure {} Pa, slope {} Pa/m at z = {z} m, b = {b} m", p[k], slope[k]))
    }

    /// Yield stresses of nodes with their derivatives by pressure and slip.
    #[inline]
    pub(crate) fn strengths(&self, nodes: &YieldNodes, out: &mut YieldAnswer) -> Result {
        let YieldNodes { pressure, slip, kept } = *nodes;
        let YieldAnswer { stress, by_pressure, by_slip } = out;
        for out in [&mut *stress, &mut *by_pressure, &mut *by_slip] {
            out.fill(f64::NAN);
        }
        let nodes = ShearNodes { h: self.h(), pressure, slip, state: kept };
        let mut out = ShearAnswer { stress, by_pressure, by_slip, longest_s: f64::INFINITY };
        self.used.law.shear(&nodes, &mut out)?;
        self.limit(out.longest_s);
        let ShearAnswer { stress, by_pressure, by_slip, .. } = out;
        let good = |k: usize| {
            stress[k] >= 0.0 && stress[k].is_finite() && by_pressure[k].is_finite() && by_slip[k].is_finite()
        };
        match (0..stress.len()).find(|k| !good(*k)) {
            None => Ok(()),
            Some(k) => self.impossible(&format!(
                "shear stress {} Pa at sigma = {} Pa, j = {} m, derivatives {} and {} Pa/m",
                stress[k], pressure[k], slip[k], by_pressure[k], by_slip[k]
            )),
        }
    }

    /// Yield stress and its derivatives by pressure and slip at one node; `kept` as committed.
    #[inline]
    pub(crate) fn strength(&self, pressure: f64, slip: f64, kept: &[f64]) -> Result<(f64, [f64; 2])> {
        let (mut stress, mut by_p, mut by_slip) = ([0.0], [0.0], [0.0]);
        let mut out = YieldAnswer { stress: &mut stress, by_pressure: &mut by_p, by_slip: &mut by_slip };
        self.strengths(&YieldNodes { pressure: &[pressure], slip: &[slip], kept }, &mut out)?;
        Ok((stress[0], [by_p[0], by_slip[0]]))
    }
}

impl std::fmt::Debug for PluginLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("PluginLaw").field(&self.name()).finish()
    }
}

impl PartialEq for PluginLaw {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.used, &other.used)
    }
}
