//! Sentences and what they are read as; the words come from the shipped `language.toml` files.

use super::super::{GoalError, GoalObject, Language, ParsedGoal, Reason, Referent};
use super::parse;
use crate::geometry::PixelBox;
use crate::pddl::{Domain, Name, SourceText, parse_domain};
use crate::settings::joined;

const BLOCKS: &str = include_str!("../../../domains/blocksworld/domain.pddl");
const HANOI: &str = include_str!("../../../domains/hanoi/domain.pddl");
/// Types with parents, objects without colours: what a kitchen needs.
const KITCHEN: &str = "(define (domain kitchen)
    (:types movable location - object container tool veggie - movable cuttool - tool)
    (:predicates (in ?o - movable ?c - container) (at ?o - movable ?l - location)
        (is-sliced ?v - veggie)))";
const KITCHEN_WORDS: &str = r#"
    examples = ["Slice the tomato and place it in the bowl."]
    articles = ["the", "a"]
    fillers = ["place", "put"]
    separators = ["and"]
    all = ["all", "every"]
    pronouns = ["it"]
    [[noun]]
    type = "veggie"
    one = ["vegetable"]
    many = ["vegetables"]
    [[noun]]
    type = "container"
    one = ["bowl", "dish"]
    many = ["bowls"]
    name = "bowl"
    [[relation]]
    phrases = ["in", "into"]
    predicate = "in"
    [[relation]]
    phrases = ["on"]
    predicate = "at"
    [[property]]
    phrases = ["slice", "cut", "sliced"]
    predicate = "is-sliced"
"#;

fn domain(text: &str) -> Domain {
    parse_domain(&SourceText::new("domain.pddl", text)).unwrap().value
}

fn blocks_language() -> Language {
    let text = include_str!("../../../domains/blocksworld/language.toml");
    Language::from_toml("language.toml", text).unwrap()
}

fn hanoi_language() -> Language {
    let text = include_str!("../../../domains/hanoi/language.toml");
    Language::from_toml("language.toml", text).unwrap()
}

fn object(name: &str, type_name: &str, colour: &str, at: Option<[f64; 4]>) -> GoalObject {
    GoalObject {
        name: name.into(),
        type_name: type_name.into(),
        colour: (!colour.is_empty()).then(|| colour.into()),
        pixel_box: at.map(PixelBox::from),
    }
}

/// Blocks of these colours side by side from left to right.
fn row(colours: &[&str]) -> Vec<GoalObject> {
    colours
        .iter()
        .enumerate()
        .map(|(idx, colour)| {
            let x = 50.0 * idx as f64;
            object(&format!("{colour}_block"), "block", colour, Some([x, 0.0, x + 40.0, 40.0]))
        })
        .collect()
}

/// Three pegs and a tower of three disks on the left one; two disks are orange.
fn pegs() -> Vec<GoalObject> {
    let mut objects: Vec<GoalObject> = ["left_peg", "middle_peg", "right_peg"]
        .iter()
        .zip([100.0, 250.0, 400.0])
        .map(|(name, x)| object(name, "peg", "", Some([x - 5.0, 50.0, x + 5.0, 250.0])))
        .collect();
    // Names in an order that is not the one of the image.
    objects.swap(0, 2);
    for (name, colour, half, y) in [
        ("orange_disk", "orange", 40.0, 180.0),
        ("orange_disk2", "orange", 60.0, 200.0),
        ("blue_disk", "blue", 80.0, 220.0),
    ] {
        let at = Some([100.0 - half, y, 100.0 + half, y + 20.0]);
        objects.push(object(name, "disk", colour, at));
    }
    objects
}

fn blocks(instruction: &str, colours: &[&str]) -> Result<ParsedGoal, GoalError> {
    parse(instruction, &domain(BLOCKS), &blocks_language(), &row(colours))
}

fn hanoi(instruction: &str) -> Result<ParsedGoal, GoalError> {
    parse(instruction, &domain(HANOI), &hanoi_language(), &pegs())
}

/// The goal as text, or the error as people see it.
fn shown(goal: Result<ParsedGoal, GoalError>) -> String {
    match goal {
        Ok(goal) => goal.goal.to_string(),
        Err(error) => error.render(),
    }
}

const SIX: &[&str] = &["red", "green", "blue", "yellow", "purple", "pink"];

#[test]
fn many_ways_to_ask_for_one_stack() {
    let wanted = "(and (on red_block green_block) (on green_block blue_block))";
    for said in [
        "Create a stack of blocks: red over green over blue.",
        "create a stack of block: red over green over blue",
        "CREATE A STACK OF BLOCKS: RED OVER GREEN OVER BLUE!",
        "Build a tower: the red block on the green block on the blue block.",
        "Build a tower of three blocks with red on top of green on top of blue.",
        "red over green over blue",
        "Red on green, green on blue.",
        "Please put the red block on the green block and then the green block on the blue block.",
        "Put red on green; put green on blue",
        "Stack the red cube onto the green cube, over the blue one",
        "I want red on green, and I want green on blue.",
        "Can you stack red above green above blue?",
        "From top to bottom: red, green, blue.",
        "Stack from bottom to top: blue, green and red",
        "Stack red, green and blue from top to bottom.",
        "red_block over green_block over blue_block",
        "red-block over green-block over blue-block",
        "One stack: red block over green block over blue block",
        "On green put red, and on blue put green.",
        "Make the tower (red over green over blue).",
    ] {
        let got = shown(blocks(said, SIX));
        let swapped = "(and (on green_block blue_block) (on red_block green_block))";
        assert!(got == wanted || got == swapped, "{said}\n{got}");
    }
    assert_eq!(
        shown(blocks("Blue under green under red.", SIX)),
        "(and (on green_block blue_block) (on red_block green_block))"
    );
}

#[test]
fn several_stacks_and_their_number() {
    let wanted = "(and (on yellow_block green_block) (on green_block pink_block) \
                  (on red_block purple_block))";
    for said in [
        "Create two stacks of blocks: yellow over green over pink, and red over purple.",
        "Create two stacks of blocks: yellow over green over pink, red over purple.",
        "Two stacks: yellow over green over pink and red over purple",
        "Make 2 towers of blocks: 1. yellow over green over pink. 2. red over purple.",
        "Build two separate piles. Yellow over green over pink; red over violet.",
        "A stack with yellow over green over pink and a stack with red over purple",
    ] {
        let goal = blocks(said, SIX);
        assert_eq!(shown(goal.clone()), wanted, "{said}");
        assert!(goal.unwrap().notes.is_empty(), "{said}");
    }
    let error = blocks("Create three stacks: red over blue, green over pink", SIX).unwrap_err();
    assert!(error.to_string().contains("\"three stacks\" is said, 2 described"), "{error}");
}

#[test]
fn properties_stand_before_or_after_their_objects() {
    for (said, wanted) in [
        ("Put all blocks on the table.", "(forall (?x - block) (ontable ?x))"),
        ("all on the table", "(forall (?x - block) (ontable ?x))"),
        ("Unstack everything.", "(forall (?x - block) (ontable ?x))"),
        ("Put every block down on the table", "(forall (?x - block) (ontable ?x))"),
        ("Put the blocks on the table", "(forall (?x - block) (ontable ?x))"),
        ("red on the table", "(ontable red_block)"),
        ("Put down the red block.", "(ontable red_block)"),
        ("Clear the red block.", "(clear red_block)"),
        ("The red block is clear", "(clear red_block)"),
        ("Nothing on the red block, please", "(clear red_block)"),
        ("Uncover red and blue", "(and (clear red_block) (clear blue_block))"),
        (
            "red, blue and pink on the table",
            "(and (ontable red_block) (ontable blue_block) (ontable pink_block))",
        ),
        ("On the table: red, blue", "(and (ontable red_block) (ontable blue_block))"),
        (
            "Put red on the table and blue on it.",
            "(and (ontable red_block) (on blue_block red_block))",
        ),
        ("Take the red block and put it on the blue block", "(on red_block blue_block)"),
        ("Take the red block and put blue on it", "(on blue_block red_block)"),
        ("Unstack red from blue", "(ontable red_block)"),
        ("Stack the blocks: red on blue", "(on red_block blue_block)"),
        ("The goal is to have the yellow block on the pink one.", "(on yellow_block pink_block)"),
        ("Take red off blue and put it on green", "(on red_block green_block)"),
    ] {
        assert_eq!(shown(blocks(said, SIX)), wanted, "{said}");
    }
}

#[test]
fn every_disk_to_a_peg() {
    let wanted = "(forall (?x - disk) (on-peg ?x right_peg))";
    for said in [
        "Move all disks to the rightmost peg.",
        "move every disk to the right peg",
        "Move each disc onto the right-most pole!",
        "Put all of the rings on the peg on the right.",
        "Move all disks to the right.",
        "Put all disks on the right",
        "Bring the tower to the last peg",
        "Transfer the whole tower to the third rod",
        "Move the tower from the left peg to the right peg.",
        "Move everything to peg 3",
        "Move all three disks to peg three.",
        "Stack the disks on the far right peg",
        "Build the tower on the right-hand stick.",
        "The right peg should hold all disks.",
        "Move all disks to right_peg",
        "Move all the disks to the peg furthest to the right.",
        "I want you to carry every single disk over to the right-hand side peg",
        "Solve the puzzle: move the disks to the peg at the far right.",
    ] {
        assert_eq!(shown(hanoi(said)), wanted, "{said}");
    }
    for (said, peg) in [
        ("Move all disks to the leftmost peg", "left_peg"),
        ("Move the tower to the first peg.", "left_peg"),
        ("All disks on the middle peg", "middle_peg"),
        ("Put all disks in the middle", "middle_peg"),
        ("Put every disk onto the peg in the centre.", "middle_peg"),
        ("Move all disks to the second peg", "middle_peg"),
    ] {
        let wanted = format!("(forall (?x - disk) (on-peg ?x {peg}))");
        assert_eq!(shown(hanoi(said)), wanted, "{said}");
    }
}

#[test]
fn single_disks_are_told_by_colour_and_size() {
    for (said, wanted) in [
        ("Put the blue disk on the left peg", "(on-peg blue_disk left_peg)"),
        ("Move blue to the middle peg", "(on-peg blue_disk middle_peg)"),
        ("Move the smallest disk to the middle peg", "(on-peg orange_disk middle_peg)"),
        ("Move the largest orange disk to the middle peg", "(on-peg orange_disk2 middle_peg)"),
        ("Put the smallest disk on the blue disk", "(on orange_disk blue_disk)"),
        ("Put orange_disk2 on the right peg.", "(on-peg orange_disk2 right_peg)"),
        (
            "Move the orange disks to the right peg",
            "(and (on-peg orange_disk right_peg) (on-peg orange_disk2 right_peg))",
        ),
        (
            "Move the blue disk to the left peg and the smallest disk to the right peg.",
            "(and (on-peg blue_disk left_peg) (on-peg orange_disk right_peg))",
        ),
    ] {
        assert_eq!(shown(hanoi(said)), wanted, "{said}");
    }
}

#[test]
fn objects_not_seen_yet_are_expected_by_name() {
    let goal = blocks("red over blue over green", &["blue"]).unwrap();
    let expected: Vec<&str> = goal.expected.iter().map(|typed| typed.name.as_str()).collect();
    assert_eq!(expected, ["red_block", "green_block"]);
    assert!(goal.expected.iter().all(|typed| typed.types == [Name::new("block")]));
    let means: Vec<(&str, &Referent)> =
        goal.phrases.iter().map(|phrase| (phrase.text.as_str(), &phrase.means)).collect();
    assert_eq!(
        means,
        [
            ("red", &Referent::Object("red_block".into())),
            ("blue", &Referent::Object("blue_block".into())),
            ("green", &Referent::Object("green_block".into())),
        ]
    );
}

#[test]
fn a_position_waits_until_enough_objects_are_seen() {
    let mut objects = pegs();
    objects.retain(|object| object.name != "right_peg");
    let read = |objects: &[GoalObject]| {
        parse("All disks to the rightmost peg", &domain(HANOI), &hanoi_language(), objects)
    };
    let error = read(&objects).unwrap_err();
    assert!(error.may_resolve_later(), "{error}");
    // Without boxes the names tell, and only the names.
    let mut objects = pegs();
    for object in &mut objects {
        object.pixel_box = None;
    }
    assert_eq!(shown(read(&objects)), "(forall (?x - disk) (on-peg ?x right_peg))");
    for (idx, object) in objects.iter_mut().enumerate() {
        object.name = format!("object{idx}").as_str().into();
    }
    assert!(read(&objects).unwrap_err().may_resolve_later());
}

#[test]
fn contradictions_are_named() {
    let check = |said: &str, wanted: &str| {
        let text = blocks(said, SIX).unwrap_err().to_string();
        assert!(text.contains(wanted), "{said}\n{text}");
    };
    check("red on blue and blue on red", "blue_block → red_block → blue_block");
    check(
        "red on blue, blue on green, green on red",
        "green_block → red_block → blue_block → green_block",
    );
    check("red on red", "red_block → red_block");
    check("red over blue, red over green", "stands on one block only");
    check("red over blue, green over blue", "carries one block only");
    check("red over blue and red on the table", "is not on the table");
    check("all blocks on the table and red over blue", "is not on the table");
    check("red over blue; clear blue", "is not clear");
    check("all blocks on the red block", "red_block → red_block");
    let text = hanoi("all disks on the left peg and the blue disk on the right peg").unwrap_err();
    assert!(text.to_string().contains("on one peg only"), "{text}");
}

#[test]
fn errors_point_at_the_words() {
    let cases = [
        (
            blocks("Put the red block on the grean block.", SIX),
            "instruction:1:26: error: \"grean\" is not a word of this domain; did you mean \
             \"green\"?\n  | Put the red block on the grean block.\n  |                          \
             ^^^^^\n  = example: Create a stack of blocks: red over blue over green.",
        ),
        (
            blocks("red over blue and green", SIX),
            "instruction:1:19: error: nothing is said about \"green\"\n  | red over blue and green\n  \
             |                   ^^^^^\n  = example: Create a stack of blocks: red over blue over \
             green.",
        ),
    ];
    for (goal, wanted) in cases {
        let text = shown(goal);
        assert_eq!(
            text.split_whitespace().collect::<Vec<_>>(),
            wanted.split_whitespace().collect::<Vec<_>>(),
            "{text}"
        );
    }
    let marks = shown(blocks("Put the rëd block on\n\tthe grean block.", SIX));
    assert!(marks.starts_with("instruction:1:9: error: \"rëd\""), "{marks}");
    let lines: Vec<String> = shown(blocks("Put rëd", SIX)).lines().map(str::to_owned).collect();
    assert_eq!(lines[1], "  | Put rëd");
    assert_eq!(lines[2], "  |     ^^^");
}

#[test]
fn every_refusal_says_why() {
    let check = |goal: Result<ParsedGoal, GoalError>, wanted: &str| {
        let text = goal.unwrap_err().to_string();
        assert!(text.contains(wanted), "{text}\nwanted: {wanted}");
    };
    check(blocks("", SIX), "says nothing");
    check(blocks(" \n", SIX), "says nothing");
    check(blocks("Please build a tower.", SIX), "says nothing");
    check(blocks("red blue green", SIX), "a relation between \"red\" and \"blue\"");
    check(blocks("red", SIX), "nothing is said about \"red\"");
    check(blocks("red over", SIX), "expected an object after \"over\"");
    check(blocks("over red", SIX), "expected an object before \"over\"");
    check(blocks("clear", SIX), "expected an object after \"clear\"");
    check(blocks("put the block on the table", SIX), "may be any of blue_block, green_block");
    check(blocks("two blocks on the table", SIX), "there are 6 such objects");
    check(blocks("red over blue except green", SIX), "\"except\" makes no sense here");
    check(blocks("do not put red on blue", SIX), "\"do not put\" denies or forbids");
    check(blocks("red or blue over green", SIX), "\"or\" leaves a choice");
    check(blocks("Put red over blue on the table.", SIX), "this may mean");
    let said = "The red block should be on top of the green block, which is on the blue block.";
    check(blocks(said, SIX), "this may mean (on red_block green_block), or (and (on red_block");
    check(blocks("red > blue", SIX), "\">\" is not a word");
    check(blocks("put it on blue", SIX), "\"it\" has nothing to stand for");
    check(blocks(&"red ".repeat(2000), SIX), "at most 4096 bytes");
    check(hanoi("move the orange disk to the left peg"), "any of orange_disk, orange_disk2");
    check(hanoi("move the leftmost disk to the left peg"), "may be any of");
    check(hanoi("move all disks to peg 4"), "there are 3 such objects");
    check(hanoi("move the left peg to the right peg"), "cannot be said of peg and peg");
    check(hanoi("move all disks to all red pegs"), "0 of 1 peg objects seen");
    check(
        blocks("Move all blocks to the left", SIX),
        "cannot say \"to\"; it can say on, under, on table, clear",
    );
    check(blocks("red and blue on red", SIX), "in a circle");
    check(blocks("put red on top", SIX), "\"top\" alone means nothing");
}

#[test]
fn other_domains_need_other_words_only() {
    let words = Language::from_toml("language.toml", KITCHEN_WORDS).unwrap();
    let objects = [
        object("tomato", "veggie", "", None),
        object("carrot", "veggie", "", None),
        object("cutting_board", "location", "", None),
    ];
    let read = |said: &str| shown(parse(said, &domain(KITCHEN), &words, &objects));
    for (said, wanted) in [
        ("Slice the tomato and put it in the bowl.", "(and (is-sliced tomato) (in tomato bowl))"),
        ("Slice the carrot and tomato", "(and (is-sliced carrot) (is-sliced tomato))"),
        (
            "Cut all vegetables, put the vegetables in a bowl",
            "(and (forall (?x - veggie) (is-sliced ?x)) (forall (?x - veggie) (in ?x bowl)))",
        ),
        ("Put the tomato on the cutting board.", "(at tomato cutting_board)"),
    ] {
        assert_eq!(read(said), wanted, "{said}");
    }
    let goal = parse("Tomato in the bowl", &domain(KITCHEN), &words, &objects).unwrap();
    assert_eq!(goal.expected.len(), 1);
}

#[test]
fn a_language_that_does_not_fit_its_domain_is_refused() {
    let check = |text: &str, wanted: &str| {
        let error = match Language::from_toml("words.toml", text) {
            Ok(language) => {
                parse("red over blue", &domain(BLOCKS), &language, &[]).unwrap_err().to_string()
            }
            Err(problems) => joined(&problems),
        };
        assert!(error.contains(wanted), "{error}\nwanted: {wanted}");
    };
    check(
        "examples = []\nfilers = []",
        "words.toml:2:1: error: filers: unknown key; did you mean fillers?",
    );
    check(
        "examples = []\n[[noun]]\ntype = \"block\"\none = []\nmani = []",
        "words.toml:5:1: error: noun[0].mani: unknown key; did you mean many?",
    );
    check("examples = 3", "words.toml:1:12: error: examples: expected an array, got 3");
    check("examples = []\n[[position]]\npick = \"lft\"\nbefore = []", "words.toml:3:8: ");
    check(
        "examples = []\n[[noun]]\ntype = \"ball\"\none = []\nmany = []",
        "noun[0].type: expected a type of the domain",
    );
    let relation = |phrases: &str, predicate: &str| {
        format!("examples = []\n[[relation]]\nphrases = {phrases}\npredicate = \"{predicate}\"\n")
    };
    check(
        &relation("[\"over\"]", "upon"),
        "relation[0].predicate: expected a predicate of the domain",
    );
    check(&relation("[\"over\"]", "clear"), "a predicate of 2 arguments, got clear, which has 1");
    check(&format!("fillers = [\"over\"]\n{}", relation("[\"over\"]", "on")), "already means");
    check(&relation("[\"\"]", "on"), "no word but articles");
    check(
        "examples = []\n[[never]]\nboth = [\"on x y\", \"(on ?x ?y)\"]\nbecause = \"\"",
        "an atom such as",
    );
    check(
        "examples = []\n[[never]]\nboth = [\"(on ?x)\", \"(on ?x ?y)\"]\nbecause = \"\"",
        "never[0].both[0]: expected a predicate of 1 arguments, got on, which has 2",
    );
}

#[test]
fn the_examples_of_every_language_are_understood() {
    for example in blocks_language().examples {
        assert!(blocks(&example, SIX).is_ok(), "{}", shown(blocks(&example, SIX)));
    }
    for example in hanoi_language().examples {
        let got = hanoi(&example);
        // An example may name a colour that is not in view: it is expected then.
        assert!(got.is_ok(), "{}", shown(got));
    }
}

#[test]
fn only_missing_objects_are_worth_another_look() {
    assert!(!blocks("red over grean", SIX).unwrap_err().may_resolve_later());
    let error = blocks("the block on the table", &[]).unwrap_err();
    let GoalError::Instruction { reason } = &error else { panic!("{error}") };
    assert!(matches!(reason.reason, Reason::Ambiguous { .. } | Reason::NotSeen { .. }), "{error}");
    assert!(error.may_resolve_later());
}

proptest::proptest! {
    /// Arbitrary words, also half-known ones, never panic, and their errors render.
    #[test]
    fn any_text_is_read_or_refused(
        said in "((red|blue|over|on the table|clear|two|stacks|all|blocks|it|from|with|right|peg|[,:;.ä€>_-]|grün| ){1,3} ?){0,12}",
    ) {
        for goal in [blocks(&said, SIX), hanoi(&said)] {
            proptest::prop_assert!(!shown(goal).is_empty());
        }
    }
}
