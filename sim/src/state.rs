//! A fingerprint of the physical state, for checks of determinism.

use crate::world::World;

impl World {
    /// A hash (64-bit FNV-1a) of time, every body's exact pose and motion and the gripper's state.
    /// Equal runs have equal fingerprints on the same build.
    pub fn fingerprint(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut mix = |bits: u64| {
            for byte in bits.to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        };
        mix(self.time_ns());
        for body in self.bodies() {
            body.world_from_body.translation.vector.iter().for_each(|v| mix(v.to_bits()));
            body.world_from_body.rotation.coords.iter().for_each(|v| mix(v.to_bits()));
            mix(body.speed_m_s.to_bits());
            mix(u64::from(body.held));
        }
        let gripper = self.gripper();
        gripper.position.iter().for_each(|v| mix(v.to_bits()));
        mix(gripper.yaw_rad.to_bits());
        mix(gripper.opening_m.to_bits());
        hash
    }
}
