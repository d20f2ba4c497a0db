"""Input, times, errors, reports, files and settings: what all other modules use."""
