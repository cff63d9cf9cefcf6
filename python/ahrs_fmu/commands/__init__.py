"""The commands of ``ahrs-fmu``, one module per group; `ahrs_fmu.cli` assembles them."""
