"""The paper on six-step drives."""
