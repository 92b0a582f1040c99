//! The files of a domain folder, each read by itself: what is wrong in one hides nothing of the others.

use super::{DomainFinding, DomainFindingKind};
use crate::files::{FileRef, Folder};
use crate::goals::Language;
use crate::pddl::{Axiom, Domain, PddlError, SourceText, parse_domain, parse_problem, parse_rules};
use crate::perception::model::{Perception, PerceptionError};
use crate::settings::{SettingsProblem, TomlFile};
use crate::skills::{SkillMap, SkillMapError};

/// What could be read.
pub(super) struct FolderFiles<'a> {
    pub(super) folder: &'a Folder,
    pub(super) domain: Domain,
    pub(super) rules: Vec<Axiom>,
    pub(super) perception: Option<Perception>,
    pub(super) language: Option<Language>,
    /// Whether it has scenes.
    pub(super) is_simulated: bool,
}

/// Key under which the skills are told that an action has none; those are told one by one here.
const MISSING_ACTION: &str = "action";

impl<'a> FolderFiles<'a> {
    /// Reads what there is; `None` without a domain, without which nothing else can be checked.
    pub(super) fn read(folder: &'a Folder, findings: &mut Vec<DomainFinding>) -> Option<Self> {
        let mut reader = Reader { folder, findings };
        let domain = reader.domain()?;
        let (rules, perception) = (reader.rules(&domain), reader.perception(&domain));
        let language = reader.language(&domain);
        let is_simulated = folder.folder_names().iter().any(|name| name == "scenes");
        reader.skills(&domain, is_simulated);
        reader.problems(&domain);
        Some(Self { folder, domain, rules, perception, language, is_simulated })
    }

    /// A finding in a file of the folder.
    pub(super) fn finding(
        &self,
        kind: DomainFindingKind,
        (file, field): (&str, impl Into<String>),
        message: impl Into<String>,
    ) -> DomainFinding {
        let file = self.folder.file(file).to_string();
        DomainFinding { kind, file, field: field.into(), message: message.into() }
    }
}

struct Reader<'a, 'f> {
    folder: &'a Folder,
    findings: &'f mut Vec<DomainFinding>,
}

impl Reader<'_, '_> {
    fn tell(&mut self, file: impl Into<String>, message: &str) {
        self.findings.push(DomainFinding::unreadable(file, "", message));
    }

    fn tell_problems(&mut self, file: &FileRef, problems: &[SettingsProblem]) {
        let findings = problems.iter().map(|problem| DomainFinding::of_problem(problem, file));
        self.findings.extend(findings);
    }

    fn tell_pddl(&mut self, error: &PddlError) {
        let text = error.to_string();
        let (place, message) = text.split_once(": error: ").unwrap_or((text.as_str(), ""));
        self.tell(place, message);
    }

    /// A file's text; `None` where it is not there, or cannot be read.
    fn text(&mut self, file: &FileRef) -> Option<SourceText> {
        if !file.exists() {
            return None;
        }
        match file.text() {
            Ok(text) => Some(SourceText { name: file.to_string(), text }),
            Err(error) => {
                self.tell(error.file, &error.reason);
                None
            }
        }
    }

    fn required(&mut self, name: &str, what: &str) -> Option<SourceText> {
        let file = self.folder.file(name);
        if !file.exists() {
            self.tell(file.to_string(), &format!("the file is missing: {what}"));
        }
        self.text(&file)
    }

    fn domain(&mut self) -> Option<Domain> {
        let source = self.required("domain.pddl", "it says types, predicates and actions")?;
        parse_domain(&source).map_err(|error| self.tell_pddl(&error)).ok().map(|read| read.value)
    }

    fn rules(&mut self, domain: &Domain) -> Vec<Axiom> {
        let source = self.text(&self.folder.file("completion.pddl"));
        let rules = source.map(|source| parse_rules(&source, domain));
        let told = rules.map(|rules| rules.map_err(|error| self.tell_pddl(&error)).ok());
        told.flatten().unwrap_or_default()
    }

    fn perception(&mut self, domain: &Domain) -> Option<Perception> {
        let source = self.required("perception.toml", "it says how objects and facts are seen")?;
        let checked = Perception::parse(&source.name, &source.text).and_then(|perception| {
            let checked = perception.check(domain);
            checked.map_err(|error| error.in_file(&source.name, &source.text))?;
            Ok(perception)
        });
        match checked {
            Ok(perception) => Some(perception),
            Err(PerceptionError::File(problems)) => {
                self.tell_problems(&self.folder.file("perception.toml"), &problems);
                None
            }
            Err(error @ (PerceptionError::Colour { .. } | PerceptionError::Value(_))) => {
                self.tell(source.name, &error.to_string());
                None
            }
        }
    }

    fn language(&mut self, domain: &Domain) -> Option<Language> {
        let file = self.folder.file("language.toml");
        let source = self.text(&file)?;
        let read = Language::from_toml(&source.name, &source.text).and_then(|language| {
            let Err(mismatch) = language.check(domain) else { return Ok(language) };
            let located = TomlFile::parse(&source.name, &source.text)?.located(mismatch);
            Err(vec![located])
        });
        read.map_err(|problems| self.tell_problems(&file, &problems)).ok()
    }

    fn skills(&mut self, domain: &Domain, is_simulated: bool) {
        let file = self.folder.file("skills.toml");
        let Some(source) = self.text(&file) else {
            if is_simulated {
                let what = "a robot needs it: [[action]] with name, preempt and sequence";
                self.tell(file.to_string(), &format!("the file is missing: {what}"));
            }
            return;
        };
        match SkillMap::parse(&source.name, &source.text, domain) {
            Ok(_) => {}
            Err(SkillMapError::Part(error)) => {
                self.tell(file.to_string(), &error.to_string());
            }
            Err(SkillMapError::File(mut problems)) => {
                problems.retain(|problem| problem.key != MISSING_ACTION);
                self.tell_problems(&file, &problems);
                let table = source.text.parse::<toml::Table>().unwrap_or_default();
                let entries = table.get("action").and_then(toml::Value::as_array);
                let named = |name: &str| {
                    let mut entries = entries.into_iter().flatten();
                    entries
                        .any(|entry| entry.get("name").and_then(toml::Value::as_str) == Some(name))
                };
                for action in domain.actions.iter().filter(|a| !named(a.name.as_str())) {
                    let name = &action.name;
                    self.findings.push(DomainFinding {
                        kind: DomainFindingKind::ActionWithoutSkill,
                        file: file.to_string(),
                        field: "action".to_owned(),
                        message: format!(
                            "the action {name} has no skills, so no plan with it can be carried out: \
                             add an [[action]] with name = \"{name}\", preempt and sequence"
                        ),
                    });
                }
            }
        }
    }

    fn problems(&mut self, domain: &Domain) {
        let folder = self.folder.below("problems");
        for name in folder.names(".pddl").unwrap_or_default() {
            let Some(source) = self.text(&folder.file(&name)) else { continue };
            if let Err(error) = parse_problem(&source, domain) {
                self.tell_pddl(&error);
            }
        }
    }
}
