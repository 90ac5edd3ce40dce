//! Walks a robot with legs of four joints: inverse kinematics, gait patterns, posture feedback.
