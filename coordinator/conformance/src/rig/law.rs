//! A law alone: its functions called as a soil calls them, with marks around every array.

use crate::finding::{Stop, Verdict};
use crate::lab::Lab;
use std::sync::Arc;
use terraglue_host::law::open;
use terraglue_subsystem::{
    Config, Error, NodeLaw, PressureAnswer, PressureNodes, Schema, ShearAnswer, ShearNodes,
};

/// Stiffness of unloading above which a law is looked at, Pa/m: stiffer than soft ground anywhere.
const UNLOADING_PA_M: f64 = 4e8;

/// Doubles before and after every array that must stay as they are.
const MARGIN: usize = 8;
const MARK: f64 = -7.25e77;

/// The functions of the law under test.
pub struct LawBench {
    law: Arc<dyn NodeLaw>,
    schema: Schema,
    config: Config,
}

/// An array between marks.
struct Marked(Vec<f64>);

impl Marked {
    fn new(values: &[f64]) -> Self {
        let margin = [MARK; MARGIN];
        Self([&margin[..], values, &margin[..]].concat())
    }

    fn empty(n: usize) -> Self {
        Self::new(&vec![f64::NAN; n])
    }

    fn values(&self) -> &[f64] {
        &self.0[MARGIN..self.0.len() - MARGIN]
    }

    fn values_mut(&mut self) -> &mut [f64] {
        let end = self.0.len() - MARGIN;
        &mut self.0[MARGIN..end]
    }

    fn margins_stand(&self) -> bool {
        let end = self.0.len() - MARGIN;
        self.0[..MARGIN].iter().chain(&self.0[end..]).all(|x| *x == MARK)
    }
}

/// What goes in with a node beside its depth.
#[derive(Clone, Default)]
struct Given {
    permanent: Vec<f64>,
    slip: Vec<f64>,
    state: Vec<f64>,
}

/// What comes out.
struct Pressed {
    pressure: Vec<f64>,
    slope: Vec<f64>,
    permanent: Vec<f64>,
    state: Vec<f64>,
}

impl LawBench {
    /// The law with usual numbers.
    ///
    /// # Errors
    /// A finding: it cannot be had.
    pub fn open(lab: &Lab) -> Verdict<Self> {
        let module = lab.own_module()?;
        let config = lab.config(module.schema()).with_defaults(module.schema());
        let law = open(&module, &config, "checked", &lab.services())
            .map_err(|why| Stop::fail("loading", "numbers of the check", why, "a law that can be called"))?;
        Ok(Self { law, schema: module.schema().clone(), config })
    }

    /// Doubles per node.
    pub fn doubles(&self) -> usize {
        self.law.state_doubles()
    }

    /// Whether it has a pressure function.
    pub fn has_pressure(&self) -> bool {
        self.law.has_pressure()
    }

    /// Whether it has a shear function.
    pub fn has_shear(&self) -> bool {
        self.law.has_shear()
    }

    /// One of its numbers, if it has it.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.schema.parameters.iter().find(|p| p.name == name)?;
        self.config.get(name)?.as_f64()
    }

    /// Pressures and slopes of nodes that were never pressed; empty without a pressure function.
    ///
    /// # Errors
    /// A finding.
    pub fn press(&mut self, b: f64, h: f64, depth: &[f64]) -> Verdict<(Vec<f64>, Vec<f64>)> {
        if !self.law.has_pressure() {
            return Ok((Vec::new(), Vec::new()));
        }
        let kept = if self.doubles() > 0 { depth.len() } else { 0 };
        let given = Given {
            permanent: vec![0.0; kept],
            slip: vec![0.0; kept],
            state: vec![0.0; depth.len() * self.doubles()],
        };
        let out = self.pressed(b, h, depth, &given)?;
        Ok((out.pressure, out.slope))
    }

    fn pressed(&mut self, b: f64, h: f64, depth: &[f64], given: &Given) -> Verdict<Pressed> {
        let (n, doubles) = (depth.len(), self.doubles());
        let kept = if doubles > 0 { n } else { 0 };
        let ins = [depth, &given.permanent, &given.slip, &given.state].map(Marked::new);
        let [mut pressure, mut slope] = [Marked::empty(n), Marked::empty(n)];
        let [mut permanent, mut state] = [Marked::empty(kept), Marked::empty(n * doubles)];
        let nodes = PressureNodes {
            b,
            h,
            depth: ins[0].values(),
            permanent: ins[1].values(),
            slip: ins[2].values(),
            state: ins[3].values(),
        };
        let mut out = PressureAnswer {
            pressure: pressure.values_mut(),
            slope: slope.values_mut(),
            permanent: permanent.values_mut(),
            state: state.values_mut(),
            longest_s: f64::INFINITY,
        };
        let done = self.law.pressure(&nodes, &mut out);
        let text = format!("{n} nodes, b = {b} m, h = {h} s");
        answered("pressure", &text, done)?;
        let same = ins.iter().zip([depth, &given.permanent, &given.slip, &given.state]);
        unwritten("pressure", &text, same)?;
        let outs = [(&pressure, "pressure"), (&slope, "slope"), (&permanent, "permanent"), (&state, "state")];
        written("pressure", &text, &outs, doubles)?;
        let [pressure, slope, permanent, state] =
            [pressure, slope, permanent, state].map(|marked| marked.values().to_vec());
        Ok(Pressed { pressure, slope, permanent, state })
    }

    /// Yield stresses and their derivatives by pressure and slip; empty without a shear function.
    ///
    /// # Errors
    /// A finding.
    pub fn drag(&mut self, pressure: &[f64], slip: f64) -> Verdict<[Vec<f64>; 3]> {
        if !self.law.has_shear() {
            return Ok([const { Vec::new() }; 3]);
        }
        let n = pressure.len();
        let (slips, state) = (vec![slip; n], vec![0.0; n * self.doubles()]);
        let ins = [pressure, &slips, &state].map(Marked::new);
        let [mut stress, mut by_pressure, mut by_slip] = [0; 3].map(|_| Marked::empty(n));
        let nodes =
            ShearNodes { h: 1e-3, pressure: ins[0].values(), slip: ins[1].values(), state: ins[2].values() };
        let mut out = ShearAnswer {
            stress: stress.values_mut(),
            by_pressure: by_pressure.values_mut(),
            by_slip: by_slip.values_mut(),
            longest_s: f64::INFINITY,
        };
        let done = self.law.shear(&nodes, &mut out);
        let text = format!("{n} nodes, j = {slip} m");
        answered("shear", &text, done)?;
        unwritten("shear", &text, ins.iter().zip([pressure, &slips, &state]))?;
        written(
            "shear",
            &text,
            &[(&stress, "stress"), (&by_pressure, "by_pressure"), (&by_slip, "by_slip")],
            0,
        )?;
        Ok([stress, by_pressure, by_slip].map(|marked| marked.values().to_vec()))
    }

    /// A node of untouched ground.
    pub fn node(&self) -> Node {
        Node { state: vec![0.0; self.doubles()], permanent: 0.0, last: 0.0, z_max: 0.0, p_max: 0.0 }
    }
}

fn answered<T>(function: &'static str, given: &str, done: Result<T, Error>) -> Verdict<T> {
    done.map_err(|e| Stop::fail(function, given, e.to_string(), "TG_OK"))
}

fn unwritten<'a>(
    function: &'static str,
    given: &str,
    arrays: impl Iterator<Item = (&'a Marked, &'a [f64])>,
) -> Verdict {
    for (after, before) in arrays {
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        if !(after.margins_stand() && after.values().iter().zip(before).all(same)) {
            return Err(Stop::fail(
                function,
                given,
                "it wrote into what it was given",
                "read only: the host owns it",
            ));
        }
    }
    Ok(())
}

fn written(function: &'static str, given: &str, arrays: &[(&Marked, &str)], doubles: usize) -> Verdict {
    for (array, name) in arrays {
        if !array.margins_stand() {
            return Err(Stop::fail(
                function,
                given,
                format!("it wrote beyond the end of `{name}`"),
                "n entries",
            ));
        }
        if let Some(k) = array.values().iter().position(|x| !x.is_finite()) {
            let node = if *name == "state" { k / doubles.max(1) } else { k };
            let got = format!(
                "`{name}` of node {node} is {}, which was there before or is no number",
                array.values()[k]
            );
            return Err(Stop::fail(function, given, got, "a finite number in every place"));
        }
    }
    Ok(())
}

/// A node with its history, as a soil would keep it.
pub struct Node {
    /// What the law keeps.
    pub state: Vec<f64>,
    /// Depth of the unloaded surface, m.
    pub permanent: f64,
    /// Depth of the last step, m.
    pub last: f64,
    z_max: f64,
    p_max: f64,
}

impl Node {
    /// Pressure and slope at a depth, as a trial.
    ///
    /// # Errors
    /// A finding.
    pub fn at(&self, law: &mut LawBench, b: f64, depth: f64) -> Verdict<(f64, f64)> {
        if law.doubles() > 0 {
            let out = law.pressed(b, 1e-3, &[depth], &self.given())?;
            return Ok((out.pressure[0], out.slope[0]));
        }
        // as soils do: elastic below the largest depth, and nowhere stiffer in first loading than in unloading
        let elastic = self.p_max + UNLOADING_PA_M * (depth - self.z_max);
        if depth <= self.z_max {
            return Ok(if elastic > 0.0 { (elastic, UNLOADING_PA_M) } else { (0.0, 0.0) });
        }
        let (p, slope) = law.press(b, 1e-3, &[depth])?;
        let own = p.first().copied().zip(slope.first().copied()).filter(|(p, _)| *p < elastic);
        Ok(own.unwrap_or((elastic, UNLOADING_PA_M)))
    }

    fn given(&self) -> Given {
        Given { permanent: vec![self.permanent], slip: vec![0.0], state: self.state.clone() }
    }

    /// Goes there in a millisecond; the pressure there.
    ///
    /// # Errors
    /// A finding.
    pub fn commit(&mut self, law: &mut LawBench, b: f64, depth: f64) -> Verdict<f64> {
        self.commit_in(law, b, depth, 1e-3)
    }

    /// The same in `h` seconds.
    ///
    /// # Errors
    /// A finding.
    pub fn commit_in(&mut self, law: &mut LawBench, b: f64, depth: f64, h: f64) -> Verdict<f64> {
        if law.doubles() > 0 {
            let out = law.pressed(b, h, &[depth], &self.given())?;
            if out.pressure[0] > 0.0 {
                (self.state, self.permanent) = (out.state, out.permanent[0]);
            }
            return Ok(out.pressure[0]);
        }
        let (p, _) = self.at(law, b, depth)?;
        if depth > self.z_max {
            (self.z_max, self.p_max) = (depth, p);
        }
        Ok(p)
    }
}
