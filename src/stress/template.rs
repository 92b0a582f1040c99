//! Problems of any size from a few lines of text: `stress.toml` of a domain folder.
//!
//! ```toml
//! objects = [{ each = ["i = 1..n"], text = "b{i} - block" }, { text = "arm - robot" }]
//! init    = [{ each = ["i = 1..n"], text = "(clear b{i})" }, { text = "(handempty arm)" }]
//! goal    = [{ each = ["i = 1..n-1"], text = "(on b{i} b{i+1})" }]
//! ```
//!
//! A line stands once, or once for each value of its counters; `{…}` is a sum of numbers and
//! counters, `n` is the size.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::mismatch::quoted;
use crate::pddl::{Domain, Problem, SourceText, parse_problem};
use crate::run::ConfigError;
use crate::settings::TomlFile;

/// Most lines that one rule may stand for.
const LINES_MAX: usize = 1_000_000;

/// How problems of a domain are made from a size.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Template {
    /// What is declared: `name - type`.
    objects: Vec<Rule>,
    /// Facts.
    init: Vec<Rule>,
    /// What must hold, all of it.
    goal: Vec<Rule>,
}

/// A line, or one for each value of its counters.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Rule {
    /// `i = 1..n`: both ends count; later counters may use earlier ones.
    #[serde(default)]
    each: Vec<String>,
    /// PDDL, with sums in braces.
    text: String,
}

impl Template {
    /// Reads a `stress.toml`.
    ///
    /// # Errors
    /// [`ConfigError::Problems`]: every unknown key and wrong value, with line and column.
    pub fn parse(file: &str, text: &str) -> Result<Self, ConfigError> {
        Ok(TomlFile::parse(file, text)?.read()?)
    }

    /// The problem of that size.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and the rule, or the place in the text that came of it.
    pub fn problem(&self, file: &str, domain: &Domain, size: u32) -> Result<Problem, ConfigError> {
        let section = |name: &str, rules: &[Rule]| {
            let mut lines = String::new();
            for rule in rules {
                rule.write(size, &mut lines).map_err(|message| {
                    let message = format!("{name}, {}: {message}", quoted(&rule.text));
                    ConfigError::Toml { path: file.to_owned(), message }
                })?;
            }
            Ok::<_, ConfigError>(lines)
        };
        let text = format!(
            "(define (problem size-{size}) (:domain {})\n(:objects\n{})\n(:init\n{})\n(:goal (and\n{})))\n",
            domain.name,
            section("objects", &self.objects)?,
            section("init", &self.init)?,
            section("goal", &self.goal)?,
        );
        let source = SourceText { name: format!("{file} (size {size})"), text };
        Ok(parse_problem(&source, domain)?.value)
    }
}

impl Rule {
    fn write(&self, size: u32, out: &mut String) -> Result<(), String> {
        let counters = self.each.iter().map(|text| Counter::parse(text));
        let counters = counters.collect::<Result<Vec<_>, _>>()?;
        let mut values = BTreeMap::from([("n", i64::from(size))]);
        let mut n_lines = 0;
        self.expand(&counters, &mut values, &mut n_lines, out)
    }

    fn expand<'a>(
        &self,
        counters: &[Counter<'a>],
        values: &mut BTreeMap<&'a str, i64>,
        n_lines: &mut usize,
        out: &mut String,
    ) -> Result<(), String> {
        let Some((counter, rest)) = counters.split_first() else {
            *n_lines += 1;
            if *n_lines > LINES_MAX {
                return Err(format!("more than {LINES_MAX} lines"));
            }
            return fill(&self.text, values, out);
        };
        let (first, last) = (sum(counter.first, values)?, sum(counter.last, values)?);
        for value in first..=last {
            values.insert(counter.name, value);
            self.expand(rest, values, n_lines, out)?;
        }
        values.remove(counter.name);
        Ok(())
    }
}

/// `name = first..last`.
struct Counter<'a> {
    name: &'a str,
    first: &'a str,
    last: &'a str,
}

impl<'a> Counter<'a> {
    fn parse(text: &'a str) -> Result<Self, String> {
        let parts = text.split_once('=').and_then(|(name, range)| {
            let (first, last) = range.split_once("..")?;
            Some(Self { name: name.trim(), first, last })
        });
        let is_new = |c: &Self| c.name != "n" && c.name.chars().all(char::is_alphabetic);
        parts
            .filter(|counter| is_new(counter) && !counter.name.is_empty())
            .ok_or_else(|| format!("expected a counter such as \"i = 1..n\", got {}", quoted(text)))
    }
}

/// Writes a line with its sums worked out.
fn fill(text: &str, values: &BTreeMap<&str, i64>, out: &mut String) -> Result<(), String> {
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        let Some((inside, after)) = after.split_once('}') else {
            return Err("a brace is not closed".to_owned());
        };
        out.push_str(before);
        // Writing to a string cannot fail.
        write!(out, "{}", sum(inside, values)?).map_err(|e| e.to_string())?;
        rest = after;
    }
    out.push_str(rest);
    out.push('\n');
    Ok(())
}

/// A sum such as `n-i+1`.
fn sum(text: &str, values: &BTreeMap<&str, i64>) -> Result<i64, String> {
    let mut total: i64 = 0;
    for part in text.replace('-', "+-").split('+').map(str::trim).filter(|p| !p.is_empty()) {
        let (sign, word) = match part.strip_prefix('-') {
            Some(word) => (-1, word.trim()),
            None => (1, part),
        };
        let value = word.parse().ok().or_else(|| values.get(word).copied());
        let value =
            value.ok_or_else(|| format!("expected a number or a counter, got {}", quoted(word)))?;
        total = total.saturating_add(sign * value);
    }
    Ok(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_misspelt_is_told_at_its_line() {
        let text = "objects = []\ninit = []\ngoal = [{ text = \"(on a b)\", eech = [] }]\n";
        let said = Template::parse("stress.toml", text).unwrap_err().to_string();
        let expected = "stress.toml:3:30: error: goal[0].eech: unknown key; did you mean each?";
        assert_eq!(said, expected);
    }

    fn line(rule: &str, size: u32) -> Result<String, String> {
        let rule: Rule = toml::from_str(rule).unwrap();
        let mut out = String::new();
        rule.write(size, &mut out).map(|()| out.replace('\n', " ").trim_end().to_owned())
    }

    #[test]
    fn rules_count_from_first_to_last() {
        let plain = line("text = \"(p)\"", 3).unwrap();
        assert_eq!(plain, "(p)");
        let chain = line("each = [\"i = 1..n-1\"]\ntext = \"(on b{i} b{i+1})\"", 3).unwrap();
        assert_eq!(chain, "(on b1 b2) (on b2 b3)");
        let pairs = "each = [\"i = 1..n\", \"j = i+1..n\"]\ntext = \"{j}{n-i}\"";
        assert_eq!(line(pairs, 3).unwrap(), "22 32 31");
        assert_eq!(line("each = [\"i = 2..1\"]\ntext = \"x\"", 3).unwrap(), "");
    }

    #[test]
    fn what_is_no_rule_is_told() {
        for (rule, why) in [
            ("each = [\"i in n\"]\ntext = \"x\"", "i = 1..n"),
            ("each = [\"n = 1..2\"]\ntext = \"x\"", "i = 1..n"),
            ("text = \"{i}\"", "\"i\""),
            ("text = \"{1\"", "not closed"),
            ("each = [\"i = 1..9999999\"]\ntext = \"x\"", "lines"),
        ] {
            let error = line(rule, 3).unwrap_err();
            assert!(error.contains(why), "{rule}: {error}");
        }
    }
}
