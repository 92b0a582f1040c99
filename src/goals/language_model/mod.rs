//! Goals of kind `language_model`: a server of the OpenAI kind reads the instruction.
//!
//! The model is told the domain, the objects and one worked example; where the server can, a grammar
//! or a schema holds it to the form. Every answer is checked here as if there were no such thing, and
//! what is wrong with it is told to the model, a bounded number of times. Valid is not right: a valid
//! goal may still be another one than was meant.

mod config;
mod gbnf;
mod candidate_objects;
mod candidates;
mod quantifiers;
mod prompt;
mod validate;

use serde_json::Value;

use self::config::{ExampleOption, Options};
use self::prompt::Example;
use self::validate::{Judged, Rules};
use super::language::misfit;
use super::{
    GoalError, GoalObject, GoalSource, GoalView, Language, ParsedGoal, Phrase, Referent,
    instruction, logical,
};
use crate::http::chat::{ChatRequest, ChatResponse, ChatTurn, response_of};
use crate::http::{Client, Header, Request, WebError, shown_url};
use crate::messages::named_objects;
use crate::mismatch::Mismatch;
use crate::parts::{Part, PartContext, PartError, options_of};
use crate::pddl::{Condition, Domain, Name, SourceText, Typed};

/// Most characters of an answer that are repeated to the model.
const ANSWER_CHARS_MAX: usize = 2000;

/// Most bytes of an instruction.
const INSTRUCTION_BYTES_MAX: usize = instruction::INSTRUCTION_BYTES_MAX;

/// The goal source of kind `language_model`.
#[derive(Debug)]
struct LanguageModel {
    origin: String,
    instruction: String,
    language: Option<Language>,
    completed: Vec<Name>,
    options: Options,
    url: String,
    key: Option<Header>,
    client: Client,
}

/// Why there is no answer.
#[derive(Debug)]
enum Unanswered {
    Web(WebError),
    Goal(GoalError),
}

impl From<WebError> for Unanswered {
    fn from(error: WebError) -> Self {
        Self::Web(error)
    }
}

/// The entry of the table of goal sources.
pub(super) const PART: Part<dyn GoalSource> = Part {
    name: "language_model",
    help: "a sentence, read by a language model behind an OpenAI-compatible server",
    options: options_of::<Options>(),
    build,
};

fn build(context: &PartContext<'_, dyn GoalSource>) -> Result<Box<dyn GoalSource>, PartError> {
    let options: Options = context.options()?;
    let inputs = &context.inputs;
    if inputs.text.trim().is_empty() || inputs.text.len() > INSTRUCTION_BYTES_MAX {
        let expected = format!("an instruction of 1 to {INSTRUCTION_BYTES_MAX} bytes");
        let mismatch = Mismatch::new(inputs.origin, expected, inputs.text.len());
        return Err(PartError::Inputs { reason: mismatch.to_string() });
    }
    let answers = context.choice.answers.clone();
    let key = match &options.key_env {
        None => None,
        Some(variable) => {
            let key = (context.environment)(variable).filter(|key| !key.trim().is_empty());
            if key.is_none() && answers.is_none() {
                return Err(no_key(variable).into());
            }
            key.map(|key| Header::secret("Authorization", &format!("Bearer {}", key.trim())))
        }
    };
    let client = Client::new(&options.retry)
        .map(|client| client.with_answers(answers))
        .map_err(|e| PartError::Inputs { reason: format!("goal.options: {e}") })?;
    let base = options.url.trim_end_matches('/');
    let is_whole = base.ends_with("/chat/completions");
    let url = if is_whole { base.to_owned() } else { format!("{base}/chat/completions") };
    Ok(Box::new(LanguageModel {
        origin: inputs.origin.to_owned(),
        instruction: inputs.text.to_owned(),
        language: inputs.language.cloned(),
        completed: inputs.perception.map(|p| p.completed.clone()).unwrap_or_default(),
        options,
        url,
        key,
        client,
    }))
}

fn no_key(variable: &str) -> GoalError {
    let reason = "is empty or not set: put the key of goal.options.url there".to_owned();
    GoalError::Key { variable: variable.to_owned(), reason }
}

impl GoalSource for LanguageModel {
    fn is_quick(&self) -> bool {
        false
    }

    fn read_in(&self, domain: &Domain, view: GoalView<'_>) -> Result<ParsedGoal, GoalError> {
        let objects = view.objects;
        if let Some(language) = &self.language {
            language.check(domain).map_err(|mismatch| misfit(mismatch.to_string()))?;
            positions_can_be_told(language, domain, objects, &self.instruction)?;
        }
        let seen = from_left_to_right(objects);
        let unseen =
            candidate_objects::unseen(&self.instruction, domain, self.language.as_ref(), objects);
        let all: Vec<Typed> =
            seen.iter().chain(&domain.constants).chain(&unseen).cloned().collect();
        let Some(grammar) = gbnf::grammar(domain, &all) else {
            let reason = "no object is seen that a goal could speak of".to_owned();
            return Err(GoalError::NotYet { reason });
        };
        let example = self.example(domain, objects)?;
        let form = self.options.dialect.form();
        let turns = prompt::turns(domain, form, example.as_ref(), &all, &self.instruction);
        let rules = Rules {
            domain,
            language: self.language.as_ref(),
            completed: &self.completed,
            objects: &all,
            unseen: &unseen,
        };
        let (goal, mut notes) = self.converse(turns, &grammar, &rules)?;
        if example.is_none() {
            notes.push("the model had no worked example (goal.options.example)".to_owned());
        }
        let named = named_objects(&goal);
        let expected = unseen.into_iter().filter(|typed| named.contains(&typed.name)).collect();
        let phrases = phrases(&self.instruction, &named);
        Ok(ParsedGoal { goal, phrases, expected, notes, said: Vec::new() })
    }
}

impl LanguageModel {
    /// Asks until an answer is valid or `attempts_max` is met.
    fn converse(
        &self,
        mut turns: Vec<ChatTurn>,
        grammar: &str,
        rules: &Rules<'_>,
    ) -> Result<(Condition, Vec<String>), GoalError> {
        let Options { model, dialect, temperature, attempts_max, tokens_max, .. } = &self.options;
        let mut repaired = None;
        let mut wrong = String::new();
        for attempt in 1..=*attempts_max {
            let question = ChatRequest {
                model,
                turns: &turns,
                grammar,
                key: "goal",
                temperature: *temperature,
                tokens_max: *tokens_max,
            };
            let answer = self.ask(&dialect.body(&question))?;
            wrong = match validate::judged(&answer, dialect.form(), rules) {
                Ok(Judged::Good(goal)) => {
                    return Ok((goal, vec![format!("read by {model}, answer {attempt}")]));
                }
                Ok(Judged::Repairable { goal, dropped, wrong }) => {
                    repaired = Some((goal, dropped));
                    wrong
                }
                Err(wrong) => wrong,
            };
            tracing::info!(attempt, answer = answer.text, wrong, "the model's goal is not valid");
            let said = answer.text.chars().take(ANSWER_CHARS_MAX).collect();
            turns.push(ChatTurn { role: "assistant", content: said });
            turns.push(prompt::correction(&wrong));
        }
        let Some((goal, dropped)) = repaired else {
            return Err(GoalError::GaveUp {
                what: format!("{model} at {}", shown_url(&self.url)),
                bound: format!("goal.options.attempts_max = {attempts_max}"),
                reason: format!("its last goal is not valid: {wrong}"),
            });
        };
        let mut notes = vec![format!("read by {model}, which contradicted itself to the end")];
        notes.extend(dropped.iter().map(|dropped| format!("dropped: {dropped}")));
        Ok((goal, notes))
    }

    /// One answer: recorded, or from the server.
    fn ask(&self, body: &Value) -> Result<ChatResponse, GoalError> {
        let mut request = Request::post(&self.url, body.clone());
        if let Some(key) = &self.key {
            request = request.with(key.clone());
        }
        let answer = self.client.answer(&request, || self.send(&request));
        let answer = answer.map_err(|error| match error {
            Unanswered::Web(error) => self.fault(&error),
            Unanswered::Goal(error) => error,
        })?;
        self.said(&answer)
    }

    fn send(&self, request: &Request) -> Result<Value, Unanswered> {
        if let (None, Some(variable)) = (&self.key, &self.options.key_env) {
            return Err(Unanswered::Goal(no_key(variable)));
        }
        let reply = self.client.send(request)?;
        if let Some(usage) = reply.body.get("usage") {
            tracing::info!(%usage, "the model's tokens");
        }
        self.said(&reply.body).map_err(Unanswered::Goal)?;
        Ok(reply.body)
    }

    /// What a reply says.
    fn said(&self, reply: &Value) -> Result<ChatResponse, GoalError> {
        response_of(reply).ok_or_else(|| {
            self.refused("expected choices[0].message.content in the reply, got none".to_owned())
        })
    }

    fn fault(&self, error: &WebError) -> GoalError {
        match (error, &self.options.key_env) {
            (WebError::NotRecorded { .. }, _) => {
                let what = format!("the answer of {}", self.options.model);
                PartError::missing(what, error.to_string()).into()
            }
            (WebError::NoConnection { .. }, _) => {
                let what = format!("the language model at {}", shown_url(&self.url));
                let how = format!("start its server or set goal.options.url ({error})");
                PartError::missing(what, how).into()
            }
            (error, Some(variable)) if error.is_unauthorised() => GoalError::Key {
                variable: variable.clone(),
                reason: format!("holds a key that is refused: {error}"),
            },
            (error, None) if error.is_unauthorised() => self.refused(format!(
                "{error}; name the environment variable that holds it as goal.options.key_env"
            )),
            (error, _) if error.is_absent() => GoalError::GaveUp {
                what: format!("{} at {}", self.options.model, shown_url(&self.url)),
                bound: "goal.options.retry".to_owned(),
                reason: error.to_string(),
            },
            (error, _) => self.refused(error.to_string()),
        }
    }

    fn refused(&self, message: String) -> GoalError {
        PartError::Options { file: self.origin.clone(), message }.into()
    }

    /// The worked example: the configured one, else the first of `language.toml` that the offline
    /// parser can read, before anything is seen if possible, so that all scenes share it.
    fn example(
        &self,
        domain: &Domain,
        objects: &[GoalObject],
    ) -> Result<Option<Example>, GoalError> {
        if let Some(option) = &self.options.example {
            return self.configured(option, domain).map(Some);
        }
        let Some(language) = &self.language else { return Ok(None) };
        let read = |objects: &[GoalObject]| {
            language.examples.iter().find_map(|instruction| {
                let parsed = instruction::parse(instruction, domain, language, objects).ok()?;
                let seen = from_left_to_right(objects);
                Some(Example {
                    instruction: instruction.clone(),
                    objects: seen.into_iter().chain(parsed.expected).collect(),
                    goal: parsed.goal,
                })
            })
        };
        Ok(read(&[]).filter(|example| !example.objects.is_empty()).or_else(|| read(objects)))
    }

    fn configured(&self, option: &ExampleOption, domain: &Domain) -> Result<Example, GoalError> {
        let mut objects = Vec::new();
        for text in &option.objects {
            let (name, type_name) = text.split_once(':').ok_or_else(|| {
                let key = "goal.options.example.objects";
                self.refused(format!("{key}: expected \"name:type\", got \"{text}\""))
            })?;
            let (name, type_name) = (name.trim().into(), type_name.trim().into());
            objects.push(GoalObject { name, type_name, colour: None, pixel_box: None });
        }
        let source = SourceText::new("goal.options.example.goal", option.goal.clone());
        let parsed = logical::parse(&source, domain, &objects)?;
        let listed = objects.into_iter().map(|o| Typed::new(o.name, o.type_name));
        let objects = listed.chain(parsed.expected).collect();
        Ok(Example { instruction: option.instruction.clone(), objects, goal: parsed.goal })
    }
}

/// Objects in order from left to right, those without a box last; equal places by name.
fn from_left_to_right(objects: &[GoalObject]) -> Vec<Typed> {
    let mut sorted: Vec<(f64, &GoalObject)> = objects
        .iter()
        .map(|object| {
            (object.pixel_box.map_or(f64::INFINITY, |pixel_box| pixel_box.centre().0), object)
        })
        .collect();
    sorted.sort_by(|(a, first), (b, second)| a.total_cmp(b).then(first.name.cmp(&second.name)));
    sorted.into_iter().map(|(_, o)| Typed::new(o.name.clone(), o.type_name.clone())).collect()
}

/// Some nouns' positions are told over several objects only ("the rightmost peg" of three).
fn positions_can_be_told(
    language: &Language,
    domain: &Domain,
    objects: &[GoalObject],
    instruction: &str,
) -> Result<(), GoalError> {
    for noun in &language.nouns {
        let of_type = |o: &&GoalObject| domain.types.is_a(&o.type_name, &noun.type_name);
        let seen = objects.iter().filter(of_type).count();
        let said = instruction.to_lowercase();
        let is_said = noun.one.iter().chain(&noun.many).any(|word| said.contains(word.as_str()));
        if is_said && seen < noun.seen_min && noun.name.is_none() {
            let (type_name, wanted) = (&noun.type_name, noun.seen_min);
            let reason = format!("{seen} of {wanted} {type_name} objects seen");
            return Err(GoalError::NotYet { reason });
        }
    }
    Ok(())
}

/// Where the instruction says the names of the goal's objects.
fn phrases(instruction: &str, named: &std::collections::BTreeSet<Name>) -> Vec<Phrase> {
    let said = instruction.to_ascii_lowercase();
    let found = named.iter().filter_map(|name| {
        let words = name.as_str().replace('_', " ");
        let start = said.find(&words)?;
        let span = start..start + words.len();
        let text = instruction.get(span.clone())?.to_owned();
        Some(Phrase { text, span, means: Referent::Object(name.clone()) })
    });
    let mut found: Vec<Phrase> = found.collect();
    found.sort_by_key(|phrase| phrase.span.start);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::goals::{GOALS, GoalInputs};
    use crate::parts::PartChoice;

    fn options(text: &str) -> Result<Box<dyn GoalSource>, PartError> {
        let table: toml::Table = text.parse().unwrap();
        let choice = PartChoice::new("goal.kind", PART.name).with_options(Some(&table), "run.toml");
        let inputs = GoalInputs::words("run.toml: goal.text", "red over blue", None);
        let environment = |name: &str| (name == "SET").then(|| "sesame".to_owned());
        GOALS.build(&PartContext { choice: &choice, inputs, environment })
    }

    const GOOD: &str = "url = 'http://127.0.0.1:9/v1'\nmodel = 'm'\ndialect = 'llamacpp'\n";

    #[test]
    fn options_are_checked_before_anything_starts() {
        for (more, wanted) in [
            ("", ""),
            ("key_env = 'SET'", ""),
            ("cache = 'answers'", "services.answers"),
            ("key_env = 'UNSET'", "the environment variable UNSET is empty or not set"),
            (
                "attempt_max = 2",
                "goal.options.attempt_max: unknown key; did you mean attempts_max?",
            ),
            (
                "attempts_max = 0",
                "goal.options.attempts_max: expected an integer, 1 or more, got 0",
            ),
            ("retry = { read = 1 }", "goal.options.retry.read: unknown key; did you mean read_ms?"),
        ] {
            match options(&format!("{GOOD}{more}")) {
                Ok(source) => {
                    assert_eq!(wanted, "", "{more}");
                    assert!(!format!("{source:?}").contains("sesame"));
                }
                Err(error) => {
                    let said = error.to_string();
                    assert!(!wanted.is_empty() && said.contains(wanted), "{more}: {said}");
                }
            }
        }
        let error = options("model = 'm'\nurl = ''\ndialect = 'gpt'").unwrap_err();
        let wanted =
            "goal.options.dialect: expected \"llamacpp\" or \"ollama\" or \"openai\" or \"vllm\"";
        assert!(error.to_string().contains(wanted), "{error}");
    }
}
