//! Drawn scenes as a world of `terraglue-world`.

use crate::{Heights, Piece, STEP, lend};
use terraglue_world::{Parallel, Result, WorldBuilder, WorldModel};

/// A drawn world whose subsystems are added in an order, at the end of its step; the ground belongs to the first piece.
///
/// # Errors
/// A world that is refused; none that is drawn is.
pub fn drawn(
    pieces: &[Piece],
    heights: &Heights,
    order: &[usize],
    parallel: Option<Parallel>,
) -> Result<WorldModel> {
    let mut builder = WorldBuilder::new();
    for piece in order.iter().map(|k| &pieces[*k]) {
        builder.subsystem(&piece.name, &piece.scene, piece.states().0, &piece.is_fixed())?;
    }
    let owner = order.iter().position(|k| *k == 0).unwrap_or(0) as u32;
    builder.ground(owner, &heights.info())?;
    if let Some(parallel) = parallel {
        builder.parallel(parallel);
    }
    let mut world = builder.build(STEP[0]);
    let mut update = world.update(STEP);
    for (number, k) in (0..).zip(order) {
        let (before, after) = pieces[*k].states();
        update.bodies(number, before, after)?;
    }
    let tiles = heights.tiles();
    update.ground(owner, lend(&tiles, heights, 1))?;
    drop(update);
    Ok(world)
}
