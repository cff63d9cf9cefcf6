"""Frequency domain: the theory of complementary filters, their design, and measured responses."""
