"""A robot of your own: a gripper without weight that goes where it is told.

python3 robot.py RUN
"""

import sys

import numpy as np

from groundloop import Refused, Robot, Target

CONTROL_HZ = 50.0
HOME = Target((0.0, 0.0, 0.5), 0.0, 0.08, 0.5)


class Gripper:
    """To drive a real one, let these speak to its controller and read its sensors."""

    def __init__(self) -> None:
        self.target = self.now = HOME

    def go(self, target: Target) -> None:
        if target.position[2] < 0.0:
            raise Refused("that is below the table")
        self.target = target

    def has_arrived(self) -> bool:
        return bool(np.allclose(self.now.position, self.target.position, atol=1e-3))

    def is_holding(self) -> bool:
        return self.now.opening_m <= 0.0

    def tool(self) -> Target:
        here, there = np.array(self.now.position), np.array(self.target.position)
        way = np.linalg.norm(there - here)
        share = min(1.0, self.target.speed_m_s / CONTROL_HZ / way) if way > 0.0 else 1.0
        t = self.target
        self.now = Target(tuple(here + share * (there - here)), t.yaw_rad, t.opening_m, t.speed_m_s)
        return self.now


def main(run: str) -> None:
    Robot(run, Gripper()).serve(CONTROL_HZ)


if __name__ == "__main__":
    main(*sys.argv[1:])
