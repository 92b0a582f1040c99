"""A Franka Panda in PyBullet as camera and robot of a run: RGB-D pictures, inverse kinematics, grasps by friction.

    pip install ./clients/python pybullet
    groundloop run panda_blocksworld --run panda &
    python3 clients/python/examples/pybullet_panda.py panda --seed 1

Written against docs/protocol.md only. World frame: z up, the table is z = 0, the camera looks along y, the arm stands at the left.
"""

import argparse
import math
import time

import numpy as np
import pybullet as p
import pybullet_data

from groundloop import Bus, Camera, Intrinsics, Refused, Robot, Target

WIDTH, HEIGHT, FIELD_OF_VIEW_DEG = 640, 480, 34.0
NEAR_M, FAR_M = 0.1, 60.0
EYE, LOOK_AT = np.array([0.0, -0.95, 0.42]), np.array([0.0, 0.0, 0.09])
STEP_S, CONTROL_S, FRAME_S = 1.0 / 240.0, 1.0 / 60.0, 0.2
BASE = (-0.46, 0.12, 0.0)
HOME = Target((-0.2, 0.1, 0.5), 0.0, 0.08, 0.5)
# Joint angles near which the arm stays: the elbow up.
REST = [0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8]
ARM, FINGERS, TOOL = range(7), (9, 10), 11
OPENING_MAX_M, GRIP_N, ARM_N = 0.08, 30.0, 240.0
ARRIVED_M, STALLED_M_S, REACH_M = 0.006, 0.002, 0.82
BLOCK_M = 0.05
COLOURS = {
    "red": (0.784, 0.196, 0.176),
    "blue": (0.184, 0.384, 0.769),
    "green": (0.184, 0.569, 0.286),
    "yellow": (0.886, 0.757, 0.176),
    "purple": (0.498, 0.247, 0.659),
}


def build(seed: int) -> int:
    """Table, blocks in random stacks of three at most, and the arm; returns the arm."""
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(pybullet_data.getDataPath())
    p.setGravity(0.0, 0.0, -9.81)
    p.setTimeStep(STEP_S)
    box(half=(20.0, 20.0, 0.1), at=(0.0, 0.0, -0.1), colour=(0.42, 0.43, 0.44), mass=0.0)
    random = np.random.default_rng(seed)
    columns: list[list[str]] = [[], [], [], []]
    for name in random.permutation(list(COLOURS)):
        free = [column for column in columns if len(column) < 3]
        free[random.integers(len(free))].append(name)
    for x, column in zip((-0.10, 0.0, 0.10, 0.20), columns, strict=True):
        y = random.uniform(-0.01, 0.01)
        for level, name in enumerate(column):
            at = (x, y, BLOCK_M * (level + 0.5))
            box(half=(BLOCK_M / 2,) * 3, at=at, colour=COLOURS[name], mass=0.075)
    arm = p.loadURDF("franka_panda/panda.urdf", BASE, useFixedBase=True)
    for joint, angle in zip(ARM, REST, strict=True):
        p.resetJointState(arm, joint, angle)
    for finger in FINGERS:
        p.resetJointState(arm, finger, OPENING_MAX_M / 2)
        p.changeDynamics(arm, finger, lateralFriction=1.5, spinningFriction=0.01)
    # The two fingers of the hand are one drive.
    gear = p.createConstraint(arm, 9, arm, 10, p.JOINT_GEAR, (1, 0, 0), (0, 0, 0), (0, 0, 0))
    p.changeConstraint(gear, gearRatio=-1, erp=0.1, maxForce=50)
    return arm


def box(half: tuple, at: tuple, colour: tuple, mass: float) -> None:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=half)
    look = p.createVisualShape(p.GEOM_BOX, halfExtents=half, rgbaColor=(*colour, 1.0), specularColor=(0.0, 0.0, 0.0))
    body = p.createMultiBody(mass, shape, look, at)
    p.changeDynamics(body, -1, lateralFriction=0.8, spinningFriction=0.005)


class Panda:
    """The arm: it goes in a straight line, at the speed that it is told."""

    def __init__(self, body: int) -> None:
        self.body, self.target, self.point = body, HOME, np.array(HOME.position)
        self.opening_m, self.stalled_s = OPENING_MAX_M, 0.0

    def go(self, target: Target) -> None:
        reach = math.dist(target.position, (BASE[0], BASE[1], 0.33))
        if reach > REACH_M:
            raise Refused(f"unreachable: {reach:.2f} m from the shoulder, {REACH_M} m at most")
        if target.opening_m != self.target.opening_m:
            self.stalled_s = 0.0
        self.target = target

    def has_arrived(self) -> bool:
        off = np.linalg.norm(np.array(self.tool().position) - self.target.position)
        wanted = min(self.target.opening_m, OPENING_MAX_M)
        jaws = abs(self._opening() - wanted) < 0.003 or (self._opening() > wanted and self.stalled_s > 0.15)
        return bool(np.allclose(self.point, self.target.position) and off < ARRIVED_M and jaws)

    def is_holding(self) -> bool:
        return self.target.opening_m + 0.004 < self._opening() and self.stalled_s > 0.15

    def tool(self) -> Target:
        position = p.getLinkState(self.body, TOOL)[4]
        return Target(position, self.target.yaw_rad, self._opening(), self.target.speed_m_s)

    def control(self) -> None:
        """One control period: moves the point that the tool follows, and sets the motors."""
        way = np.array(self.target.position) - self.point
        step_m = self.target.speed_m_s * CONTROL_S
        self.point += way if np.linalg.norm(way) <= step_m else way / np.linalg.norm(way) * step_m
        # The hand points down, and its broad side, along which the fingers open, along y: blocks stand side by side in x.
        down = p.getQuaternionFromEuler((math.pi, 0.0, self.target.yaw_rad))
        angles = p.calculateInverseKinematics(
            self.body, TOOL, self.point, down, lowerLimits=[-2.9] * 7, upperLimits=[2.9] * 7, jointRanges=[5.8] * 7,
            restPoses=REST, maxNumIterations=60, residualThreshold=1e-5,
        )
        p.setJointMotorControlArray(
            self.body, list(ARM), p.POSITION_CONTROL, angles[:7], forces=[ARM_N] * 7, positionGains=[0.3] * 7
        )
        # Closing fingers squeeze: they want to be closer than what they close on lets them.
        for finger in FINGERS:
            p.setJointMotorControl2(
                self.body, finger, p.POSITION_CONTROL, self.target.opening_m / 2, force=GRIP_N, maxVelocity=0.15
            )
        before, self.opening_m = self.opening_m, self._opening()
        is_still = abs(self.opening_m - before) < STALLED_M_S * CONTROL_S * 5
        self.stalled_s = self.stalled_s + CONTROL_S if is_still else 0.0

    def _opening(self) -> float:
        return sum(p.getJointState(self.body, finger)[0] for finger in FINGERS)


class Eye:
    """The camera beside the table."""

    def __init__(self, run: str, bus: Bus) -> None:
        forward = (LOOK_AT - EYE) / np.linalg.norm(LOOK_AT - EYE)
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3, :3] = np.column_stack((right, np.cross(forward, right), forward))
        pose[:3, 3] = EYE
        focal = HEIGHT / 2 / math.tan(math.radians(FIELD_OF_VIEW_DEG / 2))
        pinhole = Intrinsics(focal, focal, (WIDTH - 1) / 2, (HEIGHT - 1) / 2)
        self.camera = Camera(run, intrinsics=pinhole, world_from_camera=pose, bus=bus)
        self.view = p.computeViewMatrix(EYE, LOOK_AT, (0.0, 0.0, 1.0))
        self.projection = p.computeProjectionMatrixFOV(FIELD_OF_VIEW_DEG, WIDTH / HEIGHT, NEAR_M, FAR_M)

    def look(self) -> None:
        taken_ns = time.monotonic_ns()
        _, _, rgba, depth, _ = p.getCameraImage(
            WIDTH, HEIGHT, self.view, self.projection, lightDirection=(0.4, -0.7, 1.2), shadow=1,
            lightAmbientCoeff=0.65, lightDiffuseCoeff=0.45, lightSpecularCoeff=0.0, renderer=p.ER_TINY_RENDERER,
        )
        rgb = np.reshape(rgba, (HEIGHT, WIDTH, 4))[:, :, :3].astype(np.uint8)
        metres = FAR_M * NEAR_M / (FAR_M - (FAR_M - NEAR_M) * np.reshape(depth, (HEIGHT, WIDTH)))
        self.camera.publish(rgb, metres, taken_ns)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("run", help="the name of the run")
    arguments.add_argument("--seed", type=int, default=1, help="of the blocks' places")
    options = arguments.parse_args()
    panda = Panda(build(options.seed))
    for _ in range(240):
        panda.control()
        p.stepSimulation()
    bus = Bus(options.run)
    eye = Eye(options.run, bus)
    # Pictures come five times a second, and a busy machine takes its time over them.
    robot = Robot(options.run, panda, bus, silence_s_max=3.0)
    started_s = time.monotonic()
    simulated_s = framed_s = 0.0
    while True:
        # Time in the simulator is that of the clock, or as near as this machine comes.
        while simulated_s < time.monotonic() - started_s:
            panda.control()
            for _ in range(round(CONTROL_S / STEP_S)):
                p.stepSimulation()
            simulated_s += CONTROL_S
        if simulated_s - framed_s >= FRAME_S:
            framed_s = simulated_s
            eye.look()
        robot.step()
        time.sleep(CONTROL_S / 4)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
