//! Rules for the repository as a whole: the order of modules, dependencies, and references in documents.

mod dependencies;
mod documents;
mod exceptions;
mod imports;
mod layers;
