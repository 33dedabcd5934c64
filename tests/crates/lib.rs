//! Empty: this package contains only tests (see its `Cargo.toml`).
