//! A domain folder: all that the loop knows of a task.

use std::path::Path;

use sha2::{Digest as _, Sha256};

use super::ConfigError;
use super::find::{find_domain, given_domain, no_domain};
use crate::files::Folder;
use crate::goals::Language;
use crate::pddl::{Axiom, Domain, SourceText, parse_domain, parse_rules};
use crate::perception::Pipeline;
use crate::perception::grounders::Grounder;
use crate::perception::model::Perception;
use crate::settings::TomlFile;
use crate::skills::SkillMap;

/// The files of `domains/<name>/`, read and checked against one another.
#[derive(Debug, Clone)]
pub struct DomainFolder {
    /// The folder.
    pub files: Folder,
    /// `domain.pddl`.
    pub domain: Domain,
    /// `domain.pddl` as it stands.
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
    /// Finds and reads a domain folder by its path or its name: beside the file that names it, in the
    /// working directory, or in the binary.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and line.
    pub fn find(name: &str, beside: &Folder) -> Result<Self, ConfigError> {
        match find_domain(name, beside) {
            Some(folder) => Self::read_files(&folder),
            None => Err(no_domain("domain", name)),
        }
    }

    /// Finds and reads a domain folder as it is given on the command line: its path, or the name of a
    /// shipped one.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and line.
    pub fn given(path: &Path) -> Result<Self, ConfigError> {
        Self::read_files(&given_domain(path)?)
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
        let Self { files, domain, perception, .. } = self;
        crate::hardware::sim::ScenesOf { folder: files, domain, perception }
    }

    /// Reads a domain folder on disk.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and line.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        Self::read_files(&Folder::Disk(path.to_owned()))
    }

    /// Reads a domain folder, on disk or in the binary.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and line.
    pub fn read_files(files: &Folder) -> Result<Self, ConfigError> {
        let mut hash = Sha256::new();
        let mut read = |name: &str| -> Result<Option<SourceText>, ConfigError> {
            let file = files.file(name);
            if !file.exists() {
                return Ok(None);
            }
            let is_pddl = Path::new(name).extension().is_some_and(|ending| ending == "pddl");
            let source = if is_pddl {
                SourceText::decode(file.to_string(), file.bytes()?)?
            } else {
                SourceText { name: file.to_string(), text: file.text()? }
            };
            hash.update(source.text.as_bytes());
            Ok(Some(source))
        };
        let missing = |file: &str| ConfigError::File {
            path: files.file(file).to_string(),
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
        let checked = perception.check(&domain);
        checked.map_err(|error| error.in_file(&source.name, &source.text))?;
        let language = match read("language.toml")? {
            Some(source) => Some(read_language(&source, &domain)?),
            None => None,
        };
        let skills = match read("skills.toml")? {
            Some(source) => Some(SkillMap::parse(&source.name, &source.text, &domain)?),
            None => None,
        };
        let digest: [u8; 32] = hash.finalize().into();
        let [a, b, c, d, e, f, g, h, ..] = digest;
        let hash = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
        let files = files.clone();
        Ok(Self { files, domain, domain_text, rules, perception, language, skills, hash, warnings })
    }
}

/// Reads `language.toml` and checks it against the domain.
fn read_language(source: &SourceText, domain: &Domain) -> Result<Language, ConfigError> {
    let language = Language::from_toml(&source.name, &source.text)?;
    if let Err(mismatch) = language.check(domain) {
        let file = TomlFile::parse(&source.name, &source.text)?;
        return Err(vec![file.located(mismatch)].into());
    }
    Ok(language)
}
