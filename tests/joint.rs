//! `s2s-joint` on the recorded results of ProDG-v, with and without box noise.
//!
//! The files are read in place from the folder that the environment variable `GROUNDLOOP_DATA`
//! names; without it every test here says that it was skipped.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test file")]

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use common::data;
use groundloop::geometry::PixelBox;
use groundloop::grounding::{
    Exemplar, ExemplarText, Exemplars, GROUNDERS, Grounder, ObjectBox, Perception,
};
use groundloop::pddl::{Atom, Domain, Name, SourceText, Typed, parse_domain, parse_problem};
use groundloop::scene::Truth;

fn source(path: &Path) -> SourceText {
    SourceText::new(path.display().to_string(), fs::read_to_string(path).unwrap())
}

/// A labelled problem, with its facts in the order and number that they are listed in.
struct Labelled {
    exemplar: Exemplar,
    listed: Vec<Atom>,
}

impl Labelled {
    fn read(folder: &Path, number: u32, domain: &Domain) -> Self {
        let state = source(&folder.join(format!("problems/problem{number}.pddl")));
        let (_, after) = state.text.split_once("(:init").unwrap();
        let init = after.split("(:goal").next().unwrap();
        let listed = init.split('(').skip(1).filter_map(|form| {
            let words: Vec<&str> = form.split(')').next()?.split_whitespace().collect();
            Some(Atom::new(words.first()?, &words[1..]))
        });
        let listed = listed.collect();
        let boxes = source(&folder.join(format!("annotated_bboxes/problem{number}.json")));
        let image_size = [512, 512];
        let text = ExemplarText { boxes, state, image_size, volumes: None, masks: None };
        Self { exemplar: Exemplar::parse(&text, domain).unwrap(), listed }
    }

    fn predicates(&self) -> BTreeSet<&Name> {
        self.listed.iter().map(|atom| &atom.predicate).collect()
    }
}

/// The boxes that the authors' detector gave, with the types they recorded.
fn recorded_boxes(recorded: &Path, pair: &str, domain: &Domain) -> Vec<ObjectBox> {
    let boxes = fs::read_to_string(recorded.join(format!("objdet/objdet_{pair}.json"))).unwrap();
    let boxes: BTreeMap<Name, PixelBox> = serde_json::from_str(&boxes).unwrap();
    let stub = recorded.join(format!("object_stubs/objects_stub_{pair}.pddl"));
    let stub = fs::read_to_string(stub).unwrap();
    let text =
        format!("(define (problem p) (:domain {}) {stub} (:init) (:goal (and)))", domain.name);
    let objects: Vec<Typed> =
        parse_problem(&SourceText::new("stub", text), domain).unwrap().value.objects;
    let objects = objects.into_iter().filter_map(|typed| {
        let pixel_box = *boxes.get(&typed.name)?;
        let type_name = typed.types[0].clone();
        Some(ObjectBox { name: typed.name, type_name, pixel_box, volume: None, mask: None })
    });
    objects.collect()
}

/// The rule of the reference: each detection to the labelled box it overlaps most, the best one kept.
fn matched(seen: &[ObjectBox], truth: &[ObjectBox]) -> BTreeMap<Name, Name> {
    let mut best: BTreeMap<&Name, (f64, &Name)> = BTreeMap::new();
    for object in seen {
        let overlap = |t: &&ObjectBox| t.pixel_box.iou(&object.pixel_box);
        let nearest = truth.iter().reduce(|a, b| if overlap(&b) > overlap(&a) { b } else { a });
        let nearest = nearest.unwrap();
        let iou = overlap(&nearest);
        let entry = best.entry(&nearest.name).or_insert((iou, &object.name));
        if iou > entry.0 {
            *entry = (iou, &object.name);
        }
    }
    best.into_iter().map(|(truth, (_, seen))| (seen.clone(), truth.clone())).collect()
}

/// Repeatable noise of a normal distribution, by the sum of twelve uniform numbers.
struct Noise(u64);

impl Noise {
    fn next(&mut self, sigma: f64) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum * sigma
    }

    fn shake(&mut self, objects: &[ObjectBox], sigma: f64) -> Vec<ObjectBox> {
        let shaken = objects.iter().map(|object| {
            let b = object.pixel_box;
            let mut edge = |value: f64| value + self.next(sigma);
            let (x1, y1, x2, y2) = (edge(b.x1), edge(b.y1), edge(b.x2), edge(b.y2));
            let edges = [x1.min(x2 - 1.0), y1.min(y2 - 1.0), x2, y2];
            ObjectBox { pixel_box: PixelBox::from(edges), ..object.clone() }
        });
        shaken.collect()
    }
}

/// What came out over all pairs of a domain.
#[derive(Debug, Clone, Copy, Default)]
struct Score {
    tp: usize,
    fp: usize,
    missed: usize,
    exact: usize,
    pairs: usize,
    doubted: usize,
}

impl Score {
    fn precision(&self) -> f64 {
        self.tp as f64 / (self.tp + self.fp).max(1) as f64
    }
    fn recall(&self) -> f64 {
        self.tp as f64 / (self.tp + self.missed).max(1) as f64
    }
    fn f1(&self) -> f64 {
        2.0 * self.tp as f64 / (2 * self.tp + self.fp + self.missed).max(1) as f64
    }
}

struct Pair {
    grounder: usize,
    boxes: Vec<ObjectBox>,
    names: BTreeMap<Name, Name>,
    truth: Vec<Atom>,
}

struct Bench {
    grounders: Vec<Box<dyn Grounder>>,
    pairs: Vec<Pair>,
}

impl Bench {
    fn read(root: &Path, name: &str, grounder: &str) -> Self {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains").join(name);
        let perception = source(&shipped.join("perception.toml"));
        let perception = Perception::parse(&perception.name, &perception.text).unwrap();
        let (folder, recorded) =
            (root.join("data").join(name), root.join("results/reported_results").join(name));
        let domain = parse_domain(&source(&folder.join("domain.pddl"))).unwrap().value;
        let numbers =
            (1..=10).filter(|n| folder.join(format!("problems/problem{n}.pddl")).exists());
        let labelled: Vec<(u32, Labelled)> =
            numbers.map(|n| (n, Labelled::read(&folder, n, &domain))).collect();
        let build = GROUNDERS.iter().find(|(name, _)| *name == grounder).unwrap().1;
        let observed: BTreeSet<&Name> = perception.observed_predicates().collect();
        let (mut grounders, mut pairs) = (Vec::new(), Vec::new());
        for (e, exemplar) in &labelled {
            let examples = Exemplars::new(vec![exemplar.exemplar.clone()]).unwrap();
            grounders.push(build(&domain, &perception, &examples).unwrap());
            let tests = labelled
                .iter()
                .filter(|(t, test)| t != e && test.predicates() == exemplar.predicates());
            for (t, test) in tests {
                let boxes = recorded_boxes(&recorded, &format!("ex{e}_test{t}"), &domain);
                let truth = test.listed.iter().filter(|a| observed.contains(&a.predicate));
                pairs.push(Pair {
                    grounder: grounders.len() - 1,
                    names: matched(&boxes, &test.exemplar.objects),
                    boxes,
                    truth: truth.cloned().collect(),
                });
            }
        }
        Self { grounders, pairs }
    }

    fn score(&self, sigma: f64, seeds: u64) -> Score {
        let mut score = Score::default();
        for seed in 0..seeds {
            for (idx, pair) in self.pairs.iter().enumerate() {
                let mut noise = Noise(seed * 1000 + idx as u64);
                let boxes = noise.shake(&pair.boxes, sigma);
                let grounding = self.grounders[pair.grounder].ground(&boxes);
                score.doubted += usize::from(!grounding.doubts.is_empty());
                let holding = grounding.judged.iter().filter(|j| j.truth == Truth::True);
                let named = holding.map(|j| {
                    let args: Option<Vec<Name>> =
                        j.atom.args.iter().map(|a| pair.names.get(a).cloned()).collect();
                    args.map(|args| Atom { predicate: j.atom.predicate.clone(), args })
                });
                let named: Vec<Option<Atom>> = named.collect();
                let right: BTreeSet<&Atom> =
                    named.iter().flatten().filter(|a| pair.truth.contains(a)).collect();
                let (tp, fp) = (right.len(), named.len() - right.len());
                let missed = pair.truth.iter().filter(|a| !right.contains(a)).count();
                score.tp += tp;
                score.fp += fp;
                score.missed += missed;
                score.exact += usize::from(fp == 0 && missed == 0);
                score.pairs += 1;
            }
        }
        score
    }
}

/// Prints both grounders' scores over box noise, and compares them.
#[track_caller]
fn check(name: &str, perfect: bool, exact_min: usize) {
    let Some(root) = data("prodgv", "photographs and recorded results") else { return };
    let [plain, joint] = ["s2s", "s2s-joint"].map(|grounder| Bench::read(&root, name, grounder));
    for sigma in [0.0, 1.0, 2.0, 3.0, 5.0] {
        let seeds = if sigma == 0.0 { 1 } else { 20 };
        let scores = [&plain, &joint].map(|bench| bench.score(sigma, seeds));
        for (grounder, score) in ["s2s", "s2s-joint"].iter().zip(&scores) {
            println!(
                "{name:11} {grounder:9} {sigma} px: P|R {:.4}|{:.4} F1 {:.4} exact {:.2}/{} doubted {:.2}",
                score.precision(),
                score.recall(),
                score.f1(),
                score.exact as f64 / seeds as f64,
                joint.pairs.len(),
                score.doubted as f64 / seeds as f64,
            );
        }
        let [plain, joint] = scores;
        assert!(joint.f1() >= plain.f1(), "{sigma} px: {plain:?}, {joint:?}");
        assert!(joint.exact >= plain.exact, "{sigma} px: {plain:?}, {joint:?}");
        if sigma == 0.0 {
            assert!(joint.precision() >= 0.995, "{joint:?}");
            assert!(joint.exact >= exact_min, "{joint:?}");
            assert!(!perfect || joint.recall() == 1.0, "{joint:?}");
        }
    }
}

#[test]
fn cooking_stays_right() {
    check("cooking", true, 12);
}

#[test]
fn blocks_side_by_side_are_not_on_each_other() {
    check("blocksworld", true, 14);
}

/// The detector missed a disk of one photograph, so four states cannot be right.
#[test]
fn one_pair_of_disks_teaches_whole_towers() {
    check("hanoi", false, 16);
}
