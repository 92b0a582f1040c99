//! Chat completions: what servers of the OpenAI kind have in common, and how each one is held to a
//! form.

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

/// What a server understands beside the common part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ChatDialect {
    /// llama.cpp's server: `grammar` holds GBNF.
    LlamaCpp,
    /// Ollama's `/v1`: `response_format` with a JSON schema.
    Ollama,
    /// OpenAI and servers like it: `response_format` with a JSON schema.
    OpenAi,
    /// vLLM: `structured_outputs` with a grammar.
    Vllm,
}

/// How a response is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChatForm {
    /// As the grammar has it, and nothing else.
    Grammar,
    /// `{"key": "…"}`: a schema for all of a language's forms would be understood by no two servers
    /// alike, so it is one string, and who asked checks what it says.
    Json,
}

/// One turn of the conversation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChatTurn {
    /// `system`, `user` or `assistant`.
    pub role: &'static str,
    /// Plain text.
    pub content: String,
}

/// One request for one completion.
#[derive(Debug, Clone, Copy)]
pub struct ChatRequest<'a> {
    /// The model's name on the server.
    pub model: &'a str,
    /// The conversation so far, oldest first.
    pub turns: &'a [ChatTurn],
    /// The response's form in GBNF, for servers that take a grammar.
    pub grammar: &'a str,
    /// The one key of the response, for servers that take a JSON schema.
    pub key: &'a str,
    /// 0 repeats itself; above, words are drawn more freely.
    pub temperature: f64,
    /// Where the server stops.
    pub tokens_max: u32,
}

impl ChatDialect {
    /// How its responses are written.
    pub fn form(self) -> ChatForm {
        match self {
            Self::LlamaCpp | Self::Vllm => ChatForm::Grammar,
            Self::Ollama | Self::OpenAi => ChatForm::Json,
        }
    }

    /// The body of the HTTP request.
    pub fn body(self, request: &ChatRequest<'_>) -> Value {
        let turns = request.turns.iter();
        let messages: Vec<Value> =
            turns.map(|turn| json!({"role": turn.role, "content": turn.content})).collect();
        let mut body = json!({
            "model": request.model,
            "messages": messages,
            "temperature": request.temperature,
            "stream": false,
        });
        // The older name is not understood by OpenAI's newer models, the newer one not by the rest.
        let tokens = if self == Self::OpenAi { "max_completion_tokens" } else { "max_tokens" };
        body[tokens] = json!(request.tokens_max);
        match self {
            Self::LlamaCpp => body["grammar"] = json!(request.grammar),
            Self::Vllm => body["structured_outputs"] = json!({"grammar": request.grammar}),
            Self::Ollama | Self::OpenAi => body["response_format"] = json_form(request.key),
        }
        body
    }
}

fn json_form(key: &str) -> Value {
    json!({
        "type": "json_schema",
        "json_schema": {
            "name": key,
            "strict": true,
            "schema": {
                "type": "object",
                "properties": {key: {"type": "string"}},
                "required": [key],
                "additionalProperties": false,
            },
        },
    })
}

/// What the model said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChatResponse {
    /// The text; empty where the server sent none.
    pub text: String,
    /// Whether the server stopped it at the most tokens there may be.
    pub is_cut: bool,
}

/// The response in the body of an HTTP reply; `None` when there is no place for one.
pub fn response_of(reply: &Value) -> Option<ChatResponse> {
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
    Some(ChatResponse { text, is_cut })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(dialect: ChatDialect) -> Value {
        let turns = [ChatTurn { role: "user", content: "hello".to_owned() }];
        dialect.body(&ChatRequest {
            model: "m",
            turns: &turns,
            grammar: "root ::= \"x\"",
            key: "goal",
            temperature: 0.0,
            tokens_max: 7,
        })
    }

    #[test]
    fn each_dialect_has_its_own_way_to_ask_for_a_form() {
        let own = |dialect: ChatDialect| {
            let body = body(dialect);
            assert_eq!(body["messages"], json!([{"role": "user", "content": "hello"}]));
            let common = ["model", "messages", "temperature", "stream"];
            let keys = body.as_object().unwrap().keys().filter(|k| !common.contains(&k.as_str()));
            keys.cloned().collect::<Vec<_>>()
        };
        assert_eq!(own(ChatDialect::LlamaCpp), ["max_tokens", "grammar"]);
        assert_eq!(own(ChatDialect::Vllm), ["max_tokens", "structured_outputs"]);
        assert_eq!(own(ChatDialect::Ollama), ["max_tokens", "response_format"]);
        assert_eq!(own(ChatDialect::OpenAi), ["max_completion_tokens", "response_format"]);
        assert_eq!(body(ChatDialect::Vllm)["structured_outputs"]["grammar"], "root ::= \"x\"");
    }

    #[test]
    fn answers_are_found_and_null_is_an_empty_one() {
        let text = |content: Value| {
            let reply =
                json!({"choices": [{"message": {"role": "assistant", "content": content}}]});
            response_of(&reply).map(|answer| answer.text)
        };
        assert_eq!(text(json!("(a)")).as_deref(), Some("(a)"));
        assert_eq!(text(json!(null)).as_deref(), Some(""));
        assert_eq!(text(json!([{"type": "text", "text": "(a)"}])).as_deref(), Some("(a)"));
        assert_eq!(response_of(&json!({"choices": []})), None);
        assert_eq!(response_of(&json!([1])), None);
        let cut = json!({"choices": [{"message": {"content": "("}, "finish_reason": "length"}]});
        assert!(response_of(&cut).unwrap().is_cut);
    }
}
