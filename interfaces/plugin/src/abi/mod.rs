//! The C ABI: plain types that both sides of the border agree on. `include/terraglue.h` is made from this
//! folder (`cargo xtask header`). Within a major version these types only grow at the end of [`TgSubsystem`],
//! [`TgHost`] and [`TgWorld`], which carry their size; all others are frozen.

mod constants;
mod host;
mod law;
mod layout;
mod scene;
mod sight;
mod step;
mod table;
mod variable;

pub use constants::*;
pub use host::{TgHost, TgJob, TgTerrain};
pub use law::{TgNodeLaw, TgOpenLaw, TgPressureAnswer, TgPressureNodes, TgShearAnswer, TgShearNodes};
pub use scene::{
    TgBody, TgBodyState, TgEnergy, TgField, TgFieldTile, TgJoint, TgMaterial, TgPose, TgScene, TgShape,
};
pub use sight::{TgBodyRef, TgMessage, TgOverlay, TgRay, TgRayHit, TgRayMask, TgShapeRef, TgStream, TgWorld};
pub use step::{TgEstimate, TgInput, TgLaw, TgMotion, TgNode, TgPort, TgResponse, TgStep};
pub use table::{TgEntry, TgSubsystem};
pub use variable::{TgAction, TgBytes, TgValues, TgVariable};
