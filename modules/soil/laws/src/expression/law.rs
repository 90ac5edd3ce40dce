//! The laws of a soil as written in a scenario: read, checked, and turned into programs.

use super::build::{Binding, Builder};
use super::dimension::{self, PRESSURE};
use super::error::ExpressionError;
use super::parse::Tree;
use super::program::Program;
use super::range;
use super::symbol::{Role, Symbol};
use crate::build_up::{FULL_SLIP, built_up, cohesion_and_friction};
use crate::first_loading::FirstLoading;
use crate::inverse;
use crate::parameters::SoilParameters;
use crate::pressure_sinkage::PressureSinkage;
use crate::shear_strength::{ShearStrength, YieldAnswer, YieldNodes, build_up};
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// Depths for which a pressure law must make sense, m.
const DEPTHS: [f64; 2] = [0.0, 1.0];
/// Sizes of contacts, m.
const SIZES: [f64; 2] = [1e-3, 2.0];
/// Pressures for which a shear law must make sense, Pa.
const PRESSURES: [f64; 2] = [0.0, 1e7];
/// Shear displacements, m.
const SLIPS: [f64; 2] = [0.0, FULL_SLIP];

/// A pressure law of the variables z (0) and b (1), before b is fixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureExpression {
    builder: Builder,
    root: u8,
    program: Program,
    /// Stiffness of unloading (Pa/m) below which its slopes are known to stay.
    gentle_at: Option<f64>,
}

impl PressureSinkage for PressureExpression {
    /// If the folded law is a power law, it is that one.
    fn under(&self, b: f64) -> FirstLoading {
        let program = self.at_size(b);
        match program.power_law() {
            Some((modulus, exponent)) => FirstLoading::Power { modulus, exponent },
            None => FirstLoading::Program(program),
        }
    }

    fn is_gentle_at(&self, k_u: f64) -> bool {
        self.gentle_at == Some(k_u)
    }
}

impl PressureExpression {
    /// The same law, whose slopes are known to stay below `k_u` (Pa/m) beyond the elastic limit.
    pub(crate) fn gentle_at(self, k_u: f64) -> Self {
        Self { gentle_at: Some(k_u), ..self }
    }

    /// The law under a contact of size `b` (m), a program of z.
    pub fn at_size(&self, b: f64) -> Program {
        let bind = |v| if v == 1 { Binding::Constant(b) } else { Binding::Variable(v) };
        let (builder, root) = self.builder.rebind(self.root, bind);
        // a program that fits with b as a variable fits with b as a number
        Program::new(builder.operations(), root).unwrap_or(self.program)
    }
}

/// A shear law: largest stress of the variables σ (0) and j (1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShearExpression {
    program: Program,
    /// Largest stress without pressure, Pa.
    cohesion: f64,
    /// d(largest stress)/dσ of the fully mobilised soil.
    friction: f64,
}

impl ShearExpression {
    fn new(program: Program) -> Result<Self> {
        let [cohesion, friction] = cohesion_and_friction(|sigma, j| Ok(program.eval([sigma, j])))?;
        Ok(Self { program, cohesion, friction })
    }
}

impl ShearStrength for ShearExpression {
    fn cohesion(&self) -> f64 {
        self.cohesion
    }

    fn friction(&self) -> f64 {
        self.friction
    }

    #[inline]
    fn yield_stress(&self, sigma: f64, j: f64, _kept: &[f64]) -> Result<(f64, [f64; 2])> {
        built_up(self.cohesion, sigma, |sigma| Ok(self.program.eval([sigma, j])))
    }

    fn yield_stresses(&self, nodes: &YieldNodes, out: &mut YieldAnswer) -> Result {
        let slopes = [&mut *out.by_pressure, &mut *out.by_slip];
        self.program.eval_all([nodes.pressure, nodes.slip], out.stress, slopes);
        build_up(self, nodes, out)
    }
}

/// The texts of `[soil.law]`; the programs are made anew when a parameter changes.
#[derive(Clone, Debug, PartialEq)]
pub struct SoilExpressions {
    pressure: Option<String>,
    shear: Option<String>,
    own: Vec<Symbol>,
}

impl SoilExpressions {
    /// Parameters that a soil with laws from the scenario adds to its schema.
    pub fn schema() -> Vec<Parameter> {
        let text = |name, help| Parameter::of(name, ParameterType::Text, help).optional();
        vec![
            text(
                "law.pressure",
                "pressure (Pa) of first loading at the depth z under a contact of size b, e.g. (k_c/b + k_phi)*z^n",
            ),
            text(
                "law.shear",
                "shear stress (Pa) at the pressure sigma after the slip j, e.g. (c + sigma*tan(phi))*(1 - exp(-j/K))",
            ),
            text("law.plugin", "a module of kind law: its name, or the path of its file"),
            text(
                "law.parameters.*",
                "a name of your own for the laws, \"VALUE UNIT [MIN, MAX]\", or a number of the module",
            ),
        ]
    }

    /// Reads `[soil.law]`; `None`: the scenario has none.
    ///
    /// # Errors
    /// [`Error::Refused`]: a parameter that cannot be read, or one that no law uses.
    pub fn from_config(config: &Config) -> Result<Option<Self>> {
        let text = |name| match config.get(name) {
            None | Some(serde_json::Value::Null) => Ok(None),
            Some(_) => config.text(name).map(|t| Some(t.to_owned())),
        };
        let (pressure, shear) = (text("law.pressure")?, text("law.shear")?);
        let mut own = Vec::new();
        for (name, value) in config.get("law.parameters").and_then(|v| v.as_object()).into_iter().flatten() {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            own.push(Symbol::parse(name, &text).map_err(|e| refuse(&format!("law.parameters.{name}"), &e))?);
        }
        if pressure.is_none() && shear.is_none() {
            return match own.first() {
                None => Ok(None),
                Some(_) if text("law.plugin")?.is_some() => Ok(None),
                Some(symbol) => Err(Error::Refused(format!(
                    "`law.parameters.{}` is given, but neither `law.pressure` nor `law.shear` uses it",
                    symbol.name
                ))),
            };
        }
        Ok(Some(Self { pressure, shear, own }))
    }

    /// The pressure law with these parameters; `None`: the scenario leaves it to the soil.
    ///
    /// # Errors
    /// [`Error::Refused`]: a text that is no law of pressure, with its place.
    pub fn pressure(&self, p: &SoilParameters) -> Result<Option<PressureExpression>> {
        let Some(text) = &self.pressure else { return Ok(None) };
        let variables = [
            Symbol::new("z", "m", Role::Variable, 0.01, DEPTHS),
            Symbol::new("b", "m", Role::Contact, 0.05, SIZES),
        ];
        let law = self.checked(text, &variables, p).and_then(|(tree, symbols)| {
            let law = compile(&tree, &symbols)?;
            physical_pressure(&tree, &law, p.elastic_stiffness_pa_m)?;
            Ok(law)
        });
        law.map(Some).map_err(|e| refuse("law.pressure", &e))
    }

    /// The shear law with these parameters; `None`: the scenario leaves it to the soil.
    ///
    /// # Errors
    /// [`Error::Refused`]: a text that is no law of shear, with its place.
    pub fn shear(&self, p: &SoilParameters) -> Result<Option<ShearExpression>> {
        let Some(text) = &self.shear else { return Ok(None) };
        let variables = [
            Symbol::new("sigma", "Pa", Role::Variable, 1e4, PRESSURES),
            Symbol::new("j", "m", Role::Variable, 0.01, SLIPS),
        ];
        let law = self.checked(text, &variables, p).and_then(|(tree, symbols)| {
            let law =
                ShearExpression::new(compile(&tree, &symbols)?.program).map_err(|e| whole(&tree, &e))?;
            physical_shear(&tree, &law)?;
            Ok(law)
        });
        law.map(Some).map_err(|e| refuse("law.shear", &e))
    }

    /// The tree with all symbols in SI, after the checks of names, dimension and range.
    fn checked(
        &self,
        text: &str,
        variables: &[Symbol],
        p: &SoilParameters,
    ) -> std::result::Result<(Tree, Vec<Symbol>), Box<ExpressionError>> {
        let mut symbols = variables.to_vec();
        symbols.extend(self.own.iter().cloned());
        for known in known_symbols(p) {
            if !symbols.iter().any(|s| s.name == known.name) {
                symbols.push(known);
            }
        }
        let names: Vec<&str> = symbols.iter().map(|s| s.name.as_str()).collect();
        let tree = Tree::parse(text, &names)?;
        dimension::check(&tree, &symbols, &PRESSURE)?;
        let values: Vec<f64> = symbols.iter().map(|s| s.value).collect();
        let factors = symbols.iter().map(|s| Ok(dimension::unit_dimension(s, &symbols, &values)?.1));
        let factors = factors.collect::<std::result::Result<Vec<f64>, Box<ExpressionError>>>()?;
        for (symbol, factor) in symbols.iter_mut().zip(factors) {
            symbol.value *= factor;
            symbol.range = symbol.range.map(|r| r * factor);
        }
        range::check(&tree, &symbols)?;
        Ok((tree, symbols))
    }
}

fn refuse(key: &str, error: &ExpressionError) -> Error {
    Error::Refused(format!("`{key}`: {error}"))
}

/// The numbers of the soil by the names that the literature gives them.
fn known_symbols(p: &SoilParameters) -> Vec<Symbol> {
    let mut known = vec![
        Symbol::fixed("n", "", p.n),
        Symbol::fixed("k_c", "N/m^(n+1)", p.k_c),
        Symbol::fixed("k_phi", "N/m^(n+2)", p.k_phi * p.gravity_factor()),
        Symbol::fixed("c", "Pa", p.c_pa),
        Symbol::fixed("phi", "rad", p.phi_rad),
        Symbol::fixed("K", "m", p.K_m),
        Symbol::fixed("k_u", "Pa/m", p.unloading()),
    ];
    known.extend(p.density_kg_m3.map(|rho| Symbol::fixed("rho", "kg/m^3", rho)));
    known
}

fn compile(tree: &Tree, symbols: &[Symbol]) -> std::result::Result<PressureExpression, Box<ExpressionError>> {
    let bind = |s: usize| match symbols[s].role {
        Role::Parameter => Binding::Constant(symbols[s].value),
        _ => Binding::Variable(s as u8),
    };
    let compiled = Builder::of(tree, bind).and_then(|(builder, root)| {
        Some(PressureExpression {
            program: Program::new(builder.operations(), root)?,
            builder,
            root,
            gentle_at: None,
        })
    });
    compiled.ok_or_else(|| {
        let message = format!("the law is too long: at most {} operations", super::program::LONGEST);
        tree.error(tree.root(), message)
    })
}

/// Evaluation points from the first to the last of a range, denser near 0.
fn points(range: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    (0..=count).map(move |k| {
        let share = k as f64 / count as f64;
        range[0] + (range[1] - range[0]) * share * share * share
    })
}

/// Soil never pulls, its pressure never falls with the depth (the depth under a force would not be unique), and it
/// is softer in first loading than in unloading once the law has left the elastic line, where `k_u` (Pa/m) is given.
fn physical_pressure(
    tree: &Tree,
    law: &PressureExpression,
    k_u: Option<f64>,
) -> std::result::Result<(), Box<ExpressionError>> {
    let whole = |message: String| tree.error(tree.root(), message);
    for b in points(SIZES, 6) {
        let at = law.at_size(b);
        let mut before = (0.0, 0.0);
        for z in points(DEPTHS, 60) {
            let (p, [slope]) = at.eval([z]);
            if !(p >= 0.0 && p.is_finite()) {
                return Err(whole(format!(
                    "the pressure is {p} Pa at z = {z:.4} m, b = {b:.4} m; soil does not pull"
                )));
            }
            if p < before.1 {
                return Err(whole(format!(
                    "the pressure falls from {:.4} Pa at z = {:.4} m to {p:.4} Pa at z = {z:.4} m (b = {b:.4} m)",
                    before.1, before.0
                ))
                .help("a foot under a given force would have no unique depth"));
            }
            if z > 0.0 && slope.is_nan() {
                return Err(whole(format!("the slope is not a number at z = {z:.4} m")));
            }
            before = (z, p);
        }
        let last = at.eval([DEPTHS[1]]).0;
        if last <= 0.0 {
            return Err(whole(format!("the pressure is 0 down to z = {} m at b = {b:.4} m", DEPTHS[1])));
        }
        let Some(k_u) = k_u else { continue };
        let limit = inverse::elastic_limit(&|z| Ok(at.depth(z)), k_u).map_err(|e| self::whole(tree, &e))?;
        if limit > 0.1 {
            return Err(whole(format!(
                "the law is stiffer than unloading ({k_u} Pa/m) down to z = {limit:.3} m at b = {b:.4} m"
            ))
            .help("check its numbers, or raise elastic_stiffness_pa_m"));
        }
    }
    Ok(())
}

/// An error of the law as a whole.
fn whole(tree: &Tree, error: &Error) -> Box<ExpressionError> {
    tree.error(tree.root(), error.to_string())
}

/// Shear stress opposes the slip and does not fall with the pressure.
fn physical_shear(tree: &Tree, law: &ShearExpression) -> std::result::Result<(), Box<ExpressionError>> {
    for sigma in points([0.0, 1e6], 20) {
        for j in points(SLIPS, 40) {
            let (tau, [by_sigma, by_j]) = law.yield_stress(sigma, j, &[]).map_err(|e| whole(tree, &e))?;
            if !(tau >= -1e-9 && tau.is_finite() && by_sigma.is_finite() && by_j.is_finite()) {
                let message = format!("the stress is {tau} Pa at sigma = {sigma:.1} Pa, j = {j:.4} m");
                return Err(tree.error(tree.root(), message).help("it must be finite and not negative"));
            }
            if by_sigma < -1e-9 || by_j < -1e-6 * (1.0 + tau) {
                let (what, slope) = if by_j < 0.0 { ("slip j", by_j) } else { ("pressure sigma", by_sigma) };
                let message = format!(
                    "the stress falls with the {what} ({slope:.3}) at sigma = {sigma:.1} Pa, j = {j:.4} m"
                );
                return Err(tree.error(tree.root(), message));
            }
        }
    }
    Ok(())
}
