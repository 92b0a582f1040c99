//! A real llama.cpp server reads goals: opt-in, see `examples/llama_server.py`.
//!
//! The environment variable `GROUNDLOOP_LLAMA_URL` names the server; without it every test here says
//! that it was skipped. Any model will do: what is checked is that the server takes the requests and
//! holds to the grammar, not that the model understands.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use crate::common::project;
use groundloop::goals::{GOALS, GoalError, GoalInputs, GoalObject, ParsedGoal};
use groundloop::parts::{PartChoice, PartContext};
use groundloop::run::DomainFolder;

#[expect(clippy::disallowed_methods, reason = "the documented variable of an opt-in test")]
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
fn server() -> Option<String> {
    let url = std::env::var("GROUNDLOOP_LLAMA_URL").ok();
    if url.is_none() {
        println!("skipped: a real model: set GROUNDLOOP_LLAMA_URL (examples/llama_server.py)");
    }
    url
}

fn read(
    url: &str,
    domain: &str,
    dialect: &str,
    instruction: &str,
    objects: &[&str],
) -> Result<ParsedGoal, GoalError> {
    let folder = DomainFolder::read(&project("domains").join(domain)).unwrap();
    let seen = objects.iter().map(|text| {
        let (name, type_name) = text.split_once(':').unwrap();
        let (colour, pixel_box) = (None, None);
        GoalObject { name: name.into(), type_name: type_name.into(), colour, pixel_box }
    });
    let seen: Vec<GoalObject> = seen.collect();
    let options = format!(
        "url = '{url}'\nmodel = 'any'\ndialect = '{dialect}'\ntokens_max = 200\n\
         retry = {{ read_ms = 300000, total_ms = 600000 }}"
    );
    let options: toml::Table = options.parse().unwrap();
    let choice = PartChoice::new("goal.kind", "language_model").with_options(Some(&options), "");
    let inputs = GoalInputs {
        perception: Some(&folder.perception),
        ..GoalInputs::words("test", instruction, folder.language.as_ref())
    };
    let context = PartContext { choice: &choice, inputs, environment: |_| None };
    GOALS.build(&context).unwrap().read(&folder.domain, &seen)
}

#[test]
fn the_server_takes_the_grammar_of_every_domain() {
    let Some(url) = server() else { return };
    for (domain, said, objects) in [
        (
            "blocksworld",
            "Create a stack of blocks: red over green over yellow.",
            &["red_block:block", "green_block:block", "yellow_block:block", "arm:robot"][..],
        ),
        (
            "cooking",
            "Slice the carrot and place the sliced vegetables in a bowl.",
            &["carrot:veggie", "tomato:veggie", "bowl:container", "wooden_board:workspace"],
        ),
        (
            "hanoi",
            "Move all disks to the rightmost peg.",
            &["red_disk:disk", "blue_disk:disk", "left_peg:peg", "middle_peg:peg", "right_peg:peg"],
        ),
    ] {
        for dialect in ["llamacpp", "ollama", "openai"] {
            match read(&url, domain, dialect, said, objects) {
                Ok(goal) => println!("{domain} {dialect}: {} {:?}", goal.goal, goal.notes),
                // A weak model may contradict itself to the end; any other end is a fault.
                Err(GoalError::GaveUp { bound, reason, .. }) if bound.contains("attempts_max") => {
                    println!("{domain} {dialect}: {reason}");
                    // The grammar leaves no room for anything but a contradiction.
                    let is_form =
                        ["expected", "unknown", "empty"].iter().any(|w| reason.contains(w));
                    assert!(dialect != "llamacpp" || !is_form, "{reason}");
                }
                Err(error) => panic!("{domain} {dialect}: {}", error.render()),
            }
        }
    }
}
