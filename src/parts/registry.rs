//! The table of a role.

use super::options::{OptionsSchema, PartOption, described};
use super::{PartChoice, PartContext, PartError, Role};
use crate::mismatch::Mismatch;
use crate::settings::default_options;

/// A part, as its file declares it.
pub struct Part<T: Role + ?Sized> {
    /// Its name in run files and flags; unique in its role.
    pub name: &'static str,
    /// What it is, in one line.
    pub help: &'static str,
    /// Keys that a run file may set, with their types.
    pub options: OptionsSchema,
    /// Makes it.
    pub build: fn(&PartContext<'_, T>) -> Result<Box<T>, PartError>,
}

impl<T: Role + ?Sized> Part<T> {
    /// Its options, in the order in which it declares them; those of a table follow the table.
    pub fn described(&self) -> Vec<PartOption> {
        described(self.options, &default_options(T::OPTIONS, self.name))
    }
}

/// Every part of a role, in alphabetical order.
pub struct Registry<T: Role + ?Sized + 'static>(pub &'static [Part<T>]);

impl<T: Role + ?Sized> std::fmt::Debug for Part<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Part").field("name", &self.name).finish_non_exhaustive()
    }
}

impl<T: Role + ?Sized> std::fmt::Debug for Registry<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.names()).finish()
    }
}

impl<T: Role + ?Sized> Registry<T> {
    /// The names of all parts.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.iter().map(|part| part.name)
    }

    /// The part of that name.
    pub fn get(&self, name: &str) -> Option<&'static Part<T>> {
        self.0.iter().find(|part| part.name == name)
    }

    /// The part of that name; `key` is what named it.
    ///
    /// # Errors
    /// [`PartError::Unknown`] with the names that there are.
    pub fn find(&self, key: &str, name: &str) -> Result<&'static Part<T>, PartError> {
        self.get(name).ok_or_else(|| {
            let known: Vec<&str> = self.names().collect();
            PartError::Unknown(Mismatch::new(key, known.join(" or "), name))
        })
    }

    /// Makes the part that the context names.
    ///
    /// # Errors
    /// [`PartError`]: there is no such part, it has no such option, or it cannot be made here.
    pub fn build(&self, context: &PartContext<'_, T>) -> Result<Box<T>, PartError> {
        let part = self.find(&context.choice.key, &context.choice.name)?;
        let PartChoice { name, file, options, .. } = context.choice;
        if let Some(key) = options.keys().next().filter(|_| part.described().is_empty()) {
            let kind = T::NAME;
            let message = format!("{}.{key}: the {kind} \"{name}\" has no options", T::OPTIONS);
            return Err(PartError::Options { file: file.clone(), message });
        }
        let built = (part.build)(context)?;
        // What reads no options by itself, such as a skill, has its keys checked here.
        let known: Vec<String> = part.described().into_iter().map(|option| option.name).collect();
        if let Some(key) = options.keys().find(|key| !known.contains(key)) {
            let expected = known.join(", ");
            let message = format!("{}.{key}: unknown key, expected {expected}", T::OPTIONS);
            return Err(PartError::Options { file: file.clone(), message });
        }
        Ok(built)
    }
}
