//! One foot on its way from a pose to the next, at constant velocity and angular velocity.

use super::State;
use terraglue_numerics::rotation::{
    Vector, conjugate, cross, minus, product, quaternion, rotation_vector, turned,
};
use terraglue_subsystem::{BodyState, Pose};

/// A foot.
#[derive(Clone, Debug, PartialEq)]
pub struct DrivenBody {
    /// Where it is.
    pub now: Pose,
    /// Where it is to be.
    pub target: Pose,
    /// Time left to get there, s.
    pub left_s: f64,
    /// Force of the ground in the last step, world axes, N.
    pub force: Vector,
    /// Moment of the ground about the foot's origin in the last step, world axes, N m.
    pub moment: Vector,
}

impl DrivenBody {
    /// At rest, upright.
    pub fn at(position: Vector) -> Self {
        let pose = Pose { position, ..Pose::IDENTITY };
        Self { now: pose, target: pose, left_s: 0.0, force: [0.0; 3], moment: [0.0; 3] }
    }

    /// Share of the way that is made in h seconds.
    fn share(&self, h: f64) -> f64 {
        // A step that ends within rounding of the target ends there.
        if h >= self.left_s * (1.0 - 1e-9) { 1.0 } else { h / self.left_s }
    }

    /// Rotation vector of the whole way that is left, rad.
    fn turn(&self) -> Vector {
        if self.now.orientation == self.target.orientation {
            return [0.0; 3];
        }
        rotation_vector(product(self.target.orientation, conjugate(self.now.orientation)))
    }

    /// Pose after h seconds.
    fn pose_after(&self, h: f64) -> Pose {
        if h == 0.0 {
            return self.now;
        }
        let share = self.share(h);
        if share == 1.0 {
            return self.target;
        }
        let (a, b) = (self.now.position, self.target.position);
        Pose {
            position: std::array::from_fn(|k| a[k] + share * (b[k] - a[k])),
            orientation: product(quaternion(self.turn().map(|x| x * share)), self.now.orientation),
        }
    }

    /// Displacement (m) of a point of the foot that lies at `point` now, and rotation vector (rad), in h seconds.
    pub fn displacement(&self, h: f64, point: Vector) -> [Vector; 2] {
        if h == 0.0 {
            return [[0.0; 3]; 2];
        }
        let share = self.share(h);
        let turn = self.turn().map(|x| x * share);
        let arm = minus(point, self.now.position);
        let swung = minus(turned(quaternion(turn), arm), arm);
        let (a, b) = (self.now.position, self.target.position);
        [std::array::from_fn(|k| share * (b[k] - a[k]) + swung[k]), turn]
    }

    /// Velocity (m/s) of a point of the foot, and angular velocity (rad/s); zero once it is there.
    pub fn velocity(&self, point: Vector) -> [Vector; 2] {
        let state = self.body_state();
        let arm = minus(point, self.now.position);
        let (v, w) = (state.linear_velocity, state.angular_velocity);
        let swing = cross(w, arm);
        [std::array::from_fn(|k| v[k] + swing[k]), w]
    }

    /// Adds a wrench (N, N m) that acts at `origin`, to be reported about the foot's place after h seconds.
    pub fn load(&mut self, h: f64, origin: Vector, force: Vector, moment: Vector) {
        let lever = cross(minus(origin, self.pose_after(h).position), force);
        for k in 0..3 {
            self.force[k] += force[k];
            self.moment[k] += moment[k] + lever[k];
        }
    }

    /// Goes on for h seconds.
    pub fn go(&mut self, h: f64) {
        self.now = self.pose_after(h);
        self.left_s = if self.now == self.target { 0.0 } else { self.left_s - h };
    }

    /// Pose and velocities now.
    pub fn body_state(&self) -> BodyState {
        if self.left_s <= 0.0 {
            return BodyState { world_from_body: self.now, ..BodyState::REST };
        }
        let way = minus(self.target.position, self.now.position);
        BodyState {
            world_from_body: self.now,
            linear_velocity: way.map(|x| x / self.left_s),
            angular_velocity: self.turn().map(|x| x / self.left_s),
        }
    }

    fn numbers(&self) -> [f64; 21] {
        let mut out = [0.0; 21];
        let poses =
            [&self.now, &self.target].into_iter().flat_map(|p| p.position.into_iter().chain(p.orientation));
        let all = poses.chain([self.left_s]).chain(self.force).chain(self.moment);
        out.iter_mut().zip(all).for_each(|(out, x)| *out = x);
        out
    }

    fn from_numbers(x: &[f64; 21]) -> Self {
        let three = |k: usize| [x[k], x[k + 1], x[k + 2]];
        let pose =
            |k: usize| Pose { position: three(k), orientation: [x[k + 3], x[k + 4], x[k + 5], x[k + 6]] };
        Self { now: pose(0), target: pose(7), left_s: x[14], force: three(15), moment: three(18) }
    }
}

impl State {
    /// All numbers, little-endian.
    pub fn to_bytes(&self) -> Vec<u8> {
        let head = [self.duration_s, f64::from(u8::from(self.jump)), self.work_j];
        let feet = self.feet.iter().flat_map(|f| f.numbers());
        head.into_iter().chain(feet).flat_map(f64::to_le_bytes).collect()
    }

    /// Back from bytes of as many feet.
    pub fn from_bytes(bytes: &[u8], count: usize) -> Option<Self> {
        let numbers: Vec<f64> = bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let good = bytes.len() == 8 * (3 + 21 * count) && numbers.iter().all(|x| x.is_finite());
        let (head, feet) = numbers.split_at_checked(3).filter(|_| good)?;
        let feet = feet.as_chunks::<21>().0.iter().map(DrivenBody::from_numbers).collect();
        Some(Self { feet, duration_s: head[0], jump: head[1] != 0.0, work_j: head[2] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swinging() -> DrivenBody {
        let mut foot = DrivenBody::at([1.0, 2.0, 3.0]);
        foot.target = Pose { position: [1.5, 2.0, 3.0], orientation: quaternion([0.0, 0.0, 0.8]) };
        foot.left_s = 0.4;
        foot
    }

    #[test]
    fn parts_of_a_way_make_the_whole() {
        let (mut foot, point) = (swinging(), [1.2, 2.3, 3.1]);
        let whole = foot.displacement(0.4, point);
        let mut at = point;
        for _ in 0..4 {
            let part = foot.displacement(0.1, at);
            at = std::array::from_fn(|k| at[k] + part[0][k]);
            foot.go(0.1);
        }
        assert_eq!((foot.now, foot.left_s), (foot.target, 0.0));
        for k in 0..3 {
            assert!((at[k] - point[k] - whole[0][k]).abs() < 1e-14, "component {k}");
        }
    }

    #[test]
    fn a_force_beside_the_foot_turns_it() {
        let mut foot = DrivenBody::at([0.0, 0.0, 1.0]);
        foot.load(0.0, [0.5, 0.0, 1.0], [0.0, 0.0, 10.0], [0.0, 0.0, 2.0]);
        assert_eq!((foot.force, foot.moment), ([0.0, 0.0, 10.0], [0.0, -5.0, 2.0]));
    }

    #[test]
    fn a_state_survives_as_bytes() {
        let state = State {
            feet: vec![swinging(), DrivenBody::at([0.0; 3])],
            duration_s: 0.25,
            jump: true,
            work_j: 1.5,
        };
        let back = State::from_bytes(&state.to_bytes(), 2).expect("the same feet");
        assert_eq!(
            (back.feet, back.duration_s, back.jump, back.work_j),
            (state.feet.clone(), 0.25, true, 1.5)
        );
        assert!(State::from_bytes(&state.to_bytes(), 3).is_none());
    }
}
