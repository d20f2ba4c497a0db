"""Input, times, errors, reports, files and settings, on which everything else builds."""

# As in Cargo.toml.
VERSION = "0.1.0"
