//! ProDG-v, the data set of the paper: the evaluation that it defines, on any checkout of it.
//!
//! Each ordered pair of problems is one episode. The first problem is the labelled example; of the
//! second only the photograph's detections and the instruction's goal are used until the plan is
//! there, which is then renamed and tried on the true problem. Everything but reading files is pure.
//!
//! The counts follow the reference implementation to the digit: which pairs count and
//! which detection is which object ([`matching`]), and what counts as right ([`score`]).

mod forms;
mod error;
pub mod data_set;
mod recorded;
pub mod matching;
mod fitted_domain;
pub mod score;
pub mod goal;
mod pair;
mod stage;
mod carry_out;
pub mod jitter;
pub(in crate::eval) mod evaluate;
mod report;
mod published;
mod pictures;

pub use carry_out::carry_out;
pub use data_set::{DomainData, Labelled};
pub use error::EvalError;
pub use evaluate::{BoxSource, Evaluation, Goals, Setup, evaluate};
pub use fitted_domain::FittedDomain;
pub use jitter::Jitter;
pub use pair::{Failure, PairInput, PairParts, PairResult, Stage};
pub use pictures::picture;
pub use published::{Published, published};
pub use recorded::Pair;
pub use report::{DomainReport, EvaluationReport, JitterReport, PairReport, Ratio, domain_report};
