"""Ten goals for a run that serves, one after another: what is asked, and what becomes of it.

    cargo run --release -- serve configs/blocksworld.toml --run demo --set sim.scene=scenes/three_blocks.toml &
    PYTHONPATH=clients/python python3 examples/ten_goals.py demo
"""

import sys

from groundloop import Tasks

GOALS = [
    "red over blue over green",
    "green over blue over red",
    "blue over red",
    "red over green",
    "green over red",
    "red over blue over green",
    "blue over green",
    "green over blue over red",
    "red over blue",
    "blue over red over green",
]


def main() -> int:
    if len(sys.argv) != 2:
        print("usage: ten_goals.py NAME", file=sys.stderr)
        return 2
    tasks = Tasks(sys.argv[1])
    # All may wait at once; they are carried out in this order.
    ids = [tasks.submit(text) for text in GOALS]
    n_reached = 0
    for text, id in zip(GOALS, ids, strict=True):
        status = tasks.wait(id)
        n_reached += status.verdict == "reached" and status.goal_in_simulator is not False
        print(f"{text}: {status.line}", flush=True)
    print(f"reached {n_reached}/{len(GOALS)}")
    return 0 if n_reached == len(GOALS) else 1


if __name__ == "__main__":
    sys.exit(main())
