//! Arguments of `terraglue locate`.

use clap::Args;
use std::path::PathBuf;
use terraglue_tree_localisation::Prior;

/// Finds the place of a scanner among the trees of a map.
#[derive(Args, Debug, Clone)]
pub struct LocateArguments {
    /// Scans in one frame whose z is up: .las, .laz, or text with x y z in each line.
    #[arg(value_name = "SCAN", required = true)]
    pub scans: Vec<PathBuf>,
    /// Table of trees with the columns x and y, m, and dbh_m where diameters are known.
    #[arg(long, value_name = "CSV")]
    pub map: PathBuf,
    /// Where the scanner stood in the frame of the points, m; once for all scans, or once for each. Without it at the origin, if
    /// points lie around it.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true)]
    pub scanner: Vec<[f64; 3]>,
    /// Search only within a radius of a place on the map, m.
    #[arg(long, value_name = "X,Y,R", value_parser = parse_prior, allow_hyphen_values = true)]
    pub prior: Option<[f64; 3]>,
    /// Direction of the frame of the points on the map, and by how much it may be wrong, degrees.
    #[arg(long, value_name = "YAW,OFF", value_parser = numbers::<2>, requires = "prior", allow_hyphen_values = true)]
    pub yaw: Option<[f64; 2]>,
    /// Deviation of the places of the map, m.
    #[arg(long, value_name = "M", default_value_t = 0.1, value_parser = parse_noise)]
    pub map_noise: f64,
    /// Deviation of the diameters of the map, m.
    #[arg(long, value_name = "M", default_value_t = 0.03, value_parser = parse_noise)]
    pub map_diameter: f64,
    /// Share of the trees that the map lacks.
    #[arg(long, value_name = "SHARE", default_value_t = 0.3, value_parser = parse_share)]
    pub missing: f64,
    /// Print JSON instead of text.
    #[arg(long)]
    pub json: bool,
    /// Draw both maps on each other.
    #[arg(long, value_name = "SVG")]
    pub picture: Option<PathBuf>,
}

impl LocateArguments {
    /// The prior of the pose.
    pub fn prior(&self) -> Option<Prior> {
        let [x, y, radius] = self.prior?;
        Some(Prior { place: [x, y], radius, yaw: self.yaw.map(|y| y.map(f64::to_radians)) })
    }
}

/// So many finite numbers with commas in between.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let all: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    let all = all.and_then(|all| all.try_into().ok());
    all.ok_or_else(|| {
        format!("{N} numbers with commas in between are needed, as in {}", ["1.5"; N].join(","))
    })
}

fn parse_prior(text: &str) -> Result<[f64; 3], String> {
    let prior = numbers::<3>(text)?;
    if prior[2] > 0.0 { Ok(prior) } else { Err("the radius must be positive".into()) }
}

fn parse_noise(text: &str) -> Result<f64, String> {
    let [noise] = numbers::<1>(text)?;
    if (0.0..=10.0).contains(&noise) { Ok(noise) } else { Err("a deviation from 0 to 10 m is needed".into()) }
}

fn parse_share(text: &str) -> Result<f64, String> {
    let [share] = numbers::<1>(text)?;
    if (0.0..=0.9).contains(&share) { Ok(share) } else { Err("a share from 0 to 0.9 is needed".into()) }
}
