//! The object under the pointer: the first hit of a ray among all shapes and grounds of a testbed.

use serde_json::{Value, json};
use terraglue_engine::testbed::Testbed;
use terraglue_subsystem::{Ray, RayHit, RayMask, World};
use terraglue_world::{WorldBuilder, fixed_bodies};

/// First hit of a ray: `{hit: {subsystem, body, point, distance}}`, body null for the ground; hit null where nothing is.
///
/// # Errors
/// A direction of length 0, or a scene that cannot be seen.
pub fn cast(testbed: &Testbed, origin: [f64; 3], direction: [f64; 3]) -> Result<Value, String> {
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    if length <= 0.0 {
        return Err("the direction of a ray is not 0, 0, 0".into());
    }
    let direction = direction.map(|d| d / length);
    testbed.view(|view| {
        let mut builder = WorldBuilder::new();
        let mut grounds = Vec::new();
        for s in view.subsystems {
            let added = builder.subsystem(s.name, s.scene, s.body_states, &fixed_bodies(s.scene));
            let number = added.map_err(|e| e.to_string())?;
            let fields = s.instance.fields();
            if let Some(field) = fields.iter().position(|f| f.name == "height") {
                builder.ground(number, &fields[field]).map_err(|e| e.to_string())?;
                grounds.push((number, field, s.instance));
            }
        }
        let mut world = builder.build(view.t_s);
        let mut update = world.update([view.t_s; 2]);
        for (number, field, instance) in grounds {
            let tile = |a: u32, b: u32| instance.field_tile(field, a, b).ok();
            update.ground(number, tile).map_err(|e| e.to_string())?;
        }
        drop(update);
        let mut hits = [RayHit::MISS];
        let ray = Ray { origin, direction, time: view.t_s, range: f64::INFINITY };
        world.cast_rays(&[ray], &RayMask::ALL, &mut hits);
        let [hit] = hits;
        if !hit.is_hit() {
            return Ok(json!({ "hit": null }));
        }
        let subsystem = view.subsystems.get(hit.subsystem as usize);
        let body = subsystem.and_then(|s| s.scene.bodies.get(hit.body as usize)).map(|body| &body.name);
        let point = [0, 1, 2].map(|k| origin[k] + hit.distance * direction[k]);
        Ok(json!({ "hit": { "subsystem": subsystem.map(|s| s.name), "body": body, "point": point, "distance": hit.distance } }))
    })
}
