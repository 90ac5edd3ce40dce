//! Procedural terrain against its numbers; elevation files against what is in them and what is wrong with them.

use super::*;
use std::path::{Path, PathBuf};
use terraglue_ground::HeightField;
use terraglue_numerics::extremes::larger;
use terraglue_scenario::Greys;

fn spec(kind: TerrainKind) -> TerrainSpec {
    TerrainSpec { size_m: [6.0, 4.0], spacing_m: 0.02, kind }
}

fn heights(terrain: &dyn Terrain) -> Vec<f64> {
    let [nx, ny] = terrain.size().map(|n| n as usize);
    let mut out = vec![0.0; nx * ny];
    terrain.heights(0, 0, nx, ny, &mut out);
    out
}

fn reference(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/terrain").join(name)
}

fn failure<T>(result: Result<T>) -> String {
    match result {
        Err(terraglue_diagnostics::Error::Input(e)) => {
            format!("{}; {}", e.message, e.help.clone().unwrap_or_default())
        }
        Err(e) => panic!("another kind of error: {e}"),
        Ok(_) => panic!("accepted"),
    }
}

#[test]
fn flat_ground_is_centred_and_uniform() {
    let ground = build(&spec(TerrainKind::Flat { height_m: 0.3 }), 1).expect("sound");
    assert_eq!((ground.size(), ground.origin()), ([301, 201], [-3.0, -2.0]));
    let mut out = [0.0; 6];
    let tile = ground.heights(-2, 199, 2, 3, &mut out);
    assert_eq!((tile, out), (terraglue_subsystem::TerrainTile::Uniform(0.3), [0.3; 6]));
}

#[test]
fn a_slope_rises_along_its_heading() {
    let kind = TerrainKind::Slope { angle_rad: 0.2, heading_rad: std::f64::consts::FRAC_PI_2 };
    let h = heights(&*build(&spec(kind), 1).expect("sound"));
    assert!((h[200 * 301 + 150] - 2.0 * 0.2f64.tan()).abs() < 1e-12);
    assert!((h[100 * 301] - 0.0).abs() < 1e-12);
}

fn undulating(seed: u64, flat_radius_m: f64) -> Vec<f64> {
    let kind =
        TerrainKind::Undulating { rms_m: 0.015, wavelengths_m: [0.3, 3.0], seed: Some(seed), flat_radius_m };
    heights(&*build(&spec(kind), 1).expect("sound"))
}

#[test]
fn undulating_ground_has_its_rms_seed_and_wavelengths() {
    let h = undulating(5, 0.0);
    let rms = (h.iter().map(|h| h * h).sum::<f64>() / h.len() as f64).sqrt();
    assert!((rms - 0.015).abs() < 1e-15, "{rms}");
    assert_eq!(h, undulating(5, 0.0));
    assert_ne!(h, undulating(6, 0.0));
    // Waves of at least 0.3 m bound the curvature: |h''| ≤ Σ a·k², far below that of a wave of two cells.
    let bend = |i: usize| (h[i + 1] - 2.0 * h[i] + h[i - 1]).abs();
    let largest = (1..300).map(|i| bend(100 * 301 + i)).fold(0.0, larger);
    assert!(largest > 1e-6 && largest < 0.06 * (TAU_OVER_SHORTEST * 0.02) * (TAU_OVER_SHORTEST * 0.02));
}
const TAU_OVER_SHORTEST: f64 = std::f64::consts::TAU / 0.3;

#[test]
fn undulating_ground_is_flat_around_the_start_when_asked() {
    let h = undulating(5, 0.5);
    assert_eq!(h[100 * 301 + 150], 0.0);
    assert_eq!(h[100 * 301 + 150 + 24], 0.0);
    let rms = (h.iter().map(|h| h * h).sum::<f64>() / h.len() as f64).sqrt();
    assert!((rms - 0.015).abs() < 1e-15);
    let kind =
        TerrainKind::Undulating { rms_m: 0.01, wavelengths_m: [0.3, 3.0], seed: None, flat_radius_m: 9.0 };
    assert!(failure(build(&spec(kind), 1)).contains("flat_radius_m = 9"));
    let kind =
        TerrainKind::Undulating { rms_m: 0.01, wavelengths_m: [0.03, 3.0], seed: None, flat_radius_m: 0.0 };
    assert!(failure(build(&spec(kind), 1)).contains("from 0.04 m on"));
}

#[test]
fn a_crater_keeps_depth_rim_and_slope() {
    let max_slope_rad = 15.0f64.to_radians();
    let profile = Profile::new(3.0, 0.4, 0.1, max_slope_rad).expect("fits");
    assert!((profile.height(0.0) + 0.3).abs() < 1e-12 && (profile.height(1.5) - 0.1).abs() < 1e-12);
    assert_eq!(profile.height(10.0), 0.0);
    let slope =
        |k: i32| (profile.height(f64::from(k + 1) * 1e-3) - profile.height(f64::from(k) * 1e-3)) / 1e-3;
    let steepest = (0..3000).map(|k| slope(k).abs()).fold(0.0, larger);
    assert!(steepest <= max_slope_rad.tan() + 1e-9 && steepest > 0.26);
    assert!((profile.steepest() - steepest).abs() < 1e-6);
    let message = failure(Profile::new(3.0, 0.5, 0.1, max_slope_rad));
    assert!(
        message.contains("max_slope_rad above 0.3218") && message.contains("depth_m below 0.4019"),
        "{message}"
    );
    // The values that the message advises are accepted.
    assert!(
        Profile::new(3.0, 0.5, 0.1, 0.3219).is_ok() && Profile::new(3.0, 0.4019, 0.1, max_slope_rad).is_ok()
    );
}

#[test]
fn an_esri_grid_is_read_north_up_and_centred() {
    let raster = read_esri_ascii(&reference("hill.asc"), None, None).expect("whole");
    assert_eq!((raster.size, raster.step, raster.corner), ([4, 3], [0.5, 0.5], [100.25, 200.25]));
    assert_eq!(raster.heights[0], 9.0);
    assert_eq!(raster.heights[11], 4.0);
    let kind = TerrainKind::EsriAscii { file: reference("hill.asc"), fill_m: None };
    let ground = build(&TerrainSpec { size_m: [0.0; 2], spacing_m: 0.0, kind }, 1).expect("sound");
    assert_eq!((ground.size(), ground.origin(), ground.spacing()), ([4, 3], [-0.75, -0.5], 0.5));
    assert!(HeightField::from_terrain(&*ground).is_ok());
}

#[test]
fn broken_esri_grids_say_file_line_and_numbers() {
    let message = failure(read_esri_ascii(&reference("truncated.asc"), None, None));
    assert!(message.contains("truncated.asc:8: expected 12 values (4 × 3), found 7"), "{message}");
    let message = failure(read_esri_ascii(&reference("hole.asc"), None, None));
    assert!(message.contains("hole.asc:8: missing data (-9999)") && message.contains("fill_m"), "{message}");
    assert_eq!(read_esri_ascii(&reference("hole.asc"), Some(0.5), None).expect("filled").heights[5], 0.5);
    let folder = tempfile::tempdir().expect("folder");
    let bad = |text: &str| {
        let path = folder.path().join("bad.asc");
        std::fs::write(&path, text).expect("written");
        failure(read_esri_ascii(&path, None, None))
    };
    assert!(bad("ncols 2\nnrows 2\ncellsize 1\n1 2\n3 x\n").contains("bad.asc:5: `x` is not a number"));
    assert!(bad("ncols 2\nnrows 2\ncellsize 0\n1 2\n3 4\n").contains("bad.asc:3: `cellsize` = 0"));
    assert!(bad("ncols 2\nnrows 2.5\ncellsize 1\n").contains("bad.asc:2: `nrows` = 2.5"));
    assert!(bad("ncols 2\nnrows 2\n1 2 3 4\n").contains("no `cellsize`"));
    assert!(bad("ncolumns 2\n").contains("unknown key `ncolumns`"));
    assert!(bad("").contains("no `ncols`"));
    assert!(failure(read_esri_ascii(&reference("absent.asc"), None, None)).contains("absent.asc"));
}

#[test]
fn a_written_grid_reads_back() {
    let lattice = lattice_of([70, 40], 0.01);
    let mut field = HeightField::flat(lattice, 0.0).expect("in range");
    for k in 0..40 {
        field.add_units(k + 20, k, 1000 * k - 700);
    }
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("ground.asc");
    write_esri_ascii(&path, &field.height_info(), |a, b| Ok(field.height_tile(a, b))).expect("written");
    let raster = read_esri_ascii(&path, None, None).expect("whole");
    assert_eq!(raster.size, [70, 40]);
    assert!((raster.corner[0] - lattice.origin[0]).abs() < 1e-12);
    for (k, h) in raster.heights.iter().enumerate() {
        assert!((h - field.height(k as i32 % 70, k as i32 / 70)).abs() <= 0.6e-7);
    }
}

#[test]
fn resampling_is_bilinear_and_stays_centred() {
    let raster = Raster {
        size: [5, 4],
        step: [1.0, 0.5],
        corner: [0.0; 2],
        heights: (0..20).map(|k| 2.0 * f64::from(k % 5) + 3.0 * 0.5 * f64::from(k / 5)).collect(),
    };
    assert!(failure(resample("dem.tif", raster.clone(), 0.0)).contains("not square"));
    let grid = resample("dem.tif", raster, 0.25).expect("fits");
    assert_eq!(grid.lattice.size, [17, 7]);
    for j in 0..7 {
        for i in 0..17 {
            let [x, y] = grid.lattice.position(i, j);
            let exact = 2.0 * (x + 2.0) + 3.0 * (y + 0.75);
            assert!((grid.height(i.into(), j.into()) - exact).abs() < 1e-12);
        }
    }
}

fn write_tiff(path: &Path, keys: &[u16], nodata: &str, values: &[f32]) {
    use tiff::encoder::{TiffEncoder, colortype::Gray32Float};
    use tiff::tags::Tag;
    let mut encoder = TiffEncoder::new(std::fs::File::create(path).expect("created")).expect("tiff");
    let mut image = encoder.new_image::<Gray32Float>(3, 2).expect("image");
    image.encoder().write_tag(Tag::ModelPixelScaleTag, &[0.5, 0.5, 0.0][..]).expect("tag");
    image.encoder().write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 7.0, 9.0, 0.0][..]).expect("tag");
    image.encoder().write_tag(Tag::GeoKeyDirectoryTag, keys).expect("tag");
    image.encoder().write_tag(Tag::GdalNodata, nodata).expect("tag");
    image.write_data(values).expect("data");
}

#[test]
fn a_geotiff_is_read_and_its_faults_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("dem.tif");
    let metres = [1, 1, 0, 1, 1024, 0, 1, 1];
    write_tiff(&path, &metres, "-3.4028234663852886e+38", &[1.0, 2.0, 3.0, 4.0, 5.0, f32::MIN]);
    assert!(failure(read_geotiff(&path, None, None)).contains("missing data"));
    let raster = read_geotiff(&path, Some(0.25), None).expect("filled");
    assert_eq!(raster.heights, [4.0, 5.0, 0.25, 1.0, 2.0, 3.0]);
    assert_eq!((raster.size, raster.step, raster.corner), ([3, 2], [0.5, 0.5], [7.0, 8.5]));
    let whole = std::fs::read(&path).expect("read");
    write_tiff(&path, &[1, 1, 0, 1, 1024, 0, 1, 2], "-1", &[1.0; 6]);
    assert!(failure(read_geotiff(&path, None, None)).contains("degrees"));
    std::fs::write(&path, &whole[..40]).expect("written");
    assert!(failure(read_geotiff(&path, None, None)).contains("dem.tif"));
    std::fs::write(&path, "no image").expect("written");
    assert!(failure(read_geotiff(&path, None, None)).contains("not a TIFF file"));
}

fn write_png(path: &Path, color: ::png::ColorType, depth: ::png::BitDepth, data: &[u8]) {
    let mut encoder = ::png::Encoder::new(std::fs::File::create(path).expect("created"), 3, 2);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().expect("header").write_image_data(data).expect("data");
}

#[test]
fn a_greyscale_image_is_read_and_its_faults_are_named() {
    use ::png::{BitDepth, ColorType};
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("hills.png");
    let greys = Greys { pixel_m: 0.5, low_m: -1.0, high_m: 4.1 };
    write_png(&path, ColorType::Grayscale, BitDepth::Eight, &[0, 51, 102, 153, 204, 255]);
    let raster = read_png(&path, greys, None, None).expect("eight bits");
    // the upper row is the one of the largest y
    for (found, expected) in raster.heights.iter().zip([2.06, 3.08, 4.1, -1.0, 0.02, 1.04]) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    assert_eq!((raster.size, raster.step), ([3, 2], [0.5; 2]));
    let sixteen = [0, 0, 0, 1, 1, 0, 128, 0, 255, 254, 255, 255];
    write_png(&path, ColorType::Grayscale, BitDepth::Sixteen, &sixteen);
    let raster =
        read_png(&path, Greys { low_m: 0.0, high_m: 65.535, ..greys }, None, None).expect("sixteen bits");
    for (found, expected) in raster.heights.iter().zip([32.768, 65.534, 65.535, 0.0, 0.001, 0.256]) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    let clear = [9, 255, 9, 255, 9, 0, 9, 255, 9, 255, 9, 255];
    write_png(&path, ColorType::GrayscaleAlpha, BitDepth::Eight, &clear);
    assert!(failure(read_png(&path, greys, None, None)).contains("transparent"));
    assert_eq!(read_png(&path, greys, Some(7.0), None).expect("filled").heights[5], 7.0);
    write_png(&path, ColorType::Rgb, BitDepth::Eight, &[0; 18]);
    assert!(failure(read_png(&path, greys, None, None)).contains("coloured"));
    let whole = std::fs::read(&path).expect("read");
    std::fs::write(&path, &whole[..40]).expect("written");
    assert!(failure(read_png(&path, greys, None, None)).contains("hills.png"));
    std::fs::write(&path, "no image").expect("written");
    assert!(failure(read_png(&path, greys, None, None)).contains("not a PNG image"));
}

#[test]
fn files_that_declare_more_than_fits_are_refused_before_they_are_read() {
    use ::png::{BitDepth, ColorType};
    let folder = tempfile::tempdir().expect("folder");
    let at = |name: &str| folder.path().join(name);
    // the data end after six points: only what the head declares can be what is refused
    std::fs::write(at("big.asc"), "ncols 1000000\nnrows 1000000\ncellsize 1\n1 2 3 4 5 6\n")
        .expect("written");
    write_tiff(&at("big.tif"), &[1, 1, 0, 1, 1024, 0, 1, 1], "-1", &[1.0; 6]);
    let mut bytes = std::fs::read(at("big.tif")).expect("read");
    // width, length, rows of a strip
    for tag in [256_u16, 257, 278] {
        let entry =
            [tag.to_le_bytes(), 4_u16.to_le_bytes(), 1_u16.to_le_bytes(), 0_u16.to_le_bytes()].concat();
        let place = bytes.windows(8).position(|w| w == entry).expect("a tag") + 8;
        bytes[place..place + 4].copy_from_slice(&100_000_u32.to_le_bytes());
    }
    std::fs::write(at("big.tif"), bytes).expect("written");
    let png = |path: &Path, size: u32| {
        let mut encoder = ::png::Encoder::new(std::fs::File::create(path).expect("created"), size, size);
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Eight);
        let mut image = encoder.write_header().expect("header");
        image.write_chunk(::png::chunk::IDAT, &[0x78]).expect("the first byte of the data");
    };
    png(&at("big.png"), 100_000);
    let greys = Greys { pixel_m: 0.01, low_m: 0.0, high_m: 1.0 };
    let kinds = |name: &str| match name.rsplit('.').next() {
        Some("asc") => TerrainKind::EsriAscii { file: at(name), fill_m: None },
        Some("tif") => TerrainKind::Geotiff { file: at(name), fill_m: None },
        _ => TerrainKind::Png { file: at(name), greys, fill_m: None },
    };
    let refused = |name: &str, spacing_m: f64| {
        let spec = TerrainSpec { size_m: [0.0; 2], spacing_m, kind: kinds(name) };
        failure(build(&spec, 1).map(drop))
    };
    for name in ["big.asc", "big.tif", "big.png"] {
        let message = refused(name, 1e6);
        assert!(
            message.contains(name) && message.contains("at most 1e8") && message.contains("gdalwarp"),
            "{message}"
        );
    }
    // fewer than that are read, but not for a ground of as many nodes
    png(&at("fine.png"), 9_000);
    let message = refused("fine.png", 0.0);
    assert!(message.contains("8.10e7 nodes") && message.contains("cut a part out of the file"), "{message}");
    assert!(!message.contains("size_m"), "{message}");
    let message = refused("fine.png", 0.1);
    assert!(message.contains("cannot be read whole"), "{message}");
    let mask = failure(super::Labels::read(
        &at("big.png"),
        None,
        &super::Analytic::new(lattice_of([5, 5], 1.0), |_, _| 0.0),
    ));
    assert!(mask.contains("at most 1e8"), "{mask}");
}

#[test]
fn heights_far_above_zero_are_taken_relative_to_the_middle() {
    let raster = Raster {
        size: [2, 2],
        step: [1.0; 2],
        corner: [0.0; 2],
        heights: vec![1500.5, 1501.0, 1502.0, 1503.0],
    };
    let ground = from_file("high.asc", raster, 0.0).expect("lowered");
    assert_eq!(heights(&*ground), [-2.5, -2.0, -1.0, 0.0]);
    let raster =
        Raster { size: [2, 2], step: [1.0; 2], corner: [0.0; 2], heights: vec![0.0, 0.0, 0.0, 3000.0] };
    assert!(failure(from_file("steep.asc", raster, 0.0).map(drop)).contains("steep.asc"));
}

#[test]
fn the_generator_keeps_its_sequence() {
    // First outputs for seed 1234567, as published with the reference implementation.
    let mut random = SplitMix64::new(1_234_567);
    let found: Vec<u64> = (0..3).map(|_| random.next_u64()).collect();
    assert_eq!(found, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
}

#[test]
fn labels_of_a_mask_lie_where_their_cells_lie() {
    use super::Labels;
    use ::png::{BitDepth, ColorType};
    let folder = tempfile::tempdir().expect("folder");
    let lattice = super::lattice_of([5, 5], 1.0);
    let ground = super::Analytic::new(lattice, |_, _| 0.0);
    let grid = folder.path().join("mask.asc");
    std::fs::write(&grid, "ncols 2\nnrows 1\nxllcorner 7\nyllcorner 7\ncellsize 2\nNODATA_value -1\n3 -1\n")
        .expect("written");
    let labels = Labels::read(&grid, None, &ground).expect("a mask");
    // cells −2 … 0 and 0 … 2 along x, −1 … 1 along y; a border belongs to the cell on the side of larger coordinates
    for (point, label) in [
        ([-2.0, 0.0], 3),
        ([-0.1, -1.0], 3),
        ([0.0, 0.0], 0),
        ([-1.0, 1.0], 0),
        ([-2.1, 0.0], 0),
        ([9.0, 0.0], 0),
    ] {
        assert_eq!(labels.at(point), label, "{point:?}");
    }
    assert_eq!(labels.unknown(|l| l == 3), None);
    assert_eq!(labels.unknown(|_| false), Some((3, "in column 1, row 1 from the top".into())));
    std::fs::write(&grid, "ncols 2\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 2\n1 2.5\n")
        .expect("written");
    let error = format!("{:?}", Labels::read(&grid, None, &ground).err().expect("refused"));
    assert!(error.contains("2.5 in column 2, row 1 from the top is no label"), "{error}");
    // an image without a size covers the ground: three pixels on five metres, the upper row at larger y
    let image = folder.path().join("mask.png");
    write_png(&image, ColorType::Grayscale, BitDepth::Eight, &[1, 2, 3, 4, 5, 6]);
    let labels = Labels::read(&image, None, &ground).expect("a mask");
    let at = |x: f64, y: f64| labels.at([x, y]);
    assert_eq!([at(-2.0, 2.0), at(0.0, 0.0), at(2.0, 1.0)], [1, 2, 3]);
    assert_eq!([at(-2.0, -2.0), at(0.0, -0.1), at(2.4, -2.4)], [4, 5, 6]);
    let narrow = Labels::read(&image, Some(0.5), &ground).expect("a mask");
    assert_eq!([narrow.at([-0.7, 0.4]), narrow.at([0.8, 0.0]), narrow.at([0.0, 0.6])], [1, 0, 0]);
}
