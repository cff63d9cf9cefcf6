"""stub"""
from ahrs_fmu.export.variant import Variant


def page(variant: Variant) -> str:
    """stub"""
    return "<html></html>"
