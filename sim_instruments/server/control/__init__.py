"""The control endpoint: hands, truth and faults of a served bench, as JSON over HTTP."""
