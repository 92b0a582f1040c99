//! The front end as a whole: what it accepts, warns of and refuses, and with which words.

use super::*;
use crate::pddl::{Atom, Condition, Domain, Effect, Literal, Step, Term};

const BLOCKS: &str = "(define (domain blocks)
  (:requirements :strips :typing)
  (:types block robot)
  (:predicates (on ?x ?y - block) (clear ?x - block) (handempty ?r - robot))
  (:action stack
    :parameters (?x ?y - block)
    :precondition (and (clear ?x) (clear ?y))
    :effect (and (on ?x ?y) (not (clear ?y)))))";

fn source(text: &str) -> SourceText {
    SourceText::new("domain.pddl", text)
}

fn domain(text: &str) -> Domain {
    parse_domain(&source(text)).unwrap_or_else(|e| panic!("{}", e.render())).value
}

fn warnings(text: &str) -> Vec<String> {
    let parsed = parse_domain(&source(text)).unwrap_or_else(|e| panic!("{}", e.render()));
    parsed.warnings.into_iter().map(|w| w.message).collect()
}

fn refused(text: &str) -> PddlError {
    parse_domain(&source(text)).unwrap_err()
}

/// The blocks domain with `from` replaced.
fn blocks_with(from: &str, to: &str) -> String {
    assert!(BLOCKS.contains(from));
    BLOCKS.replacen(from, to, 1)
}

fn goal(text: &str) -> Result<Condition, PddlError> {
    let objects = [Typed::new("a", "block"), Typed::new("b", "block"), Typed::new("r", "robot")];
    parse_goal(&SourceText::new("goal.pddl", text), &domain(BLOCKS), &objects)
}

#[test]
fn an_unknown_predicate_is_shown_with_its_context_and_the_likely_name() {
    let text = blocks_with("(and (clear ?x) (clear ?y))", "(and (claer ?x))");
    assert_eq!(
        refused(&text).render(),
        "\
domain.pddl:7:25: error: unknown predicate `claer`
 --> in action stack, precondition
  |
7 |     :precondition (and (claer ?x))
  |                         ^^^^^
  = help: did you mean `clear`?
"
    );
}

#[test]
fn a_wrong_number_of_arguments_is_underlined_as_a_whole() {
    let text = blocks_with("(on ?x ?y) (not", "(on ?x) (not");
    assert_eq!(
        refused(&text).render(),
        "\
domain.pddl:8:18: error: expected 2 arguments of `on`, got 1
 --> in action stack, effect
  |
8 |     :effect (and (on ?x) (not (clear ?y)))))
  |                  ^^^^^^^
"
    );
}

#[test]
fn a_parenthesis_that_is_never_closed_is_found_at_its_place() {
    assert_eq!(
        refused("(define (domain d)\n  (:predicates (p)\n").render(),
        "\
domain.pddl:2:3: error: expected `)` before the end of the file: this `(` is never closed
  |
2 |   (:predicates (p)
  |   ^
"
    );
}

#[test]
fn an_object_of_the_wrong_type_is_refused() {
    let error = goal("(:goal (and (on a b) (on a r)))").unwrap_err();
    assert_eq!(
        error.render(),
        "\
goal.pddl:1:28: error: expected a `block` as `?y` of `on`, got `r` of type `robot`
 --> in goal
  |
1 | (:goal (and (on a b) (on a r)))
  |                            ^
"
    );
    assert_eq!(error.kind, ErrorKind::Semantics);
}

#[test]
fn what_is_not_supported_is_named() {
    let action = "(:action stack";
    let feature = |text: &str| match refused(text).kind {
        ErrorKind::Unsupported { feature } => feature,
        other @ (ErrorKind::Syntax | ErrorKind::Semantics) => panic!("{other:?}"),
    };
    let durative = blocks_with(action, "(:durative-action stack");
    assert_eq!(feature(&durative), "durative actions");
    let numeric = blocks_with("(and (clear ?x) (clear ?y))", "(> (size ?x) 3)");
    assert_eq!(feature(&numeric), "numeric conditions");
    let assign = blocks_with("(on ?x ?y) (not", "(assign (size ?x) 3) (not");
    assert_eq!(feature(&assign), "numeric fluents");
    let preference = blocks_with("(and (clear ?x) (clear ?y))", "(preference p (clear ?x))");
    assert_eq!(feature(&preference), "preferences");
    let constraints = blocks_with(action, "(:constraints (always (clear ?x))) (:action stack");
    assert_eq!(feature(&constraints), "trajectory constraints");
}

#[test]
fn names_that_do_not_fit_together_are_refused() {
    for (from, to, message) in [
        ("(clear ?y))\n", "(clear ?z))\n", "the variable `?z` is not bound here"),
        ("(clear ?y))\n", "(clear y))\n", "unknown object `y`"),
        ("?y - block)\n    :pre", "?y - blok)\n    :pre", "unknown type `blok`"),
        ("(?x ?y - block)\n", "(?x ?x - block)\n", "the parameter `x` is declared twice"),
        ("(clear ?x - block)", "(on ?x - block)", "the predicate `on` is declared twice"),
        ("block robot)", "block - robot robot - block)", "the type `block` is its own ancestor"),
        ("(handempty ?r - robot)", "(not ?r - robot)", "`not` cannot name a predicate"),
        (":effect", ":efect", "expected one of :parameters :precondition :effect, got `:efect`"),
        ("(:types", "(:tipes", "got a list that begins with `:tipes`"),
        (":strips", "strips", "expected a requirement, got `strips`"),
    ] {
        let error = refused(&blocks_with(from, to));
        assert!(error.message.contains(message), "{}", error.render());
    }
}

#[test]
fn a_second_action_of_the_same_name_is_refused() {
    let twice = blocks_with("(:action stack", "(:action stack :effect (and)) (:action stack");
    assert_eq!(refused(&twice).message, "the action `stack` is declared twice");
}

#[test]
fn case_glued_dashes_and_missing_spaces_are_accepted() {
    let loose = "(DEFINE (Domain Blocks) (:Predicates (On ?A- Block ?b -block) (At))
      (:types Block) ; types may come after
      (:action Move:parameters(?A ?x-- block):precondition(and(on ?a ?X-))
        :effect(not(ON ?a ?x-))))";
    let domain = domain(&loose.replace("Move:", "Move :").replace("?x--", "?x- -"));
    let action = domain.action("move").unwrap();
    assert_eq!(action.params, [Typed::new("a", "block"), Typed::new("x-", "block")]);
    assert_eq!(domain.predicate("on").unwrap().params[1], Typed::new("b", "block"));
    assert!(domain.predicate("at").unwrap().params.is_empty());
}

#[test]
fn a_feature_used_without_its_requirement_is_only_a_warning() {
    let text = BLOCKS.replace("(and (clear ?x) (clear ?y))", "(or (not (clear ?x)) (= ?x ?y))");
    assert_eq!(
        warnings(&text),
        [
            "`:disjunctive-preconditions` is used here but not declared",
            "`:negative-preconditions` is used here but not declared",
            "`:equality` is used here but not declared",
        ]
    );
    assert_eq!(warnings(&text.replace(":strips", ":adl")), Vec::<String>::new());
    let comment = text.replace(":strips", ":adl ; all of it\n");
    assert_eq!(warnings(&comment), Vec::<String>::new());
    assert_eq!(
        warnings(&BLOCKS.replace(":strips", ":fluents")),
        ["the requirement `:fluents` is declared but not understood"]
    );
}

#[test]
fn an_inner_variable_may_hide_an_outer_one() {
    let text = BLOCKS.replace(
        "(and (clear ?x) (clear ?y))",
        "(and (clear ?x) (exists (?x - robot) (handempty ?x)))",
    );
    let messages = warnings(&text);
    assert_eq!(messages.iter().filter(|m| *m == "`?x` hides an outer variable").count(), 1);
    let inner_only = text.replace("(handempty ?x)", "(clear ?x)");
    assert!(refused(&inner_only).message.contains("got `?x` of type `robot`"));
}

#[test]
fn a_wider_variable_is_a_warning_and_a_foreign_one_an_error() {
    let wide = blocks_with("(?x ?y - block)\n", "(?x - (either block robot) ?y)\n");
    let messages = warnings(&wide);
    let first = "`?x` of type `either block robot` (4 more like it)";
    assert_eq!(messages.iter().filter(|m| m.ends_with(first)).count(), 1, "{messages:?}");
    let foreign = blocks_with("(?x ?y - block)\n", "(?x - robot ?y - block)\n");
    assert!(refused(&foreign).message.contains("got `?x` of type `robot`"));
}

#[test]
fn nested_effects_keep_their_structure() {
    let text = blocks_with(
        "(and (on ?x ?y) (not (clear ?y)))",
        "(forall (?z - block) (when (on ?z ?x) (when (clear ?z) (and (not (on ?z ?x))))))",
    );
    let domain = domain(&text);
    let Effect::Forall(variables, inner) = &domain.actions[0].effect else { panic!() };
    assert_eq!(variables, &[Typed::new("z", "block")]);
    let Effect::When(_, inner) = &**inner else { panic!() };
    let Effect::When(_, inner) = &**inner else { panic!() };
    let args = vec![Term::Var("z".into()), Term::Var("x".into())];
    let deleted = Effect::Delete(Literal { predicate: "on".into(), args });
    assert_eq!(**inner, Effect::And(vec![deleted]));
}

const COSTS: &str = "(define (domain d) (:requirements :strips :action-costs)
  (:predicates (p)) (:functions (total-cost) - number (far ?x) - number)
  (:action a :parameters (?x) :effect (and (p) (increase (total-cost) (far ?x))))
  (:action b :effect (and (p) (increase (total-cost) 2.5))))";

#[test]
fn costs_are_read_and_state_dependent_ones_are_refused() {
    let domain = domain(COSTS);
    let text = "(define (problem p) (:domain d) (:objects x y) (:goal (p))
      (:init (= (far x) 2) (= (far y) 0.5) (= (total-cost) 0)) (:metric minimize (total-cost)))";
    let problem = parse_problem(&source(text), &domain).unwrap();
    assert_eq!(problem.value.costs[&Atom::new("far", &["y"])], Number::new(5, 1));
    assert!(problem.value.minimise_cost);
    assert_eq!(problem.warnings, []);
    // Values that nothing costs may be what they like.
    let negative = parse_problem(&source(&text.replace("0.5", "-0.5")), &domain).unwrap().value;
    assert!(negative.costs[&Atom::new("far", &["y"])].is_negative());
    let long = text.replace("0.5", &"9".repeat(39));
    let long = parse_problem(&source(&long), &domain).unwrap_err();
    assert_eq!(long.help.as_deref(), Some("numbers have at most 38 digits"));
    let negative = refused(&COSTS.replace("2.5", "-2.5"));
    assert_eq!(negative.message, "expected a cost of 0 or more, got `-2.5`");
    let maximise = parse_problem(&source(&text.replace("minimize", "maximize")), &domain);
    assert!(matches!(maximise.unwrap_err().kind, ErrorKind::Unsupported { .. }));
    let conditional = refused(
        &COSTS.replace("(increase (total-cost) 2.5)", "(when (p) (increase (total-cost) 2.5))"),
    );
    assert!(matches!(conditional.kind, ErrorKind::Unsupported { .. }));
}

fn problem_text(objects: &str, init: &str) -> String {
    format!("(define (problem p) (:domain blocks) (:objects {objects}) (:init {init}) (:goal ()))")
}

#[test]
fn facts_given_twice_count_once() {
    let text = problem_text("a b - block", "(on a b) (clear a) (ON A B) (not (clear b))");
    let parsed = parse_problem(&source(&text), &domain(BLOCKS)).unwrap();
    assert_eq!(parsed.value.init.len(), 2);
    assert_eq!(parsed.warnings.len(), 1);
    assert_eq!(parsed.value.goal, Condition::True);
}

#[test]
fn a_fact_that_is_said_both_ways_is_refused() {
    for (init, column) in [("(clear a) (not (clear a))", 76), ("(not (clear a)) (CLEAR a)", 82)] {
        let text = problem_text("a - block", init);
        let error = parse_problem(&source(&text), &domain(BLOCKS)).unwrap_err();
        assert_eq!(error.message, "`(clear a)` is said to hold and not to hold");
        assert_eq!(error.place.column, column);
        assert!(error.help.unwrap().starts_with("the other is at line 1, column 66"));
    }
}

#[test]
fn a_type_may_be_declared_once_for_each_parent() {
    let text = blocks_with("block robot", "block - toy block - thing toy thing robot");
    assert_eq!(domain(&text).types.parents["block"], ["toy", "thing"]);
    let cycle = blocks_with("block robot", "block - toy toy - thing toy - block robot");
    assert!(refused(&cycle).message.ends_with("is its own ancestor"));
}

#[test]
fn what_surrounds_or_separates_is_named() {
    let refused = |text: &str| {
        let error = refused(text);
        format!("{error}; {}", error.help.clone().unwrap_or_default())
    };
    let prose = refused(&format!("Here is the domain: {BLOCKS}"));
    assert!(prose.contains(":1:1: error: expected `(define (domain …) …)`, got `Here`; "));
    assert!(prose.ends_with("leave out the text around the form, or begin its lines with `;`"));
    assert!(refused(&format!("{BLOCKS} Done.")).contains("got `Done.`; leave out the text after"));
    let fenced = refused(&format!("Here it is:\n```pddl\n{BLOCKS}\n```"));
    assert!(
        fenced.contains(":2:1: error: expected PDDL, got a Markdown fence; give the PDDL alone")
    );
    let comma = refused(&blocks_with("block robot", "block, robot"));
    assert!(comma.contains(":3:16: error: expected PDDL, got a comma; names are separated by"));
}

#[test]
fn an_object_that_repeats_a_constant_is_tolerated_if_its_type_agrees() {
    let domain = domain(&blocks_with("(:predicates", "(:constants r - robot) (:predicates"));
    let parsed = parse_problem(&source(&problem_text("r a - object", "")), &domain).unwrap();
    assert_eq!(parsed.value.objects, [Typed { name: "a".into(), types: vec![] }]);
    let clash = parse_problem(&source(&problem_text("r - block", "")), &domain).unwrap_err();
    assert!(clash.message.contains("of type `robot`, not `block`"), "{}", clash.message);
}

#[test]
fn another_domains_problem_is_refused_with_help() {
    let text = problem_text("a - block", "").replace("(:domain blocks)", "(:domain hanoi)");
    let error = parse_problem(&source(&text), &domain(BLOCKS)).unwrap_err();
    assert_eq!(error.message, "expected the domain `blocks`, got `hanoi`");
    assert!(error.help.unwrap().contains("defines `blocks`"));
    let swapped = parse_problem(&source(BLOCKS), &domain(BLOCKS)).unwrap_err();
    assert_eq!(swapped.help.as_deref(), Some("this file holds a domain, not a problem"));
}

#[test]
fn timed_literals_are_told_from_a_predicate_named_at() {
    let domain = domain("(define (domain d) (:predicates (at ?x ?y) (p)))");
    let facts = |text: &str| {
        let objects = ["x", "5"].map(|name| Typed { name: name.into(), types: vec![] });
        parse_facts(&source(text), &domain, &objects)
    };
    assert_eq!(facts("(at 5 x)").unwrap().value.len(), 1);
    let kind = facts("(at 5 (p))").unwrap_err().kind;
    assert_eq!(kind, ErrorKind::Unsupported { feature: "timed initial literals".to_owned() });
}

#[test]
fn goals_are_read_bare_or_in_their_form() {
    let bare = goal("(on a b)").unwrap();
    assert_eq!(goal("(:goal (on a b))").unwrap(), bare);
    assert_eq!(goal("(and)").unwrap(), Condition::True);
    assert_eq!(goal("(on a c)").unwrap_err().message, "unknown object `c`");
    assert_eq!(goal("").unwrap_err().message, "expected a goal, got an empty text");
    assert_eq!(
        goal("(on a b) (on b a)").unwrap_err().message,
        "expected the end of the file, got a list that begins with `on`"
    );
}

#[test]
fn facts_are_read_from_a_list_an_init_or_a_problem() {
    let objects = [Typed::new("a", "block"), Typed::new("b", "block")];
    let problem = problem_text("a b - block", "(on a b) (clear a)");
    for text in ["(on a b) (clear a)", "(:init (on a b) (clear a))", &problem] {
        let facts = parse_facts(&source(text), &domain(BLOCKS), &objects).unwrap().value;
        let expected = [Atom::new("clear", &["a"]), Atom::new("on", &["a", "b"])];
        assert_eq!(facts.into_iter().collect::<Vec<_>>(), expected);
    }
}

#[test]
fn plans_are_read_with_comments() {
    let text = "(Pick A)\n(place a b) ; done\n; cost = 2 (unit cost)\n";
    let plan = parse_plan(&source(text)).unwrap();
    assert_eq!(plan, [Step::new("pick", &["a"]), Step::new("place", &["a", "b"])]);
    assert_eq!(parse_plan(&source("(a (b))")).unwrap_err().place.column, 4);
    assert!(parse_plan(&source("a b")).is_err());
    assert!(parse_plan(&source("()")).is_err());
}

#[test]
fn rules_are_checked_against_their_domain() {
    let rules = |text: &str| parse_rules(&source(text), &domain(BLOCKS));
    let ok = "(define (domain blocks)
      (:derived (clear ?x- block) (not (exists (?y- block) (on ?y ?x)))))";
    assert_eq!(rules(ok).unwrap()[0].head.params, [Typed::new("x", "block")]);
    let untyped = rules(&ok.replace("?x- block", "?x")).unwrap();
    assert_eq!(untyped[0].head.params, [Typed::new("x", "block")]);
    let cyclic = rules(&ok.replace("(on ?y ?x)", "(clear ?y)")).unwrap_err();
    assert_eq!(cyclic.message, "the derived predicate `clear` depends on its own negation");
    assert_eq!((cyclic.place.line, cyclic.place.column), (2, 7));
    assert!(rules(&ok.replace("domain blocks", "domain other")).is_err());
    assert!(rules(&ok.replace("(clear ?x", "(clean ?x")).is_err());
    assert!(rules(&ok.replace("?x- block", "?x- robot")).is_err());
}

#[test]
fn an_action_may_not_change_a_derived_predicate() {
    let text = blocks_with("(:action", "(:derived (clear ?x - block) (not (on ?x ?x))) (:action");
    assert!(refused(&text).message.contains("`clear` is derived"));
}

mod soup {
    use proptest::prelude::*;

    use super::*;

    /// Texts made of the words of the language in any order, more or less balanced.
    fn token_soup() -> impl Strategy<Value = String> {
        let words = [
            "(",
            "(",
            "(",
            ")",
            ")",
            ")",
            "define",
            "domain",
            "problem",
            "blocks",
            ":predicates",
            ":types",
            ":action",
            ":parameters",
            ":precondition",
            ":effect",
            ":derived",
            ":goal",
            ":init",
            ":objects",
            ":domain",
            ":metric",
            ":functions",
            "and",
            "or",
            "not",
            "when",
            "forall",
            "exists",
            "imply",
            "=",
            "increase",
            "total-cost",
            "either",
            "-",
            "?x",
            "?x-",
            "-t",
            "block",
            "on",
            "clear",
            "a",
            "5",
            ";c\n",
            "object",
            "minimize",
            "\u{e9}",
            "?",
        ];
        prop::collection::vec(prop::sample::select(words.to_vec()), 0..60)
            .prop_map(|words| words.join(" "))
    }

    fn read_everything(text: &str) {
        let source = SourceText::new("soup", text);
        let blocks = domain(BLOCKS);
        let objects = [Typed::new("a", "block")];
        let errors = [
            parse_domain(&source).err(),
            parse_problem(&source, &blocks).err(),
            parse_rules(&source, &blocks).err(),
            parse_goal(&source, &blocks, &objects).err(),
            parse_facts(&source, &blocks, &objects).err(),
            parse_plan(&source).err(),
        ];
        for error in errors.into_iter().flatten() {
            let shown = error.render();
            assert!(shown.contains('^') && shown.starts_with("soup:"), "{shown}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            read_everything(&String::from_utf8_lossy(&bytes));
        }

        #[test]
        fn any_order_of_words_is_read_or_refused(text in token_soup()) {
            read_everything(&text);
            read_everything(&format!("(define (domain blocks) {text})"));
            read_everything(&format!("{}{text}", &BLOCKS[..BLOCKS.len() - 1]));
        }

        #[test]
        fn a_domain_with_a_part_missing_is_read_or_refused(
            cut in 0..BLOCKS.len(), len in 0..40_usize,
        ) {
            let end = (cut + len).min(BLOCKS.len());
            read_everything(&format!("{}{}", &BLOCKS[..cut], &BLOCKS[end..]));
        }
    }

    #[test]
    fn deep_nesting_inside_a_condition_is_refused_not_overflowed() {
        for depth in [100, 190, 250, 100_000] {
            let condition = format!("{}(clear ?x){}", "(not ".repeat(depth), ")".repeat(depth));
            read_everything(&blocks_with("(and (clear ?x) (clear ?y))", &condition));
        }
    }
}
