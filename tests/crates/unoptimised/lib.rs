//! Nothing: this package has tests alone (see its `Cargo.toml`).
