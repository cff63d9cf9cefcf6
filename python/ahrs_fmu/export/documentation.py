"""The page ``documentation/index.html`` of an FMU."""

from ahrs_fmu.export.variant import Variant


def page(variant: Variant) -> str:
    """Text of the page."""
    return f"<!DOCTYPE html><title>{variant.descriptor.title}</title>\n"
