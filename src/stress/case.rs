//! The problems that a case stands for.

use std::path::Path;
use std::sync::Arc;

use super::{CaseConfig, StressConfig, StressError, Template};
use crate::pddl::{Problem, parse_problem};
use crate::run::{ConfigError, DomainFolder, in_data, read_pddl};

/// One problem of a case.
#[derive(Debug, Clone)]
pub struct Instance {
    /// The case's name.
    pub case: String,
    /// Its place in the file.
    pub case_idx: usize,
    /// The size that was asked for; of a problem file, the number of its objects.
    pub size: u32,
    /// The problem file's name without folder and ending; nothing for a sweep.
    pub problem_name: Option<String>,
    /// The domain.
    pub folder: Arc<DomainFolder>,
    /// Objects, goal and the first state.
    pub problem: Problem,
}

impl Instance {
    /// Its name in reports: case and size, or case and problem.
    pub fn name(&self) -> String {
        match &self.problem_name {
            Some(problem) => format!("{} {problem}", self.case),
            None => format!("{} {}", self.case, self.size),
        }
    }
}

/// Reads or makes every problem of a stress test, in the order of the file.
///
/// # Errors
/// [`StressError::Config`] naming the file.
pub fn instances(config: &StressConfig, data: Option<&Path>) -> Result<Vec<Instance>, StressError> {
    let mut found = Vec::new();
    for (case_idx, case) in config.case.iter().enumerate() {
        let folder = Arc::new(DomainFolder::find(&case.domain, &config.origin.folder)?);
        let new = |size: u32, problem_name: Option<String>, problem: Problem| Instance {
            case: case.name.clone(),
            case_idx,
            size,
            problem_name,
            folder: Arc::clone(&folder),
            problem,
        };
        for &size in &case.sizes {
            found.push(new(size, None, of_size(&folder, size)?));
        }
        for text in &case.problems {
            let path = in_data("case.problems", text, data)?;
            let source = read_pddl(&path)?;
            let problem = parse_problem(&source, &folder.domain)?.value;
            let size = u32::try_from(problem.objects.len()).unwrap_or(u32::MAX);
            let name = path.file_stem().map(|name| name.to_string_lossy().into_owned());
            found.push(new(size, name, problem));
        }
    }
    Ok(found)
}

/// The problem that the folder's template makes of a size.
fn of_size(folder: &DomainFolder, size: u32) -> Result<Problem, ConfigError> {
    let file = folder.files.file("stress.toml");
    let name = file.to_string();
    Template::parse(&name, &file.text()?)?.problem(&name, &folder.domain, size)
}

/// The case that an instance belongs to.
pub(super) fn case_of<'a>(config: &'a StressConfig, instance: &Instance) -> &'a CaseConfig {
    &config.case[instance.case_idx]
}
