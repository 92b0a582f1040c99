"""Times the nearest-neighbour method in Python, on the inputs of `benches/grounding.rs`.

Own words for the published method (boxes only): a plain version with one pass of numpy per pair of
objects, as one would first write it, and a version that does all pairs of a predicate at once. Prints the
median of each in microseconds. Needs numpy; says so and ends well without it.

    python3 benches/reference_s2s.py
"""

import json
import re
import sys
import time
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("skipped: numpy is not installed")
    sys.exit(0)

SHIFT_PX = 200
DOMAINS = Path(__file__).resolve().parent.parent / "domains"
# Observed predicates with the types of their arguments.
PREDICATES = {
    "blocksworld": {"on": ("block", "block")},
    "hanoi": {"on": ("disk", "disk"), "on-peg": ("disk", "peg"), "smaller": ("disk", "disk")},
}


def read_examples(domain):
    """Every labelled example: objects (name, type, box) and the facts that hold."""
    examples = []
    for path in sorted((DOMAINS / domain / "exemplar/sim_640x480").glob("*.json")):
        if path.name.count(".") > 1:
            continue
        state = path.with_suffix(".pddl").read_text()
        declared = re.search(r"\(:objects(.*?)\)", state, re.S)[1]
        types = {}
        for names, type_name in re.findall(r"((?:[\w-]+\s+)+)-\s+([\w-]+)", declared):
            types.update({name: type_name for name in names.split()})
        init = re.search(r"\(:init(.*?)\)\s*\(:goal", state, re.S)[1]
        facts = {tuple(atom.split()) for atom in re.findall(r"\(([^()]*)\)", init)}
        boxes = json.loads(path.read_text())
        objects = [(name, types[name], np.array(box)) for name, box in boxes.items()]
        examples.append((objects, facts))
    return examples


def moved(examples, n_objects):
    """Objects like the labelled ones, each somewhere else; the same numbers as in Rust."""
    state, objects = 1, []
    labelled = [object_ for objects_, _ in examples for object_ in objects_]
    for i in range(n_objects):
        name, type_name, box = labelled[i % len(labelled)]
        shift = []
        for _ in range(2):
            state = (state * 1_664_525 + 1_013_904_223) % 2**32
            shift.append((state >> 16) % (2 * SHIFT_PX) - SHIFT_PX)
        objects.append((f"{name}_{i}", type_name, box + np.array(shift * 2, dtype=float)))
    return objects


def relation(s, o):
    """Edge differences and four times the gap."""
    gap_x = max(o[0] - s[2], s[0] - o[2], 0.0)
    gap_y = max(o[1] - s[3], s[1] - o[3], 0.0)
    return np.array([*(o - s), 4.0 * np.hypot(gap_x, gap_y)])


def relations(s, o):
    """The same for arrays of boxes."""
    gap_x = np.maximum(np.maximum(o[:, 0] - s[:, 2], s[:, 0] - o[:, 2]), 0.0)
    gap_y = np.maximum(np.maximum(o[:, 1] - s[:, 3], s[:, 1] - o[:, 3]), 0.0)
    return np.column_stack([o - s, 4.0 * np.hypot(gap_x, gap_y)])


def pairs(objects, types):
    first, second = types
    return [
        (a, b)
        for a in objects
        if a[1] == first
        for b in objects
        if b[1] == second and b[0] != a[0]
    ]


def learn(domain, examples):
    """Vectors of the pairs that hold and of those that do not, for each predicate."""
    tables = {}
    for predicate, types in PREDICATES[domain].items():
        sides = ([], [])
        for objects, facts in examples:
            for a, b in pairs(objects, types):
                sides[(predicate, a[0], b[0]) in facts].append(relation(a[2], b[2]))
        if sides[0] and sides[1]:
            tables[predicate] = (types, np.array(sides[1]), np.array(sides[0]))
    return tables


def plain(tables, objects):
    facts = set()
    for predicate, (types, positives, negatives) in tables.items():
        for a, b in pairs(objects, types):
            vector = relation(a[2], b[2])
            near_positive = np.linalg.norm(positives - vector, axis=1).min()
            near_negative = np.linalg.norm(negatives - vector, axis=1).min()
            if near_positive < near_negative:
                facts.add((predicate, a[0], b[0]))
    return facts


def at_once(tables, objects):
    facts = set()
    for predicate, (types, positives, negatives) in tables.items():
        candidates = pairs(objects, types)
        if not candidates:
            continue
        subjects = np.array([a[2] for a, _ in candidates])
        others = np.array([b[2] for _, b in candidates])
        vectors = relations(subjects, others)[:, None, :]
        near_positive = np.linalg.norm(positives - vectors, axis=2).min(axis=1)
        near_negative = np.linalg.norm(negatives - vectors, axis=2).min(axis=1)
        for i in np.flatnonzero(near_positive < near_negative):
            facts.add((predicate, candidates[i][0][0], candidates[i][1][0]))
    return facts


def median_us(call):
    times, began = [], time.perf_counter()
    while len(times) < 5 or time.perf_counter() - began < 1.0:
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e6 * float(np.median(times))


def main():
    print("domain       examples  objects  facts  plain_us  at_once_us")
    for domain in PREDICATES:
        everything = read_examples(domain)
        for label, examples in (("one-shot", everything[:1]), ("shipped", everything)):
            tables = learn(domain, examples)
            for n_objects in (10, 60):
                objects = moved(everything, n_objects)
                facts = plain(tables, objects)
                assert facts == at_once(tables, objects)
                times = [median_us(lambda: version(tables, objects)) for version in (plain, at_once)]
                print(
                    f"{domain:12} {label:9} {n_objects:7} {len(facts):6}"
                    f" {times[0]:9.0f} {times[1]:11.0f}"
                )


if __name__ == "__main__":
    main()
