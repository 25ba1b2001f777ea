"""The simulated 34461A, a digital multimeter."""
