//! Plates pressed into level ground: the soils give the pressure that their law promises, whatever the grid.

use super::MODULES;
use super::fixture::{Fixture, flat, soil};
use super::rows::{SoilRow, eight};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use crate::{Context, Figure, Limit};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{Geometry, Subsystem};

/// Makes an instance of a soil: configuration, nodes along a side, spacing.
pub type Maker = fn(&str, u32, f64) -> Box<dyn Subsystem>;

/// An instance of the module `M` on level ground.
pub fn level<M: terraglue_subsystem::Module>(config: &str, size: u32, spacing: f64) -> Box<dyn Subsystem> {
    soil::<M>(config, size, spacing, flat)
}

/// Name, geometry, b of the law and area of the plates.
fn shapes() -> [(&'static str, Geometry, f64, f64); 6] {
    let disc = |name, radius: f64| {
        (
            name,
            Geometry::Cylinder { half_length: 0.1, radius },
            radius,
            std::f64::consts::PI * radius * radius,
        )
    };
    let rectangle = |name, a: f64, b: f64| {
        // the disc of equal area, or that which bears as much as an endless strip as broad (Terzaghi 1943)
        let size = (a * b / std::f64::consts::PI).sqrt().min(5.0 / 6.0 * a.min(b));
        (name, Geometry::Box { half_extents: [0.5 * a, 0.5 * b, 0.1] }, size, a * b)
    };
    [
        disc("disc_r3cm", 0.03),
        disc("disc_r5cm", 0.05),
        disc("disc_r15cm", 0.15),
        rectangle("plate_10x10cm", 0.1, 0.1),
        rectangle("plate_20x5cm", 0.2, 0.05),
        rectangle("plate_40x10cm", 0.4, 0.1),
    ]
}

const SPACINGS: [f64; 3] = [0.02, 0.01, 0.005];
/// Width of the ground, m.
const GROUND: f64 = 1.0;
/// Where the middle of the plate lies: on no symmetry of the lattice.
const OFFSET: [f64; 2] = [0.0031, -0.0017];
const SPEED: f64 = 0.01;

/// One plate on one soil and grid.
#[derive(Clone)]
struct PlateCase {
    make: Maker,
    row: SoilRow,
    shape: usize,
    spacing: f64,
    quick: bool,
}

impl PlateCase {
    fn fixture(&self, mass: f64) -> Fixture {
        let size = (GROUND / self.spacing).round() as u32 + 1;
        let (_, geometry, ..) = shapes()[self.shape].clone();
        let mut fixture =
            Fixture::new((self.make)(&self.row.config, size, self.spacing), geometry, mass, 0.1);
        (fixture.position[0], fixture.position[1]) = (OFFSET[0], OFFSET[1]);
        fixture
    }

    /// Half the width of the plate over the spacing.
    fn resolution(&self) -> f64 {
        let (_, geometry, b, _) = shapes()[self.shape].clone();
        let half = if let Geometry::Box { half_extents: [x, y, _] } = geometry { x.min(y) } else { b };
        half / self.spacing
    }

    /// Largest relative error of the pressure from 10 mm to 50 mm, every 5 mm.
    fn pressed(&self) -> f64 {
        let (.., b, area) = shapes()[self.shape].clone();
        // the law knows no rate: a quick run takes longer strides
        let h = if self.quick { 1e-2 } else { 1e-3 };
        let stride = SPEED * h;
        let mut fixture = self.fixture(1.0);
        fixture.h = h;
        let (every, last) = ((0.005 / stride).round() as u32, (0.05 / stride).round() as u32);
        let mut worst = 0.0_f64;
        for k in 1..=last {
            let force = fixture.prescribed_step(&[-stride, 0.0, 0.0, 0.0, 0.0, 0.0])[0];
            let z = stride * f64::from(k);
            if k % every == 0 && z > 0.0099 {
                worst = larger(worst, (force / area / self.row.pressure(z, b) - 1.0).abs());
            }
        }
        worst
    }

    /// Largest relative error of the sinkage under 5 … 200 N, until the plate rests.
    fn loaded(&self) -> f64 {
        let (.., b, area) = shapes()[self.shape].clone();
        let mut worst = 0.0_f64;
        for load in [5.0, 10.0, 20.0, 50.0, 100.0, 200.0] {
            let z = self.row.depth(load / area, b);
            if z < 0.1 {
                // a light plate, its load laid on smoothly: a heavy one would plunge deeper than it rests
                let mut fixture = self.fixture(0.1);
                fixture.gravity = 0.0;
                let ramp = if self.quick { 300.0 } else { 4000.0 };
                for k in 0..ramp as u32 + 100 {
                    let share = (f64::from(k) / ramp).min(1.0);
                    fixture.force[2] = -0.5 * load * (1.0 - (std::f64::consts::PI * share).cos());
                    fixture.iterative_step();
                }
                let speed = fixture.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
                let error = if speed < 1e-5 { (fixture.sunk() / z - 1.0).abs() } else { f64::NAN };
                worst = larger(worst, error);
            }
        }
        worst
    }
}

/// All figures, on one soil: both press by the same code.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let [(module, make), _] = MODULES;
    let mut all = Vec::new();
    let cases = cases(context, make)?;
    let errors = in_parallel(&cases, PlateCase::pressed);
    for (shape, (name, ..)) in shapes().iter().enumerate() {
        let worst = |from: f64, to: f64| {
            let of_shape = cases.iter().zip(&errors).filter(|(c, _)| c.shape == shape);
            let fitting =
                of_shape.filter(|(c, _)| c.resolution() >= from - 1e-9 && c.resolution() < to - 1e-9);
            fitting.map(|(_, e)| *e).reduce(larger)
        };
        for (part, from, to, limit) in
            [("fine", 10.0, f64::INFINITY, 1.0), ("coarse", 3.0, 10.0, 3.0), ("few_cells", 0.0, 3.0, 3.0)]
        {
            let Some(error) = worst(from, to) else { continue };
            let soils = if context.quick { 2 } else { 8 };
            let what = format!(
                "largest error of the pressure, %, {soils} soils, 10 to 50 mm, R/spacing {from} to {to}"
            );
            let id = format!("soil.{module}.{name}.{part}");
            all.push(Figure::new(id, 100.0 * error, Limit::AtMost(limit), what));
        }
    }
    all.push(load_control(context, module, make)?);
    Ok(all)
}

/// Every soil, shape and grid; quickly two soils and the two grids that show most.
fn cases(context: &Context, make: Maker) -> Outcome<Vec<PlateCase>> {
    let mut cases = Vec::new();
    for (number, row) in eight()?.into_iter().enumerate() {
        for shape in 0..shapes().len() {
            for spacing in SPACINGS {
                let case = PlateCase { make, row: row.clone(), shape, spacing, quick: context.quick };
                let small = shapes()[shape].3 < 0.02;
                if !context.quick || (number == 1 || number == 7) && (spacing > 0.009 || small) {
                    cases.push(case);
                }
            }
        }
    }
    Ok(cases)
}

fn load_control(context: &Context, module: &str, make: Maker) -> Outcome<Figure> {
    let rows = eight()?;
    let rows = if context.quick { vec![rows[2].clone(), rows[7].clone()] } else { rows };
    let shapes: &[usize] = if context.quick { &[1] } else { &[0, 1, 2, 3, 4, 5] };
    let case = |row: &SoilRow, shape| PlateCase {
        make,
        row: row.clone(),
        shape,
        spacing: 0.01,
        quick: context.quick,
    };
    let cases: Vec<PlateCase> =
        rows.iter().flat_map(|row| shapes.iter().map(move |s| case(row, *s))).collect();
    let errors = in_parallel(&cases, PlateCase::loaded);
    let worst = errors.into_iter().reduce(larger).unwrap_or(f64::NAN);
    let what = "largest error of the sinkage under 5 to 200 N, %, 1 cm grid";
    Ok(Figure::new(format!("soil.{module}.load_control"), 100.0 * worst, Limit::AtMost(2.0), what))
}
