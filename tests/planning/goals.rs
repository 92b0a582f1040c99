//! What goals mean: the instructions of ProDG-v, sentences of our own, and goal images.
//!
//! The data set is read in place from the folder that the environment variable `GROUNDLOOP_DATA`
//! names; without it its test says that it was skipped.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::common::{Process, data, files_below, project};
use groundloop::goals::{GOALS, GoalError, GoalInputs, GoalObject, ParsedGoal};
use groundloop::parts::{PartChoice, PartContext};
use groundloop::pddl::{
    Condition, Domain, Literal, Name, Problem, SourceText, Term, Typed, parse_problem,
};
use groundloop::perception::label_of;
use groundloop::run::{DomainFolder, ExemplarFiles};

/// The ground atoms that a conjunctive goal asks for over these objects.
fn ground(goal: &Condition, domain: &Domain, objects: &[Typed]) -> BTreeSet<String> {
    expand(goal, domain, objects, &BTreeMap::new())
}

fn expand(
    goal: &Condition,
    domain: &Domain,
    objects: &[Typed],
    bound: &BTreeMap<Name, Name>,
) -> BTreeSet<String> {
    match goal {
        Condition::True => BTreeSet::new(),
        Condition::And(parts) => {
            parts.iter().flat_map(|part| expand(part, domain, objects, bound)).collect()
        }
        Condition::Atom(Literal { predicate, args }) => {
            let name = |term: &Term| match term {
                Term::Var(name) => bound[name].to_string(),
                Term::Object(name) => name.to_string(),
            };
            let args: Vec<String> = args.iter().map(name).collect();
            BTreeSet::from([format!("{predicate} {}", args.join(" "))])
        }
        Condition::Forall(variables, body) => {
            let [variable] = variables.as_slice() else { panic!("one variable: {goal}") };
            let fitting = objects.iter().filter(|o| domain.types.fits(&o.types, &variable.types));
            let bind = |o: &Typed| {
                let more = [(variable.name.clone(), o.name.clone())];
                bound.clone().into_iter().chain(more).collect()
            };
            fitting.flat_map(|o| expand(body, domain, objects, &bind(o))).collect()
        }
        Condition::False
        | Condition::Equal(..)
        | Condition::Not(_)
        | Condition::Or(_)
        | Condition::Exists(..) => panic!("no conjunctive goal: {goal}"),
    }
}

fn folder(name: &str) -> DomainFolder {
    DomainFolder::read(&project("domains").join(name)).unwrap()
}

/// An object as a detector of this domain would give it.
fn object(
    folder: &DomainFolder,
    name: &Name,
    type_name: &Name,
    at: Option<[f64; 4]>,
) -> GoalObject {
    let spec = folder.perception.type_spec(type_name);
    GoalObject {
        name: name.clone(),
        type_name: type_name.clone(),
        colour: spec.and_then(|spec| label_of(spec, name).cloned()),
        pixel_box: at.map(Into::into),
    }
}

fn read(
    folder: &DomainFolder,
    instruction: &str,
    objects: &[GoalObject],
) -> Result<ParsedGoal, GoalError> {
    let choice = PartChoice::new("goal.kind", "instruction");
    let inputs = GoalInputs::words("test", instruction, folder.language.as_ref());
    let context = PartContext { choice: &choice, inputs, environment: |_| None };
    GOALS.build(&context).unwrap().read(&folder.domain, objects)
}

/// A problem of the data set: its instruction, annotated objects and true goal.
struct Recorded {
    instruction: String,
    objects: Vec<GoalObject>,
    problem: Problem,
}

impl Recorded {
    fn read(root: &Path, stem: &str, folder: &DomainFolder) -> Self {
        let text = |kind: &str, end: &str| {
            std::fs::read_to_string(root.join(format!("{kind}/{stem}.{end}"))).unwrap()
        };
        let problem = SourceText::new(stem, text("problems", "pddl"));
        let problem = parse_problem(&problem, &folder.domain).unwrap().value;
        let boxes: BTreeMap<String, [f64; 4]> =
            serde_json::from_str(&text("annotated_bboxes", "json")).unwrap();
        let typed = |name: &str| problem.objects.iter().find(|o| o.name == Name::new(name));
        let objects = boxes.iter().filter_map(|(name, at)| {
            typed(name).map(|o| object(folder, &o.name, &o.types[0], Some(*at)))
        });
        let objects = objects.collect();
        Self { instruction: text("instructions", "txt"), objects, problem }
    }
}

/// All instructions of a domain are read as what they say. The truth of an exception asks for more
/// atoms than its instruction says.
fn recorded_instructions(name: &str, exceptions: &[(&str, &[&str])]) {
    let Some(root) = data(&format!("prodgv/data/{name}"), "recorded instructions") else { return };
    let folder = folder(name);
    let files = files_below(&root.join("instructions"), "txt");
    assert!(files.len() >= 6, "{}", root.display());
    for path in files {
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let Recorded { instruction, objects, problem } = Recorded::read(&root, stem, &folder);
        let goal =
            read(&folder, &instruction, &objects).unwrap_or_else(|e| panic!("{}", e.render()));
        assert_eq!(goal.expected, [], "{stem}: {instruction}");
        let of = |goal: &Condition| ground(goal, &folder.domain, &problem.objects);
        let unsaid = exceptions.iter().find(|(exception, _)| *exception == stem);
        let unsaid = unsaid.iter().flat_map(|(_, atoms)| atoms.iter().map(ToString::to_string));
        let mut wanted = of(&problem.goal);
        for atom in unsaid {
            assert!(wanted.remove(&atom), "{stem}: its truth asks for {atom}");
        }
        if name != "cooking" {
            assert_eq!(of(&goal.goal), wanted, "{stem}: {instruction}");
            continue;
        }
        // The truths of cooking ask for every vegetable to be sliced, the instructions for one kind;
        // both ask for every vegetable in the bowl.
        let got = of(&goal.goal);
        assert!(got.is_subset(&wanted), "{stem}: {got:?}");
        let in_bowl = |atoms: &BTreeSet<String>| {
            atoms.iter().filter(|atom| atom.starts_with("in ")).cloned().collect::<Vec<_>>()
        };
        assert_eq!(in_bowl(&got), in_bowl(&wanted), "{stem}: {instruction}");
        let sliced: Vec<&str> = got.iter().filter_map(|a| a.strip_prefix("is-sliced ")).collect();
        assert!(!sliced.is_empty());
        for vegetable in problem.objects.iter().filter(|o| o.types[0] == "veggie") {
            let kind = vegetable.name.as_str().trim_end_matches(|c: char| c.is_ascii_digit());
            let is_said = instruction.to_lowercase().contains(kind);
            assert_eq!(sliced.contains(&vegetable.name.as_str()), is_said, "{stem}: {got:?}");
        }
    }
}

#[test]
fn recorded_instructions_of_blocksworld_are_read_as_what_they_say() {
    let unsaid: &[&str] = &["clear red_block", "clear yellow_block"];
    recorded_instructions("blocksworld", &[("problem3", unsaid)]);
}

#[test]
fn recorded_instructions_of_cooking_are_read_as_what_they_say() {
    recorded_instructions("cooking", &[]);
}

#[test]
fn recorded_instructions_of_hanoi_are_read_as_what_they_say() {
    recorded_instructions("hanoi", &[]);
}

/// Every sentence is read as these atoms over these objects (`name:type`, from left to right).
#[track_caller]
fn paraphrases(name: &str, objects: &[&str], sentences: &[&str], wanted: &[&str]) {
    let folder = folder(name);
    let seen = objects.iter().enumerate().map(|(i, text)| {
        let (name, type_name) = text.split_once(':').unwrap();
        let x = 50.0 * i as f64;
        object(&folder, &name.into(), &type_name.into(), Some([x, 0.0, x + 40.0, 40.0]))
    });
    let seen: Vec<GoalObject> = seen.collect();
    let typed: Vec<Typed> =
        seen.iter().map(|o| Typed::new(o.name.clone(), o.type_name.clone())).collect();
    for sentence in sentences {
        let goal = read(&folder, sentence, &seen);
        let goal = goal.unwrap_or_else(|e| panic!("{sentence}\n{}", e.render()));
        let got = ground(&goal.goal, &folder.domain, &typed);
        let wanted: BTreeSet<String> = wanted.iter().map(ToString::to_string).collect();
        assert_eq!(got, wanted, "{sentence}");
    }
}

#[test]
fn paraphrases_of_blocksworld() {
    let blocks = ["red_block:block", "green_block:block", "blue_block:block", "pink_block:block"];
    paraphrases(
        "blocksworld",
        &blocks,
        &[
            "Create two stacks of blocks: red over green, and blue over pink.",
            "I would like red on top of green and blue on top of pink.",
            "Please build two towers, red over green and blue over pink",
            "Make sure that the green block is under the red block and pink is under blue.",
            "Place the red cube on the green cube; place the blue cube onto the pink one.",
            "Put the leftmost block on the green block, and the blue block on the rightmost block.",
        ],
        &["on red_block green_block", "on blue_block pink_block"],
    );
    paraphrases(
        "blocksworld",
        &blocks,
        &[
            "Put every block on the table.",
            "Unstack everything.",
            "All blocks should be on the table",
            "Lay each block down on the table, one by one.",
        ],
        &blocks
            .map(|name| format!("ontable {}", name.replace(":block", "")))
            .each_ref()
            .map(String::as_str),
    );
}

#[test]
fn paraphrases_of_hanoi() {
    let objects =
        ["left_peg:peg", "middle_peg:peg", "right_peg:peg", "red_disk:disk", "blue_disk:disk"];
    paraphrases(
        "hanoi",
        &objects,
        &[
            "Move all disks to the rightmost peg.",
            "Bring the whole tower to the right peg.",
            "Every disk should end up on the peg furthest to the right",
            "Transfer all discs from the left rod to the right rod, please.",
            "Move the tower to the third peg.",
        ],
        &["on-peg red_disk right_peg", "on-peg blue_disk right_peg"],
    );
    paraphrases(
        "hanoi",
        &objects,
        &["Put the red ring on the middle peg.", "The central pole should hold the red disk."],
        &["on-peg red_disk middle_peg"],
    );
}

#[test]
fn paraphrases_of_cooking() {
    let objects = [
        "carrot:veggie",
        "tomato:veggie",
        "bowl:container",
        "wooden_board:workspace",
        "chopping_knife:cuttool",
    ];
    paraphrases(
        "cooking",
        &objects,
        &[
            "Slice the tomato and place the sliced vegetables in a bowl.",
            "Cut the tomato and put all vegetables into the bowl.",
            "Please chop the tomato, and then put everything in the dish.",
        ],
        &["is-sliced tomato", "in tomato bowl", "in carrot bowl"],
    );
    paraphrases(
        "cooking",
        &objects,
        &[
            "Slice the carrot and place it in the bowl.",
            "Chop up the carrot and put it into the bowl",
        ],
        &["is-sliced carrot", "in carrot bowl"],
    );
}

#[test]
fn sentences_without_a_clear_meaning_are_refused_with_the_word() {
    for (name, sentence, wanted) in [
        ("blocksworld", "Sort the blocks by colour.", "\"sort\""),
        ("blocksworld", "Put red on blue and red on green.", "contradict"),
        ("hanoi", "Juggle the disks.", "\"juggle\""),
        ("cooking", "Boil the tomato.", "\"boil\""),
    ] {
        let folder = folder(name);
        let error = read(&folder, sentence, &[]).unwrap_err();
        let said = error.render().to_lowercase();
        assert!(said.contains(wanted) && said.contains('^'), "{sentence}\n{said}");
    }
}

// ── goal images ─────────────────────────────────────────────────────────────────────────────────

/// Calls `groundloop ground` with the goal shown by an image; gives goal and length of the plan.
fn goal_image(
    domain: &str,
    image: &str,
    goal: &Path,
    more: &[&str],
) -> Result<(String, usize), String> {
    let example = |ending: &str| format!("domains/{domain}/exemplar/sim_640x480/{image}.{ending}");
    let (picture, boxes, state) = (example("png"), example("json"), example("pddl"));
    let folder = format!("domains/{domain}");
    let args = ["ground", "--domain", &folder, "--image", &picture, "--json"];
    let exemplar = ["--exemplar-image", &picture, "--exemplar-boxes", &boxes];
    let goal = ["--exemplar-state", &state, "--goal-image", goal.to_str().unwrap()];
    let ended = Process::start(&[&args[..], &exemplar, &goal, more].concat()).end();
    if ended.status.code() != Some(0) {
        assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
        return Err(ended.stderr);
    }
    let answer = ended.json();
    let goal = answer["goal"].as_str().unwrap().to_owned();
    Ok((goal, answer["plan"].as_array().unwrap().len()))
}

/// What the label of an example image says holds there, of these predicates.
fn labelled(domain: &str, image: &str, predicates: &[&str]) -> BTreeSet<String> {
    let folder = folder(domain);
    let file =
        |ending: &str| project(&format!("domains/{domain}/exemplar/sim_640x480/{image}.{ending}"));
    let (_, exemplar) =
        ExemplarFiles::on_disk(&file("png"), &file("json"), &file("pddl")).read(&folder).unwrap();
    let facts = exemplar.init.iter().filter(|f| predicates.contains(&f.predicate.as_str()));
    facts.map(ToString::to_string).collect()
}

#[track_caller]
fn shows(domain: &str, image: &str, goal: &str, predicates: &[&str]) {
    let path = format!("domains/{domain}/exemplar/sim_640x480/{goal}.png");
    let joint = ["--grounder", "s2s-joint"];
    let (got, n_steps) = goal_image(domain, image, Path::new(&path), &joint).unwrap();
    let wanted = labelled(domain, goal, predicates);
    assert!(n_steps > 0 && !wanted.is_empty());
    for atom in &wanted {
        assert!(got.contains(atom), "{atom} in {got}");
    }
    assert_eq!(got.matches('(').count(), wanted.len() + 1, "{wanted:?}: {got}");
}

#[test]
fn an_image_of_the_goal_is_what_it_shows() {
    shows("blocksworld", "c_close_and_apart", "a_tower_and_singles", &["on"]);
}

#[test]
fn what_no_action_changes_is_not_asked_for() {
    // `smaller` is observed, too, and stays as it is.
    shows("hanoi", "a_tower_left", "d_tower_right", &["on", "on-peg", "off-peg"]);
}

#[test]
fn a_goal_image_that_is_read_as_contradicting_itself_is_refused() {
    // One example of a tower says little about where the other pegs' disks are, and s2s judges each
    // fact by itself.
    let path = "domains/hanoi/exemplar/sim_640x480/d_tower_right.png";
    let each = ["--grounder", "s2s"];
    let said = goal_image("hanoi", "a_tower_left", Path::new(path), &each).unwrap_err();
    assert!(said.contains("it is read as (on-peg blue_disk left_peg) and (on-peg"), "{said}");
}

#[test]
fn a_goal_image_that_does_not_fit_is_refused() {
    let call = |path: &str, more: &[&str]| {
        goal_image("blocksworld", "b_high_tower", Path::new(path), more).unwrap_err()
    };
    let said = call("docs/replanning.png", &[]);
    let wanted = "docs/replanning.png: expected 640x480 pixels like the labelled example, or another \
                  size of its ratio (1.333), got 1100x476 (2.311)";
    assert!(said.contains(wanted), "{said}");
    assert!(call("nowhere.png", &[]).contains("nowhere.png"));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("options.toml");
    for (options, wanted) in [
        ("predicates = ['over']", "has no predicate \"over\""),
        ("predicate = ['on']", "goal.options.predicate: unknown key; did you mean predicates?"),
        ("predicates = ['holding']", "it shows no fact of holding"),
    ] {
        std::fs::write(&file, options).unwrap();
        let image = "domains/blocksworld/exemplar/sim_640x480/a_tower_and_singles.png";
        let said = call(image, &["--goal-options", file.to_str().unwrap()]);
        assert!(said.contains(wanted), "{said}");
    }
}

#[cfg(feature = "sim")]
#[test]
fn an_episode_reaches_what_an_image_shows() {
    let image = project("domains/hanoi/exemplar/sim_320x240/d_tower_right.png");
    let text = format!("goal.text={}", image.display());
    let sets = ["goal.kind=image", text.as_str(), "sim.scene=scenes/exemplar/a_tower_left.toml"];
    let episode = crate::common::episode(crate::common::small("hanoi.toml", &sets));
    assert_eq!(episode.report.verdict, "reached", "{}", episode.report.reason);
    assert!(episode.report.goal.contains("right_peg"), "{}", episode.report.goal);
}
