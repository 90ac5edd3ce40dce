//! All data of an actuator in one table: parameters of the scenario, live variables and their docs are made from it.

/// One number of an actuator.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    /// Name of the variable `JOINT.key` and, below `actuator`, of the parameter.
    pub key: &'static str,
    /// For a joint that turns.
    pub unit: &'static str,
    pub default: f64,
    pub range: Range,
    /// Which actuators have it.
    pub group: Group,
    pub help: &'static str,
}

/// Range of the values that are accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Range {
    NotNegative,
    Positive,
    /// Greater than 0 and at most 1.
    Share,
    /// From 0 to 1.
    UpToOne,
    Any,
}

impl Range {
    pub fn accepts(self, x: f64) -> bool {
        match self {
            Self::NotNegative => x >= 0.0,
            Self::Positive => x > 0.0,
            Self::Share => x > 0.0 && x <= 1.0,
            Self::UpToOne => (0.0..=1.0).contains(&x),
            Self::Any => true,
        }
    }
}

/// Which actuators a setting matters to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    All,
    Friction,
    Dc,
    Thermal,
    Formula,
}

const fn setting(
    key: &'static str,
    unit: &'static str,
    default: f64,
    range: Range,
    group: Group,
    help: &'static str,
) -> Setting {
    Setting { key, unit, default, range, group, help }
}

macro_rules! settings {
    ($($item:ident = $key:literal, $unit:literal, $default:literal, $range:ident, $group:ident, $help:literal;)*) => {
        /// Names of the settings; the numbers are their places.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum Item { $($item),* }

        /// All settings in the order of [`Item`].
        pub(crate) const SETTINGS: [Setting; [$($key),*].len()] =
            [$(setting($key, $unit, $default, Range::$range, Group::$group, $help)),*];
    };
}

settings! {
    BlockTorque = "block_torque", "N m", 1e12, NotNegative, All, "Torque up to which a block holds; from 1e12 on it gives way to nothing";
    ApproachTime = "approach_time", "s", 0.01, Positive, All, "Time in which a rigid-position motor takes back its error";
    ApproachRate = "approach_rate", "rad/s", 20.0, NotNegative, All, "Largest rate of a rigid-position motor";
    Recuperation = "recuperation", "", 0.0, NotNegative, All, "Share of negative electrical power that goes back into the supply; the rest is burnt";
    Armature = "armature", "kg m^2", 0.0, NotNegative, Friction, "Inertia along the joint besides that of the bodies";
    SpringStiffness = "spring_stiffness", "N m/rad", 0.0, NotNegative, Friction, "Stiffness of a spring beside the motor";
    SpringReference = "spring_reference", "rad", 0.0, Any, Friction, "Coordinate at which that spring is slack";
    ViscousFriction = "viscous_friction", "N m s/rad", 0.0, NotNegative, Friction, "Friction per rate";
    CoulombFriction = "coulomb_friction", "N m", 0.0, NotNegative, Friction, "Friction while sliding";
    StaticFriction = "static_friction", "N m", 0.0, NotNegative, Friction, "Friction at which it breaks away; at least the Coulomb friction";
    StribeckRate = "stribeck_rate", "rad/s", 0.01, Positive, Friction, "Rate over which static friction falls to Coulomb friction";
    BristleStiffness = "bristle_stiffness", "N m/rad", 0.0, NotNegative, Friction, "Stiffness of sticking friction (LuGre); 0: it sticks rigidly";
    BristleDamping = "bristle_damping", "N m s/rad", 0.0, NotNegative, Friction, "Damping of sticking friction (LuGre)";
    GearRatio = "gear_ratio", "", 1.0, Positive, Dc, "Turns of the motor per turn of the joint";
    EfficiencyDriving = "efficiency_driving", "", 1.0, Share, Dc, "Power at the joint / power of the motor while it drives";
    EfficiencyDriven = "efficiency_driven", "", 1.0, Share, Dc, "Power of the motor / power at the joint while it is driven";
    RotorInertia = "rotor_inertia", "kg m^2", 0.0, NotNegative, Dc, "Inertia of the rotor before the gear";
    Resistance = "winding_resistance", "ohm", 1.0, Positive, Dc, "Resistance of the winding at 293.15 K";
    Inductance = "winding_inductance", "H", 0.0, NotNegative, Dc, "Inductance of the winding";
    TorqueConstant = "torque_constant", "N m/A", 0.05, Positive, Dc, "Torque per current, and back-EMF per rate, of the motor before the gear";
    MaxCurrent = "max_current", "A", 1e12, NotNegative, Dc, "Largest current";
    MaxVoltage = "max_voltage", "V", 1e12, NotNegative, Dc, "Largest voltage, besides what the supply can give";
    ResistanceTemperature = "resistance_temperature_coefficient", "1/K", 0.00393, NotNegative, Dc, "Relative change of the resistance per kelvin (copper: 0.00393)";
    WindingCapacity = "winding_heat_capacity", "J/K", 0.0, NotNegative, Dc, "Heat capacity of the winding; 0: it stays cold";
    HousingCapacity = "housing_heat_capacity", "J/K", 100.0, Positive, Thermal, "Heat capacity of the housing";
    WindingHousing = "winding_housing_resistance", "K/W", 1.0, Positive, Thermal, "Thermal resistance from winding to housing";
    HousingAmbient = "housing_ambient_resistance", "K/W", 5.0, Positive, Thermal, "Thermal resistance from housing to ambient";
    AmbientTemperature = "ambient_temperature", "K", 293.15, Positive, Thermal, "Temperature around; winding and housing start there";
    MaxWindingTemperature = "max_winding_temperature", "K", 1e12, Positive, Thermal, "The largest current falls to 0 over the last 10 K below it";
    FormulaPower = "current_per_power", "A/W", 0.0, NotNegative, Formula, "Coefficient of |torque·rate| in the formula of the current";
    FormulaTorque = "current_per_torque", "A/(N m)", 0.0, NotNegative, Formula, "Coefficient of |torque|";
    FormulaRate = "current_per_rate", "A s/rad", 0.0, NotNegative, Formula, "Coefficient of |rate|";
    FormulaIdle = "idle_current", "A", 0.0, NotNegative, Formula, "Current at rest";
    LimitRestitution = "limit_restitution", "", 0.0, UpToOne, All, "Rate with which the joint leaves an end stop / rate with which it hits it";
}
