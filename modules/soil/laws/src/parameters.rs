//! The numbers of one soil and the laws made from them.

use crate::bearing_capacity::BearingCapacity;
use crate::bekker::Bekker;
use crate::expression::SoilExpressions;
use crate::pressure_law::{PRESSURE_LAWS, PressureLaw};
use crate::reece::Reece;
use crate::rolling::Rolling;
use crate::shear::ShearLaw;
use crate::strength::Strength;
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// Default density, kg/m³: the upper 15 cm of lunar soil (Carrier, Olhoeft and Mendell 1991, Lunar Sourcebook, table
/// 9.4).
pub const DEFAULT_DENSITY: f64 = 1500.0;

/// Parameters of a soil; the names are the keys of a scenario and the columns of `models/soils.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(non_snake_case)]
pub struct SoilParameters {
    /// Which pressure–sinkage law, with the numbers that it alone has.
    pub family: Family,
    /// Exponent of the pressure–sinkage law.
    pub n: f64,
    /// Cohesive modulus of Bekker's law, N/m^(n+1); 0 for the others.
    pub k_c: f64,
    /// Frictional modulus of Bekker's law, N/m^(n+2); 0 for the others.
    pub k_phi: f64,
    /// Cohesion, Pa.
    pub c_pa: f64,
    /// Cohesion that holds steep slopes, Pa; `None`: `c_pa`. Dry sand has none (Terzaghi 1943, art. 5): its `c_pa` is where
    /// the line meets the axis that was fitted to tests under pressure.
    pub wall_cohesion_pa: Option<f64>,
    /// Angle of internal friction, rad.
    pub phi_rad: f64,
    /// Shear deformation modulus, m.
    pub K_m: f64,
    /// Bulk density where known, kg/m³.
    pub density_kg_m3: Option<f64>,
    /// Stiffness of unloading and reloading, Pa/m; `None`: that of [`PressureLaw::unloading`].
    pub elastic_stiffness_pa_m: Option<f64>,
    /// Acceleration of gravity, m/s²: makes a weight of the density.
    pub gravity: f64,
    /// Gravity under which the moduli of Bekker's law were measured, m/s²; `None`: not known.
    pub measured_gravity: Option<f64>,
    /// Whether k_φ, which stands for the weight of the soil, is scaled from there to `gravity`.
    pub gravity_scaling: bool,
    /// Angle of friction and adhesive strength between feet and soil, rad and Pa, where they are not those of the soil.
    pub interface: [Option<f64>; 2],
    /// Tension with which soil clings to a foot that lifts off, Pa; 0: it never pulls.
    pub adhesion_pa: f64,
    /// Part of the mass of the cone of soil under a foot that moves with it; 0: soil has no inertia.
    pub added_mass: f64,
    /// Parameters of wheels alone.
    pub rolling: Rolling,
    /// Effect of the direction of motion and of the slope of the underside.
    pub direction: Direction,
}

/// Stiffness that no law comes near, Pa/m.
const STIFF: f64 = 1e18;

/// Effect of the direction of motion and of the slope of the underside of a body on the pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Inclined faces bear less than level ones: [`crate::strength::slope_factor`].
    pub slope_factor: bool,
    /// A contact that carries shear bears less: [`crate::strength::Inclination`].
    pub load_inclination: bool,
    /// Faces that are pushed sideways meet passive earth pressure: [`Strength::passive`].
    pub passive_pressure: bool,
}

impl Default for Direction {
    fn default() -> Self {
        Self { slope_factor: true, load_inclination: true, passive_pressure: true }
    }
}

impl Direction {
    /// Nothing of it: the pressure depends on the depth alone.
    pub const NONE: Self = Self { slope_factor: false, load_inclination: false, passive_pressure: false };

    fn schema() -> [Parameter; 3] {
        let flag = |name, help| Parameter::of(name, ParameterType::Bool, help).or(true);
        [
            flag(
                "slope_factor",
                "inclined undersides bear less than level ones, as plates do (Li et al. 2013)",
            ),
            flag("load_inclination", "a contact that carries shear bears less and sinks (Sokolovskii 1965)"),
            flag(
                "passive_pressure",
                "faces that are pushed sideways meet passive earth pressure (Rankine 1857)",
            ),
        ]
    }

    fn from_config(config: &Config) -> Result<Self> {
        let flag = |key| if config.get(key).is_some() { config.flag(key) } else { Ok(true) };
        Ok(Self {
            slope_factor: flag("slope_factor")?,
            load_inclination: flag("load_inclination")?,
            passive_pressure: flag("passive_pressure")?,
        })
    }
}

/// A number that a scenario gives.
fn number(name: &str, unit: &str, help: &str) -> Parameter {
    Parameter { unit: unit.into(), ..Parameter::of(name, ParameterType::Number, help) }
}

/// The pressure-sinkage law and its numbers.
fn pressure_schema() -> Vec<Parameter> {
    vec![
        Parameter::of("pressure_law", ParameterType::Text, "pressure-sinkage law")
            .or(PRESSURE_LAWS[0])
            .choices(&PRESSURE_LAWS),
        number("n", "", "exponent of the pressure-sinkage law").within(0.05, 3.0),
        number("k_c", "", "bekker: cohesive modulus, N/m^(n+1)").within(0.0, 1e9).optional().usually(
            "N/m^(n+1)",
            20.0,
            3e5,
        ),
        number("k_phi", "", "bekker: frictional modulus, N/m^(n+2)").within(0.0, 1e12).optional().usually(
            "N/m^(n+2)",
            1.5e4,
            2.5e7,
        ),
        number("k_c_prime", "", "reece: k_c' of (c k_c' + gamma b k_phi') (z/b)^n")
            .within(0.0, 1e9)
            .optional(),
        number("k_phi_prime", "", "reece: k_phi'").within(0.0, 1e9).optional(),
        number("N_c", "", "bearing: N_c of (c N_c + gamma b N_gamma) (z/z_r)^n").within(0.0, 1e9).optional(),
        number("N_gamma", "", "bearing: N_gamma").within(0.0, 1e9).optional(),
        Parameter::number("reference_depth_m", "m", 0.1, "bearing: reference depth z_r")
            .positive()
            .usually("m", 0.005, 2.0),
    ]
}

/// The strength of the soil.
fn strength_schema() -> Vec<Parameter> {
    vec![
        number("c_pa", "Pa", "cohesion").within(0.0, 1e7).usually("Pa", 100.0, 2e5),
        number(
            "wall_cohesion_pa",
            "Pa",
            "cohesion that holds steep slopes; c_pa where absent, 0 in dry sand, whose c_pa is the intercept of a fit",
        )
        .within(0.0, 1e7)
        .optional(),
        number("phi_rad", "rad", "angle of internal friction").within(0.01, 1.2),
        number("K_m", "m", "shear deformation modulus of Janosi and Hanamoto")
            .positive()
            .usually("m", 0.002, 0.12),
        number("density_kg_m3", "kg/m^3", "bulk density")
            .positive()
            .optional()
            .usually("kg/m^3", 100.0, 3500.0),
    ]
}

/// Parameters of the elastic rebound of the soil and of the effect of gravity.
fn elastic_schema() -> Vec<Parameter> {
    vec![
        number(
            "elastic_stiffness_pa_m",
            "Pa/m",
            "stiffness of unloading and reloading; where absent 4.4 times that of first loading down to 2 cm (Wong 1984)",
        )
        .positive()
        .optional(),
        number(
            "measured_gravity_m_s2",
            "m/s^2",
            "bekker: acceleration of gravity under which k_phi was measured",
        )
        .positive()
        .optional(),
        Parameter::of(
            "gravity_scaling",
            ParameterType::Bool,
            "bekker: scale k_phi, which stands for the weight of the soil, from measured_gravity_m_s2 to the gravity of the scenario (Reece 1965)",
        )
        .or(false),
    ]
}

/// Parameters of the interface of feet and soil.
fn interface_schema() -> Vec<Parameter> {
    vec![
        number(
            "interface_phi_rad",
            "rad",
            "angle of friction between feet and soil; phi_rad where absent",
        )
        .within(0.0, 1.2)
        .optional(),
        number(
            "interface_c_pa",
            "Pa",
            "shear strength between feet and soil without pressure; c_pa where absent",
        )
        .within(0.0, 1e7)
        .optional()
        .usually("Pa", 10.0, 2e5),
        number(
            "adhesion_pa",
            "Pa",
            "tension with which soil clings to a foot that lifts off, until it lets go; none where absent",
        )
        .within(0.0, 1e7)
        .optional()
        .usually("Pa", 10.0, 2e5),
        number(
            "added_mass",
            "",
            "part of the mass of the cone of soil under a foot that moves with it and resists by its inertia (Aguilar and Goldman 2016); 0: none",
        )
        .or(0.0)
        .within(0.0, 10.0),
    ]
}

/// A pressure–sinkage law and the numbers that it alone has.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Family {
    /// [`Bekker`] with `k_c` and `k_phi`.
    Bekker,
    /// [`Reece`] with the dimensionless k_c' and k_φ'.
    Reece {
        /// k_c'.
        k_c: f64,
        /// k_φ'.
        k_phi: f64,
    },
    /// [`BearingCapacity`].
    Bearing {
        /// N_c at the reference depth.
        n_c: f64,
        /// N_γ at the reference depth, per width b.
        n_gamma: f64,
        /// z_r, m.
        reference: f64,
    },
}

impl Default for SoilParameters {
    /// Nominal lunar soil (Apollo model): n = 1, k_c 1400, k_φ 820 000, c 170 Pa, φ 35°, K 18 mm.
    fn default() -> Self {
        Self {
            family: Family::Bekker,
            n: 1.0,
            k_c: 1400.0,
            k_phi: 820_000.0,
            c_pa: 170.0,
            wall_cohesion_pa: None,
            phi_rad: 35f64.to_radians(),
            K_m: 0.018,
            density_kg_m3: None,
            elastic_stiffness_pa_m: None,
            gravity: 1.62,
            measured_gravity: Some(1.62),
            gravity_scaling: false,
            interface: [None; 2],
            adhesion_pa: 0.0,
            added_mass: 0.0,
            rolling: Rolling::default(),
            direction: Direction::default(),
        }
    }
}

impl SoilParameters {
    /// Parameters of these laws in the scenario table of a module. The usual spans are those of `models/soils.csv`,
    /// widened by about three.
    pub fn schema() -> Vec<Parameter> {
        let mut parameters = pressure_schema();
        parameters.extend(strength_schema());
        parameters.extend(elastic_schema());
        parameters.extend(interface_schema());
        parameters.push(
            Parameter::of(
                "contacts_shown",
                ParameterType::Integer,
                "number of wheels and feet that have variables of their own (contact1.slip, …), in the order of their first touch",
            )
            .or(0)
            .within(0.0, 64.0),
        );
        parameters.extend(Direction::schema());
        parameters.extend(Rolling::schema());
        parameters.extend(SoilExpressions::schema());
        parameters
    }

    /// The table of a soil with the numbers of another soil, that of a region of the ground, in place of its own.
    ///
    /// # Errors
    /// The table cannot be read again.
    pub fn of_region(
        config: &Config,
        numbers: &serde_json::Map<String, serde_json::Value>,
    ) -> Result<Config> {
        let mut all: serde_json::Map<_, _> = serde_json::from_str(&config.to_json())
            .map_err(|e| Error::Refused(format!("the soil's table cannot be read again: {e}")))?;
        // a density that a region does not give is unknown for its soil
        all.remove("density_kg_m3");
        all.remove("measured_gravity_m_s2");
        all.remove("wall_cohesion_pa");
        all.extend(numbers.iter().map(|(key, value)| (key.clone(), value.clone())));
        Config::parse(&serde_json::Value::Object(all).to_string())
    }

    /// Reads the parameters of an instance under `gravity` (m/s²). Refused: a missing or non-positive number where
    /// one is needed.
    ///
    /// # Errors
    /// [`Error::Refused`]: a number that is missing or without sense.
    pub fn from_config(config: &Config, gravity: f64) -> Result<Self> {
        let number = |name| config.optional_number(name);
        let parameters = Self {
            family: Family::from_config(config)?,
            n: config.number("n")?,
            k_c: number("k_c")?.unwrap_or(0.0),
            k_phi: number("k_phi")?.unwrap_or(0.0),
            c_pa: config.number("c_pa")?,
            wall_cohesion_pa: number("wall_cohesion_pa")?,
            phi_rad: config.number("phi_rad")?,
            K_m: config.number("K_m")?,
            density_kg_m3: number("density_kg_m3")?,
            elastic_stiffness_pa_m: number("elastic_stiffness_pa_m")?,
            gravity,
            measured_gravity: number("measured_gravity_m_s2")?,
            gravity_scaling: config.get("gravity_scaling").is_some() && config.flag("gravity_scaling")?,
            interface: [number("interface_phi_rad")?, number("interface_c_pa")?],
            adhesion_pa: number("adhesion_pa")?.unwrap_or(0.0),
            added_mass: number("added_mass")?.unwrap_or(0.0),
            rolling: Rolling::from_config(config)?,
            direction: Direction::from_config(config)?,
        };
        parameters.check().map(|()| parameters)
    }

    /// Refuses numbers with which the laws make no sense.
    ///
    /// # Errors
    /// [`Error::Refused`], with the name and value of the first such number.
    pub fn check(&self) -> Result {
        for (name, value) in [
            ("n", self.n),
            ("phi_rad", self.phi_rad),
            ("K_m", self.K_m),
            ("elastic_stiffness_pa_m", self.elastic_stiffness_pa_m.unwrap_or(1.0)),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::Refused(format!("`{name}` = {value} must be larger than zero")));
            }
        }
        for (name, value) in [
            ("k_c", self.k_c),
            ("k_phi", self.k_phi),
            ("c_pa", self.c_pa),
            ("wall_cohesion_pa", self.wall_cohesion_pa.unwrap_or(0.0)),
            ("adhesion_pa", self.adhesion_pa),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::Refused(format!("`{name}` = {value} must not be negative")));
            }
        }
        if self.gravity_scaling && self.family == Family::Bekker && self.measured_gravity.is_none() {
            let text = "`gravity_scaling` needs `measured_gravity_m_s2`: the gravity under which `k_phi` was measured";
            return Err(Error::Refused(text.into()));
        }
        let modulus = self.pressure().curve(0.1, STIFF)?.virgin(0.01)?;
        if modulus.is_finite() && modulus > 0.0 {
            return Ok(());
        }
        Err(Error::Refused(match self.family {
            Family::Bekker => "`k_phi` is missing or zero: the soil would carry nothing".into(),
            _ => "the soil would carry nothing: the law needs `c_pa` with its factor, or `density_kg_m3` and gravity \
                  with the other one"
                .into(),
        }))
    }

    /// Factor of k_φ for the gravity of the scenario: g over that of the measurement where `gravity_scaling` is set.
    ///
    /// The frictional part of the resistance grows with the unit weight of the soil and the cohesive one does not: (c k_c' +
    /// γ b k_φ')(z/b)ⁿ (Reece 1965). With it the sinkage of a body of given mass hardly depends on gravity, as Kobayashi et
    /// al. (2010, J. Terramechanics 47, 261) measured with wheels in aircraft.
    pub fn gravity_factor(&self) -> f64 {
        match self.measured_gravity {
            Some(measured) if self.gravity_scaling && self.family == Family::Bekker => {
                self.gravity / measured
            }
            _ => 1.0,
        }
    }

    /// The pressure law.
    pub fn pressure(&self) -> PressureLaw {
        let weight = self.density_kg_m3.unwrap_or(0.0) * self.gravity;
        match self.family {
            Family::Bekker => {
                let k_phi = self.k_phi * self.gravity_factor();
                PressureLaw::Bekker(Bekker { k_c: self.k_c, k_phi, n: self.n })
            }
            Family::Reece { k_c, k_phi } => {
                let (cohesive, frictional) = (self.c_pa * k_c, weight * k_phi);
                PressureLaw::Reece(Reece { cohesive, frictional, n: self.n })
            }
            Family::Bearing { n_c, n_gamma, reference } => {
                let (cohesive, frictional) = (self.c_pa * n_c, weight * n_gamma);
                PressureLaw::BearingCapacity(BearingCapacity { cohesive, frictional, reference, n: self.n })
            }
        }
    }

    /// Stiffness of unloading and reloading, Pa/m.
    pub fn unloading(&self) -> f64 {
        // built-in laws always answer; one that the scenario writes as text may leave them without numbers
        let own = || self.pressure().unloading().unwrap_or(0.0);
        self.elastic_stiffness_pa_m.unwrap_or_else(own).max(1.0)
    }

    /// Weight of the soil per volume, N/m³.
    pub fn weight(&self) -> f64 {
        self.density_kg_m3.unwrap_or(DEFAULT_DENSITY) * self.gravity
    }

    /// Cohesion, friction and weight of the soil itself.
    pub fn strength(&self) -> Strength {
        Strength { cohesion: self.c_pa, phi: self.phi_rad, weight: self.weight() }
    }

    /// The same of slopes that stand without anything that presses on them.
    pub fn wall(&self) -> Strength {
        Strength { cohesion: self.wall_cohesion_pa.unwrap_or(self.c_pa), ..self.strength() }
    }

    /// The shear law between feet and soil: the weaker of the soil's own strength and that of the interface acts.
    pub fn shear(&self) -> ShearLaw {
        let [phi, c] = self.interface;
        let cohesion = c.map_or(self.c_pa, |c| c.min(self.c_pa));
        let phi = phi.map_or(self.phi_rad, |phi| phi.min(self.phi_rad));
        ShearLaw::new(cohesion, phi, self.K_m, self.unloading())
    }
}

impl Family {
    fn from_config(config: &Config) -> Result<Self> {
        let name = config.get("pressure_law").and_then(|v| v.as_str()).unwrap_or(PRESSURE_LAWS[0]);
        Ok(match name {
            "bekker" => {
                config.number("k_c")?;
                config.number("k_phi")?;
                Self::Bekker
            }
            "reece" => {
                Self::Reece { k_c: config.number("k_c_prime")?, k_phi: weighed(config, "k_phi_prime")? }
            }
            "bearing" => Self::Bearing {
                n_c: config.number("N_c")?,
                n_gamma: weighed(config, "N_gamma")?,
                reference: config.optional_number("reference_depth_m")?.unwrap_or(0.1),
            },
            other => return Err(unknown("pressure_law", other, &PRESSURE_LAWS)),
        })
    }
}

/// A factor of the soil's weight, which needs a density.
fn weighed(config: &Config, name: &str) -> Result<f64> {
    let value = config.number(name)?;
    if value > 0.0 && config.optional_number("density_kg_m3")?.is_none() {
        let text = format!("`{name}` multiplies the weight of the soil: `density_kg_m3` is needed with it");
        return Err(Error::Refused(text));
    }
    Ok(value)
}

fn unknown(key: &str, value: &str, known: &[&str]) -> Error {
    Error::Refused(format!("`{key}` = \"{value}\" is not known; take one of {}", known.join(", ")))
}

impl terraglue_subsystem::bytes::Persist for Family {
    fn write(&self, out: &mut Vec<u8>) {
        let (name, numbers) = match *self {
            Self::Bekker => (0_u8, [0.0; 3]),
            Self::Reece { k_c, k_phi } => (1, [k_c, k_phi, 0.0]),
            Self::Bearing { n_c, n_gamma, reference } => (2, [n_c, n_gamma, reference]),
        };
        (name, numbers).write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        match <(u8, [f64; 3])>::read(from)? {
            (0, _) => Ok(Self::Bekker),
            (1, [k_c, k_phi, _]) => Ok(Self::Reece { k_c, k_phi }),
            (2, [n_c, n_gamma, reference]) => Ok(Self::Bearing { n_c, n_gamma, reference }),
            _ => Err(terraglue_subsystem::bytes::wrong("there is no such pressure law")),
        }
    }
}

terraglue_subsystem::persist!(SoilParameters {
    family,
    n,
    k_c,
    k_phi,
    c_pa,
    wall_cohesion_pa,
    phi_rad,
    K_m,
    density_kg_m3,
    elastic_stiffness_pa_m,
    gravity,
    measured_gravity,
    gravity_scaling,
    interface,
    adhesion_pa,
    added_mass,
    rolling,
    direction,
});
terraglue_subsystem::persist!(Direction { slope_factor, load_inclination, passive_pressure });
