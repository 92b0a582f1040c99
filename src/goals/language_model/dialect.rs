//! What servers of the OpenAI kind have in common, and how each one is held to a form.

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

/// The name of the form that is asked for.
const FORM_NAME: &str = "goal";

/// What a server understands beside the common part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum Dialect {
    /// llama.cpp's server: `grammar` holds GBNF.
    LlamaCpp,
    /// Ollama's `/v1`: `response_format` with a JSON schema.
    Ollama,
    /// OpenAI and servers like it: `response_format` with a JSON schema.
    OpenAi,
    /// vLLM: `structured_outputs` with a grammar.
    Vllm,
}

/// How an answer is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// The goal and nothing else.
    Pddl,
    /// `{"goal": "…"}`: a schema for all of PDDL's forms would be understood by no two servers
    /// alike, so the goal is one string, and what it says is checked here.
    Json,
}

/// One turn of the conversation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Turn {
    /// `system`, `user` or `assistant`.
    pub(super) role: &'static str,
    /// What is said.
    pub(super) content: String,
}

/// What is asked of a model.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question<'a> {
    pub(super) model: &'a str,
    pub(super) turns: &'a [Turn],
    /// The form of a goal in GBNF.
    pub(super) grammar: &'a str,
    pub(super) temperature: f64,
    pub(super) tokens_max: u32,
}

impl Dialect {
    /// How its answers are written.
    pub(super) fn form(self) -> Form {
        match self {
            Self::LlamaCpp | Self::Vllm => Form::Pddl,
            Self::Ollama | Self::OpenAi => Form::Json,
        }
    }

    /// The body of a request for one answer.
    pub(super) fn body(self, question: &Question<'_>) -> Value {
        let turns = question.turns.iter();
        let messages: Vec<Value> =
            turns.map(|turn| json!({"role": turn.role, "content": turn.content})).collect();
        let mut body = json!({
            "model": question.model,
            "messages": messages,
            "temperature": question.temperature,
            "stream": false,
        });
        // The older name is not understood by OpenAI's newer models, the newer one not by the rest.
        let tokens = if self == Self::OpenAi { "max_completion_tokens" } else { "max_tokens" };
        body[tokens] = json!(question.tokens_max);
        match self {
            Self::LlamaCpp => body["grammar"] = json!(question.grammar),
            Self::Vllm => body["structured_outputs"] = json!({"grammar": question.grammar}),
            Self::Ollama | Self::OpenAi => body["response_format"] = json_form(),
        }
        body
    }
}

fn json_form() -> Value {
    json!({
        "type": "json_schema",
        "json_schema": {
            "name": FORM_NAME,
            "strict": true,
            "schema": {
                "type": "object",
                "properties": {"goal": {"type": "string"}},
                "required": ["goal"],
                "additionalProperties": false,
            },
        },
    })
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Answer {
    /// The text; empty where the server sent none.
    pub(super) text: String,
    /// Whether the server stopped it at the most tokens there may be.
    pub(super) is_cut: bool,
}

/// The answer in a reply; `None` when there is no place for one.
pub(super) fn answer_of(reply: &Value) -> Option<Answer> {
    let choice = reply.pointer("/choices/0")?;
    let content = choice.pointer("/message/content")?;
    let text = match content {
        Value::String(text) => text.clone(),
        // The content in parts.
        Value::Array(parts) => {
            parts.iter().filter_map(|part| part.get("text").and_then(Value::as_str)).collect()
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::Object(_) => String::new(),
    };
    let is_cut = choice.get("finish_reason").and_then(Value::as_str) == Some("length");
    Some(Answer { text, is_cut })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(dialect: Dialect) -> Value {
        let turns = [Turn { role: "user", content: "hello".to_owned() }];
        dialect.body(&Question {
            model: "m",
            turns: &turns,
            grammar: "root ::= \"x\"",
            temperature: 0.0,
            tokens_max: 7,
        })
    }

    #[test]
    fn each_dialect_has_its_own_way_to_ask_for_a_form() {
        let own = |dialect: Dialect| {
            let body = body(dialect);
            assert_eq!(body["messages"], json!([{"role": "user", "content": "hello"}]));
            let common = ["model", "messages", "temperature", "stream"];
            let keys = body.as_object().unwrap().keys().filter(|k| !common.contains(&k.as_str()));
            keys.cloned().collect::<Vec<_>>()
        };
        assert_eq!(own(Dialect::LlamaCpp), ["max_tokens", "grammar"]);
        assert_eq!(own(Dialect::Vllm), ["max_tokens", "structured_outputs"]);
        assert_eq!(own(Dialect::Ollama), ["max_tokens", "response_format"]);
        assert_eq!(own(Dialect::OpenAi), ["max_completion_tokens", "response_format"]);
        assert_eq!(body(Dialect::Vllm)["structured_outputs"]["grammar"], "root ::= \"x\"");
    }

    #[test]
    fn answers_are_found_and_null_is_an_empty_one() {
        let text = |content: Value| {
            let reply =
                json!({"choices": [{"message": {"role": "assistant", "content": content}}]});
            answer_of(&reply).map(|answer| answer.text)
        };
        assert_eq!(text(json!("(a)")).as_deref(), Some("(a)"));
        assert_eq!(text(json!(null)).as_deref(), Some(""));
        assert_eq!(text(json!([{"type": "text", "text": "(a)"}])).as_deref(), Some("(a)"));
        assert_eq!(answer_of(&json!({"choices": []})), None);
        assert_eq!(answer_of(&json!([1])), None);
        let cut = json!({"choices": [{"message": {"content": "("}, "finish_reason": "length"}]});
        assert!(answer_of(&cut).unwrap().is_cut);
    }
}
