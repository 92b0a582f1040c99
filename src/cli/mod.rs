//! The command line: one file per verb.

mod table;
mod out;
mod begin;
mod camera;
mod camera_flags;
mod config;
mod dataset;
mod doctor;
mod domain;
mod eval;
mod exemplar_capture;
mod exemplar_check;
mod exemplar;
mod goal;
mod ground;
mod hardware;
mod narrate;
mod new;
mod parts;
mod plan;
mod reports;
mod run;
mod schema;
mod serve;
mod stop;
mod services;
mod stress;
mod sweep;
mod task;
mod topics;
mod validate;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::run::RunError;

/// Process exit codes; `README.md` lists them.
pub mod exit {
    use crate::planning::Outcome;

    /// Internal error.
    pub const INTERNAL: u8 = 1;
    /// Bad usage, configuration or input file.
    pub const BAD_INPUT: u8 = 2;
    /// Proven unsolvable.
    pub const UNSOLVABLE: u8 = 3;
    /// A budget was used up.
    pub const GAVE_UP: u8 = 4;
    /// Something that is needed is not there.
    pub const MISSING: u8 = 5;
    /// A check did not hold.
    pub const CHECK_FAILED: u8 = 6;

    /// The code for how planning ended.
    pub(super) fn of(outcome: &Outcome) -> u8 {
        match outcome {
            Outcome::Solved(_) => 0,
            Outcome::Unsolvable { .. } => UNSOLVABLE,
            Outcome::OutOfBudget { .. } | Outcome::Interrupted => GAVE_UP,
            Outcome::Unsupported { .. } | Outcome::BadInput { .. } => BAD_INPUT,
        }
    }
}

/// A closed-loop task executive for robots: look, ground, plan, act, look again.
#[derive(Debug, Parser)]
#[command(name = "groundloop", version, about, long_about = None)]
struct Cli {
    /// How much is logged on standard error.
    #[arg(long, global = true, default_value = "warn", value_name = "LEVEL", display_order = 900,
          value_parser = ["error", "warn", "info", "debug", "trace"])]
    log: String,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Run closed-loop episodes.
    Run(run::Args),
    /// Take goals from the bus, and carry them out one after another.
    Serve(serve::Args),
    /// Ask a run that serves for goals.
    #[command(subcommand)]
    Task(task::Verb),
    /// Publish frames from this process to a run in another one.
    Camera(camera::Args),
    /// Show, check and describe run files.
    Config(config::Args),
    /// Play the camera and the robot of a run file for a run in another process.
    Hardware(hardware::Args),
    /// Plan once, from a PDDL problem.
    Plan(plan::Args),
    /// Check a plan against a PDDL problem.
    Validate(validate::Args),
    /// Read the symbolic state off one image, and plan from it.
    Ground(ground::Args),
    /// Show what a goal is read as.
    Goal(goal::Args),
    /// Make and check labelled examples.
    #[command(subcommand)]
    Exemplar(exemplar::Verb),
    /// Make data sets of rendered scenes.
    #[command(subcommand)]
    Dataset(dataset::Verb),
    /// Check this machine: shared memory, leftovers of killed runs, programs, services.
    Doctor(doctor::Args),
    /// Check domain folders.
    #[command(subcommand)]
    Domain(domain::Verb),
    /// Start a domain of your own.
    #[command(subcommand)]
    New(new::Verb),
    /// List detectors, planners and all other parts, with their options.
    Parts(parts::Args),
    /// Measure on data sets.
    Eval(eval::Args),
    /// Measure what replanning costs.
    Stress(stress::Args),
    /// Run many episodes over chosen factors, on one machine or a cluster.
    #[command(subcommand)]
    Sweep(sweep::Verb),
    /// See who says what in a run, and what does not arrive.
    #[command(subcommand)]
    Topics(topics::Verb),
    /// Print the JSON Schema of what a verb writes with `--json`.
    Schema(schema::Args),
}

/// Parses the arguments and carries the verb out.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    out::start_log(&cli.log);
    let done = match cli.verb {
        Verb::Run(args) => run::run(&args),
        Verb::Serve(args) => serve::run(&args),
        Verb::Task(verb) => task::run(&verb),
        Verb::Camera(args) => camera::run(&args),
        Verb::Config(args) => config::run(&args),
        Verb::Hardware(args) => hardware::run(&args),
        Verb::Plan(args) => plan::run(&args),
        Verb::Validate(args) => validate::run(&args),
        Verb::Ground(args) => ground::run(&args),
        Verb::Goal(args) => goal::run(&args),
        Verb::Exemplar(verb) => exemplar::run(&verb),
        Verb::Dataset(verb) => dataset::run(&verb),
        Verb::Doctor(args) => doctor::run(&args),
        Verb::Domain(verb) => domain::run(&verb),
        Verb::New(verb) => new::run(&verb),
        Verb::Parts(args) => parts::run(&args),
        Verb::Eval(args) => eval::run(&args),
        Verb::Stress(args) => stress::run(&args),
        Verb::Sweep(verb) => sweep::run(&verb),
        Verb::Topics(verb) => topics::run(&verb),
        Verb::Schema(args) => schema::run(&args),
    };
    match done.and_then(|code| out::lost().map_or(Ok(code), Err)) {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            out::error(&failure.message);
            ExitCode::from(failure.code)
        }
    }
}

/// A verb has failed: what to say, and the exit code.
#[derive(Debug)]
struct Failure {
    message: String,
    code: u8,
}

impl Failure {
    fn bad_input(message: impl std::fmt::Display) -> Self {
        Self { message: message.to_string(), code: exit::BAD_INPUT }
    }

    fn internal(message: impl std::fmt::Display) -> Self {
        Self { message: message.to_string(), code: exit::INTERNAL }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        let code = error.exit_code();
        let message = match error {
            RunError::Config(error) => error.render(),
            RunError::Transport(_) | RunError::Fatal(_) | RunError::Snapshot { .. } => {
                error.to_string()
            }
        };
        Self { message, code }
    }
}

impl From<crate::run::ConfigError> for Failure {
    fn from(error: crate::run::ConfigError) -> Self {
        RunError::from(error).into()
    }
}

impl From<crate::goals::GoalError> for Failure {
    fn from(error: crate::goals::GoalError) -> Self {
        RunError::from(crate::actors::Fatal::from(error)).into()
    }
}

impl From<crate::pddl::PddlError> for Failure {
    fn from(error: crate::pddl::PddlError) -> Self {
        Self::bad_input(error.render())
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    /// Everything that is not in the style of help texts, of a command and those below it.
    fn faults(command: &clap::Command, path: &str, found: &mut Vec<String>) {
        let mut check = |what: String, text: Option<&clap::builder::StyledStr>| {
            let text = text.map(ToString::to_string).unwrap_or_default();
            if !text.starts_with(|c: char| c.is_uppercase()) || text.ends_with('.') {
                found.push(format!("{what}: expected a sentence without its full stop: {text}"));
            }
            text
        };
        let mut more = Vec::new();
        // The program's own line is a sentence of its own.
        if path.contains(' ') {
            let about = check(path.to_owned(), command.get_about());
            if about.split_whitespace().next().is_some_and(|verb| verb.ends_with('s')) {
                more.push(format!("{path}: expected \"Show …\", not \"Shows …\": {about}"));
            }
        }
        for arg in command.get_arguments() {
            let what = format!("{path} {}", arg.get_id());
            check(what.clone(), arg.get_help());
            for name in arg.get_value_names().into_iter().flatten().filter(|n| n.contains('_')) {
                more.push(format!("{what}: expected a short name of its value, got {name}"));
            }
        }
        found.extend(more);
        for inner in command.get_subcommands() {
            faults(inner, &format!("{path} {}", inner.get_name()), found);
        }
    }

    #[test]
    fn help_texts_are_of_one_style() {
        let mut found = Vec::new();
        faults(&Cli::command(), "groundloop", &mut found);
        assert!(found.is_empty(), "\n{}", found.join("\n"));
        let bad = clap::Arg::new("a").value_name("A_B").help("it.");
        faults(&clap::Command::new("x").about("Does it").arg(bad), "groundloop x", &mut found);
        assert_eq!(found.len(), 3, "{found:?}");
    }
}
