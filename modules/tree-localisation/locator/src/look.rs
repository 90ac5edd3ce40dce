//! From the points of a scan to the trees around the machine, in its frame turned level.

use crate::cloud::Cloud;
use crate::own::OwnBodies;
use crate::settings::Settings;
use terraglue_subsystem::{Error, Pose, Result, World};
use terraglue_tree_localisation::{
    Detector, Filter, LocalTree, NO_BODY, NO_RING, Point, Pose2, Scan, Volume,
};

/// Trees that scans of a step show.
#[derive(Default)]
pub(crate) struct Sighting {
    /// Local map of each scan.
    pub maps: Vec<Vec<LocalTree>>,
    /// Stems that stand where the machine itself is.
    pub own_stems: usize,
    /// Sectors that the machine hides from a scanner, the most of any, rad.
    pub hidden: f64,
}

/// Looks at scans; keeps the numbers of the machine's bodies.
#[derive(Default)]
pub(crate) struct Looker {
    own: Option<OwnBodies>,
    boxes: Vec<Volume>,
}

/// How the machine stands and moves while it scans.
pub(crate) struct Attitude {
    /// Speed along x, m/s, and rate of turning about the vertical, rad/s.
    pub speed: f64,
    pub turn_rate: f64,
    /// Turns directions of the mount into its frame turned level.
    level: Pose,
}

impl Attitude {
    /// With this roll and pitch, rad.
    pub fn new([speed, turn_rate]: [f64; 2], [roll, pitch]: [f64; 2]) -> Self {
        let [(sr, cr), (sp, cp)] = [roll, pitch].map(|a| (libm::sin(0.5 * a), libm::cos(0.5 * a)));
        let level = Pose { orientation: [cp * cr, cp * sr, sp * cr, -sp * sr], ..Pose::IDENTITY };
        Self { speed, turn_rate, level }
    }
}

/// How far beyond its boxes a stem still counts as the machine itself, m.
const BESIDE: f64 = 0.2;
/// Values of the mask: by the body of a point, by the boxes around bodies.
const BY_BODY: usize = 1;
const BY_VOLUME: usize = 2;

impl Looker {
    /// Stems of the scan at an input.
    pub fn see(
        &mut self,
        settings: &mut Settings,
        (input, cloud): (usize, &Cloud),
        attitude: &Attitude,
        mask: usize,
        world: &dyn World,
        out: &mut Sighting,
    ) -> Result {
        let mount = &settings.mount;
        let wanted = format!("{}/{}", mount.subsystem(), mount.body());
        if !cloud.frame.is_empty() && cloud.frame != wanted {
            let why = format!(
                "the points at `points_{input}` lie in the frame of `{}`; mount that scanner on `{}`, the body of the \
                 parameter `mount`",
                cloud.frame.replacen('/', ".", 1),
                wanted.replacen('/', ".", 1),
            );
            return Err(Error::Failed(why));
        }
        let filter = self.filter(settings, (mask, attitude), world)?;
        let own = self.own.as_ref().map_or(u32::MAX, |own| own.subsystem);
        let scan = straightened(settings, cloud, own, attitude);
        let detector = Detector { filter, ..Detector::default() };
        let found = detector.detect(&scan);
        let is_own = |place: [f64; 2]| {
            let inside =
                |v: &Volume, k: usize| place[k] >= v.low[k] - BESIDE && place[k] <= v.high[k] + BESIDE;
            self.boxes.iter().any(|v| inside(v, 0) && inside(v, 1))
        };
        out.own_stems += found.stems.iter().filter(|s| is_own(s.place)).count();
        out.hidden = out.hidden.max(detector.filter.hidden(&scan).iter().map(|[a, b]| b - a).sum());
        out.maps.push(found.stems.iter().map(LocalTree::from).collect());
        Ok(())
    }

    /// The filter of a scan, with the present boxes around the bodies.
    fn filter(
        &mut self,
        settings: &mut Settings,
        (mask, attitude): (usize, &Attitude),
        world: &dyn World,
    ) -> Result<Filter> {
        let frame = settings.mount.state(world, world.time())?.world_from_body;
        let own = match self.own.take() {
            Some(own) => own,
            None => OwnBodies::find(&settings.own_bodies, &settings.mount, world)?,
        };
        own.volumes([&frame, &attitude.level], world, world.time(), &mut self.boxes);
        let filter = Filter {
            range_m: settings.range_m,
            own_bodies: if mask == BY_BODY { own.bodies.clone() } else { Vec::new() },
            own_volumes: if mask == BY_VOLUME { self.boxes.clone() } else { Vec::new() },
            ..Filter::default()
        };
        self.own = Some(own);
        Ok(filter)
    }
}

/// Points of a turn in the frame of the machine at its end, turned level: its motion during the turn is removed.
fn straightened(settings: &Settings, cloud: &Cloud, own: u32, attitude: &Attitude) -> Scan {
    let Attitude { speed, turn_rate, level } = attitude;
    let base = settings.mount.body_from_sensor();
    let pose = cloud.pose.unwrap_or(Pose::IDENTITY);
    let place = |p: [f64; 3]| {
        let point = pose.point(p);
        level.turned(base.turned_back([0, 1, 2].map(|k| point[k] - base.position[k])))
    };
    let points = cloud.points.iter().map(|p| {
        let [x, y, z] = place(p.position);
        let then = Pose2 { x: speed * p.time, y: 0.0, yaw: turn_rate * p.time };
        let [x, y] = then.place([x, y]);
        Point {
            position: [x, y, z],
            ring: p.ring.unwrap_or(NO_RING),
            body: p.on.filter(|(s, _)| *s == own).map_or(NO_BODY, |(_, body)| body),
        }
    });
    Scan { points: points.collect(), eye: Some(place([0.0; 3])) }
}
