//! F3, F4, F5, F11 on the files of `TERRAGLUE_FOREST_DATA`, where they are: turns of scanners through a stand of conifers, and a map from
//! the air against the stems of a plot.

use super::npz::array;
use super::{Context, Figure, Limit};
use crate::process::{Outcome, read};
use std::path::Path;
use terraglue_numerics::extremes::smaller;
use terraglue_tree_localisation::{
    Answer, Detector, LocalTree, Located, MapTree, MatchModel, Matcher, Point, Pose2, Prior, Scan, TreeMap,
};

/// Where the scanners of `synthetic` stand, m: 2 m above the ground.
const EYE: [f64; 3] = [180.0, 120.0, 1.4053];
/// Distance up to which stems count, m.
const WITHIN: f64 = 20.0;

pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let Some(folder) = std::env::var_os("TERRAGLUE_FOREST_DATA") else {
        let ids = ["synthetic.os1-64", "synthetic.vlp-16", "pine-plot", "treematcher"];
        let skipped = |id| Figure::skipped(format!("forest.data.{id}"), "TERRAGLUE_FOREST_DATA is not set");
        return Ok(ids.map(skipped).into());
    };
    let folder = Path::new(&folder);
    let mut out = turn(folder, "F3", "os1-64", "OS1-64", [0.95, 0.95])?;
    out.extend(turn(folder, "F4", "vlp-16", "VLP16", [0.95, 0.75])?);
    out.push(pine_plot(folder)?);
    out.extend(from_the_air(folder)?);
    Ok(out)
}

/// A turn against the trees whose stems show ten returns.
fn turn(folder: &Path, line: &str, id: &str, file: &str, limits: [f64; 2]) -> Outcome<Vec<Figure>> {
    let path = folder.join(format!("synthetic/scan_{file}.npz"));
    let (places, owners) = (array(&path, "p")?, array(&path, "owner")?);
    let truth = table(&read(&folder.join("synthetic/truth.csv"))?)?;
    let (rows, _) = places.as_chunks::<3>();
    let points = rows.iter().map(|p| Point::at([0, 1, 2].map(|k| p[k] - EYE[k]))).collect();
    let stems = Detector::default().detect(&Scan::from_origin(points)).stems;
    let gap = |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]);
    let trees: Vec<[f64; 2]> = truth.iter().map(|t| [t[0] - EYE[0], t[1] - EYE[1]]).collect();
    let near: Vec<_> = stems.iter().filter(|s| gap(s.place, [0.0; 2]) <= WITHIN).collect();
    let errors = near.iter().map(|s| trees.iter().map(|t| gap(*t, s.place)).fold(f64::INFINITY, smaller));
    let errors: Vec<f64> = errors.filter(|e| *e < 0.5).collect();
    let seen = |k: &usize| owners.iter().filter(|o| **o == *k as f64).count() >= 10;
    let visible: Vec<usize> =
        (0..trees.len()).filter(|k| gap(trees[*k], [0.0; 2]) <= WITHIN).filter(seen).collect();
    let found = |k: &&usize| stems.iter().any(|s| gap(s.place, trees[**k]) < 0.5);
    let recall = visible.iter().filter(found).count() as f64 / visible.len().max(1) as f64;
    let precision = errors.len() as f64 / near.len().max(1) as f64;
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt();
    let of = format!("one turn of {file} in a stand of conifers, {} trees seen", visible.len());
    let figure = |name: &str, value: f64, limit: Limit, what: &str| {
        Figure::new(
            format!("forest.data.synthetic.{id}.{name}"),
            value,
            limit,
            format!("{line} {what}, {of}"),
        )
    };
    Ok(vec![
        figure("precision", precision, Limit::AtLeast(limits[0]), "share of the stems that are trees"),
        figure("recall", recall, Limit::AtLeast(limits[1]), "share of the trees that are found"),
        figure(
            "place",
            rms,
            if line == "F3" { Limit::AtMost(0.1) } else { Limit::None },
            "error of the places, m",
        ),
    ])
}

/// A cloud without beams against circles that were checked by hand; of 17 16 are clear by eye.
fn pine_plot(folder: &Path) -> Outcome<Figure> {
    let told = |e: las::Error| e.to_string();
    let mut reader = las::Reader::from_path(folder.join("pine_plot/pine_plot.laz")).map_err(told)?;
    let all = reader.read_all().map_err(told)?;
    let places = all.x().zip(all.y()).zip(all.z());
    let points = places.map(|((x, y), z)| Point::at([x, y, z])).collect();
    let scan = Scan { points, eye: None };
    let stems = Detector::default().detect(&scan).stems;
    let truth = table(&read(&folder.join("pine_plot/pine_plot_ref.csv"))?)?;
    let near = |t: &&Vec<f64>| stems.iter().any(|s| libm::hypot(s.place[0] - t[0], s.place[1] - t[1]) < 0.3);
    let found = truth.iter().filter(near).count() as f64;
    let what =
        format!("F5 stems of a pine plot that are found, of {} by hand; {} in all", truth.len(), stems.len());
    Ok(Figure::new("forest.data.pine-plot.found", found, Limit::AtLeast(14.0), what))
}

/// Rows of numbers behind a head.
fn table(text: &str) -> Outcome<Vec<Vec<f64>>> {
    let row = |line: &str| line.split([',', '\t']).map(|x| x.trim().parse().unwrap_or(f64::NAN)).collect();
    Ok(text.lines().skip(1).filter(|l| !l.trim().is_empty()).map(row).collect())
}

/// The map from the air is not sufficient without a prior: several poses explain the plot about as well.
fn from_the_air(folder: &Path) -> Outcome<Vec<Figure>> {
    let air = table(&read(&folder.join("treematcher/Air_Positions.txt"))?)?;
    let ground = table(&read(&folder.join("treematcher/Ground_Positions.txt"))?)?;
    let trees = air.iter().map(|r| MapTree { place: [r[2], r[3]], diameter: None }).collect();
    let map = TreeMap::new(trees).map_err(|e| e.to_string())?;
    let model = MatchModel { noise_m: 0.7, matched: 0.5, ..MatchModel::default() };
    let matcher = Matcher::with(map, model);
    let tree = |r: &Vec<f64>| LocalTree {
        place: [r[5], r[4]],
        deviation: 0.3,
        diameter: 0.01 * r[3],
        diameter_deviation: 0.02,
        sightings: 1,
    };
    let local: Vec<LocalTree> = ground.iter().map(tree).collect();
    let alone = matcher.find(&local, None);
    let refused = f64::from(u8::from(!matches!(alone, Answer::Located(_))));
    let what = format!(
        "F11 whether {} stems of a plot on {} trees from the air are refused without a prior",
        local.len(),
        air.len()
    );
    let mut out = vec![Figure::new("forest.data.treematcher.refused", refused, Limit::Equal(1.0), what)];
    // with a prior around the best pose its runner-up is reported
    if let Answer::Ambiguous(_, all) = &alone
        && let Some(best) = all.first()
    {
        let Pose2 { x, y, yaw } = best.pose;
        let prior = Prior { place: [x, y], radius: 10.0, yaw: Some([yaw, 5.0_f64.to_radians()]) };
        let again = matcher.find(&local, Some(&prior));
        let runner_up = match &again {
            Answer::Located(found) => {
                let Located { runner_up, found, .. } = &**found;
                runner_up / found.score
            }
            Answer::Ambiguous(_, all) => all.get(1).map_or(0.0, |f| f.score / all[0].score),
            Answer::Lost(_) => f64::NAN,
        };
        let what = "F11 score of the runner-up over that of the best pose, within 10 m and 5°";
        out.push(Figure::new("forest.data.treematcher.runner-up", runner_up, Limit::None, what));
    }
    Ok(out)
}
