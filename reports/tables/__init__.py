"""Figures as rows: budgets, comparisons, summaries."""
