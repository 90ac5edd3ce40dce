//! Numbers that cross the border: versions, statuses, kinds.

/// Version of the ABI that breaks: host and module must agree.
pub const TG_ABI_MAJOR: u32 = 3;
/// Version of the ABI that grows: new fields at the end of `tg_subsystem` and `tg_host`.
pub const TG_ABI_MINOR: u32 = 1;

/// Status of a call; any value other than those below counts as `TG_FATAL`.
pub type TgStatus = i32;
/// Success.
pub const TG_OK: i32 = 0;
/// The step is too long: `reached` (s) is how far it could go. The host may repeat with a shorter step.
pub const TG_DISCARD: i32 = 1;
/// A value, name or argument is not acceptable; the instance is unchanged and usable. Text: `last_error`.
pub const TG_REFUSED: i32 = 2;
/// The call failed; the committed state is intact. Text: `last_error`.
pub const TG_ERROR: i32 = -1;
/// The call, the kind of input or the level is not offered.
pub const TG_UNSUPPORTED: i32 = -2;
/// The call failed and the instance must not be called again, `last_error` and `free` excepted.
pub const TG_FATAL: i32 = -3;

/// `tg_subsystem.kind`: owns ground, answers contact ports on side 2.
pub const TG_SOIL: u32 = 1;
/// `tg_subsystem.kind`: bodies with shapes, side 1 of contact ports.
pub const TG_ROBOT: u32 = 2;
/// `tg_subsystem.kind`: signals only.
pub const TG_CONTROLLER: u32 = 3;
/// `tg_subsystem.kind`: pressure and shear over arrays of nodes.
pub const TG_LAW: u32 = 4;
/// `tg_subsystem.kind`: looks at the world of the others, answers with signals and streams. Since 3.1.
pub const TG_SENSOR: u32 = 5;

/// Bit of `capabilities`: `advance` takes `TG_FORCE`.
pub const TG_CAN_FORCE: u32 = 1;
/// Bit of `capabilities`: `advance` takes `TG_MOTION`.
pub const TG_CAN_MOTION: u32 = 2;
/// Bit of `capabilities`: `estimate_forces`.
pub const TG_CAN_ESTIMATE: u32 = 8;
/// Bit of `capabilities`: `solve_compatibility`.
pub const TG_CAN_SOLVE: u32 = 16;
/// Bit of `capabilities`: `interface_jacobian`.
pub const TG_CAN_DERIVATIVES: u32 = 32;
/// Bit of `capabilities`: trials do not disturb the committed state and can be repeated.
pub const TG_CAN_RETRY: u32 = 64;
/// Bit of `capabilities`: `save_state` and `restore_state`.
pub const TG_CAN_STATE: u32 = 128;
/// Bit of `capabilities`: `serialize` and `deserialize`.
pub const TG_CAN_SERIALIZE: u32 = 256;
/// Bit of `capabilities`: makes steps of its own inside a communication step.
pub const TG_CAN_SUBCYCLE: u32 = 512;
/// Bit of `capabilities`: outputs depend directly on inputs of the same time.
pub const TG_CAN_FEEDTHROUGH: u32 = 1024;
/// Bit of `capabilities`: makes communication steps of one length only.
pub const TG_CAN_FIXED_STEP: u32 = 4096;
/// Bit of `capabilities`: `observe`. Since 3.1.
pub const TG_CAN_SEE: u32 = 8192;
/// Bit of `capabilities`: `shape_visibility`. Since 3.1.
pub const TG_CAN_HIDE: u32 = 16384;

/// `tg_port.kind`: one body shape on one ground, unilateral.
pub const TG_CONTACT: u32 = 0;
/// `tg_port.kind`: a cut joint, bilateral.
pub const TG_JOINT: u32 = 1;
/// `tg_port.kind`: declared by name in a scenario.
pub const TG_NAMED: u32 = 2;

/// Bit of `tg_port.mask`: force along n.
pub const TG_N: u32 = 1;
/// Bit of `tg_port.mask`: force along t1.
pub const TG_T1: u32 = 2;
/// Bit of `tg_port.mask`: force along t2.
pub const TG_T2: u32 = 4;
/// Bit of `tg_port.mask`: moment about n.
pub const TG_MN: u32 = 8;
/// Bit of `tg_port.mask`: moment about t1.
pub const TG_MT1: u32 = 16;
/// Bit of `tg_port.mask`: moment about t2.
pub const TG_MT2: u32 = 32;

/// `tg_input.kind`: the wrench `t` acts; `x` and `v` are the partner's motion where it is known, else null.
pub const TG_FORCE: u32 = 0;
/// `tg_input.kind`: the other side moves by `x`, `v`.
pub const TG_MOTION: u32 = 1;

/// Level of a derivative: X.
pub const TG_POSITION: u32 = 0;
/// Level of a derivative: V.
pub const TG_VELOCITY: u32 = 1;
/// Level of a derivative: A.
pub const TG_ACCELERATION: u32 = 2;

/// Bit of `tg_response.flags`: something happened at `reached`.
pub const TG_EVENT: u32 = 1;
/// Bit of `tg_response.flags`: the subsystem asks for the end of the run.
pub const TG_TERMINATE: u32 = 2;
/// Bit of `tg_response.flags`: a port yields.
pub const TG_YIELDED: u32 = 4;

/// `tg_values.value_type`: double.
pub const TG_F64: u32 = 0;
/// `tg_values.value_type`: float.
pub const TG_F32: u32 = 1;
/// `tg_values.value_type`: int8_t.
pub const TG_I8: u32 = 2;
/// `tg_values.value_type`: int16_t.
pub const TG_I16: u32 = 3;
/// `tg_values.value_type`: int32_t.
pub const TG_I32: u32 = 4;
/// `tg_values.value_type`: int64_t.
pub const TG_I64: u32 = 5;
/// `tg_values.value_type`: uint8_t.
pub const TG_U8: u32 = 6;
/// `tg_values.value_type`: uint16_t.
pub const TG_U16: u32 = 7;
/// `tg_values.value_type`: uint32_t.
pub const TG_U32: u32 = 8;
/// `tg_values.value_type`: uint64_t.
pub const TG_U64: u32 = 9;
/// `tg_values.value_type`: uint8_t, 0 or 1.
pub const TG_BOOL: u32 = 10;
/// `tg_values.value_type`: tg_bytes that hold UTF-8.
pub const TG_STRING: u32 = 11;
/// `tg_values.value_type`: tg_bytes.
pub const TG_BINARY: u32 = 12;
/// `tg_values.value_type`: int64_t, an index into the names of the enumeration.
pub const TG_ENUMERATION: u32 = 13;
/// `tg_values.value_type`: reserved.
pub const TG_CLOCK: u32 = 14;

/// `tg_variable.causality`: set from outside, constant between changes.
pub const TG_PARAMETER: u32 = 0;
/// `tg_variable.causality`: set before each step, e.g. by a connection.
pub const TG_INPUT: u32 = 1;
/// `tg_variable.causality`: offered to connections.
pub const TG_OUTPUT: u32 = 2;
/// `tg_variable.causality`: to look at.
pub const TG_LOCAL: u32 = 3;

/// `tg_variable.effect`: a change holds from the next step on.
pub const TG_LIVE: u32 = 0;
/// `tg_variable.effect`: a change is accepted only before the first step.
pub const TG_NEEDS_RESET: u32 = 1;
/// `tg_variable.effect`: a change is never accepted.
pub const TG_READ_ONLY: u32 = 2;

/// `tg_shape.geometry`: `size[0]` = radius.
pub const TG_SPHERE: u32 = 0;
/// `tg_shape.geometry`: `size` = half lengths along x, y, z.
pub const TG_BOX: u32 = 1;
/// `tg_shape.geometry`: `size` = half length of the segment along z, radius.
pub const TG_CAPSULE: u32 = 2;
/// `tg_shape.geometry`: `size` = half length along z, radius.
pub const TG_CYLINDER: u32 = 3;
/// `tg_shape.geometry`: convex hull of `points`.
pub const TG_CONVEX_MESH: u32 = 4;
/// `tg_shape.geometry`: `size` = half length along z, radius at z = -half length, radius at z = half length. Since 3.1.
pub const TG_CONE_FRUSTUM: u32 = 5;
/// `tg_shape.geometry`: `size` = half lengths along x, y, z. Since 3.1.
pub const TG_ELLIPSOID: u32 = 6;
/// `tg_shape.geometry`: the triangles of `points`, open or closed; is seen only. Since 3.1.
pub const TG_MESH: u32 = 7;

/// `tg_joint.kind`: turns about its axis between limits.
pub const TG_REVOLUTE: u32 = 0;
/// `tg_joint.kind`: turns about its axis without limits.
pub const TG_CONTINUOUS: u32 = 1;
/// `tg_joint.kind`: slides along its axis.
pub const TG_PRISMATIC: u32 = 2;
/// `tg_joint.kind`: turns about a point.
pub const TG_SPHERICAL: u32 = 3;
/// `tg_joint.kind`: slides in the plane across its axis and turns about it.
pub const TG_PLANAR: u32 = 4;
/// `tg_joint.kind`: does not move.
pub const TG_FIXED: u32 = 5;
/// `tg_joint.kind`: closes a loop of the tree.
pub const TG_CLOSURE: u32 = 6;
/// `tg_joint.kind`: slides along its axis and turns about it.
pub const TG_CYLINDRICAL: u32 = 7;
/// `tg_joint.kind`: turns about two axes that stay perpendicular.
pub const TG_UNIVERSAL: u32 = 8;

/// Bit of `tg_ray_mask.sees`: shapes that are not hidden.
pub const TG_SEES_SHAPES: u32 = 1;
/// Bit of `tg_ray_mask.sees`: height fields.
pub const TG_SEES_GROUND: u32 = 2;

/// `tg_overlay.figure`: lines, two of `points` for each; `size` is their width.
pub const TG_LINES: u32 = 0;
/// `tg_overlay.figure`: points of that `size`.
pub const TG_POINTS: u32 = 1;
/// `tg_overlay.figure`: arrows, tail and tip of each in `points`; `size` is the width of the shaft.
pub const TG_ARROWS: u32 = 2;
/// `tg_overlay.figure`: the edge of an ellipse in the x, y plane of `pose`.
pub const TG_ELLIPSE: u32 = 3;
/// `tg_overlay.figure`: `text` from the first of `points` on, `size` high.
pub const TG_TEXT: u32 = 4;

/// `tg_field_tile.format`: every value equals `scale`; no data.
pub const TG_TILE_UNIFORM: u32 = 0;
/// `tg_field_tile.format`: data are double.
pub const TG_TILE_F64: u32 = 1;
/// `tg_field_tile.format`: data are float.
pub const TG_TILE_F32: u32 = 2;
/// `tg_field_tile.format`: data are int32_t; value = data * `scale`.
pub const TG_TILE_FIXED: u32 = 3;

/// Level of a log line.
pub const TG_LOG_ERROR: i32 = 1;
/// Level of a log line.
pub const TG_LOG_WARNING: i32 = 2;
/// Level of a log line.
pub const TG_LOG_INFO: i32 = 3;
/// Level of a log line.
pub const TG_LOG_DEBUG: i32 = 4;
