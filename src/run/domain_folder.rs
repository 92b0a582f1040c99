//! A domain folder: all that the loop knows of a task.

use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use super::{ConfigError, read_text};
use crate::goals::Language;
use crate::pddl::{Axiom, Domain, SourceText, parse_domain, parse_rules};
use crate::perception::Pipeline;
use crate::perception::grounders::Grounder;
use crate::perception::model::Perception;
use crate::skills::SkillMap;

/// The files of `domains/<name>/`, read and checked against one another.
#[derive(Debug, Clone)]
pub struct DomainFolder {
    /// The folder.
    pub path: PathBuf,
    /// `domain.pddl`.
    pub domain: Domain,
    /// Its text.
    pub domain_text: String,
    /// `completion.pddl`; no rules without the file.
    pub rules: Vec<Axiom>,
    /// `perception.toml`.
    pub perception: Perception,
    /// `language.toml`, where there is one.
    pub language: Option<Language>,
    /// `skills.toml`, where there is one.
    pub skills: Option<SkillMap>,
    /// Of all these files: both ends of a topic must use the same.
    pub hash: u64,
    /// Remarks of the PDDL parser.
    pub warnings: Vec<String>,
}

impl DomainFolder {
    /// Finds and reads a domain folder. `name` is a folder's path, or the name of a folder in
    /// `domains/` beside the run file's folder or in the working directory.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and line.
    pub fn find(name: &str, origin: &Path) -> Result<Self, ConfigError> {
        let beside = origin.parent().and_then(Path::parent).map(|p| p.join("domains").join(name));
        let candidates = [Some(PathBuf::from(name)), Some(Path::new("domains").join(name)), beside];
        let found = candidates.into_iter().flatten().find(|p| p.join("domain.pddl").is_file());
        match found {
            Some(path) => Self::read(&path),
            None => Err(ConfigError::Value {
                key: "domain".to_owned(),
                expected: "a folder with a domain.pddl, or the name of one in domains/".to_owned(),
                got: name.to_owned(),
            }),
        }
    }

    /// The way from detections to facts, with a grounder for this domain.
    pub fn pipeline<'a>(&'a self, grounder: &'a dyn Grounder) -> Pipeline<'a> {
        Pipeline {
            domain: &self.domain,
            perception: &self.perception,
            rules: &self.rules,
            grounder,
        }
    }

    /// Its scenes, for the simulator.
    #[cfg(feature = "sim")]
    pub fn scenes(&self) -> crate::hardware::sim::ScenesOf<'_> {
        let Self { path, domain, perception, .. } = self;
        crate::hardware::sim::ScenesOf { folder: path, domain, perception }
    }

    /// Reads a domain folder.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and line.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let mut hash = Sha256::new();
        let mut read = |file: &str| -> Result<Option<SourceText>, ConfigError> {
            let file = path.join(file);
            if !file.is_file() {
                return Ok(None);
            }
            let text = read_text(&file)?;
            hash.update(text.as_bytes());
            Ok(Some(SourceText { name: file.display().to_string(), text }))
        };
        let missing = |file: &str| ConfigError::File {
            path: path.join(file).display().to_string(),
            reason: "the domain folder needs this file".to_owned(),
        };
        let source = read("domain.pddl")?.ok_or_else(|| missing("domain.pddl"))?;
        let parsed = parse_domain(&source)?;
        let (domain, domain_text) = (parsed.value, source.text);
        let warnings = parsed.warnings.iter().map(|w| w.message.clone()).collect();
        let rules = match read("completion.pddl")? {
            Some(source) => parse_rules(&source, &domain)?,
            None => Vec::new(),
        };
        let source = read("perception.toml")?.ok_or_else(|| missing("perception.toml"))?;
        let perception = Perception::parse(&source.name, &source.text)?;
        perception.check(&domain)?;
        let language = match read("language.toml")? {
            Some(source) => Some(Language::from_toml(&source.name, &source.text)?),
            None => None,
        };
        let skills = match read("skills.toml")? {
            Some(source) => Some(SkillMap::parse(&source.name, &source.text, &domain)?),
            None => None,
        };
        let digest: [u8; 32] = hash.finalize().into();
        let [a, b, c, d, e, f, g, h, ..] = digest;
        let hash = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
        let path = path.to_owned();
        Ok(Self { path, domain, domain_text, rules, perception, language, skills, hash, warnings })
    }
}
