//! Properties of a world apart from the right hit: times, masks, hidden shapes, ties, threads, grounds and odd input.

use random_scenes::{Heights, Random, STEP, drawn, lend, rays, scenes};
use std::sync::Arc;
use terraglue_numerics::rotation::quaternion;
use terraglue_subsystem::{
    BodyRef, BodyState, FieldTile, GROUND, Geometry, JointKind, JointVariables, Material, MaterialClass,
    Pose, Ray, RayHit, RayMask, Scene, SceneBody, SceneJoint, SceneShape, ShapeRef, TileValues, World,
};
use terraglue_world::{Error, Parallel, WorldBuilder, WorldModel, fixed_bodies};

fn at(position: [f64; 3]) -> BodyState {
    BodyState { world_from_body: Pose { position, ..Pose::IDENTITY }, ..BodyState::REST }
}

/// A scene with a body for each geometry, with ids 10, 20, …
fn scene(geometries: &[Geometry]) -> Scene {
    let body = |k: usize| SceneBody { name: format!("body{k}"), mass: 1.0 };
    let shape = |k: usize| SceneShape {
        id: 10 * (k as u32 + 1),
        body: k as u32,
        name: format!("shape{k}"),
        geometry: geometries[k].clone(),
        body_from_shape: Pose::IDENTITY,
        collides: false,
        material: Material::UNKNOWN,
    };
    let n = geometries.len();
    Scene { bodies: (0..n).map(body).collect(), shapes: (0..n).map(shape).collect(), joints: Vec::new() }
}

fn ball(radius: f64) -> Geometry {
    Geometry::Sphere { radius }
}

/// Alone, named `a`.
fn alone(scene: &Scene, states: &[BodyState], is_fixed: bool) -> WorldModel {
    let mut builder = WorldBuilder::new();
    builder.subsystem("a", scene, states, &vec![is_fixed; states.len()]).expect("a scene");
    builder.build(0.0)
}

fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
    Ray { origin, direction, time: 0.0, range: f64::INFINITY }
}

fn hit(world: &WorldModel, ray: Ray, mask: &RayMask) -> RayHit {
    let mut hits = [RayHit::MISS];
    world.cast_rays(&[ray], mask, &mut hits);
    hits[0]
}

/// Along x from the origin.
fn ahead(world: &WorldModel, mask: &RayMask) -> RayHit {
    hit(world, ray([0.0; 3], [1.0, 0.0, 0.0]), mask)
}

fn bits(hit: &RayHit) -> [u64; 9] {
    let m = hit.material;
    let [x, y, z] = hit.normal.map(f64::to_bits);
    let material = u64::from(m.class) << 32 | u64::from(m.reflectance.to_bits());
    let of = [hit.subsystem, hit.body, hit.shape].map(u64::from);
    [hit.distance.to_bits(), x, y, z, of[0], of[1], of[2], material, u64::from(m.transmittance.to_bits())]
}

#[test]
fn a_ray_meets_a_moving_body_where_it_is_at_its_own_time() {
    let mut world = alone(&scene(&[ball(0.5)]), &[at([5.0, 0.0, 0.0])], false);
    world.update([1.0, 3.0]).bodies(0, &[at([5.0, 0.0, 0.0])], &[at([9.0, 0.0, 0.0])]).expect("states");
    for (time, distance) in [(1.0, 4.5), (1.5, 5.5), (3.0, 8.5), (0.0, 4.5), (7.0, 8.5)] {
        let ray = Ray { time, ..ray([0.0; 3], [1.0, 0.0, 0.0]) };
        assert!((hit(&world, ray, &RayMask::ALL).distance - distance).abs() < 1e-12, "{time}");
    }
    let body = world.body("a", "body0").expect("a body");
    let place = |time| world.pose(body, time).expect("a pose").world_from_body.position[0];
    assert_eq!((place(1.0), place(2.0), place(3.0)), (5.0, 7.0, 9.0));
    // what is not moved again has come to rest
    drop(world.update([3.0, 4.0]));
    let body = world.body("a", "body0").expect("a body");
    assert_eq!(world.pose(body, 3.0).expect("a pose").world_from_body.position[0], 9.0);
    assert_eq!(world.time(), 4.0);
    let still = alone(&scene(&[ball(0.5)]), &[BodyState::REST], true);
    assert!(world.moves(0) && !still.moves(0) && !still.moves(1));
}

#[test]
fn a_turning_box_shows_its_corner_half_way() {
    let cube = Geometry::Box { half_extents: [1.0; 3] };
    let mut world = alone(&scene(&[cube]), &[at([5.0, 0.0, 0.0])], false);
    let mut after = at([5.0, 0.0, 0.0]);
    after.world_from_body.orientation = quaternion([0.0, 0.0, std::f64::consts::FRAC_PI_2]);
    world.update([0.0, 1.0]).bodies(0, &[at([5.0, 0.0, 0.0])], &[after]).expect("states");
    for (time, distance) in [(0.0, 4.0), (0.5, 5.0 - 2.0_f64.sqrt()), (1.0, 4.0)] {
        let ray = Ray { time, ..ray([0.0, 1e-9, 0.0], [1.0, 0.0, 0.0]) };
        let found = hit(&world, ray, &RayMask::ALL).distance;
        assert!((found - distance).abs() < 1e-8, "{time}: {found}");
    }
}

#[test]
fn masks_and_hidden_shapes_let_a_ray_through() {
    let mut things = scene(&[ball(0.5), ball(0.5), ball(0.5)]);
    things.shapes[1].material = Material::of(MaterialClass::FOLIAGE, 0.3);
    let states = [at([2.0, 0.0, 0.0]), at([4.0, 0.0, 0.0]), at([6.0, 0.0, 0.0])];
    for is_fixed in [true, false] {
        let mut world = alone(&things, &states, is_fixed);
        let first = |world: &WorldModel, mask| ahead(world, &mask).shape;
        assert_eq!(first(&world, RayMask::ALL), 10);
        assert_eq!(first(&world, RayMask::without(BodyRef { subsystem: 0, body: 0 })), 20);
        assert_eq!(first(&world, RayMask { classes: 1 << MaterialClass::FOLIAGE.0, ..RayMask::ALL }), 20);
        assert!(!ahead(&world, &RayMask::without(BodyRef::all_of(0))).is_hit());
        assert!(!ahead(&world, &RayMask { sees: RayMask::THE_GROUND, ..RayMask::ALL }).is_hit());
        world.update([0.0, 1.0]).visibility(0, &[false, false, true]).expect("flags");
        assert_eq!(first(&world, RayMask::ALL), 30);
        assert!(!world.is_visible(ShapeRef { subsystem: 0, body: 0, shape: 10 }));
        world.update([1.0, 2.0]).visibility(0, &[true; 3]).expect("flags");
        assert_eq!(first(&world, RayMask::ALL), 10);
        assert!(world.is_visible(ShapeRef { subsystem: 0, body: 0, shape: 10 }));
        assert!(!world.is_visible(ShapeRef { subsystem: 0, body: 1, shape: 10 }));
    }
}

#[test]
fn of_two_at_one_distance_the_first_name_and_then_the_lowest_id_counts() {
    let one = scene(&[ball(0.5), ball(0.5)]);
    let states = [at([3.0, 0.0, 0.0]); 2];
    for names in [["a", "b"], ["b", "a"]] {
        for fixed in [[true, true], [false, true], [true, false], [false, false]] {
            let mut builder = WorldBuilder::new();
            for (name, fixed) in names.iter().zip(fixed) {
                builder.subsystem(name, &one, &states, &[fixed; 2]).expect("a scene");
            }
            let world = builder.build(0.0);
            let found = ahead(&world, &RayMask::ALL);
            assert_eq!((names[found.subsystem as usize], found.shape), ("a", 10), "{fixed:?}");
        }
    }
}

#[test]
fn nothing_depends_on_the_order_of_subsystems() {
    let (pieces, heights) = scenes(5, 300);
    let rays = rays(5, 300, 3000);
    let answers = [[0, 1, 2], [2, 0, 1], [1, 2, 0]].map(|order| {
        let world = drawn(&pieces, &heights, &order, None).expect("a world");
        let mut hits = vec![RayHit::MISS; rays.len()];
        world.cast_rays(&rays, &RayMask::ALL, &mut hits);
        let renumbered = |h: &RayHit| match h.is_hit() {
            true => bits(&RayHit { subsystem: order[h.subsystem as usize] as u32, ..*h }),
            false => bits(h),
        };
        hits.iter().map(renumbered).collect::<Vec<_>>()
    });
    assert!(answers[0] == answers[1] && answers[0] == answers[2]);
}

/// That many threads.
fn threads(n: usize) -> Parallel {
    Arc::new(move |count, job| {
        std::thread::scope(|scope| {
            for first in 0..n {
                scope.spawn(move || (first..count).step_by(n).for_each(job));
            }
        });
    })
}

#[test]
fn nothing_depends_on_threads_or_on_how_rays_are_batched() {
    let (pieces, heights) = scenes(6, 200);
    let rays = rays(6, 200, 5000);
    let cast = |parallel| {
        let world = drawn(&pieces, &heights, &[0, 1, 2], parallel).expect("a world");
        let mut hits = vec![RayHit::MISS; rays.len()];
        world.cast_rays(&rays, &RayMask::ALL, &mut hits);
        (world, hits.iter().map(bits).collect::<Vec<_>>())
    };
    let (world, one) = cast(None);
    assert!([1, 2, 5].into_iter().all(|n| cast(Some(threads(n))).1 == one));
    let single = rays.iter().map(|ray| bits(&hit(&world, *ray, &RayMask::ALL)));
    assert!(single.eq(one));
}

fn level(size: [u32; 2], spacing: f64) -> Heights {
    let values = vec![0.25; (size[0] * size[1]) as usize];
    Heights { origin: [-1.0, -2.0], spacing, size, values }
}

/// A ground alone, of the subsystem `soil`.
fn ground(heights: &Heights, generation: u64) -> WorldModel {
    let mut builder = WorldBuilder::new();
    builder.subsystem("soil", &Scene::default(), &[], &[]).expect("no bodies");
    builder.ground(0, &heights.info()).expect("a ground");
    let mut world = builder.build(0.0);
    show(&mut world, heights, generation);
    world
}

fn show(world: &mut WorldModel, heights: &Heights, generation: u64) {
    let tiles = heights.tiles();
    world.update([0.0, 1.0]).ground(0, lend(&tiles, heights, generation)).expect("heights");
}

fn height(world: &WorldModel, at: [f64; 2]) -> f64 {
    let mut heights = [0.0];
    world.ground_heights(&[at], &mut heights);
    heights[0]
}

fn down(world: &WorldModel, [x, y]: [f64; 2]) -> RayHit {
    hit(world, ray([x, y, 5.0], [0.0, 0.0, -1.0]), &RayMask::ALL)
}

#[test]
fn a_footprint_is_seen_as_soon_as_its_generation_is_new() {
    let mut heights = level([100, 70], 0.05);
    let mut world = ground(&heights, 1);
    let place = [0.6 + 0.3 * 0.05, 0.6 + 0.2 * 0.05];
    let found = down(&world, place);
    assert!((found.distance - 4.75).abs() < 1e-12 && found.normal == [0.0, 0.0, 1.0]);
    assert_eq!((found.body, found.shape, found.material.class), (GROUND, GROUND, MaterialClass::SOIL.0));
    // the node on the corner of four tiles
    let (i, j) = (32, 32);
    heights.values[(j * 100 + i) as usize] = 0.15;
    show(&mut world, &heights, 1);
    assert!((height(&world, [0.6, -0.4]) - 0.25).abs() < 1e-12, "the generation is the old one");
    show(&mut world, &heights, 2);
    assert!((height(&world, [0.6, -0.4]) - 0.15).abs() < 1e-12);
    for (dx, dy) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        let at = [0.6 + dx * 0.0125, -0.4 + dy * 0.0125];
        let (seen, told) = (5.0 - down(&world, at).distance, height(&world, at));
        // half way down on the sides with the diagonal, a quarter from the rim on the others
        let right = if dx * dy > 0.0 { 0.20 } else { 0.175 };
        assert!((seen - right).abs() < 1e-12 && (told - right).abs() < 1e-12, "{dx} {dy}: {seen} {told}");
    }
}

#[test]
fn a_node_on_the_rim_of_a_tile_moves_the_cells_of_the_tiles_before_it() {
    let mut heights = level([100, 70], 0.05);
    let mut world = ground(&heights, 1);
    heights.values[32 * 100 + 32] = 0.15;
    let tiles = heights.tiles();
    // of the tile of the node alone the generation is new
    let lend = |a: u32, b: u32| {
        let generation = if (a, b) == (1, 1) { 2 } else { 1 };
        Some(FieldTile { generation, values: TileValues::F64(&tiles[(b * 4 + a) as usize]) })
    };
    world.update([0.0, 1.0]).ground(0, lend).expect("heights");
    for (dx, dy, right) in [(-1.0, -1.0, 0.20), (1.0, -1.0, 0.175), (-1.0, 1.0, 0.175), (1.0, 1.0, 0.20)] {
        let at = [0.6 + dx * 0.0125, -0.4 + dy * 0.0125];
        let (seen, told) = (5.0 - down(&world, at).distance, height(&world, at));
        assert!((seen - right).abs() < 1e-12 && (told - right).abs() < 1e-12, "{dx} {dy}: {seen} {told}");
    }
}

#[test]
fn nothing_slips_through_level_ground_at_any_height() {
    let mut random = Random::new(9);
    for h in [0.0, -0.0, 1e-300, -1e-9, 1e-7, 0.25, -3.0, 1000.0] {
        let mut heights = level([401, 401], 0.01);
        heights.values.fill(h);
        let world = ground(&heights, 1);
        for k in 0..2000 {
            // aimed at a point of the ground, at every second time at a node
            let mut place = |low: f64| low + 0.01 * (1.0 + 398.0 * random_part(&mut random, k));
            let target = [place(-1.0), place(-2.0), h];
            let origin =
                [random.between(-1.0, 3.0), random.between(-2.0, 2.0), h + random.between(0.01, 5.0)];
            let way: [f64; 3] = std::array::from_fn(|c| target[c] - origin[c]);
            let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
            let found = hit(&world, ray(origin, way.map(|c| c / length)), &RayMask::ALL);
            assert!((found.distance - length).abs() < 1e-9 * (1.0 + h.abs()), "{h}: {found:?} for {length}");
        }
    }
}

/// A part of 1 in hundredths of a cell, or in whole cells of 398.
fn random_part(random: &mut Random, k: usize) -> f64 {
    let part = random.between(0.0, 1.0);
    if k.is_multiple_of(2) { part } else { (398.0 * part).round() / 398.0 }
}

#[test]
fn nothing_slips_through_the_ground_at_nodes_and_edges() {
    let mut random = Random::new(4);
    let mut heights = level([67, 40], 0.1);
    heights.values.iter_mut().for_each(|h| *h = random.between(-0.01, 0.01));
    // flatter than any ray below, so that none grazes a ridge; one tile stays level
    (0..32 * 32).for_each(|k| heights.values[k / 32 * 67 + k % 32] = 0.0);
    let world = ground(&heights, 1);
    let mut rays = Vec::new();
    for _ in 0..20_000 {
        let (i, j) = (1 + random.below(64) as u32, 1 + random.below(37) as u32);
        // a node, one of the edges to the next ones, or the diagonal
        let [a, b] = [[(0, 0), (0, 0)], [(0, 0), (1, 0)], [(0, 0), (0, 1)], [(1, 0), (0, 1)]]
            [random.below(4)]
        .map(|(a, b)| heights.point(i + a, j + b));
        let part = [0.0, 0.5, random.unit()][random.below(3)];
        let target: [f64; 3] = std::array::from_fn(|k| a[k] + part * (b[k] - a[k]));
        let from = if random.below(3) == 0 {
            [target[0], target[1], 3.0]
        } else {
            [random.between(0.0, 4.0), random.between(-1.0, 1.0), 3.0]
        };
        let way: [f64; 3] = std::array::from_fn(|k| target[k] - from[k]);
        let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
        // a little more than to the surface: whoever slips through meets nothing
        rays.push(Ray { range: length + 1e-6, ..ray(from, way.map(|x| x / length)) });
    }
    let mut hits = vec![RayHit::MISS; rays.len()];
    world.cast_rays(&rays, &RayMask::ALL, &mut hits);
    assert_eq!(hits.iter().filter(|h| !h.is_hit()).count(), 0);
}

#[test]
fn a_ground_in_other_tiles_or_from_below_is_the_same_ground() {
    let mut heights = level([75, 50], 0.1);
    let mut random = Random::new(9);
    heights.values.iter_mut().for_each(|h| *h = random.between(-0.2, 0.2));
    let mut builder = WorldBuilder::new();
    builder.subsystem("soil", &Scene::default(), &[], &[]).expect("no bodies");
    let info = terraglue_subsystem::FieldInfo { tile_edge: 20, ..heights.info() };
    builder.ground(0, &info).expect("a ground");
    let mut other = builder.build(0.0);
    let values = |a: u32, b: u32| -> Vec<f32> {
        let node = |k: u32| (20 * a + k % 20, 20 * b + k / 20);
        (0..400)
            .map(node)
            .map(|(i, j)| if i < 75 && j < 50 { heights.at(i, j) as f32 } else { 0.0 })
            .collect()
    };
    let tiles: Vec<_> = (0..12).map(|k| values(k % 4, k / 4)).collect();
    let lend = |a: u32, b: u32| {
        Some(FieldTile { generation: 1, values: TileValues::F32(&tiles[(b * 4 + a) as usize]) })
    };
    other.update([0.0; 2]).ground(0, lend).expect("heights");
    heights.values.iter_mut().for_each(|h| *h = f64::from(*h as f32));
    let world = ground(&heights, 1);
    for _ in 0..500 {
        let at = [random.between(-1.0, 6.4), random.between(-2.0, 2.9)];
        let (a, b) = (down(&world, at), down(&other, at));
        assert_eq!(bits(&a), bits(&b));
        assert!((5.0 - a.distance - height(&world, at)).abs() < 1e-12);
        let below = hit(&world, ray([at[0], at[1], -5.0], [0.0, 0.0, 1.0]), &RayMask::ALL);
        assert!((a.distance + below.distance - 10.0).abs() < 1e-12 && below.normal[2] < 0.0);
    }
    for outside in [[-1.1, 0.0], [6.5, 0.0], [0.0, 3.0], [f64::NAN, 0.0]] {
        assert!(height(&world, outside).is_nan() && !down(&world, outside).is_hit(), "{outside:?}");
    }
}

/// A ball of triangles: an octahedron whose sides are halved again and again.
fn globe(rounds: u32) -> Geometry {
    let mut points = vec![
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    let mut triangles =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..rounds {
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |a: u32, b: u32| {
                let sum: [f64; 3] = std::array::from_fn(|k| points[a as usize][k] + points[b as usize][k]);
                let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                let point = sum.map(|x| x / length);
                let known = points.iter().position(|p| *p == point);
                known.unwrap_or_else(|| {
                    points.push(point);
                    points.len() - 1
                }) as u32
            };
            let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
            finer.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
        triangles = finer;
    }
    Geometry::ConvexMesh { points, triangles }
}

#[test]
fn nothing_slips_out_of_a_closed_mesh() {
    let geometry = globe(3);
    let Geometry::ConvexMesh { points, triangles } = &geometry else { panic!("a mesh") };
    let turn = BodyState {
        world_from_body: Pose { position: [1.0, 2.0, 3.0], orientation: quaternion([0.3, -0.7, 0.4]) },
        ..BodyState::REST
    };
    let mut random = Random::new(1);
    let targets: Vec<[f64; 3]> = (triangles.iter().flat_map(|[a, b, _]| [[*a, *a], [*a, *b]]))
        .map(|[a, b]| std::array::from_fn(|k| 0.5 * (points[a as usize][k] + points[b as usize][k])))
        .collect();
    for is_fixed in [true, false] {
        let world = alone(&scene(std::slice::from_ref(&geometry)), &[turn], is_fixed);
        for target in &targets {
            let start = random.point(0.5);
            let world_of = |p: [f64; 3]| {
                let turned = terraglue_numerics::rotation::turned(turn.world_from_body.orientation, p);
                std::array::from_fn::<f64, 3, _>(|k| turned[k] + turn.world_from_body.position[k])
            };
            let (from, to) = (world_of(start), world_of(*target));
            let way: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
            let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
            let found = hit(&world, ray(from, way.map(|x| x / length)), &RayMask::ALL);
            assert!((found.distance - length).abs() < 1e-9, "{found:?} {length}");
        }
    }
}

#[test]
fn a_world_far_from_its_origin_looks_the_same() {
    let (pieces, heights) = scenes(8, 100);
    let near = drawn(&pieces, &heights, &[0, 1, 2], None).expect("a world");
    let far = [500_000.0, 5_600_000.0, 300.0];
    let away = |p: [f64; 3]| std::array::from_fn::<f64, 3, _>(|k| p[k] + far[k]);
    let move_all = |states: &[BodyState]| -> Vec<BodyState> {
        let moved = |s: &BodyState| {
            let p = s.world_from_body;
            BodyState { world_from_body: Pose { position: away(p.position), ..p }, ..*s }
        };
        states.iter().map(moved).collect()
    };
    let mut builder = WorldBuilder::new();
    for piece in &pieces {
        let states = move_all(piece.states().0);
        builder.subsystem(&piece.name, &piece.scene, &states, &piece.is_fixed()).expect("a scene");
    }
    let mut world = builder.build(STEP[0]);
    let (before, after) = pieces[0].states();
    world.update(STEP).bodies(0, &move_all(before), &move_all(after)).expect("states");
    let rays = rays(8, 100, 2000);
    let mask = RayMask { sees: RayMask::SHAPES, ..RayMask::ALL };
    let mut different = 0;
    for ray in &rays {
        let (a, b) = (hit(&near, *ray, &mask), hit(&world, Ray { origin: away(ray.origin), ..*ray }, &mask));
        different += u32::from(a.shape != b.shape || a.is_hit() && (a.distance - b.distance).abs() > 1e-6);
    }
    // what grazes may differ
    assert!(different <= 2, "{different} of 2000");
}

#[test]
fn everything_that_a_short_ray_meets_is_found_by_a_sphere() {
    let (pieces, heights) = scenes(3, 60);
    let mut world = drawn(&pieces, &heights, &[0, 1, 2], None).expect("a world");
    // the sphere sees the end of the step
    let mut random = Random::new(2);
    let (mut met, mut alone) = (0, 0);
    for _ in 0..100 {
        let (centre, radius) = (random.point(4.0), random.between(0.1, 1.5));
        let mut found = vec![ShapeRef { subsystem: 9, body: 9, shape: 9 }];
        world.overlap(centre, radius, &RayMask::ALL, &mut found);
        assert!(found.is_sorted() && found.iter().all(|s| s.subsystem < 3));
        let mut seen: Vec<ShapeRef> = Vec::new();
        for _ in 0..400 {
            let ray = Ray { range: radius, time: STEP[1], ..ray(centre, random.direction()) };
            let hit = hit(&world, ray, &RayMask::ALL);
            let of = ShapeRef { subsystem: hit.subsystem, body: hit.body, shape: hit.shape };
            if hit.is_hit() && !seen.contains(&of) {
                seen.push(of);
            }
        }
        assert!(seen.iter().all(|s| found.contains(s)), "{seen:?} {found:?}");
        met += seen.len();
        alone += found.len() - seen.len();
    }
    // the rest lies behind others, contains the centre, or is barely touched
    assert!(met > 50 && alone < met, "{met} {alone}");
    world.update(STEP).visibility(1, &vec![false; pieces[1].scene.shapes.len()]).expect("flags");
    let mut found = Vec::new();
    world.overlap([0.0; 3], 10.0, &RayMask::ALL, &mut found);
    assert!(!found.is_empty() && found.iter().all(|s| s.subsystem != 1));
}

#[test]
fn a_sphere_inside_a_solid_touches_it_and_inside_an_open_mesh_does_not() {
    let sheet = Geometry::Mesh {
        points: vec![[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [0.0, 1.0, 1.0]],
        triangles: vec![[0, 1, 2]],
    };
    for is_fixed in [true, false] {
        let geometries = [ball(1.0), globe(1), sheet.clone()];
        let world = alone(&scene(&geometries), &[BodyState::REST; 3], is_fixed);
        let touched = |z: f64, radius: f64| {
            let mut found = Vec::new();
            world.overlap([0.0, 0.0, z], radius, &RayMask::ALL, &mut found);
            found.iter().map(|s| s.shape).collect::<Vec<_>>()
        };
        assert_eq!((touched(0.0, 0.01), touched(0.0, 1.01)), (vec![10, 20], vec![10, 20, 30]));
        assert_eq!((touched(1.2, 0.1), touched(1.2, 0.21)), (vec![], vec![10, 20, 30]));
        assert!(touched(f64::NAN, 1.0).is_empty() && touched(0.0, -1.0).is_empty());
    }
}

#[test]
fn a_sphere_touches_the_ground_above_beside_and_below() {
    let mut heights = level([40, 40], 0.1);
    heights.values[20 * 40 + 20] = 1.25;
    let world = ground(&heights, 1);
    let touches = |centre, radius| {
        let mut found = Vec::new();
        world.overlap(centre, radius, &RayMask::ALL, &mut found);
        found == [ShapeRef { subsystem: 0, body: GROUND, shape: GROUND }]
    };
    assert!(
        touches([0.0, 0.0, 0.3], 0.06) && !touches([0.0, 0.0, 0.3], 0.04) && touches([0.0, 0.0, -3.0], 0.1)
    );
    // beside the spike, and beyond the rim
    assert!(touches([1.15, 0.0, 1.0], 0.15) && !touches([1.15, 0.0, 1.0], 0.08));
    assert!(touches([-1.2, 0.0, 0.3], 0.22) && !touches([-1.2, 0.0, 0.3], 0.18));
}

#[test]
fn what_is_odd_is_refused_or_not_seen() {
    let mut builder = WorldBuilder::new();
    let one = scene(&[ball(0.5)]);
    builder.subsystem("a", &one, &[at([2.0, 0.0, 0.0])], &[false]).expect("a scene");
    assert!(matches!(builder.subsystem("a", &one, &[BodyState::REST], &[true]), Err(Error::Name(_))));
    assert!(matches!(builder.subsystem("b", &one, &[], &[true]), Err(Error::Count { given: 0, .. })));
    assert!(matches!(builder.ground(7, &level([2, 2], 1.0).info()), Err(Error::Name(_))));
    assert!(matches!(builder.ground(0, &level([2, 2], -1.0).info()), Err(Error::Lattice { .. })));
    let odd = [
        ball(f64::NAN),
        ball(-1.0),
        Geometry::Ellipsoid { semi_axes: [1.0, 0.0, 1.0] },
        Geometry::Mesh { points: vec![[0.0; 3]], triangles: vec![[0, 0, 1]] },
        Geometry::Mesh { points: vec![[f64::INFINITY; 3]], triangles: vec![] },
    ];
    for geometry in odd {
        let refused = builder.subsystem("b", &scene(&[geometry]), &[BodyState::REST], &[true]);
        let text = refused.expect_err("a shape that is none").to_string();
        assert!(text.starts_with("shape `shape0` of b: "), "{text}");
    }
    let mut world = builder.build(0.0);
    let good = ahead(&world, &RayMask::ALL);
    assert_eq!(good.distance, 1.5);
    assert!(world.update([0.0; 2]).bodies(3, &[], &[]).is_err());
    assert!(world.update([0.0; 2]).bodies(0, &[], &[]).is_err());
    assert!(world.update([0.0; 2]).visibility(0, &[]).is_err());
    assert!(world.update([0.0; 2]).ground(0, |_, _| None).is_err());
    let ahead_of = |ray: Ray| hit(&world, ray, &RayMask::ALL).distance;
    let plain = ray([0.0; 3], [1.0, 0.0, 0.0]);
    assert_eq!(
        ahead_of(Ray { direction: [5.0, 0.0, 0.0], ..plain }),
        1.5,
        "a direction that is no unit vector"
    );
    assert_eq!(
        (ahead_of(Ray { range: 1.5, ..plain }), ahead_of(Ray { range: 1.49, ..plain })),
        (1.5, f64::INFINITY)
    );
    for bad in [
        Ray { direction: [0.0; 3], ..plain },
        Ray { direction: [f64::NAN, 0.0, 0.0], ..plain },
        Ray { origin: [f64::INFINITY, 0.0, 0.0], ..plain },
        Ray { range: f64::NAN, ..plain },
        Ray { range: 0.0, ..plain },
        Ray { range: -1.0, ..plain },
        Ray { time: f64::NAN, ..plain },
    ] {
        assert_eq!(ahead_of(bad), f64::INFINITY, "{bad:?}");
    }
    world.update([0.0; 2]).bodies(0, &[at([0.0; 3])], &[at([f64::NAN, 0.0, 0.0])]).expect("states");
    assert!(!ahead(&world, &RayMask::ALL).is_hit(), "at no place");
}

#[test]
fn ten_thousand_shapes_at_one_place_are_no_matter() {
    let mut random = Random::new(1);
    for (geometry, distance) in
        [(ball(0.5), 4.5), (Geometry::Box { half_extents: [0.0; 3] }, 5.0), (globe(0), 4.0)]
    {
        for is_fixed in [true, false] {
            let n = 10_000;
            let place = [5.0, 0.0, 0.0];
            let states: Vec<_> = (0..n).map(|_| at(place)).collect();
            let world = alone(&scene(&vec![geometry.clone(); n]), &states, is_fixed);
            let found = ahead(&world, &RayMask::ALL);
            assert_eq!((found.distance, found.shape), (distance, 10));
            let off = random.direction();
            assert!(!hit(&world, ray([0.0, 1e-3, 0.0], off), &RayMask::ALL).normal[0].is_nan());
        }
    }
}

#[test]
fn an_empty_world_is_empty() {
    let world = WorldBuilder::new().build(0.0);
    assert!(!ahead(&world, &RayMask::ALL).is_hit() && height(&world, [0.0; 2]).is_nan());
    assert!(world.pose(BodyRef { subsystem: 0, body: 0 }, 0.0).is_none() && world.scene(0).is_none());
}

#[test]
fn bodies_that_hang_on_the_world_for_ever_are_fixed() {
    let mut tree = scene(&[ball(0.1), ball(0.1), ball(0.1), ball(0.1)]);
    let joint = |parent: u32, child: u32, kind, action: &str| SceneJoint {
        name: format!("joint{child}"),
        parent,
        child,
        parent_from_joint: Pose::IDENTITY,
        axis: [0.0; 3],
        kind,
        limits: [0.0; 2],
        variables: JointVariables::ABSENT,
        break_action: action.into(),
    };
    // listed from the end of the chain on
    tree.joints = vec![
        joint(0, 1, JointKind::Fixed, ""),
        joint(1, 2, JointKind::Revolute, ""),
        joint(SceneJoint::WORLD, 0, JointKind::Fixed, ""),
        joint(0, 3, JointKind::Fixed, "break joint3"),
    ];
    assert_eq!(fixed_bodies(&tree), [true, true, false, false]);
}
