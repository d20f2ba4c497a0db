"""The version of the package, the same as in Cargo.toml."""

VERSION = "0.1.0"
