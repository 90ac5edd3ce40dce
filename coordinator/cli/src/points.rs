//! `--points FILE`: the points that all scanners of a recording have seen, in the world, as LAS or LAZ.
//!
//! Points lie in the frame of a body at their own times, so the pose of the body is interpolated between those that were recorded. In the file
//! the GPS time is the simulated time, the source of a point the number of its stream from 1 on in the order of their names, and the user data its ring.

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use prost::Message;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use terraglue_diagnostics::Result;
use terraglue_recording::{PoseSeries, RECORDING, Recording, STREAM, at};
use terraglue_scenario::InputError;

/// Unit of places in the file, m.
const SCALE: f64 = 1e-4;
/// Schema of the streams that are written.
const CLOUD: &str = "foxglove.PointCloud";

/// Refuses a name that ends in neither `.las` nor `.laz`.
pub fn check(path: &Path) -> Result<()> {
    if ends_in(path, "las") || ends_in(path, "laz") {
        return Ok(());
    }
    let message = format!("--points {}: points are written as .las or .laz", path.display());
    Err(InputError::plain(message, Some("e.g. --points scan.laz".into())).into())
}

/// Writes the points of the recording in a folder; the answer is how many.
///
/// # Errors
/// The recording has no points, or cannot be read; the file has another ending, or cannot be written.
pub fn write(folder: &Path, path: &Path) -> Result<u64> {
    check(path)?;
    let poses = Recording::open(folder)?.poses;
    let recording = folder.join(RECORDING);
    let bytes = terraglue_subsystem::files::read(&recording).map_err(at(&recording))?;
    let clouds = clouds(&bytes);
    if clouds.is_empty() {
        let message = format!("--points {}: {} has no points", path.display(), recording.display());
        let help =
            format!("points come from streams of {CLOUD}, which `terraglue modules laser-scanner` offers");
        return Err(InputError::plain(message, Some(help)).into());
    }
    // under another name until it is complete
    let part = path.with_extension(if ends_in(path, "laz") { "part.laz" } else { "part.las" });
    let written = write_all(&clouds, &poses, &part);
    match written {
        Ok(count) => std::fs::rename(&part, path).map_err(at(path)).map(|()| count),
        Err(why) => {
            drop(std::fs::remove_file(&part));
            Err(at(path)(std::io::Error::other(why)))
        }
    }
}

fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// Messages of streams of points, with their names; what is damaged ends them.
fn clouds(bytes: &[u8]) -> Vec<(String, PointCloud)> {
    let options = mcap::read::Options::IgnoreEndMagic.into();
    let messages = mcap::MessageStream::new_with_options(bytes, options).into_iter().flatten();
    let messages = messages.map_while(|message| message.ok()).filter_map(|message| {
        let own = message.channel.schema.as_ref().is_some_and(|s| s.name == CLOUD);
        let name = message.channel.metadata.get(STREAM).filter(|_| own)?;
        Some((name.clone(), PointCloud::decode(&message.data[..]).ok()?))
    });
    messages.collect()
}

type Poses = BTreeMap<String, PoseSeries>;

fn write_all(
    clouds: &[(String, PointCloud)],
    poses: &Poses,
    path: &Path,
) -> std::result::Result<u64, las::Error> {
    let mut builder = las::Builder::from((1, 2));
    let scale = las::Transform { scale: SCALE, offset: 0.0 };
    builder.transforms = las::Vector { x: scale, y: scale, z: scale };
    builder.point_format = las::point::Format::new(1)?;
    builder.generating_software = "terraglue".into();
    // the same run gives the same bytes on any day
    builder.date = None;
    let mut writer = las::Writer::from_path(path, builder.into_header()?)?;
    let names: BTreeSet<&String> = clouds.iter().map(|(name, _)| name).collect();
    let mut count = 0;
    for (name, cloud) in clouds {
        let source = names.iter().take_while(|other| **other <= name).count();
        for point in points(cloud, poses) {
            writer.write_point(las::Point { point_source_id: source as u16, ..point })?;
            count += 1;
        }
    }
    writer.close()?;
    Ok(count)
}

/// Points of a message in the world; none where its frame has no poses.
fn points<'a>(cloud: &'a PointCloud, poses: &'a Poses) -> impl Iterator<Item = las::Point> + 'a {
    let end = cloud.timestamp.map_or(0.0, |t| f64::from(t.sec()) + 1e-9 * f64::from(t.nsec()));
    let pose = cloud.pose.unwrap_or_default();
    let (p, q) = (pose.position.unwrap_or_default(), pose.orientation);
    let q = q.map_or(Quaternion::identity(), |q| Quaternion::new(q.w, q.x, q.y, q.z));
    let body_from_cloud =
        Isometry3::from_parts(Translation3::new(p.x, p.y, p.z), UnitQuaternion::from_quaternion(q));
    let is_world = cloud.frame_id.is_empty() || cloud.frame_id == "world";
    let series = poses.get(&cloud.frame_id);
    let known = is_world || series.is_some();
    let field = |name: &str| cloud.fields.iter().find(|f| f.name == name);
    let [x, y, z, time, intensity, ring] = ["x", "y", "z", "time", "intensity", "ring"].map(field);
    let stride = (cloud.point_stride as usize).max(1);
    cloud.data.chunks_exact(stride).filter(move |_| known).filter_map(move |data| {
        let own = Point3::new(number(x?, data)?, number(y?, data)?, number(z?, data)?);
        let t = end + time.and_then(|f| number(f, data)).unwrap_or(0.0);
        let world_from_body = series.map_or(Isometry3::identity(), |s| pose_at(s, t));
        let place = world_from_body * body_from_cloud * own;
        let bright = intensity.and_then(|f| number(f, data)).unwrap_or(0.0);
        place.iter().all(|x| x.is_finite()).then(|| las::Point {
            x: place.x,
            y: place.y,
            z: place.z,
            intensity: (65535.0 * bright).round() as u16,
            gps_time: Some(t),
            return_number: 1,
            number_of_returns: 1,
            user_data: ring.and_then(|f| number(f, data)).unwrap_or(0.0) as u8,
            ..las::Point::default()
        })
    })
}

/// A number of a point.
fn number(field: &PackedElementField, point: &[u8]) -> Option<f64> {
    let at = field.offset as usize;
    macro_rules! read {
        ($t:ty) => {
            point.get(at..at + size_of::<$t>())?.try_into().map(<$t>::from_le_bytes).ok().map(|x| x as f64)
        };
    }
    match field.r#type() {
        NumericType::Unknown => None,
        NumericType::Uint8 => read!(u8),
        NumericType::Int8 => read!(i8),
        NumericType::Uint16 => read!(u16),
        NumericType::Int16 => read!(i16),
        NumericType::Uint32 => read!(u32),
        NumericType::Int32 => read!(i32),
        NumericType::Float32 => read!(f32),
        NumericType::Float64 => read!(f64),
    }
}

/// The pose at a time between two that were recorded; before the first and after the last one, that one.
fn pose_at(series: &PoseSeries, t: f64) -> Isometry3<f64> {
    let of = |k: usize| {
        let [w, i, j, l] = series.orientation[k];
        let q = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, l));
        Isometry3::from_parts(Vector3::from(series.position[k]).into(), q)
    };
    let after = series.t_s.partition_point(|s| *s <= t);
    match (after.checked_sub(1), after < series.t_s.len()) {
        (Some(k), true) => {
            let share = (t - series.t_s[k]) / (series.t_s[after] - series.t_s[k]);
            of(k).try_lerp_slerp(&of(after), share, 1e-12).unwrap_or_else(|| of(k))
        }
        (Some(k), false) => of(k),
        (None, true) => of(0),
        (None, false) => Isometry3::identity(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_between_two_is_interpolated() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let series = PoseSeries {
            t_s: vec![1.0, 2.0],
            position: vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]],
            orientation: vec![[1.0, 0.0, 0.0, 0.0], [half, 0.0, 0.0, half]],
        };
        let middle = pose_at(&series, 1.5);
        assert!((middle.translation.vector - Vector3::new(1.0, 0.0, 0.0)).norm() < 1e-12);
        assert!((middle.rotation.angle() - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
        assert_eq!(pose_at(&series, 0.0), pose_at(&series, 1.0));
        assert_eq!(pose_at(&series, 9.0), pose_at(&series, 2.0));
    }

    #[test]
    fn only_names_of_las_and_laz_are_taken() {
        assert!(check(Path::new("a.laz")).is_ok() && check(Path::new("a.LAS")).is_ok());
        assert!(check(Path::new("a.xyz")).is_err() && check(Path::new("laz")).is_err());
    }
}
