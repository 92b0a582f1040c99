//! What the model is told: the domain, one worked example, the objects, the instruction.
//!
//! What stays the same stands first, so that a server can keep what it has read of it.

use super::gbnf::in_layout;
use crate::http::chat::{ChatForm, ChatTurn};
use crate::pddl::{Condition, Domain, Name, Typed};

/// A worked example.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Example {
    pub(super) instruction: String,
    pub(super) objects: Vec<Typed>,
    pub(super) goal: Condition,
}

/// The conversation up to the instruction.
pub(super) fn turns(
    domain: &Domain,
    form: ChatForm,
    example: Option<&Example>,
    objects: &[Typed],
    instruction: &str,
) -> Vec<ChatTurn> {
    let mut turns = vec![ChatTurn { role: "system", content: rules(domain, form) }];
    if let Some(example) = example {
        let content = task(&example.objects, &example.instruction);
        turns.push(ChatTurn { role: "user", content });
        turns.push(ChatTurn { role: "assistant", content: answer(&example.goal, form) });
    }
    turns.push(ChatTurn { role: "user", content: task(objects, instruction) });
    turns
}

/// What is said after an answer that is not valid.
pub(super) fn correction(wrong: &str) -> ChatTurn {
    let content = format!("This is no valid goal:\n{wrong}\nWrite the corrected goal only.");
    ChatTurn { role: "user", content }
}

/// A goal as the model should write it.
fn answer(goal: &Condition, form: ChatForm) -> String {
    let text = in_layout(goal);
    match form {
        ChatForm::Grammar => text,
        ChatForm::Json => serde_json::json!({ "goal": text }).to_string(),
    }
}

fn rules(domain: &Domain, form: ChatForm) -> String {
    let name = &domain.name;
    let mut lines = vec![
        format!("You translate an instruction for a robot into a PDDL goal of the domain {name}."),
        "Types:".to_owned(),
    ];
    let types = domain.types.parents.iter();
    lines.extend(types.map(|(name, parents)| format!("{name} - {}", either(parents))));
    lines.push("Predicates:".to_owned());
    lines.extend(domain.predicates.iter().map(|predicate| {
        let params = predicate.params.iter();
        let params = params.map(|p| format!(" ?{} - {}", p.name, either(&p.types)));
        format!("({}{})", predicate.name, params.collect::<String>())
    }));
    lines.extend(
        [
            "Write only the goal, on one line: (and …) around what must hold in the end.",
            "(forall (?x - type) (predicate ?x …)) speaks of every object of a type.",
            "Use only these predicates and the objects listed, which stand in order from left to right.",
            "Ask for what the instruction says and for nothing else.",
        ]
        .map(str::to_owned),
    );
    if form == ChatForm::Json {
        lines.push("Answer with JSON: {\"goal\": \"(and …)\"}.".to_owned());
    }
    lines.join("\n")
}

/// The alternatives of a type.
fn either(types: &[Name]) -> String {
    if types.is_empty() {
        return "object".to_owned();
    }
    types.iter().map(Name::as_str).collect::<Vec<_>>().join("/")
}

fn task(objects: &[Typed], instruction: &str) -> String {
    let objects = objects.iter().map(|o| format!("{} - {}", o.name, either(&o.types)));
    let objects: Vec<String> = objects.collect();
    format!("Objects: {}\nInstruction: {}\nGoal:", objects.join(", "), instruction.trim())
}
