"""Attitude estimators as FMI co-simulation components."""
