//! Writes `models/forest`: one turn of a scanner in a stand that is grown from a seed, and a map of that stand, with which
//! `docs/forest.md` shows the command `locate`.

use forest_scenes::{ERRORS, Forest};
use std::fmt::Write;
use terraglue_forest::{Growth, Survey};
use terraglue_laser_scanner::Pattern;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/forest");
    let forest = Forest::grow(Growth { half_m: 45.0, ..Growth::default() }, 12)?;
    let pattern = Pattern::even(900, 24, [12.0, -18.0]);
    let seen = forest.scan(&pattern, &ERRORS, [4.0, -7.0], 2.0, 0.6, 1);
    let mut builder = las::Builder::from((1, 2));
    builder.point_format.is_compressed = true;
    let steps = las::Transform { scale: 1e-4, offset: 0.0 };
    builder.transforms = las::Vector { x: steps, y: steps, z: steps };
    let mut writer = las::Writer::from_path(format!("{folder}/scan.laz"), builder.into_header()?)?;
    for s in &seen {
        let [x, y, z] = s.position;
        writer.write_point(las::Point { x, y, z, ..las::Point::default() })?;
    }
    writer.close()?;
    let survey = Survey { noise_m: 0.1, missing: 0.1, extra: 0.1 };
    let mut map = String::from("x,y,dbh_m\n");
    for (k, tree) in survey.of(&forest.stand, 3).iter().enumerate() {
        let [x, y] = tree.place;
        let other = k % forest.stand.trees.len();
        let diameter = forest.stand.trees[tree.tree.unwrap_or(other)].diameter;
        writeln!(map, "{x:.2},{y:.2},{diameter:.2}")?;
    }
    std::fs::write(format!("{folder}/map.csv"), map)?;
    Ok(())
}
