"""The Python side of an FMU whose model is a Python class: ``python -m ahrs_fmu.serve RESOURCES``.

The FMU's library starts this process and owns it; the other side is ``fmu_src/python_model``.
"""
