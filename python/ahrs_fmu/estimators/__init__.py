"""The numpy back-end: one file per estimator, vectorised over any leading batch dimensions."""
