"""Co-simulation: anything that steps, alone or connected with others."""
