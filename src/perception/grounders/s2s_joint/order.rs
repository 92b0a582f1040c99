//! Strict orders: one line of objects that the evidence contradicts least.

use super::assignment::{Assignment, BAND};
use crate::logic::Truth;
use crate::pddl::Name;

/// Most rounds of moving single objects to a better place in the line. Each round improves the line;
/// real scenes need two or three.
const ROUNDS_MAX: u32 = 50;

/// Decides a strict order.
///
/// `total` says that any two objects are related; `agreeing` are support predicates whose atoms are
/// taken as evidence too.
pub(super) fn decide(
    assignment: &mut Assignment,
    predicate: &Name,
    total: bool,
    agreeing: &[&Name],
) {
    let objects = assignment.objects_of(predicate);
    let n = objects.len();
    let evidence = evidence(assignment, predicate, &objects, agreeing);
    let line = line(&evidence, n);
    // A pair is accepted as the line has it where the evidence is clear, and where it follows.
    let least = if total { 2.0 * BAND } else { BAND };
    let mut known = vec![false; n * n];
    for (at, &first) in line.iter().enumerate() {
        for &second in &line[at + 1..] {
            let clear = if total {
                evidence[first * n + second]
            } else {
                let place = assignment.place(predicate, objects[first], objects[second]);
                place.map_or(0.0, |place| assignment.weights[place])
            };
            known[first * n + second] = clear >= least;
        }
    }
    close(&mut known, &line);
    for &(ref args, place) in &assignment.tuples(predicate).to_vec() {
        let [first, second] = args[..] else { continue };
        let number = |object| objects.binary_search(&object).unwrap_or_default();
        let (first, second) = (number(first), number(second));
        let undecided = if total {
            !known[second * n + first]
        } else {
            assignment.weights[place].abs() < BAND && !known[second * n + first]
        };
        let truth = match (known[first * n + second], undecided) {
            (true, _) => Truth::True,
            (false, true) => Truth::Unknown,
            (false, false) => Truth::False,
        };
        assignment.decide(place, truth);
    }
}

/// How much more speaks for each ordered pair than for the opposite one.
fn evidence(
    assignment: &Assignment,
    predicate: &Name,
    objects: &[usize],
    agreeing: &[&Name],
) -> Vec<f64> {
    let n = objects.len();
    let mut evidence = vec![0.0; n * n];
    for (i, &first) in objects.iter().enumerate() {
        for (j, &second) in objects.iter().enumerate() {
            let own =
                assignment.place(predicate, first, second).map_or(0.0, |at| assignment.weights[at]);
            let rests =
                agreeing.iter().filter(|name| assignment.holds(name, first, second)).count();
            let weight = own + rests as f64;
            evidence[i * n + j] += weight;
            evidence[j * n + i] -= weight;
        }
    }
    evidence
}

/// The objects in a line, by their sums of evidence and then by moving single ones.
fn line(evidence: &[f64], n: usize) -> Vec<usize> {
    let row = |i: usize| &evidence[i * n..(i + 1) * n];
    let sums: Vec<f64> = (0..n).map(|i| row(i).iter().sum()).collect();
    let mut line: Vec<usize> = (0..n).collect();
    line.sort_by(|&a, &b| sums[b].total_cmp(&sums[a]).then(a.cmp(&b)));
    for _ in 0..ROUNDS_MAX {
        let before = line.clone();
        for object in 0..n {
            let Some(from) = line.iter().position(|&other| other == object) else { continue };
            line.remove(from);
            line.insert(best_place(&line, row(object), from), object);
        }
        if line == before {
            break;
        }
    }
    line
}

/// Where in the line an object fits best; where it was, unless another place is better.
fn best_place(line: &[usize], evidence: &[f64], from: usize) -> usize {
    // Worth of the first place: before all others. Each step back turns one pair around.
    let mut worth: f64 = line.iter().map(|&other| evidence[other]).sum();
    let mut worths = vec![worth];
    for &other in line {
        worth -= 2.0 * evidence[other];
        worths.push(worth);
    }
    let mut best = from;
    for (place, &worth) in worths.iter().enumerate() {
        if worth > worths[best] + f64::EPSILON * (1.0 + worth.abs()) * line.len() as f64 {
            best = place;
        }
    }
    best
}

/// Adds what follows: of three in the line, if both neighbouring pairs are known, so is the outer.
fn close(known: &mut [bool], line: &[usize]) {
    let n = line.len();
    for &middle in line {
        for &first in line {
            if !known[first * n + middle] {
                continue;
            }
            for &last in line {
                known[first * n + last] |= known[middle * n + last];
            }
        }
    }
}
