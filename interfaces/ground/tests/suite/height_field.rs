//! Heights, mass, sinkage and snapshots of the height field and of the tile map.

use proptest::prelude::*;
use terraglue_ground::{HeightField, HeightSnapshot, Lattice, TileMap, TileMapSnapshot, UNIT_M};
use terraglue_subsystem::{Terrain, TerrainTile, TileValues};

const LATTICE: Lattice = Lattice { origin: [-1.0, -0.5], spacing: 0.01, size: [201, 101] };

struct Wavy;

impl Wavy {
    fn at(i: i64, j: i64) -> f64 {
        0.01 * ((i * 7 + j * 13) % 17) as f64
    }
}

impl Terrain for Wavy {
    fn origin(&self) -> [f64; 2] {
        LATTICE.origin
    }
    fn spacing(&self) -> f64 {
        LATTICE.spacing
    }
    fn size(&self) -> [u32; 2] {
        LATTICE.size
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        for b in 0..nj {
            for a in 0..ni {
                out[b * ni + a] = Self::at((i0 + a as i64).clamp(0, 200), (j0 + b as i64).clamp(0, 100));
            }
        }
        TerrainTile::Varied
    }
}

#[test]
fn heights_come_from_the_terrain_to_half_a_unit() {
    let field = HeightField::from_terrain(&Wavy).expect("in range");
    for (i, j) in [(0, 0), (31, 31), (32, 31), (200, 100), (77, 64)] {
        assert!((field.height(i, j) - Wavy::at(i64::from(i), i64::from(j))).abs() <= 0.5 * UNIT_M);
    }
    assert_eq!(field.height(-5, 300), field.height(0, 100));
    assert!(HeightField::flat(LATTICE, 600.0).is_err() && HeightField::flat(LATTICE, f64::NAN).is_err());
}

#[test]
fn untouched_flat_ground_stays_one_number_per_tile() {
    let mut field = HeightField::flat(LATTICE, 0.25).expect("in range");
    assert_eq!(field.total_units(), 201 * 101 * (1 << 20));
    field.set_units(40, 3, 5);
    assert_eq!(field.touched(), &[1]);
    assert!(matches!(field.height_tile(0, 0).values, TileValues::Uniform(h) if h == 0.25));
    assert!(matches!(field.sinkage_tile(2, 1).values, TileValues::Uniform(0.0)));
    assert_eq!(field.height_tile(1, 0).values.at(3 * 32 + 8), 5.0 * UNIT_M);
    assert_eq!(field.sinkage_tile(1, 0).values.at(3 * 32 + 8), 0.25 - 5.0 * UNIT_M);
    assert_eq!((field.generation(1), field.generation(0)), (1, 0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn moved_material_is_neither_made_nor_lost(
        moves in prop::collection::vec((0..201i32, 0..101i32, 0..201i32, 0..101i32, 1..100_000i32), 1..200),
    ) {
        let mut field = HeightField::from_terrain(&Wavy).expect("in range");
        let start = field.clone();
        for (i, j, k, l, amount) in moves {
            field.add_units(i, j, -amount);
            field.add_units(k, l, amount);
        }
        prop_assert_eq!(field.total_units(), start.total_units());
        prop_assert_eq!(field.gained_units(), 0);
        for j in 0..101 {
            for i in 0..201 {
                prop_assert_eq!(field.initial_units(i, j), start.units(i, j));
            }
        }
    }

    #[test]
    fn restored_fields_equal_the_saved_ones(
        writes in prop::collection::vec((0..201i32, 0..101i32, -1000..1000i32), 2..120),
        cut in 0.0..1.0f64,
    ) {
        let cut = (cut * writes.len() as f64) as usize;
        let mut field = HeightField::from_terrain(&Wavy).expect("in range");
        let mut map = TileMap::new(LATTICE, 7.0, 4);
        let (mut saved, mut saved_map) = (HeightSnapshot::default(), TileMapSnapshot::default());
        let write = |field: &mut HeightField, map: &mut TileMap<f64>, (i, j, u): (i32, i32, i32)| {
            field.add_units(i, j, u);
            *map.get_mut(i, j) += f64::from(u);
        };
        writes[..cut].iter().for_each(|w| write(&mut field, &mut map, *w));
        field.save(&mut saved);
        map.save(&mut saved_map);
        let (kept, kept_map) = (field.clone(), map.clone());
        writes[cut..].iter().for_each(|w| write(&mut field, &mut map, *w));
        field.restore(&saved);
        map.restore(&saved_map);
        for j in 0..101 {
            for i in 0..201 {
                prop_assert_eq!(field.units(i, j), kept.units(i, j));
                prop_assert_eq!(field.sinkage_units(i, j), kept.sinkage_units(i, j));
                prop_assert_eq!(map.get(i, j), kept_map.get(i, j));
            }
        }
        prop_assert_eq!(map.touched(), kept_map.touched());
        prop_assert_eq!(field.touched(), kept.touched());
    }

    #[test]
    fn any_order_of_saving_and_going_back_gives_the_saved_contents(
        actions in prop::collection::vec((0..7u32, 0..2usize, 0..201i32, 0..101i32, -1000..1000i32), 2..150),
    ) {
        let mut field = HeightField::from_terrain(&Wavy).expect("in range");
        let mut map = TileMap::new(LATTICE, 7.0, 4);
        let mut slots: [(HeightSnapshot, TileMapSnapshot<f64>); 2] = Default::default();
        let mut models = [None, None];
        for (action, slot, i, j, u) in actions {
            match (action, &models[slot]) {
                (0, _) => {
                    field.save(&mut slots[slot].0);
                    map.save(&mut slots[slot].1);
                    models[slot] = Some((field.clone(), map.clone()));
                }
                (1, Some((heights, values))) => {
                    let before: Vec<u64> = (0..28).map(|t| field.generation(t)).collect();
                    let old = field.clone();
                    field.restore(&slots[slot].0);
                    map.restore(&slots[slot].1);
                    for tile in 0..28 {
                        prop_assert_eq!(field.tile(tile), heights.tile(tile));
                        prop_assert_eq!(map.tile(tile), values.tile(tile));
                        // readers take an unchanged number for unchanged contents
                        prop_assert!(field.generation(tile) != before[tile] || field.tile(tile) == old.tile(tile));
                    }
                    prop_assert_eq!(field.gained_units(), heights.gained_units());
                    prop_assert_eq!(field.touched(), heights.touched());
                    // a field that was made anew from the same terrain
                    let mut other = HeightField::from_terrain(&Wavy).expect("in range");
                    other.restore(&slots[slot].0);
                    (0..28).for_each(|tile| assert_eq!(other.tile(tile), heights.tile(tile)));
                }
                _ => {
                    field.add_units(i, j, u);
                    *map.get_mut(i, j) += f64::from(u);
                }
            }
        }
    }
}
