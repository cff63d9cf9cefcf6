"""From descriptors and C sources to headers, FMUs and documentation."""
