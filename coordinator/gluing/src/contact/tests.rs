//! Ports of spheres and plates on planes, slopes and holes; what must not make a port; what must be refused.

use super::*;
use terraglue_diagnostics::error::Error;
use terraglue_ground::HeightField;
use terraglue_numerics::extremes::larger;
use terraglue_scenario::{TerrainKind, TerrainSpec};
use terraglue_subsystem::{
    BodyState, Capabilities, FieldInfo, FieldTile, Geometry, Input, Material, Pose, Response,
    Result as CallResult, Scene, SceneBody, SceneShape, Step, Subsystem, Terrain, component,
};
use terraglue_terrain as terrain;

const H: f64 = 1e-3;
const MOON: [f64; 3] = [0.0, 0.0, -1.62];

/// A ground that only shows its height.
struct Shown {
    field: HeightField,
    fields: [FieldInfo; 1],
}

impl Shown {
    fn of(terrain: &dyn Terrain) -> Self {
        let field = HeightField::from_terrain(terrain).expect("in range");
        let fields = [field.height_info()];
        Self { field, fields }
    }
}

impl Subsystem for Shown {
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }
    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> CallResult {
        Ok(())
    }
    fn fields(&self) -> &[FieldInfo] {
        &self.fields
    }
    fn field_tile(&self, _: usize, a: u32, b: u32) -> CallResult<FieldTile<'_>> {
        Ok(self.field.height_tile(a, b))
    }
}

/// A soil that shows nothing.
struct Mute;

impl Subsystem for Mute {
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }
    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> CallResult {
        Ok(())
    }
}

fn ground(kind: TerrainKind) -> Box<dyn Terrain> {
    terrain::build(&TerrainSpec { size_m: [2.0, 2.0], spacing_m: 0.01, kind }, 1).expect("sound")
}

fn slope(angle_rad: f64) -> Shown {
    Shown::of(&*ground(TerrainKind::Slope { angle_rad, heading_rad: 0.0 }))
}

/// One body per geometry, named foot0, foot1, …
fn scene(geometries: &[Geometry]) -> Scene {
    let name = |k: usize| format!("foot{k}");
    let shape = |(k, geometry): (usize, &Geometry)| SceneShape {
        id: 10 + k as u32,
        body: k as u32,
        name: name(k),
        geometry: geometry.clone(),
        body_from_shape: Pose::IDENTITY,
        collides: true,
        material: Material::UNKNOWN,
    };
    Scene {
        bodies: (0..geometries.len()).map(|k| SceneBody { name: name(k), mass: 1.0 }).collect(),
        shapes: geometries.iter().enumerate().map(shape).collect(),
        joints: Vec::new(),
    }
}

fn at(position: [f64; 3], linear_velocity: [f64; 3]) -> BodyState {
    let world_from_body = Pose { position, ..Pose::IDENTITY };
    BodyState { world_from_body, linear_velocity, ..BodyState::REST }
}

fn now() -> Now {
    Now { t: 0.0, h: H, gravity: MOON, margin: 1e-3 }
}

struct Fixture {
    soil: Box<dyn Subsystem>,
    detector: ContactDetector,
}

impl Fixture {
    fn new(soil: Box<dyn Subsystem>, geometries: &[Geometry], terrain: Option<&dyn Terrain>) -> Self {
        let scene = scene(geometries);
        let bodies = [BodySide { subsystem: 2, name: "robot", scene: &scene }];
        let grounds = [GroundSide { subsystem: 3, instance: &*soil }];
        let detector = ContactDetector::new(&bodies, &grounds, terrain).expect("has ground");
        Self { soil, detector }
    }

    fn detect(&mut self, states: &[BodyState]) -> terraglue_diagnostics::Result<&PortSet> {
        let soil = &*self.soil;
        self.detector.detect(&now(), |_| states, |_| soil)
    }
}

const SPHERE: Geometry = Geometry::Sphere { radius: 0.03 };

#[test]
fn a_sphere_on_a_slope_gets_its_normal_and_lowest_point() {
    for angle in [0.0, 0.1, 0.3f64] {
        let mut fixture = Fixture::new(Box::new(slope(angle)), &[SPHERE], None);
        // Centre so that the sphere touches the plane z = x·tan(angle) beside the origin, 0.2 mm deep.
        let n = [-angle.sin(), 0.0, angle.cos()];
        let d = 0.0298;
        let state = at([0.1 + n[0] * d, 0.05, 0.1 * angle.tan() + n[2] * d], [0.0; 3]);
        let set = fixture.detect(&[state]).expect("on the ground");
        assert_eq!((set.ports.len(), set.n, set.epoch), (1, 6, 1));
        let port = &set.ports[0];
        assert_eq!((port.mask, port.side, port.body, port.shape), (component::WRENCH, 1, 0, 10));
        assert_eq!(port.key, 2 << 48 | 3 << 32 | 10);
        for (k, n) in n.iter().enumerate() {
            assert!((port.frame[k] - n).abs() < 1e-6, "{angle}: {:?}", port.frame);
            let centre = state.world_from_body.position[k];
            assert!((port.origin[k] - (centre - 0.03 * n)).abs() < 1e-7);
        }
        // The smallest vertical gap over the nodes, times n_z, is the gap along the normal.
        let gap = (port.origin[2] - port.origin[0] * angle.tan()) * n[2];
        assert!((gap + 2e-4).abs() < 1e-7, "{gap}");
        assert_eq!(set.owners[0], PortOwner { subsystem: 2, ground: 3, body: 0, shape: 10 });
        assert!(port.nodes(&set.nodes).iter().all(|node| node.area > 0.0 && node.area <= 1e-4 + 1e-15));
    }
}

#[test]
fn frames_are_right_handed_with_t1_along_world_x() {
    let mut fixture = Fixture::new(Box::new(slope(0.25)), &[SPHERE], None);
    let set = fixture.detect(&[at([0.0, 0.0, 0.03], [0.0; 3])]).expect("on the ground");
    let f = set.ports[0].frame;
    assert!(f[3] > 0.0 && f[4].abs() < 1e-9);
    let cross = [f[1] * f[5] - f[2] * f[4], f[2] * f[3] - f[0] * f[5], f[0] * f[4] - f[1] * f[3]];
    for k in 0..3 {
        assert!((cross[k] - f[6 + k]).abs() < 1e-12);
    }
}

#[test]
fn a_hovering_foot_makes_no_port_and_a_falling_one_makes_it_a_step_ahead() {
    let mut fixture = Fixture::new(Box::new(slope(0.0)), &[SPHERE], None);
    let hovering = at([0.0, 0.0, 0.03 + 5e-3], [0.0; 3]);
    assert!(fixture.detect(&[hovering]).expect("fine").ports.is_empty());
    // 9 mm above, 10 m/s: touches within the millisecond.
    let falling = at([0.0, 0.0, 0.03 + 9e-3], [0.0, 0.0, -10.0]);
    assert_eq!(fixture.detect(&[falling]).expect("fine").ports.len(), 1);
    // 12 mm above it does not, margin included.
    let too_high = at([0.0, 0.0, 0.03 + 12e-3], [0.0, 0.0, -10.0]);
    assert!(fixture.detect(&[too_high]).expect("fine").ports.is_empty());
    // The tip of a spinning body moves though its centre rests.
    let mut spinning = at([0.0, 0.0, 0.03 + 5e-3], [0.0; 3]);
    spinning.angular_velocity = [0.0, 200.0, 0.0];
    assert_eq!(fixture.detect(&[spinning]).expect("fine").ports.len(), 1);
}

#[test]
fn keys_stay_and_the_epoch_counts_changes_of_the_set() {
    let mut fixture = Fixture::new(Box::new(slope(0.0)), &[SPHERE, SPHERE, SPHERE], None);
    let z = [0.03, 0.03, 0.03];
    let states = |z: [f64; 3]| -> Vec<BodyState> {
        (0..3).map(|k| at([0.3 * k as f64 - 0.3, 0.0, z[k]], [0.0; 3])).collect()
    };
    let keys = |set: &PortSet| set.ports.iter().map(|p| p.key & 0xffff).collect::<Vec<_>>();
    let set = fixture.detect(&states(z)).expect("fine");
    assert_eq!((keys(set), set.epoch, set.n), (vec![10, 11, 12], 1, 18));
    assert_eq!(fixture.detect(&states(z)).expect("fine").epoch, 1);
    let set = fixture.detect(&states([0.03, 0.2, 0.03])).expect("fine");
    assert_eq!((keys(set), set.epoch), (vec![10, 12], 2));
    assert_eq!(set.ports[1].first, 6);
    let set = fixture.detect(&states(z)).expect("fine");
    assert_eq!((keys(set), set.epoch), (vec![10, 11, 12], 3));
    assert_eq!(set.ports[1].first_node as usize, set.ports[0].nodes(&set.nodes).len());
}

#[test]
fn a_plate_carries_moments_over_its_half_lengths() {
    let plate = Geometry::Box { half_extents: [0.15, 0.1, 0.01] };
    let mut fixture = Fixture::new(Box::new(slope(0.0)), &[plate], None);
    let set = fixture.detect(&[at([0.003, 0.002, 0.0099], [0.0; 3])]).expect("fine");
    let port = &set.ports[0];
    assert_eq!((port.mask, set.n), (component::WRENCH, 6));
    assert!((port.extent[0] - 0.15).abs() < 1e-9 && (port.extent[1] - 0.1).abs() < 1e-9, "{:?}", port.extent);
    assert!((port.origin[0] - 0.003).abs() < 1e-9 && (port.origin[2] + 1e-4).abs() < 1e-9);
    let area: f64 = port.nodes(&set.nodes).iter().map(|n| n.area).sum();
    assert!((area - 0.06).abs() < 1e-9);
}

#[test]
fn a_sphere_smaller_than_a_cell_does_not_fall_between_the_nodes() {
    let mut fixture = Fixture::new(Box::new(slope(0.0)), &[Geometry::Sphere { radius: 0.003 }], None);
    let set = fixture.detect(&[at([0.005, 0.005, 0.0029], [0.0; 3])]).expect("fine");
    assert_eq!((set.ports.len(), set.nodes.len()), (1, 1));
    assert!((set.nodes[0].lower + 1e-4).abs() < 1e-9);
}

#[test]
fn a_ground_that_changes_is_seen_at_once() {
    let mut soil = slope(0.0);
    for j in 90..110 {
        for i in 90..110 {
            soil.field.set_units(i, j, -100_000);
        }
    }
    let mut fixture = Fixture::new(Box::new(soil), &[SPHERE], None);
    let deep = at([0.0, 0.0, 0.03], [0.0; 3]);
    assert!(fixture.detect(&[deep]).expect("fine").ports.is_empty(), "hangs over a hole of 24 mm");
    let beside = at([0.3, 0.0, 0.03], [0.0; 3]);
    assert_eq!(fixture.detect(&[beside]).expect("fine").ports.len(), 1);
}

#[test]
fn a_shape_beyond_the_ground_is_an_error_only_when_it_is_low() {
    let mut fixture = Fixture::new(Box::new(slope(0.0)), &[SPHERE], None);
    assert!(fixture.detect(&[at([1.5, 0.0, 0.5], [0.0; 3])]).expect("high above").ports.is_empty());
    match fixture.detect(&[at([1.5, 0.25, 0.03], [0.0; 3])]) {
        Err(Error::Simulation { message, .. }) => {
            for part in ["`foot0` of robot", "x = 1.500 m, y = 0.250 m", "x = -1 … 1 m"] {
                assert!(message.contains(part), "{message}");
            }
        }
        other => panic!("no error: {other:?}"),
    }
    let nowhere = at([f64::NAN, 0.0, 0.0], [0.0; 3]);
    assert!(matches!(fixture.detect(&[nowhere]), Err(Error::Simulation { .. })));
}

#[test]
fn a_soil_without_heights_is_read_as_the_terrain() {
    let terrain = ground(TerrainKind::Flat { height_m: 0.2 });
    let mut fixture = Fixture::new(Box::new(Mute), &[SPHERE], Some(&*terrain));
    assert_eq!(fixture.detect(&[at([0.0, 0.0, 0.23], [0.0; 3])]).expect("fine").ports.len(), 1);
    let scene = scene(&[SPHERE]);
    let bodies = [BodySide { subsystem: 0, name: "robot", scene: &scene }];
    let grounds = [GroundSide { subsystem: 1, instance: &Mute }];
    assert!(ContactDetector::new(&bodies, &grounds, None).is_err());
}

#[test]
fn the_frame_moves_smoothly_over_rolling_ground() {
    let kind = TerrainKind::Undulating {
        rms_m: 0.015,
        wavelengths_m: [0.3, 3.0],
        seed: Some(3),
        flat_radius_m: 0.0,
    };
    let terrain = ground(kind);
    let soil = Shown::of(&*terrain);
    let height = |x: f64| soil.field.height(((x + 1.0) / 0.01).round() as i32, 100);
    let positions: Vec<[f64; 3]> =
        (0..200).map(|k| f64::from(k) * 1e-3).map(|x| [x, 0.0, height(x) + 0.028]).collect();
    let mut fixture = Fixture::new(Box::new(Shown::of(&*terrain)), &[SPHERE], None);
    let mut before: Option<[f64; 9]> = None;
    for p in positions {
        let set = fixture.detect(&[at(p, [0.0; 3])]).expect("fine");
        let frame = set.ports[0].frame;
        if let Some(old) = before {
            let turn = (0..3).map(|k| (frame[k] - old[k]).abs()).fold(0.0, larger);
            assert!(turn < 4e-3, "the normal jumped by {turn} over 1 mm");
        }
        before = Some(frame);
    }
}

/// A fixture on level ground with one body that carries all the shapes.
fn one_body(parts: &[(Geometry, [f64; 3])]) -> Fixture {
    let geometries: Vec<Geometry> = parts.iter().map(|(g, _)| g.clone()).collect();
    let mut scene = scene(&geometries);
    scene.bodies.truncate(1);
    for (shape, (_, position)) in scene.shapes.iter_mut().zip(parts) {
        shape.body = 0;
        shape.body_from_shape = Pose { position: *position, ..Pose::IDENTITY };
    }
    let soil: Box<dyn Subsystem> = Box::new(slope(0.0));
    let bodies = [BodySide { subsystem: 2, name: "robot", scene: &scene }];
    let grounds = [GroundSide { subsystem: 3, instance: &*soil }];
    let detector = ContactDetector::new(&bodies, &grounds, None).expect("has ground");
    Fixture { soil, detector }
}

/// A plate, a foot under each end of it, and a ball beside all.
fn bridge() -> Vec<(Geometry, [f64; 3])> {
    let foot = Geometry::Box { half_extents: [0.02, 0.04, 0.02] };
    vec![
        (foot.clone(), [-0.1, 0.0, 0.02]),
        (SPHERE, [0.0, 0.3, 0.03]),
        (foot, [0.1, 0.0, 0.02]),
        (Geometry::Box { half_extents: [0.12, 0.04, 0.01] }, [0.0, 0.0, 0.05]),
    ]
}

#[test]
fn shapes_that_hang_together_are_one_contact() {
    let mut fixture = one_body(&bridge());
    let set = fixture.detect(&[at([0.002, 0.001, -1e-3], [0.0; 3])]).expect("on the ground");
    let keys: Vec<u64> = set.ports.iter().map(|p| p.key & 0xffff).collect();
    assert_eq!(keys, [10, 11]);
    let [piece, ball] = &set.ports[..] else { panic!("two ports") };
    assert_eq!((piece.mask, ball.mask, set.n), (component::WRENCH, component::WRENCH, 12));
    assert_eq!((set.owners[0].shape, piece.body), (10, 0));
    let nodes = piece.nodes(&set.nodes);
    let mut seen: Vec<[i32; 2]> = nodes.iter().map(|n| [n.i, n.j]).collect();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), nodes.len(), "each node once");
    let area: f64 = nodes.iter().map(|n| n.area).sum();
    assert!((area - 2.0 * 0.04 * 0.08).abs() < 1e-9, "{area}");
    assert!(nodes.iter().all(|n| (n.lower + 1e-3).abs() < 1e-12));
    // The way from one foot to the other and half a foot more.
    assert!((piece.origin[2] + 1e-3).abs() < 1e-12 && piece.extent[0] <= 0.12 + 1e-12, "{piece:?}");
}

#[test]
fn a_part_that_does_not_touch_changes_nothing_but_the_key() {
    let post = Geometry::Capsule { half_length: 0.1, radius: 0.01 };
    let mut joined = one_body(&[(post, [0.0, 0.0, 0.16]), (SPHERE, [0.0, 0.0, 0.03])]);
    let mut alone = one_body(&[(SPHERE, [0.0, 0.0, 0.03])]);
    let state = [at([0.003, -0.002, -2e-3], [0.1, 0.0, -0.2])];
    let alone = alone.detect(&state).expect("on the ground");
    let joined = joined.detect(&state).expect("on the ground");
    assert_eq!(alone.nodes, joined.nodes);
    let [a, b] = [&alone.ports[0], &joined.ports[0]];
    assert_eq!((a.mask, a.origin, a.frame, a.extent), (b.mask, b.origin, b.frame, b.extent));
    assert_eq!((b.mask, b.key & 0xffff, b.shape), (component::WRENCH, 10, 11));
}

#[test]
fn a_small_part_is_buried_only_with_all_of_its_piece() {
    // A rib of 5 mm below a block, 2 cm deep.
    let parts = [
        (Geometry::Box { half_extents: [0.05, 0.05, 0.05] }, [0.0, 0.0, 0.05]),
        (Geometry::Box { half_extents: [0.002, 0.05, 0.0025] }, [0.0, 0.0, -0.0024]),
    ];
    let mut fixture = one_body(&parts);
    let set = fixture.detect(&[at([0.0, 0.0, -0.02], [0.0; 3])]).expect("fine");
    assert_eq!(set.ports.len(), 1);
    assert_eq!(fixture.detector.buried(), None);
    fixture.detect(&[at([0.0, 0.0, -0.25], [0.0; 3])]).expect("fine");
    assert!(fixture.detector.buried().is_some_and(|why| why.contains("`foot0` of robot")));
}
