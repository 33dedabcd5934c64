//! What holds for the house as a whole: the order of its rooms, and what it depends on.

mod dependencies;
mod documents;
mod exceptions;
mod imports;
mod rooms;
