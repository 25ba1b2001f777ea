"""The operator's panel in a browser: pages are views of journals, questions go over the runs' lines."""
