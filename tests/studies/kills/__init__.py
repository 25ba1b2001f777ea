"""A bench that is ended, disturbed and lied to in every manner, tried from outside: `python -m tests.studies.kills`."""
